"""Accuracy, separation, segments and arrays of a made track; states at other times."""

import numpy as np
import pytest

from groundstation.systems.trajectory.figures import MOST_ROWS, accuracy_of, segments_of, separation_of, track_figure
from groundstation.systems.trajectory.sampling import at_times
from groundstation.systems.trajectory.solution import TrackOfStates
from tests.systems.trajectory.made import track


def moved(of: TrackOfStates, north_m: float, heading_deg: float) -> TrackOfStates:
    """The track moved north and turned."""
    from dataclasses import replace

    return replace(
        of,
        latitude_deg=of.latitude_deg + north_m / 111_349.0,
        heading_deg=np.mod(of.heading_deg + heading_deg, 360.0),
    )


def test_accuracy_is_that_of_the_sigmas() -> None:
    rows = {one.quantity: one for one in accuracy_of(track(1000.0 * np.pi))}
    assert rows["heading"].median_sigma == pytest.approx(0.15, rel=0.03)
    assert rows["heading"].worst_sigma == pytest.approx(0.225, rel=0.01)
    assert rows["heading"].median_within95 == pytest.approx(0.294, rel=0.03)
    plane = rows["horizontal position"]
    assert plane.median_sigma == pytest.approx(np.hypot(0.2, 0.25), rel=0.03)
    assert plane.median_within95 == pytest.approx(1.731 * plane.median_sigma, rel=1e-3)
    assert plane.unit == "m" and plane.worst_s is not None and np.sin(0.01 * plane.worst_s) > 0.999


def test_separation_is_forward_minus_smoothed() -> None:
    rows, figure = separation_of(moved(track(), 2.0, 1.5), track())
    found = {one.quantity: one for one in rows}
    assert found["horizontal position"].rms == pytest.approx(2.0, rel=1e-3)
    assert np.nanmedian(figure.position_north_m) == pytest.approx(2.0, rel=1e-3)
    assert found["heading"].worst == pytest.approx(1.5) and np.nanmedian(figure.heading_deg) == pytest.approx(1.5)
    assert found["tilt"].rms == 0.0


def test_segments_are_told_apart_and_never_bridged() -> None:
    cut = track(100.0, gap_s=(40.0, 45.0))
    first, second = segments_of(cut)
    assert (first.start_s, first.end_s, second.start_s) == pytest.approx((0.0, 39.95, 45.05), abs=0.06)
    found = at_times(cut, np.array([-1.0, 0.0, 39.975, 42.0, 50.025, 200.0]))
    assert found.segment.tolist() == [-1, 0, -1, -1, 1, -1]
    assert np.isfinite(found.heading_deg).tolist() == [False, True, False, False, True, False]


def test_states_between_others_cross_north_and_the_date_line() -> None:
    two = track(0.1)
    assert len(two) == 2
    from dataclasses import replace

    two = replace(
        two,
        heading_deg=np.array([359.0, 2.0]),
        longitude_deg=np.array([179.9999, -179.9997]),
        roll_deg=np.array([-179.0, 179.0]),
    )
    found = at_times(two, np.array([0.025]))
    assert found.heading_deg[0] == pytest.approx(0.5)
    assert abs(found.longitude_deg[0]) == pytest.approx(179.9999, abs=1e-6) and found.longitude_deg[0] < 0.0
    assert abs(found.roll_deg[0]) == pytest.approx(180.0)


def test_a_long_track_is_thinned_for_the_page() -> None:
    long = track(3000.0)
    figure = track_figure(long)
    assert len(long) > MOST_ROWS >= len(figure) > 0.6 * MOST_ROWS
    assert figure.time_s[-1] == long.time_s[-1] and figure.other_heading_deg is None
    short = track(100.0)
    assert len(track_figure(short, short.heading_deg + 155.0)) == len(short)
