"""Steps of the INS heading in the estimate: the error is that after the last, however many there are."""

from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from groundstation.base.angles import wrap_360
from groundstation.methods.taxi_error import interval
from groundstation.simulation.taxi import TaxiCase, simulate_taxi, table_of, taxi_flight
from groundstation.systems.heading.answer import HeadingStep
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.solution import MOST_STEPS, STEP_SIGMA_DEG, _before
from groundstation.tables.table import Flight

TWO_TURNS = TaxiCase(segments_s=(60.0, 60.0, 60.0), turns_deg=(90.0, -100.0), antenna_arm_m=4.0)
TAXI_S = (70.0, 220.0)  # within the moving part of it


def stepped(count: int, seed: int = 4) -> tuple[Flight, float]:
    """A taxi whose INS heading has so many steps of 2 deg or so, and the azimuth error after the last."""
    flight = taxi_flight(simulate_taxi(TWO_TURNS, np.random.default_rng(seed)))
    rng, ins = np.random.default_rng(seed), flight.tables["ins"]
    time_s = (ins.time_ns - ins.time_ns[0]) / 1e9
    places = np.linspace(*TAXI_S, count)
    sizes_deg = rng.choice([-1.0, 1.0], count) * rng.uniform(1.5, 2.5, count)
    added_deg = (time_s[:, None] >= places) @ sizes_deg
    heading_deg = wrap_360(ins.columns["true_heading_deg"].values + added_deg)
    columns = {"true_heading_deg": heading_deg, "mode": ins.columns["mode"].values}
    tables = flight.tables | {"ins": table_of("ins", ins.time_ns, columns)}
    return replace(flight, tables=MappingProxyType(tables)), float(sizes_deg.sum())


@pytest.mark.slow
def test_many_steps_cost_as_little_as_some_and_the_error_is_that_after_the_last(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    widths = list[int]()
    whole = interval._Target.evaluate

    def count(self: interval._Target, *given: np.ndarray) -> tuple[np.ndarray, ...]:
        widths.append(self.taxi[1].shape[1])
        return whole(self, *given)

    monkeypatch.setattr(interval._Target, "evaluate", count)
    settings = HeadingSettings(posterior_draws=500)
    found, widest = {}, {}
    for steps in (0, MOST_STEPS, 3 * MOST_STEPS):
        flight, after_deg = stepped(steps)
        widths.clear()
        found[steps] = estimate_heading_error(flight, settings=settings)
        assert abs(len(found[steps].steps) - steps) <= 1, "one in a turn may hide"
        width = np.ptp(found[steps].confidence95_deg)
        assert found[steps].error_deg == pytest.approx(found[0].error_deg + after_deg, abs=width)
        assert found[steps].verdict != "accept" or not steps
        widest[steps] = max(widths)
    assert widest[3 * MOST_STEPS] == widest[0] + MOST_STEPS + 1


def test_steps_told_together_have_the_sum_and_the_variance_of_single_ones() -> None:
    rng = np.random.default_rng(39)
    steps = tuple(HeadingStep(float(at), float(rng.uniform(0.2, 3.0))) for at in range(1, 21))
    used = SimpleNamespace(time_s=np.arange(0.0, 30.0, 0.5))
    found = _before(used, steps)  # type: ignore[arg-type]
    assert len(found) == MOST_STEPS + 1
    expected = -sum(np.where(used.time_s < step.time_s, step.size_deg, 0.0) for step in steps)
    assert sum(one.values * one.prior_mean for one in found) == pytest.approx(expected)
    apart = sorted(abs(step.size_deg) for step in steps)[:-MOST_STEPS]
    together = found[-1].prior_sigma * np.sqrt(np.sum(np.square(apart)))
    assert together == pytest.approx(STEP_SIGMA_DEG * np.sqrt(len(apart)))
    few = _before(used, steps[:MOST_STEPS])  # type: ignore[arg-type]
    assert [(one.prior_mean, one.prior_sigma) for one in few] == [
        (-s.size_deg, STEP_SIGMA_DEG) for s in steps[:MOST_STEPS]
    ]
