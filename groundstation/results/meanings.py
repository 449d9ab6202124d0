"""Meanings of the fields of answers, from where their types stand.

The JSON Schema has them, and with it the reference.

A meaning stands behind a field (``#: text``), above it, or in the section Parameters of the docstring of its class.
Names that mean the same in every answer are told once, in ``COMMON``.
"""

import ast
import inspect
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

COMMON = {
    "confidence95_deg": "95 % interval of the error [low, high].",
    "confidence95_m": "95 % interval of the error [low, high].",
    "end_s": "Flight second of the end.",
    "gnss_topic": "Topic of the GNSS used.",
    "ins_topic": "Topic of the INS used.",
    "remarks": "Sentences for people on limits of the answer.",
    "samples": "Number of samples behind the figures.",
    "settings": "Settings of the analysis as used, by name.",
    "start_s": "Flight second of the beginning.",
    "time_s": "Flight second.",
    "topic": "Topic of the log.",
    "unit": "Unit of the figures of this row; empty for a ratio.",
}


def meanings_of(cls: type) -> dict[str, str]:
    """Return the meanings of the fields of a dataclass, by name, as far as they are told.

    Examples
    --------
    >>> from groundstation.results.gates import Gate
    >>> meanings_of(Gate)["value"]
    'The figure; null when it could not be measured.'
    """
    told: dict[str, str] = {}
    for base in reversed(cls.__mro__[:-1]):
        told |= _in_docstring(base.__doc__ or "")
        told |= _beside_fields(base)
    return {**COMMON, **told}


def _in_docstring(doc: str) -> dict[str, str]:
    """Return the meanings in the section Parameters; names on one line share theirs."""
    _, _, listed = doc.partition("Parameters\n    ----------\n")
    told: dict[str, str] = {}
    names: list[str] = []
    for line in listed.splitlines():
        if re.match(r"    \w", line):
            names = line.partition(" : ")[0].replace(",", " ").split()
        elif line.strip():
            told |= {name: f"{told.get(name, '')} {line.strip()}".strip() for name in names}
    return told


def _beside_fields(cls: type) -> dict[str, str]:
    """Return the meanings in the comments ``#:`` of a class, behind its fields or above them."""
    source = inspect.getsourcefile(cls)
    return _comments(source).get(cls.__qualname__, {}) if source is not None else {}


@cache
def _comments(source: str) -> dict[str, dict[str, str]]:
    """Return the meanings of the fields of every class of a file, by the name of the class."""
    text = Path(source).read_text(encoding="utf-8")
    lines = text.splitlines()
    return {node.name: dict(_of_class(node, lines)) for node in ast.parse(text).body if isinstance(node, ast.ClassDef)}


def _of_class(node: ast.ClassDef, lines: list[str]) -> Iterator[tuple[str, str]]:
    for field in node.body:
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
            behind = lines[(field.end_lineno or field.lineno) - 1].partition("#: ")[2]
            above: list[str] = []
            at = field.lineno - 2
            while lines[at].strip().startswith("#: "):
                above.insert(0, lines[at].strip().removeprefix("#: "))
                at -= 1
            if told := " ".join([*above, behind]).strip():
                yield field.target.id, told
