"""MCAP whose bus words are named by other ICDs.

It is read as the log that it came from, without the log.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from groundstation.base.records import Damage, Int64Array, Item, LogHeader, RecordBatch, Remark, UtcReadings
from groundstation.pipeline.one_flight.segments import Segment, segments_in
from groundstation.readers.chapter10.naming import NAMING_CODES, SeenWords, named
from groundstation.readers.icd import Icd
from groundstation.store.info import StoreInfo
from groundstation.store.reader import read, read_info


def items_named(path: Path, icds: Sequence[Icd]) -> Iterator[Item]:
    """Return the items of the log behind an MCAP, with other names for its bus words.

    Signals that other ICDs gave are left out; times are those of the recorder again.
    """
    info = read_info(path)
    renamed = {one["topic"] for one in info.remarks if one.get("code") == "mapped" and one.get("topic")}
    segments = segments_in(info)
    seen, utc_of_zero_ns = SeenWords(), None
    places, zeros = list[int](), list[int]()
    for item in read(path):
        if not isinstance(item, RecordBatch):
            continue
        seen.add(item)
        index, zero_ns = _zeros(item, segments) if info.has_utc else (item.record_index[:0],) * 2
        if not len(index):
            continue
        if utc_of_zero_ns is None:
            utc_of_zero_ns = int(np.sort(zero_ns)[len(zero_ns) // 2])
        places += index[[0, -1]].tolist()
        zeros += zero_ns[[0, -1]].tolist()
    readings = UtcReadings(np.array(places, np.int64), np.array(zeros, np.int64)) if zeros else None
    facts = _facts(info, renamed)
    header = LogHeader(info.reader, facts, utc_of_zero_ns, info.clock.is_counting, utc_readings=readings)
    return named(_as_recorded(path, info, header, renamed), icds, seen)


def _zeros(batch: RecordBatch, segments: Sequence[Segment]) -> tuple[Int64Array, Int64Array]:
    """Return the records that have both times, and the UTC of the recorder's zero by them.

    Records of power-ups without UTC are left out.
    """
    index, timed = batch.record_index, batch.device_time_ns.mask
    for one in segments:
        if not one.has_utc:
            timed = timed & ((index < one.first) | (index >= one.end))
    if batch.time_ns is None:
        return index[:0], index[:0]
    return index[timed], (batch.time_ns - batch.device_time_ns.values)[timed]


def _facts(info: StoreInfo, renamed: set[str]) -> Mapping[str, str]:
    dropped = tuple(f"derived.{topic}." for topic in renamed)
    return {key: value for key, value in info.metadata.items() if not key.startswith(dropped or ("\0",))}


def _as_recorded(path: Path, info: StoreInfo, header: LogHeader, renamed: set[str]) -> Iterator[Item]:
    yield header
    for item in read(path):
        if isinstance(item, RecordBatch) and item.topic not in renamed:
            order = np.argsort(item.record_index, kind="stable")
            batch = item if (np.diff(order) == 1).all() else item.take(order)
            yield replace(batch, time_ns=None, validity_time_ns=None)
        elif isinstance(item, Damage):
            yield item
    for one in info.remarks:
        if one.get("code") not in NAMING_CODES:
            yield Remark(str(one.get("code", "")), str(one.get("text", "")), str(one.get("topic", "")))
    for one in info.damages:
        between = one.get("between_records")
        yield Damage(
            str(one.get("kind", "")),
            str(one.get("place", "")),
            int(one.get("count", 0)),
            str(one.get("what", "")),
            str(one.get("topic", "")),
            bool(one.get("loses_data", True)),
            (int(between[0]), int(between[1])) if isinstance(between, list | tuple) and len(between) == 2 else None,
        )
