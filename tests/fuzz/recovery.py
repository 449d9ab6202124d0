"""Of the records that no edit touched, the share that each reader gives: ``python -m tests.fuzz.recovery [N]``.

A record is one of topic and time. It is untouched when its own bytes stand together in the mutated file, and so do the
bytes of a definition of it (of an MCAP: its whole chunk, as the checksum is the chunk's). What is expected comes from
walkers of the sound file that are written here, apart from the readers.
"""

import contextlib
import io
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.base.records import RecordBatch
from tests.fuzz import recovery_streams as streams
from tests.fuzz.bases import Base, bases, chapter10_starts, line_starts, mcap_starts, ulog_starts
from tests.fuzz.mutation import Mutant
from tests.fuzz.trial import Case, edits_of, suffix_of

LIMIT_S = 20
Key = tuple[str, Any]
Found = Counter  # of keys


@dataclass(frozen=True, eq=False)
class Expected:
    """Records of a sound file: place, key, and the definitions any one of each group of which must be kept."""

    starts: np.ndarray
    ends: np.ndarray
    keys: list[Key]
    definitions: list[int]  # number of the record's group
    groups: list[list[tuple[int, int]]]  # spans, each of which must be kept; an MCAP has two such lists of each

    def untouched(self, mutant: Mutant) -> Found:
        """Keys of the records that are whole and defined."""
        sound = np.array([all(mutant.is_kept(*span) for span in group) for group in self.groups])
        kept = mutant.kept(self.starts, self.ends) & sound[np.array(self.definitions, dtype=np.int64)]
        return Counter(key for key, is_kept in zip(self.keys, kept, strict=True) if is_kept)


def _expected(rows: list[tuple[int, int, Key, int]], groups: list[list[tuple[int, int]]]) -> Expected:
    starts, ends, keys, numbers = zip(*rows, strict=True)
    return Expected(np.array(starts), np.array(ends), list(keys), list(numbers), groups)


def of_ulog(data: bytes) -> Expected:
    """Data messages by topic, instance and time; defined by the flags, formats and their subscription."""
    spans = [(at, at + 3 + int.from_bytes(data[at : at + 2], "little")) for at in ulog_starts(data)]
    formats = {data[at + 3 : end].partition(b":")[0].decode(): (at, end) for at, end in spans if data[at + 2] == 70}
    groups: list[list[tuple[int, int]]] = []
    subscribed: dict[int, tuple[str, int]] = {}
    rows = []
    for at, end in spans:
        body = data[at + 3 : end]
        if data[at + 2] == ord("A"):
            name = body[3:].decode()
            nested = [span for other, span in formats.items() if other.encode() in data[slice(*formats[name])]]
            subscribed[body[1] | body[2] << 8] = (f"{name}.{body[0]}", len(groups))
            groups.append([(at, end), formats[name], *nested])
        elif data[at + 2] == ord("D") and end <= len(data):
            topic, group = subscribed[body[0] | body[1] << 8]
            rows.append((at, end, (topic, int.from_bytes(body[2:10], "little")), group))
    return _expected(rows, groups)


def of_dataflash(data: bytes) -> Expected:
    """Records by type and time; defined by their FMT record."""
    types: dict[int, tuple[str, int, int, int]] = {128: ("FMT", 89, 0, 0)}
    groups: list[list[tuple[int, int]]] = [[]]
    rows, at = [], 0
    while at + 3 <= len(data) and data[at : at + 2] == b"\xa3\x95":
        name, length, unit_us, group = types[data[at + 2]]
        if at + length > len(data):
            break
        if name == "FMT":
            new_name, columns = data[at + 5 : at + 9].rstrip(b"\0").decode(), data[at + 25 : at + 89]
            # Old types of the satellites' or another clock hold no time of the autopilot there.
            other_clock = new_name.startswith(("GPS", "ACC", "GYR"))
            microseconds = columns.startswith(b"TimeUS,") and data[at + 9 : at + 10] == b"Q"
            milliseconds = columns.startswith(b"TimeMS,") and data[at + 9 : at + 10] == b"I" and not other_clock
            unit_us = 1 if microseconds else 1000 if milliseconds else 0
            types[data[at + 3]] = (new_name, data[at + 4], unit_us, len(groups))
            groups.append([(at, at + length)])
        elif unit_us:
            time = int.from_bytes(data[at + 3 : at + (11 if unit_us == 1 else 7)], "little")
            rows.append((at, at + length, (name, time * unit_us), group))
        at += length
    return _expected(rows, groups)


def of_chapter10(data: bytes) -> Expected:
    """1553 messages and ARINC 429 words by channel and counter, each with the span of its packet: all or none."""
    rows = []
    for at in chapter10_starts(data):
        channel, length = (int.from_bytes(data[at + place : at + place + 2], "little") for place in (2, 4))
        end = at + (length | int.from_bytes(data[at + 6 : at + 8], "little") << 16)
        first, kind = int.from_bytes(data[at + 16 : at + 22], "little"), data[at + 15]
        if end <= len(data) and kind in (0x19, 0x38) and not data[at + 14] & 0x80:
            body = data[at + 24 : at + 24 + int.from_bytes(data[at + 8 : at + 12], "little")]
            times = _times_1553(body) if kind == 0x19 else _times_429(body, first)
            rows += [(at, end, (f"{'1553' if kind == 0x19 else '429'}.{channel}", time), 0) for time in times]
    return _expected(rows, [[]])


def _times_1553(body: bytes) -> Iterator[int]:
    at = 4
    for _message in range(int.from_bytes(body[:3], "little")):
        if at + 14 > len(body):
            return
        yield int.from_bytes(body[at : at + 6], "little")
        at += 14 + int.from_bytes(body[at + 12 : at + 14], "little")


def _times_429(body: bytes, first: int) -> Iterator[int]:
    time = first
    for number in range(int.from_bytes(body[:2], "little")):
        head = int.from_bytes(body[4 + 8 * number : 8 + 8 * number], "little")
        time += head & 0xFFFFF
        yield time


def of_mcap(data: bytes) -> Expected:
    """Messages by topic and time, each with the span of its chunk; defined at the start or in the summary."""
    from mcap.stream_reader import StreamReader, breakup_chunk

    topics: dict[int, str] = {}
    spans = [(at, at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")) for at in mcap_starts(data)]
    chunks = iter([span for span in spans if data[span[0]] == 6])
    rows = []
    for record in StreamReader(io.BytesIO(data), emit_chunks=True).records:
        if type(record).__name__ == "Channel":
            topics[record.id] = record.topic
        elif type(record).__name__ == "Chunk":
            at, end = next(chunks)
            for message in breakup_chunk(record):
                if type(message).__name__ == "Message" and not topics[message.channel_id].startswith(
                    ("location_fix.", "pose.", "log")
                ):
                    rows.append((at, end, (topics[message.channel_id], message.log_time), 0))
    return _expected(rows, [[]])


def _lines(base: Base, header_lines: int, time_of: Callable[[list[bytes]], Any]) -> Expected:
    starts = list(line_starts(base.data))
    ends = [*starts[1:], len(base.data)]
    rows = []
    for at, end in list(zip(starts, ends, strict=True))[header_lines:]:
        time = time_of(base.data[at:end].split(b","))
        if time is not None:
            # A line is touched, too, when the line end before it is: then it is the end of another line.
            rows.append((at - 1, end, ("row", time), 0))
    header = starts[header_lines - 1], ends[header_lines - 1]
    return _expected(rows, [[header]])


def _csv_ms(cells: list[bytes]) -> int | None:
    return round(float(cells[0]) * 1000)


def _g1000_s(cells: list[bytes]) -> int | None:
    if not cells[0].strip() or len(cells[1].strip()) != 8:
        return None
    hours, minutes, seconds = (int(part) for part in cells[1].split(b":"))
    sign, offset = (-1 if b"-" in cells[2] else 1), cells[2].strip().lstrip(b"+-").split(b":")
    return (hours * 3600 + minutes * 60 + seconds - sign * (int(offset[0]) * 3600 + int(offset[1]) * 60)) % 86_400


def _items(path: Path) -> Iterator[RecordBatch]:
    from groundstation.pipeline.one_flight.log import open_log

    for item in open_log(path).items():
        if isinstance(item, RecordBatch):
            yield item


def our_ulog(path: Path, found: Found) -> None:
    for batch in _items(path):
        name = batch.topic.removeprefix("raw.")
        if batch.topic.startswith("raw.") and not name.startswith("ulog."):
            stem, _, number = name.rpartition(".")
            topic = name if stem and number.isdecimal() else f"{name}.0"
            found.update((topic, time // 1000) for time in batch.device_time_ns.values.tolist())


def our_dataflash(path: Path, found: Found) -> None:
    for batch in _items(path):
        if batch.topic.startswith("raw."):
            name = batch.topic.split(".")[1]
            found.update((name, time // 1000) for time in batch.device_time_ns.values.tolist())


def our_chapter10(path: Path, found: Found) -> None:
    for batch in _items(path):
        if batch.topic.startswith("raw.bus."):
            name = batch.topic.removeprefix("raw.bus.")
            found.update((name, time // 100) for time in batch.device_time_ns.values.tolist())


def our_mcap(path: Path, found: Found) -> None:
    for batch in _items(path):
        times = batch.device_time_ns.values if batch.time_ns is None else batch.time_ns  # taken for another format
        found.update((batch.topic, time) for time in times.tolist())


def _our_rows(path: Path, found: Found, key: Callable[[int], int]) -> None:
    rows: dict[int, int] = {}
    for batch in _items(path):
        present = batch.device_time_ns.mask.tolist()
        times = batch.device_time_ns.values.tolist()
        for index, time, is_there in zip(batch.record_index.tolist(), times, present, strict=True):
            if is_there:
                rows[index] = key(time)
    found.update(("row", time) for time in rows.values())


def our_csv(path: Path, found: Found) -> None:
    _our_rows(path, found, lambda ns: ns // 1_000_000)


def our_g1000(path: Path, found: Found) -> None:
    _our_rows(path, found, lambda ns: ns // 10**9 % 86_400)


def by_pyulog(path: Path, found: Found) -> None:
    import pyulog

    for data in pyulog.ULog(str(path)).data_list:
        found.update((f"{data.name}.{data.multi_id}", int(time)) for time in data.data["timestamp"])


def by_pymavlink(path: Path, found: Found) -> None:
    from pymavlink.DFReader import DFReader_binary

    with contextlib.closing(DFReader_binary(str(path))) as reader:
        while (message := reader.recv_msg()) is not None:
            fields = message.to_dict()
            time_us = fields.get("TimeUS", 1000 * fields.get("TimeMS", 0))
            found[message.get_type(), time_us] += 1


def by_pychapter10(path: Path, found: Found) -> None:
    from chapter10 import C10

    for packet in C10(str(path)):
        if packet.data_type == 0x19:
            for message in packet:
                found[f"1553.{packet.channel_id}", message.ipts & 0xFFFFFFFFFFFF] += 1
        elif packet.data_type == 0x38:
            time = packet.rtc
            for message in packet:
                time += message.gap_time
                found[f"429.{packet.channel_id}", time] += 1


def by_acranetwork(path: Path, found: Found) -> None:
    from AcraNetwork.IRIG106.Chapter10.FileParser import FileParser
    from AcraNetwork.IRIG106.Chapter11 import Chapter11
    from AcraNetwork.IRIG106.Chapter11.ARINC429 import ARINC429DataPacket
    from AcraNetwork.IRIG106.Chapter11.MILSTD1553 import MILSTD1553DataPacket

    with FileParser(str(path)) as file:
        for content in file:
            packet = Chapter11()
            packet.unpack(content)
            payload = packet.payload[: packet.datalen]
            if packet.datatype == 0x19:
                body = MILSTD1553DataPacket()
                body.unpack(payload)
                found.update((f"1553.{packet.channelID}", message.ipts.count) for message in body)
            elif packet.datatype == 0x38:
                body, time = ARINC429DataPacket(), packet.relativetimecounter
                body.unpack(payload)
                for word in body:
                    time += word.gaptime
                    found[f"429.{packet.channelID}", time] += 1


def by_mcap_seeking(path: Path, found: Found) -> None:
    from mcap.reader import make_reader

    with path.open("rb") as file:
        for _schema, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False):
            found[channel.topic, message.log_time] += 1


def by_mcap_stream(path: Path, found: Found) -> None:
    from mcap.stream_reader import StreamReader

    topics: dict[int, str] = {}
    with path.open("rb") as file:
        for record in StreamReader(file, validate_crcs=True).records:
            if type(record).__name__ == "Channel":
                topics[record.id] = record.topic
            elif type(record).__name__ == "Message":
                found[topics.get(record.channel_id, ""), record.log_time] += 1


def _by_pandas(path: Path, found: Found, key: Callable[[list[bytes]], Any]) -> None:
    import pandas

    table = pandas.read_csv(path, skiprows=2, on_bad_lines="skip", encoding_errors="replace", dtype=str)
    for cells in table.iloc[:, :3].fillna("").itertuples(index=False):
        with contextlib.suppress(ValueError, IndexError):
            found["row", key([cell.encode() for cell in cells])] += 1


def by_pandas_csv(path: Path, found: Found) -> None:
    _by_pandas(path, found, _csv_ms)


def by_pandas_g1000(path: Path, found: Found) -> None:
    _by_pandas(path, found, _g1000_s)


def _ours(count: Callable[[Iterator[RecordBatch], Found], None]) -> Callable[[Path, Found], None]:
    return lambda path, found: count(_items(path), found)


READERS: dict[str, dict[str, Callable[[Path, Found], None]]] = {
    "flat-csv": {"groundstation": our_csv, "pandas (bad lines skipped)": by_pandas_csv},
    "csv-profile": {"groundstation": our_g1000, "pandas (bad lines skipped)": by_pandas_g1000},
    "ulog": {"groundstation": our_ulog, "pyulog": by_pyulog},
    "dataflash": {"groundstation": our_dataflash, "pymavlink": by_pymavlink},
    "chapter10": {"groundstation": our_chapter10, "pychapter10": by_pychapter10, "AcraNetwork": by_acranetwork},
    "mcap": {"groundstation": our_mcap, "mcap make_reader": by_mcap_seeking, "mcap StreamReader": by_mcap_stream},
    "ubx": {"groundstation": _ours(streams.by_column("iTOW")), "pyubx2": streams.by_pyubx2},
    "nmea": {"groundstation": _ours(streams.by_column("time", scale=1e3)), "pynmeagps": streams.by_pynmeagps},
    "tlog": {"groundstation": _ours(streams.by_column("time_boot_ms", "time_usec"))},
    "robot-mcap": {"groundstation": _ours(streams.by_time)},
    "ros1": {"groundstation": _ours(streams.by_time)},
}
STREAMS = {
    "ubx": streams.of_ubx,
    "nmea": streams.of_nmea,
    "tlog": streams.of_tlog,
    "robot-mcap": streams.of_robot_mcap,
    "ros1": streams.of_ros1,
}


def expected_of(base: Base) -> Expected | None:
    """Records of a base; None where it is not measured."""
    if base.format in STREAMS:
        rows = STREAMS[base.format](base.data)
        return _expected(rows, [[]]) if rows else None
    if base.format == "ulog":
        return of_ulog(base.data)
    if base.format == "dataflash":
        return of_dataflash(base.data)
    if base.format == "chapter10":
        return of_chapter10(base.data)
    if base.format == "mcap":
        return of_mcap(base.data)
    if base.format == "flat-csv":
        return _lines(base, 3, _csv_ms) if base.name == "flat-csv-written-1" else None
    if "thor" in base.name:
        return None
    return _lines(base, 3, _g1000_s)


def _too_long(_signal: int, _frame: Any) -> None:
    raise TimeoutError


def _give(read: Callable[[Path, Found], None], path: Path) -> tuple[Found, str]:
    """What a reader gives before it ends or fails, and how it ended."""
    found: Found = Counter()
    signal.alarm(LIMIT_S)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            read(path, found)
    except GroundstationError:
        return found, "refused"
    except TimeoutError:
        return found, "hang"
    except BaseException as error:  # a peer's: whatever it raises is counted
        if isinstance(error, KeyboardInterrupt):
            raise
        return found, "exception"
    finally:
        signal.alarm(0)
    return found, ""


def measure(format_name: str, cases: int, first: int = 1_000_000) -> dict[str, Any]:
    """Totals over mutated logs of a format."""
    expected = {base.name: expected_of(base) for base in bases(format_name)}
    readers = READERS[format_name]
    total, files = 0, 0
    got, ends = Counter[str](), {name: Counter[str]() for name in readers}
    whole: Counter[str] = Counter()
    missed: list[tuple[int, int, int]] = []
    seed = first
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"log{suffix_of(format_name)}"
        while files < cases:
            base, other, edits = edits_of(Case(format_name, seed))
            seed += 1
            known = expected[base.name]
            if known is None:
                continue
            mutant = Mutant(base.data, other.data, edits)
            path.write_bytes(mutant.content)
            untouched = known.untouched(mutant)
            files += 1
            total += untouched.total()
            for name, read in readers.items():
                found, end = _give(read, path)
                hits = (untouched & found).total()
                got[name] += hits
                whole[name] += hits == untouched.total()
                ends[name][end or "read"] += 1
                if name == "groundstation" and hits < untouched.total():
                    missed.append((seed - 1, untouched.total() - hits, untouched.total()))
    missed.sort(key=lambda entry: -entry[1])
    return {"files": files, "records": total, "got": got, "whole": whole, "ends": ends, "missed": missed}


def main() -> None:
    """Print a table; the seeds that lost most are listed behind it."""
    cases = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    signal.signal(signal.SIGALRM, _too_long)
    for format_name in sys.argv[2:] or READERS:
        found = measure(format_name, cases)
        for name in READERS[format_name]:
            share = found["got"][name] / max(1, found["records"])
            print(
                f"{format_name:12} {name:28} {found['files']} files, {found['records']} untouched records: "
                f"{share:.4%} given; all of them in {found['whole'][name]} files; {dict(found['ends'][name])}",
                flush=True,
            )
        print("   missed most (seed, missed, untouched):", found["missed"][:8], flush=True)


if __name__ == "__main__":
    main()
