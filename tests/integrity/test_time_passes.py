"""Compiled passes over many times tell what the shorter ways beside them tell."""

from dataclasses import fields

import numpy as np
import pytest

from groundstation.base.records import Column, Item, LogHeader, RecordBatch
from groundstation.integrity import places, survey, time_passes
from groundstation.integrity.steps_by_source import StepsBySource
from tests.integrity.test_places import described, log_of

US = 1_000


def batches_of(seed: int, sources: int) -> list[RecordBatch]:
    """Three batches of a topic of several sources, each with steps back and rows without a time."""
    rng = np.random.default_rng(seed)
    made = []
    for number in range(3):
        time = np.cumsum(rng.integers(-2, 9, 500)) * US + number * 2_000 * US
        time = Column(time, rng.random(500) < 0.9 if number == 1 else None)
        index = np.arange(500) + 500 * number
        made.append(RecordBatch("ins", index, time, {}, sources=rng.integers(0, sources, 500)))
    return made


@pytest.mark.parametrize("is_many", [False, True])
@pytest.mark.parametrize("sources", [1, 3, 90])
def test_steps_back_are_those_of_each_source(sources: int, is_many: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Several sources, more of them than a pass tells apart too, against a count row by row."""
    monkeypatch.setattr(time_passes, "MANY", 1 if is_many else 10_000)
    steps, last, expected = StepsBySource(), dict[int, int](), 0
    for batch in batches_of(4, sources):
        assert batch.sources is not None
        steps.add(batch)
        rows = zip(batch.sources.tolist(), batch.device_time_ns.values.tolist(), batch.device_time_ns.mask, strict=True)
        for source, time_ns, is_timed in rows:
            expected += is_timed and time_ns < last.get(source, time_ns)
            if is_timed:
                last[source] = time_ns
    assert steps.counts == {"ins": expected} and expected > 1
    assert type(steps.counts["ins"]) is int


@pytest.mark.parametrize("window_records", [500, 500_000])
@pytest.mark.parametrize("seed", range(12))
def test_a_clock_of_many_records_is_that_of_few(
    seed: int, window_records: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Late ones, wrong times, gaps, a frozen topic: laid by compiled passes, in windows and at once."""
    monkeypatch.setattr(places, "WINDOW_RECORDS", window_records)
    items: list[Item] = log_of(seed, is_counting=True)
    few = survey(items)
    monkeypatch.setattr(time_passes, "MANY_IN_ALL", 1)
    monkeypatch.setattr(places, "MANY_LAID", 1)
    many = survey(items)
    for entry in fields(few.clock):
        one, other = getattr(few.clock, entry.name), getattr(many.clock, entry.name)
        assert np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other, entry.name
    assert described(few) == described(many)


def test_a_period_is_exact_whatever_its_units(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps of whole microseconds, of none, and longer than the table holds."""
    monkeypatch.setattr(time_passes, "MANY_IN_ALL", 1)
    for steps in ([1_000, 5_000, 7_000], [1_001, 5_003, 7_000], [90_000_000, 80_000_000, 1_000]):
        time = np.concatenate(([0], np.cumsum(np.tile(steps, 40))))
        batch = RecordBatch("raw.a", np.arange(len(time)), Column(time), {})
        found = survey([LogHeader("test", has_counting_clock=True), batch])
        assert found.clock.period_ns == sorted(steps)[1]
        assert found.clock.longest_step_ns == max(steps)
