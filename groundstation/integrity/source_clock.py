"""Clock of a source: one model, made of one part for each power-up."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array, LogHeader, NewLog
from groundstation.base.sorted_values import distinct
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock import ClockModel, ClockOffsets, estimate_clock
from groundstation.integrity.clock_references import ClockReferences
from groundstation.integrity.counting import CountingSettings, estimate_counting_clock
from groundstation.integrity.limits import Thresholds
from groundstation.integrity.ordering import joined_columns
from groundstation.integrity.places import PieceOnDisk, Places
from groundstation.integrity.power_ups import SILENT_NS, TOLERANCE_NS, Evidence, PowerUp, power_ups
from groundstation.integrity.thinning import Thinner

PAUSE_NS = NS_PER_S  # between power-ups that are laid behind one another, as nothing tells when they were
Window = tuple[Int64Array, Column, BoolArray]  # places, device times, whether the time of the topic does not advance


@dataclass(frozen=True)
class PowerUpClock:
    """The clock of one of several power-ups.

    Parameters
    ----------
    records : PowerUp
        Its first record, and the first one of the next.
    utc_of_zero_ns : int or None
        UTC of its device time zero.
    is_absolute : bool
    start_ns, end_ns : int
        Corrected time of its first and last record, on the clock of the source.
    shift_ns : int
        Nanoseconds added to lay it beside the others; 0 where its time is UTC.
    metadata : mapping of str to str
        Metadata of the source for it alone.
    """

    records: PowerUp
    utc_of_zero_ns: int | None
    is_absolute: bool
    start_ns: int
    end_ns: int
    shift_ns: int = 0
    metadata: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ClockPass:
    """Results of a pass over a source.

    They are its header, further logs that begin in it, places and times, other clocks.
    """

    header: LogHeader
    new_logs: tuple[NewLog, ...]
    places: Places
    pieces: Mapping[str, Sequence[PieceOnDisk]]
    references: ClockReferences

    @property
    def topics(self) -> list[Sequence[PieceOnDisk]]:
        """The pieces of each topic, in alphabetical order."""
        return [self.pieces[topic] for topic in sorted(self.pieces)]

    def windows(self, part: PowerUp) -> Iterator[Window]:
        """Records of one power-up in order, with times as if its counter had no end."""
        for index, time, frozen in self.places.in_order(self.topics):
            first, end = np.searchsorted(index, (part.first, part.end))
            if first < end:
                rows = slice(int(first), int(end))
                here = time.take(rows)
                yield index[rows], Column(part.unwrapped_ns(index[rows], here.values), here.present), frozen[rows]


def clock_of(found: ClockPass, limits: Thresholds) -> tuple[ClockModel, tuple[PowerUpClock, ...]]:
    """Model the clock of a source; also return its power-ups where there are several.

    A source is looked at for them where its clock steps back, is out of order, is silent for an hour, or another log
    begins in it.
    """
    header = found.header
    offsets = ClockOffsets.of(header.clock_offsets)
    if offsets is not None:  # another clock of the log tells how this one was set
        return _set_by_another(found, limits, offsets), ()
    clock = _whole(found, limits)
    is_odd = clock.steps or clock.is_unordered or found.new_logs
    if not (is_odd or (header.utc_of_zero_ns == 0 and clock.longest_step_ns > SILENT_NS)):
        return clock, ()
    parts = power_ups(_believed(found), _evidence(found, clock))
    if len(parts) == 1 and not parts[0].wraps:
        return clock, ()
    zeros: list[int | None] = []
    for part in parts:
        before_ns = zeros[-1] if zeros else header.utc_of_zero_ns
        zeros.append(_zero_of(part, found, before_ns, is_alone=len(parts) == 1))
    return _beside([_of(part, found, limits, zero_ns) for part, zero_ns in zip(parts, zeros, strict=True)])


def _whole(found: ClockPass, limits: Thresholds, offsets: ClockOffsets | None = None) -> ClockModel:
    """The model of a source as one power-up; ``offsets`` are added to its times."""
    zero_ns = found.header.utc_of_zero_ns
    if found.header.has_counting_clock:
        windows: Iterable[Window] = found.places.in_order(found.topics)
        if offsets is not None:
            windows = ((index, offsets.moved(index, time), frozen) for index, time, frozen in windows)
        return _counting_clock(windows, found.places.is_long, zero_ns, limits.counting_clock)
    index, time = found.places.in_one(found.topics)
    time = time if offsets is None else offsets.moved(index, time)
    return estimate_clock(index, time, zero_ns, settings=limits.clock)


def _set_by_another(found: ClockPass, limits: Thresholds, offsets: ClockOffsets) -> ClockModel:
    """Return the model for times as the device wrote them, set by another clock of the log.

    It is made from the model for times that the other clock has set.
    """
    clock = _whole(found, limits, offsets)
    return clock.on(offsets, clock.first_device_ns - int(offsets.offsets_ns[0])) if clock.has_times else clock


def _counting_clock(
    windows: Iterable[Window], is_long: bool, zero_ns: int | None, settings: CountingSettings
) -> ClockModel:
    """Estimate the model of a counting clock.

    In a long log only the records that matter are laid together.
    """
    thinner = Thinner(round(settings.tolerance_s * NS_PER_S), settings.run_records)
    kept_ones: list[Window] = []
    for index, time, frozen in windows:
        if not is_long:
            return estimate_counting_clock(index, time, frozen, zero_ns, settings=settings)
        kept = thinner.kept(time.values, time.mask & ~frozen)
        kept_ones.append((index[kept], time.take(kept), frozen[kept]))
    if not kept_ones:
        return ClockModel()
    clock = estimate_counting_clock(*_joined(kept_ones), zero_ns, settings=settings)
    return replace(clock, period_ns=thinner.period_ns) if clock.has_times else clock


def _joined(windows: Sequence[Window]) -> Window:
    return (
        np.concatenate([index for index, _time, _frozen in windows]),
        joined_columns([time for _index, time, _frozen in windows]),
        np.concatenate([frozen for _index, _time, frozen in windows]),
    )


def _believed(found: ClockPass) -> Iterator[tuple[Int64Array, Int64Array]]:
    """Places and times of the records that have a time which advances."""
    for index, time, frozen in found.places.in_order(found.topics):
        usable = time.mask & ~frozen
        yield (index, time.values) if usable.all() else (index[usable], time.values[usable])


def _evidence(found: ClockPass, clock: ClockModel) -> Evidence:
    return Evidence(
        is_utc=found.header.utc_of_zero_ns == 0,
        period_ns=clock.period_ns,
        new_logs=sorted(one.record_index for one in found.new_logs),
        steps_back=lambda place, middle_ns: _most_step_back(found, place, middle_ns),
        zero_ns=lambda first, end: _read_zero(found, first, end),
    )


def _most_step_back(found: ClockPass, place: int, middle_ns: int) -> bool:
    """Tell whether most topics go back, each by itself, at the end of a power-up.

    Only topics in the second half of the power-up count.
    """
    back = on = late = 0
    for several in found.topics:
        before_ns, behind_ns = _around(found.places, several, place)
        if before_ns is None or before_ns < middle_ns:  # it was written when something happened, or at the start
            continue
        late += 1
        if behind_ns is not None:
            is_back = before_ns - behind_ns > TOLERANCE_NS
            back, on = back + is_back, on + (not is_back)
    return back > on and 2 * back > late


def _around(places: Places, several: Sequence[PieceOnDisk], place: int) -> tuple[int | None, int | None]:
    """Return the last time of a topic before a place, and the first one from there on."""
    before_ns = behind_ns = None
    for kept in several:
        if kept.last < place:
            before_ns = kept.times[1] if kept.times else before_ns
            continue
        if kept.first >= place:
            if kept.times:
                return before_ns, kept.times[0]
            continue
        piece = places.piece(kept)
        index = piece.index[piece.time.mask]
        at = int(np.searchsorted(index, place))
        before_ns = int(piece.timed[at - 1]) if at else before_ns
        behind_ns = int(piece.timed[at]) if at < len(index) else None
        if behind_ns is not None:
            break
    return before_ns, behind_ns


def _read_zero(found: ClockPass, first: int, end: int) -> int | None:
    """Return UTC of device time zero by the readings between two records.

    They are the reader's, or else those of another clock of the log.
    """
    readings = found.header.utc_readings
    zeros = readings.between(first, end) if readings is not None else found.references.zeros_ns(first, end)
    return int(zeros[len(zeros) // 2]) if len(zeros) else None


def _zero_of(part: PowerUp, found: ClockPass, before_ns: int | None, *, is_alone: bool) -> int | None:
    """Return UTC of device time zero of one power-up.

    It is 0 for all power-ups where the device's own time is UTC. A header speaks for the first log in the source;
    readings over a whole source fit none of several power-ups. A counter that is ahead of the one before (whose zero is
    ``before_ns``) is taken for the same.
    """
    header = found.header
    if header.utc_of_zero_ns == 0:
        return 0
    told = next((one for one in found.new_logs if one.record_index == part.first), None)
    if told is not None and told.utc_of_zero_ns is not None:
        return told.utc_of_zero_ns
    if part.first == 0 and not header.has_counting_clock:
        return header.utc_of_zero_ns
    end = part.wraps[0].record_index if part.wraps else part.end
    read_ns = _read_zero(found, part.first, end)
    return before_ns if read_ns is None and (is_alone or part.is_ahead) else read_ns


def _of(part: PowerUp, found: ClockPass, limits: Thresholds, zero_ns: int | None) -> tuple[ClockModel, PowerUpClock]:
    """Model one power-up by the device's own times; also return what is known of it."""
    header = found.header
    if header.has_counting_clock:
        clock = _counting_clock(found.windows(part), found.places.is_long, zero_ns, limits.counting_clock)
    else:
        index, time, _frozen = _joined([_NOTHING, *found.windows(part)])
        clock = estimate_clock(index, time, zero_ns, settings=limits.clock)
    ends = [_ends(clock, window) for window in found.windows(part)]
    start_ns, end_ns = min((one for one, _ in ends), default=0), max((one for _, one in ends), default=0)
    for window in found.windows(part) if part.wraps else ():
        clock = _with_mixed(clock, part, window)
    told = next((one.metadata for one in found.new_logs if one.record_index == part.first), {})
    known = PowerUpClock(part, zero_ns, clock.is_absolute, start_ns, end_ns, metadata=told)
    return _wrapped(clock, part), known


_NOTHING: Window = (np.zeros(0, np.int64), Column(np.zeros(0, np.int64)), np.zeros(0, np.bool_))


def _ends(clock: ClockModel, window: Window) -> tuple[int, int]:
    time_ns = clock.time_ns(window[0], window[1])
    return int(time_ns.min()), int(time_ns.max())


def _with_mixed(clock: ClockModel, part: PowerUp, window: Window) -> ClockModel:
    """Return the model with records placed one by one where both sides of a wrap are mixed.

    Their place in the log does not tell on which side they are.
    """
    index, time, _frozen = window
    is_mixed = np.zeros(len(index), dtype=bool)
    for wrap in part.wraps:
        is_mixed |= (index >= wrap.early_from) & (index <= wrap.late_until)
    is_mixed &= time.mask & ~np.isin(index, clock.placed_index)
    places = np.concatenate((clock.placed_index, index[is_mixed]))
    times = np.concatenate((clock.placed_ns, clock.time_ns(index, time)[is_mixed]))
    order = np.argsort(places, kind="stable")
    return replace(clock, placed_index=places[order], placed_ns=times[order])


def _wrapped(clock: ClockModel, part: PowerUp) -> ClockModel:
    """Return the model for times as the device wrote them, from that of a counter without end."""
    starts = distinct(np.concatenate((clock.starts, [wrap.record_index for wrap in part.wraps])).astype(np.int64))
    offsets = ClockOffsets(clock.starts, clock.offsets_ns).at(starts)
    for wrap in part.wraps:
        offsets = offsets + np.where(starts >= wrap.record_index, wrap.modulus_ns, 0)
    starts[0] = min(int(starts[0]), part.first)
    return replace(clock, starts=starts, offsets_ns=offsets, wraps=part.wraps)


def _beside(
    several: Sequence[tuple[ClockModel, PowerUpClock]],
) -> tuple[ClockModel, tuple[PowerUpClock, ...]]:
    """Join the models of several power-ups; those without UTC follow the one before them."""
    timed = [(clock, known) for clock, known in several if clock.has_times]
    if len(timed) < 2:
        return (timed or list(several))[0][0], ()
    shifts = _shifts([known for _clock, known in timed])
    clocks = [_moved(clock, shift_ns) for (clock, _known), shift_ns in zip(timed, shifts, strict=True)]
    known = tuple(
        replace(one, start_ns=one.start_ns + shift_ns, end_ns=one.end_ns + shift_ns, shift_ns=shift_ns)
        for (_clock, one), shift_ns in zip(timed, shifts, strict=True)
    )
    first = clocks[0]
    return (
        replace(
            first,
            is_absolute=any(one.is_absolute for one in known),
            starts=np.concatenate([one.starts for one in clocks]),
            offsets_ns=np.concatenate([one.offsets_ns for one in clocks]),
            placed_index=np.concatenate([one.placed_index for one in clocks]),
            placed_ns=np.concatenate([one.placed_ns for one in clocks]),
            steps=tuple(step for one in clocks for step in one.steps),
            missing_times=sum(one.missing_times for one in clocks),
            implausible_times=sum(one.implausible_times for one in clocks),
            stray_rows=sum(one.stray_rows for one in clocks),
            is_unordered=any(one.is_unordered for one in clocks),
            stray_index=np.concatenate([one.stray_index for one in clocks]),
            stale_times=sum(one.stale_times for one in clocks),
            longest_step_ns=max(one.longest_step_ns for one in clocks),
            wraps=tuple(wrap for one in clocks for wrap in one.wraps),
        ),
        known,
    )


def _shifts(known: Sequence[PowerUpClock]) -> list[int]:
    """Return the shift of each power-up that brings those without UTC in order.

    Each stands behind the one before it, or before the first.
    """
    anchor = next((number for number, one in enumerate(known) if one.is_absolute), 0)
    shifts = [0] * len(known)
    for number in range(anchor + 1, len(known)):
        if not known[number].is_absolute:
            before_ns = known[number - 1].end_ns + shifts[number - 1]
            shifts[number] = before_ns + PAUSE_NS - known[number].start_ns
    for number in range(anchor - 1, -1, -1):
        behind_ns = known[number + 1].start_ns + shifts[number + 1]
        shifts[number] = behind_ns - PAUSE_NS - known[number].end_ns
    return shifts


def _moved(clock: ClockModel, shift_ns: int) -> ClockModel:
    if not shift_ns:
        return clock
    return replace(clock, offsets_ns=clock.offsets_ns + shift_ns, placed_ns=clock.placed_ns + shift_ns)
