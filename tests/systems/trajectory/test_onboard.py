"""Errors of the on-board filter: constants are told and taken off, true errors found, none invented."""

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.records import HEADING_IS_TRACK
from groundstation.systems.trajectory.onboard import ComparedFilter, compare_onboard
from groundstation.systems.trajectory.onboard_answer import OnboardError, OnboardErrors
from groundstation.systems.trajectory.quantity_answer import Quantity
from groundstation.systems.trajectory.sampling import at_times
from groundstation.tables.table import Flight
from tests.systems.trajectory.made import onboard, track

TRACK = track()


def compared(flight: Flight, of: object = TRACK) -> ComparedFilter:
    """The comparison, which must be there."""
    found = compare_onboard(of, flight, "ins")  # type: ignore[arg-type]
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
    assert 0.2 < span.half95 < 0.5, "1.96 times the smoothed sigma, hardly less by averaging"
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
    assert compare_onboard(track(20.0), Flight({"ins": late["ins"].take(slice(2000, None))}, start_ns=0), "ins") is None
    assert compare_onboard(TRACK, Flight({"ins": late["ins"].take(slice(0, 10))}), "ins") is None


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
