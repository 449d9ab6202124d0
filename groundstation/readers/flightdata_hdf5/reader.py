"""Items of a recording: every parameter under its own name, and the canonical topics.

They come in slices of time.
"""

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import field

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import METRES_PER_DEG
from groundstation.base.records import MAX_BATCH_ROWS, Column, Damage, Int64Array, Item, LogHeader, RecordBatch, Remark
from groundstation.base.signals import RAW_PREFIX
from groundstation.base.source_units import PREFIX, units_entry
from groundstation.base.units import NS_PER_S
from groundstation.readers.flightdata_hdf5.canonical import (
    TRACK,
    WIND_FROM,
    WIND_SPEED,
    ParameterFeed,
    feeds_of,
    track_feed,
    values_at,
    wind_feeds,
)
from groundstation.readers.flightdata_hdf5.container import FAILURES, HIGHEST_RATE_HZ, Container, Parameter, opened
from groundstation.readers.layout import velocity_from_track, wind_from_direction
from groundstation.readers.parts import bounded
from groundstation.readers.places import nowhere, placed
from groundstation.readers.source import Source

SLICE_S = MAX_BATCH_ROWS / HIGHEST_RATE_HZ
SLICE_ROWS = 1 << 20  # samples of all parameters: slices with fewer are read together
SPEED = "ground_speed_mps"
_NO_TIMES = np.zeros(0, dtype=np.int64)
_ODD = re.compile(r"[^A-Za-z0-9_\-]+")


@dataclass
class _Losses:
    """Damaged parameters with the reason, and missing positions by topic."""

    broken: dict[str, str] = field(default_factory=dict)
    lost: dict[str, int] = field(default_factory=dict)
    nowhere: Counter[str] = field(default_factory=Counter)

    def add(self, name: str, reason: object, samples: int) -> None:
        self.broken.setdefault(name, " ".join(str(reason).split())[:100])
        self.lost[name] = self.lost.get(name, 0) + samples

    def damages(self) -> Iterator[Damage]:
        for name, reason in self.broken.items():
            yield Damage("corrupt", f"parameter {name}", self.lost[name], f"samples that cannot be read ({reason})")
        for topic, count in self.nowhere.items():
            yield nowhere(topic, count)


def items(source: Source, reader_name: str) -> Iterator[Item]:
    """Yield the items of a recording, one slice of time after the other."""
    with opened(source) as container:
        start = container.start_utc_s
        utc_ns = None if start is None else round(start * NS_PER_S)
        topics, losses, steps = _raw_topics(container), _Losses(), _Steps()
        units = {PREFIX + topic: units_entry({"value": one.unit}) for topic, one in topics.items() if one.unit}
        yield LogHeader(reader_name, units, utc_ns, has_counting_clock=True)
        feeds, said = feeds_of(container)
        track = track_feed(container) if any(one.field.name == SPEED for one in feeds.get("ins", ())) else None
        beside = {"ins": () if track is None else (track,), "air": wind_feeds(container)}
        next_index = 0
        for span in _slices(container.parameters):
            batches = [
                *_raw_batches(topics, span, losses),
                *_canonical_batches(feeds, beside, span, losses),
            ]
            for batch in batches:
                steps.see(batch)
            instants = np.unique(np.concatenate([_NO_TIMES, *(batch.device_time_ns.values for batch in batches)]))
            yield from (part for batch in batches for part in _numbered(batch, instants, next_index))
            next_index += len(instants)
        yield from _remarks(feeds, track, container)
        yield from (Remark("converted", text, topic) for topic, text in said)
        yield from steps.remarks()
        if container.missing_bytes:
            yield Damage("truncated", f"byte {source.size}", container.missing_bytes, "bytes cut off")
        for place in container.mended:
            yield Damage("corrupt", f"byte {place}", 1, "heap of text without an end")
        for refused in container.refused:
            yield Damage("dropped_channel", f"parameter {refused.name}", 1, f"parameter with {refused.reason}")
        yield from losses.damages()


def _raw_topics(container: Container) -> dict[str, Parameter]:
    """Parameters by their topic, ``raw.<name>``; a name that clashes gets a number."""
    topics: dict[str, Parameter] = {}
    for parameter in container.parameters:
        base = topic = RAW_PREFIX + (_ODD.sub("_", parameter.name).strip("_") or "_")
        copy = 1
        while topic in topics:
            copy += 1
            topic = f"{base}_{copy}"
        topics[topic] = parameter
    return topics


Span = tuple[int, int]  # of time: nanoseconds since the start, end exclusive


def _slices(parameters: Sequence[Parameter]) -> list[Span]:
    """Spans of time that are read one after the other, as long as ``SLICE_ROWS`` allow."""
    end_s = max(one.offset_s + one.samples / one.frequency_hz for one in parameters)
    edges_s = SLICE_S * np.arange(math.floor(end_s / SLICE_S) + 2)
    rows = np.zeros(len(edges_s) - 1)
    for one in parameters:
        rows += np.diff(np.clip((edges_s - one.offset_s) * one.frequency_hz, 0, one.samples))
    spans, start, held = list[Span](), 0, 0.0
    for number, here in enumerate(rows):
        if held + here > SLICE_ROWS and number > start:
            spans.append((_slice_ns(start), _slice_ns(number)))
            start, held = number, 0.0
        held += here
    return [*spans, (_slice_ns(start), _slice_ns(len(rows)))]


def _slice_ns(number: int) -> int:
    return number * round(SLICE_S * NS_PER_S)


def _times_in(parameter: Parameter, span: Span) -> tuple[int, int]:
    """First and last number (exclusive) of the samples within a span of time."""
    return parameter.first_from(span[0]), parameter.first_from(span[1])


def _raw_batches(topics: dict[str, Parameter], span: Span, losses: _Losses) -> Iterator[RecordBatch]:
    for topic, parameter in topics.items():
        first, last = _times_in(parameter, span)
        if last <= first:
            continue
        try:
            samples = parameter.read(first, last)
        except FAILURES as error:
            losses.add(parameter.name, error, last - first)
            continue
        if samples.lost:
            losses.add(parameter.name, samples.reason, samples.lost)
        times_ns = parameter.times_ns(first, last)
        batch = _batch(topic, times_ns, {"value": Column(samples.values, samples.is_valid)})
        if batch is not None:
            yield batch


def _canonical_batches(
    feeds: dict[str, tuple[ParameterFeed, ...]],
    beside: dict[str, tuple[ParameterFeed, ...]],
    span: Span,
    losses: _Losses,
) -> Iterator[RecordBatch]:
    for topic, several in feeds.items():
        leader = several[0].parameter
        times_ns = leader.times_ns(*_times_in(leader, span))
        columns: dict[str, Column] = {}
        for feed in (*several, *beside.get(topic, ())):
            try:
                values, present = values_at(feed, times_ns)
            except FAILURES as error:
                losses.add(feed.parameter.name, error, 0)
                continue
            is_flag = feed.field.kind == "bool"
            columns[feed.field.name] = Column(values != 0.0 if is_flag else values, present)
        _with_velocities(columns)
        _with_wind(columns)
        known, zeros = placed(topic, columns)
        if len(zeros):
            losses.nowhere[topic] += len(zeros)
            clocks = {(one.parameter.offset_s, one.parameter.frequency_hz) for one in several}
            columns = known | (_apart(columns, known) if len(clocks) > 1 and "latitude_deg" in known else {})
        batch = _batch(topic, times_ns, columns)
        if batch is not None:
            yield batch


def _apart(columns: dict[str, Column], placed: dict[str, Column]) -> dict[str, Column]:
    """Drop positions next to a row of zeros, which were interpolated from it."""
    is_zero = columns["latitude_deg"].mask & ~placed["latitude_deg"].mask
    beside = np.append(False, is_zero[:-1]) | np.append(is_zero[1:], False)
    names = ("latitude_deg", "longitude_deg")
    return {name: Column(placed[name].values, placed[name].mask & ~beside) for name in names}


def _with_velocities(columns: dict[str, Column]) -> None:
    """Replace the track by velocities, as ``ins`` has no field for it."""
    track, speed = columns.pop("track_deg", None), columns.get(SPEED)
    if track is None or speed is None:
        return
    present = track.mask & speed.mask
    north, east = velocity_from_track(track.values, speed.values)
    columns["velocity_north_mps"], columns["velocity_east_mps"] = Column(north, present), Column(east, present)


def _with_wind(columns: dict[str, Column]) -> None:
    """Replace direction and speed of the wind by its velocity."""
    direction, speed = columns.pop(WIND_FROM.name, None), columns.pop(WIND_SPEED.name, None)
    if direction is None or speed is None:
        return
    present = direction.mask & speed.mask
    north, east = wind_from_direction(direction.values, speed.values)
    columns["wind_north_mps"], columns["wind_east_mps"] = Column(north, present), Column(east, present)


def _batch(topic: str, times_ns: Int64Array, columns: dict[str, Column]) -> RecordBatch | None:
    """Rows that have any value; None where there is none."""
    if not columns or not len(times_ns):
        return None
    rows = np.logical_or.reduce([column.mask for column in columns.values()])
    if not rows.any():
        return None
    kept = {name: column.take(rows) for name, column in columns.items()}
    return RecordBatch(topic, np.zeros(int(rows.sum()), dtype=np.int64), Column(times_ns[rows]), kept)


def _numbered(batch: RecordBatch, instants: Int64Array, next_index: int) -> Iterator[RecordBatch]:
    """Yield a batch, in parts that are not too long, with its places in the source.

    Instants are numbered in order of time.
    """
    index = next_index + np.searchsorted(instants, batch.device_time_ns.values).astype(np.int64)
    yield from bounded(RecordBatch(batch.topic, index, batch.device_time_ns, batch.columns))


@dataclass
class _Steps:
    """The smallest step of the recorded latitude: how finely positions are written."""

    smallest_deg: float = math.inf

    def see(self, batch: RecordBatch) -> None:
        if batch.topic != "ins" or "latitude_deg" not in batch.columns:
            return
        column = batch.columns["latitude_deg"]
        steps = np.abs(np.diff(column.values[column.mask]))
        if (steps > 1e-9).any():
            self.smallest_deg = min(self.smallest_deg, float(steps[steps > 1e-9].min()))

    def remarks(self) -> Iterator[Remark]:
        if 1e-5 < self.smallest_deg < 1.0:
            north_m = self.smallest_deg * METRES_PER_DEG
            text = f"positions are written in steps of {self.smallest_deg:.8f} deg, {north_m:.0f} m of latitude"
            yield Remark("quantised", text, "ins", ("latitude_deg", "longitude_deg"))


def _remarks(
    feeds: dict[str, tuple[ParameterFeed, ...]], track: ParameterFeed | None, container: Container
) -> Iterator[Remark]:
    mapped = "; ".join(
        f"{topic} from {', '.join(one.parameter.name for one in several)}" for topic, several in feeds.items()
    )
    if mapped:
        yield Remark("mapped", mapped)
    for topic, several in feeds.items():
        leader = several[0].parameter
        moved = [one.parameter.name for one in several[1:] if one.parameter.offset_s != leader.offset_s]
        if moved:
            text = f"{', '.join(moved)} brought to the times of {leader.name}, between neighbouring samples"
            yield Remark("converted", f"{text}; as recorded in {RAW_PREFIX}*", topic)
    if track is not None:
        text = f"velocities from Groundspeed and {TRACK}, which is heading plus drift: no track apart from the heading"
        yield Remark("derived", text, "ins", ("velocity_north_mps", "velocity_east_mps"))
    derived = [parameter.name for parameter in container.parameters if parameter.is_derived]
    if derived:
        yield Remark("derived", f"computed by the ground software, not recorded: {', '.join(sorted(derived))}")
    if any(one.parameter.name in ("Heading", "Heading Continuous") for one in feeds.get("ins", ())):
        yield Remark("mapped", "Heading without a further word is taken as magnetic", "ins", ("magnetic_heading_deg",))
