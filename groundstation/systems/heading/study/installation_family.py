"""Fleets of docs/evidence/installation.md.

Aircraft with mountings, factors and winds, and what their flights show.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.results.installations import Lesson
from groundstation.systems.heading.gates_answer import CURED_BY_MORE_DATA, WHOLE
from groundstation.systems.heading.installation.settings import (
    MOUNTING_DEG,
    ORDINARY_WIND_MPS,
    STEADY_DEG,
    alignment_sigma_deg,
)
from groundstation.systems.heading.steady import FACTORS
from groundstation.systems.heading.study.installation_pool import TaxiOfPool
from groundstation.systems.known import AircraftClass

AIRCRAFT, FLIGHTS = 100, 6
CLASSES: tuple[AircraftClass, ...] = ("light", "jet trainer", "business jet", "airliner")
FACTOR_SPREAD = 0.5  # sigma of the logarithm
WIND_MPS, METAR_MPS = 3.6, 1.5
TURNED_DEG = 180.0
LIMIT_DEG = 1.0 / 3.0


@dataclass(frozen=True)
class FamilyOfFleets:
    """One family: the knowledge of its flights, and what is different."""

    name: str
    alignment: str = "stored heading"
    has_azimuth: bool = True
    has_metar: bool = True
    is_class_stated: bool = True
    change: str = ""  # told, not told, turned, two units, mistyped
    has_one_engine: bool = False
    has_stand: bool = False


FAMILIES: tuple[FamilyOfFleets, ...] = (
    FamilyOfFleets("stored, azimuth, METAR"),
    FamilyOfFleets("stored, azimuth", has_metar=False),
    FamilyOfFleets("stored alone", has_azimuth=False),
    FamilyOfFleets("gyrocompass, METAR", "gyrocompass", has_azimuth=False),
    FamilyOfFleets("gyrocompass", "gyrocompass", has_azimuth=False, has_metar=False),
    FamilyOfFleets("replaced, told", change="told"),
    FamilyOfFleets("replaced, not told", change="not told"),
    FamilyOfFleets("turned", change="turned"),
    FamilyOfFleets("two units, one serial", change="two units"),
    FamilyOfFleets("mistyped", change="mistyped"),
    FamilyOfFleets("class not stated", is_class_stated=False),
    FamilyOfFleets("one engine", has_one_engine=True),
    FamilyOfFleets("stand", has_stand=True),
)


@dataclass(frozen=True)
class FlownFlight:
    """Flight of a fleet: what it shows, and the truth.

    ``since_change``: for how many flights another unit has flown, 0 where none has.
    """

    lesson: Lesson
    taxi: TaxiOfPool
    airframe_deg: float
    platform_deg: float
    since_change: int


def draw_fleet(number: int, seed: int, pool: Sequence[TaxiOfPool], aircraft: int = AIRCRAFT) -> list[list[FlownFlight]]:
    """Draw the aircraft of a family, each with its flights in order of time.

    ``number`` is that of the family in :data:`FAMILIES`.
    """
    return [_aircraft(number, seed, place, pool) for place in range(aircraft)]


@dataclass(frozen=True)
class _Airframe:
    """One aircraft as it is; ``mountings_deg`` are those of its first and second unit."""

    kind: AircraftClass
    factor: float
    steady_deg: float
    mountings_deg: NDArray[np.float64]
    units: NDArray[np.int64]


@dataclass(frozen=True)
class _Day:
    """One flight as drawn: winds from the right as blown and as told, alignment, sights."""

    crosswind_mps: float
    told_mps: float
    alignment_deg: float
    azimuth_sigma_deg: float
    azimuth_deg: float
    has_turns: bool
    stand_deg: float


def _aircraft(number: int, seed: int, place: int, pool: Sequence[TaxiOfPool]) -> list[FlownFlight]:
    family, rng = FAMILIES[number], np.random.default_rng((seed, number + 1, place))
    airframe = _draw_airframe(family, rng)
    taxis = rng.choice(len(pool), FLIGHTS, replace=False)
    flown, since = [], 0
    for flight in range(FLIGHTS):
        taxi, day, unit = pool[int(taxis[flight])], _draw_day(family, rng), int(airframe.units[flight])
        is_after = (family.change in ("told", "not told", "turned") and unit == 1) or since > 0
        since += family.change != "" and (is_after or unit == 1)
        heading_deg = day.alignment_deg + float(airframe.mountings_deg[unit])
        lesson = _lesson(family, airframe, taxi, day, heading_deg)
        named = replace(
            lesson,
            flight_id=f"{place:03d}-{flight + 1}",
            aircraft=f"A{place:03d}",
            ins_serial=f"S{place:03d}" + ("b" if family.change == "told" and unit else ""),
            start_utc=f"2026-05-{flight + 1:02d}T06:00:00Z",
        )
        flown.append(FlownFlight(named, taxi, heading_deg, day.alignment_deg, since))
    return flown


def _draw_airframe(family: FamilyOfFleets, rng: np.random.Generator) -> _Airframe:
    kind: AircraftClass = CLASSES[int(rng.integers(len(CLASSES)))]
    factor = FACTORS[kind][0] * float(np.exp(FACTOR_SPREAD * rng.standard_normal()))
    steady = float(rng.normal(0.0, STEADY_DEG))
    if family.has_one_engine:
        steady = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.15, 0.4))
    mountings = rng.normal(0.0, MOUNTING_DEG, 2)
    if family.change == "turned":
        mountings[1] = mountings[0] + TURNED_DEG
    return _Airframe(kind, factor, steady, mountings, _units(family.change, rng))


def _draw_day(family: FamilyOfFleets, rng: np.random.Generator) -> _Day:
    track_rad = float(rng.uniform(0.0, 2.0 * np.pi))
    wind, error = rng.normal(0.0, WIND_MPS, 2), rng.normal(0.0, METAR_MPS, 2)
    crosswind, told = (_from_right(one, track_rad) for one in (wind, wind + error))
    alignment = float(rng.normal(0.0, alignment_sigma_deg(family.alignment)))
    azimuth_sigma = float(rng.uniform(0.02, 0.05))
    azimuth = alignment + float(rng.normal(0.0, azimuth_sigma))
    has_turns, stand = bool(rng.random() >= 0.2), float(rng.normal(0.0, 0.05))
    return _Day(crosswind, told, alignment, azimuth_sigma, azimuth, has_turns, stand)


def _lesson(family: FamilyOfFleets, airframe: _Airframe, taxi: TaxiOfPool, day: _Day, heading_deg: float) -> Lesson:
    """Return the lesson of a flight, not yet named.

    ``heading_deg`` is the true error of its airframe.
    """
    factor, factor_sigma = FACTORS[airframe.kind if family.is_class_stated else ""]
    half_width = _alone_half_width(taxi, (factor, factor_sigma), day.told_mps, family.has_metar)
    shown = heading_deg + airframe.steady_deg + airframe.factor * day.crosswind_mps + taxi.error_deg
    told_mps = day.told_mps if family.has_metar else 0.0
    has_azimuth = family.has_azimuth and day.has_turns
    return Lesson(
        *("", "", "", ""),
        number_deg=shown,
        taxi_sigma_deg=taxi_sigma(taxi),
        crosswind_mps=told_mps,
        crosswind_sigma_mps=METAR_MPS if family.has_metar else ORDINARY_WIND_MPS,
        alignment=family.alignment,
        alignment_sigma_deg=alignment_sigma_deg(family.alignment),
        azimuth_deg=day.azimuth_deg if has_azimuth else None,
        azimuth_sigma_deg=day.azimuth_sigma_deg if has_azimuth else None,
        reference_deg=heading_deg + day.stand_deg if family.has_stand else None,
        reference_sigma_deg=0.05 if family.has_stand else None,
        aircraft_class=airframe.kind if family.is_class_stated else "",
        factor=factor,
        factor_sigma=factor_sigma,
        steady_sigma_deg=STEADY_DEG,
        mounting_sigma_deg=MOUNTING_DEG,
        verdict=_verdict(taxi, half_width),
        failed=(*taxi.failed, *([WHOLE] if half_width > LIMIT_DEG else [])),
        error_deg=shown - factor * told_mps,
        half_width_deg=half_width,
        platform_error_deg=shown - factor * told_mps,
        limit_deg=LIMIT_DEG,
    )


def taxi_sigma(taxi: TaxiOfPool) -> float:
    """Return the sigma of a normal distribution with the half width of this taxi alone."""
    return taxi.half_width_deg / NORMAL_95


def _verdict(taxi: TaxiOfPool, half_width_deg: float) -> str:
    """Return the verdict by this taxi alone."""
    if set(taxi.failed) - CURED_BY_MORE_DATA:
        return "reject"
    if taxi.failed:
        return "extend"
    return "accept" if half_width_deg <= LIMIT_DEG else "advisory"


def _alone_half_width(taxi: TaxiOfPool, stated: tuple[float, float], told_mps: float, has_metar: bool) -> float:
    """Return the half width of the whole interval by this taxi alone."""
    usual = float(np.hypot(*stated)) * (METAR_MPS if has_metar else ORDINARY_WIND_MPS)
    wind = np.hypot(stated[1] * told_mps if has_metar else 0.0, usual)
    return NORMAL_95 * float(np.sqrt(taxi_sigma(taxi) ** 2 + wind**2 + STEADY_DEG**2))


def _units(change: str, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw which of two units flies each flight."""
    from_flight, odd = int(rng.integers(2, 5)), int(rng.integers(1, 5))
    either = rng.integers(0, 2, FLIGHTS)
    flights = np.arange(FLIGHTS)
    if change in ("told", "not told", "turned"):
        return np.asarray(flights >= from_flight, dtype=np.int64)
    if change == "two units":
        return np.asarray(either, dtype=np.int64)
    if change == "mistyped":
        return np.asarray(flights == odd, dtype=np.int64)
    return np.zeros(FLIGHTS, dtype=np.int64)


def _from_right(wind_mps: NDArray[np.float64], track_rad: float) -> float:
    """Return the wind across a path from the right, m/s, from its north and east components."""
    return float(wind_mps[0] * np.sin(track_rad) - wind_mps[1] * np.cos(track_rad))
