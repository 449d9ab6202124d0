"""The motor that a lost attitude points to, by what a mixer commands when one fails, and advice after it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import Column
from groundstation.chapters.parts import Facts
from groundstation.results.flight import FlightResults, NotAssessable
from groundstation.systems.health.answer import AutopilotHealth, SettingFound
from groundstation.systems.health.chapter import health
from groundstation.systems.health.figures import lanes_figure
from groundstation.systems.health.motors import ardupilot_ends
from groundstation.systems.health.plots import PLOTS
from groundstation.systems.health.system import SYSTEM
from groundstation.systems.system import Systems
from groundstation.tables.parameters import parameters_of
from groundstation.tables.table import Flight, Table
from groundstation.tables.vehicle import is_rotorcraft
from groundstation.viewer.recording import write_recording
from tests.recording_contents import Contents
from tests.report_example import example
from tests.systems.health.made import table
from tests.systems.health.test_ardupilot import END_S, answer, flight, parameters
from tests.systems.health.test_px4 import answered, new
from tests.told import next_steps

LOST_S, TIME = 50.0, np.arange(0.0, END_S, 0.1)
QUAD_X = ((-1.0, 1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, -1.0))  # roll and pitch that motors 1 to 4 of a quad X give
RANGE = {"RC3_MIN": 982.0, "RC3_MAX": 2006.0, "MOT_SPIN_MIN": 0.15, "MOT_SPIN_MAX": 0.95, "MOT_THST_EXPO": 0.65}
COPTER = {**RANGE, **{f"SERVO{number}_FUNCTION": 32.0 + number for number in range(1, 5)}, "FRAME_CLASS": 1.0}


def flown(dead: int | None = None, *, hover: float = 0.4, push: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Travel of each output (n, 4) and roll of a quad that a controller of rate and angle holds level.

    ``dead`` gives no thrust from ``LOST_S`` on; ``push`` is a torque, to and fro, that no motor can hold.
    """
    mixer = np.array(QUAD_X)
    angle, rate, spins, travel, roll = np.zeros(2), np.zeros(2), np.ones(4), [], []
    for now in TIME:
        asked = -0.02 * angle - 0.02 * rate
        thrust = np.clip(hover + mixer @ asked, 0.0, 1.0)
        spins[:] = 1.0
        if dead is not None and now >= LOST_S:
            spins[dead - 1] = 0.0
        torque = mixer.T @ (thrust * spins)
        if now >= LOST_S:
            torque = torque + push * np.array([np.sign(np.sin(12.0 * (now - LOST_S) + 0.1)), 0.3])
        if now >= LOST_S:  # what flew level before needs no steps
            rate = np.clip(rate + 60.0 * torque, -90.0, 90.0)
            angle = np.clip(angle + 0.1 * rate, -85.0, 85.0)
        travel.append((np.sqrt(0.35**2 + 4.0 * 0.65 * thrust) - 0.35) / 1.3)
        roll.append(angle[0])
    return np.array(travel), np.array(roll)


def made(travel: np.ndarray, roll: np.ndarray, *more: Table, **settings: float) -> Flight:
    """A flight of a copter whose outputs run from 1135 to 1954 us."""
    roll = np.where(TIME < LOST_S, 0.0, np.where(np.abs(roll) < 35.0, 40.0, roll))
    pulses = {f"C{number}": np.floor(1135.0 + 819.0 * travel[:, number - 1]) for number in range(1, 5)}
    attitude = table("raw.ATT", TIME, DesRoll=0.0, Roll=roll, DesPitch=0.0, Pitch=0.0)
    stated = parameters(AHRS_EKF_TYPE=3.0, **{**COPTER, **settings})
    one = flight(stated, attitude, table("raw.MODE", [0.0], ModeNum=5.0), table("raw.RCOU", TIME, **pulses), *more)
    return Flight(dict(one.tables), {"vehicle": "ArduCopter"}, 0, False, "made.bin")


def of_px4(**stated: float) -> Table:
    one = table("raw.ulog.parameters", np.zeros(len(stated)), value=list(stated.values()))
    columns = {**one.columns, "name": Column(np.array(list(stated))), "kind": Column(np.array(["value"] * len(stated)))}
    return replace(one, columns=columns)


def reason(found: AutopilotHealth, key: str = "tracking") -> str:
    return found.check(key).reason


@pytest.mark.parametrize(("dead", "opposite"), [(1, 2), (2, 1), (3, 4), (4, 3)])
def test_a_motor_that_fails_is_commanded_up_and_is_the_suspect(dead: int, opposite: int) -> None:
    found = answer(made(*flown(dead)))
    assert found.loss is not None and found.loss.start_s == pytest.approx(LOST_S) and found.loss.suspect == dead
    assert f"output {dead} at its highest (1954 us) for" in reason(found)
    assert f"output {opposite} at its lowest (1135 us) for" in reason(found)
    assert f"suspect motor, ESC or propeller of output {dead}" in reason(found)
    assert f"with output {dead} suspect (motor, ESC or propeller)" in found.sentence
    assert next(one for one in found.check("saturation").measures).figure == 1.0


def test_all_motors_at_full_point_to_thrust_and_to_no_motor() -> None:
    found = answer(made(*flown(hover=1.0)))
    assert found.loss is not None and found.loss.suspect is None and found.loss.all_full
    assert "too little thrust or a weak battery, no single motor suspect" in reason(found)
    assert "suspect" not in found.sentence


def test_a_collision_points_to_no_motor() -> None:
    """What is pushed to and fro is commanded to and fro: no output stands high for long."""
    found = answer(made(*flown(push=3.0)))
    assert found.loss is not None and found.loss.motors and found.loss.suspect is None
    assert "no single motor suspect" in reason(found)


def test_two_motors_alike_point_to_a_side_and_to_no_motor() -> None:
    travel = np.tile([1.0, 0.0, 0.0, 1.0], (len(TIME), 1))
    found = answer(made(travel, np.full(len(TIME), 60.0)))
    assert found.loss is not None and found.loss.suspect is None


def test_a_loss_without_outputs_is_told_without_motors() -> None:
    one = made(*flown(2))
    found = answer(Flight({name: part for name, part in one.tables.items() if name != "raw.RCOU"}, one.metadata, 0))
    assert found.loss is not None and found.loss.motors == () and "output" not in reason(found)


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ({**RANGE, "MOT_PWM_MIN": 0.0, "MOT_PWM_MAX": 0.0}, (1135.0, 1954.0)),  # 0: those of the throttle
        ({**RANGE, "MOT_PWM_MIN": 1000.0, "MOT_PWM_MAX": 2000.0}, (1150.0, 1950.0)),
        ({"RC3_MIN": 1100.0, "RC3_MAX": 1900.0, "THR_MIN": 130.0}, (1204.0, 1900.0)),  # before 3.4
        ({"RCMAP_THROTTLE": 1.0, "RC1_MIN": 1000.0, "RC1_MAX": 2000.0, "THR_MIN": 0.0}, (1000.0, 2000.0)),
        ({"MOT_SPIN_MIN": 0.15, "MOT_SPIN_MAX": 0.95}, None),
    ],
)
def test_the_limits_of_a_motors_output(stated: dict[str, float], expected: tuple[float, float] | None) -> None:
    assert ardupilot_ends(parameters_of(flight(parameters(**stated)))) == expected


def test_all_low_in_a_descent_is_no_limit_of_control() -> None:
    found = answer(made(np.zeros((len(TIME), 4)), np.zeros(len(TIME))))
    assert next(one for one in found.check("saturation").measures).figure == 0.0


def next_of(found: AutopilotHealth) -> dict[str, str]:
    missing = (NotAssessable("heading", "no straight taxi: of 11 epochs above 6 m/s before lift-off"),)
    results: FlightResults = replace(example(), answers={"health": found}, not_assessable=missing)
    section = next_steps(results)
    return (
        {}
        if section is None
        else {line: text for part in section.parts if isinstance(part, Facts) for line, text, _ in part.pairs}
    )


def test_advice_after_a_lost_attitude_is_to_inspect_and_never_to_taxi() -> None:
    told = next_of(answer(made(*flown(2))))
    assert told["Check"] == "For the lost attitude: motor, ESC, propeller and connector of output 2."
    assert next(iter(told)) == "Check" and "taxi" not in str(told)
    plane = answer(flight(table("raw.VIBE.0", TIME, IMU=0.0, VibeX=1.0, VibeY=1.0, VibeZ=1.0)))
    assert "taxi straight" in next_of(plane)["Fly"]


def test_what_failed_before_the_loss_is_inspected_too() -> None:
    field = np.where(TIME < 30.0, 30_000.0, 60_000.0)
    compass = table("magnetometer", TIME, field_forward_nt=field, field_right_nt=0.0, field_down_nt=0.0)
    told = next_of(answer(made(*flown(2), compass)))
    assert "output 2, the compass and its wiring" in told["Check"]


def test_what_failed_is_inspected_though_nothing_was_lost() -> None:
    """A log with a bad compass and a declination that is off is not answered with "taxi" alone."""
    offset = table("raw.MAG", TIME, MagX=200.0, MagY=0.0, MagZ=400.0, OfsX=700.0, OfsY=0.0, OfsZ=0.0)
    found = answer(flight(offset))
    setting = SettingFound("COMPASS_DEC", "declination", "deg", 11.1, 0.084, 0.4, "warn", "WMM-2025", "raw.PARM")
    told = next_of(replace(found, settings_found=(setting,)))
    assert told["Check"] == ("The setting COMPASS_DEC (11.1° set, 0.084° found), the compass and its wiring.")
    assert "Check" not in next_of(answer(flight(table("raw.VIBE.0", TIME, IMU=0.0, VibeX=1.0, VibeY=1.0, VibeZ=1.0))))


def test_the_battery_is_told_with_times_though_no_limit_judges_it() -> None:
    volt, ampere = np.where(TIME < LOST_S, 14.0, 12.32), np.where(TIME == LOST_S, 45.1, 20.0)
    battery = table("raw.BAT", TIME, Volt=volt, Curr=ampere)
    found = answer(made(*flown(2), battery, table("raw.POWR", TIME, Vcc=5.07)))
    told = reason(found, "battery")
    assert told.startswith(
        "battery 1 down to 12.3 V at 0:50.0 (14.0 V before the loss), up to 45.1 A at 0:50.0 (20.0 A"
    )
    assert "supply of the board up to 5.07 V" in told
    alone = answer(flight(battery))
    assert alone.check("battery").verdict == "not_logged" and "down to 12.3 V at 0:50.0" in reason(alone, "battery")


def test_outputs_of_px4_by_actuator_motors_and_by_pulses() -> None:
    travel, _ = flown(3)
    turned = np.where(TIME < LOST_S, 1.0, np.cos(np.deg2rad(60.0) / 2.0))
    level = {"q_d__0": 1.0, "q_d__1": 0.0, "q_d__2": 0.0, "q_d__3": 0.0}
    own = (
        table("raw.vehicle_attitude_setpoint", TIME, **level),
        table("raw.vehicle_attitude", TIME, q__0=turned, q__1=np.sqrt(1.0 - turned**2), q__2=0.0, q__3=0.0),
    )
    rest = [one for one in new() if "attitude" not in one.topic and "actuator" not in one.topic]
    shares = table("raw.actuator_motors", TIME, **{f"control__{k}": travel[:, k] for k in range(4)})
    pulses = table("raw.actuator_outputs", TIME, **{f"output__{k}": 1000.0 + 900.0 * travel[:, k] for k in range(4)})
    stated = of_px4(PWM_MAIN_MIN=1000.0, PWM_MAIN_MAX=1900.0, **{f"PWM_MAIN_FUNC{k}": 100.0 + k for k in range(1, 5)})
    for tables, words in (((shares,), "output 3 at its highest (1) for"), ((pulses, stated), "(1900 us) for")):
        found = answered(*rest, *own, *tables)
        assert found.loss is not None and found.loss.suspect == 3 and words in reason(found)


def test_a_kind_that_cannot_taxi() -> None:
    kinds = {2.0: True, 1.0: False, 10.0: False, 4.0: True}
    for kind, expected in kinds.items():
        status = table("raw.vehicle_status", [0.0, 1.0], system_type=kind)
        assert is_rotorcraft(Flight({status.topic: status}, {}, 0, False, "made.ulg")) == expected


def test_the_panel_has_each_output_around_the_loss() -> None:
    found = answer(made(*flown(2)))
    plot = PLOTS["health.motors"](replace(example(), answers={"health": found}, figures=found.figures))
    assert plot is not None
    marks = plot.rows[0].panels[0].marks
    assert [mark.name for mark in marks if mark.name.startswith("output")] == [f"output {k}" for k in range(1, 5)]
    x = next(mark.x for mark in marks if mark.name == "output 1")  # type: ignore[attr-defined]
    assert x.min() == pytest.approx(LOST_S - 3.0) and x.max() == pytest.approx(LOST_S + 5.0)


def test_the_recording_shows_the_seconds_around_the_loss_on_an_axis_of_their_own(tmp_path: Path) -> None:
    one = made(*flown(2))
    found = answer(one)
    results = replace(example(), answers={"health": found}, figures=found.figures)
    plot = PLOTS["health.motors"](results)
    assert plot is not None
    (window,) = plot.rows[0].panels[0].x.windows
    assert window == pytest.approx((LOST_S - 3.0, LOST_S + 5.0))
    write_recording(tmp_path / "a.rrd", one, results, Systems((SYSTEM,)))
    contents = Contents(tmp_path / "a.rrd")
    chart = [path for path in contents.fixed if path.startswith("/health/motors/1/")]
    (cursor,) = {path for path in contents.batches if path.startswith("/health/motors/") and path.endswith("/cursor")}
    shown_s = np.sort(contents.times(cursor)) / 1e9
    assert chart and shown_s[0] > LOST_S - 3.1 and shown_s[-1] < LOST_S + 5.2
    assert not any("/health/motors/" in path and "lines" in path for path in contents.batches)


def test_the_first_line_says_what_failed_first_and_a_list_says_the_rest() -> None:
    lost = made(*flown(2), table("raw.ERR", [LOST_S + 2.0], Subsys=12.0, ECode=1.0))
    found = answer(lost)
    section = health(replace(example(), answers={"health": found}, figures=found.figures))
    assert section is not None and section.claim is not None
    first, rest = section.claim.headline, section.claim.sentences
    assert "control of attitude lost" in first.lower() and "output 2 suspect" in first and ";" not in first
    bad = sum(one.is_bad for one in found.checks)
    assert bad > 1 and len(rest) >= bad and "checks pass" in rest[-1]
    assert not any(first in one for one in rest) and all(one.endswith(".") for one in rest)


def test_lanes_end_with_the_log_and_are_not_logged_in_its_pauses() -> None:
    time = np.concatenate([np.arange(0.0, 30.0, 0.2), np.arange(50.0, 90.0, 0.2)])
    slow = table("raw.PM", [5.0, 15.0, 25.0, 55.0, 65.0, 75.0, 85.0], NLon=0.0, NL=4000.0)
    vibe = table("raw.VIBE.0", time, IMU=0.0, VibeX=1.0, VibeY=1.0, VibeZ=1.0)
    one = flight(slow, vibe)
    tables = {name: part.take(part.time_ns <= 90 * 10**9) for name, part in one.tables.items()}
    found = answer(Flight(tables, {}, 0, False, "made.bin"))
    lanes = next(part for part in found.figures if part.name == "health_lanes")
    assert isinstance(lanes, type(lanes_figure([], [], 0.0, (np.zeros(0), np.zeros(0)))))
    assert lanes.end_s.max() <= 90.0
    quiet = lanes.where(lanes.grade == "not logged")
    assert set(quiet.check) == {"timing and log", "vibration"}
    assert quiet.start_s.tolist() == pytest.approx([29.8] * 2, abs=0.01)
    assert quiet.end_s.tolist() == pytest.approx([50.0] * 2, abs=0.01)
    others = lanes.where(lanes.grade != "not logged")
    assert not np.any((others.start_s < 49.9) & (others.end_s > 29.9))


def test_the_worst_value_lies_in_a_span_that_counts() -> None:
    """A peak of one sample, shorter than the limit must last, is not the worst of a span elsewhere."""
    field = np.where((TIME > 30.0) & (TIME < 33.0), 1.3, 1.0)
    field[np.argmin(np.abs(TIME - 60.0))] = 1.4
    made_of = table("magnetometer", TIME, field_forward_nt=30_000.0 * field, field_right_nt=0.0, field_down_nt=0.0)
    one = next(each for each in answer(flight(made_of)).measures if each.quantity == "field_change")
    assert one.worst == pytest.approx(0.3, abs=1e-6) and 30.0 < one.worst_at_s < 33.0
    assert one.span_start_s is not None and one.span_start_s <= one.worst_at_s
