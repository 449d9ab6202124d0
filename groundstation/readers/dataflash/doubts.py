"""Doubts about definitions and instances that no autopilot writes.

Records were read by them, and some may not be what they were. A FMT record has no checksum. A damaged one may still
describe records of the right length, under another name or with other fields: then no bytes are left over, and the
fields that the analyses want are missing without notice.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from groundstation.base.records import Damage
from groundstation.readers.dataflash import rules
from groundstation.readers.dataflash.definitions import FMT_DTYPE, RecordDefinition
from groundstation.readers.dataflash.rules import MOST_SENSORS, FieldRule

_NAME = re.compile(rb"[A-Za-z][A-Za-z0-9_]{0,3}")
_LABELS = re.compile(rb"[A-Za-z][A-Za-z0-9_]*(,[A-Za-z][A-Za-z0-9_]*)*")
_TEXTS = frozenset(("Name", "Message", "Label", "UnitIds", "MultIds"))
_TIMES = ("TimeUS", "TimeMS")


def _sources(*groups: Sequence[FieldRule]) -> tuple[str, ...]:
    return tuple(rule.source for group in groups for rule in group)


_GPS = (*_sources(rules.POSITION, rules.GNSS_VELOCITY, rules.GNSS_QUALITY, rules.SATELLITES), "Status", "GMS", "GWk")
_SENSORS = {
    "gnss": _GPS,
    "magnetometer": _sources(rules.FIELD),
    "baro": (rules.PRESSURE.source,),
    "electric": _sources(rules.CURRENT),
    "radio_altimeter": (*_sources(rules.HEIGHT), "Stat", "Orient"),
}
WANTED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "ATT": (*_sources(rules.ATTITUDE), rules.TRUE_YAW.source),
        "AHR2": (*_sources(rules.ATTITUDE, rules.POSITION), rules.TRUE_YAW.source),
        "POS": _sources(rules.POSITION),
        "IMU": _sources(rules.RATES, rules.ACCELERATIONS),
        "GYR": _sources(rules.RATES),
        "ACC": _sources(rules.ACCELERATIONS),
        **dict.fromkeys(("GPA", "GPA2"), ("VDop", *_sources(rules.SIGMAS))),
        "PARM": ("Name", "Value"),
        "MSG": ("Message",),
        "EV": ("Id",),
        "UNIT": ("Id", "Label"),
        "MULT": ("Id", "Mult"),
        "FMTU": ("FmtType", "UnitIds", "MultIds"),
        **{f"{ekf}4": ("PI",) for ekf in ("XKF", "NKF", "EKF")},
        **{f"{ekf}1": _sources(rules.VELOCITY) for ekf in ("XKF", "NKF", "EKF")},
        **{f"{ekf}2": _sources(rules.WIND) for ekf in ("XKF", "NKF", "EKF")},
        **{name: _SENSORS[kind] for kind, groups in rules.SENSOR_TYPES.items() for names in groups for name in names},
    }
)


def doubts(
    payloads: Mapping[int, bytes], definitions: Mapping[int, RecordDefinition], counts: Mapping[int, int]
) -> Iterator[Damage]:
    """Yield damage for types with a doubtful definition; it counts the records read by it.

    Parameters
    ----------
    payloads : mapping of type id to bytes
        The FMT records in force, without their headers.
    definitions : mapping of type id to RecordDefinition
    counts : mapping of type id to int
        Records by type.
    """
    names = {definitions[type_id].name for type_id in payloads}
    for type_id, payload in payloads.items():
        definition, count = definitions[type_id], counts.get(type_id, 0)
        reason = count and (_fault(payload, definition) or _slip(definition, names))
        if reason:
            what = f"records read by a definition that is damaged: {reason}"
            yield Damage("corrupt", f"definition of {definition.name}", count, what, f"raw.{definition.name}")


def odd_instances(counts: Mapping[str, int]) -> Iterator[Damage]:
    """Yield damage for topics ``raw.<type>.<instance>`` whose instance no autopilot has."""
    for topic, count in counts.items():
        instance = topic.split(".")[-1]
        if instance.isdecimal() and int(instance) >= MOST_SENSORS and topic.split(".")[1] in WANTED:
            yield Damage("corrupt", topic, count, f"records of an instance {instance}, which no autopilot has", topic)


def _fault(payload: bytes, definition: RecordDefinition) -> str:
    """Return the part of a FMT record that no autopilot writes; empty where there is none."""
    record = np.frombuffer(payload, FMT_DTYPE, 1)[0]
    starts = {name: FMT_DTYPE.fields[name][1] for name in ("Name", "Format", "Columns")}  # type: ignore[index]
    texts = {name: payload[at : at + FMT_DTYPE[name].itemsize] for name, at in starts.items()}
    plain = {name: text.partition(b"\0")[0] for name, text in texts.items()}
    if any(text.rstrip(b"\0") != plain[name] for name, text in texts.items()):
        return "bytes behind the end of a text"
    if not _NAME.fullmatch(plain["Name"]) or not _LABELS.fullmatch(plain["Columns"] or b"a"):
        return "a name with characters that no name has"
    fields, labels = len(plain["Format"]), plain["Columns"].split(b",") if plain["Columns"] else []
    is_full = len(plain["Columns"]) >= FMT_DTYPE["Columns"].itemsize - 1  # the last names may be left out then
    is_short = any(wanted.encode() not in labels for wanted in WANTED.get(definition.name, ()))
    if len(labels) != fields and (is_short or not is_full):
        return f"{len(labels)} names for {fields} fields"
    used = sum(definition.dtype[spec.name].itemsize for spec in definition.fields) + 3
    if definition.fields and used != int(record["Length"]):
        return f"fields of {used} bytes in records of {record['Length']}"
    return ""


def _slip(definition: RecordDefinition, names: set[str]) -> str:
    """Return a field, or the type, whose name is almost one that is expected and missing."""
    labels = [spec.name for spec in definition.fields]
    if labels and labels[0] not in _TIMES and any(_is_slip(labels[0], time) for time in _TIMES):
        return f"field {labels[0]}: unknown, meant {_TIMES[0]}?"
    for wanted in WANTED.get(definition.name, ()):
        spec = definition.find(wanted)
        if spec is not None and spec.is_text != (wanted in _TEXTS):
            return f"field {wanted} of kind {spec.character}"
        others = [one for one in labels if one not in WANTED[definition.name]]
        near = next((one for one in others if _is_slip(one, wanted)), None) if wanted not in labels else None
        if near is not None:
            return f"field {near}: unknown, meant {wanted}?"
    if definition.name not in WANTED:
        for name, wanted_labels in WANTED.items():
            if name not in names and _is_slip(definition.name, name) and set(wanted_labels) <= set(labels):
                return f"type {definition.name}: unknown, meant {name}?"
    return ""


def _is_slip(found: str, wanted: str) -> bool:
    """Tell whether two names differ in exactly one character."""
    return len(found) == len(wanted) and sum(a != b for a, b in zip(found, wanted, strict=True)) == 1
