"""The first pass over a ULog: what the header must tell before the first batch, and which rule serves which signal."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Int64Array, Remark
from groundstation.readers.mapping import Assignment, Offer, assigned
from groundstation.readers.start import told_at_zero
from groundstation.readers.ulog.blocks import Block, Definitions, Topic
from groundstation.readers.ulog.canonical import ARMING, FIX_3D, ROLES, UTC_SOURCES
from groundstation.readers.ulog.messages import Keyed, keyed, release_text

EARLIEST_US, LATEST_US = 1_072_915_200_000_000, 4_102_444_800_000_000  # 2004, 2100: PX4 flies between them
MAX_METADATA = 200
MAX_METADATA_CHARACTERS = 256
_KEPT_PREFIXES = ("sys_", "ver_", "time_ref_utc", "log_type", "replay")


@dataclass
class Overview:
    """What the first pass found.

    Attributes
    ----------
    metadata : dict of str to str
    utc_of_zero_ns : int or None
    remarks : list of Remark
    assignments : dict of (PX4 topic, instance) to list of Assignment
    arming : (topic, column, value that means armed), or None
    has_gnss : bool
    odd_flags : set of (topic number, column)
        Columns of type bool that hold other values than 0 and 1.
    """

    metadata: dict[str, str] = field(default_factory=dict)
    utc_of_zero_ns: int | None = None
    remarks: list[Remark] = field(default_factory=list)
    assignments: dict[tuple[str, int], list[Assignment]] = field(default_factory=dict)
    arming: tuple[str, str, int] | None = None
    has_gnss: bool = False
    odd_flags: set[tuple[int, str]] = field(default_factory=set)


def overview(blocks: Iterable[Block], definitions: Definitions) -> Overview:
    """Go through the blocks of a log once; ``definitions`` are those of their walk."""
    with_data: set[int] = set()
    clocks: dict[str, list[Int64Array]] = {}  # (UTC, device time) of messages, microseconds
    found = Overview()
    for block in blocks:
        occurring = np.flatnonzero(np.bincount(block.topic[block.topic >= 0])).tolist()
        with_data.update(occurring)
        for topic in (block.topics[number] for number in occurring):
            _note_odd_flags(block, topic, found.odd_flags)
            if topic.name in UTC_SOURCES and topic.instance == 0 and _tells_utc(topic):
                clocks.setdefault(topic.name, []).append(_utc_and_device_us(block, topic))
        _note_facts(block, found.metadata)
    _assign(found, [topic for topic in definitions.topics if topic.number in with_data])
    _relate_to_utc(found, clocks)
    _name_aircraft(found.metadata)
    return found


def _note_odd_flags(block: Block, topic: Topic, odd: set[tuple[int, str]]) -> None:
    """Note columns of type bool with other values than 0 and 1: they are kept as the numbers they are."""
    if topic.layout is None or not topic.layout.flags:
        return
    rows = block.rows(topic.layout, np.flatnonzero(block.topic == topic.number))
    odd.update((topic.number, name) for name in topic.layout.flags if (rows[name] > 1).any())


def _tells_utc(topic: Topic) -> bool:
    layout = topic.layout
    return layout is not None and layout.timestamp_offset is not None and "time_utc_usec" in layout.names


def _utc_and_device_us(block: Block, topic: Topic) -> Int64Array:
    """UTC and device time of each message that has a good fix and a time that can be true, shape (2, n)."""
    assert topic.layout is not None
    rows = block.rows(topic.layout, np.flatnonzero(block.topic == topic.number))
    utc, device = rows["time_utc_usec"].astype(np.uint64), rows["timestamp"]
    good = (utc >= EARLIEST_US) & (utc < LATEST_US) & (device > 0) & (device < LATEST_US)
    if "fix_type" in topic.layout.names:
        good &= rows["fix_type"] >= FIX_3D
    return np.stack([utc[good].astype(np.int64), device[good].astype(np.int64)])


def _relate_to_utc(found: Overview, clocks: dict[str, list[Int64Array]]) -> None:
    """UTC of power-up: by the good fixes of the first topic that has any."""
    for name in UTC_SOURCES:
        utc, device = np.concatenate(clocks.get(name, [np.zeros((2, 0), dtype=np.int64)]), axis=1)
        if not len(utc):
            continue
        found.has_gnss |= name != "vehicle_global_position"
        median_us, offsets = told_at_zero(utc, device)
        spread_s = float(np.quantile(np.abs(offsets - median_us), 0.9)) / 1e6
        found.utc_of_zero_ns = median_us * 1_000
        text = (
            f"UTC of power-up from {name}: median over {len(offsets)} times with a fix, "
            f"nine tenths within {spread_s:.3f} s; messages come some 0.1 s after the time they tell"
        )
        found.remarks.append(Remark("utc_from_gnss", text))
        return


def _assign(found: Overview, topics: list[Topic]) -> None:
    """Choose the rule of each role among the topics that have data."""
    offers = [Offer(topic.name, topic.instance, topic.layout.names) for topic in topics if topic.layout is not None]
    for one in assigned(ROLES, offers):
        found.assignments.setdefault((one.offer.source, one.offer.instance), []).append(one)
        found.remarks += one.rule.told(one.topic)
    for source, column, armed in ARMING:
        if any(topic.name == source and topic.layout and column in topic.layout.names for topic in topics):
            found.arming = (source, column, armed)
            break


def _note_facts(block: Block, metadata: dict[str, str]) -> None:
    for _number, kind, body in block.controls():
        if kind not in "IP" or len(metadata) >= MAX_METADATA:
            continue
        try:
            fact = keyed(body)
        except GroundstationError:
            continue
        if kind == "P" and fact.key == "SYS_AUTOSTART":
            metadata.setdefault("airframe", str(fact.value))
        elif kind == "I" and fact.key.startswith(_KEPT_PREFIXES) and not isinstance(fact.value, bytes):
            metadata[fact.key] = _fact_text(fact)


def _fact_text(fact: Keyed) -> str:
    if fact.key == "ver_sw_release" and isinstance(fact.value, int):
        return release_text(fact.value)
    text = "".join(letter if letter.isprintable() else " " for letter in str(fact.value))
    return text.strip()[:MAX_METADATA_CHARACTERS]


def _name_aircraft(metadata: dict[str, str]) -> None:
    """The autopilot's own number names the aircraft; its last twelve digits tell apart two of one batch."""
    number = metadata.get("sys_uuid", "")
    if number:
        metadata["aircraft"] = f"PX4-{number[-12:]}"
