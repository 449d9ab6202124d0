"""Settings of an autopilot by its own log: off their defaults, changed in flight, beside what the flight shows."""

from dataclasses import replace

import numpy as np
import pytest

import groundstation
from groundstation.base.records import Column
from groundstation.results.roles import Delay, Delays
from groundstation.systems.health.evidence import whole_log
from groundstation.systems.health.parameters import events, settings_of
from groundstation.systems.known import Known
from groundstation.tables.estimator_in_use import estimator_in_use
from groundstation.tables.parameters import parameters_of
from groundstation.tables.table import Flight, Table
from tests.real_logs import real_log
from tests.systems.health.made import KNOWN, table

UTC_NS = 1_720_000_000_000_000_000  # 2024-07-03


def named(topic: str, name: str, names: list[str], **columns: object) -> Table:
    made = table(topic, np.arange(len(names)), **columns)  # type: ignore[arg-type]
    return replace(made, columns={**made.columns, name: Column(np.array(names))})


def dataflash(*, defaults: list[float] | None = None, **values: float) -> Table:
    more = {} if defaults is None else {"Default": defaults}
    return named("raw.PARM", "Name", list(values), Value=list(values.values()), **more)


def flight(*tables: Table, has_utc: bool = True) -> Flight:
    return Flight({one.topic: one for one in tables}, {}, UTC_NS if has_utc else 0, has_utc, "made.bin")


def gnss() -> Table:
    time_ns = UTC_NS + np.arange(10, dtype=np.int64) * 200_000_000
    one = table("gnss", np.arange(10.0), latitude_deg=47.0, longitude_deg=8.0, altitude_msl_m=500.0)
    return replace(one, time_ns=time_ns)


class _Found(Delays):
    def __init__(self, latency_s: float, sigma_s: float) -> None:
        self._one = Delay()
        self._one.latency_s, self._one.sigma_s, self._one.confidence95_s = latency_s, sigma_s, None

    def observed(self, reference: str, other: str) -> Delay | None:
        return self._one if (reference, other) == ("ins", "gnss") else None


def test_defaults_come_from_the_log_alone() -> None:
    silent = parameters_of(flight(dataflash(A=1.0, B=2.0)))
    assert not silent.has_defaults and silent.differing == ()
    told = parameters_of(flight(dataflash(A=1.0, B=2.0, C=3.0, defaults=[1.0, 1.5, np.nan])))
    assert told.has_defaults and [(one.name, one.default) for one in told.differing] == [("B", 1.5)]
    again = named("raw.PARM", "Name", ["A", "A"], Value=[1.0, 2.0], Default=[1.0, np.nan])  # set in flight
    changed = parameters_of(flight(again))
    assert [(one.first, one.value, one.default) for one in changed.changed] == [(1.0, 2.0, 1.0)]
    assert changed.differing == changed.changed


def test_a_ulog_without_a_default_for_a_parameter_says_that_it_is_at_it() -> None:
    kinds = ["initial", "initial", "initial", "system default", "default of the configuration"]
    one = named("raw.ulog.parameters", "name", ["A", "B", "C", "A", "B"], value=[1.0, 2.0, 3.0, 0.5, 2.0])
    one = replace(one, columns={**one.columns, "kind": Column(np.array(kinds))})
    told = parameters_of(flight(one))
    assert [(each.name, each.value, each.default) for each in told.differing] == [("A", 1.0, 0.5)]
    assert told.by_name["C"].default == 3.0
    silent = parameters_of(flight(one.take(slice(0, 3))))
    assert not silent.has_defaults and silent.by_name["C"].default is None


@pytest.mark.parametrize("field", ["Name", "Value"])
def test_columns_of_another_kind_are_no_parameters(field: str) -> None:
    one = dataflash(A=1.0)
    wrong = Column(np.array([1.0])) if field == "Name" else Column(np.array(["x"]))
    assert parameters_of(flight(replace(one, columns={**one.columns, field: wrong}))).by_name == {}
    assert parameters_of(flight()).by_name == {} and estimator_in_use(flight()) is None


def test_the_estimator_that_flew() -> None:
    def name(**values: float) -> str:
        found = estimator_in_use(flight(dataflash(**values)))
        return "" if found is None else found.name

    assert name(AHRS_EKF_USE=0.0) == "DCM" and name(AHRS_EKF_USE=1.0) == "EKF1"
    assert name(AHRS_EKF_TYPE=2.0, AHRS_EKF_USE=0.0) == "DCM"  # a plane of 3.3 to 3.5
    assert name(AHRS_EKF_TYPE=3.0) == "EKF3" and name(AHRS_EKF_TYPE=11.0) == "external"
    assert name(EKF2_EN=1.0) == "PX4 EKF2" and name(SYS_MC_EST_GROUP=1.0) == "PX4 LPE" and name(OTHER=1.0) == ""
    attitude = table("raw.ATT", np.arange(10.0), AEKF=np.where(np.arange(10) < 6, 3.0, 0.0))
    found = estimator_in_use(flight(dataflash(AHRS_EKF_TYPE=3.0), attitude, table("raw.NKF1", [0.0], VN=0.0)))
    assert found is not None and (found.name, found.names, found.others) == ("EKF3", ("EKF3", "DCM"), ("EKF2",))
    assert found.at("DCM", attitude.time_ns).tolist() == [False] * 6 + [True] * 4


@pytest.mark.parametrize(("latency_s", "verdict"), [(0.13, "pass"), (0.3, "warn")])
def test_the_delay_that_is_set_beside_the_one_found(latency_s: float, verdict: str) -> None:
    log = flight(dataflash(EKF2_GPS_DELAY=110.0), gnss(), table("ins", [0.0], roll_deg=0.0))
    known = replace(KNOWN, answers={"latency": _Found(latency_s, 0.005)})  # type: ignore[dict-item]
    (row,) = settings_of(log, known).found
    assert (row.stated, row.found, row.verdict) == (0.11, latency_s, verdict)
    (event,) = events(settings_of(log, known), whole_log(log))
    assert event.grade == ("warn" if verdict == "warn" else "info")
    (unknown,) = settings_of(log, KNOWN).found
    assert (
        unknown.verdict == "not_logged"
        and unknown.found is None
        and not events(settings_of(log, KNOWN), whole_log(log))
    )


def test_a_delay_of_zero_is_that_of_the_driver() -> None:
    (row,) = settings_of(flight(dataflash(GPS_DELAY_MS=0.0)), KNOWN).found
    assert row.verdict == "not_logged" and "driver" in row.reason


@pytest.mark.parametrize(("stated_deg", "verdict"), [(3.3, "pass"), (11.0, "warn")])
def test_the_declination_that_is_set_beside_the_world_model(stated_deg: float, verdict: str) -> None:
    log = flight(dataflash(COMPASS_DEC=np.deg2rad(stated_deg), COMPASS_AUTODEC=0.0), gnss())
    (row,) = settings_of(log, KNOWN).found
    assert row.verdict == verdict and row.found == pytest.approx(3.3, abs=0.5)
    assert ("true headings 7." in row.told and row.told.endswith("deg too large")) == (verdict == "warn")
    table = flight(dataflash(COMPASS_DEC=np.deg2rad(stated_deg), COMPASS_AUTODEC=1.0), gnss())
    (by_table,) = settings_of(table, KNOWN).found
    assert by_table.verdict == ("pass" if verdict == "pass" else "not_logged"), "replaced at the first fix"
    assert by_table.found == row.found and not by_table.consequence
    for other in (
        flight(dataflash(COMPASS_DEC=0.2), gnss(), has_utc=False),
        flight(dataflash(COMPASS_DEC=0.2)),
        flight(dataflash(COMPASS_DEC=0.2, COMPASS_USE=0.0), gnss()),
        flight(dataflash(COMPASS_DEC=0.0, COMPASS_AUTODEC=1.0), gnss()),
    ):
        (row,) = settings_of(other, KNOWN).found
        assert row.verdict == "not_logged" and row.found is None


def test_settings_that_no_flight_measures_are_told_and_not_judged() -> None:
    log = flight(dataflash(GPS_POS1_X=0.3, GPS_POS1_Y=0.0, GPS_POS1_Z=-0.4, AHRS_ORIENTATION=8.0))
    rows = settings_of(log, Known(KNOWN.phases)).found
    assert [(row.verdict, row.stated) for row in rows] == [("not_logged", 0.5), ("not_logged", 8.0)]


def test_recorded_logs() -> None:
    erle = groundstation.open(real_log("dataflash/erle_plane_4-12-2014_329.BIN")).flight
    found = estimator_in_use(erle)
    assert found is not None and (found.name, found.source, found.others) == ("DCM", "AHRS_EKF_USE = 0", ("EKF1",))
    plane = groundstation.open(real_log("dataflash/plane_4.2.3_pilot0004.BIN")).flight
    (row,) = [one for one in settings_of(plane, KNOWN).found if one.what == "declination"]
    assert row.verdict == "warn" and row.stated == pytest.approx(11.08, abs=0.01)  # set by hand, 11 deg too much
    quadrotor = groundstation.open(real_log("ulog/quadrotor_local.ulg")).flight
    assert len(settings_of(quadrotor, KNOWN).differing) == 106
