"""A log that contradicts itself is told so; odd but possible motion is not."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.findings import CONTRADICTION, Finding
from groundstation.integrity.ledger_findings import ledger_findings
from groundstation.integrity.survey import survey
from groundstation.readers.registry import read
from tests.real_logs import real_log

LENGTH_S, RATE_HZ = 300, 5
M_PER_DEG = 111_195.0
KNOT = 1852.0 / 3600.0
Columns = dict[str, np.ndarray]


def motion(
    speed_mps: float,
    turn_dps: float = 0.0,
    *,
    longitude_deg: float = 37.0,
    beside_deg: float = 0.0,
    noise_m: float = 1.0,
) -> Columns:
    """Columns of INS and GNSS that agree: a vehicle at one speed, in a turn, its nose ``beside_deg`` off its track."""
    rng = np.random.default_rng(5)
    time_s = np.arange(0.0, LENGTH_S, 1.0 / RATE_HZ)
    track = np.deg2rad(20.0 + turn_dps * time_s)
    north, east = speed_mps * np.cos(track), speed_mps * np.sin(track)
    latitude = 52.0 + np.cumsum(north) / RATE_HZ / M_PER_DEG
    longitude = longitude_deg + np.cumsum(east) / RATE_HZ / M_PER_DEG / np.cos(np.deg2rad(52.0))
    noise = rng.normal(0.0, noise_m / M_PER_DEG, (2, len(time_s)))
    velocity = rng.normal(0.0, 0.05, (2, len(time_s)))
    return {
        "time_s": time_s,
        "gnss.latitude_deg": latitude + noise[0],
        "gnss.longitude_deg": (longitude + noise[1] + 180.0) % 360.0 - 180.0,
        "gnss.velocity_north_mps": north + velocity[0],
        "gnss.velocity_east_mps": east + velocity[1],
        "gnss.altitude_msl_m": 300.0 + 5.0 * time_s,
        "baro.pressure_altitude_m": 150.0 + 4.6 * time_s,
        "ins.true_heading_deg": (np.rad2deg(track) + beside_deg) % 360.0,
        "ins.roll_deg": np.full(len(time_s), 3.0),
        "ins.pitch_deg": np.full(len(time_s), 2.0),
    }


def told(columns: Columns, folder: Path, head: str = "") -> list[Finding]:
    """Contradictions that the ledger of such a log tells."""
    path = folder / "log.csv"
    rows = np.column_stack(list(columns.values()))
    with path.open("w") as file:
        file.write(f"{head}{','.join(columns)}\n")
        np.savetxt(file, rows, fmt="%.9f", delimiter=",")
    found = ledger_findings(survey(read(path)).ledger)
    return [finding for finding in found if finding.code == CONTRADICTION]


def scaled(name: str, factor: float, offset: float = 0.0) -> Callable[[Columns], Columns]:
    return lambda columns: {**columns, name: columns[name] * factor + offset}


def swapped(columns: Columns) -> Columns:
    north, east = "gnss.velocity_north_mps", "gnss.velocity_east_mps"
    return {**columns, north: columns[east], east: columns[north]}


def in_knots(columns: Columns) -> Columns:
    names = ("gnss.velocity_north_mps", "gnss.velocity_east_mps")
    return {**columns, **{name: columns[name] / KNOT for name in names}}


FLYING = motion(80.0, 0.2)
WHEELS = {**motion(2.0, 0.3, noise_m=0.3), "odometry.speed_mps": np.full(LENGTH_S * RATE_HZ, 2.0)}


@pytest.mark.parametrize(
    ("change", "columns", "topic", "text"),
    [
        (in_knots, FLYING, "gnss", "imply 79.9 m/s, logged are 156 m/s"),
        (scaled("gnss.velocity_east_mps", -1.0), FLYING, "gnss", "deg off the way"),
        (swapped, FLYING, "gnss", "deg off the way"),
        (scaled("ins.true_heading_deg", -1.0, 360.0), FLYING, "ins", "off the track of an aircraft faster than 25 m/s"),
        (scaled("ins.true_heading_deg", 1.0, -145.0), WHEELS, "ins", "145 deg off the track of a vehicle on wheels"),
        (scaled("ins.roll_deg", 1.0, 86.6), WHEELS, "ins", "rolls by 89.6 deg"),
        (scaled("baro.pressure_altitude_m", 1.0 / 0.3048), FLYING, "gnss", "pressure altitude drift"),
    ],
)
def test_a_contradiction_is_told_with_its_figure(
    change: Callable[[Columns], Columns], columns: Columns, topic: str, text: str, tmp_path: Path
) -> None:
    (finding,) = told(change(columns), tmp_path)
    assert (finding.severity, finding.topic) == ("warn", topic)
    assert finding.text.startswith("this log contradicts itself: ") and text in finding.text
    assert "s in all" in finding.place


@pytest.mark.parametrize(
    "columns",
    [
        FLYING,
        WHEELS,
        motion(80.0, 3.0),  # holding
        motion(80.0, 0.2, longitude_deg=179.95),  # across the date line
        motion(80.0, 0.2, beside_deg=35.0),  # gale from the side
        motion(12.0, 1.0, beside_deg=90.0),  # a multirotor around a point of interest
        motion(12.0, 0.0, beside_deg=180.0),  # flown backwards
        motion(0.0, 0.0, noise_m=8.0),  # parked among houses
        scaled("ins.roll_deg", 1.0, 86.6)(motion(0.0)),  # a sensor on the bench, on its side
        scaled("gnss.altitude_msl_m", 1.0, 400.0)(FLYING),  # low pressure
    ],
)
def test_odd_motion_is_no_contradiction(columns: Columns, tmp_path: Path) -> None:
    assert told(columns, tmp_path) == []


def test_what_is_short_is_no_contradiction(tmp_path: Path) -> None:
    """A robot that reverses for half a minute."""
    back = (WHEELS["time_s"] > 100.0) & (WHEELS["time_s"] < 135.0)
    heading = np.where(back, WHEELS["ins.true_heading_deg"] + 180.0, WHEELS["ins.true_heading_deg"]) % 360.0
    assert told({**WHEELS, "ins.true_heading_deg": heading}, tmp_path) == []


def test_a_car_is_a_vehicle_on_wheels_by_its_head(tmp_path: Path) -> None:
    turned = scaled("ins.true_heading_deg", 1.0, 90.0)(motion(10.0, 0.3))
    assert told(turned, tmp_path) == []
    (finding,) = told(turned, tmp_path, "# always_on_ground: yes\n")
    assert "90 deg off the track of a vehicle on wheels" in finding.text


def test_the_robot_on_its_side_is_told() -> None:
    found = ledger_findings(survey(read(real_log("foreign/robot_localization_husky_test1.bag"))).ledger)
    texts = [finding.text for finding in found if finding.code == CONTRADICTION]
    assert any("rolls by 89.5 deg" in text for text in texts) and any("deg off the track" in text for text in texts)


@pytest.mark.parametrize(
    "name",
    [
        *("fixedwing/umn_thor_flight75.csv", "inertial/gv_ff02.csv"),
        *("g1000/log_220417_125002_LFQA.csv", "dataflash/plane_4.2.3_pilot0004.BIN", "ulog/quadrotor_local.ulg"),
    ],
)
def test_a_recorded_log_that_is_right_is_left_alone(name: str) -> None:
    found = ledger_findings(survey(read(real_log(name))).ledger)
    assert [finding.text for finding in found if finding.code == CONTRADICTION] == []


def test_the_vertical_velocity_of_the_reference_drive_is_upward() -> None:
    found = ledger_findings(survey(read(real_log("reference_heading/pntos_drive_first_half.csv"))).ledger)
    (text,) = [finding.text for finding in found if finding.code == CONTRADICTION]
    assert "velocity_down_mps of ins goes up with its height (correlation with its rate of sinking -1.00)" in text
    assert "climb and sink rate by it have the wrong sign" in text


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_vertical_velocity_with_the_other_sign_is_told(sign: float, tmp_path: Path) -> None:
    time_s = np.arange(LENGTH_S * RATE_HZ) / RATE_HZ
    climbing = {
        **FLYING,
        "ins.altitude_msl_m": 500.0 + 60.0 * np.sin(0.05 * time_s),
        "ins.velocity_down_mps": -sign * 3.0 * np.cos(0.05 * time_s),
    }
    found = [one for one in told(climbing, tmp_path) if "velocity_down_mps of ins goes up" in one.text]
    assert len(found) == (sign < 0)
