"""Flights for the magnetic estimator made by formulas: attitude by turn after turn, the field through known iron."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.signal import lfilter

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.declination import declination_along
from groundstation.base.records import Column
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import MPS2_PER_G, NS_PER_S
from groundstation.methods.harmonics import fit
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.magnetic.attitude import field_in_body, levelled_heading_deg
from groundstation.tables.phases import PhaseInterval, Phases
from groundstation.tables.table import Flight, Table

START_NS = iso_to_utc_ns("2026-05-09T08:00:00Z")[0]
STEP_S = 0.1
SPEED_MPS = 60.0
BANK_RATE_DPS = 8.0
LATITUDE_DEG, LONGITUDE_DEG, ALTITUDE_M = 55.97, 37.41, 1400.0
LEVEL = tuple((0.0, turn) for turn in (40.0, 75.0, -130.0, 160.0, 95.0, -60.0, 110.0))
EIGHT = ((20.0, 380.0), (-20.0, -380.0))
HARD_NT = (900.0, -1100.0, 400.0)
SOFT = ((1.01, 0.004, 0.002), (0.006, 0.985, -0.004), (0.003, -0.002, 1.0))


@dataclass(frozen=True)
class Case:
    """A flight to be made: turns as (bank, degrees turned), a bank of 0 standing for an everyday turn at 12 deg."""

    turns: Sequence[tuple[float, float]] = (*LEVEL[:4], *EIGHT, *LEVEL[4:])
    hard_nt: tuple[float, float, float] = HARD_NT
    soft: tuple[tuple[float, float, float], ...] = SOFT
    ins_error_deg: float = 0.0
    declination_error_deg: float = 0.0
    field_error_nt: tuple[float, float] = (0.0, 0.0)
    heading_noise_deg: float = 0.0
    attitude_noise_deg: float = 0.0
    field_noise_nt: float = 0.0
    bank_sway_deg: float = 0.0
    turn_world_deg: float = 0.0
    latency_s: float = 0.0
    current_nt_per_a: tuple[float, float, float] | None = None
    altitude_m: float = ALTITUDE_M
    seed: int = 1


@dataclass(frozen=True)
class Made:
    """The flight, and the truth: declination and field at the place, A to E of level flight."""

    flight: Flight
    declination_deg: float
    horizontal_nt: float
    down_nt: float
    coefficients_deg: np.ndarray
    phases: Phases


def make(**changes: Any) -> Made:
    """Make a flight; the INS heading is wrong by ``ins_error_deg``.

    The model's declination lacks ``declination_error_deg``, its H and Z lack ``field_error_nt``.
    """
    case = replace(Case(), **changes)
    rng = np.random.default_rng(case.seed)
    roll, heading = motion(case, rng)
    time_s = np.arange(len(roll)) * STEP_S
    pitch = 2.0 + 0.5 * np.sin(2.0 * np.pi * time_s / 40.0) * (case.bank_sway_deg > 0.0)
    place = np.full(1, LATITUDE_DEG), np.full(1, LONGITUDE_DEG), np.full(1, case.altitude_m)
    earth = declination_along(*place, START_NS)
    horizontal = float(earth.horizontal_nt[0]) + case.field_error_nt[0]
    down = float(earth.down_nt[0]) + case.field_error_nt[1]
    magnetic = heading - float(earth.values_deg[0]) - case.declination_error_deg
    field = field_in_body(horizontal, down, magnetic, roll, pitch)
    reading = field @ np.array(case.soft).T + np.array(case.hard_nt)
    current = 40.0 + 25.0 * np.sign(np.sin(2.0 * np.pi * time_s / 37.0))
    if case.current_nt_per_a is not None:
        reading = reading + np.outer(current - 40.0, case.current_nt_per_a)
    reading = reading + case.field_noise_nt * correlated(rng, reading.shape, 1.0)
    time_ns = START_NS + np.arange(len(roll)) * round(STEP_S * NS_PER_S)
    noise = case.attitude_noise_deg * correlated(rng, (len(roll), 2), 5.0)
    ins = {
        "roll_deg": wrap_180(roll + noise[:, 0]),
        "pitch_deg": pitch + noise[:, 1],
        "true_heading_deg": wrap_360(
            heading + case.ins_error_deg + case.heading_noise_deg * correlated(rng, (len(roll), 1), 5.0)[:, 0]
        ),
        "latitude_deg": np.full(len(roll), LATITUDE_DEG),
        "longitude_deg": np.full(len(roll), LONGITUDE_DEG),
        "altitude_ellipsoid_m": np.full(len(roll), case.altitude_m),
    }
    axes = dict(zip(("field_forward_nt", "field_right_nt", "field_down_nt"), reading.T, strict=True))
    tables = {
        "ins": table("ins", time_ns, ins),
        "magnetometer": table("magnetometer", time_ns + round(case.latency_s * NS_PER_S), axes),
    }
    if case.current_nt_per_a is not None:
        tables["electric"] = table("electric", time_ns, {"current_a": current})
    flight = Flight(tables, {"aircraft": "SIM-3"}, START_NS, True, "made.csv")
    phases = Phases((PhaseInterval(0.0, flight.duration_s, "airborne"),), "made")
    values = level_truth(case, horizontal, down)
    return Made(flight, float(earth.values_deg[0]), horizontal, down, values, phases)


def motion(case: Case, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Roll and heading, shapes (n,): coordinated turns with straight flight of 25 s between them."""
    bank_parts = [np.zeros(round(20.0 / STEP_S))]
    for bank, turned in case.turns:
        steep = abs(bank) or 12.0
        sign = np.sign(turned)
        rate = np.rad2deg(MPS2_PER_G * np.tan(np.deg2rad(steep)) / SPEED_MPS)
        ramp = np.arange(0.0, steep, BANK_RATE_DPS * STEP_S)
        held = max(round(abs(turned) / rate / STEP_S) - len(ramp), 1)
        bank_parts += [sign * ramp, np.full(held, sign * steep), sign * ramp[::-1], np.zeros(round(25.0 / STEP_S))]
    roll = np.concatenate(bank_parts)
    roll = roll + case.bank_sway_deg * correlated(rng, (len(roll), 1), 3.0)[:, 0]
    rate = np.rad2deg(MPS2_PER_G * np.tan(np.deg2rad(roll)) / SPEED_MPS)
    return roll, 17.0 + case.turn_world_deg + np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * STEP_S)])


def correlated(rng: np.random.Generator, shape: tuple[int, ...], time_s: float) -> np.ndarray:
    """First-order Gauss-Markov noise of unit variance along the first axis."""
    keep = np.exp(-STEP_S / time_s)
    white = rng.standard_normal(shape) * np.sqrt(1.0 - keep**2)
    white[0] = rng.standard_normal(shape[1:])
    return np.asarray(lfilter([1.0], [1.0, -keep], white, axis=0))


def level_truth(case: Case, horizontal_nt: float, down_nt: float) -> np.ndarray:
    """A to E of level flight that the iron of a case makes, declination removed, the errors of INS and model not in."""
    heading = np.arange(0.0, 360.0, 0.25)
    level, pitch = np.zeros(len(heading)), np.full(len(heading), 2.0)
    field = field_in_body(horizontal_nt, down_nt, heading, level, pitch)
    shown = levelled_heading_deg(field @ np.array(case.soft).T + np.array(case.hard_nt), level, pitch)
    error, order = wrap_180(shown - heading), np.argsort(shown)
    centres = np.arange(360.0) + 0.5
    return fit(centres, np.interp(centres, shown[order], error[order], period=360.0))[0]


def table(topic: str, time_ns: np.ndarray, columns: dict[str, np.ndarray]) -> Table:
    """A table of plain columns."""
    rows = np.arange(len(time_ns))
    return Table(topic, time_ns, {name: Column(values) for name, values in columns.items()}, rows, Column(time_ns))


def taxi_heading(**changes: Any) -> HeadingResult:
    """Answer of the heading analysis as if taxi had found nothing wrong, 0.1 deg sigma, at the start of the flight."""
    answer = HeadingResult(
        *("ins", "gnss", "true heading", "accept", "", 0.0, 0.1, (-0.2, 0.2), 0.0, 0.1, 0.1, 0.1),
        *(100, 60.0, None, None, 0.0, 0.01, (), None, ()),
        reference_time_s=0.0,
    )  # fmt: skip
    return replace(answer, **changes)
