"""Canonical ``ins`` holds the estimate that flew, and nothing of a filter without states."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import Damage, RecordBatch, Remark
from groundstation.readers import registry
from groundstation.tables.filter_of_ins import TRUTH, filter_of_ins
from tests.readers.dataflash_writer import DataFlash
from tests.readers.telemetry_writer import START_US, Telemetry
from tests.readers.test_dataflash import Log
from tests.tables.test_phases import flight_of, light_aircraft

NAMES = {"XKF": 3, "NKF": 2, "EKF": 1}
UNREADY, NO_ATTITUDE = 128, None


def ardupilot(
    tmp_path: Path,
    family: str = "XKF",
    unready: int = 0,
    flew: tuple[int | None, ...] = (3,),
    kind: float | None = 3.0,
    cores: int = 1,
) -> Log:
    """Return ten rows of a filter; the first of them written before it was initialised, ``flew`` along them."""
    made = DataFlash()
    made.define_units({"#": "instance", "-": ""}, {"-": 0.0})
    has_kind = flew[0] is not NO_ATTITUDE
    made.define(1, "PARM", "QNf", "TimeUS,Name,Value")
    made.define(2, "ATT", "QccC" + "B" * has_kind, "TimeUS,Roll,Pitch,Yaw" + ",AEKF" * has_kind)
    made.define(3, f"{family}1", "QBfff", "TimeUS,C,VN,VE,VD")
    made.define(4, f"{family}2", "QBff", "TimeUS,C,VWN,VWE")
    made.define(5, f"{family}4", "QBHb", "TimeUS,C,FS,PI")
    made.define(6, "AHR2", "QccC", "TimeUS,Roll,Pitch,Yaw")
    if cores > 1:
        for number, layout in ((1, "s#---"), (2, "s#--"), (4, "s#--")):
            made.units(f"{family}{number}", layout, "-" * len(layout))
    for name, value in (("AHRS_EKF_TYPE", kind), ("COMPASS_DEC", 0.1), ("COMPASS_AUTODEC", 0.0)):
        if value is not None:
            made.write("PARM", 1, name, value)
    for row in range(10):
        time_us = 1_000_000 + row * 100_000
        which = flew[min(row * len(flew) // 10, len(flew) - 1)]
        made.write("ATT", time_us, 100, 200, 9000, *([] if which is None else [which]))
        made.write("AHR2", time_us, 100, 200, 9000)
        for core in range(cores):
            is_unready = row < unready or core > 0
            velocity = (0.0, 0.0, 0.0) if is_unready else (1.0 + row, 0.0, 0.0)
            made.write(f"{family}1", time_us, core, *velocity)
            made.write(f"{family}2", time_us, core, 0.0 if is_unready else 3.0, 0.0)
            made.write(f"{family}4", time_us, core, UNREADY if is_unready else 0, 0)
    return Log(tmp_path / "made.BIN", made.content)


@pytest.mark.parametrize("family", ["XKF", "NKF", "EKF"])
def test_a_filter_that_is_not_initialised_gives_no_velocity(tmp_path: Path, family: str) -> None:
    number = NAMES[family]
    kind = None if family == "EKF" else float(number)
    log = ardupilot(tmp_path, family, unready=4, flew=(number,), kind=kind)
    assert log.present("ins", "velocity_north_mps") == [5.0, 6.0, 7.0, 8.0, 9.0, 10.0], "not one row too many"
    assert log.present("air", "wind_north_mps") == [3.0] * 6
    assert log.present(f"raw.{family}1", "VN")[:4] == [0.0] * 4, "the log's own values stay"
    (told,) = [one for one in log.damages if one.kind == "no_solution"]
    assert told.count == 8 and f"{family}1 and {family}2" in told.what and not told.loses_data


def test_a_second_core_without_states_says_nothing_of_the_first(tmp_path: Path) -> None:
    log = ardupilot(tmp_path, cores=2)
    assert log.present("ins", "velocity_north_mps") == [1.0 + row for row in range(10)]
    assert not [one for one in log.damages if one.kind == "no_solution"]


def test_a_filter_that_stands_still_keeps_its_zeros(tmp_path: Path) -> None:
    log = ardupilot(tmp_path)
    assert log.present("ins", "velocity_east_mps") == [0.0] * 10


def test_the_filter_beside_dcm_is_the_second_estimate(tmp_path: Path) -> None:
    log = ardupilot(tmp_path, flew=(0,))
    assert not log.flight["ins"].has("velocity_north_mps") and "air" not in log.flight.topics()
    assert log.present("ins.2", "velocity_north_mps")[0] == 1.0
    assert log.derived("ins", "true_heading_deg").startswith("yaw of ATT (DCM) with compass")
    assert log.derived("ins.2", "velocity_north_mps") == "velocity of XKF1, not in use"


def test_each_estimator_that_flew_gives_its_own_rows(tmp_path: Path) -> None:
    log = ardupilot(tmp_path, flew=(0, 3))
    assert log.present("ins", "velocity_north_mps") == [6.0, 7.0, 8.0, 9.0, 10.0]
    assert log.present("ins.2", "velocity_north_mps") == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert log.derived("ins", "true_heading_deg").startswith("yaw of ATT (DCM and EKF3)")
    told = {f"derived.{topic}.x": log.derived(topic, "velocity_north_mps") for topic in ("ins", "ins.2")}
    assert "while another estimator" in told["derived.ins.2.x"] and "while it" in told["derived.ins.x"]


@pytest.mark.parametrize(("flew", "kind"), [((10,), 10.0), ((NO_ATTITUDE,), 10.0)])
def test_the_truth_of_a_simulator_is_no_filter(tmp_path: Path, flew: tuple[int | None, ...], kind: float) -> None:
    log = ardupilot(tmp_path, flew=flew, kind=kind)
    origin = log.derived("ins", "true_heading_deg")
    assert origin == "yaw of ATT (the simulator's truth, no estimate)"
    assert log.present("ins.2", "velocity_north_mps")[0] == 1.0 and not log.flight["ins"].has("velocity_north_mps")
    flight = flight_of(light_aircraft())
    metadata = {"derived.ins.true_heading_deg": origin, "parameter.AHRS_EKF_TYPE": "10"}
    of = filter_of_ins(replace(flight, metadata=metadata), "ins")
    assert (of.name, of.flew) == (TRUTH, None), "it estimated nothing, and flew nothing"


def telemetry(kind: float, flags: tuple[int, ...]) -> bytes:
    """Return a second of positions after each status of the filter; the vehicle stands still."""
    log = Telemetry()
    log.add("param_value", b"AHRS_EKF_TYPE", kind, 9, 1, 0, time_us=START_US)
    for second, flag in enumerate(flags):
        time_us = START_US + second * 1_000_000
        log.add("ekf_status_report", flag, 0.1, 0.1, 0.1, 0.1, 0.1, time_us=time_us + 1_000)
        for row in range(4):
            at_us = time_us + 2_000 + row * 200_000
            stamp = (at_us - START_US) // 1_000
            log.add("attitude", stamp, 0.1, -0.2, 1.0, 0.0, 0.0, 0.0, time_us=at_us)
            velocity = (0, 0, 0) if second < 2 else (100, 0, 0)
            log.add("global_position_int", stamp, 550_000_000, 370_000_000, 200_000, 0, *velocity, 0, time_us=at_us)
    return bytes(log.data)


def test_telemetry_of_a_filter_without_states_gives_no_velocity(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(telemetry(3.0, (1024, 831, 1024)))
    items = list(registry.read(path))
    batches = [one for one in items if isinstance(one, RecordBatch) and one.topic == "ins"]
    columns = [one.columns["velocity_north_mps"] for one in batches if "velocity_north_mps" in one.columns]
    north = np.concatenate([one.values[one.mask] for one in columns]).tolist()
    assert north == [0.0] * 4 + [1.0] * 4, "zeros go where the status says so"
    assert sum(one.columns["latitude_deg"].mask.sum() for one in batches if "latitude_deg" in one.columns) == 12
    (told,) = [one for one in items if isinstance(one, Damage) and one.kind == "no_solution"]
    assert told.count == 4


@pytest.mark.parametrize(
    ("kind", "told"),
    [(3.0, "attitude of the autopilot's filter"), (0.0, "attitude by DCM"), (10.0, "the simulator's truth")],
)
def test_telemetry_names_the_source_of_the_attitude(tmp_path: Path, kind: float, told: str) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(telemetry(kind, (831,)))
    origins = [one.text for one in registry.read(path) if isinstance(one, Remark) and "true_heading_deg" in one.fields]
    assert len(origins) == 1 and f"from {told} (ATTITUDE)" in origins[0]
    assert np.all(["filter" in one for one in origins]) == (kind == 3.0)


@pytest.mark.parametrize("kind", [float("nan"), float("inf")])
@pytest.mark.parametrize("flew", [(3,), (NO_ATTITUDE,)])
def test_a_parameter_that_is_no_number_names_no_estimator(
    tmp_path: Path, flew: tuple[int | None, ...], kind: float
) -> None:
    log = ardupilot(tmp_path, flew=flew, kind=kind)
    topic = "ins" if flew == (3,) else "ins.2"
    assert log.present(topic, "velocity_north_mps") == [1.0 + row for row in range(10)]
