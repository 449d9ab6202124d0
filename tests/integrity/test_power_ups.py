"""Power-ups in one source, and counters that wrap: where one ends, what is none, and the clock of each."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from groundstation.base.records import Column, Int64Array, Item, LogHeader, NewLog, RecordBatch, UtcReadings
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.integrity import Survey, corrected, ledger_findings, survey
from groundstation.integrity.power_ups import Evidence, _wrap_of, power_ups

DAY_IN_2026_NS = iso_to_utc_ns("2026-05-04T06:00:00Z")[0]
MS = NS_PER_S // 1000


def seconds(first: float, count: int, step: float = 1.0) -> list[float]:
    return [first + step * number for number in range(count)]


def firsts(times_s: list[float], evidence: Evidence | None = None) -> list[int]:
    """First records of the power-ups among records with these times."""
    time = np.rint(np.array(times_s) * NS_PER_S).astype(np.int64)
    return [one.first for one in power_ups([(np.arange(len(time)), time)], evidence or Evidence())]


@pytest.mark.parametrize(
    ("times_s", "expected"),
    [
        (seconds(0, 300), [0]),
        (seconds(0, 60) + seconds(0, 60), [0, 60]),
        (seconds(0, 60) + seconds(0, 90) + seconds(0, 30), [0, 60, 150]),
        (seconds(1000, 60) + seconds(0, 60), [0, 60]),  # the tail of one power-up, then a whole one
        (seconds(60, 1200) + seconds(300, 1200), [0, 1200]),  # logging began later after power-up
        (seconds(100, 30) + seconds(87, 60), [0]),  # a clock that was set back by 43 s
        (seconds(0, 15) + seconds(0, 60), [0]),  # too short to be one
        (seconds(0, 60) + seconds(50, 9) + seconds(60, 60), [0]),  # late records
        (seconds(0, 100) + seconds(60, 30) + seconds(100, 100), [0]),  # a stretch out of its place
        (seconds(0, 100) + seconds(400, 100) + seconds(1000, 50), [0]),  # gaps
    ],
)
def test_a_counter_that_starts_again_is_another_power_up(times_s: list[float], expected: list[int]) -> None:
    assert firsts(times_s) == expected


@given(st.lists(st.integers(30, 400), min_size=1, max_size=6), st.floats(0.0, 4.0), st.integers(0, 2**32))
@settings(max_examples=60, deadline=None)
def test_as_many_power_ups_as_there_are(lengths: list[int], boot_s: float, seed: int) -> None:
    """Whatever their lengths, with records up to 2 s late; none ends where a counter of 2^n wraps."""
    rng = np.random.default_rng(seed)
    tops = [boot_s + length for length in lengths]
    assume(all(_wrap_of(round((top + at) * 1e9), round(boot_s * 1e9)) is None for top in tops for at in (-2.2, 0.0)))
    times_s: list[float] = []
    expected = []
    for length in lengths:
        expected.append(len(times_s))
        own = boot_s + np.arange(0.0, length, 0.2)
        late = np.maximum(own - np.where(rng.random(len(own)) < 0.1, rng.uniform(0.0, 2.0, len(own)), 0.0), boot_s)
        times_s += late.tolist()
    found = firsts(times_s)
    assert len(found) == len(expected) and all(
        abs(one - other) <= 1 for one, other in zip(found, expected, strict=True)
    )


@given(st.integers(0, 2**32))
@settings(max_examples=30, deadline=None)
def test_shuffled_records_are_no_power_ups(seed: int) -> None:
    assert firsts(np.random.default_rng(seed).permutation(500).astype(float).tolist()) == [0]


@pytest.mark.parametrize("step_s", [-3.0, -15.0, -59.0, -900.0, 3600.0, -1024 * 604_800.0])
def test_a_clock_that_tells_utc_and_is_set_is_no_other_power_up(step_s: float) -> None:
    """By seconds when GNSS time comes, by whole quarters of an hour, by a GPS week."""
    times_s = seconds(1.7e9, 900) + seconds(1.7e9 + 899 + step_s, 900)
    assert firsts(times_s, Evidence(is_utc=True)) == [0]


@pytest.mark.parametrize("step_s", [-1234.0, -86_000.0, 5_000.0, 90_011.0])
def test_a_clock_that_tells_utc_of_another_time_is_another_power_up(step_s: float) -> None:
    times_s = seconds(1.7e9, 900) + seconds(1.7e9 + 899 + step_s, 900)
    assert firsts(times_s, Evidence(is_utc=True)) == [0, 900]


def test_where_another_log_begins_less_is_enough() -> None:
    marked = Evidence(new_logs=[60])
    assert firsts(seconds(10, 60) + seconds(52, 60), marked) == [0, 60]
    assert firsts(seconds(10, 60) + seconds(70, 60), marked) == [0]  # it goes on
    assert firsts(seconds(10, 60) + seconds(100, 60), marked) == [0, 60]
    utc = Evidence(is_utc=True, new_logs=[60])
    assert firsts(seconds(1e9, 60) + seconds(1e9 + 45, 60), utc) == [0]  # set by 15 s, as a header was written
    assert firsts(seconds(1e9, 60) + seconds(1e9 + 300, 60), utc) == [0, 60]


MODULI_S = [2**32 * 1e-3, 2**32 * 1e-6, 2**24 * 1e-3, 2**48 * 1e-7, 86_400.0, 604_800.0]


@pytest.mark.parametrize("modulus_s", MODULI_S)
def test_a_counter_that_wraps_goes_on(modulus_s: float) -> None:
    times_s = [(modulus_s - 30.03 + one) % modulus_s for one in seconds(0, 600, 0.1)]
    (found,) = power_ups([(np.arange(600), nanoseconds(times_s))], Evidence())
    (wrap,) = found.wraps
    assert wrap.modulus_ns == round(modulus_s * NS_PER_S) and wrap.record_index == 301
    steps = np.diff(found.unwrapped_ns(np.arange(600), nanoseconds(times_s)))
    assert np.abs(steps - NS_PER_S // 10).max() <= 200


def nanoseconds(times_s: list[float]) -> Int64Array:
    return np.rint(np.array(times_s) * NS_PER_S).astype(np.int64)


@pytest.mark.parametrize("before_s", [6.0, 60.0])
def test_a_counter_that_starts_again_before_its_end_does_not_wrap(before_s: float) -> None:
    modulus_s = MODULI_S[0]
    times_s = seconds(modulus_s - 300, int(300 - before_s)) + seconds(0, 300)
    found = power_ups([(np.arange(len(times_s)), nanoseconds(times_s))], Evidence())
    assert [len(one.wraps) for one in found] == [0, 0]


def test_a_start_again_near_the_end_is_told_by_another_clock() -> None:
    """The counter of 32 bits and 1 µs ends after 4295 s; a minute passed by the time of GNSS."""
    times_s = seconds(3995.2, 300) + seconds(0.1, 300)
    zeros = {0: 10**18, 300: 10**18 + round(4295.2 * NS_PER_S) + 60 * NS_PER_S}
    told = Evidence(zero_ns=lambda first, _end: zeros.get(first))
    assert [len(one.wraps) for one in power_ups([(np.arange(600), nanoseconds(times_s))], Evidence())] == [1]
    assert [len(one.wraps) for one in power_ups([(np.arange(600), nanoseconds(times_s))], told)] == [0, 0]


def test_a_wrap_and_a_start_again_together() -> None:
    modulus_s = MODULI_S[0]
    times_s = [(modulus_s - 100.5 + one) % modulus_s for one in seconds(0, 300)] + seconds(0.2, 200)
    found = power_ups([(np.arange(len(times_s)), nanoseconds(times_s))], Evidence())
    assert [(one.first, len(one.wraps)) for one in found] == [(0, 1), (300, 0)]


def test_a_gps_week_of_ten_bits_wraps() -> None:
    before, after = (iso_to_utc_ns(text)[0] for text in ("2019-04-06T23:54:42Z", "1999-08-21T23:59:47Z"))
    time = np.concatenate([before + np.arange(300) * NS_PER_S, after + np.arange(300) * NS_PER_S])
    (found,) = power_ups([(np.arange(600), time)], Evidence(is_utc=True))
    unwrapped = found.unwrapped_ns(np.arange(600), time)
    assert len(found.wraps) == 1 and (np.diff(unwrapped) == NS_PER_S).all()


def test_records_that_stand_mixed_at_a_wrap_keep_their_times() -> None:
    """Two buffers, one of them written 0.6 s late: around the wrap the counter jumps to and fro."""
    modulus_ns, steps = 2**32 * MS, np.arange(0, 120 * NS_PER_S, 100 * MS)
    true = np.sort(np.concatenate([steps, steps + 50 * MS]))
    is_late = np.isin(true, steps + 50 * MS)
    order = np.argsort(true + np.where(is_late, 600 * MS, 0), kind="stable")
    device = (modulus_ns - 60 * NS_PER_S + true[order]) % modulus_ns
    batches = [
        RecordBatch(topic, np.flatnonzero(rows), Column(device[rows]), {"x": Column(np.ones(int(rows.sum())))})
        for topic, rows in (("raw.a", ~is_late[order]), ("raw.b", is_late[order]))
    ]
    items: list[Item] = [LogHeader("test", has_counting_clock=True), *batches]
    found = survey(items)
    assert len(found.clock.wraps) == 1 and not found.power_ups
    for batch in corrected(items, found.clock):
        assert batch.time_ns is not None and (np.diff(batch.time_ns) == 100 * MS).all()
    assert [one.code for one in ledger_findings(found.ledger)].count("clock.wrapped") == 1


def log(*parts: list[float], header: LogHeader, marks: tuple[NewLog, ...] = ()) -> list[Item]:
    """A log of two topics with the times of parts behind one another."""
    time = nanoseconds([one for part in parts for one in part])
    index = np.arange(len(time))
    return [
        header,
        RecordBatch("raw.a", index, Column(time), {"x": Column(index.astype(float))}),
        RecordBatch("raw.b", index, Column(time), {"y": Column(index.astype(float))}),
        *marks,
    ]


def spans(found: Survey) -> list[tuple[float, float, bool]]:
    """Power-ups in seconds since 6 o'clock, and whether they have UTC."""
    ends = [(one.start_ns - DAY_IN_2026_NS, one.end_ns - DAY_IN_2026_NS, one.is_absolute) for one in found.power_ups]
    return [(start / NS_PER_S, end / NS_PER_S, has_utc) for start, end, has_utc in ends]


@pytest.mark.parametrize("is_counting", [True, False])
def test_each_has_a_utc_of_its_own(is_counting: bool) -> None:
    zeros = np.repeat([DAY_IN_2026_NS, DAY_IN_2026_NS + 700 * NS_PER_S], 3)
    readings = UtcReadings(np.array([10, 20, 30, 70, 80, 90]), zeros)
    header = LogHeader("test", {}, DAY_IN_2026_NS, is_counting, utc_readings=readings)
    found = survey(log(seconds(0, 60), seconds(0, 60), header=header))
    expected = [(0.0, 59.0, True), (700.0, 759.0, True)] if is_counting else spans(found)
    assert spans(found) == expected and len(expected) == 2 and found.clock.is_absolute


def test_without_utc_they_stand_behind_one_another() -> None:
    found = survey(log(seconds(0, 60), seconds(0, 40), header=LogHeader("test")))
    assert not found.clock.is_absolute
    assert [(one.start_ns // NS_PER_S, one.end_ns // NS_PER_S) for one in found.power_ups] == [(0, 59), (60, 99)]


def test_a_start_again_without_utc_does_not_take_that_of_the_first() -> None:
    found = survey(log(seconds(0, 60), seconds(0, 40), header=LogHeader("test", {}, DAY_IN_2026_NS)))
    assert spans(found) == [(0.0, 59.0, True), (60.0, 99.0, False)]


def test_a_log_that_begins_in_the_source_says_what_it_is() -> None:
    mark = NewLog(60, {"aircraft": "B"}, DAY_IN_2026_NS + 100 * NS_PER_S)
    found = survey(log(seconds(0, 60), seconds(0, 40), header=LogHeader("test", {}, DAY_IN_2026_NS), marks=(mark,)))
    assert spans(found) == [(0.0, 59.0, True), (100.0, 139.0, True)]
    assert found.power_ups[1].metadata == {"aircraft": "B"}
    (told,) = [one for one in ledger_findings(found.ledger) if one.code == "log.power_ups"]
    assert told.severity == "warn" and told.count == 2 and "06:01:40.000Z to 2026-05-04T06:02:19.000Z" in told.text


def test_topic_behind_topic_is_one_power_up() -> None:
    """A log that was put in order of its topics: the time starts again with each of them."""
    time, index = nanoseconds(seconds(0, 100)), np.arange(100)
    batches = [
        RecordBatch(f"raw.t{at}", index + 100 * at, Column(time), {"x": Column(np.ones(100))}) for at in range(5)
    ]
    found = survey([LogHeader("test", has_counting_clock=True), *batches])
    assert not found.power_ups and found.clock.is_unordered


def test_a_long_log_is_split_as_a_short_one(monkeypatch: pytest.MonkeyPatch) -> None:
    header = LogHeader("test", {}, None, has_counting_clock=True)
    items = log(seconds(0, 400, 0.1), seconds(0, 400, 0.1), header=header)
    whole = survey(items)
    monkeypatch.setattr("groundstation.integrity.places.WINDOW_RECORDS", 100)
    windows = survey([items[0], *(part for item in items[1:] for part in pieces(item, 64))])
    assert [one.records for one in windows.power_ups] == [one.records for one in whole.power_ups]
    assert len(whole.power_ups) == 2


def pieces(item: Item, rows: int) -> list[Item]:
    assert isinstance(item, RecordBatch)
    return [item.take(slice(start, start + rows)) for start in range(0, len(item), rows)]
