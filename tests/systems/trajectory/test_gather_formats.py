"""One simulated log of an inertial unit in each format gives the same input of the trajectory, on the unit's clock."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.simulation.imu.dataflash import write_dataflash
from groundstation.simulation.imu.flight import ImuFlight
from groundstation.simulation.imu.ros_bag import write_ros1
from groundstation.simulation.imu.scenario import ImuScenario, fly
from groundstation.simulation.imu.settings import ImuSettings, StampSettings
from groundstation.simulation.imu.tables import write_csv
from groundstation.simulation.imu.ulog import write_ulog
from groundstation.simulation.scenario import LogInterval
from groundstation.systems.known import Known
from groundstation.systems.trajectory.gather import gather
from groundstation.systems.trajectory.gathered import Gathered
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.tables.phases import Phases

FORMATS = {
    "x.csv": write_csv,
    "x.ulg": write_ulog,
    "x.BIN": write_dataflash,
    "x.bag": write_ros1,
}
DURATION_S, RATE_HZ, JITTER_S = 120.0, 100.0, 0.003
GAP = LogInterval(50.0, 52.5)


def flown(*, is_integral: bool = True) -> tuple[ImuFlight, ImuScenario]:
    stamps = StampSettings(jitter_s=JITTER_S, gaps=(GAP,))
    unit = ImuSettings(duration_s=DURATION_S, rate_hz=RATE_HZ, stamps=stamps, is_integral=is_integral)
    scenario = ImuScenario("drive", name="drive", unit=unit)
    return fly(scenario), scenario


def gathered_from(folder: Path, name: str, flight: ImuFlight, scenario: ImuScenario) -> Gathered:
    FORMATS[name](folder / name, flight, scenario)
    mcap = folder / "x.mcap"
    found = read_flight(mcap, convert_log(open_log(folder / name), mcap))
    return gather(found, Known(Phases((), "none")), InputSettings())


@pytest.mark.parametrize("is_integral", [True, False], ids=["increments", "samples"])
@pytest.mark.parametrize("name", FORMATS)
def test_times_and_increments_are_those_of_the_unit(tmp_path: Path, name: str, is_integral: bool) -> None:
    flight, scenario = flown(is_integral=is_integral)
    found = gathered_from(tmp_path, name, flight, scenario)
    assert len(found.imu) >= len(flight.true_time_s) - 2
    start_s = found.imu.time_s[-1] - flight.true_time_s[-1]
    near = np.searchsorted(flight.true_time_s, found.imu.time_s - start_s - 0.5 / RATE_HZ)
    error_s = found.imu.time_s - flight.true_time_s[np.minimum(near, len(flight.true_time_s) - 1)]
    error_s = error_s - np.median(error_s)
    assert np.abs(error_s).max() < JITTER_S / 3.0 and np.std(error_s) < JITTER_S / 15.0
    assert found.imu_facts.jitter_s == pytest.approx(JITTER_S, rel=0.1)
    assert found.imu_facts.gaps == 1 and found.imu_facts.longest_gap_s == pytest.approx(2.5, abs=0.03)
    assert found.imu.is_integral == (is_integral and name != "x.bag")
    total = flight.delta_velocity_mps.sum(axis=0)
    turned = flight.delta_angle_rad.sum(axis=0)
    assert np.abs(found.imu.delta_velocity_mps.sum(axis=0) - total).max() < 2e-4 * np.abs(total).max()
    assert np.abs(found.imu.delta_angle_rad.sum(axis=0) - turned).max() < 0.005
    assert len(found.gnss) == len(flight.gnss.time_s)
