"""Times of validity of the frames of a telemetry log, block by block.

They follow from the clocks of the senders.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.tlog.clock import NS_PER_US, TimeReader, TlogClocks, time_fields
from groundstation.readers.tlog.frames import FrameBlock

MOST_LATE_S = 600.0
ASTRAY_S = 2.0  # largest difference of a message's time from its sender's clock around it


class Timer:
    """Times of validity of the values in frames, computed block by block.

    Attributes
    ----------
    most_late_ns : int
        How late a frame arrived at most, so far.
    first_received_ns, earliest_ns : int, optional
        When the first frame was received, and the earliest time of validity: both in UTC.
    """

    def __init__(self, clocks: TlogClocks) -> None:
        self.most_late_ns = 0
        self.first_received_ns: int | None = None
        self.earliest_ns: int | None = None
        self._clocks = clocks
        self._readers: dict[tuple[int, int], TimeReader] = {}
        self._before: dict[int, NDArray[np.int64]] = {}  # the last reference of each sender: record, receipt, its clock
        self._last: dict[int, NDArray[np.int64]] = {}  # the last frame whose time is known: record, receipt, UTC
        self._references: dict[int, NDArray[np.int64]] = {}  # references of the block that follows
        self._device_ns: Int64Array = np.zeros(0, dtype=np.int64)  # when the last frame before the block was received

    def validity_ns(self, block: FrameBlock, following: FrameBlock | None) -> Int64Array | None:
        """Return the times of validity of a block's frames, shape (n,).

        They are by the ground station's clock; None without any clock.
        """
        if not self._clocks.senders:
            return None
        own = self._references or self._read_references(block)
        self._references = {} if following is None else self._read_references(following)
        index, received_ns = block.record_index, self._received_ns(block)
        utc_ns, is_known = received_ns.copy(), np.zeros(len(block), dtype=bool)
        has_own = np.zeros(len(block), dtype=bool)
        senders = list(block.by_sender())
        for sender, groups in senders:
            if sender in self._clocks.senders:
                around = self._around(sender, own, self._references)
                self._place(block, sender, groups, around, utc_ns, is_known)
        known = np.stack((index, received_ns, utc_ns))
        rows_of = {sender: np.flatnonzero(block.frames[:, 2] == sender) for sender, _groups in senders}
        for sender, rows in rows_of.items():
            wanted = rows[~is_known[rows]]
            if not len(wanted):
                continue
            anchors = self._of_sender(sender, rows, known, is_known)
            if not anchors.shape[1]:
                system = [other for one, other in rows_of.items() if one >> 8 == sender >> 8]
                anchors = self._known(sender >> 8, np.sort(np.concatenate(system)), known, is_known)
            if anchors.shape[1]:
                utc_ns[wanted] = _between(index[wanted], received_ns[wanted], anchors)
                has_own[wanted] = True
        self._remember(rows_of, own, known, is_known)
        late_ns = (received_ns - utc_ns)[is_known]
        self.most_late_ns = max(self.most_late_ns, int(late_ns.max(initial=0)))
        if self.first_received_ns is None and len(block):
            self.first_received_ns = int(received_ns[0])
        placed_ns = utc_ns[has_own | is_known]
        if len(placed_ns):
            earliest_ns = int(placed_ns.min())
            self.earliest_ns = earliest_ns if self.earliest_ns is None else min(self.earliest_ns, earliest_ns)
        validity_ns, device_ns = utc_ns - self._clocks.offsets.at(index), block.received.values
        # Frames received at one time may get others; a time of validity that is the device's would go with it.
        validity_ns += (validity_ns == device_ns) & self._is_repeated(device_ns, following)
        return np.where(has_own | is_known, validity_ns, device_ns)

    def _is_repeated(self, device_ns: Int64Array, following: FrameBlock | None) -> BoolArray:
        """Tell which frames were received together with a neighbour, shape (n,)."""
        behind_ns = np.zeros(0, dtype=np.int64) if following is None else following.received.values[:1]
        around_ns = np.concatenate((self._device_ns, device_ns, behind_ns))
        is_same = np.concatenate(([False], around_ns[1:] == around_ns[:-1], [False]))
        first, self._device_ns = len(self._device_ns), device_ns[-1:]
        return np.asarray((is_same[:-1] | is_same[1:])[first : first + len(device_ns)])

    def _received_ns(self, block: FrameBlock) -> Int64Array:
        return np.asarray(block.received.values + self._clocks.offsets.at(block.record_index))

    def _read(self, block: FrameBlock, sender: int, number: int, which: Int64Array) -> Int64Array:
        """Read times of frames by the clock of their sender, -1 where there is none."""
        reader = self._readers.setdefault((sender, number), TimeReader(number))
        return self._clocks.senders[sender].by_its_clock(*reader.read(block, which))

    def _read_references(self, block: FrameBlock) -> dict[int, NDArray[np.int64]]:
        """Read the frames of each sender that serve its clock: record, receipt, clock.

        Only those that can be true.
        """
        found = {}
        received_ns = self._received_ns(block)
        for sender, number, which in block.groups:
            clock = self._clocks.senders.get(sender)
            if clock is None or number != clock.reference:
                continue
            clock_ns = self._read(block, sender, clock.reference, which)
            index = block.record_index[which]
            late_ns = clock.late_ns(index, received_ns[which] - self._clocks.ground_ns, clock_ns)
            good = (clock_ns >= 0) & (late_ns > -ASTRAY_S * NS_PER_S) & (late_ns < MOST_LATE_S * NS_PER_S)
            found[sender] = np.stack((index[good], received_ns[which[good]], clock_ns[good]))
        return found

    def _around(
        self, sender: int, own: Mapping[int, NDArray[np.int64]], behind: Mapping[int, NDArray[np.int64]]
    ) -> NDArray[np.int64]:
        """Return references of a sender in the block, and the nearest on either side of it."""
        nothing = np.zeros((3, 0), dtype=np.int64)
        parts = self._before.get(sender, nothing), own.get(sender, nothing), behind.get(sender, nothing)[:, :1]
        return np.concatenate(parts, axis=1)

    def _place(
        self,
        block: FrameBlock,
        sender: int,
        groups: Sequence[tuple[int, Int64Array]],
        around: NDArray[np.int64],
        utc_ns: Int64Array,
        is_known: BoolArray,
    ) -> None:
        """Set the UTC of the frames of a sender whose own times can be true."""
        clock = self._clocks.senders[sender]
        if not around.shape[1]:
            return
        astray_ns = round(ASTRAY_S * NS_PER_S)
        behind = np.concatenate((around[2], around[2, -1:]))
        before = np.concatenate((around[2, :1], around[2]))
        low, high = np.minimum(before, behind) - astray_ns, np.maximum(before, behind) + astray_ns
        clock_ns = np.full(len(block), -1, dtype=np.int64)
        for number, which in groups:
            if number == clock.reference or number not in clock.trusted:
                continue
            own_ns = self._read(block, sender, number, which)
            at = np.searchsorted(around[0], block.record_index[which])
            if time_fields()[number].is_short and time_fields()[number].unit_ns == NS_PER_US:
                own_ns = _near(own_ns, before[at])
            clock_ns[which] = np.where((own_ns >= low[at]) & (own_ns <= high[at]), own_ns, -1)
        of_block = around[:, (around[0] >= block.first_index) & (around[0] < block.first_index + len(block))]
        clock_ns[of_block[0] - block.first_index] = of_block[2]
        good = np.flatnonzero(clock_ns >= 0)
        utc_ns[good] = clock.utc_of(block.record_index[good], clock_ns[good], self._clocks.ground_ns)
        is_known[good] = True

    def _of_sender(
        self, sender: int, rows: Int64Array, known: NDArray[np.int64], is_known: BoolArray
    ) -> NDArray[np.int64]:
        """Return the frames of a sender whose time is known.

        The last one before the block and the first one behind it are included.
        """
        nothing = np.zeros((3, 0), dtype=np.int64)
        behind = self._references.get(sender, nothing)[:, :1]
        if behind.shape[1]:
            clock = self._clocks.senders[sender]
            behind = np.stack((behind[0], behind[1], clock.utc_of(behind[0], behind[2], self._clocks.ground_ns)))
        return np.concatenate((self._last.get(sender, nothing), known[:, rows[is_known[rows]]], behind), axis=1)

    def _known(self, system: int, rows: Int64Array, known: NDArray[np.int64], is_known: BoolArray) -> NDArray[np.int64]:
        """Return frames of all senders of a system with known time, and the last before."""
        last = [one for sender, one in self._last.items() if sender >> 8 == system]
        before = max(last, key=lambda one: int(one[0, -1]), default=np.zeros((3, 0), dtype=np.int64))
        return np.concatenate((before, known[:, rows[is_known[rows]]]), axis=1)

    def _remember(
        self,
        rows_of: Mapping[int, Int64Array],
        own: Mapping[int, NDArray[np.int64]],
        known: NDArray[np.int64],
        is_known: BoolArray,
    ) -> None:
        for sender, references in own.items():
            if references.shape[1]:
                self._before[sender] = references[:, -1:]
        for sender, rows in rows_of.items():
            placed = rows[is_known[rows]]
            if len(placed):
                self._last[sender] = known[:, placed[-1:]]


def _near(short_ns: Int64Array, clock_ns: Int64Array) -> Int64Array:
    """Complete times of which only 32 bits in microseconds were sent, close to others."""
    wrap_ns = (1 << 32) * NS_PER_US
    return np.asarray(clock_ns + (short_ns - clock_ns + wrap_ns // 2) % wrap_ns - wrap_ns // 2)


def _between(index: Int64Array, received_ns: Int64Array, known: NDArray[np.int64]) -> Int64Array:
    """Return the UTC of frames between others by the time of receipt.

    Where the receipt is the same, the order of the frames counts.
    """
    at = np.searchsorted(known[0], index)
    low, high = np.maximum(at - 1, 0), np.minimum(at, known.shape[1] - 1)
    records, times, utc = known
    before_ns, first_ns = times[low], utc[low]
    span_ns, since_ns = times[high] - before_ns, received_ns - before_ns
    share = np.clip(since_ns, 0, span_ns) / np.maximum(span_ns, 1)
    is_one = np.flatnonzero(span_ns <= 0)
    if len(is_one):
        before, behind = records[low[is_one]], records[high[is_one]]
        share[is_one] = (index[is_one] - before) / np.maximum(behind - before, 1)
    utc_ns = first_ns + np.rint((utc[high] - first_ns) * share).astype(np.int64)
    is_first, is_last = at == 0, at == known.shape[1]
    if is_first.any():
        utc_ns[is_first] = first_ns[is_first] + np.minimum(since_ns[is_first], 0)
    if is_last.any():
        utc_ns[is_last] = first_ns[is_last] + np.maximum(since_ns[is_last], 0)
    return np.asarray(utc_ns)
