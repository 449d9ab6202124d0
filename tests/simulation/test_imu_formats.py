"""One simulated log of an inertial unit as flat CSV, ULog, DataFlash and ROS bag: equal tables, and known to peers."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import SettingsError, UsageError
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.verbs.synthesis import simulate_to
from groundstation.simulation.imu.dataflash import write_dataflash
from groundstation.simulation.imu.families import FAMILIES, Family
from groundstation.simulation.imu.flight import ImuFlight
from groundstation.simulation.imu.ros_bag import write_ros1
from groundstation.simulation.imu.scenario import ImuScenario, fly, imu_scenario_names, load_imu_scenario
from groundstation.simulation.imu.settings import ImuSettings, ReceiverSettings, StampSettings
from groundstation.simulation.imu.tables import gnss_columns, imu_columns, write_csv
from groundstation.simulation.imu.ulog import write_ulog
from groundstation.simulation.scenario import LogInterval
from groundstation.tables.table import Flight, Table

Writer = Callable[[Path, ImuFlight, ImuScenario], None]
FORMATS: dict[str, tuple[Writer, str]] = {
    "csv": (write_csv, "x.csv"),
    "ulog": (write_ulog, "x.ulg"),
    "dataflash": (write_dataflash, "x.BIN"),
    "ros1": (write_ros1, "x.bag"),
}
SINGLE = 1.2e-7  # relative: numbers of the topic imu are stored in single precision, some formats' as well
TIMES_S = {"csv": 1e-9, "ulog": 1e-6, "dataflash": 1e-6, "ros1": 1e-9}
# Half a step of what a format stores; of DataFlash the speed and course in single precision.
STEPS = {
    "csv": {"latitude_deg": 5e-10, "longitude_deg": 5e-10, "altitude_ellipsoid_m": 5e-5, "velocity": 5e-5},
    "ulog": {"latitude_deg": 0.0, "longitude_deg": 0.0, "altitude_ellipsoid_m": 0.0, "velocity": 30 * SINGLE},
    "dataflash": {"latitude_deg": 5e-8, "longitude_deg": 5e-8, "altitude_msl_m": 5e-3, "velocity": 1e-5},
    "ros1": {"latitude_deg": 0.0, "longitude_deg": 0.0, "altitude_ellipsoid_m": 0.0, "velocity": 0.0},
}
SIGMAS = {"csv": 5e-4, "ulog": SINGLE, "dataflash": 5.1e-3, "ros1": 1e-12}
ROUNDING = 1e-9


def scenario_of(family: Family, *, is_integral: bool = True) -> ImuScenario:
    gnss = ReceiverSettings(latency_s=0.1, outages=(LogInterval(20.0, 25.0),))
    stamps = StampSettings(jitter_s=0.001, gaps=(LogInterval(12.0, 12.5),))
    unit = ImuSettings(duration_s=60.0, rate_hz=50.0, gnss=gnss, stamps=stamps, is_integral=is_integral)
    return ImuScenario(family, name=family, unit=unit)


@cache
def flown(family: Family, is_integral: bool) -> ImuFlight:
    return fly(scenario_of(family, is_integral=is_integral))


@pytest.mark.parametrize("is_integral", [True, False], ids=["increments", "samples"])
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("form", FORMATS)
def test_tables_are_those_of_the_flight(form: str, family: Family, is_integral: bool, tmp_path: Path) -> None:
    flight, scenario = flown(family, is_integral), scenario_of(family, is_integral=is_integral)
    write, name = FORMATS[form]
    write(tmp_path / name, flight, scenario)
    mcap = tmp_path / "x.mcap"
    found = read_flight(mcap, convert_log(open_log(tmp_path / name), mcap))
    assert found.has_utc
    _check_imu(form, found, flight)
    _check_gnss(form, found, flight)


def _seconds(found: Flight, topic: str) -> np.ndarray:
    """Recorder's own times since the first inertial sample."""
    at_ns = found[topic].device_time_ns.values
    return (at_ns - found["imu"].device_time_ns.values[0]) / 1e9


def _check_imu(form: str, found: Flight, flight: ImuFlight) -> None:
    table, step_s, at_s = found["imu"], flight.interval_s, _seconds(found, "imu")
    if form == "ulog" and not flight.is_integral:  # rates and specific force are messages apart
        assert len(table) == 2 * len(flight.time_s)
        at_s = at_s[np.isfinite(table.values("rate_x_dps"))]
    assert len(at_s) == len(flight.time_s)
    assert np.abs(at_s - (flight.time_s - flight.time_s[0])).max() <= 2.0 * TIMES_S[form] + ROUNDING
    expected = imu_columns(flight)
    is_integral = bool(expected.pop("is_integral").all()) and form != "ros1"
    assert set(table.values("is_integral")) == {float(is_integral)}
    if form == "ros1":  # it has rates: the means of the intervals
        expected.pop("interval_s", None)
    for name, values in expected.items():
        got = table.values(name) if name in table else _increment_of(name, table, step_s)
        csv_step = 1e-9 if form == "csv" else 0.0
        assert np.abs(got[np.isfinite(got)] - values).max() <= 2.0 * SINGLE * np.abs(values).max() + csv_step, name


def _increment_of(name: str, table: Table, step_s: np.ndarray) -> np.ndarray:
    axis = name.split("_")[2]
    if name.startswith("delta_angle"):
        return np.deg2rad(table.values(f"rate_{axis}_dps")) * step_s
    return table.values(f"accel_{axis}_mps2") * step_s


def _check_gnss(form: str, found: Flight, flight: ImuFlight) -> None:
    table, expected = found["gnss"], gnss_columns(flight)
    for field, step in STEPS[form].items():
        names = [f"velocity_{axis}_mps" for axis in ("north", "east", "down")] if field == "velocity" else [field]
        for name in names:
            known = np.isfinite(table.values(name))
            values = expected["altitude_ellipsoid_m" if name.startswith("altitude") else name]
            assert known.sum() == len(values)
            assert np.abs(table.values(name)[known] - values).max() <= step * 1.001 + ROUNDING, name
            at_s = _seconds(found, "gnss")[known] + flight.time_s[0]
            assert np.abs(at_s - flight.gnss.time_s).max() <= 2.0 * TIMES_S[form] + ROUNDING
    for name in ("horizontal_sigma_m", "vertical_sigma_m", "velocity_sigma_mps"):
        if name in table:
            values = table.values(name)
            assert np.nanmax(np.abs(values - expected[name][0])) <= SIGMAS[form] * 2.0, name
        else:
            assert (form, name) == ("ros1", "velocity_sigma_mps"), "a twist without a covariance"


def test_ulog_is_known_to_its_peer(tmp_path: Path) -> None:
    from pyulog import ULog

    flight = flown("uav", True)
    write_ulog(tmp_path / "x.ulg", flight, scenario_of("uav"))
    log = ULog(str(tmp_path / "x.ulg"))
    unit = log.get_dataset("vehicle_imu").data
    assert not log.file_corruption and len(unit["timestamp"]) == len(flight.time_s)
    assert unit["delta_velocity[2]"] == pytest.approx(flight.delta_velocity_mps[:, 2], rel=SINGLE)
    assert set(unit["delta_angle_dt"]) == {20_000}
    fixes = log.get_dataset("vehicle_gps_position").data
    assert np.array_equal(fixes["latitude_deg"], flight.gnss.latitude_deg)


def test_dataflash_is_known_to_its_peer(tmp_path: Path) -> None:
    from pymavlink.DFReader import DFReader_binary

    flight = flown("uav", True)
    write_dataflash(tmp_path / "x.BIN", flight, scenario_of("uav"))
    log, found = DFReader_binary(str(tmp_path / "x.BIN")), {"IMT": [], "GPS": [], "GPA": []}
    while (message := log.recv_msg()) is not None:
        found.get(message.get_type(), []).append(message)
    log.close()
    assert len(found["IMT"]) == len(flight.time_s) and len(found["GPA"]) == len(flight.gnss.time_s)
    assert [one.DelVZ for one in found["IMT"]] == pytest.approx(flight.delta_velocity_mps[:, 2], rel=SINGLE)
    assert [one.Lat for one in found["GPS"]] == pytest.approx(flight.gnss.latitude_deg, abs=6e-8)


def test_bag_is_known_to_its_peer(tmp_path: Path) -> None:
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_typestore

    flight, types = flown("uav", True), get_typestore(Stores.ROS1_NOETIC)
    write_ros1(tmp_path / "x.bag", flight, scenario_of("uav"))
    found: dict[str, list[object]] = {}
    with Reader(tmp_path / "x.bag") as bag:
        for connection in bag.connections:
            assert types.generate_msgdef(connection.msgtype)[1] == connection.digest
        for connection, _time_ns, data in bag.messages():
            message = types.deserialize_ros1(data, connection.msgtype)
            found.setdefault(connection.topic, []).append(message)
    assert {name: len(rows) for name, rows in found.items()} == {
        "/imu/data_raw": len(flight.time_s),
        "/gps/fix": len(flight.gnss.time_s),
        "/gps/vel": len(flight.gnss.time_s),
    }
    up = [one.linear_acceleration.z for one in found["/imu/data_raw"]]
    assert up == pytest.approx(-flight.delta_velocity_mps[:, 2] / flight.interval_s, rel=1e-12)
    assert [one.twist.linear.x for one in found["/gps/vel"]] == pytest.approx(flight.gnss.velocity_mps[:, 1])


@pytest.mark.parametrize("name", imu_scenario_names())
def test_every_shipped_scenario_can_be_flown(name: str) -> None:
    scenario = load_imu_scenario(name)
    assert scenario.title and name.startswith("imu-")
    flight = fly(scenario)
    assert np.isfinite(flight.delta_angle_rad).all() and len(flight.gnss.time_s) > 2_000


def test_a_user_simulates_a_log_with_its_truth(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('family = "hover"\n[unit]\nduration_s = 20\nrate_hz = 50\n')
    for form, names in (("csv", ["mine.csv"]), ("ulog", ["mine.ulg", "mine.truth.csv"])):
        paths = simulate_to(str(file), tmp_path / form, form=form)  # type: ignore[arg-type]
        assert [path.name for path in paths] == names
        assert "truth.true_heading_deg" in paths[-1].read_text()[:2000]
    with pytest.raises(UsageError, match="a file that exists"):
        simulate_to(str(file), tmp_path / "csv")
    with pytest.raises(UsageError, match="--format ch10"):
        simulate_to(str(file), tmp_path / "ch10", form="ch10")
    with pytest.raises(UsageError, match="--format ulog"):
        simulate_to("taxi-good", tmp_path, form="ulog")
    again = simulate_to(str(file), tmp_path / "again")[0]
    assert again.read_bytes() == (tmp_path / "csv" / "mine.csv").read_bytes()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('family = "boat"', "key family"),
        ('family = "uav"\n[unit]\nrate_hz = 0', "key unit.rate_hz"),
        ('family = "uav"\n[unit]\nspeed = 3', "key unit.speed"),
        ('family = "uav"\n[unit]\nimu_class = "toy"', "imu_class"),
        ('family = "uav"\nstart_utc = "yesterday"', "ISO 8601"),
    ],
)
def test_a_scenario_that_cannot_be_used_says_where(text: str, expected: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text + "\n")
    with pytest.raises(SettingsError, match=expected):
        load_imu_scenario(file)
