"""Simulated approaches with ILS channels: true motion, errors of the ILS, coarse INS.

The motion is that along a final.
"""

from dataclasses import field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.records import Column, Int64Array
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.toml_settings import check_ranges, number, required_number, settings_from
from groundstation.base.units import DOTS_PER_FULL_SCALE, NS_PER_S
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.readings import generator
from groundstation.tables.table import Flight, Table

_SCENARIOS = ShippedToml("groundstation.simulation", "approaches", "approach")
FULL_SCALE_DDM = 0.155
GLIDE_SLOPE_DOT = 0.12  # one dot as a share of the glide angle
NEEDLE_STOP_DOTS = 4.5
FLARE_M = 15.0  # height at which the sink rate begins to fall
SLOWEST_MPS = 15.0  # the roll-out is recorded down to it
CLIMB_S, CLIMB_MPS = 120.0, 8.0
CAPTURE_M = 2_500.0  # distance over which an offset from the course falls to 37 %


@dataclass(frozen=True)
class TrueRunway:
    """True runway and its aids; what a site file says of them may differ."""

    latitude_deg: float = required_number(-80.0, 80.0)
    longitude_deg: float = required_number(-180.0, 180.0)
    true_course_deg: float = required_number(0.0, 360.0)
    elevation_m: float = number(100.0, -100.0, 4_000.0)
    length_m: float = number(3_000.0, 500.0, 6_000.0)
    threshold_crossing_height_m: float = number(15.0, 5.0, 30.0)
    glide_angle_deg: float = number(3.0, 2.0, 7.0)
    localizer_width_m: float = number(213.36, 50.0, 500.0)
    localizer_distance_m: float = number(3_300.0, 1_000.0, 8_000.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class FinalMotion:
    """Motion on the final.

    Across is right of the course; ``crab_deg`` turns the nose right of the track.
    """

    start_distance_m: float = number(22_000.0, 2_000.0, 60_000.0)
    start_across_m: float = number(0.0, -20_000.0, 20_000.0)
    speed_mps: float = number(70.0, 20.0, 150.0)
    wander_m: float = number(8.0, 0.0, 500.0)
    wander_s: float = number(25.0, 1.0, 1_000.0)
    crab_deg: float = number(0.0, -20.0, 20.0)
    above_path_m: float = number(0.0, -200.0, 200.0)
    rollout_across_m: float = number(0.0, -30.0, 30.0)
    go_around_height_m: float | None = number(None, 20.0, 500.0)


@dataclass(frozen=True)
class Recorded:
    """Errors of the recorded data.

    Position error = INS minus truth as the threshold is crossed, and its growth.
    """

    across_m: float = number(0.0, -20_000.0, 20_000.0)
    along_m: float = number(0.0, -20_000.0, 20_000.0)
    across_rate_mps: float = number(0.0, -5.0, 5.0)
    across_curvature_mps2: float = number(0.0, -0.1, 0.1)
    step_deg: float = number(180.0 / 2**17, 0.0, 0.1)
    rounding: Literal["nearest", "down"] = "nearest"
    course_line_m: float = number(0.0, -100.0, 100.0)
    bend_ddm: float = number(0.0, 0.0, 0.2)
    bend_length_m: float = number(1_000.0, 10.0, 10_000.0)
    width_error: float = number(0.0, -0.9, 2.0)
    is_reversed: bool = False
    dot_step: float = number(0.0101, 1e-6, 1.0)
    has_weight_on_wheels: bool = True
    antenna_m: float = number(0.0, -20.0, 20.0)  # of the glide slope's antenna above the point whose height is logged
    height_scale: float = number(1.0, 0.5, 2.0)  # of the logged height above the airfield: air that is no standard
    runway_rise: float = number(0.0, -0.05, 0.05)  # per metre along the landing, of the ground that is rolled out on


@dataclass(frozen=True)
class ApproachScenario:
    """Everything that determines a simulated approach."""

    runway: TrueRunway
    name: str = "approach"
    title: str = ""
    seed: int = 1
    start_utc: str = "2026-05-04T06:00:00Z"
    flown: FinalMotion = field(default_factory=FinalMotion)
    recorded: Recorded = field(default_factory=Recorded)

    def __post_init__(self) -> None:
        if iso_to_utc_ns(self.start_utc)[0] < 0:
            raise SettingsError("start_utc", self.start_utc, "a date after 1970")


@dataclass(frozen=True, eq=False)
class SimulatedApproach:
    """Log of a simulated approach, and the values that an analysis should find.

    Times are flight seconds, errors are those as the threshold is crossed.
    """

    scenario: ApproachScenario
    flight: Flight
    threshold_s: float
    touchdown_s: float | None
    across_m: float
    across_rate_mps: float


def approach_names() -> tuple[str, ...]:
    """Names of the shipped approaches."""
    return _SCENARIOS.names()


def load_approach(name_or_path: str | Path) -> ApproachScenario:
    """Read a shipped approach by name, or one from a TOML file.

    Examples
    --------
    >>> load_approach("ils-approach").runway.glide_angle_deg
    3.0
    """
    file = _SCENARIOS.read(name_or_path)
    return replace(settings_from(ApproachScenario, file.table, file.where), name=file.name)


def simulate_approach(scenario: ApproachScenario, seed: int | None = None) -> SimulatedApproach:
    """Fly and record an approach. The same scenario and seed give the same log."""
    scenario = scenario if seed is None else replace(scenario, seed=seed)
    time_s, distance_m, height_m, speed_mps = _along(scenario)
    rng = generator(scenario.seed, "approach")
    line_m = _course_line(scenario, distance_m)
    across_m = _across(scenario.flown, time_s, distance_m, height_m, rng) + np.where(height_m > 0.0, line_m, 0.0)
    crossing_s = float(np.interp(0.0, -distance_m, time_s)) if distance_m.min() < 0.0 else float(time_s[-1])
    on_ground = height_m <= 0.0
    tables = {
        "ins": _ins(scenario, time_s, distance_m, across_m, speed_mps, crossing_s),
        "guidance": _guidance(scenario, distance_m, across_m - line_m, height_m + scenario.recorded.antenna_m, rng),
        "baro": {"height_above_airfield_m": _logged_height(scenario.recorded, distance_m, height_m)},
        "radio_altimeter": {"height_m": np.where(height_m < 750.0, np.round(height_m, 1), np.nan)},
    }
    if scenario.recorded.has_weight_on_wheels:
        tables["discrete"] = {"weight_on_wheels": on_ground}
    landed = float(time_s[np.argmax(on_ground)]) if on_ground.any() else None
    recorded = scenario.recorded
    return SimulatedApproach(
        scenario, _flight(scenario, time_s, tables), crossing_s, landed, recorded.across_m, recorded.across_rate_mps
    )


def write_approach(scenario: ApproachScenario, folder: str | Path, seed: int | None = None) -> Path:
    """Simulate an approach and write its log ``<folder>/<name>.csv``."""
    path = Path(folder) / f"{scenario.name}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_flat_csv(path, simulate_approach(scenario, seed).flight)
    return path


def _along(scenario: ApproachScenario) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return time, distance before the threshold, height above it, and ground speed.

    They are given once a second down to a slow roll-out.
    """
    flown, runway = scenario.flown, scenario.runway
    slope = np.tan(np.deg2rad(runway.glide_angle_deg))
    height = runway.threshold_crossing_height_m + flown.start_distance_m * slope + flown.above_path_m
    distance, speed, climbing_s = flown.start_distance_m, flown.speed_mps, 0.0
    rows = []
    for second in range(3_600):
        rows.append((float(second), distance, height, speed))
        if climbing_s >= CLIMB_S or speed < SLOWEST_MPS:
            break
        distance -= speed
        if climbing_s or (flown.go_around_height_m is not None and height <= flown.go_around_height_m):
            climbing_s += 1.0
            height += CLIMB_MPS
        elif height <= 0.0:
            speed -= 2.0
        else:
            height = max(height - speed * slope * (1.0 if height > FLARE_M else max(height / FLARE_M, 0.25)), 0.0)
    time_s, distance_m, height_m, speed_mps = np.array(rows).T
    return time_s, distance_m, height_m, speed_mps


def _course_line(scenario: ApproachScenario, distance_m: FloatArray) -> FloatArray:
    """Return the offset of the mean course line, right of the true course.

    The aircraft follows the mean course line.
    """
    to_antenna = np.maximum(distance_m + scenario.runway.localizer_distance_m, 50.0)
    return np.asarray(scenario.recorded.course_line_m * to_antenna / scenario.runway.localizer_distance_m)


def _across(
    flown: FinalMotion, time_s: FloatArray, distance_m: FloatArray, height_m: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Return the true displacement right of the course: capture, wander, roll-out.

    The wander narrows towards the runway.
    """
    capture = flown.start_across_m * np.exp(-(flown.start_distance_m - distance_m) / CAPTURE_M)
    narrowing = np.clip(0.2 + distance_m / 10_000.0, 0.05, 3.0)
    wander = gauss_markov(rng, (len(time_s),), 1.0, flown.wander_m, flown.wander_s) * narrowing
    return np.where(height_m <= 0.0, flown.rollout_across_m, capture + wander)


def _ins(
    scenario: ApproachScenario,
    time_s: FloatArray,
    distance_m: FloatArray,
    across_m: FloatArray,
    speed_mps: FloatArray,
    crossing_s: float,
) -> dict[str, FloatArray]:
    recorded, runway = scenario.recorded, scenario.runway
    since_s = time_s - crossing_s
    error_m = recorded.across_m + recorded.across_rate_mps * since_s
    shown_across = across_m + error_m + 0.5 * recorded.across_curvature_mps2 * since_s**2
    shown_along = recorded.along_m - distance_m
    course_rad = np.deg2rad(runway.true_course_deg)
    north = shown_along * np.cos(course_rad) - shown_across * np.sin(course_rad)
    east = shown_along * np.sin(course_rad) + shown_across * np.cos(course_rad)
    latitude, longitude = latitude_longitude_deg(north, east, runway.latitude_deg, runway.longitude_deg)
    return {
        "latitude_deg": _stepped(latitude, recorded),
        "longitude_deg": _stepped(longitude, recorded),
        "true_heading_deg": np.full(len(time_s), wrap_360(runway.true_course_deg + scenario.flown.crab_deg)),
        "roll_deg": np.zeros(len(time_s)),
        "ground_speed_mps": np.round(speed_mps, 2),
    }


def _stepped(values_deg: FloatArray, recorded: Recorded) -> FloatArray:
    if recorded.step_deg <= 0.0:
        return values_deg
    steps = values_deg / recorded.step_deg
    return np.asarray((np.round(steps) if recorded.rounding == "nearest" else np.floor(steps)) * recorded.step_deg)


def _guidance(
    scenario: ApproachScenario,
    distance_m: FloatArray,
    off_line_m: FloatArray,
    height_m: FloatArray,
    rng: np.random.Generator,
) -> dict[str, FloatArray]:
    """Return the deviations in dots as a receiver shows them."""
    recorded, runway = scenario.recorded, scenario.runway
    to_antenna = np.maximum(distance_m + runway.localizer_distance_m, 50.0)
    per_dot = 0.5 * runway.localizer_width_m / DOTS_PER_FULL_SCALE * to_antenna / runway.localizer_distance_m
    bend_s = recorded.bend_length_m / scenario.flown.speed_mps
    bend = gauss_markov(rng, (len(distance_m),), 1.0, recorded.bend_ddm / 2.0 / FULL_SCALE_DDM * 2.0, bend_s)
    lateral = off_line_m / per_dot * (1.0 + recorded.width_error) + bend
    slope = np.tan(np.deg2rad(runway.glide_angle_deg))
    origin_m = np.maximum(distance_m + runway.threshold_crossing_height_m / slope, 20.0)
    angle_deg = np.rad2deg(np.arctan2(height_m, origin_m))
    vertical = (angle_deg - runway.glide_angle_deg) / (GLIDE_SLOPE_DOT * runway.glide_angle_deg)
    sign = -1.0 if recorded.is_reversed else 1.0
    return {
        "lateral_deviation_dots": sign * _needle(lateral, recorded.dot_step),
        "vertical_deviation_dots": _needle(vertical, 0.018),
        "frequency_mhz": np.full(len(distance_m), 110.3),
    }


def _logged_height(recorded: Recorded, distance_m: FloatArray, height_m: FloatArray) -> FloatArray:
    """Return the barometric height above the threshold, in whole feet.

    The roll-out follows the runway.
    """
    rise_m = np.where(height_m <= 0.0, -recorded.runway_rise * distance_m, 0.0)
    return np.asarray(np.round((height_m * recorded.height_scale + rise_m) / 0.3048) * 0.3048)


def _needle(dots: FloatArray, step: float) -> FloatArray:
    return np.asarray(np.round(np.clip(dots, -NEEDLE_STOP_DOTS, NEEDLE_STOP_DOTS) / step) * step)


def _flight(scenario: ApproachScenario, time_s: FloatArray, tables: dict[str, dict[str, FloatArray]]) -> Flight:
    start_ns = iso_to_utc_ns(scenario.start_utc)[0]
    time_ns: Int64Array = (time_s * NS_PER_S).astype(np.int64)
    index = np.arange(len(time_ns), dtype=np.int64)
    return Flight(
        {
            topic: Table(
                topic,
                time_ns + start_ns,
                {name: Column(values, _present(values)) for name, values in columns.items()},
                index,
                Column(time_ns),
            )
            for topic, columns in tables.items()
        },
        {"aircraft": "simulated", "flight": scenario.name, "start_utc": scenario.start_utc},
        start_ns,
        has_utc=True,
        source_name=f"{scenario.name}.csv",
    )


def _present(values: FloatArray) -> "np.ndarray | None":
    known = np.isfinite(values)
    return None if known.all() else known
