"""When the values in the frames of a telemetry log were true, block by block, by the clocks of their senders."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.tlog.clock import MOST_LATE_S, NS_PER_US, Clocks, TimeReader, time_fields
from groundstation.readers.tlog.frames import Block

ASTRAY_S = 2.0  # of the time of a message from those of its sender's clock around it


class Timer:
    """Tells when the values of frames were true, block by block."""

    def __init__(self, clocks: Clocks) -> None:
        self._clocks = clocks
        self._readers: dict[tuple[int, int], TimeReader] = {}
        self._before: dict[int, NDArray[np.int64]] = {}  # the last reference of each sender: record, receipt, its clock
        self._last: dict[int, NDArray[np.int64]] = {}  # the last frame whose time is known: record, receipt, UTC
        self._references: dict[int, NDArray[np.int64]] = {}  # of the block that follows
        self._device_ns: Int64Array = np.zeros(0, dtype=np.int64)  # when the last frame before the block was received

    def validity_ns(self, block: Block, following: Block | None) -> Int64Array | None:
        """Times of validity of a block's frames by the ground station's clock, shape (n,); None without any clock."""
        if not self._clocks.senders:
            return None
        own = self._references or self._read_references(block)
        self._references = {} if following is None else self._read_references(following)
        index, received_ns = block.record_index, self._received_ns(block)
        utc_ns, is_known = received_ns.copy(), np.zeros(len(block), dtype=bool)
        has_own = np.zeros(len(block), dtype=bool)
        for sender, rows in block.of_senders():
            if sender in self._clocks.senders:
                around = self._around(sender, own, self._references)
                self._place(block, sender, rows, around, utc_ns, is_known)
        known = np.stack((index, received_ns, utc_ns))
        systems: dict[int, list[Int64Array]] = {}
        for sender, rows in block.of_senders():
            systems.setdefault(sender >> 8, []).append(rows)
        for system, several in systems.items():
            everything = self._known(system, np.sort(np.concatenate(several)), known, is_known)
            for rows in several:
                sender = int(block.frames[rows[0], 2])
                of_sender = self._of_sender(sender, rows, known, is_known)
                wanted = rows[~is_known[rows]]
                anchors = of_sender if of_sender.shape[1] else everything
                if len(wanted) and anchors.shape[1]:
                    utc_ns[wanted] = _between(index[wanted], received_ns[wanted], anchors)
                    has_own[wanted] = True
        self._remember(block, own, known, is_known)
        validity_ns, device_ns = utc_ns - self._clocks.offsets.at(index), block.received.values
        # Frames received at one time may get others; a time of validity that is the device's would go with it.
        validity_ns += (validity_ns == device_ns) & self._is_repeated(device_ns, following)
        return np.where(has_own | is_known, validity_ns, device_ns)

    def _is_repeated(self, device_ns: Int64Array, following: Block | None) -> BoolArray:
        """Frames of a block that were received together with the one before or behind, shape (n,)."""
        behind_ns = np.zeros(0, dtype=np.int64) if following is None else following.received.values[:1]
        around_ns = np.concatenate((self._device_ns, device_ns, behind_ns))
        is_same = np.concatenate(([False], around_ns[1:] == around_ns[:-1], [False]))
        first, self._device_ns = len(self._device_ns), device_ns[-1:]
        return np.asarray((is_same[:-1] | is_same[1:])[first : first + len(device_ns)])

    def _received_ns(self, block: Block) -> Int64Array:
        return np.asarray(block.received.values + self._clocks.offsets.at(block.record_index))

    def _read(self, block: Block, sender: int, number: int, which: Int64Array) -> Int64Array:
        """Times of frames by the clock of their sender, -1 where there is none."""
        reader = self._readers.setdefault((sender, number), TimeReader(number))
        return self._clocks.senders[sender].by_its_clock(*reader.read(block, which))

    def _read_references(self, block: Block) -> dict[int, NDArray[np.int64]]:
        """The frames of each sender that are read for its clock: record, receipt, clock; those that can be true."""
        found = {}
        received_ns = self._received_ns(block)
        for sender, clock in self._clocks.senders.items():
            which = np.flatnonzero((block.frames[:, 2] == sender) & (block.frames[:, 1] == clock.reference))
            if not len(which):
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
        """References of a sender in the block, with the last before it and the first behind it."""
        nothing = np.zeros((3, 0), dtype=np.int64)
        parts = self._before.get(sender, nothing), own.get(sender, nothing), behind.get(sender, nothing)[:, :1]
        return np.concatenate(parts, axis=1)

    def _place(
        self,
        block: Block,
        sender: int,
        rows: Int64Array,
        around: NDArray[np.int64],
        utc_ns: Int64Array,
        is_known: BoolArray,
    ) -> None:
        """UTC of the frames of a sender whose own times can be true."""
        clock = self._clocks.senders[sender]
        if not around.shape[1]:
            return
        for number, which in block.by_number(rows):
            if number not in clock.trusted:
                continue
            index = block.record_index[which]
            at = np.searchsorted(around[0], index)
            before = around[2, np.maximum(at - 1, 0)]
            behind = around[2, np.minimum(at, around.shape[1] - 1)]
            if number == clock.reference:
                place = np.minimum(at, around.shape[1] - 1)
                good, clock_ns = around[0, place] == index, around[2, place]
            else:
                clock_ns = self._read(block, sender, number, which)
                if time_fields()[number].is_short and time_fields()[number].unit_ns == NS_PER_US:
                    clock_ns = _near(clock_ns, before)
                low, high = np.minimum(before, behind), np.maximum(before, behind)
                astray_ns = round(ASTRAY_S * NS_PER_S)
                good = (clock_ns >= 0) & (clock_ns >= low - astray_ns) & (clock_ns <= high + astray_ns)
            utc_ns[which[good]] = clock.utc_of(index[good], clock_ns[good], self._clocks.ground_ns)
            is_known[which[good]] = True

    def _of_sender(
        self, sender: int, rows: Int64Array, known: NDArray[np.int64], is_known: BoolArray
    ) -> NDArray[np.int64]:
        """Frames of a sender whose time is known, with the last before the block and the first behind it."""
        nothing = np.zeros((3, 0), dtype=np.int64)
        behind = self._references.get(sender, nothing)[:, :1]
        if behind.shape[1]:
            clock = self._clocks.senders[sender]
            behind = np.stack((behind[0], behind[1], clock.utc_of(behind[0], behind[2], self._clocks.ground_ns)))
        return np.concatenate((self._last.get(sender, nothing), known[:, rows[is_known[rows]]], behind), axis=1)

    def _known(self, system: int, rows: Int64Array, known: NDArray[np.int64], is_known: BoolArray) -> NDArray[np.int64]:
        """The same of all senders of a system."""
        last = [one for sender, one in self._last.items() if sender >> 8 == system]
        before = max(last, key=lambda one: int(one[0, -1]), default=np.zeros((3, 0), dtype=np.int64))
        return np.concatenate((before, known[:, rows[is_known[rows]]]), axis=1)

    def _remember(
        self, block: Block, own: Mapping[int, NDArray[np.int64]], known: NDArray[np.int64], is_known: BoolArray
    ) -> None:
        for sender, references in own.items():
            if references.shape[1]:
                self._before[sender] = references[:, -1:]
        for sender, rows in block.of_senders():
            placed = rows[is_known[rows]]
            if len(placed):
                self._last[sender] = known[:, placed[-1:]]


def _near(short_ns: Int64Array, clock_ns: Int64Array) -> Int64Array:
    """Times of which 32 bits in microseconds were sent, next to others."""
    wrap_ns = (1 << 32) * NS_PER_US
    return np.asarray(clock_ns + (short_ns - clock_ns + wrap_ns // 2) % wrap_ns - wrap_ns // 2)


def _between(index: Int64Array, received_ns: Int64Array, known: NDArray[np.int64]) -> Int64Array:
    """UTC of frames between others, by the time of receipt, or by their order where that is one."""
    at = np.searchsorted(known[0], index)
    low, high = np.maximum(at - 1, 0), np.minimum(at, known.shape[1] - 1)
    span_ns = known[1, high] - known[1, low]
    by_receipt = np.clip(received_ns - known[1, low], 0, np.maximum(span_ns, 0)) / np.maximum(span_ns, 1)
    by_order = (index - known[0, low]) / np.maximum(known[0, high] - known[0, low], 1)
    share = np.where(span_ns > 0, by_receipt, by_order)
    between = np.rint((known[2, high] - known[2, low]) * share).astype(np.int64)
    beyond = received_ns - known[1, low]  # before the first, or behind the last
    beyond = np.where(at == 0, np.minimum(beyond, 0), np.maximum(beyond, 0))
    is_inside = (at > 0) & (at < known.shape[1])
    return np.asarray(known[2, low] + np.where(is_inside, between, beyond))
