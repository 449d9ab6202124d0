"""The second pass over a stream: batches of every message and sentence, raw and canonical, remarks and damages."""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import HEADING_IS_TRACK, Column, Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.readers.receiver import nmea, novatel, scan, ubx, ubx_canonical
from groundstation.readers.receiver.messages import Block, bounded, raw_batches, text_batches
from groundstation.readers.receiver.novatel_messages import INS_SOURCES
from groundstation.readers.receiver.overview import NAME, Overview, overview, remarks
from groundstation.readers.receiver.sentences import Sentences, by_address
from groundstation.readers.receiver.stream import Frames, Stream
from groundstation.readers.source import Source

_NAMES_TOLD = 5
_NEARLY_ALL = 0.99
_WITH_CHECKSUM = re.compile(rb"[$!][A-Z][A-Z0-9]{2,9},[^\r\n$*]{0,500}\*[0-9A-Fa-f]{2}")


def items(source: Source) -> Iterator[Item]:
    """Yield the header, batches in the order of the blocks of the stream, then remarks and damages.

    Raises
    ------
    UnreadableLogError
        When the stream has no frame but RTCM.
    """
    is_bare = not _WITH_CHECKSUM.search(source.head)
    found = overview(source, is_bare)
    if not found.counts:
        raise UnreadableLogError(source.name, "no message or sentence of a receiver", "", "was it cut or damaged?")
    # Messages of one epoch come late and in any order, with times some microseconds apart: no step of the clock.
    yield LogHeader(NAME, found.metadata, 0 if len(found.anchors) else None, has_counting_clock=True)
    stream, told = Stream(source, is_bare, _epoch_start_of(found)), _Told()
    for frames, sentences in found.blocks or ((frames, by_address(frames)) for frames in stream):
        yield from _of_block(frames, sentences, found, told)
    yield from remarks(found)
    if told.gnss == 0:
        yield Remark("no_position", "no position in this file: " + _what_it_has(found))
    if told.bare:
        yield Remark("no_checksum", "sentences without a checksum: a damaged number is not seen")
    yield from told.items()
    yield from found.damages if found.blocks else stream.damages()


class _Told:
    """What is counted on the way: heights that cannot be, cells that are no number."""

    def __init__(self) -> None:
        self.astray = self.gnss = self.bare = 0
        self.as_track = self.moving = 0
        self.unreadable: Counter[tuple[str, str]] = Counter()

    def items(self) -> Iterator[Item]:
        if self.moving and self.as_track >= _NEARLY_ALL * self.moving:
            text = (
                f"heading and track are the same in {self.as_track} of {self.moving} fixes above "
                f"{ubx_canonical.MOVING_MPS:g} m/s: the receiver lets the nose point along the motion, so its heading "
                "is no second measurement"
            )
            yield Remark(HEADING_IS_TRACK, text, "ins", ("true_heading_deg",))
        if self.astray:
            text = (
                f"geoid and ellipsoid are said to be over {nmea.MOST_SEPARATION_M:.0f} m apart in {self.astray} rows, "
                "which they never are: altitude_msl_m left out, their sum kept as altitude_ellipsoid_m"
            )
            yield Remark("odd_height", text, "gnss", ("altitude_ellipsoid_m",))
        for (address, name), count in sorted(self.unreadable.items()):
            topic = f"raw.{address}"
            yield Damage("unreadable_cells", f"{topic}.{name}", count, "cells that are no number", topic)


def _what_it_has(found: Overview) -> str:
    names = ", ".join(f"{name} ({count})" for name, count in found.counts.most_common(_NAMES_TOLD))
    return names + (" and others" if len(found.counts) > _NAMES_TOLD else "")


def _epoch_start_of(found: Overview) -> Callable[[Frames], int]:
    if found.leader:
        return ubx.epoch_start if found.leader in ubx_canonical.POSITION_SOURCES else novatel.epoch_start
    return lambda frames: nmea.epoch_start(frames, by_address(frames))


def _of_block(frames: Frames, sentences: dict[str, Sentences], found: Overview, told: _Told) -> Iterator[RecordBatch]:
    block = Block()
    for messages, time in ubx.timed(frames, found.anchors):
        batches = text_batches if messages.name.startswith("INF-") else raw_batches
        yield from batches(messages, time)
        block.add(messages)
    for timed in novatel.messages_of(frames):
        yield from raw_batches(timed, found.anchors.in_their_week(timed.places, timed.time()))
        block.add(timed)
    epochs = nmea.epochs_of(sentences)
    time = nmea.day_times(epochs, found.anchors)
    for address, one in sentences.items():
        yield from _raw_sentences(one, epochs.time_of(address, time), told)
    if found.leader in ubx_canonical.POSITION_SOURCES:
        gnss = ubx_canonical.gnss_batch(block, found.leader, found.anchors)
    elif found.leader:
        gnss = _in_their_week(novatel.gnss_batch(block, found.leader), found)
    else:
        gnss, astray = nmea.gnss_batch(epochs, time)
        told.astray += astray
    same, moving = ubx_canonical.heading_as_track(block, found.attitude)
    told.as_track, told.moving = told.as_track + same, told.moving + moving
    told.bare += len(frames.of(scan.BARE_NMEA))
    if gnss is not None:
        told.gnss += int(gnss.columns["latitude_deg"].mask.sum()) if "latitude_deg" in gnss.columns else 0
        yield from bounded(gnss)
    ins = _ins(block, epochs, time, found)
    if ins is not None:
        yield from bounded(ins)


def _ins(block: Block, epochs: nmea.Epochs, time: Column, found: Overview) -> RecordBatch | None:
    if not found.attitude:
        return None
    if found.attitude in nmea.HEADING_FORMATTERS:
        return nmea.ins_batch(epochs, found.attitude, time, ubx_canonical.INS_MODE)
    if found.attitude in INS_SOURCES:
        return _in_their_week(novatel.ins_batch(block, found.attitude), found)
    return ubx_canonical.ins_batch(block, found.attitude, found.anchors)


def _in_their_week(batch: RecordBatch | None, found: Overview) -> RecordBatch | None:
    """A batch whose times were made of the week that each of its messages tells."""
    if batch is None:
        return None
    time = found.anchors.in_their_week(batch.record_index, batch.device_time_ns)
    return replace(batch, device_time_ns=time)


def _raw_sentences(sentences: Sentences, time: Column, told: _Told) -> Iterator[RecordBatch]:
    columns: Mapping[str, Column] = sentences.columns
    for name, count in sentences.unreadable.items():
        told.unreadable[(sentences.address, name)] += count
    rows = None
    for column in columns.values():
        rows = column.mask if rows is None else rows | column.mask
    batch = RecordBatch(f"raw.{sentences.address}", sentences.places, time, columns)
    if rows is not None and not rows.all():
        batch = batch.take(rows)
    if len(batch):
        yield from bounded(batch)
