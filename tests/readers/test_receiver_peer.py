"""Every field of every message and sentence of the recorded receivers' streams equals that of pyubx2 and pynmeagps."""

import datetime
import logging
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.records import RecordBatch
from groundstation.readers.receiver import read
from groundstation.readers.receiver.sentences import FORMATTERS
from groundstation.readers.receiver.ubx_messages import LAYOUTS
from groundstation.readers.source import Source
from tests.real_logs import real_log

LOGS = (
    "gnss/walk_0827_gnss_1730.ubx",
    "gnss/ublox_ins_drive_pvat.ubx",
    "gnss/pygpsdata-MIXED.log",
    "gnss/pygpsdata-NMEA.log",
    "gnss/pygpsdata_testobsdata.log",
    "gnss/inertialsense_Serial38400.nmea",
)
BEGINNING_BYTES = 130_000
DEGREES = 5e-10  # pynmeagps rounds degrees of minutes to ten decimals
Row = dict[str, Any]


def by_groundstation(path: Path) -> dict[str, list[Row]]:
    """Rows of the raw topics in the order of the file, absent values left out; ``raw.X.group`` is ``X.group``."""
    found: dict[str, list[Row]] = defaultdict(list)
    for batch in read(Source(path)):
        if not isinstance(batch, RecordBatch) or not batch.topic.startswith("raw."):
            continue
        columns = {name: (column.values.tolist(), column.mask.tolist()) for name, column in batch.columns.items()}
        for at, place in enumerate(batch.record_index.tolist()):
            row = {name: values[at] for name, (values, mask) in columns.items() if mask[at]}
            found[batch.topic.removeprefix("raw.")].append(row | {"_place": place})
    return found


def by_peers(path: Path) -> Iterator[tuple[str, Any]]:
    """Messages of pyubx2 and sentences of pynmeagps in the order of the file."""
    reader = pytest.importorskip("pyubx2").UBXReader
    pytest.importorskip("pynmeagps")
    logging.disable(logging.CRITICAL)  # its complaints of what it does not know
    try:
        with path.open("rb") as stream:
            for _raw, parsed in reader(stream, protfilter=7, quitonerror=0, labelmsm=0):
                if parsed is not None and not isinstance(parsed, str):
                    yield str(parsed.identity), parsed
    finally:
        logging.disable(logging.NOTSET)


def groups_of(message: Any, names: list[str]) -> list[Row]:
    """Members of the repeated group of a message of pyubx2, whose fields it numbers."""
    rows, number = [], 1
    while any(hasattr(message, f"{name}_{number:02d}") for name in names):
        rows.append({name: getattr(message, f"{name}_{number:02d}") for name in names})
        number += 1
    return rows


def assert_message(name: str, message: Any, row: Row, groups: list[Row]) -> None:
    for field, value in row.items():
        if field != "_place":
            assert same(getattr(message, field), value), (name, field, getattr(message, field), value)
    names = [field for field in (groups[0] if groups else {}) if field != "_place"]
    theirs = groups_of(message, names)
    assert len(theirs) == len(groups), name
    for their, our in zip(theirs, groups, strict=True):
        for field in names:
            assert same(their[field], our[field]), (name, field, their[field], our[field])


def same(theirs: Any, ours: Any) -> bool:
    if isinstance(theirs, bytes):
        if isinstance(ours, str):
            return theirs.decode("latin-1").rstrip("\0") == ours.rstrip("\0")
        return int.from_bytes(theirs, "little") == ours
    return bool(theirs == ours)


def assert_sentence(name: str, sentence: Any, row: Row) -> None:
    for field in (word.split(":")[0] for word in FORMATTERS[name].split()):
        if not hasattr(sentence, field):
            assert field not in row, (name, field, row)
            continue
        theirs, ours = getattr(sentence, field), row.get(field)
        if theirs in ("", None):
            assert ours is None, (name, field, ours)
        elif isinstance(theirs, datetime.time):
            seconds = (theirs.hour * 60 + theirs.minute) * 60 + theirs.second + theirs.microsecond * 1e-6
            assert ours == pytest.approx(seconds, abs=1e-9), (name, field)
        elif isinstance(theirs, datetime.date):
            assert ours == theirs.strftime("%d%m%y"), (name, field)
        elif isinstance(theirs, str):
            assert str(ours) == theirs, (name, field)
        else:
            assert ours == pytest.approx(theirs, abs=DEGREES if field in ("lat", "lon") else 0.0), (name, field)


@pytest.mark.real_log
@pytest.mark.parametrize("name", LOGS)
def test_beginning_of_recorded_stream(name: str, tmp_path: Path) -> None:
    path = tmp_path / "stream"
    path.write_bytes(real_log(name).read_bytes()[:BEGINNING_BYTES])
    assert_equal(path)


@pytest.mark.slow
@pytest.mark.real_log
@pytest.mark.parametrize("name", LOGS)
def test_recorded_stream(name: str) -> None:
    assert_equal(real_log(name))


def assert_equal(path: Path) -> None:
    ours = by_groundstation(path)
    groups: dict[str, dict[int, list[Row]]] = {}
    for topic in [topic for topic in ours if topic.endswith(".group")]:
        heads = np.array([row["_place"] for row in ours[topic.removesuffix(".group")]])
        of_head: dict[int, list[Row]] = defaultdict(list)
        for row in ours[topic]:
            of_head[int(np.searchsorted(heads, row["_place"]) - 1)].append(row)
        groups[topic.removesuffix(".group")] = of_head
    seen: dict[str, int] = defaultdict(int)
    compared = 0
    for identity, parsed in by_peers(path):
        topic = identity
        if topic not in ours or not getattr(parsed, "payload", b"x"):  # a poll has no fields
            continue
        row, number = ours[topic][seen[topic]], seen[topic]
        seen[topic] += 1
        if topic in LAYOUTS:
            assert_message(topic, parsed, row, groups.get(topic, {}).get(number, []))
            compared += 1
        elif topic[2:] in FORMATTERS:
            assert_sentence(topic[2:], parsed, row)
            compared += 1
    assert compared > 0
    for topic, count in seen.items():
        assert count == len(ours[topic]), topic
