"""What of a store file's facts has the shape that later rooms rely on; an entry that has not is left out.

The facts are JSON in a file that may be damaged or written by anyone. Keys that are not named here pass unchanged.
"""

import math
from collections.abc import Mapping
from typing import Any

from groundstation.base.findings import SEVERITIES

_MAX_INTEGER = 1 << 62
_TEXT, _COUNT, _NUMBER, _FLAG = "text", "count", "number or nothing", "flag"
_DAMAGE = {"kind": _TEXT, "place": _TEXT, "count": _COUNT, "what": _TEXT, "topic": _TEXT, "loses_data": _FLAG}
_REMARK = {"code": _TEXT, "text": _TEXT, "topic": _TEXT}
_FINDING = {"severity": _TEXT, "code": _TEXT, "text": _TEXT}
_TOPIC = {
    **dict.fromkeys(("rows", "duplicates", "backward_steps", "stray_rows"), _COUNT),
    **dict.fromkeys(("first", "last"), _TEXT),
    **dict.fromkeys(("span_s", "nominal_rate_hz", "actual_rate_hz", "coverage"), _NUMBER),
}
# Parts of a ledger and of its topics that are tables or lists of tables; one of another kind is left out.
_TABLES, _LISTS = ("thresholds", "gap_definition", "dropouts", "losses", "fields"), ("spans", "sequences")
_COUNTS = ("bytes_skipped", "spans_more")
_GAPS = {"count": _COUNT, "longest_s": _NUMBER}


def _is_a(value: Any, kind: str) -> bool:
    if kind == _TEXT:
        return isinstance(value, str)
    if kind == _FLAG:
        return isinstance(value, bool)
    if kind == _COUNT:
        return type(value) is int and 0 <= value < _MAX_INTEGER
    if value is None:
        return True
    return type(value) in (int, float) and abs(value) < _MAX_INTEGER and math.isfinite(value)


def _has(entry: Any, shape: Mapping[str, str]) -> bool:
    return isinstance(entry, dict) and all(key in entry and _is_a(entry[key], kind) for key, kind in shape.items())


def _agrees(entry: Any, shape: Mapping[str, str]) -> bool:
    """Whether what an entry has of a shape is right; all of it may be absent."""
    return isinstance(entry, dict) and all(_is_a(entry[key], kind) for key, kind in shape.items() if key in entry)


def _is_finding(entry: Any) -> bool:
    if not _has(entry, _FINDING) or entry["severity"] not in SEVERITIES:
        return False
    rest = all(_is_a(entry.get(key, ""), _TEXT) for key in ("topic", "place"))
    return rest and (entry.get("count") is None or _is_a(entry["count"], _COUNT))


def _is_topic(entry: Any) -> bool:
    return _has(entry, _TOPIC) and _has(entry.get("gaps"), _GAPS)


def sound_damages(entries: Any) -> list[Any]:
    """Entries that may be damages.

    Examples
    --------
    >>> sound_damages([{"kind": "cut"}, {"kind": []}, 7])
    [{'kind': 'cut'}]
    """
    return [entry for entry in _listed(entries) if _agrees(entry, _DAMAGE)]


def sound_remarks(entries: Any) -> list[Any]:
    """Entries that may be remarks."""
    return [entry for entry in _listed(entries) if _agrees(entry, _REMARK)]


def sound_ledger(ledger: Mapping[str, Any]) -> dict[str, Any]:
    """A ledger whose topics, damages, remarks and findings have their shape.

    Examples
    --------
    >>> sound_ledger({"topics": {"ins": {"rows": "x"}}, "findings": 3, "more": 1})
    {'topics': {}, 'findings': [], 'more': 1}
    """
    sound = _sound_parts(ledger)
    if "topics" in ledger:
        topics = ledger["topics"] if isinstance(ledger["topics"], dict) else {}
        sound["topics"] = {name: _sound_parts(entry) for name, entry in topics.items() if _is_topic(entry)}
    if "damages" in ledger:
        sound["damages"] = [entry for entry in _listed(ledger["damages"]) if _has(entry, _DAMAGE)]
    if "remarks" in ledger:
        sound["remarks"] = sound_remarks(ledger["remarks"])
    if "findings" in ledger:
        sound["findings"] = [entry for entry in _listed(ledger["findings"]) if _is_finding(entry)]
    return sound


def _sound_parts(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table without parts of the wrong kind."""
    sound = dict(table)
    for name in sound.keys() & {*_TABLES, *_LISTS, *_COUNTS}:
        value = sound[name]
        if name in _LISTS:
            sound[name] = [entry for entry in _listed(value) if isinstance(entry, dict)]
        elif not (_is_a(value, _COUNT) if name in _COUNTS else isinstance(value, dict)):
            del sound[name]
    return sound


def _listed(entries: Any) -> list[Any]:
    return list(entries) if isinstance(entries, list | tuple) else []
