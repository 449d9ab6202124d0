"""Words of the buses as raw topics, one for each channel.

Every bit stays, so that an ICD can name them afterwards.

``raw.bus.1553.<channel>`` has a record for each message: ``block_status`` and ``gap_times`` as recorded,
``word_count``, and the message's words, command words first, four in a number of 64 bits, the first in its lowest 16:
``words_00`` has the words 0 to 3, ``words_32`` 32 to 35. ``raw.bus.429.<channel>`` has a record for each word: ``word``
with bit 1 as its lowest, ``sub_channel`` (number of the bus, from 1, as in TMATS), ``flags`` (4 format error, 2 parity
error, 1 high-speed bus). The place of a record is that of its bytes in the file.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import MAX_BATCH_ROWS, BoolArray, Column, Int64Array, RecordBatch
from groundstation.base.signals import BUS_PREFIX
from groundstation.readers.chapter10 import scan
from groundstation.readers.chapter10.packets import NS_PER_COUNT, PacketBlock

TOPIC_1553, TOPIC_429 = f"{BUS_PREFIX}1553.", f"{BUS_PREFIX}429."
MOST_WORDS = 36  # two commands, 32 data words, two statuses
_PER_NUMBER = 4
PACKS = tuple(f"words_{at:02d}" for at in range(0, MOST_WORDS, _PER_NUMBER))
_HEAD_BYTES, _WORD_BYTES = 14, 8

# Bits of the block status word of a 1553 message. Source: IRIG 106-22 Chapter 11, 11.2.4.1.
BUS_B, MESSAGE_ERROR, FORMAT_ERROR, TIME_OUT = 0x2000, 0x1000, 0x0400, 0x0200
WORD_COUNT_ERROR, SYNC_ERROR, WORD_ERROR = 0x0020, 0x0010, 0x0008
ANY_ERROR = MESSAGE_ERROR | FORMAT_ERROR | TIME_OUT | WORD_COUNT_ERROR | SYNC_ERROR | WORD_ERROR


def bounded(batch: RecordBatch) -> Iterator[RecordBatch]:
    """Yield a batch in pieces that are not too long."""
    for start in range(0, len(batch), MAX_BATCH_ROWS):
        yield batch if len(batch) <= MAX_BATCH_ROWS else batch.take(slice(start, start + MAX_BATCH_ROWS))


def messages_1553(block: PacketBlock, channel: int, packets: Int64Array) -> tuple[RecordBatch, int]:
    """Return the messages of a channel in a block, and how many its packets lack.

    The number lacking is by the count that the packets state.
    """
    room = int(np.maximum(packets[:, scan.BODY_END] - packets[:, scan.BODY], 0).sum()) // _HEAD_BYTES
    places, times = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
    heads, words = np.empty((room, 3), dtype=np.uint16), np.zeros((room, MOST_WORDS), dtype=np.uint16)
    lost = np.zeros(len(packets), dtype=np.int64)
    count = scan.messages_1553(block.data, packets, places, times, heads, words.view(np.uint8), lost)
    packs = words[:count].view("<u8")
    word_count = (heads[:count, 2] // 2).astype(np.uint16)
    columns = {
        "block_status": Column(heads[:count, 0].copy()),
        "gap_times": Column(heads[:count, 1].copy()),
        "word_count": Column(word_count),
    }
    for number, name in enumerate(PACKS):
        present: BoolArray = word_count > number * _PER_NUMBER
        if present.any():
            columns[name] = Column(packs[:, number].copy(), None if present.all() else present)
    return _batch(f"{TOPIC_1553}{channel}", block, places[:count], times[:count], columns), int(lost.sum())


def words_429(block: PacketBlock, channel: int, packets: Int64Array) -> tuple[RecordBatch, int]:
    """Return the words of a channel in a block, and how many its packets lack.

    The number lacking is by the count that the packets state.
    """
    room = int(np.maximum(packets[:, scan.BODY_END] - packets[:, scan.BODY], 0).sum()) // _WORD_BYTES
    places, times = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
    heads, words = np.empty(room, dtype=np.uint32), np.empty(room, dtype=np.uint32)
    lost = np.zeros(len(packets), dtype=np.int64)
    count = scan.words_429(block.data, packets, places, times, heads, words, lost)
    heads = heads[:count]
    columns = {
        "sub_channel": Column((heads >> 24).astype(np.uint16) + np.uint16(1)),
        "word": Column(words[:count]),
        "flags": Column((heads >> 21 & 7).astype(np.uint8)),
    }
    return _batch(f"{TOPIC_429}{channel}", block, places[:count], times[:count], columns), int(lost.sum())


def _batch(
    topic: str, block: PacketBlock, places: Int64Array, times: Int64Array, columns: dict[str, Column]
) -> RecordBatch:
    return RecordBatch(topic, places + block.base, Column(times * NS_PER_COUNT), columns)


def words_of(batch: RecordBatch) -> NDArray[np.uint16]:
    """Words of the messages of a raw batch, shape (n, 36); zero behind a message's last word."""
    packs = np.zeros((len(batch), len(PACKS)), dtype="<u8")
    for number, name in enumerate(PACKS):
        column = batch.columns.get(name)
        if column is not None:
            packs[:, number] = column.values if column.present is None else np.where(column.present, column.values, 0)
    return packs.view("<u2")
