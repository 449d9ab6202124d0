"""First pass over a stream: full times, the messages there are, and which of them lead."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import field

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage, Int64Array, Remark
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.readers.imu import POINT_SAMPLES
from groundstation.readers.receiver import nmea, novatel, novatel_inertial, novatel_messages, scan, ubx, ubx_inertial
from groundstation.readers.receiver.dating import DateFacts, dated
from groundstation.readers.receiver.host_text import HostText
from groundstation.readers.receiver.host_times import HostTimes
from groundstation.readers.receiver.host_times import remarks as host_remarks
from groundstation.readers.receiver.messages import Messages, MessagesByName
from groundstation.readers.receiver.nmea_canonical import HEADING_FORMATTERS, has_heading
from groundstation.readers.receiver.sentence_layouts import FORMATTERS, MAKERS_POSITIONS, RECEIVERS, STANDARD_POSITIONS
from groundstation.readers.receiver.sentences import Sentences, by_address, formatter_of
from groundstation.readers.receiver.stream import Frames, Stream
from groundstation.readers.receiver.times import Anchors
from groundstation.readers.receiver.ubx_canonical import (
    ATTITUDE_SOURCES,
    OTHER_SOLUTIONS,
    POSITION_SOURCES,
    has_attitude,
)
from groundstation.readers.source import Source

NAME = "receiver"
_VERSION = "MON-VER"
MOST_BLOCKS_KEPT = 1


@dataclass
class StreamOverview:
    """Contents of a stream, by the first pass over it.

    Parameters
    ----------
    counts : Counter of str
        Messages, sentences and frames of RTCM by name.
    anchors : Anchors
        Full times.
    leader : str
        Binary message that leads the rows of ``gnss``; empty: sentences give them.
    choice : Choice
        Which sentences do.
    attitude : str
        Message or formatter that gives ``ins``; empty where none does.
    heading_address : str
        Address of the sentences that do; empty where a binary message does.
    inertial : str
        Message of NovAtel that gives ``imu``; empty where none does.
    sensors : str
        Message of u-blox that does; empty where none does.
    imu_types : Counter of int
        Its units by the type that the messages state.
    arrivals : Anchors, optional
        Times of arrival by the clock of the computer that recorded, where the stream tells no time.
    is_absolute : bool
        Whether times are UTC.
    blocks : list of Frames and their sentences
        Those of a stream that is one block: they need not be looked for again. Empty for a longer one.
    damages : tuple of Damage
        What belongs to no frame of such a stream.
    """

    counts: Counter[str] = field(default_factory=Counter)
    anchors: Anchors = field(default_factory=lambda: ubx.FullTimes().anchors())
    leader: str = ""
    choice: nmea.Choice = nmea.ALL
    attitude: str = ""
    heading_address: str = ""
    inertial: str = ""
    sensors: str = ""
    imu_types: Counter[int] = field(default_factory=Counter)
    arrivals: Anchors | None = None
    is_absolute: bool = False
    metadata: dict[str, str] = field(default_factory=dict)
    remarks: list[Remark] = field(default_factory=list)
    rtcm: Counter[int] = field(default_factory=Counter)
    blocks: list[tuple[Frames, dict[str, Sentences]]] = field(default_factory=list)
    damages: tuple[Damage, ...] = ()


def overview(source: Source, bare: bool, host: HostText | None = None) -> StreamOverview:
    """Read a stream once; ``host`` is the form of a computer's text in it."""
    found, full_times, attitudes, sound = StreamOverview(), ubx.FullTimes(), Counter[str](), set[str]()
    samples = Counter[str]()
    places, utc_ns = [], []
    stream = Stream(source, bare, is_hosts=host.accepts if host else None)
    host_clock = HostTimes(host) if host else None
    for frames in stream:
        block = MessagesByName()
        for messages in ubx.messages_of(frames):
            found.counts[messages.name] += len(messages)
            if messages.is_sound:
                full_times.take(messages)
                sound.add(messages.name)
            block.add(messages)
        for timed in novatel.messages_of(frames):
            found.counts[timed.name] += len(timed)
            sound |= {timed.name} if timed.is_sound else set()
            if timed.is_sound and timed.name in novatel_inertial.SOURCES:
                found.imu_types.update(timed.head()["imu_type"].tolist())
            full_times.take_time(timed.places, timed.time())
            full_times.note_utc_offset(timed)
        attitudes.update(name for name in ATTITUDE_SOURCES if has_attitude(block, name))
        for name in ubx_inertial.SOURCES:
            samples[name] += ubx_inertial.samples_in(block, name)
        if _VERSION in block and not found.metadata:
            found.metadata = _versions(block[_VERSION])
        sentences = by_address(frames)
        for one in sentences.values():
            found.counts[one.address] += len(one)
            attitudes[one.address] += len(one) if attitudes[one.address] or has_heading(one) else 0
        if host_clock is not None:
            host_clock.take(frames, nmea.epochs_of(sentences))
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
    found.sensors = max(samples, key=lambda name: samples[name]) if samples.total() else ""
    _choose(found, attitudes, sound)
    _set_times(found, full_times, np.concatenate([*places, _NOTHING]), np.concatenate([*utc_ns, _NOTHING]), source)
    if host_clock is not None:
        _take_hosts(found, host_clock)
    return found


_NOTHING: Int64Array = np.zeros(0, dtype=np.int64)


def _choose(found: StreamOverview, attitudes: Counter[str], sound: set[str]) -> None:
    """Choose the sources of ``gnss`` and ``ins``, for the whole stream.

    Of several the first in the order of the tables counts.
    """
    leaders = (*POSITION_SOURCES, *novatel_messages.POSITION_SOURCES)
    found.leader = next((name for name in leaders if name in sound), "")
    found.inertial = max(novatel_inertial.SOURCES, key=lambda name: found.counts[name] if name in sound else 0)
    found.inertial = found.inertial if found.inertial in sound else ""
    found.choice = _choice_of(found.counts)
    found.attitude = next((name for name in ATTITUDE_SOURCES if attitudes[name]), "")
    if not found.attitude:
        found.attitude = next((name for name in novatel_messages.INS_SOURCES if name in sound), "")
    if not found.attitude:
        for formatter in HEADING_FORMATTERS:
            told = sorted((-count, name) for name, count in attitudes.items() if formatter_of(name) == formatter)
            if told and told[0][0]:
                found.attitude, found.heading_address = formatter, told[0][1]
                break
    if found.attitude:
        found.metadata["ins_kind"] = "gnss_aided"


def _choice_of(counts: Counter[str]) -> nmea.Choice:
    """Choose the sentences that give ``gnss``, by the addresses of a stream."""
    positions = {name for name in counts if formatter_of(name) in STANDARD_POSITIONS}
    if not positions:
        return nmea.Choice(maker=next((name for name in MAKERS_POSITIONS if counts[name]), ""))
    if not any(name.startswith(RECEIVERS) for name in positions):
        return nmea.ALL
    others = {name for name in counts if formatter_of(name) in FORMATTERS and not name.startswith(("P", *RECEIVERS))}
    return nmea.Choice(passed_over=frozenset(others))


def _set_times(
    found: StreamOverview, full_times: ubx.FullTimes, places: Int64Array, utc_ns: Int64Array, source: Source
) -> None:
    """Note the full times of a stream, and what is odd about them."""
    order = np.argsort(places, kind="stable")
    told = DateFacts(
        of_week=full_times.anchors(),
        of_day=Anchors(places[order], utc_ns[order], np.full(len(places), -1, dtype=np.int64)),
        leaps=full_times.leaps,
        wrong_leaps=full_times.wrong_leaps,
        head=source.head,
        hardware=found.metadata.get("receiver.hwVersion", ""),
    )
    times = dated(told)
    found.anchors = times.anchors
    found.is_absolute = bool(len(found.anchors))
    found.remarks += times.remarks


def _take_hosts(found: StreamOverview, host_clock: HostTimes) -> None:
    """Take the date, or times of arrival, from the computer's clock.

    Only where the stream states none.
    """
    served = None if len(found.anchors) else host_clock.serve()
    if served is not None:
        found.arrivals, found.is_absolute = served.arrivals, served.is_absolute
        if served.dates is not None:
            found.anchors, found.is_absolute = served.dates, True
    found.remarks += host_remarks(host_clock.host, host_clock.lines, served)


def _versions(messages: Messages) -> dict[str, str]:
    """Return firmware, hardware and extensions of the last MON-VER."""
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


def remarks(found: StreamOverview) -> Iterator[Remark]:
    """Yield remarks on what serves each topic, and what was passed over."""
    yield from found.remarks
    yield from _gnss_remarks(found)
    if found.attitude:
        yield Remark("mapped", f"ins from {found.attitude}: {_ATTITUDE_SENSE[found.attitude]}", "ins", ("mode",))
    yield from _inertial_remarks(found)
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


def _inertial_remarks(found: StreamOverview) -> Iterator[Remark]:
    """Yield remarks on what serves ``imu``, and on inertial messages that cannot."""
    if found.sensors:
        text = "measurements along the receiver's own axes, timed by its counter"
        yield Remark("mapped", f"imu from {found.sensors}: {text}; {POINT_SAMPLES}", "imu")
    for name in ubx_inertial.SOURCES:
        if found.counts[name] and name != found.sensors:
            why = f"{found.sensors} has more samples of the sensors" if found.sensors else _UNTIMED[name]
            yield Remark("skipped", f"{name} ({found.counts[name]}) stays raw: {why}", f"raw.{name}")
    if found.inertial:
        yield from _unit_remarks(found)
    for name, why in _NO_INERTIAL.items():
        if found.counts[name]:
            yield Remark("skipped", f"{name} ({found.counts[name]}) stays raw: {why}", f"raw.{name}")


def _unit_remarks(found: StreamOverview) -> Iterator[Remark]:
    """Yield remarks on the units whose counts serve ``imu``, and on those that cannot."""
    scales = novatel_inertial.SCALES
    known = [scales[kind].name for kind in sorted(found.imu_types) if kind in scales]
    if known:
        text = "increments along its own axes (forward y, right x, down -z), not turned into the vehicle"
        yield Remark("mapped", f"imu from {found.inertial} of {', '.join(known)}: {text}", "imu")
    for kind, count in sorted(found.imu_types.items()):
        if kind not in scales:
            yield Remark(
                "skipped", f"{found.inertial} ({count}) of a unit of type {kind}, whose scale is not known here"
            )


_WITHOUT_GRAVITY = "it is without gravity and the earth's rotation, which are no specific force and no rate"
_COUNTS_ALONE = "counts whose scale is that of the unit, which the message does not tell (RAWIMUX does)"
_NO_INERTIAL = {
    **dict.fromkeys(("CORRIMUDATA", "CORRIMUDATAS"), _WITHOUT_GRAVITY),
    **dict.fromkeys(novatel_inertial.UNSCALED, _COUNTS_ALONE),
}
_UNTIMED = {
    "ESF-MEAS": "it has no inertial data",
    "ESF-RAW": "it has no inertial data, or no milliseconds that tell their time",
}


def _gnss_remarks(found: StreamOverview) -> Iterator[Remark]:
    """Yield remarks on the source of ``gnss``, and on other solutions of the receiver.

    The others would look like a second receiver.
    """
    if found.leader:
        others = ", ".join(name for name in _added_to(found.leader) if found.counts[name])
        text = f"gnss from {found.leader}" + (f" with {others} of the same epoch" if others else "")
        sentences = sorted({formatter_of(name) for name in found.counts} & {*STANDARD_POSITIONS})
        text += f"; the sentences of the same receiver ({', '.join(sentences)}) stay raw" if sentences else ""
        yield Remark("mapped", text, "gnss")
    elif found.choice.maker:
        yield Remark("mapped", f"gnss from {found.choice.maker}, as no standard sentence tells a position", "gnss")
    for name in OTHER_SOLUTIONS:
        if found.counts[name] and name != found.leader:
            text = f"{name} ({found.counts[name]}) stays raw: {_OTHER_SENSE[name.partition('-')[0]]}"
            yield Remark("skipped", text, f"raw.{name}")
    if found.choice.passed_over and not found.leader:
        names = ", ".join(sorted(found.choice.passed_over))
        yield Remark("skipped", f"sentences of another device than the GNSS receiver stay raw: {names}")
    told = {formatter_of(name) for name in found.counts}
    if found.leader == "HNR-PVT" or found.choice.maker == "PUBX.00" or (not found.leader and told & {"RMC", "VTG"}):
        text = "gnss: velocity_north_mps, velocity_east_mps derived from ground speed and track"
        yield Remark("derived", text, "gnss", ("velocity_north_mps", "velocity_east_mps"))


def _added_to(leader: str) -> tuple[str, ...]:
    """Messages that add to the rows of the leading one."""
    if leader in novatel_messages.VELOCITY_OF:
        return novatel_messages.VELOCITY_OF[leader], "PSRDOP"
    family = "NAV2" if leader.startswith("NAV2") else "NAV"
    finer = ("NAV-HPPOSLLH",) if family == "NAV" and leader != "NAV-HPPOSLLH" else ()
    if leader.endswith(("PVT", "PVAT")):
        return f"{family}-DOP", *finer
    return f"{family}-DOP", f"{family}-VELNED", f"{family}-SOL", f"{family}-STATUS", *finer


_OTHER_SENSE = {
    "HNR": "the receiver's solution between its epochs, predicted from the same measurements",
    "NAV2": "the receiver's second solution, of the same antenna and without corrections or inertial sensors",
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
    "HNR-ATT": _FUSED,
    "HNR-PVT": _FUSED,
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
