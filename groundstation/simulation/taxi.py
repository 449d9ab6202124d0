"""Taxi runs before take-off: heading, GNSS velocity and the truth.

They are of the family of docs/evidence/heading.md.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.records import BoolArray, Column, frozen
from groundstation.base.units import NS_PER_S
from groundstation.simulation.processes import damped_oscillation, gauss_markov
from groundstation.simulation.taxi_disturbance import (
    KINDS,
    NO_DISTURBANCE,
    Disturbance,
    draw_disturbance,
    draw_wind,
    turns_of,
)
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]
Family = Literal["grid", "continuous", "wide"]

INS_RATE_HZ = 50
GNSS_EVERY = 5  # INS steps per GNSS epoch: 10 Hz
FASTEST_GATED_MPS = 6.0
QUIET_SHARE = 0.5  # share of family wide with receivers good enough for the gate at standstill
AIRFIELD_DEG = (59.8, 179.999)  # beside the date line: the wrap is met in every test
START_OF_DAY_NS = 1_777_874_400 * NS_PER_S  # 2026-05-04T06:00:00Z


@dataclass(frozen=True)
class TaxiCase:
    """Parameters of one simulated taxi run.

    docs/evidence/heading.md tells what each is and how it is drawn. Times are in seconds, angles in degrees, speeds in
    m/s, ``drift_deg_per_h`` in degrees an hour. ``segments_s`` are the lengths above 6 m/s, ``turns_deg`` (one fewer)
    the turns between them, ``curve_dps`` the rate of a gentle 10-s curve in the longest segment (0: none).
    """

    heading_error_deg: float = 0.8
    drift_deg_per_h: float = 0.05
    standstill_s: float = 60.0
    first_track_deg: float = 40.0
    segments_s: tuple[float, ...] = (60.0,)
    turns_deg: tuple[float, ...] = ()
    turn_rate_dps: float = 8.0
    curve_dps: float = 0.0
    cruise_mps: float = 8.0
    speed_wander_mps: float = 0.3
    sway_sigma_deg: float = 0.5
    sway_hz: float = 0.4
    sway_damping: float = 0.1
    steering_sigma_deg: float = 0.4
    steering_hz: float = 0.05
    white_mps: float = 0.05
    correlated_mps: float = 0.03
    correlation_s: float = 3.0
    antenna_arm_m: float = 4.0
    is_arm_known: bool = True
    heading_noise_deg: float = 0.005
    heading_resolution_deg: float = 0.005
    disturbance: Disturbance = NO_DISTURBANCE


def noiseless(case: TaxiCase) -> TaxiCase:
    """Return the same run without sway, steering, speed wander and sensor noise.

    The run is then exact.
    """
    return replace(
        case,
        speed_wander_mps=0.0,
        sway_sigma_deg=0.0,
        steering_sigma_deg=0.0,
        white_mps=0.0,
        correlated_mps=0.0,
        heading_noise_deg=0.0,
        heading_resolution_deg=0.0,
    )


@dataclass(frozen=True)
class TaxiRun:
    """One simulated run; arrays are read-only.

    Time runs from 0 at the first sample of standstill.

    Parameters
    ----------
    ins_time_s, ins_heading_deg, heading_deg : ndarray, shape (n,)
        50 Hz: what the INS shows, and the true heading.
    ins_error_deg : ndarray, shape (n,)
        INS heading minus true heading, without noise, rounding and wander about the error.
    on_ground : ndarray of bool, shape (m,)
        Weight on wheels at the GNSS times.
    gnss_time_s, velocity_north_mps, velocity_east_mps : ndarray, shape (m,)
        10 Hz.
    taxi_start_s : float
        End of the standstill.
    """

    case: TaxiCase
    ins_time_s: FloatArray
    ins_heading_deg: FloatArray
    heading_deg: FloatArray
    ins_error_deg: FloatArray
    gnss_time_s: FloatArray
    velocity_north_mps: FloatArray
    velocity_east_mps: FloatArray
    on_ground: BoolArray
    taxi_start_s: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                object.__setattr__(self, name, frozen(value))

    def error_at(self, time_s: float) -> float:
        """True INS heading error, degrees, at a time."""
        return float(np.interp(time_s, self.ins_time_s, self.ins_error_deg))


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_run(family: Family, seed: int, number: int) -> "TaxiRun":
    """Draw run ``number`` of a seed of a family.

    Runs of family wide go through its cells one after the other.
    """
    rng = np.random.default_rng((seed, number))
    case = draw_case(rng, family)
    if family == "wide":
        kind = KINDS[number % len(KINDS)]
        case = replace(case, disturbance=draw_disturbance(rng, kind), turns_deg=turns_of(kind, rng, case.turns_deg))
        if rng.random() < QUIET_SHARE:
            quiet, white = float(rng.uniform(0.003, 0.015)), float(rng.uniform(0.01, 0.04))
            case = replace(case, correlated_mps=quiet, white_mps=white)
        case = replace(case, disturbance=draw_wind(rng, case.disturbance))
    return simulate_taxi(case, rng)


def draw_case(rng: np.random.Generator, family: Family) -> TaxiCase:
    """Draw the parameters of one run from a family of docs/evidence/heading.md, undisturbed."""
    grid = family == "grid"
    if grid:
        total_s = float(rng.choice([20.0, 40.0, 60.0, 90.0, 120.0]))
    else:
        total_s = 20.0 if rng.random() < 0.25 else float(rng.uniform(20.0, 120.0))
    count = min(int(rng.integers(1, 5)), int(total_s // 10.0))
    segments = 8.0 + (total_s - 8.0 * count) * rng.dirichlet(np.full(count, 4.0))
    is_back = rng.random(count - 1) < 0.25
    turns = rng.choice([-1.0, 1.0], count - 1) * np.where(is_back, 180.0, rng.uniform(60.0, 120.0, count - 1))
    has_curve = rng.random() < 0.3
    curve = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 0.8))
    return TaxiCase(
        heading_error_deg=float(rng.normal(0.0, 1.0)),
        drift_deg_per_h=float(rng.choice([-1.0, 1.0])) * _log_uniform(rng, 0.01, 0.1),
        standstill_s=_log_uniform(rng, 30.0, 300.0),
        first_track_deg=float(rng.uniform(0.0, 360.0)),
        segments_s=tuple(float(length) for length in segments),
        turns_deg=tuple(float(turn) for turn in turns),
        turn_rate_dps=float(rng.uniform(6.0, 12.0)),
        curve_dps=curve if has_curve else 0.0,
        cruise_mps=float(rng.triangular(6.5, 8.0, 15.0)),
        sway_sigma_deg=0.5 if grid else float(rng.uniform(0.25, 0.75)),
        sway_hz=float(rng.uniform(0.2, 0.6)),
        sway_damping=float(rng.choice([0.02, 0.1, 0.2, 0.5])) if grid else _log_uniform(rng, 0.02, 0.5),
        steering_sigma_deg=0.4 if grid else float(rng.uniform(0.1, 0.8)),
        steering_hz=0.05 if grid else float(rng.uniform(0.03, 0.08)),
        white_mps=0.05 if grid else float(rng.uniform(0.03, 0.07)),
        correlated_mps=float(rng.uniform(0.02, 0.05)),
        correlation_s=float(rng.choice([1.0, 3.0, 10.0])) if grid else _log_uniform(rng, 1.0, 10.0),
        antenna_arm_m=float(rng.uniform(3.0, 5.0)),
        is_arm_known=bool(rng.random() < 0.5),
    )


ACCELERATION_MPS2, BRAKING_MPS2, TURNING_MPS = 1.0, 1.2, 5.0
ROLL_OUT_MPS, HOLDING_S, MARGIN_S = 3.0, 12.0, 0.4
TAKE_OFF_MPS2, LIFT_OFF_MPS, CLIMBING_MPS, CLIMBING_S = 2.5, 30.0, 45.0, 20.0


class _Profile:
    """Nodes of piecewise linear speed, and the turns.

    They are written down one manoeuvre after the other.
    """

    def __init__(self, standstill_s: float) -> None:
        self.time_s, self.speed_mps = [0.0, standstill_s], [0.0, 0.0]
        self.turns: list[tuple[float, float, float]] = []  # start, duration, angle

    def hold(self, duration_s: float) -> None:
        self.time_s.append(self.time_s[-1] + max(duration_s, 1e-3))
        self.speed_mps.append(self.speed_mps[-1])

    def change_speed(self, speed_mps: float, acceleration_mps2: float = ACCELERATION_MPS2) -> None:
        change = speed_mps - self.speed_mps[-1]
        rate = acceleration_mps2 if change > 0 else BRAKING_MPS2
        self.time_s.append(self.time_s[-1] + abs(change) / rate + 1e-3)
        self.speed_mps.append(speed_mps)

    def turn(self, angle_deg: float, rate_dps: float) -> None:
        duration = 1.5 * abs(angle_deg) / rate_dps  # a parabola of rate: mean is two thirds of the peak
        self.turns.append((self.time_s[-1], duration, angle_deg))
        self.hold(duration)


def _plan(case: TaxiCase) -> _Profile:
    profile = _Profile(case.standstill_s)
    profile.change_speed(ROLL_OUT_MPS)
    profile.hold(1.0)
    profile.turn(90.0, case.turn_rate_dps)
    longest = int(np.argmax(case.segments_s))
    for index, length in enumerate(case.segments_s):
        gated_per_mps = 1.0 / ACCELERATION_MPS2 + 1.0 / BRAKING_MPS2
        cruise = min(case.cruise_mps, FASTEST_GATED_MPS + max(length - 4.0, 1.0) / gated_per_mps)
        profile.hold(1.0)
        profile.change_speed(cruise)
        cruising = length + MARGIN_S - (cruise - FASTEST_GATED_MPS) * gated_per_mps
        if index == longest and case.curve_dps and cruising > 12.0:
            profile.turns.append((profile.time_s[-1] + 0.3 * (cruising - 10.0), 10.0, 10.0 * case.curve_dps))
        profile.hold(cruising)
        profile.change_speed(TURNING_MPS if index < len(case.turns_deg) else 0.0)
        if index < len(case.turns_deg):
            profile.hold(1.0)
            profile.turn(case.turns_deg[index], case.turn_rate_dps)
    profile.hold(HOLDING_S)
    if case.disturbance.take_off_crab_deg is not None:
        profile.change_speed(CLIMBING_MPS, TAKE_OFF_MPS2)
        profile.hold(CLIMBING_S)
    return profile


def _path_track_deg(time_s: FloatArray, case: TaxiCase, turns: list[tuple[float, float, float]]) -> FloatArray:
    track = np.full(len(time_s), case.first_track_deg - 90.0)
    for start, duration, angle in turns:
        phase = np.clip((time_s - start) / duration, 0.0, 1.0)
        gentle = abs(angle) <= 10.0 * abs(case.curve_dps) + 1e-9
        # A gentle curve has a constant rate; a turn a parabola of rate (no jump of rate at its ends).
        track = track + angle * (phase if gentle else phase**2 * (3.0 - 2.0 * phase))
    return track


def simulate_taxi(case: TaxiCase, rng: np.random.Generator) -> TaxiRun:
    """Draw one taxi run: standstill, straight segments with turns between, holding point.

    The middle of the main-gear axle moves along its track; the antenna ahead of it moves sideways as the heading turns:
    v_antenna = v_axle + (heading rate) x arm. Heading = track + sway + sideslip. The sensor errors are those of the
    case, the disturbances those of ``case.disturbance``.
    """
    profile, disturbance = _plan(case), case.disturbance
    step = 1.0 / INS_RATE_HZ
    time_s: FloatArray = np.arange(int(profile.time_s[-1] * INS_RATE_HZ), dtype=np.float64) * step
    count = len(time_s)
    planned_mps = np.interp(time_s, profile.time_s, profile.speed_mps)
    wander = gauss_markov(rng, (count,), step, case.speed_wander_mps, 15.0)
    speed = np.maximum(planned_mps + wander * np.clip(planned_mps / 6.0, 0.0, 1.0), 0.0)
    moving = np.clip(planned_mps / 3.0, 0.0, 1.0)
    steering = case.steering_sigma_deg * damped_oscillation(rng, (count,), step, 1.0, case.steering_hz, 0.7)
    sway = case.sway_sigma_deg * damped_oscillation(rng, (count,), step, 1.0, case.sway_hz, case.sway_damping)
    path_deg = _path_track_deg(time_s, case, profile.turns)
    track_deg = path_deg + moving * steering
    sideslip = disturbance.sideslip(rng, path_deg, case.first_track_deg, step)
    if disturbance.take_off_crab_deg is not None:
        is_run = np.arange(count) > np.flatnonzero(planned_mps <= 0.0)[-1]
        sideslip = sideslip + disturbance.take_off_crab_deg * is_run
    heading_deg = track_deg + moving * (sway + sideslip)
    rate_radps = np.deg2rad(np.gradient(heading_deg, step))
    track_rad, heading_rad = np.deg2rad(track_deg), np.deg2rad(heading_deg)
    north = speed * np.cos(track_rad) - rate_radps * case.antenna_arm_m * np.sin(heading_rad)
    east = speed * np.sin(track_rad) + rate_radps * case.antenna_arm_m * np.cos(heading_rad)
    velocity = disturbance.delayed(time_s, np.stack([north, east]))

    error = case.heading_error_deg + case.drift_deg_per_h / 3600.0 * (time_s - case.standstill_s)
    error = error + disturbance.ins_error(time_s, case.standstill_s)
    shown = heading_deg + error + case.heading_noise_deg * rng.standard_normal(count)
    shown = shown + disturbance.ins_wander(rng, count, step)
    if case.heading_resolution_deg > 0.0:
        shown = np.round(shown / case.heading_resolution_deg) * case.heading_resolution_deg
    every = max(round(disturbance.gnss_every_s * INS_RATE_HZ), GNSS_EVERY)
    at_gnss = slice(0, None, every)
    velocity = velocity[:, at_gnss] + _gnss_error(case, rng, moving[at_gnss], path_deg[at_gnss], every * step)
    return TaxiRun(
        case=case,
        ins_time_s=time_s,
        ins_heading_deg=wrap_360(shown),
        heading_deg=wrap_360(heading_deg),
        ins_error_deg=wrap_180(error),
        gnss_time_s=time_s[at_gnss],
        velocity_north_mps=velocity[0],
        velocity_east_mps=velocity[1],
        on_ground=planned_mps[at_gnss] < LIFT_OFF_MPS,
        taxi_start_s=case.standstill_s,
    )


def _gnss_error(
    case: TaxiCase, rng: np.random.Generator, moving: FloatArray, path_deg: FloatArray, step_s: float
) -> FloatArray:
    """GNSS velocity error, m/s, shape (2, n); ``moving`` is 0 at standstill and 1 in motion."""
    disturbance, count = case.disturbance, len(moving)
    noise = gauss_markov(rng, (2, count), step_s, case.correlated_mps, case.correlation_s)
    noise = noise * (1.0 + (disturbance.motion_factor - 1.0) * moving)
    in_motion = disturbance.multipath(path_deg) + disturbance.patches(rng, count, step_s)
    return np.asarray(noise + case.white_mps * rng.standard_normal((2, count)) + moving * in_motion)


def table_of(topic: str, time_ns: NDArray[np.int64], columns: Mapping[str, NDArray[np.generic]]) -> Table:
    """Make a table whose every value is present."""
    index = np.arange(len(time_ns), dtype=np.int64)
    return Table(topic, time_ns, {name: Column(values) for name, values in columns.items()}, index, Column(time_ns))


def taxi_flight(run: TaxiRun, *, rng: np.random.Generator | None = None) -> Flight:
    """Make the tables of a simulated run, as a reader would give them.

    Topics are ins, gnss, discrete and truth. Positions are the sums of the velocities: good enough to tell one epoch
    from the next. GDOP is 1.5, or drawn.
    """
    gdop = 1.5 if rng is None else rng.uniform(1.2, 1.8)
    ins_ns = START_OF_DAY_NS + np.round(run.ins_time_s * NS_PER_S).astype(np.int64)
    gnss_ns = START_OF_DAY_NS + np.round(run.gnss_time_s * NS_PER_S).astype(np.int64)
    epochs = len(gnss_ns)
    step_s = float(run.gnss_time_s[1] - run.gnss_time_s[0])
    latitude_deg, longitude_deg = latitude_longitude_deg(
        np.cumsum(run.velocity_north_mps) * step_s, np.cumsum(run.velocity_east_mps) * step_s, *AIRFIELD_DEG
    )
    tables = (
        table_of("ins", ins_ns, {"true_heading_deg": run.ins_heading_deg, "mode": np.full(len(ins_ns), "nav")}),
        table_of(
            "gnss",
            gnss_ns,
            {
                "latitude_deg": latitude_deg,
                "longitude_deg": longitude_deg,
                "velocity_north_mps": run.velocity_north_mps,
                "velocity_east_mps": run.velocity_east_mps,
                "gdop": np.full(epochs, gdop),
                "integrity_ok": np.ones(epochs, dtype=bool),
            },
        ),
        table_of("discrete", gnss_ns, {"weight_on_wheels": run.on_ground}),
        table_of("truth", ins_ns, {"true_heading_deg": run.heading_deg}),
    )
    metadata = MappingProxyType({"aircraft": "simulated", "flight": "taxi"})
    return Flight({table.topic: table for table in tables}, metadata, START_OF_DAY_NS, True, "simulated taxi")
