"""Shipped limits of the heading correction, each held to its source: changing one is a decision with a reason."""

from dataclasses import fields

import numpy as np
import pytest

from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.chapters.parts import Facts
from groundstation.plots.marks import Limit
from groundstation.simulation.taxi import TaxiCase, simulate_taxi, taxi_flight
from groundstation.systems.heading.advice_chapter import STANDSTILL_S
from groundstation.systems.heading.answer import MEAN_SPEED_LIMIT, RAW_SPEED_LIMIT
from groundstation.systems.heading.chapter import heading
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.gates_answer import GATES, LIMITS
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.standstill_plots import components
from groundstation.systems.heading.standstill_plots import mean_speed as mean_speed_plot
from groundstation.systems.heading.verdict import gate_bounds
from tests.report_example import example, heading_result

PAPER = "Markelov, Kostishin, Shukalov, Heading correction of an INS before take-off by satellite navigation, 2015"
ENOUGH = 1000  # samples


@pytest.mark.parametrize(
    ("name", "value", "source"),
    [
        ("precision_max_deg", 0.05, f"{PAPER}: precision e"),
        ("quality_max_deg", 0.3, f"{PAPER}: spread of the running mean"),
        ("speed_of_mean_max_mps", 0.01, f"{PAPER}: mean velocity at standstill"),
        ("taxi_min_s", 20.0, f"{PAPER}: shortest of 11 taxi runs"),
        ("taxi_speed_min_mps", 6.0, f"{PAPER}: ground speed of a sample"),
        ("turn_rate_max_dps", 1.0, f"{PAPER}: rate of the INS heading of a sample"),
        ("geometry_max", 2.0, f"{PAPER}: geometric factor"),
        ("standstill_speed_max_mps", 0.2, f"{PAPER}: speed of the 1-s mean at standstill"),
        ("standstill_min_s", 10.0, f"{PAPER}: standstill of 10 to 30 s"),
        ("standstill_max_s", 30.0, f"{PAPER}: standstill of 10 to 30 s"),
        ("half_width_max_deg", 0.2, "20 arcmin is then more than three sigma"),
    ],
)
def test_a_shipped_limit_is_that_of_its_source(name: str, value: float, source: str) -> None:
    assert getattr(HeadingSettings(), name) == value, source


def test_limits_that_figures_show_without_an_answer_are_the_shipped_ones() -> None:
    shipped = HeadingSettings()
    for name, value in (RAW_SPEED_LIMIT, MEAN_SPEED_LIMIT, ("standstill_max_s", STANDSTILL_S)):
        assert getattr(shipped, name) == value


def test_the_whole_interval_may_be_as_wide_as_the_published_errors() -> None:
    assert HeadingSettings().whole_half_width_max_deg * ARCMIN_PER_DEG == pytest.approx(20.0), PAPER


def test_the_gates_use_the_shipped_limits() -> None:
    bounds = gate_bounds(HeadingSettings(), ENOUGH)
    assert bounds["precision"] == (None, 0.05)
    assert bounds["quality"] == (None, 0.3)
    assert bounds["standstill_speed_of_mean"] == (None, 0.01)
    assert bounds["taxi_seconds"] == (20.0, None)
    assert bounds["whole_half_width"] == (None, pytest.approx(20.0 / 60.0))


def test_each_gate_is_a_row_of_the_table_and_has_a_bound() -> None:
    built = estimate_heading_error(taxi_flight(simulate_taxi(TaxiCase(), np.random.default_rng(0)))).gates
    assert {gate.name for gate in built} == set(GATES) and len(built) == len(GATES)
    for kind in GATES.values():
        assert (kind.limit is None) == bool(kind.setting), kind.name
        assert kind.required == "never" or kind.failed, f"{kind.name}: no words for a crew"
    names = {field.name for field in fields(HeadingSettings)}
    assert names >= LIMITS and {kind.setting for kind in GATES.values() if kind.setting} <= names


def test_figures_show_the_limits_that_the_answer_rests_on() -> None:
    results = example(heading_result(settings={"standstill_speed_max_mps": 0.3, "speed_of_mean_max_mps": 0.02}))
    workings = [part for part in heading(results).appendix if isinstance(part, Facts)]
    assert "Raw samples above 0.3 m/s" in [pair[0] for part in workings for pair in part.pairs]
    plane, mean_speed = components(results), mean_speed_plot(results)
    assert plane is not None and "circle: 0.3 m/s; cross" in plane.caption
    assert mean_speed is not None
    assert next(mark.value for mark in mean_speed.panels[0].marks if isinstance(mark, Limit)) == 0.02
