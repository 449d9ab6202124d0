"""Landing by ranges: the filter of the approach against an independent one, its honesty over trials, and bad input."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.angles import FloatArray
from groundstation.base.errors import SettingsError
from groundstation.systems.planning.landing.answer import HONEST, TOUCHDOWN, WHITE
from groundstation.systems.planning.landing.filter import (
    covariance_along,
    filter_ranges,
    nominal_readings,
    with_errors,
)
from groundstation.systems.planning.landing.model import CLOCK, PLACE, error_model
from groundstation.systems.planning.landing.moving_point import fly_moving_point, measure
from groundstation.systems.planning.landing.outcome import category_spans, range_landing
from groundstation.systems.planning.landing.plan import _of_places
from groundstation.systems.planning.landing.scenario import (
    MovingPoint,
    OwnErrors,
    RangeApproach,
    RangeNoise,
    ReferencePoint,
    StraightPath,
)
from groundstation.systems.planning.landing.trials import draw_errors, fly_trials

PAIR = (ReferencePoint("left", 0.0, -1000.0), ReferencePoint("right", 0.0, 1000.0))
THIRD = (*PAIR, ReferencePoint("third", 100.0, 0.0))
COARSE = RangeNoise(interval_s=0.1, white_m=3.0 / np.sqrt(10.0))  # as much information a second as 3 m each 0.01 s
FOUR = RangeApproach("four points", points=THIRD, moving=MovingPoint(), noise=COARSE, own=OwnErrors(baro_m=50.0))
CURVED_M = 0.05  # what a start wrong by tens of metres leaves of the curvature of ranges
ROUNDING_M = 1e-6  # of covariances after hundreds of updates in another order of sums
CORRELATED = RangeNoise(interval_s=0.1, white_m=0.3, correlated_m=3.0, correlation_s=5.0)


def _expected_ranges(state: FloatArray, reading_m: FloatArray, points_m: FloatArray, moving: int) -> FloatArray:
    points = points_m.copy()
    if moving >= 0:
        points[-1] -= state[moving : moving + 3]
    place = reading_m - state[list(PLACE)]
    return np.asarray(np.linalg.norm(place - points, axis=1) + state[CLOCK])


def test_covariance_is_that_of_a_plain_dense_filter_with_numeric_derivatives() -> None:
    scenario = replace(FOUR, noise=RangeNoise(interval_s=1.0, white_m=2.0))
    model, readings = error_model(scenario, has_slow_errors=True), nominal_readings(scenario)
    P = model.P0.copy()
    for k, (reading_m, points_m) in enumerate(zip(readings.place_m, readings.points_m, strict=True)):
        if k:
            P = model.F @ P @ model.F.T + model.Q
        step = 1e-3
        H = np.column_stack(
            [
                (
                    _expected_ranges(step * one, reading_m, points_m, model.moving)
                    - _expected_ranges(-step * one, reading_m, points_m, model.moving)
                )
                / (2.0 * step)
                for one in np.eye(model.size)
            ]
        )
        S = H @ P @ H.T + scenario.noise.white_m**2 * np.eye(len(H))
        P = P - P @ H.T @ np.linalg.solve(S, H @ P)
    found = covariance_along(scenario)
    assert found.time_s[-1] == scenario.time_s[-1]
    assert np.sqrt(np.diag(P)[list(PLACE)]) == pytest.approx(found.sigma_m[-1], rel=1e-4)


def test_exact_ranges_give_the_exact_place() -> None:
    model = error_model(FOUR, has_slow_errors=True)
    errors = np.zeros((len(FOUR.time_s), model.size))
    errors[:, PLACE] = 0.5, -0.3, 0.4
    errors[:, CLOCK] = 100.0
    exact = replace(FOUR, noise=replace(COARSE, white_m=0.01))
    readings = with_errors(nominal_readings(exact), model, errors, np.zeros((len(errors), 4)))
    found = filter_ranges(exact, readings)
    assert np.abs(found.correction_m[-1] - errors[-1, PLACE]).max() < CURVED_M
    assert np.abs(found.innovation[10:]).max() < 1.0


def test_information_a_second_counts_and_not_the_interval() -> None:
    fine = covariance_along(replace(FOUR, noise=RangeNoise(interval_s=0.01, white_m=3.0)))
    coarse = covariance_along(FOUR)
    assert coarse.sigma_m[-1] == pytest.approx(fine.sigma_m[-1], rel=0.1)


def test_points_on_one_line_and_under_the_path_are_told() -> None:
    def codes(*places: tuple[float, float]) -> list[str]:
        points = tuple(ReferencePoint(f"P{n}", before_m, right_m) for n, (before_m, right_m) in enumerate(places))
        return [one.code for one in _of_places(RangeApproach("places", points=points))]

    assert codes((0.0, -1000.0), (0.0, 1000.0)) == []
    assert codes((0.0, -1000.0), (0.0, 1000.0), (3000.0, 0.0)) == []
    assert codes((0.0, -1000.0), (0.0, 1000.0), (500.0, 10.0)) == ["landing_ranges.under_path"]
    assert codes((-500.0, -1000.0), (0.0, 0.0), (500.0, 1010.0))[0] == "landing_ranges.on_one_line"
    assert codes((3000.0, 0.0), (-2600.0, 0.0)) == ["landing_ranges.on_course"]


def test_left_and_right_are_alike() -> None:
    offset = replace(FOUR, points=(*PAIR, ReferencePoint("third", 500.0, 500.0)))
    mirrored = replace(offset, points=(*PAIR, ReferencePoint("third", 500.0, -500.0)))
    assert covariance_along(offset).sigma_m == pytest.approx(covariance_along(mirrored).sigma_m, abs=ROUNDING_M)


def test_errors_of_trials_agree_with_what_the_filter_computes() -> None:
    trials = fly_trials(replace(FOUR, trials=10, seed=11))
    places = [int(np.argmin(np.abs(trials.before_threshold_m - place))) for place in (2000.0, 500.0, 0.0, -270.0)]
    low, high = trials.limits
    for k in places:
        assert low < trials.nees[:, k].mean() < high
    assert trials.innovation_square.mean() == pytest.approx(1.0, abs=0.05)


def test_three_points_on_the_ground_leave_no_aircraft_below_it() -> None:
    three = replace(FOUR, moving=None, own=OwnErrors(baro_m=20.0, position_m=30.0), trials=6, seed=0)
    trials = fly_trials(three)
    assert np.abs(trials.error_m[:, -1, 2]).max() < 4.0 * trials.sigma_m[:, -1, 2].max()


def test_correlated_ranges_taken_for_white_make_a_filter_overconfident() -> None:
    scenario = replace(FOUR, noise=CORRELATED, trials=6, seed=3)
    answer = range_landing(scenario)
    honest, white = ([row for row in answer.trials if row.filter == name][-1] for name in (HONEST, WHITE))
    assert honest.is_consistent
    assert not white.is_consistent
    assert white.overconfidence_right > 3.0
    assert any("treats the correlated" in remark for remark in answer.remarks)


def test_drawn_errors_have_the_covariance_of_the_model() -> None:
    model = error_model(replace(FOUR, noise=CORRELATED), has_slow_errors=True)
    ends = np.array([draw_errors(np.random.default_rng(k), model, 50)[-1] for k in range(800)])
    expected = model.P0.copy()
    for _ in range(49):
        expected = model.F @ expected @ model.F.T + model.Q
    assert ends.std(axis=0) == pytest.approx(np.sqrt(np.diag(expected)), rel=0.12)


def test_the_controlled_aircraft_keeps_its_bounds_and_gains_geometry() -> None:
    kept = replace(FOUR, moving=MovingPoint(control="none"))
    steered, level = fly_moving_point(FOUR), fly_moving_point(kept)
    assert steered is not None
    assert level is not None
    moving = FOUR.moving
    assert moving is not None
    assert steered.speed_mps.min() >= moving.slowest_mps - 1e-9
    assert steered.speed_mps.max() <= moving.fastest_mps + 1e-9
    assert np.abs(np.diff(steered.speed_mps) / 0.1).max() <= moving.acceleration_mps2 + 1e-6
    step_m = np.diff(steered.place_m[:, 0])
    assert step_m == pytest.approx(0.05 * (steered.speed_mps[1:] + steered.speed_mps[:-1]), abs=1e-6)
    ground = np.broadcast_to(FOUR.point_places_m, (len(FOUR.time_s), 3, 3))
    gained = [
        measure(FOUR.places_m, np.concatenate([ground, one.place_m[:, None]], axis=1)).mean()
        for one in (steered, level)
    ]
    assert gained[0] > gained[1]


def test_published_places_are_in_the_answer() -> None:
    answer = range_landing(replace(FOUR, trials=0))
    touchdown = answer.at(TOUCHDOWN)
    assert touchdown.before_threshold_m == pytest.approx(-FOUR.path.touchdown_m, abs=20.0)
    assert touchdown.lateral_category == "CAT IIIB"
    assert touchdown.category == touchdown.vertical_category == "CAT I"
    assert answer.least_up_m < touchdown.sigma_up_m
    assert [row.place for row in answer.rows] == ["start", "200 ft", "100 ft", "threshold", TOUCHDOWN]
    assert answer.trials == ()


def test_spans_are_where_the_figures_meet_the_limits() -> None:
    track = covariance_along(FOUR)
    for span in category_spans(track):
        inside = (-track.true_m[:, 0] <= span.from_before_threshold_m + 1e-6) & (
            -track.true_m[:, 0] >= span.to_before_threshold_m - 1e-6
        )
        if span.axis == "vertical" and span.category == "CAT I":
            assert (track.vertical_95_m[inside] <= 6.0).all()
    assert any(span.category == "CAT I" and span.axis == "horizontal and vertical" for span in category_spans(track))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: StraightPath(runway_length_m=0.0), "runway_length_m"),
        (lambda: StraightPath(runway_length_m=150.0), "runway that the glide path meets"),
        (lambda: RangeApproach("", points=()), "one ground point"),
        (lambda: RangeApproach("", points=(PAIR[0], PAIR[0])), "given twice"),
        (lambda: RangeApproach("", points=(ReferencePoint("under", 0.0, 0.0, 15.0),)), "off the path"),
        (
            lambda: RangeApproach("", points=PAIR, noise=RangeNoise(interval_s=0.001), path=StraightPath(30_000.0)),
            "mea",
        ),
        (lambda: MovingPoint(speed_mps=20.0), "its bounds"),
        (lambda: OwnErrors(baro_m=float("nan")), "finite"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(make: object, said: str) -> None:
    with pytest.raises(SettingsError, match=said):
        make()  # type: ignore[operator]
