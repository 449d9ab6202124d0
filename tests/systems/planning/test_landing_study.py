"""The landing study: its cases, its verdicts and its page, on few runs."""

from dataclasses import replace

import pytest

from groundstation.systems.planning.landing.answer import TOUCHDOWN, RangeLanding
from groundstation.systems.planning.landing.outcome import range_landing
from groundstation.systems.planning.landing.plan import LANDING_PLAN
from groundstation.systems.planning.landing.study import cases as landing_cases
from groundstation.systems.planning.landing.study.bearings import bearing_spans, bearing_table
from groundstation.systems.planning.landing.study.cases import CLAIMS, FLOWN, PUBLISHED, SIGMAS, approach, variations
from groundstation.systems.planning.landing.study.landing import run_approaches
from groundstation.systems.planning.landing.study.tables import (
    category_table,
    holds,
    order_table,
    sigma_table,
    trial_table,
    variation_table,
)
from groundstation.systems.shipped_plans import plan_names


@pytest.fixture(scope="module")
def answers() -> dict[str, RangeLanding]:
    return {name: range_landing(replace(approach(name), trials=0)) for name in PUBLISHED}


def test_every_case_names_a_shipped_approach() -> None:
    assert {*FLOWN, *PUBLISHED} <= set(plan_names(LANDING_PLAN))
    assert all(approach(name).title for name in plan_names(LANDING_PLAN))


def test_published_sigmas_are_found_within_a_factor_of_two(answers: dict[str, RangeLanding]) -> None:
    table = sigma_table(answers)
    assert list(table["within_factor_two"]) == ["yes"] * len(SIGMAS)
    assert table["ours_m"][-1] == pytest.approx(1.7, abs=0.1)  # published: 1.6 to 1.8 m


def test_the_moving_point_shows_no_category_two_in_height_at_touchdown(answers: dict[str, RangeLanding]) -> None:
    table = category_table(answers)
    row = list(table["published"]).index("moving fourth: category II in height")
    assert table["at_threshold"][row] == "holds"
    assert table["at_touchdown"][row] == "refuted"


def test_claims_by_hand() -> None:
    claim = CLAIMS[0]
    assert holds(claim, 20.0)
    assert not holds(claim, 10.0)
    assert holds(replace(claim, axis="vertical", category="CAT I"), 5.9)
    assert not holds(replace(claim, axis="vertical", category="CAT II and IIIA"), 2.1)


def test_order_puts_the_worst_first_and_the_moving_point_last(answers: dict[str, RangeLanding]) -> None:
    table = order_table(answers)
    assert sorted(table["touchdown_up_m"], reverse=True) == list(table["touchdown_up_m"])
    assert table["approach"][-1] == "moving-fourth"


def test_height_at_touchdown_follows_the_wander_of_the_barometer() -> None:
    changed = {name: one for name, one in variations().items() if name.startswith("baro") or "0.5 s" in name}
    table = variation_table({name: range_landing(replace(one, trials=0)) for name, one in changed.items()})
    up = dict(zip(table["changed"], table["touchdown_up_m"], strict=True))
    assert up["baro 10 m over 3600 s"] < 0.5 * up["baro 100 m over 3600 s"]
    assert up["3 m each 0.5 s"] > 3.0


@pytest.mark.slow
def test_trials_are_flown_in_processes_and_told_with_their_limits() -> None:
    scenario = replace(approach("moving-fourth"), noise=landing_cases.RangeNoise(interval_s=0.1))
    told: list[str] = []
    found = run_approaches({"one": scenario, "two": scenario}, {"one": 3}, 7, told.append)
    assert told == ["one: 3 approaches", "two: 0 approaches"]
    assert found["two"].trials == ()
    answer = found["one"]
    assert answer.trials == range_landing(replace(scenario, trials=3, seed=7)).trials
    table = trial_table({"one": answer})
    assert len(table) == len(answer.trials)
    assert set(table["trials"]) == {3}
    assert answer.at(TOUCHDOWN).height_m < 2.0


@pytest.mark.slow
def test_drawn_bearings_err_as_the_formulas_say_and_refute_category_two_laterally() -> None:
    table = bearing_table(1500, 5)
    near = (table["before_threshold_m"] <= 2000.0) & (table["bearing_sigma_deg"] == 1.0)
    for axis in ("lateral", "glide_path"):
        assert table[f"{axis}_drawn_m"][near] == pytest.approx(table[f"{axis}_formula_m"][near], rel=0.1)
    assert set(table["category_two_laterally"]) == {"refuted"}
    holds_in_height = table["before_threshold_m"][table["category_two_in_height"] == "holds"]
    assert 0.0 < holds_in_height.max() < 500.0


def test_spans_name_where_bearings_meet_a_category() -> None:
    table = bearing_spans()
    rows = {
        (sigma, category, axis): told
        for sigma, category, axis, told in zip(*(table[name] for name in table.columns), strict=True)
    }
    assert rows[(1.0, "CAT II and IIIA", "vertical")] == "305 to 0"
    assert rows[(2.0, "CAT II and IIIA", "vertical")] == "nowhere"
    assert ", " in rows[(1.0, "CAT I", "lateral")]  # about either locator
