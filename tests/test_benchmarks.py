"""Records of benchmarks: intervals, goals, what is missing, and the page that is written from them."""

import doctest
import json
import time
from pathlib import Path

import pytest

from benchmarks import record, table, trend
from benchmarks.__main__ import LONG, parts
from benchmarks.record import Book, Goal, Interval, Record, Times, by_turns, interval, order_statistics
from groundstation.base.halves import both


def times(*seconds: float) -> Times:
    return Times(seconds, tuple(2.0 * one for one in seconds))


def test_interval_of_seven_rounds_is_their_range_and_of_nine_is_not() -> None:
    assert interval([7.0, 1.0, 5.0, 3.0, 2.0, 6.0, 4.0]) == Interval(4.0, 1.0, 7.0)
    assert interval([float(one) for one in range(1, 10)]) == Interval(5.0, 2.0, 8.0)
    assert [order_statistics(one) for one in (1, 2, 12, 17)] == [0, 0, 2, 4]  # tables of David and Nagaraja


def test_examples_in_the_records() -> None:
    found = doctest.testmod(record)
    assert found.attempted and not found.failed


def test_a_goal_is_met_by_the_less_favourable_end() -> None:
    assert Goal(2.0).is_met_by(Interval(1.0, 0.5, 2.0)) and not Goal(2.0).is_met_by(Interval(1.0, 0.5, 2.1))
    faster = Goal(5.0, "at least")
    assert faster.is_met_by(Interval(9.0, 5.0, 11.0)) and not faster.is_met_by(Interval(9.0, 4.9, 11.0))


def test_ratio_is_that_of_rounds_and_times_as_fast_turns_it(tmp_path: Path) -> None:
    book = Book("part", tmp_path)
    ours, peer = times(1.0, 2.0, 4.0), times(4.0, 4.0, 4.0)
    share = book.against("a", ours, peer, "numpy", goal=Goal(0.9))
    faster = book.against("b", ours, peer, "numpy", goal=Goal(1.0, "at least"), is_times=True, by_clock=True)
    assert (share.ratio, share.ratio_low, share.ratio_high, share.met) == (0.5, 0.25, 1.0, False)
    assert (faster.ratio, faster.ratio_low, faster.ratio_high, faster.met) == (2.0, 1.0, 4.0, True)
    assert (share.ours, share.peer, faster.ours, faster.peer) == (2.0, 4.0, 4.0, 8.0)
    assert share.peer_version and share.machine is not None and share.date.endswith("UTC")


def test_works_take_turns_after_one_that_warms_them_up() -> None:
    seen: list[str] = []
    found = by_turns({"a": lambda: seen.append("a"), "b": lambda: seen.append("b")}, 2, {"b": 2})
    assert "".join(seen) == "ab" + "abb" * 2
    assert all(len(one.processor_s) == len(one.clock_s) == 2 for one in found.values())


def test_a_peer_that_is_not_installed_is_not_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Book("part", tmp_path) as book:
        assert not book.has("no-such-package")
    (found,) = record.read(tmp_path / "part.json")
    assert found == book.records[0] and found.met is None and found.ratio is None
    assert "not measured: no-such-package is not installed" in capsys.readouterr().out


def test_a_part_measured_again_replaces_its_records_alone() -> None:
    old = [Record("b", "one", "c"), Record("a", "one", "c"), Record("b", "two", "c")]
    new = [Record("b", "three", "c")]
    assert [(one.part, one.what) for one in table.merged(old, new)] == [("a", "one"), ("b", "three")]


def test_trend_compares_ratios_everywhere_and_seconds_on_one_machine(tmp_path: Path) -> None:
    runs = []
    for commit, machine, ratio, seconds in (("a1", "A", 2.0, 1.0), ("b2", "B", 3.0, 5.0), ("c3", "B", 3.3, 4.0)):
        figures = {"tables, times pyulog": ratio, "run, s": seconds}
        runs.append({"part": "ulog", "commit": commit, "machine": machine, "figures": figures})
    assert trend.told(runs) == [
        "ulog: tables, times pyulog: a1 2  b2 3  c3 3.3; +10 %",
        "ulog: run, s (A): a1 1",
        "ulog: run, s (B): b2 5  c3 4; -20 %",
    ]
    lines = trend.lines_of([Record("ulog", "tables", "c", ratio=2.0, is_times=True, peer_name="pyulog")])
    assert json.loads(lines[0])["figures"] == {"tables, times pyulog": 2.0}


def test_the_page_is_what_the_records_give() -> None:
    page = table.PAGE.read_text(encoding="utf-8")
    assert table.page_with(page, record.read(table.KEPT)) == page, "python -m benchmarks.table"
    assert {one.part for one in record.read(table.KEPT)} <= set(parts())


def test_every_part_stands_on_the_page_and_long_ones_exist() -> None:
    text = table.PAGE.read_text(encoding="utf-8").partition("## What limits")[0]
    listed = {
        name.strip() for line in text.splitlines() if line.startswith("| ") for name in line.split("|")[1].split(",")
    }
    assert listed - {"part"} == set(parts()) and set(LONG) <= set(parts())


def test_loops_that_run_at_once_count_their_own_time_alone() -> None:
    """The limit of a flight counted the time of both threads twice: it was 0.24 s where loops and Parquet took 0.14."""
    from benchmarks.bench_fleet import measured

    def spin() -> None:
        end = time.thread_time() + 0.2
        while time.thread_time() < end:
            pass

    loop = measured(spin)
    both(loop, loop)
    assert sum(loop.seconds) == pytest.approx(0.4, abs=0.05)
