"""Errors of the on-board filter: constants are told and taken off, true errors found, none invented."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.records import HEADING_IS_TRACK, Column
from groundstation.base.units import NS_PER_S
from groundstation.plots.marks import Curve
from groundstation.systems.trajectory.arrays import TrajectoryOnboard
from groundstation.systems.trajectory.onboard import ComparedFilter, compare_onboard
from groundstation.systems.trajectory.onboard_answer import OnboardError, OnboardErrors
from groundstation.systems.trajectory.onboard_filters import FIELDS, filters_of
from groundstation.systems.trajectory.onboard_plots import onboard_attitude
from groundstation.systems.trajectory.quantity_answer import Quantity
from groundstation.systems.trajectory.sampling import at_times
from groundstation.systems.trajectory.solution import TrackOfStates
from groundstation.tables.table import Flight, Table
from tests.systems.trajectory.made import onboard, track
from tests.systems.trajectory.made_answers import accepted, results_of

TRACK = track()


def compared(flight: Flight, of: object = TRACK) -> ComparedFilter:
    """The comparison, which must be there."""
    (first, *_) = filters_of(flight)
    found = compare_onboard(of, flight, first)  # type: ignore[arg-type]
    assert found is not None
    return found


def row(errors: OnboardErrors, quantity: Quantity) -> OnboardError:
    """The row of a quantity, which must be there."""
    found = errors.row(quantity)
    assert found is not None, quantity
    return found


def test_a_filter_that_is_right_has_no_wrong_span_and_no_offset() -> None:
    for seed in range(5):
        errors = compared(onboard(TRACK, seed=seed)).errors
        assert not any(one.spans for one in errors.rows), [one for one in errors.rows if one.spans]
        assert row(errors, "heading").offset_cause == "" and row(errors, "horizontal position").offset_cause == ""
        assert row(errors, "heading").rms == pytest.approx(0.05, abs=0.005)
        assert row(errors, "vertical position").offset == pytest.approx(-14.5, abs=0.05)
        assert row(errors, "vertical position").offset_cause == "datum"
        assert errors.delay_s == pytest.approx(0.0, abs=0.005)


def test_a_heading_that_is_wrong_from_a_moment_on_is_told_with_its_sigma() -> None:
    time_s = np.arange(TRACK.time_s[0] + 1.0, TRACK.time_s[-1] - 1.0, 0.1)
    errors = compared(onboard(TRACK, heading_error_deg=np.where(time_s > 400.0, 2.1, 0.0))).errors
    heading = row(errors, "heading")
    (span,) = heading.spans
    assert span.value == pytest.approx(2.1, abs=0.1)
    assert (span.start_s, span.end_s) == pytest.approx((400.5, 598.5), abs=1.5)
    assert 0.15 < span.half95 < 0.5, "1.96 times the smoothed sigma, hardly less by averaging"
    assert not row(errors, "roll").spans and not row(errors, "horizontal velocity").spans


def test_an_error_inside_our_own_sigma_is_not_the_filters() -> None:
    wide = track(sigma=15.0)  # heading to 2.3 deg
    time_s = np.arange(wide.time_s[0] + 1.0, wide.time_s[-1] - 1.0, 0.1)
    errors = compared(onboard(wide, heading_error_deg=np.where(time_s > 400.0, 2.1, 0.0)), wide).errors
    assert row(errors, "heading").spans == ()


@pytest.mark.parametrize("angles", [(0.0, 0.0, 2.5), (1.0, -1.5, 90.0), (180.0, 0.0, -90.0), (0.3, 20.0, 179.99)])
def test_a_constant_turn_is_mounting_and_never_an_error(angles: tuple[float, float, float]) -> None:
    turn = rotation_n_from_b(np.array([angles]))[0]
    errors = compared(onboard(TRACK, turn=turn)).errors
    for quantity, angle in zip(("roll", "pitch", "heading"), angles, strict=True):
        found = row(errors, quantity)  # type: ignore[arg-type]
        assert float(wrap_180((found.offset or 0.0) - angle)) == pytest.approx(0.0, abs=0.05), quantity
        assert found.spans == () and found.rms < 0.07
        assert found.offset_cause == ("mounting" if abs(angle) > 0.2 else "")


def test_an_antenna_elsewhere_is_told_on_the_vehicle() -> None:
    errors = compared(onboard(TRACK, arm_m=(1.2, -0.4))).errors
    found = row(errors, "horizontal position")
    assert (
        found.offset_cause == "antenna"
        and found.offset_words == "antenna or reference point 1.20 m forward, 0.40 m left"
    )
    assert found.spans == () and found.rms < 0.1
    assert row(errors, "horizontal velocity").rms == pytest.approx(0.028, abs=0.004), "turning about it is taken off"


def test_another_datum_is_told_on_the_earth() -> None:
    flight = onboard(TRACK)
    latitude = flight["ins"].values("latitude_deg") + 3.0 / 111_300.0
    errors = compared(onboard(TRACK, latitude_deg=latitude)).errors
    found = row(errors, "horizontal position")
    assert (
        found.offset_cause == "datum" and found.offset_words.startswith("datum 3.0") and "north" in found.offset_words
    )
    assert found.spans == ()


@pytest.mark.parametrize("delay_s", [0.11, -0.085, 0.31])
def test_late_stamps_are_a_delay(delay_s: float) -> None:
    errors = compared(onboard(TRACK, delay_s=delay_s)).errors
    assert errors.delay_s == pytest.approx(delay_s, abs=0.004)
    assert errors.delay_sigma_s is not None and errors.delay_sigma_s < 0.005
    assert not any(one.spans for one in errors.rows)
    assert row(errors, "horizontal position").rms < 0.2


def test_a_drift_of_the_place_is_found_while_it_lasts() -> None:
    flight = onboard(TRACK)
    time_s = flight.time_s("ins")
    off_m = np.where((time_s > 200.0) & (time_s < 320.0), 0.3 * (time_s - 200.0), 0.0)
    latitude = flight["ins"].values("latitude_deg") + off_m / 111_300.0
    found = row(compared(onboard(TRACK, latitude_deg=latitude)).errors, "horizontal position")
    (span,) = found.spans
    assert span.start_s == pytest.approx(204.0, abs=3.0) and span.end_s == pytest.approx(320.0, abs=3.0)
    assert span.value == pytest.approx(18.0, abs=1.0) and span.largest == pytest.approx(36.0, abs=1.0)


def test_what_is_not_logged_has_no_row() -> None:
    errors = compared(onboard(TRACK, roll_deg=None, pitch_deg=None, latitude_deg=None, longitude_deg=None)).errors
    assert [one.quantity for one in errors.rows] == [
        "heading",
        "horizontal velocity",
        "vertical velocity",
        "vertical position",
    ]


def test_a_place_from_an_unknown_origin_is_compared() -> None:
    flight = onboard(TRACK, latitude_deg=None, longitude_deg=None)
    true = at_times(TRACK, flight.time_s("ins"))
    north = (true.latitude_deg - TRACK.latitude_deg[0]) * 111_300.0 + 500.0
    east = (true.longitude_deg - TRACK.longitude_deg[0]) * 64_000.0
    moved = onboard(TRACK, latitude_deg=None, longitude_deg=None, position_north_m=north, position_east_m=east)
    found = row(compared(moved).errors, "horizontal position")
    assert found.offset_cause == "datum" and found.offset == pytest.approx(500.0, rel=0.02)


def test_a_vertical_velocity_with_the_other_sign_is_told_and_no_error() -> None:
    up = -onboard(TRACK)["ins"].values("velocity_down_mps")
    found = row(compared(onboard(TRACK, velocity_down_mps=up)).errors, "vertical velocity")
    assert found.offset_cause == "sign" and "up, not down" in found.offset_words
    assert found.offset is None and found.spans == () and found.rms < 0.05
    assert row(compared(onboard(TRACK)).errors, "vertical velocity").offset_cause == ""


def test_a_place_that_is_no_fix_is_no_error() -> None:
    flight = onboard(TRACK)
    late = flight.time_s("ins") > 60.0
    places = {name: np.where(late, flight["ins"].values(name), 0.0) for name in ("latitude_deg", "longitude_deg")}
    found = row(compared(onboard(TRACK, **places)).errors, "horizontal position")
    assert found.spans == () and found.rms < 0.1 and found.offset_cause == ""


def test_a_track_told_as_heading_is_not_compared() -> None:
    flight = onboard(TRACK)
    told = Flight(dict(flight.tables), {f"{HEADING_IS_TRACK}.ins.true_heading_deg": "yes"})
    assert compared(told).errors.row("heading") is None


def test_a_filter_that_never_ran_beside_the_track_has_no_comparison() -> None:
    late = onboard(TRACK)
    of = Flight({"ins": late["ins"].take(slice(2000, None))}, start_ns=0)
    assert compare_onboard(track(20.0), of, filters_of(of)[0]) is None
    few = Flight({"ins": late["ins"].take(slice(0, 10))})
    assert compare_onboard(TRACK, few, filters_of(few)[0]) is None


def test_a_hover_that_does_not_turn_has_one_place_and_no_delay_of_note() -> None:
    still = track(300.0, hovers=True)
    errors = compared(onboard(still, arm_m=(0.5, 0.0)), still).errors
    found = row(errors, "horizontal position")
    assert found.offset_cause in ("", "antenna") and found.spans == () and found.rms < 0.1
    assert not any(one.spans for one in errors.rows)


@pytest.mark.slow
def test_the_share_of_logs_with_an_invented_span_is_small() -> None:
    """A filter that is right, beside a solution whose errors wander as its sigma says."""
    wrong, logs = 0, 40
    length_s = TRACK.time_s[-1]
    at_s = np.arange(0.0, length_s, 1.0)
    rng = np.random.default_rng(3)
    step = np.exp(-1.0 / 60.0)
    time_s = np.arange(TRACK.time_s[0] + 1.0, TRACK.time_s[-1] - 1.0, 0.1)
    for seed in range(logs):
        wander = np.zeros(len(at_s))
        wander[0] = rng.normal()
        for place in range(1, len(at_s)):
            wander[place] = step * wander[place - 1] + np.sqrt(1.0 - step**2) * rng.normal()
        sigma = np.interp(time_s, TRACK.time_s, TRACK.attitude_sigma_deg[:, 2])
        ours = 3.0 * sigma * np.interp(time_s, at_s, wander)
        wide = track(sigma=3.0)
        found = row(compared(onboard(wide, heading_error_deg=ours, seed=seed), wide).errors, "heading")
        wrong += bool(found.spans)
    assert wrong <= 6, f"{wrong} of {logs} logs"


# ---- a filter that steps: wrong before, or after?


TIMES = np.arange(TRACK.time_s[0] + 1.0, TRACK.time_s[-1] - 1.0, 0.1)
TURNS = ((0.0, 0.0, 0.0), (0.0, 0.0, 90.0), (180.0, 3.0, -35.0))


def flat() -> TrackOfStates:
    """A track that yaws alone: its motion does not show the yaw of the filter's axes."""
    return replace(TRACK, roll_deg=0.0 * TRACK.roll_deg, pitch_deg=0.0 * TRACK.pitch_deg)


@pytest.mark.parametrize("angles", TURNS)
@pytest.mark.parametrize("at_s", [150.0, 300.0, 450.0])
@pytest.mark.parametrize("is_wrong_before", [True, False])
def test_the_part_of_a_step_that_is_wrong_is_told_by_the_axes(
    angles: tuple[float, float, float], at_s: float, is_wrong_before: bool
) -> None:
    """Rolls and pitches show the axes of the filter, whatever its heading is; the longer part may be the wrong one."""
    wrong = (at_s > TIMES) == is_wrong_before
    turn = rotation_n_from_b(np.array([angles]))[0]
    heading = row(compared(onboard(TRACK, turn=turn, heading_error_deg=np.where(wrong, 6.0, 0.0))).errors, "heading")
    assert heading.changes == () and heading.axes_sigma is not None and heading.axes_sigma < 1.0
    (span,) = heading.spans
    ends = (TIMES[0], at_s) if is_wrong_before else (at_s, TIMES[-1])
    assert (span.start_s, span.end_s) == pytest.approx(ends, abs=1.5)
    assert span.value == pytest.approx(6.0, abs=0.1)
    assert float(wrap_180((heading.offset or 0.0) - angles[2])) == pytest.approx(0.0, abs=0.1)
    assert heading.rms == pytest.approx(6.0 * np.sqrt(np.mean(wrong)), rel=0.05)


@pytest.mark.parametrize("at_s", [60.0, 150.0, 300.0, 450.0, 560.0])
@pytest.mark.parametrize("is_wrong_before", [True, False])
def test_a_step_whose_axes_nothing_shows_is_left_open(at_s: float, is_wrong_before: bool) -> None:
    """What only yaws does not tell the yaw of the axes: changed, but never which part is wrong."""
    wrong = (at_s > TIMES) == is_wrong_before
    heading = row(compared(onboard(flat(), heading_error_deg=np.where(wrong, 6.0, 0.0)), flat()).errors, "heading")
    assert heading.spans == ()
    (change,) = heading.changes
    assert change.at_s == pytest.approx(at_s, abs=1.5)
    assert change.by == pytest.approx(-6.0 if is_wrong_before else 6.0, abs=0.1) and change.half95 < 0.6
    assert "wrong before or after, which cannot be told" in heading.changed


def test_own_axes_of_an_autopilot_decide_what_motion_leaves_open() -> None:
    of = onboard(flat(), heading_error_deg=np.where(TIMES < 400.0, 6.0, 0.0))
    found = compare_onboard(flat(), of, filters_of(of)[0], is_own=True)
    assert found is not None
    heading = row(found.errors, "heading")
    assert heading.changes == () and [round(one.value) for one in heading.spans] == [6]
    assert heading.spans[0].end_s == pytest.approx(400.0, abs=1.5)


def test_steps_between_several_levels_are_left_open() -> None:
    error = np.select([TIMES < 250.0, TIMES < 350.0, TIMES < 450.0], [0.0, 5.0, 12.0], -4.0)
    heading = row(compared(onboard(flat(), heading_error_deg=error), flat()).errors, "heading")
    assert heading.spans == () and len(heading.changes) >= 2


def test_an_error_that_grows_to_the_end_is_no_step() -> None:
    error = np.where(TIMES > 400.0, 0.05 * (TIMES - 400.0), 0.0)
    heading = row(compared(onboard(flat(), heading_error_deg=error), flat()).errors, "heading")
    assert heading.changes == () and heading.spans[0].end_s == pytest.approx(TIMES[-1], abs=1.5)


def test_a_filter_that_finds_its_heading_at_the_start_is_wrong_there() -> None:
    error = 40.0 * np.exp(-TIMES / 30.0)
    heading = row(compared(onboard(flat(), heading_error_deg=error), flat()).errors, "heading")
    assert heading.changes == () and heading.spans[0].start_s == pytest.approx(TIMES[0], abs=1.5)


def test_a_place_that_jumps_further_than_any_antenna_is_wrong_there_a_shorter_one_is_left_open() -> None:
    latitude = onboard(TRACK)["ins"].values("latitude_deg")
    for off_m, is_told in ((200.0, True), (8.0, False)):
        moved = latitude + np.where(TIMES > 400.0, off_m, 0.0) / 111_300.0
        found = row(compared(onboard(TRACK, latitude_deg=moved)).errors, "horizontal position")
        assert bool(found.spans) == is_told and bool(found.changes) == (not is_told), found
        if is_told:
            assert found.spans[0].start_s == pytest.approx(400.0, abs=2.0)


def test_tilt_that_steps_is_told_by_own_axes_alone() -> None:
    """A tilt that is wrong in the body looks as another mounting, however the vehicle turns."""
    roll = onboard(TRACK)["ins"].values("roll_deg") + np.where(TIMES < 350.0, 4.0, 0.0)
    of = onboard(TRACK, roll_deg=roll)
    found = row(compared(of).errors, "roll")
    assert found.spans == () and [round(one.by) for one in found.changes] == [-4]
    own = compare_onboard(TRACK, of, filters_of(of)[0], is_own=True)
    assert own is not None
    found = row(own.errors, "roll")
    assert found.changes == () and [round(one.value) for one in found.spans] == [4]
    assert found.spans[0].end_s == pytest.approx(350.0, abs=1.5)


# ---- which filter


def renamed(flight: Flight, topic: str) -> Table:
    return replace(flight["ins"], topic=topic)


def test_the_filter_that_flew_comes_first_and_is_named() -> None:
    first, second = onboard(TRACK, heading_error_deg=3.0 * (TIMES > 400.0)), onboard(TRACK)
    log = Flight(
        {"ins": first["ins"], "ins.2": renamed(second, "ins.2")},
        {
            "derived.ins.true_heading_deg": "yaw of ATT (EKF2)",
            "derived.ins.2.true_heading_deg": "yaw of another filter (EKF3)",
        },
    )
    log = Flight({**log.tables, "raw.PARM": parameters(AHRS_EKF_TYPE=3.0)}, log.metadata)
    found = filters_of(log)
    assert [(one.topic, one.name, one.flew) for one in found] == [("ins.2", "EKF3", True), ("ins", "EKF2", False)]
    assert "AHRS_EKF_TYPE = 3" in found[0].source
    assert [one.topic for one in filters_of(Flight({"ins": first["ins"], "ins.1": renamed(second, "ins.1")}))] == [
        "ins",
        "ins.1",
    ]


def test_a_filter_that_the_log_leaves_open_has_no_name() -> None:
    told = {"derived.ins.true_heading_deg": "yaw of ATT (DCM or a filter that is not logged) with compass"}
    (found,) = filters_of(Flight(dict(onboard(TRACK).tables), told))
    assert (found.name, found.flew) == ("", None)


def test_lanes_of_an_autopilot_are_compared() -> None:
    true = onboard(TRACK)
    lanes = [ardupilot_lane(onboard(TRACK, heading_error_deg=error), lane) for lane, error in enumerate((0.0, 1.0))]
    log = Flight({**true.tables, **{one.topic: one for one in lanes}, "raw.XKF4.0": primary(1.0)})
    found = filters_of(log)
    assert [(one.topic, one.name, one.flew) for one in found[1:]] == [
        ("raw.XKF1.0", "EKF3 lane 0", False),
        ("raw.XKF1.1", "EKF3 lane 1", True),
    ]
    for one in found[1:]:
        errors = compare_onboard(TRACK, log, one)
        assert errors is not None
        assert row(errors.errors, "heading").rms < 0.1 and row(errors.errors, "horizontal velocity").rms < 0.1
    assert len(filters_of(Flight({**true.tables, "raw.XKF1.0": lanes[0]}))) == 1, "one lane is ins itself"


def parameters(**values: float) -> Table:
    time_ns = np.zeros(len(values), dtype=np.int64)
    columns = {"Name": Column(np.array(list(values))), "Value": Column(np.array(list(values.values())))}
    return Table("raw.PARM", time_ns, columns, np.arange(len(values)), Column(time_ns))


def ardupilot_lane(flight: Flight, lane: int) -> Table:
    table = flight["ins"]
    true = at_times(TRACK, flight.time_s("ins"))
    place = {
        "PN": (true.latitude_deg - TRACK.latitude_deg[0]) * 111_300.0,
        "PE": (true.longitude_deg - TRACK.longitude_deg[0]) * 64_000.0,
        "PD": TRACK.height_m[0] - true.height_m,
    }
    columns = {FIELDS[name]: table.columns[name] for name in FIELDS if name in table.columns}
    return replace(
        table, topic=f"raw.XKF1.{lane}", columns=columns | {name: Column(one) for name, one in place.items()}
    )


def primary(lane: float) -> Table:
    time_ns = np.arange(10, dtype=np.int64) * NS_PER_S
    return Table("raw.XKF4.0", time_ns, {"PI": Column(np.full(10, lane))}, np.arange(10), Column(time_ns))


def test_an_attitude_of_ours_that_is_not_sure_judges_nobody() -> None:
    unsure = np.where(TRACK.time_s < 200.0, 25.0, 0.15)
    of = replace(TRACK, attitude_sigma_deg=np.column_stack([TRACK.attitude_sigma_deg[:, :2], unsure]))
    time_s = np.arange(TRACK.time_s[0] + 1.0, TRACK.time_s[-1] - 1.0, 0.1)
    found = compared(onboard(TRACK, heading_error_deg=np.where(time_s < 199.0, 150.0, 0.0)), of)
    heading = row(found.errors, "heading")
    assert heading.rms < 0.1 and heading.sigma_rms < 0.2 and not heading.spans and not heading.changes
    assert heading.judged_share == pytest.approx(400.0 / 598.0, abs=0.01)
    assert np.isnan(found.figure.heading_deg[:190]).all() and np.isfinite(found.figure.heading_deg[210:]).all()
    assert row(found.errors, "roll").judged_share == 1.0


def test_the_line_of_a_heading_error_does_not_cross_the_figure() -> None:
    seam = compared(onboard(TRACK, heading_error_deg=178.0 + 4.0 * np.sin(np.arange(5980) / 300.0))).figure
    shown = replace(seam, heading_deg=wrap_180(seam.heading_deg + 180.0))
    made = accepted()
    figures = tuple(shown if isinstance(one, TrajectoryOnboard) else one for one in made.figures)
    plot = onboard_attitude(results_of(replace(made, figures=figures)))
    assert plot is not None
    line = next(mark for mark in plot.rows[0].panels[0].marks if isinstance(mark, Curve))
    assert np.nanmax(np.abs(np.diff(line.y))) < 180.0 < np.nanmax(np.abs(np.diff(shown.heading_deg)))
