"""First pass over a recording: TMATS, time packets, and dates on the buses.

Dates on the buses are read where the time packets lack the year.
"""

from collections import Counter
from dataclasses import field, replace
from datetime import date

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.readers.chapter10 import scan
from groundstation.readers.chapter10.bus_words import TOPIC_429, TOPIC_1553
from groundstation.readers.chapter10.kinds import ARINC_429, MIL_STD_1553, TIME, TMATS
from groundstation.readers.chapter10.naming import SeenWords
from groundstation.readers.chapter10.packets import NS_PER_COUNT, PacketBlock, PacketWalk
from groundstation.readers.chapter10.timing import Reading, dates_in, reading
from groundstation.readers.chapter10.tmats import Tmats, parse
from groundstation.readers.source import Source

_ENOUGH_DATES = 8
_WORD_BYTES = 8


@dataclass
class RecordingOverview:
    """Facts that must be known before the first record is yielded."""

    tmats: Tmats = field(default_factory=Tmats)
    readings: list[Reading] = field(default_factory=list)
    dates: Counter[date] = field(default_factory=Counter)
    seen: SeenWords = field(default_factory=SeenWords)


def overview(source: Source, *, with_buses: bool) -> RecordingOverview:
    """Read a recording once.

    Several TMATS packets in a row are one text. Reading what is on the buses (``with_buses``) takes longer.
    """
    found, texts, is_setup = RecordingOverview(), [], True
    for block in PacketWalk(source):
        for packet in block.of(TMATS) if is_setup else ():
            texts.append(block.body(packet))
        is_setup = is_setup and bool(np.isin(block.packets[:, scan.TYPE], (TMATS, 0)).all() or not texts)
        for packet in block.of(TIME):
            told = reading(
                int(packet[scan.CHANNEL]),
                int(packet[scan.RTC]) * NS_PER_COUNT,
                block.specific_word(packet),
                block.body(packet),
            )
            found.readings += [replace(told, place=block.base + int(packet[scan.AT]))] if told else []
        if found.dates.total() < _ENOUGH_DATES and not (found.readings and found.readings[0].year):
            found.dates += _dates(block)
        for kind, channel, packets in block.by_channel() if with_buses else ():
            if kind == MIL_STD_1553:
                scan.see_1553(block.data, packets, found.seen.of(f"{TOPIC_1553}{channel}"))
            elif kind == ARINC_429:
                scan.see_429(block.data, packets, found.seen.of(f"{TOPIC_429}{channel}"))
    found.tmats = parse(b"".join(texts))
    return found


def _dates(block: PacketBlock) -> Counter[date]:
    """Count the dates in ARINC-429 words with label 260."""
    found: Counter[date] = Counter()
    for packet in block.of(ARINC_429):
        whole = max(0, packet[scan.BODY_END] - packet[scan.BODY]) // _WORD_BYTES
        body = block.data[packet[scan.BODY] :][: whole * _WORD_BYTES].reshape(whole, _WORD_BYTES)
        found += dates_in(np.ascontiguousarray(body[:, 4:]).view("<u4")[:, 0])
    return found
