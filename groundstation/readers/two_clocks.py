"""Comparison of a clock with the times at which its readings were received.

It tells which readings arrived late, and which of the two clocks was set.

Receipt less clock is never below the offset between the two: a reading that waited in a buffer or on a link arrives
late, none early. The lower envelope of the differences is that offset; where the envelope steps and stays, one of the
clocks was set, or started again.

Source: S. B. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay measurements, IEEE
INFOCOM 1999.
"""

from collections.abc import Sequence
from dataclasses import field
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S

LARGEST_NS = 1 << 62  # largest time: differences of differences fit 64 bits
STEP_S = 1.0  # a smaller step cannot be told from a reading that arrived late
DRIFT_PPM = 200.0  # drift between two clocks; crystals are within 100
MOST_SKEW_PPM = 1_000.0  # a clock that runs worse counts no seconds: a simulation, or one that was stopped
JUMP_AHEAD_S = 60.0  # a clock that goes ahead by less and stays: older readings were dropped on the way
FEWEST_READINGS = 4  # readings of a stretch; fewer are astray
MOST_ROUNDS = 5  # rounds of leaving out readings astray
CAUGHT_UP_SHARE = 0.1  # share of a step by which readings after it may come earlier
MOST_KEPT, RUN = 100_000, 64  # readings that are kept beside the lowest of each run
MOST_STEPS = 64  # steps in a log; a clock with more is no clock
Stepped: TypeAlias = Literal["", "receipt", "clock"]


@dataclass
class ClockReadings:
    """Readings of a clock, thinned.

    Those around each jump are kept, and of each run the one that arrived least late.

    Attributes
    ----------
    count : int
        How many there were.
    """

    count: int = 0
    _parts: list[Int64Array] = field(default_factory=list)
    _kept: int = 0
    _last: Int64Array = field(default_factory=lambda: np.zeros((4, 0), dtype=np.int64))

    def take(self, record_index: Int64Array, receipt_ns: Int64Array, clock_ns: Int64Array) -> None:
        """Add readings in the order of the log, shape (n,) each.

        Readings with a time that is negative or above 62 bits are left out.
        """
        is_time = (receipt_ns >= 0) & (receipt_ns < LARGEST_NS) & (clock_ns >= 0) & (clock_ns < LARGEST_NS)
        if not is_time.all():
            record_index, receipt_ns, clock_ns = record_index[is_time], receipt_ns[is_time], clock_ns[is_time]
        if not len(record_index):
            return
        number = np.arange(self.count, self.count + len(record_index))
        new = np.stack((record_index, receipt_ns, clock_ns, number))
        self.count += len(record_index)
        rows = np.concatenate((self._last, new), axis=1)
        late_ns = rows[1] - rows[2]
        is_kept = np.zeros(rows.shape[1], dtype=bool)
        is_kept[[0, -1]] = True
        jumps = np.flatnonzero(np.abs(np.diff(late_ns)) > STEP_S * NS_PER_S)
        jumps = jumps[: max(MOST_KEPT - self._kept, 0) // 2]
        is_kept[jumps] = is_kept[jumps + 1] = True
        whole = len(late_ns) // RUN * RUN
        is_kept[np.arange(0, whole, RUN) + late_ns[:whole].reshape(-1, RUN).argmin(axis=1)] = True
        is_kept[whole + int(late_ns[whole:].argmin()) if whole < len(late_ns) else -1] = True
        is_kept[: self._last.shape[1]] = False  # it was kept before
        self._kept += 2 * len(jumps)
        self._parts.append(rows[:, is_kept])
        self._last = rows[:, -1:]

    def all(self) -> "ReadingSequence":
        """Return the readings that were kept."""
        rows = np.concatenate(self._parts, axis=1) if self._parts else np.zeros((4, 0), dtype=np.int64)
        return ReadingSequence(*rows)


@dataclass(frozen=True, eq=False)
class ReadingSequence:
    """Readings in the order of the log: record, receipt, clock, place among all readings.

    Each has shape (n,).
    """

    record_index: Int64Array
    receipt_ns: Int64Array
    clock_ns: Int64Array
    number: Int64Array

    def __len__(self) -> int:
        return len(self.record_index)

    def take(self, rows: BoolArray | slice) -> "ReadingSequence":
        """The readings that ``rows`` selects."""
        return ReadingSequence(self.record_index[rows], self.receipt_ns[rows], self.clock_ns[rows], self.number[rows])

    @property
    def late_ns(self) -> Int64Array:
        """Receipt less clock."""
        return np.asarray(self.receipt_ns - self.clock_ns)

    @property
    def readings(self) -> int:
        """Number of readings from the first to the last."""
        return int(self.number[-1] - self.number[0]) + 1 if len(self) else 0


@dataclass(frozen=True, eq=False)
class ClockStretch:
    """Readings over which neither clock was set.

    Parameters
    ----------
    track : ReadingSequence
    stepped : {'', 'receipt', 'clock'}
        Which clock was set, or started again, where it begins.
    after : int
        Record of the reading before; -1 for the first stretch.
    """

    track: ReadingSequence
    stepped: Stepped = ""
    after: int = -1

    @property
    def level_ns(self) -> int:
        """Least difference of receipt and clock."""
        return int(self.track.late_ns.min())


def stretches_of(track: ReadingSequence, *, receipt_step_s: float = STEP_S) -> list[ClockStretch]:
    """Part readings into stretches between steps; readings astray are left out.

    All are one stretch where the steps are no steps of a clock.

    Parameters
    ----------
    track : ReadingSequence
    receipt_step_s : float
        Least step ahead of the receiver's clock that is taken for one: readings may go on being late.

    Examples
    --------
    >>> seconds = np.arange(100)
    >>> late = np.where(seconds < 40, 0, 3_600)  # the receiver's clock is set
    >>> track = ReadingSequence(seconds, (seconds + late) * NS_PER_S, seconds * NS_PER_S, seconds)
    >>> [(len(one.track), one.stepped, one.level_ns // NS_PER_S) for one in stretches_of(track)]
    [(40, '', 0), (60, 'receipt', 3600)]
    """
    left, found = track.take(~_slips(track)), list[ClockStretch]()
    for _ in range(MOST_ROUNDS):
        found = _stretches(left, receipt_step_s)
        sound = [one for one in found if one.track.readings >= min(FEWEST_READINGS, track.readings)]
        if len(sound) == len(found):
            return found
        kept = np.concatenate([left.number[:0], *(one.track.number for one in sound)])
        left, found = left.take(np.isin(left.number, kept)), sound
    return found


def _slips(track: ReadingSequence) -> BoolArray:
    """Tell which single readings are far from two neighbours that are near each other."""
    late_ns, step_ns = track.late_ns, STEP_S * NS_PER_S
    found = np.zeros(len(track), dtype=bool)
    changes = np.abs(np.diff(late_ns)) > step_ns
    in_turn = track.number[2:] - track.number[:-2] == 2
    found[1:-1] = in_turn & changes[:-1] & changes[1:] & (np.abs(late_ns[2:] - late_ns[:-2]) <= step_ns)
    return found


def _stretches(track: ReadingSequence, receipt_step_s: float) -> list[ClockStretch]:
    if not len(track):
        return []
    late_ns = track.late_ns
    span_ns = min(int(np.ptp(track.receipt_ns)), int(np.ptp(track.clock_ns)))
    tolerance_ns = STEP_S * NS_PER_S + min(span_ns, 86_400 * NS_PER_S) * DRIFT_PPM * 1e-6
    places: list[int] = []
    kinds: dict[int, Stepped] = {}
    open_ends = [(0, len(track))]
    while open_ends and len(places) <= MOST_STEPS:
        start, end = open_ends.pop()
        place, kind = _step_in(track, late_ns, start, end, tolerance_ns, receipt_step_s * NS_PER_S)
        if kind:
            places.append(place)
            kinds[place] = kind
            open_ends += [(start, place), (place, end)]
    if len(places) > MOST_STEPS:
        return [ClockStretch(track)]
    edges = [0, *sorted(places), len(track)]
    return [
        ClockStretch(
            track.take(slice(start, end)), kinds.get(start, ""), int(track.record_index[start - 1]) if start else -1
        )
        for start, end in pairwise(edges)
    ]


def _step_in(
    track: ReadingSequence, late_ns: Int64Array, start: int, end: int, tolerance_ns: float, ahead_ns: float
) -> tuple[int, Stepped]:
    """Return the largest step of the lower envelope in some readings: its place and clock.

    The clock is the one that stepped.

    The readings step there too. Those that come late after a pause catch up, those of a clock that was set do not.
    """
    changes = np.diff(late_ns[start:end])
    places = np.flatnonzero(np.abs(changes) > STEP_S * NS_PER_S) + 1
    if not len(places):
        return 0, ""
    before = np.minimum.accumulate(late_ns[start:end])[places - 1]
    behind = np.minimum.accumulate(late_ns[start:end][::-1])[::-1][places]
    rises, jumps = behind - before, changes[places - 1]
    sizes = np.where(np.sign(rises) == np.sign(jumps), np.minimum(np.abs(rises), np.abs(jumps)), 0)
    for at in np.argsort(-sizes, kind="stable")[:8].tolist():
        if sizes[at] <= tolerance_ns:
            break
        place = start + int(places[at])
        receipt_ns = int(track.receipt_ns[place] - track.receipt_ns[place - 1])
        clock_ns = int(track.clock_ns[place] - track.clock_ns[place - 1])
        kind: Stepped = "receipt" if _oddness(receipt_ns) > _oddness(clock_ns) else "clock"
        rise_ns, caught_up_ns = int(rises[at]), int(late_ns[place]) - int(behind[at])
        is_lasting = rise_ns > ahead_ns and caught_up_ns <= max(STEP_S * NS_PER_S, CAUGHT_UP_SHARE * rise_ns)
        if kind == "receipt" and (receipt_ns < 0 or is_lasting):
            return place, kind
        if kind == "clock" and (rise_ns > 0 or -rise_ns > JUMP_AHEAD_S * NS_PER_S):
            return place, kind
    return 0, ""


def _oddness(change_ns: int) -> float:
    """Return how odd a change of a clock from one reading to the next is.

    A change that falls is odder than any that rises.
    """
    return change_ns if change_ns >= -STEP_S * NS_PER_S else -change_ns * 1e6


@dataclass(frozen=True)
class ReceiptLine:
    """Receipt less clock of readings that were not late, as a straight line.

    ``offset_ns`` at ``zero_ns`` of the clock, and its drift.
    """

    zero_ns: int
    offset_ns: int
    drift: float = 0.0

    def at(self, clock_ns: Int64Array) -> Int64Array:
        """Return the offset to add to times of the clock, ns."""
        if not self.drift:
            return np.full(len(clock_ns), self.offset_ns, dtype=np.int64)
        return np.asarray(self.offset_ns + np.rint((clock_ns - self.zero_ns) * self.drift).astype(np.int64))


def lower_line(track: ReadingSequence) -> ReceiptLine:
    """Fit the line below all differences of receipt and clock that is nearest to them.

    It goes through the edge of their lower hull above which the middle of the clock's times lies. A clock that runs off
    by more than :data:`MOST_SKEW_PPM` counts no seconds: then the least difference holds throughout.

    Examples
    --------
    >>> clock = np.arange(0, 3_600, 10) * NS_PER_S
    >>> late = np.where(np.arange(360) % 7, 400_000_000, 0) + (clock * 50e-6).astype(np.int64)
    >>> line = lower_line(ReadingSequence(np.arange(360), clock + 5 * NS_PER_S + late, clock, np.arange(360)))
    >>> round(line.drift * 1e6), [round(at / NS_PER_S, 3) for at in line.at(clock[[0, -1]]).tolist()]
    (50, [5.0, 5.179])
    """
    order = np.argsort(track.clock_ns, kind="stable")
    clock_ns, late_ns = track.clock_ns[order], track.late_ns[order]
    least = ReceiptLine(int(clock_ns[0]), int(late_ns.min()))
    corners = _lower_hull(clock_ns, late_ns)
    middle = float(np.mean((clock_ns - clock_ns[0]).astype(np.float64)))
    after = next((at for at in range(1, len(corners)) if clock_ns[corners[at]] - clock_ns[0] >= middle), 0)
    if not after:
        return least
    one, other = corners[after - 1], corners[after]
    drift = int(late_ns[other] - late_ns[one]) / int(clock_ns[other] - clock_ns[one])
    if abs(drift) > MOST_SKEW_PPM * 1e-6:
        return least
    return ReceiptLine(int(clock_ns[one]), int(late_ns[one]), drift)


def _lower_hull(x: Int64Array, y: Int64Array) -> list[int]:
    """Return the places of the corners of the lower hull of points in order of ``x``.

    Of points with equal ``x`` the lowest counts.
    """
    keep = _lowest(x, y)
    corners: list[int] = []
    for at in keep:
        while len(corners) > 1 and _is_above(x, y, corners[-2], corners[-1], at):
            corners.pop()
        corners.append(at)
    return corners


def _lowest(x: Int64Array, y: Int64Array) -> Sequence[int]:
    """Return the lowest point of each of at most some thousand stretches of ``x``."""
    width = max(int(x[-1] - x[0]) // 4_096, 1)
    cell = (x - x[0]) // width
    order = np.lexsort((y, cell))
    first = np.concatenate(([True], np.diff(cell[order]) > 0))
    places = order[first]
    keep: list[int] = sorted(places.tolist(), key=lambda at: int(x[at]))
    return [at for number, at in enumerate(keep) if not number or x[at] > x[keep[number - 1]]]


def _is_above(x: Int64Array, y: Int64Array, one: int, middle: int, other: int) -> bool:
    """Tell whether the middle point is on or above the line between the two others."""
    left = int(y[middle] - y[one]) * int(x[other] - x[one])
    return left >= int(y[other] - y[one]) * int(x[middle] - x[one])
