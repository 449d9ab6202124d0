"""Second pass over a stream: batches of messages and sentences, remarks and damage.

Batches are raw, and canonical where a rule serves them.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Column, Item, LogHeader, RecordBatch
from groundstation.readers.receiver import (
    host_text,
    host_times,
    nmea,
    nmea_canonical,
    novatel,
    novatel_inertial,
    scan,
    ubx,
    ubx_canonical,
    ubx_inertial,
)
from groundstation.readers.receiver.messages import MessagesByName, bounded, raw_batches, text_batches
from groundstation.readers.receiver.novatel_messages import INS_SOURCES
from groundstation.readers.receiver.overview import NAME, StreamOverview, overview, remarks
from groundstation.readers.receiver.sentences import Sentences, by_address
from groundstation.readers.receiver.stream import Frames, Stream
from groundstation.readers.receiver.tally import StreamTally
from groundstation.readers.source import Source

_WITH_CHECKSUM = re.compile(rb"[$!][A-Z][A-Z0-9]{2,29},[^\r\n$*]{0,500}\*[0-9A-Fa-f]{2}")


def items(source: Source) -> Iterator[Item]:
    """Yield the header, batches in the order of the blocks of the stream, remarks and damage.

    Raises
    ------
    UnreadableLogError
        When the stream has no frame but RTCM.
    """
    is_bare, host = not _WITH_CHECKSUM.search(source.head), host_text.find(source.head)
    found = overview(source, is_bare, host)
    if not found.counts:
        raise UnreadableLogError(source.name, "no message or sentence of a receiver", "", "was it cut or damaged?")
    # Messages of one epoch come late and in any order, with times some microseconds apart: no step of the clock.
    yield LogHeader(NAME, found.metadata, 0 if found.is_absolute else None, has_counting_clock=True)
    stream, tally = Stream(source, is_bare, _epoch_start_of(found), host.accepts if host else None), StreamTally()
    days, counter = nmea.DayTimes(found.anchors), ubx_inertial.CounterClock()
    for frames, sentences in found.blocks or ((frames, by_address(frames)) for frames in stream):
        yield from _of_block(frames, sentences, found, days, counter, tally)
    yield from remarks(found)
    yield from tally.items(found.counts)
    yield from found.damages if found.blocks else stream.damages()


def _epoch_start_of(found: StreamOverview) -> Callable[[Frames], int]:
    if found.leader in ubx_canonical.POSITION_SOURCES:
        return lambda frames: ubx.epoch_start(frames, found.leader)
    if found.leader:
        return novatel.epoch_start
    return lambda frames: nmea.epoch_start(frames, by_address(frames), found.choice)


def _of_block(
    frames: Frames,
    sentences: dict[str, Sentences],
    found: StreamOverview,
    days: nmea.DayTimes,
    counter: ubx_inertial.CounterClock,
    tally: StreamTally,
) -> Iterator[RecordBatch]:
    block = MessagesByName()
    for messages, time in ubx.timed(frames, found.anchors):
        batches = text_batches if messages.name.startswith("INF-") else raw_batches
        yield from batches(messages, time)
        block.add(messages)
        tally.add_lengths(messages, is_poll=messages.size == 0)
    for timed in novatel.messages_of(frames):
        yield from raw_batches(timed, found.anchors.in_their_week(timed.places, timed.time()))
        block.add(timed)
        tally.add_lengths(timed, is_poll=False)
    epochs = nmea.epochs_of(sentences, found.choice, found.arrivals)
    time = days.of(epochs)
    for address, one in sentences.items():
        yield from _raw_sentences(one, epochs.time_of(address, time))
        tally.add_cells(one)
    host = host_times.raw_batch(frames, epochs, time)
    if host is not None:
        yield from bounded(host)
    tally.bare += len(frames.of(scan.BARE_NMEA))
    if found.leader in ubx_canonical.POSITION_SOURCES:
        gnss = ubx_canonical.gnss_batch(block, found.leader, found.anchors, tally)
    elif found.leader:
        gnss = _in_their_week(novatel.gnss_batch(block, found.leader, tally), found)
    else:
        gnss = nmea_canonical.gnss_batch(epochs, time, tally)
    tally.add_headings(*ubx_canonical.heading_as_track(block, found.attitude))
    if gnss is not None:
        tally.add_fixes(gnss)
        yield from bounded(gnss)
    inertial = ubx_inertial.imu_batch(block, found.sensors, counter, found.anchors) if found.sensors else None
    if inertial is not None:
        yield from bounded(inertial)
    increments = novatel_inertial.imu_batch(block, found.inertial) if found.inertial else None
    if increments is not None:
        yield from bounded(_in_their_week(increments, found) or increments)
    ins = _ins(block, epochs, time, found, tally)
    if ins is not None:
        yield from bounded(ins)


def _ins(
    block: MessagesByName, epochs: nmea.SentenceEpochs, time: Column, found: StreamOverview, tally: StreamTally
) -> RecordBatch | None:
    if not found.attitude:
        return None
    if found.heading_address:
        return nmea_canonical.ins_batch(epochs, found.heading_address, time, ubx_canonical.INS_MODE, tally)
    if found.attitude in INS_SOURCES:
        return _in_their_week(novatel.ins_batch(block, found.attitude, tally), found)
    return ubx_canonical.ins_batch(block, found.attitude, found.anchors, tally)


def _in_their_week(batch: RecordBatch | None, found: StreamOverview) -> RecordBatch | None:
    """Correct a batch whose times were made of the week that each message states."""
    if batch is None:
        return None
    time = found.anchors.in_their_week(batch.record_index, batch.device_time_ns)
    return replace(batch, device_time_ns=time)


def _raw_sentences(sentences: Sentences, time: Column) -> Iterator[RecordBatch]:
    columns: Mapping[str, Column] = sentences.columns
    rows = None
    for column in columns.values():
        rows = column.mask if rows is None else rows | column.mask
    batch = RecordBatch(f"raw.{sentences.address}", sentences.places, time, columns)
    if rows is not None and not rows.all():
        batch = batch.take(rows)
    if len(batch):
        yield from bounded(batch)
