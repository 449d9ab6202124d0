"""What a survey keeps does not grow with the log, and a log taken in windows tells what it tells at once."""

import sys
import tracemalloc
from collections.abc import Iterator
from dataclasses import fields

import numpy as np
import pytest

from groundstation.base.records import Column, Item, LogHeader, RecordBatch
from groundstation.integrity import places, rhythm
from groundstation.integrity.survey import Survey, survey

NS = 10**9
PERIOD_SHARE = 0.05  # its median is over all records of a long log, over those that are believed of others


def log_of(seed: int, is_counting: bool) -> list[Item]:
    """Blocks of records of five topics: late ones, wrong times, gaps, a frozen topic, one without times."""
    rng = np.random.default_rng(seed)
    items: list[Item] = [LogHeader("test", has_counting_clock=is_counting)]
    first, now = 7, 100 * NS
    for _block in range(12):
        count = int(rng.integers(100, 400))
        time = now + np.cumsum(rng.integers(5, 15, count) * 1_000_000)
        now = int(time[-1]) + int(rng.choice([0, 0, 0, 20])) * NS
        late = rng.random(count) < 0.02
        time[late] -= rng.integers(0, 6, int(late.sum())) * NS
        wrong = rng.random(count) < rng.choice([0.0, 0.01, 0.05])
        time[wrong] += rng.integers(-90, 90_000, int(wrong.sum())) * NS
        topic = rng.integers(0, 5, count)
        time[topic == 4] = 42 * NS
        for number in range(5):
            which = np.flatnonzero(topic == number)
            absent = np.zeros(len(which), dtype=bool) if number == 3 else None
            batch = RecordBatch(f"raw.t{number}", first + which, Column(time[which], absent), {})
            items += [batch, RecordBatch("ins", *(batch.record_index, batch.device_time_ns), {})] * (number == 0)
            items += [batch] * (number > 0)
        first += count
    return items


def described(found: Survey) -> dict[str, object]:
    return {topic.topic: topic.entry(found.clock, {}) for topic in found.ledger.topics}


@pytest.mark.parametrize("is_counting", [True, False])
@pytest.mark.parametrize("seed", range(25))
def test_windows_tell_what_the_whole_tells(seed: int, is_counting: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    items = log_of(seed, is_counting)
    whole = survey(items)
    monkeypatch.setattr(places, "WINDOW_RECORDS", 500)
    monkeypatch.setattr(places, "MEMORY_BYTES", 4_000)
    windowed = survey(items)
    for entry in fields(whole.clock):
        one, other = (getattr(found.clock, entry.name) for found in (whole, windowed))
        if entry.name == "period_ns":
            assert other == pytest.approx(one, rel=PERIOD_SHARE if is_counting else 0)
        else:
            assert np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other, entry.name
    assert described(whole) == described(windowed)


def long_log(blocks: int, records: int = 60_000, topics: int = 30, of_one_time: int = 1) -> Iterator[Item]:
    """Blocks of records of several topics, 100 different times in a second."""
    yield LogHeader("test", has_counting_clock=True)
    for block in range(blocks):
        index = np.arange(records) + block * records
        for number in range(topics):
            which = index[number::topics]
            yield RecordBatch(f"raw.t{number}", which, Column(which // of_one_time * 10_000_000), {})


def test_memory_of_a_survey_hardly_grows_with_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice the records, 1.2 million more: 20 MB if they were kept, 48 if they were laid in order at once as well."""
    monkeypatch.setattr(places, "WINDOW_RECORDS", 100_000)
    monkeypatch.setattr(places, "MEMORY_BYTES", 1 << 20)
    peaks = []
    for blocks in (20, 40):
        tracemalloc.start()
        found = survey(long_log(blocks))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert sum(topic.rows for topic in found.ledger.topics) == blocks * 60_000
    assert peaks[1] < 24e6 and peaks[1] - peaks[0] < 4e6, peaks


def test_times_of_one_topic_alone_are_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are its times and its steps, 16 bytes a record, and what marks some: not those of the topic before too."""
    monkeypatch.setattr(places, "WINDOW_RECORDS", 100_000)
    monkeypatch.setattr(places, "MEMORY_BYTES", 1 << 20)
    blocks = 40
    tracemalloc.start()
    found = survey(long_log(blocks, 100_000, 2, of_one_time=4))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert [topic.duplicates for topic in found.ledger.topics] == [1_000_000, 1_000_000]
    assert peak < 24 * blocks * 50_000, peak


@pytest.mark.parametrize("seed", range(4))
def test_steps_ahead_in_parts(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = np.random.default_rng(seed).integers(0, 3, 5_000)
    monkeypatch.setattr(rhythm, "MOST_STEPS", 300)
    monkeypatch.setattr(rhythm, "AT_ONCE", 37)
    ahead = steps[steps > 0]
    assert np.array_equal(rhythm._some_ahead(steps, len(ahead)), ahead[:: len(ahead) // 300 | 1])


@pytest.mark.parametrize(("blocks", "times"), [(1, 0), (3, 3)])
def test_a_long_log_gives_freed_memory_back(blocks: int, times: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before its topics are counted and behind each of them: convert of 239 MB of DataFlash peaks lower by 20 MB."""
    given = []
    module = sys.modules[survey.__module__]
    monkeypatch.setattr(module, "MANY_RECORDS", 250_000)
    monkeypatch.setattr(module, "give_back", lambda: given.append(1))
    survey(long_log(blocks, 100_000, 2, of_one_time=4))
    assert len(given) == times
