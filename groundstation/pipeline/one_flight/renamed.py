"""An MCAP whose bus words are named by other ICDs: it is read as the log that it came from, without the log."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from groundstation.base.records import Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.readers.chapter10.naming import NAMING_CODES, Seen, named
from groundstation.readers.icd import Icd
from groundstation.store.info import StoreInfo
from groundstation.store.reader import read, read_info


def items_named(path: Path, icds: Sequence[Icd]) -> Iterator[Item]:
    """Items of the log that an MCAP was made of, its bus words named anew.

    Signals that other ICDs gave are left out; times are those of the recorder again.
    """
    info = read_info(path)
    renamed = {one["topic"] for one in info.remarks if one.get("code") == "mapped" and one.get("topic")}
    seen, utc_of_zero_ns = Seen(), None
    for item in read(path):
        if isinstance(item, RecordBatch):
            seen.add(item)
            if info.has_utc and utc_of_zero_ns is None:
                utc_of_zero_ns = _utc_of_zero(item)
    header = LogHeader(info.reader, _facts(info, renamed), utc_of_zero_ns, info.clock.is_counting)
    return named(_as_recorded(path, info, header, renamed), icds, seen)


def _utc_of_zero(batch: RecordBatch) -> int | None:
    """UTC of the recorder's zero, by records that have both times."""
    timed = batch.device_time_ns.mask
    if batch.time_ns is None or not timed.any():
        return None
    zeros = (batch.time_ns - batch.device_time_ns.values)[timed]
    return int(np.sort(zeros)[len(zeros) // 2])


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
