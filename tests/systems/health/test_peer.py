"""PX4's own analysis of its estimator on the same logs: every figure that both have, by its own reduction."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.systems.health import px4
from groundstation.tables.table import Flight
from tests.real_logs import real_log

REFERENCE = Path(__file__).parents[2] / "references" / "health_ecl_ekf.toml"
RUNS = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))["run"]
SENSORS = {
    "hgt": "height",
    "mag": "magnetic field",
    "vel": "GNSS and vision velocity",
    "pos": "horizontal position",
    "hagl": "height above ground",
}
NEAR_GROUND = ("hgt", "mag")  # judged with the margin
IMU = {
    "imu_coning": ("coning_rad2",),
    "imu_hfdang": ("delta_angle_vibration_rad",),
    "imu_hfdvel": ("delta_velocity_vibration_mps",),
    "output_obs_ang_err": ("output_angle_rad",),
    "output_obs_vel_err": ("output_velocity_mps",),
    "output_obs_pos_err": ("output_position_m",),
}
STATISTICS = {"max": np.max, "peak": np.max, "mean": np.mean, "median": np.median}
ROUNDING = 1e-6  # of single precision, in which the peer computes


def _flight(path: Path, tmp_path: Path) -> Flight:
    target = tmp_path / "log.mcap"
    return read_flight(target, convert_log(open_log(path), target))


def _airtimes(flight: Flight, margin_s: float) -> list[tuple[float, float]]:
    """Take-offs and landings as the peer reads them off vehicle_land_detected; those of 5 s and more."""
    table = flight["raw.vehicle_land_detected"]
    landed = table.values("landed")
    begins = np.flatnonzero(np.diff(landed) < 0) + 1
    ends = np.flatnonzero(np.diff(landed) > 0) + 1
    if not len(begins) or (len(ends) and ends[0] < begins[0]):
        begins = np.concatenate([[0], begins])
    if len(ends) < len(begins):
        ends = np.append(ends, len(landed) - 1)
    time_s = table.time_ns * 1e-9
    spans = [(time_s[a] + margin_s, time_s[b] - margin_s) for a, b in zip(begins, ends, strict=True)]
    return [(start, end) for start, end in spans if end - start >= 5.0]


def _in(time_ns: np.ndarray, spans: list[tuple[float, float]]) -> np.ndarray:
    chosen = np.zeros(len(time_ns), dtype=bool)
    for start, end in spans:
        chosen |= (time_ns * 1e-9 >= start) & (time_ns * 1e-9 < end)
    return chosen


def _figure(flight: Flight, name: str, margin_s: float) -> float:
    """A figure of the peer from our evidence, by the peer's reduction of samples."""
    what, _, statistic = name.rpartition("_")
    if what in ("imu_dang_bias", "imu_dvel_bias"):
        return _bias(flight, 10 if "dang" in what else 13, margin_s)
    if what.removesuffix("_test").removesuffix("_percentage") in SENSORS:
        sensor = what.removesuffix("_test").removesuffix("_percentage")
        wanted = ("test_ratio", SENSORS[sensor])
        margin_s = margin_s if sensor in NEAR_GROUND else 0.0
    else:
        wanted = (*IMU[what], None)
    (found,) = [one for one in px4.evidence(flight) if one.quantity == wanted[0] and wanted[1] in (None, one.sensor)]
    value = found.value[_in(found.time_ns, _airtimes(flight, margin_s))]
    if statistic == "amber":
        return 100.0 * float(np.mean(value > 0.5) - np.mean(value > 1.0))
    return float(STATISTICS[statistic](value))


def _bias(flight: Flight, first: int, margin_s: float) -> float:
    """Length of the medians of the axes; ours is the median of the length, of the same samples."""
    topic = "raw.estimator_states" if "raw.estimator_states" in flight else "raw.estimator_status"
    table = flight[topic]
    rows = _in(table.time_ns, _airtimes(flight, margin_s))
    return float(np.linalg.norm([np.median(table.values(f"states[{first + axis}]")[rows]) for axis in range(3)]))


@pytest.mark.parametrize("run", RUNS, ids=[Path(one["log"]).stem for one in RUNS])
def test_figures_are_those_of_the_peer(run: dict[str, Any], tmp_path: Path) -> None:
    flight = _flight(real_log(run["log"]), tmp_path)
    margin_s = 0.0 if "--no-sensor-safety-margin" in run["how"] else 5.0
    ours = {name: _figure(flight, name, margin_s) for name in run["figures"]}
    assert ours == pytest.approx(run["figures"], rel=ROUNDING, abs=1e-12)
