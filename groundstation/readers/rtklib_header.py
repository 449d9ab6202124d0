"""Headers of RTKLIB solutions: names and facts that govern the rows below them.

A file has one on top, and more where solutions were appended to each other.

Source: Takasu, RTKLIB ver. 2.4.2 manual (2013), appendix B.1; solution.c and postpos.c of its 2.4.3.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.ecef import geodetic_deg_m
from groundstation.base.records import Damage
from groundstation.readers.dialect import HeadLine, head_lines
from groundstation.readers.sections import MOST, left_out, lines_with
from groundstation.readers.source import Source

Place = tuple[float, float, float]
_NAMES = re.compile(r"%\s*(GPST|UTC|JST)\b.*\b(latitude|x-ecef|e-baseline)\b.*\bQ\b\s*[,;]?\s*\bns\b")
_HEIGHTS = re.compile(r"\(.*\bheight\b.*\b(ellipsoidal|geodetic)\b")
_REFERENCE = re.compile(r"(?:ref|slave) pos\s*:(.*)")
# RTKLIB before 2.4.3 b34 writes %13.9f%14.9f%10.4f with nothing between them.
_NUMBER = re.compile(r"[-+]?\d+\.\d{9}(?=\d*\.)|[-+]?\d+(?:\.\d*)?|[-+]?\.\d+")
_PERCENT = re.compile(b"%")
_TURN_DEG = 360.0
_HEAD_LINES = 1000


@dataclass(frozen=True)
class Form:
    """Form of the rows below a header.

    Parameters
    ----------
    names : tuple of str
        Of the cells, date and time (or week and second) first.
    scale : {'GPST', 'UTC', 'JST'}
    has_week : bool
        Times are week and second.
    heights : {'', 'ellipsoidal', 'geodetic'}
    reference : (latitude_deg, longitude_deg, height_m), optional
        Place of the base station.
    metadata : mapping of str to str
    """

    names: tuple[str, ...]
    scale: str
    has_week: bool
    heights: str
    reference: Place | None
    metadata: Mapping[str, str]

    def reads_as(self, other: "Form") -> bool:
        """Tell whether rows mean the same under another header."""
        return self == replace(other, metadata=self.metadata)


@dataclass(frozen=True)
class Governed:
    """Form with line and byte of its first row; ``end_byte`` begins the next header."""

    form: Form
    first_line: int
    first_byte: int
    end_byte: int | None = None


def form_of(source: Source) -> Governed | None:
    """Return the header at the top of a file; None where it is not RTKLIB's."""
    if not source.head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"%"):
        return None
    top: list[HeadLine] = []
    for line in head_lines(source, "utf-8", _HEAD_LINES):
        if not line.text.lstrip().startswith("%"):
            break
        top.append(line)
    form = _form(source, top, None)
    return None if form is None else Governed(form, top[-1].number + 1, top[-1].next_byte)


def forms_of(source: Source, first: Governed) -> tuple[list[Governed], Damage | None]:
    """Find the headers that change how rows are read; damage where there are too many."""
    governed = [first]
    last = HeadLine(first.first_line - 1, first.first_byte, "", True)
    for block, start in _blocks(source, last):
        form = _form(source, block, governed[-1].form)
        if form is None or form.reads_as(governed[-1].form):
            continue
        governed[-1] = replace(governed[-1], end_byte=start)
        if len(governed) == MOST:
            return governed, left_out(source, block[0].number, start)
        governed.append(Governed(form, block[-1].number + 1, block[-1].next_byte))
    return governed, None


def _blocks(source: Source, last: HeadLine) -> Iterator[tuple[list[HeadLine], int]]:
    """Yield runs of lines after the first header that begin with a percent sign."""
    block: list[HeadLine] = []
    begin = 0
    for line, start in lines_with(source, last, "utf-8", _PERCENT):
        if not line.text.lstrip().startswith("%"):
            continue
        if block and line.number != block[-1].number + 1:
            yield block, begin
            block = []
        begin = begin if block else start
        block.append(line)
    if block:
        yield block, begin


def _form(source: Source, block: Sequence[HeadLine], before: Form | None) -> Form | None:
    """Return the form that a block of lines states; None where it changes nothing.

    A line of names begins anew: what the lines around it do not say is not known. Without one, or where the same line
    of names stands alone, what they say is added to what was known.
    """
    at = [k for k, line in enumerate(block) if _NAMES.match(line.text.lstrip())]
    named = block[at[-1]] if at else None
    text = "\n".join(line.text for line in block[at[-2] + 1 if len(at) > 1 else 0 :])
    found = _HEIGHTS.findall(text)
    heights = found[-1] if found else ""
    reference = _reference(text)
    if named is None:
        if before is None:
            return None
        return replace(before, heights=heights or before.heights, reference=reference or before.reference)
    words = re.sub(r"[,;]", " ", named.text.lstrip("% ")).split()
    row = _first_row(source, block[-1].next_byte)
    form = Form(_cell_names(words[1:]), words[0], b"/" not in row, heights, reference, dict(_facts(text)))
    if before is not None and len(block) == 1 and (form.names, form.scale) == (before.names, before.scale):
        return replace(form, heights=before.heights, reference=before.reference)
    return form


def _cell_names(words: Sequence[str]) -> tuple[str, ...]:
    names = ["date", "time"]
    for word in words:
        name, _, unit = word.partition("(")
        names += [f"{name}_deg", f"{name}_min", f"{name}_s"] if unit.startswith("d'") else [name]
    return tuple(name if names.index(name) == at else f"{name}_{at}" for at, name in enumerate(names))


def _first_row(source: Source, start: int) -> bytes:
    """Return the beginning of the first row, its date or week."""
    if start < len(source.head) - 64:
        return source.head[start : start + 64].lstrip(b" \t\r\n")[:12]
    with source.open() as stream:
        stream.seek(start)
        return stream.read(64).lstrip(b" \t\r\n")[:12]


def _reference(text: str) -> Place | None:
    """Return the place of the base station: degrees, d m s, or ECEF; numbers may touch.

    Examples
    --------
    >>> _reference("% ref pos   : 40.086179918-105.206044414 1575.6355")
    (40.086179918, -105.206044414, 1575.6355)
    >>> [round(part, 6) for part in _reference("% ref pos   :  40 05 10.24770-105 12 21.75989 1575.6355")]
    [40.08618, -105.206044, 1575.6355]
    """
    found = _REFERENCE.findall(text)
    parts = _NUMBER.findall(found[-1]) if found else []
    numbers = [float(part) for part in parts]
    if len(numbers) >= 7:
        latitude, longitude = (_degrees(numbers[at : at + 3]) for at in (0, 3))
        return _on_earth(latitude, longitude, numbers[6])
    if len(numbers) < 3:
        return None
    if max(abs(numbers[0]), abs(numbers[1])) <= _TURN_DEG:
        return _on_earth(*numbers[:3])
    place = geodetic_deg_m(np.array([numbers[:3]]))
    return _on_earth(*(float(part[0]) for part in place))


def _degrees(parts: Sequence[float]) -> float:
    size = abs(parts[0]) + parts[1] / 60.0 + parts[2] / 3600.0
    return float(np.copysign(size, parts[0]))


def _on_earth(latitude_deg: float, longitude_deg: float, height_m: float) -> Place | None:
    is_place = abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= _TURN_DEG and np.isfinite(height_m)
    return (latitude_deg, longitude_deg, height_m) if is_place else None


def _facts(text: str) -> Iterator[tuple[str, str]]:
    """Program and settings of the solution, as metadata."""
    for key, name in (
        ("program", "program"),
        ("pos mode", "pos_mode"),
        ("ref pos", "ref_pos"),
        ("solution", "solution"),
    ):
        found = re.search(rf"(?m)^%\s*{key}\s*:\s*(.{{1,200}})$", text)
        if found is not None:
            yield f"rtklib.{name}", found[1].strip()
