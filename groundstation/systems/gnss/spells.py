"""Spells of the states of a receiver, shares of its time in them, and losses of the fix."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.gnss.answer import (
    NOT_LOGGED,
    STATE_NAMES,
    WITHOUT_FIX,
    WITHOUT_RECORD,
    FixLoss,
    FixState,
)
from groundstation.systems.gnss.series import ReceiverRows
from groundstation.systems.gnss.settings import GnssSettings

LEAST_CLAIMS = 10  # rows with a claimed sigma that make its median
NO_RECORD, LOG_SILENT = "no_record", "log_silent"
MS = 1e-3  # s: pauses are known to it
MISSES = 1.5  # usual steps of a sensor: in a longer one a row is missing


@dataclass(frozen=True)
class Spells:
    """Spells of one state each, in order of time and without holes between them."""

    start_s: FloatArray
    end_s: FloatArray
    state: NDArray[np.str_]

    @property
    def seconds(self) -> FloatArray:
        """Lengths of the spells."""
        return self.end_s - self.start_s


def spells_of(one: ReceiverRows, others_s: Sequence[FloatArray]) -> Spells:
    """Return the spells of a receiver, gaps among them.

    ``others_s`` are the times of the rows of each other sensor, sorted. A gap is one of the log where all of them miss
    rows in it together, but for as long as a step of the receiver may be. A pause of the log is none of the receiver;
    what it misses before and behind is a gap where it is long enough.
    """
    gap = np.flatnonzero(one.is_gap)
    row, start_s, end_s, is_pause = _parts_of(one, gap)
    silent = np.where(is_pause, NOT_LOGGED, NO_RECORD).astype(one.state.dtype)
    if others_s:
        free = [_free(time_s) for time_s in others_s]
        shared = np.array([_shared_s(start, end, free) for start, end in zip(start_s, end_s, strict=True)])
        silent[(end_s - start_s - shared <= one.gap_s) & ~is_pause] = LOG_SILENT
    # A gap begins when its row has held for its time; behind a pause it begins at once.
    held_s = np.where(start_s == one.time_s[row], one.held_s[row], 0.0)
    state = np.insert(one.state, row + 1, silent)
    start = np.insert(one.time_s, row + 1, start_s + held_s)
    first = np.flatnonzero(np.append(True, state[1:] != state[:-1]))
    end = np.append(start[first[1:]], one.time_s[-1] + one.held_s[-1])
    return Spells(start[first], end, state[first])


def _free(time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the times in which a sensor misses rows, from and to.

    It does before its first row and behind its last.
    """
    steps = np.diff(time_s)
    long = np.flatnonzero(steps > MISSES * float(np.median(steps))) if len(steps) else np.zeros(0, dtype=np.intp)
    start = np.concatenate(([-np.inf], time_s[long], time_s[-1:]))
    return start, np.concatenate((time_s[:1], time_s[long + 1], [np.inf]))


def _shared_s(start_s: float, end_s: float, free: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """Return how long in a gap all other sensors miss rows."""
    spans = [(start_s, end_s)]
    for start, end in free:
        first, behind = int(np.searchsorted(end, start_s, "right")), int(np.searchsorted(start, end_s, "left"))
        mine = list(zip(start[first:behind].tolist(), end[first:behind].tolist(), strict=True))
        cut = [(max(a, c), min(b, d)) for a, b in spans for c, d in mine]
        spans = [(a, b) for a, b in cut if b > a]
    return sum(b - a for a, b in spans)


def _parts_of(
    one: ReceiverRows, gap: NDArray[np.intp]
) -> tuple[NDArray[np.intp], FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return the parts of gaps: row before, from, to, and whether it is a pause of the log.

    Parts beside a pause that are too short for a gap belong to the pause.
    """
    parts: list[tuple[int, float, float, bool]] = []
    before = one.paused_s[:, 0]
    for row in gap.tolist():
        start_s, end_s = float(one.time_s[row]), float(one.time_s[row + 1])
        inside = one.paused_s[(before >= start_s - MS) & (before < end_s)]
        at_s = start_s
        for from_s, to_s in inside.tolist():
            if from_s - at_s > one.gap_s:
                parts.append((row, at_s, from_s, False))
                at_s = from_s
            parts.append((row, at_s, to_s, True))
            at_s = to_s
        if not len(inside) or end_s - at_s > one.gap_s:
            parts.append((row, at_s, end_s, False))
    rows, starts, ends, pauses = zip(*parts, strict=True) if parts else ((), (), (), ())
    return np.array(rows, dtype=np.intp), np.array(starts), np.array(ends), np.array(pauses, dtype=bool)


def logged_s(spells: Spells) -> float:
    """Return the time of all spells but pauses of the log."""
    return float(spells.seconds[spells.state != NOT_LOGGED].sum())


def states_of(one: ReceiverRows, spells: Spells) -> tuple[FixState, ...]:
    """Return the time in each state and the sigma claimed in it, the best state first."""
    claimed_m = one.values("horizontal_sigma_m")
    whole_s = logged_s(spells)
    found = []
    for name in (*STATE_NAMES, *sorted(set(spells.state.tolist()) - STATE_NAMES.keys())):
        mine = spells.seconds[spells.state == name]
        if mine.size:
            seconds = float(mine.sum())
            share = seconds / whole_s if whole_s > 0.0 else float(np.mean(spells.state == name))
            share = 0.0 if name == NOT_LOGGED else share
            sigmas = claimed_m[np.isfinite(claimed_m) & (one.state == name)]
            sigma_m = float(np.median(sigmas)) if len(sigmas) >= LEAST_CLAIMS else None
            found.append(FixState(name, seconds, share, int(mine.size), float(mine.max()), sigma_m))
    return tuple(found)


def losses_of(one: ReceiverRows, spells: Spells, settings: GnssSettings) -> tuple[FixLoss, ...]:
    """Return stretches after the first fix without one, and gaps.

    Single epochs without a fix are none. A gap is from row to row, as the ledger counts it.
    """
    with_fix = np.flatnonzero(one.has_fix)
    if not with_fix.size:
        return ()
    losses = []
    for kinds in (WITHOUT_FIX, WITHOUT_RECORD):
        without = np.isin(spells.state, kinds)
        edges = np.diff(np.concatenate([[0], without.astype(np.int8), [0]]))
        for first, behind in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
            start_s, end_s = float(spells.start_s[first]), float(spells.end_s[behind - 1])
            if kinds is WITHOUT_RECORD:
                row = max(int(np.searchsorted(one.time_s, start_s + MS)) - 1, 0)
                start_s = float(one.time_s[row]) if start_s <= one.time_s[row] + one.held_s[row] + MS else start_s
            elif end_s - start_s <= settings.loss_min_s:
                continue
            if end_s <= one.time_s[with_fix[0]]:
                continue
            longest = first + int(np.argmax(spells.seconds[first:behind]))
            before, after = _around(one, with_fix, start_s, end_s)
            losses.append(_loss(one, str(spells.state[longest]), start_s, end_s, before, after))
    return tuple(sorted(losses, key=lambda loss: loss.start_s))


def seconds_after_first_fix(one: ReceiverRows, spells: Spells, kinds: tuple[str, ...]) -> float:
    """Return the time in some states after the first fix."""
    with_fix = np.flatnonzero(one.has_fix)
    if not with_fix.size:
        return 0.0
    mine = np.isin(spells.state, kinds) & (spells.start_s > one.time_s[with_fix[0]])
    return float(spells.seconds[mine].sum())


def _around(one: ReceiverRows, with_fix: NDArray[np.intp], start_s: float, end_s: float) -> tuple[int, int | None]:
    """Return the last row with a fix before a loss, and the first one after it."""
    at = int(np.searchsorted(one.time_s[with_fix], start_s, side="right"))  # a gap begins at that row itself
    later = int(np.searchsorted(one.time_s[with_fix], end_s - 1e-6))
    return int(with_fix[at - 1]), int(with_fix[later]) if later < len(with_fix) else None


def _loss(one: ReceiverRows, state: str, start_s: float, end_s: float, before: int, after: int | None) -> FixLoss:
    speeds = [known(one.speed_mps[row]) if row is not None else None for row in (before, after)]
    moved_m = None
    if after is not None:
        rows = np.array([after])
        plan = one.plan_m(rows, one.latitude_deg[[before]], one.longitude_deg[[before]])[0]
        moved_m = known(float(np.hypot(*plan)))
    return FixLoss(state, start_s, end_s, end_s - start_s, speeds[0], speeds[1], moved_m)


def known(value: float) -> float | None:
    """Return a number, None where it is not finite."""
    return float(value) if np.isfinite(value) else None
