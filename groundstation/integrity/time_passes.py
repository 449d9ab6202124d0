"""Compiled passes over the times of many records.

Each does at once what numpy takes several passes for. They pay where there are many records: machine code takes one to
two milliseconds to load in each process, and a call five times one of numpy. Shorter arrays, and those with gaps, go
the ways beside them. Over single columns numpy is faster: its passes take eight values at a time.
"""

from typing import Any

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.records import Int64Array

MANY = 16_384  # records of several sources from which a compiled pass pays
MANY_IN_ALL = 131_072  # of a window: it pays there later, as numpy takes fewer passes
MANY_LAID = 4_096  # of a piece of such a window
MOST_SOURCES = 32  # told apart by a compiled pass
TABLE_STEPS = 1 << 16  # steps of whole units that are counted in a table
UNIT_NS = 1_000

# Places in the state array of ``follow``.
LATEST, EARLIEST, LATENESS, LONGEST, REST, STATE_SIZE = 0, 1, 2, 3, 4, 5


def passes_over(*arrays: Any, least: int | None = None) -> bool:
    """Tell whether a compiled pass takes arrays of one length: many records, without gaps.

    ``least`` is how many; ``MANY`` without it.
    """
    return len(arrays[0]) >= (MANY if least is None else least) and all(one.flags.c_contiguous for one in arrays)


@in_place
def count_back(time: Any, sources: Any, known: Any, last: Any, count: int) -> int:
    """Count the steps back in the times of each source.

    Parameters
    ----------
    time, sources : ndarray of int64, shape (n,)
    known, last : ndarray of int64, shape (k,), out
        Sources met so far, and their last times; the first ``count`` are those of before. The last entry of ``last``
        becomes the number of sources.

    Returns
    -------
    int
        Number of steps back; -1 where there are more sources than places for them.
    """
    back = 0
    for row in range(len(time)):
        source, now = sources[row], time[row]
        at = 0
        while at < count and known[at] != source:
            at += 1
        if at == count:
            if count == len(known) - 1:
                return -1
            known[at] = source
            count += 1
        elif now < last[at]:
            back += 1
        last[at] = now
    last[len(last) - 1] = count
    return back


@in_place
def lay(index: Any, values: Any, start: int, seen: Any, timed: Any, time: Any) -> None:
    """Lay times at their places, counted from ``start``; mark these as seen and timed."""
    for row in range(len(index)):
        at = index[row] - start
        seen[at] = timed[at] = True
        time[at] = values[row]


@in_place
def follow(
    time: Any, starts: Any, is_ahead: Any, tolerance: int, ends: int, kept: Any, table: Any, rest: Any, state: Any
) -> None:
    """Follow the times of a counting clock.

    Parameters
    ----------
    time : ndarray of int64, shape (n,)
    starts : ndarray of int64, shape (r,)
        First rows of the runs.
    is_ahead : ndarray of bool, shape (r,)
        Runs whose times make no other late.
    tolerance : int
    ends : int
        Records that are kept of the beginning of each run, and of the end of all.
    kept : ndarray of bool, shape (n,), out
        These, late records, and those at which time enters or leaves a stretch of half the tolerance.
    table : ndarray of int64, shape (TABLE_STEPS,), out
        Steps ahead are added to it by their number of units.
    rest : ndarray of int64, shape (n,), out
        Other steps ahead.
    state : ndarray of int64, shape (STATE_SIZE,), out
        Latest and earliest time, largest lateness and longest step so far; the number of the ``rest``.
    """
    count = len(time)
    latest, earliest, lateness, longest = state[LATEST], state[EARLIEST], state[LATENESS], state[LONGEST]
    half, others = tolerance // 2, 0
    before = time[0]
    low = before // half * half
    for run in range(len(starts)):
        first = starts[run]
        behind = starts[run + 1] if run + 1 < len(starts) else count
        is_believed = not is_ahead[run]
        for row in range(first, behind):
            now = time[row]
            if is_believed:
                latest = max(latest, now)
            earliest = min(earliest, now)
            late = latest - now
            lateness = max(lateness, late)
            kept[row] = late > tolerance or row < first + ends or row >= count - ends
            step = now - before
            if step > 0:
                longest = max(longest, step)
                units = step // UNIT_NS
                if units < TABLE_STEPS and units * UNIT_NS == step:
                    table[units] += 1
                else:
                    rest[others] = step
                    others += 1
            if now < low or now >= low + half:
                low = now // half * half
                kept[row] = True
                if row > 0:
                    kept[row - 1] = True
            before = now
    state[LATEST], state[EARLIEST], state[LATENESS], state[LONGEST] = latest, earliest, lateness, longest
    state[REST] = others


def starts_of_runs(time: Int64Array, tolerance: int) -> Int64Array:
    """Return the first rows of runs, in which no step is longer than the tolerance.

    Examples
    --------
    >>> starts_of_runs(np.array([1, 2, 9, 8, 1]), 3).tolist()
    [0, 2, 4]
    """
    steps = np.diff(time)
    if steps.max(initial=0) <= tolerance and steps.min(initial=0) >= -tolerance:
        return np.zeros(1, dtype=np.int64)
    return np.concatenate(([0], np.flatnonzero(np.abs(steps) > tolerance) + 1))


def new_state() -> Int64Array:
    """State of :func:`follow` before the first record."""
    state = np.zeros(STATE_SIZE, dtype=np.int64)
    state[LATEST], state[EARLIEST] = np.iinfo(np.int64).min // 2, np.iinfo(np.int64).max
    return state
