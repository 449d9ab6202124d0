"""Placement of ground points: exact gradients, the place that analysis gives, what is kept out, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.errors import GroundstationError, SettingsError
from groundstation.results.flight import FlightResults, Source
from groundstation.systems.planning.session.placement import plan_placement
from groundstation.systems.planning.session.placement_answer import GIVEN, PlacementPlan
from groundstation.systems.planning.session.placement_plots import accuracy_map
from groundstation.systems.planning.session.placing import PlaceLoss, Site
from groundstation.systems.planning.session.region import Region
from groundstation.systems.planning.session.scenario import (
    Criterion,
    KeepOut,
    Over,
    Placement,
    PlannedAircraft,
    PlannedErrors,
    PlannedPoint,
    Ranging,
    SessionPlan,
)

FloatArray = NDArray[np.float64]
SPEED_MPS, SLOPE = 70.0, float(np.tan(np.deg2rad(3.0)))
SLOPE_TOLERANCE = 1e-4  # of the largest: central differences of 1 cm in places of kilometres
BEGIN_M, CROSSING_M = 2100.0, 15.0
LEFT, RIGHT = PlannedPoint("left", 0.0, -1000.0), PlannedPoint("right", 0.0, 1000.0)
THIRD = PlannedPoint("third", -300.0, 200.0, is_placed=True)


def approach(points: tuple[PlannedPoint, ...] = (LEFT, RIGHT, THIRD), **asked: object) -> SessionPlan:
    """The last two kilometres of an approach; the runway leads north from the origin."""
    height = CROSSING_M + BEGIN_M * SLOPE
    aircraft = PlannedAircraft(
        *("approach", -BEGIN_M, 0.0, height, SPEED_MPS, 0.0, -SPEED_MPS * SLOPE),
        errors=PlannedErrors(position_m=100.0, velocity_mps=1.0, baro_m=200.0),
    )
    wanted = Placement(
        fixed_at_s=20.0, low_north_m=-2000.0, high_north_m=400.0, low_east_m=-1500.0, high_east_m=1500.0, starts=1
    )
    return SessionPlan(
        *("approach", (aircraft,), points),
        duration_s=30.0,
        step_s=2.0,
        ranging=Ranging(3.0, 0.1),
        placement=replace(wanted, **({"map_side": 5} | asked)),  # type: ignore[arg-type]
    )


def best_analysis_m(before_m: float, height_m: float) -> float:
    """Distance before the threshold of the largest determinant with a pair abeam the threshold: s + h^2 / s."""
    return before_m + height_m**2 / before_m


def codes(plan: SessionPlan) -> set[str]:
    return {finding.code for finding in plan_placement(plan)[1]}


@pytest.mark.parametrize("criterion", ["determinant", "eigenvalue", "dop", "covariance"])
@pytest.mark.parametrize("over", ["fixed", "way", "lost"])
def test_the_gradient_by_the_places_is_exact(criterion: Criterion, over: Over) -> None:
    pair = PlannedPoint("pair", -100.0, -700.0, is_placed=True), PlannedPoint("other", 0.0, 0.0, mirrors="pair")
    high = PlannedPoint("high", 300.0, 900.0, 150.0)
    site = Site(approach((*pair, THIRD, high)))
    wanted = PlaceLoss(site, criterion, site.span if over == "way" else (site.fixed,) * 2, over == "lost")
    at = np.array([[-150.0, -650.0], [-900.0, 310.0]])
    wanted.width = 0.05 * abs(wanted.largest(at))
    _, slope = wanted(at)
    numeric = np.zeros(at.shape)
    for place in np.ndindex(at.shape):
        moved = np.zeros(at.shape)
        moved[place] = 1e-2
        numeric[place] = (wanted(at + moved)[0] - wanted(at - moved)[0]) / 2e-2
    assert np.abs(numeric).max() > 0.0
    assert np.abs(slope - numeric).max() <= SLOPE_TOLERANCE * np.abs(numeric).max()


@pytest.mark.parametrize("fixed_at_s", [10.0, 18.0, 26.0])
def test_the_third_point_stands_where_analysis_puts_it(fixed_at_s: float) -> None:
    plan = approach(criterion="determinant", fixed_at_s=fixed_at_s)
    answer, _ = plan_placement(plan)
    before_m = BEGIN_M - SPEED_MPS * fixed_at_s
    assert answer.fixed_north_m == pytest.approx(-before_m)
    expected = best_analysis_m(before_m, CROSSING_M + before_m * SLOPE)
    (third,) = (row for row in answer.places_of("determinant_fixed") if row.is_placed)
    assert third.north_m == pytest.approx(-expected, abs=1.0)
    assert third.east_m == pytest.approx(0.0, abs=1.0)
    assert answer.design("determinant_fixed").has_converged
    assert "placement.under_way" in codes(plan)


def test_each_design_is_best_at_what_it_was_made_for() -> None:
    answer, _ = plan_placement(approach(starts=3))
    rows = {row.design: row for row in answer.designs}

    def variance(row: str, part: str) -> float:
        sigmas = [getattr(rows[row], f"{part}two_sigma_{axis}_m") for axis in ("north", "east", "up")]
        return float(np.square(sigmas).sum())

    assert max(rows, key=lambda name: rows[name].determinant) == "determinant_fixed"
    assert min(rows, key=lambda name: variance(name, "")) == "covariance_fixed"
    least = variance("covariance_lost", "lost_")
    assert all(least <= variance(name, "lost_") * (1.0 + 1e-6) for name in rows)
    assert rows[GIVEN].iterations == 0 and all(row.has_converged for row in rows.values())


def test_no_place_of_the_map_beats_the_optimum() -> None:
    answer, _ = plan_placement(approach(criterion="covariance", map_side=21, starts=3))
    row = answer.design("covariance_fixed")
    best_m = 0.5 * np.sqrt(row.two_sigma_north_m**2 + row.two_sigma_east_m**2 + row.two_sigma_up_m**2)
    (mapped,) = (figure for figure in answer.figures if figure.name == "placement_map")
    assert np.nanmin(mapped["sigma_m"]) >= best_m * (1.0 - 1e-6)
    assert len(mapped) == 21 * 21 and np.isfinite(mapped["sigma_m"]).all()


def test_a_pair_stays_a_pair_and_keeps_out_on_both_sides() -> None:
    pond = KeepOut("pond", ((-2100.0, 100.0), (500.0, 100.0), (500.0, 900.0), (-2100.0, 900.0)))
    points = PlannedPoint("left", 0.0, -600.0, is_placed=True), PlannedPoint("right", 0.0, 0.0, mirrors="left"), THIRD
    answer, findings = plan_placement(approach(points, keep_out=(pond,), iterations=10))
    assert "placement.given_kept_out" in {finding.code for finding in findings}
    for design in answer.designs:
        left, right, third = answer.places_of(design.design)
        assert (right.north_m, right.east_m) == pytest.approx((left.north_m, -left.east_m))
        assert not 100.0 < third.east_m < 900.0 and not 100.0 < abs(left.east_m) < 900.0


def test_no_allowed_place_is_an_error_in_a_line() -> None:
    lake = KeepOut("lake", ((-9000.0, -9000.0), (9000.0, -9000.0), (9000.0, 9000.0), (-9000.0, 9000.0)))
    with pytest.raises(GroundstationError, match="no place for third"):
        plan_placement(approach(keep_out=(lake,)))


def test_an_optimum_beyond_the_rectangle_is_told() -> None:
    assert "placement.at_edge" in codes(approach(criterion="determinant", low_north_m=-300.0))


@pytest.mark.parametrize("axis", ["north", "east"])
def test_a_rectangle_without_height_or_width_is_a_line_of_places(axis: str) -> None:
    line = {f"low_{axis}_m": -300.0, f"high_{axis}_m": -300.0}
    answer, findings = plan_placement(approach(criterion="determinant", **line))
    (mapped,) = (figure for figure in answer.figures if figure.name == "placement_map")
    assert len(mapped) == 5 and (mapped[f"{axis}_m"] == -300.0).all() and np.isfinite(mapped["sigma_m"]).all()
    placed = next(one for one in answer.places_of(answer.recommended) if one.point == "third")
    assert (placed.north_m if axis == "north" else placed.east_m) == -300.0
    assert "placement.at_edge" not in {finding.code for finding in findings}
    results = FlightResults("x", Source("a", "00" * 32, 0, ""), {}, None, 0.0, "ok")
    drawn = accuracy_map(replace(results, answers={answer.analysis: answer}, figures=answer.figures))
    assert drawn is not None and drawn.rows[0].panels[0].x.title == ("east, km" if axis == "north" else "north, km")


def test_a_point_where_an_aircraft_starts_is_told() -> None:
    home = PlannedPoint("home", -BEGIN_M, 0.0, CROSSING_M + BEGIN_M * SLOPE)
    assert "plan.at_start" in codes(approach((LEFT, RIGHT, THIRD, home)))
    assert "plan.at_start" not in codes(approach((LEFT, RIGHT, THIRD, replace(home, height_m=0.0))))


def test_points_on_one_line_are_told() -> None:
    column = tuple(PlannedPoint(name, north, 0.0) for name, north in (("A", -1000.0), ("B", 0.0)))
    plan = approach((*column, THIRD), low_east_m=0.0, high_east_m=0.0)
    answer, findings = plan_placement(plan)
    assert np.isnan(answer.design(answer.recommended).dop) and answer.design(answer.recommended).determinant == 0.0
    assert "placement.singular" in {finding.code for finding in findings}


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"fixed_at_s": 0.0}, "fixed_at_s"),
        ({"from_s": 31.0}, "from_s"),
        ({"low_east_m": 2000.0}, "low_east_m"),
        ({"over": "lost", "criterion": "determinant"}, "over"),
        ({"weight_north": 0.0, "weight_east": 0.0, "weight_up": 0.0}, "weight"),
        ({"low_north_m": float("nan")}, "low_north_m"),
    ],
)
def test_a_wrong_question_is_refused(asked: dict[str, object], told: str) -> None:
    with pytest.raises(SettingsError, match=told):
        approach(**asked)


def test_a_polygon_has_three_corners_and_a_mirror_a_point() -> None:
    with pytest.raises(SettingsError, match="corners"):
        KeepOut("line", ((0.0, 0.0), (1.0, 1.0)))
    with pytest.raises(SettingsError, match="finite"):
        KeepOut("nowhere", ((0.0, 0.0), (1.0, float("inf")), (1.0, 0.0)))
    with pytest.raises(SettingsError, match="mirrors"):
        approach((LEFT, replace(RIGHT, mirrors="left"), THIRD))


@pytest.mark.parametrize("seed", range(20))
def test_the_nearest_allowed_place_is_the_nearest(seed: int) -> None:
    """Against every place of a fine grid."""
    rng = np.random.default_rng(seed)
    rings = tuple(rng.uniform(-1.2, 1.2, (int(rng.integers(3, 6)), 2)) for _ in range(3))
    region = Region(np.full(2, -1.0), np.full(2, 1.0), rings)
    axis = np.linspace(-1.0, 1.0, 81)
    grid = np.array([(north, east) for north in axis for east in axis])
    allowed = grid[region.allows(grid)]
    assert region.is_empty == (len(region.corners) == 0) and len(allowed)
    for place in rng.uniform(-1.5, 1.5, (10, 2)):
        found = region.nearest(place)
        assert region.allows(found[None])[0]
        on_the_grid = np.linalg.norm(allowed - place, axis=1).min()
        assert np.linalg.norm(found - place) <= on_the_grid + 1e-12
        assert np.linalg.norm(found - place) >= on_the_grid - 0.05  # as fine as the grid
        assert found == pytest.approx(place) or not region.allows(place[None])[0]


def test_an_approach_is_answered_without_laws_of_control() -> None:
    answer, _ = plan_placement(approach())
    assert isinstance(answer, PlacementPlan) and answer.recommended == "covariance_fixed"
    assert [row.design for row in answer.designs][:2] == [GIVEN, "determinant_fixed"]
