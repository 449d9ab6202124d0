"""The clock that counts from power-up: what it believes, and that order between topics proves nothing."""

import numpy as np
import pytest

from groundstation.base.records import Column, LogHeader, RecordBatch
from groundstation.base.units import NS_PER_S
from groundstation.integrity import survey
from groundstation.integrity.counting import estimate_counting_clock


def clock_of(seconds: list[float], absent: tuple[int, ...] = (), utc_ns: int | None = None):
    time = np.rint(np.array(seconds) * NS_PER_S).astype(np.int64)
    present = np.ones(len(time), dtype=bool)
    present[list(absent)] = False
    index = np.arange(len(time)) * 3 + 5
    column = Column(time, present)
    clock = estimate_counting_clock(index, column, np.zeros(len(time), dtype=bool), utc_ns)
    return clock, (clock.time_ns(index, column) / NS_PER_S).tolist()


RUN = [100.0 + k / 10 for k in range(60)]


def test_late_records_keep_their_times() -> None:
    seconds = [*RUN, 104.0, 106.0, 105.2, *[106.1 + k / 10 for k in range(60)]]
    clock, times = clock_of(seconds)
    assert times == pytest.approx(seconds) and not clock.steps and not clock.stray_rows and not clock.stale_times


def test_old_and_impossible_times_are_placed_by_neighbours() -> None:
    clock, times = clock_of([3.0, 70.0, *RUN[:30], 2.5, *RUN[30:], 9e5])
    assert (clock.stale_times, clock.implausible_times) == (3, 1)
    assert times[0] == times[1] == 100.0 and 102.9 <= times[32] <= 103.0 and times[-1] == RUN[-1]


def test_a_real_gap_stays() -> None:
    seconds = [*RUN, *[400.0 + k / 10 for k in range(60)], 700.0, 701.0, *[900.0 + k / 10 for k in range(60)]]
    clock, times = clock_of(seconds)
    assert times == pytest.approx(seconds) and clock.stale_times == 0


def test_topic_after_topic_is_unordered() -> None:
    clock, times = clock_of([*RUN, *RUN, *RUN])
    assert clock.is_unordered and times == pytest.approx([*RUN] * 3)


def test_missing_times_and_utc() -> None:
    clock, times = clock_of([*RUN, 0.0, *[106.0 + k for k in range(60)]], absent=(60,), utc_ns=10**18)
    assert clock.is_absolute and clock.missing_times == 1 and 105.9 <= times[60] - 1e9 <= 106.0
    nothing, _ = clock_of([1.0, 2.0], absent=(0, 1))
    assert not nothing.has_times and nothing.missing_times == 2
    one, times = clock_of([7.0])
    assert times == [7.0] and one.has_times


@pytest.mark.parametrize("share", [0.01, 0.1])
def test_corrupt_times_do_not_stretch_the_log(share: float) -> None:
    rng = np.random.default_rng(2)
    time = np.sort(rng.uniform(1_000.0, 1_600.0, 20_000))
    flipped = rng.random(len(time)) < share / 10
    time[flipped] = rng.uniform(0.0, 1e7, int(flipped.sum()))
    _, times = clock_of(time.tolist())
    assert min(times) > 990.0 and max(times) < 1_610.0


def test_a_topic_that_never_advances_is_placed_where_it_stands() -> None:
    index = np.arange(200)
    time = np.where(index % 2 == 0, 100 + index / 10, 4.0) * NS_PER_S
    batches = [
        RecordBatch(name, index[rows], Column(time[rows].astype(np.int64)), {"x": Column(np.ones(100))})
        for name, rows in (("raw.a", index % 2 == 0), ("raw.frozen", index % 2 == 1))
    ]
    found = survey([LogHeader("test", has_counting_clock=True), *batches])
    assert found.clock.stale_times == 100 and found.ledger["raw.frozen"].first_ns >= 100 * NS_PER_S
