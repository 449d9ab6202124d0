"""The learned installation: exact sums, what teaches and what does not, changes that nobody told of."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from groundstation.results.installations import Lesson, Measured
from groundstation.systems.heading.installation.answer import InstallationResult
from groundstation.systems.heading.installation.model import (
    doubts,
    factor_nodes,
    first_belief,
    installed,
    learn,
    predict,
)
from groundstation.systems.heading.installation.outcome import verdict_of
from groundstation.systems.heading.installation.series import (
    FIRST,
    SAME_TIME,
    answer_from,
    answers_of,
    pooled_of,
    series_of,
)
from groundstation.systems.heading.installation.settings import InstallationSettings
from groundstation.systems.heading.study.installation import judge_family
from groundstation.systems.heading.study.installation_family import FAMILIES, draw_fleet
from groundstation.systems.heading.study.installation_pool import TaxiOfPool, draw_taxi

SETTINGS = InstallationSettings()
TRUSTING = InstallationSettings(hazard=0.0, odd_rates=(0.0,), odd_weights=(1.0,), gross_share=0.0)
POOL_SEED, POOL_RUNS = 5003, 200  # taxis drawn from their own figures, not through the estimator
LIMIT_DEG = 1.0 / 3.0


def lesson(day: int, number_deg: float, **changes: object) -> Lesson:
    """A flight of a unit with a stored heading, its azimuth seen in flight."""
    plain = Lesson(
        flight_id=f"202605{day:02d}",
        aircraft="A1",
        ins_serial="S1",
        start_utc=f"2026-05-{day:02d}T06:00:00Z",
        number_deg=number_deg,
        taxi_sigma_deg=0.08,
        crosswind_sigma_mps=1.5,
        alignment="stored heading",
        alignment_sigma_deg=1.0,
        azimuth_deg=0.0,
        azimuth_sigma_deg=0.03,
        factor=0.03,
        factor_sigma=0.015,
        steady_sigma_deg=0.05,
        mounting_sigma_deg=0.2,
        verdict="accept",
        error_deg=number_deg,
        half_width_deg=0.25,
        platform_error_deg=number_deg,
        limit_deg=LIMIT_DEG,
    )
    return replace(plain, **changes)  # type: ignore[arg-type]


def answers(lessons: Sequence[Lesson], settings: InstallationSettings = SETTINGS) -> list[InstallationResult]:
    found = {}
    for series in series_of(lessons):
        for one, answer in answers_of(series, settings):
            assert answer is not None
            found[one.flight_id] = answer
    return [found[one.flight_id] for one in lessons]


def pool() -> tuple[TaxiOfPool, ...]:
    """Taxis with honest intervals, without the estimator."""
    rng = np.random.default_rng(POOL_SEED)
    sigma = rng.uniform(0.05, 0.11, POOL_RUNS)
    errors = sigma * rng.standard_normal(POOL_RUNS)
    return tuple(
        TaxiOfPool(float(error), float(one), 1.96 * float(one), 0.0, ())
        for error, one in zip(errors, sigma, strict=True)
    )


# The sums


def test_posterior_is_that_of_generalised_least_squares() -> None:
    """With a known factor and no doubts: mounting and steady sideslip by the normal equations, written out."""
    rng = np.random.default_rng(1)
    flights = [
        lesson(day, float(rng.normal(0.3, 0.1)), crosswind_mps=float(rng.normal(0.0, 3.0)), factor_sigma=0.0)
        for day in range(1, 6)
    ]
    belief = first_belief(flights[0], TRUSTING)
    for one in flights:
        belief = learn(belief, one, TRUSTING)
    variance = 0.08**2 + (0.03 * 1.5) ** 2 + 1.0 / (1.0 / 1.0**2 + 1.0 / 0.03**2)
    shown = [(one.number_deg or 0.0) - 0.03 * one.crosswind_mps for one in flights]
    information = np.ones((2, 2)) * len(flights) / variance + np.diag([0.2**-2, 0.05**-2])
    mean = np.linalg.solve(information, np.full(2, sum(shown) / variance))
    covariance = np.linalg.inv(information)
    found = installed(belief)
    assert (found.mounting_deg, found.steady_deg) == pytest.approx(mean.tolist(), abs=1e-9)
    sigmas = np.sqrt(np.diag(covariance))
    assert (found.mounting_sigma_deg, found.steady_sigma_deg) == pytest.approx(sigmas.tolist(), abs=1e-9)
    assert found.sum_sigma_deg == pytest.approx(float(np.sqrt(covariance.sum())), abs=1e-9)


def test_factor_is_learned_from_flights_in_different_winds() -> None:
    """True factor twice that of the class: six flights in winds of +-6 m/s say so, and their mounting is right."""
    winds = [6.0, -6.0, 5.0, -5.0, 6.0, -6.0]
    flights = [
        lesson(day, 0.1 + 0.06 * wind, crosswind_mps=wind, crosswind_sigma_mps=0.2, taxi_sigma_deg=0.03)
        for day, wind in enumerate(winds, 1)
    ]
    belief = first_belief(flights[0], SETTINGS)
    for one in flights:
        belief = learn(belief, one, SETTINGS)
    found = installed(belief)
    assert found.factor == pytest.approx(0.06, abs=2.5 * found.factor_sigma) and found.factor_sigma < 0.004
    assert found.sum_deg == pytest.approx(0.1, abs=0.02)


def test_factor_nodes_have_mean_and_sigma_of_the_class() -> None:
    for mean, sigma in ((0.035, 0.05), (0.027, 0.0135)):
        nodes, weight = factor_nodes(mean, sigma, SETTINGS)
        assert float(weight @ nodes) == pytest.approx(mean, rel=0.01)
        assert float(np.sqrt(weight @ (nodes - mean) ** 2)) == pytest.approx(sigma, rel=0.05)
        assert (nodes > 0.0).all()


@pytest.mark.slow
def test_grid_and_histories_are_fine_enough() -> None:
    """Against four times the values and histories the half widths differ by less than half an arcminute."""
    fine = InstallationSettings(hypotheses=200, nodes=61, factor_sigmas=5.0)
    for number in (0, 6, 8):
        for flights in draw_fleet(number, POOL_SEED, pool(), 2):
            lessons = [one.lesson for one in flights]
            for coarse, sure in zip(answers(lessons), answers(lessons, fine), strict=True):
                assert coarse.half_width_deg == pytest.approx(sure.half_width_deg, abs=0.5 / 60.0)
                assert coarse.error_deg == pytest.approx(sure.error_deg, abs=0.5 / 60.0)


def test_weights_are_those_of_a_distribution() -> None:
    belief = first_belief(lesson(1, 0.1), SETTINGS)
    for day in range(1, 8):
        belief = learn(belief, lesson(day, 0.1 * day), SETTINGS)
        assert belief.weight.sum() == pytest.approx(1.0)
        assert len(belief.histories) <= SETTINGS.hypotheses and len(set(map(len, belief.histories))) == 1
    mixture = predict(belief, lesson(9, 0.5), SETTINGS)
    assert mixture.weight.sum() == pytest.approx(1.0) and (mixture.sigma > 0.0).all()


# What it does to the numbers


def test_mounting_comes_off_the_platforms_number_and_not_off_the_airframes() -> None:
    flights = [lesson(day, 0.4) for day in range(1, 6)]
    last = answers(flights)[-1]
    assert last.flights == 4
    assert last.error_deg == pytest.approx(0.4, abs=0.05)
    assert last.platform_error_deg == pytest.approx(0.0, abs=0.06)
    assert last.platform_standard_error_deg is not None and last.platform_standard_error_deg < 0.15


def test_parts_add_up_to_the_whole() -> None:
    last = answers([lesson(day, 0.1 * day, crosswind_mps=2.0) for day in range(1, 5)])[-1]
    for parts, sigma in (
        (last.interval_parts, last.standard_error_deg),
        (last.platform_parts, last.platform_standard_error_deg),
    ):
        assert [one.name for one in parts] == ["taxi", "wind", "installation"]
        assert sigma == pytest.approx(float(np.sqrt(sum(one.sigma_deg**2 for one in parts))), rel=1e-6)


def test_gyrocompass_needs_no_azimuth_and_a_stored_heading_without_one_teaches_nothing() -> None:
    gyro = [lesson(day, 0.2, alignment_sigma_deg=0.1, azimuth_deg=None, azimuth_sigma_deg=None) for day in range(1, 7)]
    stored = [replace(one, alignment_sigma_deg=1.0) for one in gyro]
    narrow, wide = answers(gyro)[-1], answers(stored)[-1]
    assert narrow.installed is not None and wide.installed is not None
    assert narrow.installed.sum_sigma_deg < 0.08 < 0.18 < wide.installed.sum_sigma_deg
    alone = 1.96 * np.sqrt(0.08**2 + (0.03**2 + 0.015**2) * 1.5**2 + 0.05**2)
    assert wide.half_width_deg == pytest.approx(alone, abs=1.0 / 60.0)


def test_reference_at_the_stand_shows_the_crab() -> None:
    """A theodolite at the stand holds the mounting, not the sideslip: the rest of the taxi's number is sideslip."""
    without = [lesson(day, 0.25, steady_sigma_deg=0.2) for day in range(1, 7)]
    seen = [replace(one, reference_deg=0.1, reference_sigma_deg=0.05) for one in without]
    blind, sees = answers(without)[-1].installed, answers(seen)[-1].installed
    assert blind is not None and sees is not None
    assert sees.steady_deg == pytest.approx(0.15, abs=0.04) and sees.steady_sigma_deg < 0.05 < blind.steady_sigma_deg
    assert sees.mounting_deg == pytest.approx(0.1, abs=0.04)
    assert answers(seen)[-1].error_deg == pytest.approx(0.1, abs=0.05)


# Doubts


def test_unit_turned_round_is_learned_anew_and_named() -> None:
    flights = [lesson(day, 0.1) for day in range(1, 4)] + [lesson(day, -179.9) for day in range(4, 8)]
    last = answers(flights)[-1]
    assert last.changed == ("20260504",) and not last.odd
    assert last.platform_error_deg == pytest.approx(0.0, abs=0.1)
    assert last.error_deg == pytest.approx(-179.9, abs=0.1)


def test_flight_of_another_unit_is_named_and_left_out() -> None:
    flights = [lesson(day, 0.1 if day != 4 else 1.1) for day in range(1, 8)]
    last = answers(flights)[-1]
    assert last.odd == ("20260504",) and not last.changed
    assert last.platform_error_deg == pytest.approx(0.0, abs=0.06)


def test_two_units_under_one_serial_widen_the_interval() -> None:
    one = answers([lesson(day, 0.3) for day in range(1, 8)])[-1]
    two = answers([lesson(day, 0.3 if day % 2 else -0.3) for day in range(1, 8)])[-1]
    assert one.platform_standard_error_deg is not None and two.platform_standard_error_deg is not None
    assert two.platform_standard_error_deg > 1.5 * one.platform_standard_error_deg


def test_probabilities_of_oddity_go_with_the_flights() -> None:
    belief = first_belief(lesson(1, 0.1), SETTINGS)
    for day in range(1, 6):
        belief = learn(belief, lesson(day, 0.1 if day != 3 else 2.0), SETTINGS)
    odd, changed = doubts(belief)
    assert odd.shape == changed.shape == (5,)
    assert int(np.argmax(odd)) == 2 and odd[2] > 0.9 and changed[2] < 0.1


# Which flights teach


def test_first_flight_has_the_answer_of_its_taxi_alone() -> None:
    (only,) = answers([lesson(1, 0.3, half_width_deg=0.4)])
    assert only.why_not == FIRST and only.flights == 0
    assert (only.error_deg, only.half_width_deg) == (0.3, 0.4)


def test_order_of_arrival_does_not_matter() -> None:
    flights = [lesson(day, 0.1 * day, crosswind_mps=float(day)) for day in range(1, 7)]
    forward = answers(flights)
    backward = answers(flights[::-1])[::-1]
    assert forward == backward


def test_later_flights_do_not_teach_and_an_added_one_changes_later_ones_alone() -> None:
    flights = [lesson(day, 0.1 * day) for day in (1, 3, 4, 6)]
    before, after = answers(flights), answers([*flights, lesson(5, -0.2)])
    assert after[:3] == before[:3]
    assert after[3] != before[3] and after[3].flights == before[3].flights + 1


def test_unit_in_another_aircraft_begins_anew_and_anew_when_it_comes_back() -> None:
    flights = [lesson(1, 0.4), lesson(2, 0.4), lesson(3, 0.1, aircraft="B2"), lesson(4, 0.4)]
    found = answers(flights)
    assert [one.flights for one in found] == [0, 1, 0, 0]
    assert found[2].why_not == FIRST


def test_another_serial_begins_anew_and_leaves_the_first_alone() -> None:
    flights = [lesson(1, 0.4), lesson(2, 0.4), lesson(3, 0.1, ins_serial="S9"), lesson(4, 0.4)]
    assert [one.flights for one in answers(flights)] == [0, 1, 0, 2]


def test_flights_that_begin_at_one_time_do_not_teach() -> None:
    twins = [lesson(2, 0.4, flight_id="a"), lesson(2, 0.4, flight_id="b")]
    flights = [lesson(1, 0.4), *twins, lesson(3, 0.4)]
    assert [one.flights for one in answers(flights)] == [0, 1, 1, 1]
    (series,) = series_of(flights)
    assert [one.not_taught for one in series.lessons] == ["", SAME_TIME, SAME_TIME, ""]


def test_fractions_of_a_second_are_in_order() -> None:
    flights = [
        lesson(1, 0.1, flight_id="late", start_utc="2026-05-01T06:00:00.5Z"),
        lesson(1, 0.1, flight_id="early", start_utc="2026-05-01T06:00:00Z"),
    ]
    (series,) = series_of(flights)
    assert [one.flight_id for one in series.lessons] == ["early", "late"]


@pytest.mark.parametrize("missing", ["ins_serial", "aircraft", "start_utc"])
def test_without_serial_aircraft_or_utc_there_is_no_learning(missing: str) -> None:
    flights = [lesson(1, 0.4), lesson(2, 0.4, **{missing: "", "not_taught": "said"})]
    assert all(len(series.lessons) == 1 for series in series_of(flights))
    found = answer_from(flights[1], flights[:1], SETTINGS)
    assert found is not None and found.why_not == "said" and found.flights == 0


def test_rejected_taxi_is_told_and_teaches_nothing() -> None:
    flights = [lesson(1, 0.4), lesson(2, 3.0, not_taught="taxi rejected: steps", verdict="reject"), lesson(3, 0.4)]
    found = answers(flights)
    assert [one.flights for one in found] == [0, 1, 1]
    assert found[1].verdict == "reject" and found[1].correction_deg is None


def test_class_stated_later_is_taken_for_the_flights_before() -> None:
    flights = [lesson(1, 0.4, factor=0.035, factor_sigma=0.05), *(lesson(day, 0.4) for day in (2, 3))]
    as_if_always = [replace(one, factor=0.03, factor_sigma=0.015) for one in flights]
    assert answers(flights)[1:] == answers(as_if_always)[1:]


def test_one_flight_from_a_list_has_the_answer_of_the_series() -> None:
    flights = [lesson(day, 0.1 * day) for day in range(1, 6)]
    assert answer_from(flights[3], flights, SETTINGS) == answers(flights)[3]


# Other sensors


def test_other_sensors_pool_by_the_same_rule_and_name_what_is_odd() -> None:
    arms = [4.1, 4.0, 3.9, 9.0, 4.0, 4.05]
    flights = [lesson(day, 0.1, measured=(Measured("antenna_arm_m", arm, 0.2),)) for day, arm in enumerate(arms, 1)]
    (series,) = series_of(flights)
    (arm,) = pooled_of(series, SETTINGS)
    assert (arm.name, arm.flights, arm.odd, arm.changed) == ("antenna_arm_m", 6, ("20260504",), ())
    assert arm.value == pytest.approx(4.0, abs=0.1) and arm.sigma == pytest.approx(0.2 / np.sqrt(5), rel=0.1)


def test_other_sensors_never_pool_across_serials() -> None:
    flights = [
        lesson(1, 0.1, measured=(Measured("compass_a_deg", 1.0, 0.1),)),
        lesson(2, 0.1, ins_serial="S2", measured=(Measured("compass_a_deg", -1.0, 0.1),)),
    ]
    found = [pooled_of(series, SETTINGS)[0] for series in series_of(flights)]
    assert [(one.flights, round(one.value, 1)) for one in found] == [(1, 1.0), (1, -1.0)]


# Verdicts


@pytest.mark.parametrize(
    "verdict, failed, half_width, expected",
    [
        ("advisory", ("whole_half_width",), 0.3, "accept"),
        ("advisory", ("whole_half_width",), 0.4, "advisory"),
        ("accept", (), 0.3, "accept"),
        ("accept", (), 0.4, "advisory"),
        ("extend", ("whole_half_width",), 0.3, "accept"),
        ("extend", ("precision",), 0.3, "extend"),
        ("extend", ("taxi_seconds",), 0.1, "extend"),
        ("reject", ("steps",), 0.1, "reject"),
        ("undecided", ("geometry",), 0.1, "undecided"),
    ],
)
def test_verdict_is_on_the_sum(verdict: str, failed: tuple[str, ...], half_width: float, expected: str) -> None:
    assert verdict_of(lesson(1, 0.1, verdict=verdict, failed=failed), half_width) == expected


def test_taxi_that_is_the_larger_part_asks_for_more_of_it() -> None:
    assert verdict_of(lesson(1, 0.1, failed=("whole_half_width",), taxi_sigma_deg=0.16), 0.36) == "extend"
    assert verdict_of(lesson(1, 0.1, failed=("whole_half_width",), taxi_sigma_deg=0.10), 0.36) == "advisory"


def test_whole_that_does_not_decide_refuses_nothing() -> None:
    assert verdict_of(lesson(1, 0.1, limit_deg=None), 3.0) == "accept"


# Families


OFTEN, LONG = ("gyrocompass", "replaced, not told"), ("stored, azimuth, METAR", "turned", "stand")


@pytest.mark.parametrize("name", [*OFTEN, *(pytest.param(one, marks=pytest.mark.slow) for one in LONG)])
def test_intervals_hold_the_truth_of_small_fleets(name: str) -> None:
    """20 aircraft of 6 flights each: 0.85 is 4.5 binomial sigmas below 0.95, and lets one told-of flight in six go."""
    number = [family.name for family in FAMILIES].index(name)
    judged = judge_family(number, POOL_SEED, pool(), aircraft=20)
    assert np.mean([one.is_inside for one in judged]) > 0.88
    told = [one for one in judged if one.taught and one.since != 1]
    assert np.mean([one.is_platform_inside for one in told]) > 0.85


def test_taxi_of_the_pool_is_one_of_the_estimator() -> None:
    taxi = draw_taxi(5001, 0)
    assert abs(taxi.error_deg) < 0.4 and 0.0 < taxi.sigma_deg < 0.3
    assert "whole_half_width" not in taxi.failed
