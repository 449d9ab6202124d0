"""The clock model: steps, strays, rows without a time, and nothing invented."""

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.records import Column, LogHeader, RecordBatch
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.integrity import ClockSettings, Survey, corrected, ledger_findings, survey
from groundstation.integrity.clock import ClockModel, estimate_clock

NAN = float("nan")
DAY_IN_2026_NS = iso_to_utc_ns("2026-05-04T06:00:00Z")[0]


def model(times_s: list[float], utc_of_zero_ns: int | None = None, **settings: float) -> tuple[ClockModel, list[float]]:
    """The clock of a log with these device times (NaN: none), and its corrected times in seconds."""
    device = column(times_s)
    index = np.arange(10, 10 + len(times_s), dtype=np.int64)
    clock = estimate_clock(index, device, utc_of_zero_ns, settings=ClockSettings(**settings))  # type: ignore[arg-type]
    return clock, (clock.time_ns(index, device) / NS_PER_S).tolist()


def column(times_s: list[float]) -> Column:
    seconds = np.array(times_s, dtype=np.float64)
    known = np.isfinite(seconds)
    return Column(np.where(known, np.round(seconds * NS_PER_S), 0).astype(np.int64), None if known.all() else known)


def counted(first: float, count: int) -> list[float]:
    return [first + step for step in range(count)]


def test_an_orderly_log_is_left_alone() -> None:
    clock, times = model(counted(5, 20))
    assert times == counted(5, 20) and not clock.steps and clock.period_ns == NS_PER_S and not clock.is_absolute


def test_utc_of_zero_makes_it_absolute() -> None:
    clock, times = model([1, 2, 3], DAY_IN_2026_NS)
    assert clock.is_absolute and times == [DAY_IN_2026_NS / NS_PER_S + second for second in (1, 2, 3)]


@pytest.mark.parametrize("zero", ["1970-01-01T00:00:00Z", "1980-01-06T00:00:00Z"])
def test_a_clock_that_was_never_set_tells_no_date(zero: str) -> None:
    clock, times = model([5, 6, 7], iso_to_utc_ns(zero)[0])
    assert (clock.is_absolute, clock.start, times) == (False, "unset", [5, 6, 7])
    assert clock.document().first_device_time == zero.replace(":00Z", ":05.000Z")
    clock, times = model([5, 6, 7], iso_to_utc_ns("1980-02-01T00:00:00Z")[0])
    assert clock.is_absolute and clock.start == "utc"


def test_each_step_tells_by_how_much_the_clock_was_set() -> None:
    clock, _times = model(counted(100, 10) + counted(50, 10) + counted(200_000, 10))
    assert [step.size_s for step in clock.steps] == [-59.0, 199_941.0]
    assert [step.set_s for step in clock.steps] == [-60.0, 199_940.0]  # a second passes between two records


def test_backward_step_moves_the_earlier_part() -> None:
    clock, times = model(counted(100, 10) + counted(50, 20))
    assert times == counted(40, 30)
    (step,) = clock.steps
    assert (step.record_index, step.kind, step.size_s, step.records_before, step.shift_s) == (
        20,
        "backward",
        -59,
        10,
        -60,
    )


@pytest.mark.parametrize("back", [1, 2, 3, 15])
def test_small_backward_steps_of_a_one_second_log(back: int) -> None:
    clock, times = model(counted(100, 18) + counted(117 - back, 30))
    assert len(clock.steps) == 1 and clock.stray_rows == 0 and np.all(np.diff(times) == 1.0)


def test_two_steps_add_up() -> None:
    clock, times = model(counted(100, 10) + counted(50, 10) + counted(200_000, 10))
    assert [step.kind for step in clock.steps] == ["backward", "forward"]
    assert np.all(np.diff(times) == 1.0) and times[-1] == 200_009.0


def test_a_day_ahead_is_a_step_and_less_is_a_gap() -> None:
    clock, times = model(counted(0, 10) + counted(86_500, 10))
    assert [step.kind for step in clock.steps] == ["forward"] and times[0] == 86_490.0
    clock, times = model(counted(0, 10) + counted(80_000, 10))
    assert not clock.steps and times[-1] == 80_009.0


def test_recorder_that_starts_over_is_moved_above_zero_and_says_so() -> None:
    clock, times = model(counted(1000, 10) + counted(0, 10))
    assert times == counted(0, 20) and clock.shift_ns == 10 * NS_PER_S


def test_negative_times_are_moved_and_utc_is_kept() -> None:
    clock, times = model([-2, -1, 0, 1])
    assert times == [0, 1, 2, 3] and clock.shift_ns == 2 * NS_PER_S
    clock, times = model([-2, -1, 0, 1], DAY_IN_2026_NS)
    assert clock.shift_ns == 0 and times[0] == DAY_IN_2026_NS / NS_PER_S - 2


def test_a_displaced_row_is_stray_and_its_time_is_believed() -> None:
    clock, times = model([0, 1, 2, 4, 5, 3, 6, 7, 8])
    assert times[5] == 3.0 and clock.stray_rows == 1 and not clock.steps and clock.implausible_times == 0


def test_a_swap_is_stray() -> None:
    clock, times = model([*counted(0, 10), 11, 10, *counted(12, 10)])
    assert clock.stray_rows == 1 and not clock.steps and sorted(times) == counted(0, 22)


@pytest.mark.parametrize("wrong", [-1e6, 3.0, 500.0, 9e7, 4e9])
def test_a_wrong_time_is_not_believed(wrong: float) -> None:
    times_in = counted(0, 30)
    times_in[12] = wrong
    clock, times = model(times_in)
    assert times == counted(0, 30) and not clock.steps
    assert (clock.implausible_times, clock.stray_rows) == (1, 0)


def test_a_late_row_at_the_end_is_stray() -> None:
    clock, times = model([*counted(0, 10), 4.5])
    assert clock.stray_rows == 1 and not clock.steps and times[-1] == 4.5


def test_rows_without_time_before_between_and_after() -> None:
    clock, times = model([NAN, NAN, 10, 11, NAN, 13, 14, 15, NAN])
    assert times == counted(8, 9) and clock.missing_times == 4


def test_rows_without_time_before_zero_move_the_log() -> None:
    clock, times = model([NAN, NAN, 0, 1, 2])
    assert times == counted(0, 5) and clock.shift_ns == 2 * NS_PER_S


def test_rows_without_time_across_a_step() -> None:
    clock, times = model([*counted(100, 10), NAN, *counted(51, 10)])
    assert times == counted(40, 21) and len(clock.steps) == 1


def test_one_timed_row_and_none() -> None:
    clock, times = model([7])
    assert times == [7] and clock.period_ns == 0 and clock.has_times
    assert model([NAN, 7, NAN])[1] == [7, 7, 7]
    clock, _times = model([NAN, NAN])
    assert not clock.has_times and clock.missing_times == 2


def test_repeated_seconds_are_no_steps() -> None:
    clock, times = model([0, 1, 1, 3, 4, 4, 6, 7, 8])
    assert times == [0, 1, 1, 3, 4, 4, 6, 7, 8] and clock.stray_rows == 0 and not clock.steps


def test_nanoseconds_of_absolute_times_survive() -> None:
    zero_ns = 1_777_874_400_000_000_001
    device = Column(np.array([5, 0, 25], dtype=np.int64), np.array([True, False, True]))
    clock = estimate_clock(np.arange(3), device, zero_ns)
    assert clock.time_ns(np.arange(3), device).tolist() == [zero_ns + 5, zero_ns + 15, zero_ns + 25]


@pytest.mark.parametrize("start", ["2240-01-01T00:00:00Z", "1970-01-02T00:00:00Z"])
def test_times_beyond_64_bits_are_no_absolute_time(start: str) -> None:
    century_s = 100 * 365.25 * 86_400
    utc_ns = iso_to_utc_ns(start)[0]
    clock, corrected = model([0.0, 1.0, 2.0, century_s, century_s + 1.0, century_s + 2.0], utc_ns, forward_step_s=1e10)
    assert clock.is_absolute == start.startswith("1970")
    assert corrected == sorted(corrected) and corrected[-1] - corrected[0] == century_s + 2.0


def test_rows_without_time_are_placed_within_64_bits() -> None:
    clock, corrected = model([0.0, 1e9, 2e9] + [NAN] * 50)
    assert clock.missing_times == 50 and corrected == sorted(corrected) and corrected[-1] < 2**62 / 1e9 + 1.0


def test_steps_that_add_up_beyond_64_bits_are_none() -> None:
    ramp = [day * 86_000.0 for day in range(40_000)]  # a century in steps of less than a day, four times over
    clock, corrected = model(ramp * 4)
    assert clock.is_unordered and not clock.steps and corrected[: len(ramp)] == ramp


def test_absolute_time_before_1970_is_no_absolute_time() -> None:
    clock, times = model([1, 2, 3], -100 * NS_PER_S)
    assert not clock.is_absolute and times == [1, 2, 3]


@pytest.mark.parametrize("seed", range(30))
def test_whatever_comes_order_comes_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(
        rng.choice([0, 1, 1, 1, 50, -20, 200_000, -300_000], size=200, p=[0.05, *[0.28] * 3, *[0.0275] * 4])
    )
    times = np.where(rng.random(200) < 0.05, NAN, times)
    found = surveyed(times.tolist(), rng)
    for utc in (None, 10**18):
        items = [LogHeader("test", {}, utc), *found]
        result = survey(items)
        out: dict[str, list[int]] = {}
        for batch in corrected(items, result.clock):
            assert batch.time_ns is not None
            out.setdefault(batch.topic, []).extend(batch.time_ns.tolist())
        assert sum(map(len, out.values())) == sum(map(len, found))
        assert all(np.all(np.diff(ns) >= 0) and ns[0] >= 0 for ns in out.values())


def surveyed(times_s: list[float], rng: np.random.Generator) -> list[RecordBatch]:
    """Two topics of these records, in small batches."""
    batches = []
    device = column(times_s)
    for start in range(0, len(times_s), 17):
        piece = np.arange(start, min(start + 17, len(times_s)))
        for topic in ("ins", "baro"):
            rows = piece if topic == "ins" else piece[rng.random(len(piece)) < 0.5]
            if len(rows):
                values: NDArray[np.float64] = rows.astype(np.float64)
                batches.append(RecordBatch(topic, rows, device.take(rows), {"x": Column(values)}))
    return batches


def found_for(times_s: list[float]) -> Survey:
    return survey([LogHeader("t"), *surveyed(times_s, np.random.default_rng(0))])


@pytest.mark.parametrize(
    ("times_s", "code", "severity"),
    [
        (counted(100, 10) + counted(50, 20), "clock.backward_step", "warn"),
        (counted(0, 10) + counted(200_000, 20), "clock.forward_step", "warn"),
        ([NAN, *counted(0, 500)], "clock.missing_times", "info"),
        ([NAN, *counted(0, 10)], "clock.missing_times", "warn"),
        ([*counted(0, 10), 900, *counted(11, 9)], "clock.implausible_times", "warn"),
        ([*counted(0, 10), 11, 10, *counted(12, 10)], "time.stray_rows", "warn"),
        (counted(0, 50)[::-1], "time.unordered", "warn"),
        (counted(-5, 20), "clock.shifted", "info"),
        (counted(0, 20), "clock.no_utc", "info"),
        ([NAN, NAN], "clock.no_times", "fail"),
        ([], "data.none", "fail"),
        ([0, 1, 1, 2, 3], "time.duplicates", "info"),
        ([0, 1, 2, 30, 31], "data.silent", "warn"),
    ],
)
def test_each_oddity_is_one_line(times_s: list[float], code: str, severity: str) -> None:
    found = [finding for finding in ledger_findings(found_for(times_s).ledger) if finding.code == code]
    assert found and found[0].severity == severity and "\n" not in found[0].text


@pytest.mark.parametrize(("end", "told"), [(100, 0), (90, 0), (89, 11), (40, 60)])
def test_a_topic_that_breaks_off_is_told_with_what_is_missing(end: int, told: int) -> None:
    """Ten seconds, and a twentieth of the log, are allowed; 60 records are missing of one that stops at 40 of 100 s."""
    rows = np.arange(101)
    batches = [surveyed_topic("ins", rows), surveyed_topic("gnss", rows[: end + 1]), surveyed_topic("raw.x", rows[:20])]
    batches.append(surveyed_topic("link.B", rows[:20]))  # another aircraft gets out of reach
    ledger = survey([LogHeader("t"), *batches]).ledger
    found = [finding for finding in ledger_findings(ledger) if finding.code == "data.breaks_off"]
    assert [(one.topic, one.count) for one in found if one.severity == "warn"] == ([("gnss", told)] if told else [])
    assert [(one.topic, one.count) for one in found if one.severity == "info"] == [("link.B", 81), ("raw.x", 81)]
    assert ledger.loses_data is bool(told)  # exit code 3


def surveyed_topic(topic: str, rows: "NDArray[np.int64]") -> RecordBatch:
    values: NDArray[np.float64] = rows.astype(np.float64)
    device_time_ns = Column(rows * NS_PER_S)
    return RecordBatch(topic, rows, device_time_ns, {"x": Column(values)})
