"""Takes a chunk out of an MCAP, its indexes and statistics mended to match or not."""

import zlib

from mcap.opcode import Opcode
from mcap.records import ChunkIndex, Footer, MetadataIndex, Statistics

from groundstation.store.framing import parse_record, read_message_index, to_bytes
from groundstation.store.marks import MAGIC
from tests.fuzz.bases import mcap_starts

PREFIX = 9


def chunk_count(data: bytes) -> int:
    """Chunks of a file."""
    return sum(data[at] == Opcode.CHUNK for at in mcap_starts(data[: -len(MAGIC)]))


def without_chunk(data: bytes, number: int, *, is_mended: bool) -> bytes:
    """The file without chunk ``number`` and the message indexes behind it.

    With ``is_mended`` chunk indexes, statistics, offsets and checksums are those of a file that never had it; else
    everything else is as it was.
    """
    starts = list(mcap_starts(data[: -len(MAGIC)]))
    spans = list(zip(starts, [*starts[1:], len(data) - len(MAGIC)], strict=True))
    first = [at for at, (start, _end) in enumerate(spans) if data[start] == Opcode.CHUNK][number]
    last = first + 1
    while data[spans[last][0]] == Opcode.MESSAGE_INDEX:
        last += 1
    begin, gone = spans[first][0], spans[last][0] - spans[first][0]
    if not is_mended:
        return data[:begin] + data[begin + gone :]
    counts: dict[int, int] = {}
    for start, end in spans[first + 1 : last]:
        index = read_message_index(data[start:end])
        assert index is not None
        counts[index[0]] = index[1]
    body, summary, is_summary = MAGIC, b"", False
    for at, (start, end) in enumerate(spans):
        if first <= at < last or data[start] in (Opcode.FOOTER, Opcode.SUMMARY_OFFSET):
            continue
        raw = data[start:end]
        record = parse_record(raw[0], raw[PREFIX:]) if is_summary else None
        if isinstance(record, ChunkIndex):
            if record.chunk_start_offset == begin:
                continue
            if record.chunk_start_offset > begin:
                record.chunk_start_offset -= gone
                record.message_index_offsets = {
                    key: place - gone for key, place in record.message_index_offsets.items()
                }
            raw = to_bytes(record)
        elif isinstance(record, MetadataIndex):
            record.offset -= gone if record.offset > begin else 0
            raw = to_bytes(record)
        elif isinstance(record, Statistics):
            record.message_count -= sum(counts.values())
            record.chunk_count -= 1
            for channel, count in counts.items():
                record.channel_message_counts[channel] -= count
            raw = to_bytes(record)
        body, summary = (body, summary + raw) if is_summary else (body + raw, summary)
        is_summary |= raw[0] == Opcode.DATA_END
    body = body[:-4] + bytes(4)  # the end of data without a checksum
    footer = to_bytes(Footer(len(body), 0, 0))
    crc = zlib.crc32(footer[:-4], zlib.crc32(summary))
    return body + summary + to_bytes(Footer(len(body), 0, crc)) + MAGIC
