"""The first pass over a stream: full times, which messages there are, and which of them lead."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from groundstation.base.records import Damage, Int64Array, Remark
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.readers.receiver import nmea, novatel, novatel_messages, scan, ubx
from groundstation.readers.receiver.dating import Told, dated
from groundstation.readers.receiver.messages import Block, Messages
from groundstation.readers.receiver.sentences import FORMATTERS, Sentences, by_address
from groundstation.readers.receiver.stream import Frames, Stream
from groundstation.readers.receiver.times import Anchors
from groundstation.readers.receiver.ubx_canonical import ATTITUDE_SOURCES, POSITION_SOURCES, has_attitude
from groundstation.readers.source import Source

NAME = "receiver"
_VERSION = "MON-VER"
MOST_BLOCKS_KEPT = 1


@dataclass
class Overview:
    """What a stream holds.

    Parameters
    ----------
    counts : Counter of str
        Messages, sentences and frames of RTCM by name.
    anchors : Anchors
        Full times.
    leader : str
        UBX message that leads the rows of ``gnss``; empty: sentences give them.
    attitude : str
        Message or formatter that gives ``ins``; empty where none does.
    blocks : list of Frames and their sentences
        Those of a stream that is one block: they need not be looked for again. Empty for a longer one.
    damages : tuple of Damage
        What belongs to no frame of such a stream.
    """

    counts: Counter[str] = field(default_factory=Counter)
    anchors: Anchors = field(default_factory=lambda: ubx.FullTimes().anchors())
    leader: str = ""
    attitude: str = ""
    metadata: dict[str, str] = field(default_factory=dict)
    remarks: list[Remark] = field(default_factory=list)
    rtcm: Counter[int] = field(default_factory=Counter)
    blocks: list[tuple[Frames, dict[str, Sentences]]] = field(default_factory=list)
    damages: tuple[Damage, ...] = ()


def overview(source: Source, bare: bool) -> Overview:
    """Walk through a stream once."""
    found, full_times, attitudes = Overview(), ubx.FullTimes(), Counter[str]()
    places, utc_ns = [], []
    stream = Stream(source, bare)
    for frames in stream:
        block = Block()
        for messages in ubx.messages_of(frames):
            found.counts[messages.name] += len(messages)
            full_times.take(messages)
            block.add(messages)
        for timed in novatel.messages_of(frames):
            found.counts[timed.name] += len(timed)
            full_times.take_time(timed.places, timed.time())
            full_times.note_utc_offset(timed)
        attitudes.update(name for name in ATTITUDE_SOURCES if has_attitude(block, name))
        if _VERSION in block and not found.metadata:
            found.metadata = _versions(block[_VERSION])
        sentences = by_address(frames)
        for one in sentences.values():
            found.counts[one.address] += len(one)
        found.blocks.append((frames, sentences))
        del found.blocks[1 + MOST_BLOCKS_KEPT :]
        told = nmea.full_times(sentences)
        places.append(told[0])
        utc_ns.append(told[1])
        found.rtcm.update(_rtcm_numbers(frames))
    if len(found.blocks) > MOST_BLOCKS_KEPT:
        found.blocks.clear()
    else:
        found.damages = tuple(stream.damages())
    _choose(found, attitudes)
    _set_times(found, full_times, np.concatenate([*places, _NOTHING]), np.concatenate([*utc_ns, _NOTHING]), source)
    return found


_NOTHING: Int64Array = np.zeros(0, dtype=np.int64)


def _choose(found: Overview, attitudes: Counter[str]) -> None:
    leaders = (*POSITION_SOURCES, *novatel_messages.POSITION_SOURCES)
    found.leader = next((name for name in leaders if found.counts[name]), "")
    found.attitude = next((name for name in ATTITUDE_SOURCES if attitudes[name]), "")
    if not found.attitude:
        found.attitude = next((name for name in novatel_messages.INS_SOURCES if found.counts[name]), "")
    formatters = {_formatter(name) for name in found.counts}
    if not found.attitude:
        found.attitude = next((name for name in nmea.HEADING_FORMATTERS if name in formatters), "")
    if found.attitude:
        found.metadata["ins_kind"] = "gnss_aided"


def _formatter(name: str) -> str:
    return name if name in FORMATTERS else name[2:]


def _set_times(
    found: Overview, full_times: ubx.FullTimes, places: Int64Array, utc_ns: Int64Array, source: Source
) -> None:
    """Note the full times of a stream, and what is odd about them."""
    order = np.argsort(places, kind="stable")
    told = Told(
        of_week=full_times.anchors(),
        of_day=Anchors(places[order], utc_ns[order], np.full(len(places), -1, dtype=np.int64)),
        leaps=full_times.leaps,
        wrong_leaps=full_times.wrong_leaps,
        head=source.head,
        hardware=found.metadata.get("receiver.hwVersion", ""),
    )
    times = dated(told)
    found.anchors = times.anchors
    found.remarks += times.remarks


def _versions(messages: Messages) -> dict[str, str]:
    """Firmware, hardware and extensions of MON-VER; of several the last."""
    assert messages.layout is not None
    head = messages.layout.head.columns(messages.head(), messages.size)
    facts = {"receiver": "u-blox"}
    facts |= {f"receiver.{name}": str(column.values[-1]).split("\0")[0] for name, column in head.items()}
    if messages.layout.group is not None:
        records, owner, _places = messages.group()
        texts = [
            record.split(b"\0")[0].decode("latin-1") for record in records["extension"][owner == len(messages) - 1]
        ]
        facts["receiver.extensions"] = ", ".join(text for text in texts if text)
    return {name: text for name, text in facts.items() if text}


def _rtcm_numbers(frames: Frames) -> Iterator[int]:
    """Message number of each RTCM frame: the first twelve bits behind the header."""
    at = frames.offsets[frames.of(scan.RTCM)]
    bytes_ = frames.bytes_at(at + 3, 2).astype(np.int64)
    yield from (bytes_[:, 0] << 4 | bytes_[:, 1] >> 4).tolist()


def remarks(found: Overview) -> Iterator[Remark]:
    """What serves as what, and what was passed over."""
    yield from found.remarks
    if found.leader:
        added = _ADDED.get(found.leader, ("NAV-DOP", "NAV-VELNED", "NAV-STATUS"))
        others = ", ".join(name for name in added if found.counts[name])
        text = f"gnss from {found.leader}" + (f" with {others} of the same epoch" if others else "")
        sentences = sorted({_formatter(name) for name in found.counts} & {"GGA", "RMC", "GNS", "GLL"})
        text += f"; the sentences of the same receiver ({', '.join(sentences)}) stay raw" if sentences else ""
        yield Remark("mapped", text, "gnss")
    if found.attitude:
        yield Remark("mapped", f"ins from {found.attitude}: {_ATTITUDE_SENSE[found.attitude]}", "ins", ("mode",))
    if found.rtcm:
        numbers = ", ".join(f"{number}: {count}" for number, count in sorted(found.rtcm.items()))
        yield Remark("skipped", f"{found.rtcm.total()} frames of RTCM 3 are not read (by message {numbers})")
    if len(found.anchors):
        first, last = int(found.anchors.utc_ns[0]), int(found.anchors.utc_ns[-1])
        if last - first < -NS_PER_S:
            yield Remark(
                "clock_disagrees",
                f"the receiver's clock goes from {utc_ns_to_iso(first)} back to {utc_ns_to_iso(last)}",
            )


_ADDED = dict.fromkeys(("NAV-PVT", "NAV-PVAT"), ("NAV-DOP", "NAV-HPPOSLLH")) | {
    name: (velocity, "PSRDOP") for name, velocity in novatel_messages.VELOCITY_OF.items()
}
_FUSED = (
    "the receiver's own filter of GNSS and inertial sensors (gnss_aided); its position and velocity are those of gnss"
)
_TWO_ANTENNAS = (
    "heading of the line from one antenna to the other, true heading of the vehicle where that line points forward "
    "(gnss_aided)"
)
_ATTITUDE_SENSE = {
    "NAV-PVAT": _FUSED,
    "NAV-ATT": _FUSED,
    "NAV-PVT": _FUSED,
    "NAV-RELPOSNED": _TWO_ANTENNAS,
    "PASHR": _FUSED,
    **dict.fromkeys(
        ("INSPVAX", "INSPVA", "INSPVAS", "INSATT", "INSATTS"),
        "the receiver's own filter of GNSS and inertial sensors (gnss_aided)",
    ),
    **dict.fromkeys(("DUALANTENNAHEADING", "HEADING2", "HEADING"), _TWO_ANTENNAS),
    "HDT": "true heading as the receiver or compass tells it (gnss_aided)",
    "THS": "true heading as the receiver or compass tells it (gnss_aided)",
    "HDM": "magnetic heading as the receiver or compass tells it",
}
