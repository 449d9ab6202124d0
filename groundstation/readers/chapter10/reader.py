"""Read a recording: an overview, then what every channel holds, then what was found.

Channels are read block by block.
"""

from collections.abc import Iterator, Sequence

from groundstation.base.records import Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.base.signals import BUS_PREFIX, without_icd
from groundstation.readers.chapter10.bus_words import bounded, messages_1553, words_429
from groundstation.readers.chapter10.kinds import ARINC_429, EVENT, MIL_STD_1553
from groundstation.readers.chapter10.naming import NO_ICD, named
from groundstation.readers.chapter10.overview import RecordingOverview, overview
from groundstation.readers.chapter10.packets import PacketBlock, PacketWalk
from groundstation.readers.chapter10.payloads import batch_of
from groundstation.readers.chapter10.timing import start_of
from groundstation.readers.chapter10.tmats import Tmats
from groundstation.readers.icd import Icd
from groundstation.readers.source import Source

READER = "chapter10"
_FACTS = {
    "tmats.programme": r"G\\PN",
    "tmats.test_item": r"G\\TA",
    "tmats.origin_date": r"G\\OD",
    "tmats.comment": r"G\\COM",
}


def items(source: Source, icds: Sequence[Icd] = ()) -> Iterator[Item]:
    """Yield the header, batches in the order of the blocks of the file, remarks and damage.

    Each batch of bus words is followed by the signals that ``icds`` find in it.
    """
    found = overview(source, with_buses=bool(icds))
    told = _recorded(source, found, is_named=bool(icds))
    return named(told, icds, found.seen) if icds else told


def _recorded(source: Source, found: RecordingOverview, *, is_named: bool) -> Iterator[Item]:
    start = start_of(found.readings, found.dates, found.tmats)
    facts = metadata(found.tmats)
    yield LogHeader(READER, facts, start.utc_of_zero_ns, has_counting_clock=True, utc_readings=start.readings)
    walk, lost, buses = PacketWalk(source), dict[str, int](), dict[str, None]()
    for block in walk:
        for batch in _batches(block, found.tmats, lost):
            if batch.topic.startswith(BUS_PREFIX):
                buses[batch.topic] = None
            yield from bounded(batch)
    yield from start.remarks
    if buses and not is_named:
        yield Remark(NO_ICD, without_icd(len(buses)))
    yield from walk.tally.remarks(found.tmats)
    yield from walk.damages()
    for topic, count in lost.items():
        what = "messages that packets say they hold and that are not in them"
        yield Damage("corrupt", topic, count, what, topic)


def metadata(tmats: Tmats) -> dict[str, str]:
    """Return facts for the header: the recording's subject, and each channel's bus name."""
    facts = {key: value for key, pattern in _FACTS.items() if (value := tmats.get(pattern))}
    if facts.get("tmats.test_item"):
        facts["aircraft"] = facts["tmats.test_item"]
    for number, channel in sorted(tmats.channels.items()):
        names = [f"{sub_channel}={name}" for sub_channel, name in sorted(channel.sub_channels.items())]
        if channel.bus or names:
            facts[f"bus.{number}"] = channel.bus or "; ".join(names)
        if channel.pcm:
            facts[f"pcm.{number}"] = "; ".join(f"{code}={value}" for code, value in channel.pcm.items())
    return facts


def _batches(block: PacketBlock, tmats: Tmats, lost: dict[str, int]) -> Iterator[RecordBatch]:
    """Yield the batches of a block, channel by channel.

    A topic's records are in the order of the file.
    """
    for kind, channel, packets in block.by_channel():
        if kind in (MIL_STD_1553, ARINC_429):
            batch, missing = (messages_1553 if kind == MIL_STD_1553 else words_429)(block, channel, packets)
            if missing:
                lost[batch.topic] = lost.get(batch.topic, 0) + missing
        elif kind != EVENT:
            found = batch_of(block, kind, channel, packets, tmats)
            if found is None:
                continue
            batch = found
        else:
            continue
        if len(batch):
            yield batch
    events = batch_of(block, EVENT, 0, block.of(EVENT), tmats)
    if events is not None:
        yield events
