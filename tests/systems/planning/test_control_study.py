"""The control study: published figures, laws flown, the third point of an approach."""

import numpy as np
import pytest

from groundstation.chapters.markdown import escaped
from groundstation.results.figures import FigureData
from groundstation.systems.planning.session.laws import PlannedSession, integral_law
from groundstation.systems.planning.session.study import control
from groundstation.systems.planning.session.study.cases import CASES, SPEED, placements, scenario, with_fixed_point
from groundstation.systems.planning.session.study.control import laws_table, page, placement_table, published_table
from groundstation.systems.planning.session.study.flown import fly
from groundstation.systems.planning.session.study.random_geometry import SIDES_M, random_section, random_table
from groundstation.systems.study import StudyResult

RUNS = 60
SIGMA_OF_RMS = 4.0 / np.sqrt(2.0 * RUNS)  # four of its relative standard error
MOVED_M = 35.0  # a step of the approach: so far may the epoch be from the point asked for


@pytest.fixture(scope="module")
def published() -> FigureData:
    """The published figures of one plan: all of them by `make slow`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(control, "CASES", tuple(case for case in CASES if case.plan == SPEED))
        return published_table(lambda _text: None)


@pytest.mark.slow
def test_published_figures_are_found_but_for_the_height_at_touchdown() -> None:
    published = published_table(lambda _text: None)
    near = dict(zip((case.name for case in CASES), published["within_factor_two"].tolist(), strict=True))
    assert near.pop("moving-touchdown") == "no"
    assert set(near.values()) == {"yes", ""}


def test_control_raises_the_measure_and_lowers_the_dilution(published: FigureData) -> None:
    ours = dict(zip((case.name for case in CASES if case.plan == SPEED), published["ours"].tolist(), strict=True))
    assert ours["speed-measure"] > 1.0 > ours["speed-dop"]
    near = published["within_factor_two"].tolist()
    assert len(near) > 3 and set(near) <= {"yes", ""}


def test_flights_meet_the_accuracy_that_the_plan_computes() -> None:
    session = PlannedSession(scenario(SPEED))
    law = integral_law(session, [session.motion.uncontrolled])
    paths = session.motion.paths(law.controls)
    P = session.model.accuracy(paths.position_m).covariance[-1]
    found = fly(session, paths, RUNS, np.random.default_rng(11))
    assert found.rms_north_m == pytest.approx(np.sqrt(P[0, 0]), rel=SIGMA_OF_RMS)
    assert found.rms_east_m == pytest.approx(np.sqrt(P[1, 1]), rel=SIGMA_OF_RMS)


def test_the_table_of_laws_has_every_law_with_its_limits() -> None:
    table = laws_table(scenario(SPEED), 10, 3, lambda _text: None)
    assert table["law"].tolist() == ["uncontrolled", "determinant", "eigenvalue", "dop", "covariance"]
    assert (table["nees_low"] < 2.0).all() and (table["nees_high"] > 2.0).all()
    assert table["computed_two_sigma_north_m"][-1] < 0.5 * table["computed_two_sigma_north_m"][0]


def test_the_fixed_point_is_where_it_is_asked_for() -> None:
    for before_m in (0.0, 437.0, 1500.0):
        plan = with_fixed_point(scenario("landing-third-point"), before_m)
        moved = plan.user
        assert moved.north_m + moved.speed_mps * plan.placement.fixed_at_s == pytest.approx(-before_m)
        assert abs(moved.north_m + 4000.0) <= MOVED_M


@pytest.mark.slow
def test_the_published_distance_belongs_to_its_fixed_point_alone() -> None:
    wanted = {name: plan for name, plan in placements().items() if name.startswith(("0 m", "200 m", "430 m before"))}
    table = placement_table(wanted, lambda _text: None)
    assert table["is_440_m"].tolist() == ["no", "no", "yes"]
    assert table["determinant_before_m"][1:] == pytest.approx(table["analysis_before_m"][1:], abs=1.0)
    assert table["determinant_before_m"][0] == pytest.approx(4000.0)  # of the threshold: the end of the rectangle


def test_the_page_tells_every_table(published: FigureData) -> None:
    laws = laws_table(scenario(SPEED), 10, 3, lambda _text: None)
    placed = placement_table(dict(list(placements().items())[:1]), lambda _text: None)
    random = random_table(scenario(SPEED), (7.8, 7.2), 2.0, 2, 3)
    text = StudyResult("control", (), page((published, laws, placed, random), 10, 3)).markdown
    assert (
        all(escaped(case.published) in text for case in CASES if case.plan == SPEED)
        and "NEES" in text
        and "440" in text
    )


def test_half_of_all_random_geometries_meet_the_figures_of_speed_control_without_control() -> None:
    found = random_table(scenario(SPEED), (7.8, 7.2), 2.0, 40, 3)
    assert found["square_m"].tolist() == list(SIDES_M)
    assert (found["share_low"] < found["share_within_factor_two"]).all()
    assert found["share_within_factor_two"].mean() > 0.4
    assert "a geometry that meets them with control proves little" in str(random_section(found).parts[0]).lower()
    none = random_table(scenario(SPEED), (0.1, 0.1), 2.0, 5, 3)
    assert (none["share_within_factor_two"] == 0.0).all()
