"""Figures of ArduPilot's own analysis on the same logs, over the whole log, as the peer takes them."""

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import groundstation
from groundstation.systems.health import ardupilot
from tests.real_logs import real_log

REFERENCE = Path(__file__).parents[2] / "references" / "health_log_analyzer.toml"
RUNS = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))["run"]
Reduce = Callable[[np.ndarray], Any]
FIGURES: Mapping[str, tuple[str, str, Reduce, float]] = {  # quantity, sensor, reduction, factor to the peer's unit
    "satellites_min": ("satellites", "GNSS 1", np.nanmin, 1.0),
    "hdop_max": ("hdop", "GNSS 1", np.nanmax, 1.0),
    "field_min_mgauss": ("field_length_gauss", "magnetometer 1", np.nanmin, 1e3),
    "field_max_mgauss": ("field_length_gauss", "magnetometer 1", np.nanmax, 1e3),
    "offset_max_mgauss": ("compass_offset", "magnetometer 1", np.nanmax, 1.0),
    "accel_mismatch_max_mps2": ("accel_difference_mps2", "IMU 2 against IMU 1", np.nanmax, 1.0),
    "slow_loops_max": ("slow_loops", "main loop", np.nanmax, 1.0),
    "supply_min_v": ("supply_v", "", np.nanmin, 1.0),
    "supply_max_v": ("supply_v", "", np.nanmax, 1.0),
}
ROUNDING = 1e-6  # of single precision in the log


@pytest.mark.parametrize("run", RUNS, ids=[Path(one["log"]).stem for one in RUNS])
def test_figures_are_those_of_the_peer(run: dict[str, Any]) -> None:
    evidence = ardupilot.evidence(groundstation.open(real_log(run["log"])).flight)
    ours = {}
    for name in run["figures"]:
        quantity, sensor, reduced, factor = FIGURES[name]
        (found,) = [one for one in evidence if (one.quantity, one.sensor) == (quantity, sensor)]
        ours[name] = factor * float(reduced(found.value))
    assert ours == pytest.approx(run["figures"], rel=ROUNDING)
