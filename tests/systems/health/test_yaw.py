"""Yaw of the autopilot against its own compass."""

from pathlib import Path

import numpy as np
import pytest

import groundstation
from groundstation.base.angles import wrap_360
from groundstation.systems.health import yaw
from groundstation.systems.health.analysis import HEALTH
from groundstation.systems.health.answer import Check
from groundstation.systems.health.settings import HealthSettings
from groundstation.systems.known import Known
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight, Table
from tests.real_logs import real_log
from tests.systems.health.made import KNOWN, table
from tests.systems.health.test_ardupilot import flight, parameters

TIME = np.arange(0.0, 100.0, 0.1)
HEADING = wrap_360(350.0 + TIME)  # through north
FIELD_NT = np.array([18_000.0, 0.0, 44_000.0])  # north, east, down: magnetic


def made(
    error: np.ndarray | float = 0.0, roll: np.ndarray | float = 0.0, declination: float = 0.1, **stated: float
) -> Flight:
    """Return a flight whose yaw is off the magnetic field; roll and pitch turn it as they turn a body."""
    pitch = 5.0
    h, p, r = (
        np.deg2rad(HEADING - np.rad2deg(declination)),
        np.deg2rad(pitch),
        np.deg2rad(np.broadcast_to(roll, TIME.shape)),
    )
    ahead, aside = FIELD_NT[0] * np.cos(h), -FIELD_NT[0] * np.sin(h)
    forward, below = ahead * np.cos(p) - FIELD_NT[2] * np.sin(p), ahead * np.sin(p) + FIELD_NT[2] * np.cos(p)
    right, down = aside * np.cos(r) + below * np.sin(r), -aside * np.sin(r) + below * np.cos(r)
    compass = table("magnetometer", TIME, field_forward_nt=forward, field_right_nt=right, field_down_nt=down)
    heading = wrap_360(HEADING + error)
    ins = table("ins", TIME, roll_deg=roll, pitch_deg=pitch, true_heading_deg=heading)
    return flight(ins, compass, parameters(COMPASS_DEC=declination, **stated))


def check(one: Flight) -> Check:
    return HEALTH.run(one, KNOWN, HealthSettings()).answer.check("yaw")


@pytest.mark.parametrize("roll", [0.0, 25.0, -25.0])
def test_a_yaw_that_follows_the_compass_passes(roll: float) -> None:
    (one,) = yaw.evidence(made(roll=roll))
    assert np.nanmax(one.value) < 1e-9, "tilt-compensated, with the declination that is set"
    assert check(made(roll=roll)).verdict == "pass"


def test_a_finding_names_the_compass() -> None:
    told = [one for one in HEALTH.run(made(40.0), KNOWN, HealthSettings()).findings if one.code == "health.yaw"]
    assert [one.topic for one in told] == ["magnetometer"] and "above 20 deg for 100 % of the time" in told[0].text


@pytest.mark.parametrize(
    ("error", "verdict"),
    [
        (np.where((TIME > 30.0) & (TIME < 55.0), 65.0, 0.0), "fail"),
        (np.where((TIME > 30.0) & (TIME < 55.0), -40.0, 0.0), "warn"),
        (np.where((TIME > 30.0) & (TIME < 34.0), 65.0, 0.0), "pass"),
        (np.full(len(TIME), 15.0), "pass"),
    ],
)
def test_what_lasts_is_told_and_a_turn_is_not(error: np.ndarray, verdict: str) -> None:
    found = check(made(error))
    assert found.verdict == verdict
    if verdict != "pass":
        (measure,) = found.measures
        assert measure.worst == pytest.approx(np.abs(error).max(), abs=1e-6)
        assert (measure.span_start_s, measure.span_end_s) == pytest.approx((30.1, 55.0), abs=0.2)
        assert "ArduPilot" in measure.threshold_source and measure.amber == 20.0


def test_what_cannot_be_compared_is_not() -> None:
    assert np.isnan(next(iter(yaw.evidence(made(roll=45.0)))).value).all(), "the steep field turns with the lean"
    for stated in ({"COMPASS_USE": 0.0}, {"EK3_SRC1_YAW": 6.0}, {"EKF2_EV_CTRL": 8.0}):
        assert not list(yaw.evidence(made(90.0, **stated))), stated
    assert check(flight(parameters(COMPASS_DEC=0.1), table("raw.VIBE.0", TIME, IMU=0.0, VibeX=1.0))).verdict == (
        "not_logged"
    )


def test_a_position_without_a_date_or_a_setting_tells_no_declination() -> None:
    one = made(declination=0.0)
    place = table("gnss", TIME, latitude_deg=52.0, longitude_deg=-2.5, altitude_msl_m=100.0)
    assert list(yaw.evidence(one)) and not list(yaw.evidence(_with(one, place)))


def _with(one: Flight, more: Table) -> Flight:
    return Flight({**one.tables, more.topic: more}, {}, 0, False, "made.bin")


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "verdict"),
    [
        ("dataflash/plane_4.2.3_pilot0004.BIN", "warn"),
        ("dataflash/copter_3.6.7_log0041.BIN", "pass"),
        ("dataflash/TestLog2_REENCODED_plane.BIN", "pass"),
        ("ulog/px4_rs_esc_status.ulg", "pass"),
        ("tlog/uavlogviewer_vtol.tlog", "pass"),
    ],
)
def test_recorded_logs(name: str, verdict: str) -> None:
    path: Path = real_log(name)
    one = groundstation.open(path).flight
    found = HEALTH.run(one, Known(flight_phases(one)), HealthSettings()).answer.check("yaw")
    assert found.verdict == verdict
    if verdict == "warn":  # moved by hand while DCM, not the filter, gave the attitude
        assert found.measures[0].worst == pytest.approx(64.7, abs=0.5)
