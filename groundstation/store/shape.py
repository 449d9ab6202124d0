"""Check of the shape of a store file's facts; an entry of another shape is left out.

Later rooms rely on the shape.

The facts are JSON in a file that may be damaged or written by anyone. Keys that are not named here pass unchanged.
"""

from collections.abc import Mapping
from typing import Any

_MAX_INTEGER = 1 << 62
_TEXT, _COUNT, _FLAG = "text", "count", "flag"
_DAMAGE = {"kind": _TEXT, "place": _TEXT, "count": _COUNT, "what": _TEXT, "topic": _TEXT, "loses_data": _FLAG}
_REMARK = {"code": _TEXT, "text": _TEXT, "topic": _TEXT}


def _is_a(value: Any, kind: str) -> bool:
    if kind == _TEXT:
        return isinstance(value, str)
    if kind == _FLAG:
        return isinstance(value, bool)
    return type(value) is int and 0 <= value < _MAX_INTEGER


def _agrees(entry: Any, shape: Mapping[str, str]) -> bool:
    """Tell whether the keys that an entry has agree with a shape; all may be absent."""
    return isinstance(entry, dict) and all(_is_a(entry[key], kind) for key, kind in shape.items() if key in entry)


def sound_damages(entries: Any) -> list[Any]:
    """Return the entries that may be damage.

    Examples
    --------
    >>> sound_damages([{"kind": "cut"}, {"kind": []}, 7])
    [{'kind': 'cut'}]
    """
    return [entry for entry in _listed(entries) if _agrees(entry, _DAMAGE)]


def sound_remarks(entries: Any) -> list[Any]:
    """Return the entries that may be remarks."""
    return [entry for entry in _listed(entries) if _agrees(entry, _REMARK)]


def _listed(entries: Any) -> list[Any]:
    return list(entries) if isinstance(entries, list | tuple) else []
