"""First pass over a ULog: facts for the header, and which rule serves which signal.

The header must be known before the first batch.
"""

from collections.abc import Iterable, Mapping
from dataclasses import field

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import Remark
from groundstation.readers.imu import first_whole
from groundstation.readers.mapping import Assignment, OfferedMessages, Role, assigned
from groundstation.readers.ulog.blocks import Definitions, Topic, UlogBlock
from groundstation.readers.ulog.canonical import ARMING, ROLES
from groundstation.readers.ulog.inertial import IMU_ROLES
from groundstation.readers.ulog.messages import Keyed, keyed, release_text
from groundstation.readers.ulog.utc import FIX_3D, UtcCollector

MAX_METADATA = 200
MAX_METADATA_CHARACTERS = 256
_RECEIVERS = frozenset(rule.source for role in ROLES if role.topic == "gnss" for rule in role.rules)
_KEPT_PREFIXES = ("sys_", "ver_", "time_ref_utc", "log_type", "replay")


@dataclass
class UlogOverview:
    """Findings of the first pass.

    Attributes
    ----------
    metadata : dict of str to str
    utc_of_zero_ns : int or None
    remarks : list of Remark
    assignments : dict of (PX4 topic, instance) to list of Assignment
    arming : (topic, column, value that means armed), or None
    fixed : set of str
        Topics of receivers that have a fix.
    odd_flags : set of (topic number, column)
        Columns of type bool that hold other values than 0 and 1.
    """

    metadata: dict[str, str] = field(default_factory=dict)
    utc_of_zero_ns: int | None = None
    remarks: list[Remark] = field(default_factory=list)
    assignments: dict[tuple[str, int], list[Assignment]] = field(default_factory=dict)
    arming: tuple[str, str, int] | None = None
    fixed: set[str] = field(default_factory=set)
    odd_flags: set[tuple[int, str]] = field(default_factory=set)


def overview(blocks: Iterable[UlogBlock], definitions: Definitions) -> UlogOverview:
    """Go through the blocks of a log once; ``definitions`` are those of their walk."""
    counts: dict[int, int] = {}
    found, clocks = UlogOverview(), UtcCollector()
    for block in blocks:
        messages = np.bincount(block.topic[block.topic >= 0])
        occurring = np.flatnonzero(messages).tolist()
        for number in occurring:
            counts[number] = counts.get(number, 0) + int(messages[number])
        for topic in (block.topics[number] for number in occurring):
            _note_odd_flags(block, topic, found.odd_flags)
            if topic.name not in found.fixed and _has_fix(block, topic):
                found.fixed.add(topic.name)
            clocks.take(block, topic)
        _note_facts(block, found.metadata, clocks)
    _assign(found, [topic for topic in definitions.topics if topic.number in counts], counts)
    start = clocks.power_up(found.metadata.get("ver_sw_release", ""))
    found.utc_of_zero_ns = start.utc_ns
    found.remarks += start.remarks
    _name_aircraft(found.metadata)
    return found


def _note_odd_flags(block: UlogBlock, topic: Topic, odd: set[tuple[int, str]]) -> None:
    """Note columns of type bool that hold other values than 0 and 1.

    They are kept as the numbers they are.
    """
    if topic.layout is None or not topic.layout.flags:
        return
    rows = block.rows(topic.layout, np.flatnonzero(block.topic == topic.number))
    odd.update((topic.number, name) for name in topic.layout.flags if (rows[name] > 1).any())


def _has_fix(block: UlogBlock, topic: Topic) -> bool:
    """Tell whether a block has a receiver with a fix."""
    if topic.name not in _RECEIVERS or topic.layout is None or "fix_type" not in topic.layout.names:
        return False
    rows = block.rows(topic.layout, np.flatnonzero(block.topic == topic.number))
    return bool((rows["fix_type"] >= FIX_3D).any())


def _assign(found: UlogOverview, topics: list[Topic], counts: Mapping[int, int]) -> None:
    """Choose the rule of each role among topics with data; of receivers those with a fix."""
    silent = _RECEIVERS - found.fixed if found.fixed else frozenset()
    offers = [
        OfferedMessages(topic.name, topic.instance, topic.layout.names)
        for topic in topics
        if topic.layout is not None and topic.name not in silent
    ]
    for one in assigned((*ROLES, *_imu_roles(topics, counts)), offers):
        found.assignments.setdefault((one.offer.source, one.offer.instance), []).append(one)
        found.remarks += one.rule.told(one.topic)
    for source, column, armed in ARMING:
        if any(topic.name == source and topic.layout and column in topic.layout.names for topic in topics):
            found.arming = (source, column, armed)
            break


def _imu_roles(topics: list[Topic], counts: Mapping[int, int]) -> tuple[Role, ...]:
    """Return the roles of the best source of ``imu`` that the logger did not thin out."""
    records = []
    for roles in IMU_ROLES:
        needed = {rule.source: rule for role in roles for rule in role.rules}
        first = {
            topic.name: counts[topic.number]
            for topic in reversed(topics)
            if topic.layout is not None
            and any(
                rule.source == topic.name and topic.layout.names >= set(rule.needs)
                for role in roles
                for rule in role.rules
            )
        }
        records.append(max(first.values()) if len(first) == len(needed) else 0)
    place = first_whole(records)
    return () if place is None else IMU_ROLES[place]


def _note_facts(block: UlogBlock, metadata: dict[str, str], clocks: UtcCollector) -> None:
    for _number, kind, body in block.controls():
        if kind in "LC":
            clocks.heed_line(kind, body)
        if kind not in "IP":
            continue
        try:
            fact = keyed(body)
        except GroundstationError:
            continue
        clocks.heed(fact)
        if len(metadata) >= MAX_METADATA:
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
    """Name the aircraft by the last twelve digits of the autopilot's own number.

    These digits tell two autopilots of one batch apart.
    """
    number = metadata.get("sys_uuid", "")
    if number:
        metadata["aircraft"] = f"PX4-{number[-12:]}"
