"""What :mod:`tests.fuzz.recovery` expects of receivers' streams, telemetry logs and bags, and how it is found again."""

import io
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from groundstation.base.records import RecordBatch
from tests.fuzz.bases import line_starts, mcap_starts, ros1_starts

Found = Counter  # of keys
Row = tuple[int, int, tuple[str, Any], int]  # start, end, key, group of definitions

UBX_NAMES = {  # class and id of the messages that begin with the time of week
    b"\x01\x04": "NAV-DOP",
    b"\x01\x05": "NAV-ATT",
    b"\x01\x07": "NAV-PVT",
    b"\x01\x17": "NAV-PVAT",
    b"\x01\x35": "NAV-SAT",
    b"\x10\x10": "ESF-STATUS",
}
NMEA_TIMED = ("GGA", "RMC", "ZDA")
MAVLINK_TIMED = {24: ("GPS_RAW_INT", 8), 30: ("ATTITUDE", 4), 33: ("GLOBAL_POSITION_INT", 4)}  # name, bytes of the time


def of_ubx(data: bytes) -> list[Row]:
    """Messages with a time of week, by name and that."""
    rows, at = [], 0
    while (at := data.find(b"\xb5\x62", at)) >= 0:
        end = at + 8 + int.from_bytes(data[at + 4 : at + 6], "little")
        if end > len(data) or _fletcher(data[at + 2 : end - 2]) != data[end - 2 : end]:
            at += 2
            continue
        if name := UBX_NAMES.get(data[at + 2 : at + 4]):
            rows.append((at, end, (name, int.from_bytes(data[at + 6 : at + 10], "little")), 0))
        at = end
    return rows


def _fletcher(body: bytes) -> bytes:
    first = second = 0
    for one in body:
        first = (first + one) & 0xFF
        second = (second + first) & 0xFF
    return bytes((first, second))


def of_nmea(data: bytes) -> list[Row]:
    """Sentences with a time of day, by name and milliseconds."""
    rows = []
    for at in line_starts(data):
        line = data[at : data.find(b"\n", at) if data.find(b"\n", at) >= 0 else len(data)].rstrip()
        name, *fields = line.split(b",")
        if name[:1] == b"$" and name[3:].decode("latin1") in NMEA_TIMED and fields[0]:
            rows.append((at, at + len(line), (name[1:].decode(), _milliseconds(fields[0])), 0))
    return rows


def _milliseconds(text: bytes) -> int:
    return round(1e3 * (3600 * int(text[:2]) + 60 * int(text[2:4]) + float(text[4:])))


def of_tlog(data: bytes) -> list[Row]:
    """Frames of MAVLink 2 with the time stamp before them, by message and time since boot."""
    rows, at = [], 0
    while at + 20 <= len(data) and data[at + 8] == 0xFD:
        length, body = data[at + 9], at + 18
        end = body + length + 2 + (13 if data[at + 10] & 1 else 0)
        if end <= len(data) and (known := MAVLINK_TIMED.get(int.from_bytes(data[at + 15 : at + 18], "little"))):
            name, width = known
            rows.append((at, end, (name, int.from_bytes(data[body : body + length][:width], "little")), 0))
        at = end
    return rows


def of_robot_mcap(data: bytes) -> list[Row]:
    """Messages by topic and time, each with the span of its chunk."""
    from mcap.exceptions import EndOfFile
    from mcap.stream_reader import StreamReader, breakup_chunk

    def records() -> Iterator[Any]:
        with suppress(EndOfFile):  # the beginning of a longer file
            yield from StreamReader(io.BytesIO(data), emit_chunks=True).records

    spans = [(at, at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")) for at in mcap_starts(data)]
    chunks = iter([span for span in spans if data[span[0]] == 6])
    topics: dict[int, str] = {}
    rows = []
    for record in records():
        for one in breakup_chunk(record) if type(record).__name__ == "Chunk" else [record]:
            if type(one).__name__ == "Channel":
                topics[one.id] = one.topic.strip("/")
        if type(record).__name__ == "Chunk":
            at, end = next(chunks)
            messages = [one for one in breakup_chunk(record) if type(one).__name__ == "Message"]
            rows += [(at, end, (topics[one.channel_id], one.log_time), 0) for one in messages]
    return rows


def of_ros1(data: bytes) -> list[Row]:
    """Messages by topic and time, each with the span of its chunk."""
    import lz4.frame

    topics: dict[int, str] = {}
    rows = []
    for at in ros1_starts(data):
        header, body, end = _ros1_record(data, at)
        if header.get("op") != b"\x05":
            continue
        body, inner = lz4.frame.decompress(body) if header["compression"] == b"lz4" else body, 0
        while inner < len(body):
            one, _content, inner = _ros1_record(body, inner)
            if one["op"] == b"\x07":
                topics[int.from_bytes(one["conn"], "little")] = one["topic"].decode().strip("/")
            elif one["op"] == b"\x02":
                seconds, rest = struct.unpack("<II", one["time"])
                topic = topics[int.from_bytes(one["conn"], "little")]
                rows.append((at, end, (topic, seconds * 10**9 + rest), 0))
    return rows


def _ros1_record(data: bytes, at: int) -> tuple[dict[str, bytes], bytes, int]:
    """Fields of a record's header, its content, and where it ends."""
    size = int.from_bytes(data[at : at + 4], "little")
    fields, place = {}, at + 4
    while place < at + 4 + size:
        length = int.from_bytes(data[place : place + 4], "little")
        name, _, value = data[place + 4 : place + 4 + length].partition(b"=")
        fields[name.decode("latin1")] = value
        place += 4 + length
    length = int.from_bytes(data[place : place + 4], "little")
    return fields, data[place + 4 : place + 4 + length], place + 4 + length


def by_column(*columns: str, scale: float = 1.0) -> Callable[[Iterator[RecordBatch], Found], None]:
    """A reader's rows by topic and the first of these columns that they have."""

    def count(batches: Iterator[RecordBatch], found: Found) -> None:
        for batch in batches:
            name = next((one for one in columns if one in batch.columns), None)
            if batch.topic.startswith("raw.") and name:
                topic, values = batch.topic.removeprefix("raw."), batch.columns[name].values
                found.update((topic, round(scale * value)) for value in values.tolist() if value == value)

    return count


def by_time(batches: Iterator[RecordBatch], found: Found) -> None:
    """A reader's rows by topic and time of the recorder."""
    for batch in batches:
        if batch.topic.startswith("raw."):
            topic = batch.topic.removeprefix("raw.")
            found.update((topic, time) for time in batch.device_time_ns.values.tolist())


def by_pyubx2(path: Path, found: Found) -> None:
    """The peer's messages."""
    from pyubx2 import ERR_IGNORE, UBX_PROTOCOL, UBXReader

    with path.open("rb") as stream:
        for _raw, one in UBXReader(stream, protfilter=UBX_PROTOCOL, quitonerror=ERR_IGNORE):
            if one is not None and hasattr(one, "iTOW"):
                found[one.identity, one.iTOW] += 1


def by_pynmeagps(path: Path, found: Found) -> None:
    """The peer's sentences."""
    from pynmeagps import ERR_IGNORE, NMEAReader

    with path.open("rb") as stream:
        for _raw, one in NMEAReader(stream, quitonerror=ERR_IGNORE):
            at = getattr(one, "time", None)
            if at:
                ms = round(1e3 * (3600 * at.hour + 60 * at.minute + at.second) + at.microsecond / 1e3)
                found[one.talker + one.msgID, ms] += 1
