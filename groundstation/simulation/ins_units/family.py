"""Family of flights that the comparison of several units is judged on.

It is written down in docs/evidence/units.md.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal, TypeAlias, get_args
from zlib import crc32

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.simulation.inertial_family import ORDINARY_RECEIVER
from groundstation.simulation.ins_units.settings import (
    AnyUnitFault,
    CommonErrors,
    GnssOutage,
    UnitAided,
    UnitClock,
    UnitDrift,
    UnitExchanged,
    UnitFrozen,
    UnitHeading,
    UnitOutput,
    UnitReset,
    UnitsSettings,
    UnitStep,
    UnitStuck,
    UnitSwapped,
    UnitTilt,
    UnitTwin,
    UnitWithoutPosition,
)
from groundstation.simulation.routes import RouteKind

GnssMode = Literal["with", "without", "outage"]
GNSS_MODES: tuple[GnssMode, ...] = get_args(GnssMode)
UNIT_NUMBERS = (2, 3)
ROUTES: tuple[RouteKind, ...] = ("straight", "manoeuvring", "out_and_back", "dogleg", "racetrack", "late_survey")
SHORTEST_S, LONGEST_S = 1800.0, 18_000.0
NAVIGATION_SHARE, COARSE_SHARE, OWN_SHARE, LATER_SHARE, STATED_SHARE = 0.6, 0.3, 0.5, 0.5, 2.0 / 3.0
SHORTEST_OUTAGE_S, LONGEST_OUTAGE = 300.0, 0.8  # the longest as a share of the flight
COARSE = UnitOutput(
    velocity_step_mps=0.0643, position_step_deg=180.0 / 2**20, heading_step_deg=180.0 / 2**15
)  # ARINC 429: 1/8 kt, labels 310 and 311, label 314
OTHER_CLASS = "tactical"
LATE_CLOCK = UnitClock(unit=1, late_s=0.5)

DrawFault: TypeAlias = Callable[[np.random.Generator, int, UnitsSettings], AnyUnitFault]


@dataclass(frozen=True)
class FaultCase:
    """Fault of a kind and size, drawn for one flight.

    Parameters
    ----------
    kind, size : str
    draw : callable
        Gives the fault from a generator, the number of the unit and the healthy flight.
    is_fault : bool
        False: input that is bad in other ways than a faulty unit.
    """

    kind: str
    size: str
    draw: DrawFault
    is_fault: bool = True

    @property
    def name(self) -> str:
        """Kind and size."""
        return f"{self.kind} {self.size}".strip()


def healthy_flight(seed: int, run: int) -> UnitsSettings:
    """Draw the settings of a healthy flight; run k is the same whatever else is drawn.

    Examples
    --------
    >>> [(healthy_flight(1, run).units, gnss_mode(healthy_flight(1, run))) for run in range(3)]
    [(2, 'with'), (3, 'with'), (2, 'without')]
    """
    rng = _generator(seed, run, "flight")
    mode = GNSS_MODES[run // len(UNIT_NUMBERS) % len(GNSS_MODES)]
    duration_s = float(np.round(rng.uniform(SHORTEST_S, LONGEST_S)))
    length_s = float(np.round(np.exp(rng.uniform(np.log(SHORTEST_OUTAGE_S), np.log(LONGEST_OUTAGE * duration_s)))))
    begin_s = float(np.round(rng.uniform(0.0, duration_s - length_s)))
    return UnitsSettings(
        units=UNIT_NUMBERS[run % len(UNIT_NUMBERS)],
        ins="navigation" if rng.random() < NAVIGATION_SHARE else "i-21",
        route=ROUTES[int(rng.integers(len(ROUTES)))],
        duration_s=duration_s,
        each_its_own=bool(rng.random() < OWN_SHARE),
        has_gnss=mode != "without",
        outages=(GnssOutage(begin_s, begin_s + length_s),) if mode == "outage" else (),
        output=COARSE if rng.random() < COARSE_SHARE else UnitOutput(),
        states_start=bool(rng.random() < STATED_SHARE),
    )


def gnss_mode(flight: UnitsSettings) -> GnssMode:
    """Return the GNSS mode of a flight."""
    if not flight.has_gnss:
        return "without"
    return "outage" if flight.outages else "with"


def faulty_flight(case: FaultCase, seed: int, run: int) -> UnitsSettings:
    """Return the healthy flight of a run with a fault in one of its units."""
    flight = healthy_flight(seed, run)
    rng = _generator(seed, run, "fault", case.name)
    unit = 1 + int(rng.integers(flight.units))
    return replace(flight, faults=(case.draw(rng, unit, flight),))


def _generator(seed: int, run: int, *names: str) -> np.random.Generator:
    key = (run, *(crc32(name.encode()) for name in ("units family", *names)))
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def _drift(times: float) -> DrawFault:
    def draw(rng: np.random.Generator, unit: int, flight: UnitsSettings) -> AnyUnitFault:
        later, begin, direction = rng.random() < LATER_SHARE, rng.uniform(0.1, 0.6), rng.uniform(0.0, 360.0)
        return UnitDrift(
            unit=unit, times=times, direction_deg=direction, at_s=begin * flight.duration_s if later else 0.0
        )

    return draw


def _tilt(times: float) -> DrawFault:
    return lambda rng, unit, _flight: UnitTilt(unit=unit, times=times, direction_deg=rng.uniform(0.0, 360.0))


def _begin(rng: np.random.Generator, flight: UnitsSettings) -> float:
    return float(np.round(rng.uniform(0.1, 0.9) * flight.duration_s))


def _step(size: float, what: Literal["m", "mps"]) -> DrawFault:
    def draw(rng: np.random.Generator, unit: int, flight: UnitsSettings) -> AnyUnitFault:
        at_s, direction = _begin(rng, flight), rng.uniform(0.0, 2.0 * np.pi)
        north, east = size * np.cos(direction), size * np.sin(direction)
        if what == "m":
            return UnitStep(unit=unit, at_s=at_s, north_m=north, east_m=east)
        return UnitStep(unit=unit, at_s=at_s, north_mps=north, east_mps=east)

    return draw


def _span(rng: np.random.Generator, length_s: float, flight: UnitsSettings) -> tuple[float, float]:
    first = 0.1 * flight.duration_s
    begin = float(np.round(rng.uniform(first, max(0.9 * flight.duration_s - length_s, first))))
    return begin, begin + length_s


def _stuck(length_s: float) -> DrawFault:
    def draw(rng: np.random.Generator, unit: int, flight: UnitsSettings) -> AnyUnitFault:
        axes: tuple[Literal["north", "east", "both"], ...] = ("north", "east", "both")
        axis = axes[int(rng.integers(len(axes)))]
        begin, end = _span(rng, length_s, flight)
        return UnitStuck(unit=unit, from_s=begin, to_s=end, axis=axis)

    return draw


def _frozen(length_s: float) -> DrawFault:
    def draw(rng: np.random.Generator, unit: int, flight: UnitsSettings) -> AnyUnitFault:
        begin, end = _span(rng, length_s, flight)
        return UnitFrozen(unit=unit, from_s=begin, to_s=end)

    return draw


def _heading(offset_deg: float) -> DrawFault:
    return lambda rng, unit, _flight: UnitHeading(unit=unit, offset_deg=offset_deg * float(rng.choice((-1.0, 1.0))))


def _twin(_rng: np.random.Generator, unit: int, _flight: UnitsSettings) -> AnyUnitFault:
    return UnitTwin(unit=unit, of=1 if unit != 1 else 2)


FAULT_CASES: tuple[FaultCase, ...] = (
    *(FaultCase("drift", f"{times:g}", _drift(times)) for times in (2.0, 4.0, 8.0)),
    *(FaultCase("tilt", f"{times:g}", _tilt(times)) for times in (2.0, 4.0, 8.0)),
    *(FaultCase("step", f"{size:g} m", _step(size, "m")) for size in (100.0, 300.0, 1000.0)),
    *(FaultCase("step", f"{size:g} m/s", _step(size, "mps")) for size in (0.5, 1.0, 3.0)),
    FaultCase("reset", "", lambda rng, unit, flight: UnitReset(unit=unit, at_s=_begin(rng, flight))),
    FaultCase("swapped", "", lambda _rng, unit, _flight: UnitSwapped(unit=unit)),
    *(FaultCase("stuck", f"{length_s:g} s", _stuck(length_s)) for length_s in (60.0, 300.0, 1200.0)),
    *(FaultCase("frozen", f"{length_s:g} s", _frozen(length_s)) for length_s in (60.0, 300.0)),
    *(FaultCase("heading", f"{offset:g} deg", _heading(offset)) for offset in (0.2, 0.5, 2.0)),
)
BAD_INPUTS: tuple[FaultCase, ...] = (
    FaultCase("clock", "0.5 s", lambda _rng, unit, _flight: UnitClock(unit=unit, late_s=0.5), is_fault=False),
    FaultCase("clock", "5 s", lambda _rng, unit, _flight: UnitClock(unit=unit, late_s=5.0), is_fault=False),
    FaultCase("clock", "40 ppm", lambda _rng, unit, _flight: UnitClock(unit=unit, rate_ppm=-40.0), is_fault=False),
    FaultCase("no position", "", lambda _rng, unit, _flight: UnitWithoutPosition(unit=unit), is_fault=False),
    FaultCase("aided", "", lambda _rng, unit, _flight: UnitAided(unit=unit), is_fault=False),
    FaultCase("twin", "", _twin, is_fault=False),
    FaultCase(
        "exchanged", "", lambda rng, unit, flight: UnitExchanged(unit=unit, at_s=_begin(rng, flight)), is_fault=False
    ),
)


def _late_but_the_first(flight: UnitsSettings) -> UnitsSettings:
    return replace(flight, faults=tuple(replace(LATE_CLOCK, unit=unit) for unit in range(2, flight.units + 1)))


BROKEN: Mapping[str, Callable[[UnitsSettings], UnitsSettings]] = MappingProxyType(
    {
        "gnss_correlated": lambda flight: replace(
            flight, gnss=replace(ORDINARY_RECEIVER, position_correlated_m=10.0, position_correlation_s=300.0)
        ),
        "common_alignment": lambda flight: replace(flight, common=CommonErrors(tilt_times=2.0, azimuth_deg=0.1)),
        "anomalies": lambda flight: replace(flight, common=CommonErrors(deflection_arcsec=20.0, deflection_km=20.0)),
        "heavy_tails": lambda flight: replace(flight, common=CommonErrors(heavy_tail_freedom=3)),
        "clocks": _late_but_the_first,
        "two_classes": lambda flight: replace(flight, ins_of_others=OTHER_CLASS),
    }
)
