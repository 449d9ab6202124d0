"""Shortfalls told before anything is estimated: of a whole log, and of logs that lack one thing each."""

from dataclasses import replace

import numpy as np
import pytest

import groundstation
from groundstation.base.records import Column
from groundstation.pipeline.one_flight.analyse import known_of, run_analyses, seen_by_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.verbs.usable import flight_purposes, usability_of_flight
from groundstation.simulation.imu.scenario import ImuScenario, fly
from groundstation.simulation.imu.settings import ImuSettings
from groundstation.simulation.imu.tables import write_csv
from groundstation.systems.trajectory.columns import COLUMNS
from groundstation.systems.trajectory.examine import ANY, RECORDERS, recorder_of
from groundstation.tables.table import Flight, Table
from tests.systems.trajectory.made_answers import accepted, ambiguous, doubtful, short

ORDINARY = Configuration()
FORMATS = {"PX4": "raw.ulog.parameters", "ArduPilot": "raw.FMT", "MAVLink telemetry": "raw.HEARTBEAT"}
FORMATS |= {
    "ROS": "raw.gnss/fix",
    "u-blox": "raw.NAV-PVT",
    "NovAtel": "raw.BESTPOS",
    "cockpit recorder": "raw.g1000",
    "": "raw.pos",
}


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    """Two minutes of a car with increments at 50 Hz."""
    scenario = ImuScenario("drive", name="drive", unit=ImuSettings(duration_s=200.0, rate_hz=50.0))
    path = tmp_path_factory.mktemp("drive") / "drive.csv"
    write_csv(path, fly(scenario), scenario)
    return groundstation.open(path).flight.without("truth")


def changed(flight: Flight, topic: str, table: Table | None) -> Flight:
    """The flight with another table of a topic, or without it."""
    kept = {name: one for name, one in flight.tables.items() if name != topic}
    return replace(flight, tables=kept if table is None else {**kept, topic: table})


def told(flight: Flight) -> tuple[str, list[str]]:
    """State and shortfalls; where there is no answer the run gives the same reason."""
    found = usability_of_flight("trajectory", flight, ORDINARY)
    if found.state == "no" and any(topic.startswith("imu") for topic in flight.topics()):
        seen = seen_by_analyses(flight, ORDINARY)
        ran = run_analyses((flight_purposes()["trajectory"],), seen, known_of(seen, ORDINARY))
        assert ran.reasons["trajectory"] == found.shortfalls[0].text
    return found.state, [one.text for one in found.shortfalls]


def without(table: Table, *names: str) -> Table:
    return replace(table, columns={name: one for name, one in table.columns.items() if name not in names})


def test_a_whole_log_lacks_nothing(flight: Flight) -> None:
    assert told(flight) == ("yes", [])


def test_velocity_is_missed(flight: Flight) -> None:
    axes = [f"velocity_{axis}_mps" for axis in ("north", "east", "down")]
    state, texts = told(changed(flight, "gnss", without(flight["gnss"], *axes)))
    assert state == "in part" and texts[0] == f"no GNSS velocity in the log: {ANY.velocity}"
    state, texts = told(changed(flight, "gnss", without(flight["gnss"], axes[2])))
    assert (state, texts[0]) == ("in part", "no vertical velocity of GNSS")


def samples(flight: Flight, every: int) -> Flight:
    """The flight with point samples in place of increments, only some of them."""
    table = flight["imu"]
    step_s = table.values("interval_s")
    columns = {}
    for axis in "xyz":
        columns[f"rate_{axis}_dps"] = Column(np.rad2deg(table.values(f"delta_angle_{axis}_rad")) / step_s)
        columns[f"accel_{axis}_mps2"] = Column(table.values(f"delta_velocity_{axis}_mps") / step_s)
    return changed(flight, "imu", replace(table, columns=columns).take(np.arange(0, len(table), every)))


def test_point_samples_are_slow_or_too_slow(flight: Flight) -> None:
    state, texts = told(samples(flight, 1))
    assert state == "in part" and texts[0].startswith(
        "point samples of 50 Hz, 90 Hz or increments are needed: log incr"
    )
    state, texts = told(samples(flight, 3))
    assert state == "no" and "imu has point samples of 17 Hz" in texts[0] and texts[0].endswith(ANY.imu)


def test_a_short_ride_is_refused(flight: Flight) -> None:
    gnss, imu = flight["gnss"], flight["imu"]
    cut = changed(flight, "imu", imu.take(flight.seconds(imu.time_ns) < 50.0))
    cut = changed(cut, "gnss", gnss.take(flight.seconds(gnss.time_ns) < 50.0))
    state, texts = told(cut)
    assert state == "no" and "at least 60 s are needed" in texts[0]


@pytest.mark.parametrize("name", FORMATS)
def test_each_format_is_told_what_to_log(flight: Flight, name: str) -> None:
    bare = changed(flight, "imu", None)
    raw = Table(FORMATS[name], flight["gnss"].time_ns, {}, flight["gnss"].record_index, Column(flight["gnss"].time_ns))
    bare = changed(replace(bare, metadata={}), FORMATS[name], raw)
    recorder = recorder_of(bare)
    assert recorder.name == name and recorder in (*RECORDERS, ANY)
    assert told(bare) == ("no", [f"no inertial unit (topic imu) in the log: {recorder.imu}"])


def test_a_bag_is_known_by_the_types_of_its_topics(flight: Flight) -> None:
    bare = replace(changed(flight, "imu", None), metadata={"type.raw.fix": "sensor_msgs/NavSatFix (cdr)"})
    assert recorder_of(bare).name == "ROS"


def test_columns_have_what_the_log_shows() -> None:
    def values(answer: object) -> dict[str, object]:
        return {column.name: column.value(answer) for column in COLUMNS}  # type: ignore[arg-type]

    found = values(accepted())
    assert found["trajectory_state"] == "accepted" and found["outage_60s_rms_m"] == 1.25
    assert (found["antenna_forward_m"], found["antenna_down_m"]) == (0.61, None), "down is not observable"
    assert found["gnss_latency_imu_s"] == 0.112 and found["gnss_velocity_lag_s"] is None
    assert 0.5 < float(str(found["onboard_heading_rms_deg"])) < 2.2
    assert float(str(found["onboard_tilt_rms_deg"])) < 0.2
    assert values(doubtful())["onboard_heading_rms_deg"] is None, "a doubtful trajectory judges no filter"
    assert values(ambiguous())["trajectory_heading_sigma_deg"] is None
    assert values(short())["outage_60s_rms_m"] is None
