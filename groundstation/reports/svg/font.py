"""Text in a picture: its width in DejaVu Sans, its characters, its SVG.

The two fonts beside this file are DejaVu Sans 2.37 cut down to Latin, Greek, Cyrillic, arrows, mathematics and signs
(``python -m fontTools.subset``), without hints. Paper is set in them; a page has a font of the reader's machine, most
of which are narrower, so that what has room by these widths has room there.
"""

import struct
from functools import cache, lru_cache
from html import escape
from pathlib import Path
from typing import Any

from groundstation.chapters.wording import HIDDEN, clean

FONTS = Path(__file__).parent / "fonts"
SIZE_PT, TITLE_PT = 8.0, 8.5
CAP_SHARE = 0.729  # height of a capital letter over the size of the font
NO_BREAK = "\u00a0"  # of two spaces the one that is not taken for one
LINE_SHARE = 1.2  # from one line to the next, over the size


@cache
def widths(is_bold: bool = False) -> dict[int, float]:
    """Return the widths of the font's characters over its size, read from the font file.

    Source: Microsoft, OpenType specification 1.9.1, tables ``cmap`` (format 4), ``hhea``, ``hmtx``.

    Examples
    --------
    >>> round(widths()[ord("0")], 3), round(widths(True)[ord("0")], 3)
    (0.636, 0.696)
    """
    data = (FONTS / f"DejaVuSans{'-Bold' if is_bold else ''}.ttf").read_bytes()
    tables = {}
    for number in range(struct.unpack_from(">H", data, 4)[0]):
        name, _, start, _ = struct.unpack_from(">4sLLL", data, 12 + 16 * number)
        tables[name] = start
    units = struct.unpack_from(">H", data, tables[b"head"] + 18)[0]
    measured = struct.unpack_from(">H", data, tables[b"hhea"] + 34)[0]
    advances = struct.unpack_from(f">{2 * measured}H", data, tables[b"hmtx"])[::2]
    glyphs = _glyphs(data, tables[b"cmap"])
    return {mark: advances[min(glyph, measured - 1)] / units for mark, glyph in glyphs.items() if glyph}


def _glyphs(data: bytes, start: int) -> dict[int, int]:
    """Return glyphs by character, of the first table of format 4."""
    for number in range(struct.unpack_from(">H", data, start + 2)[0]):
        offset = start + struct.unpack_from(">L", data, start + 8 + 8 * number)[0]
        if struct.unpack_from(">H", data, offset)[0] == 4:
            break
    count = struct.unpack_from(">H", data, offset + 6)[0] // 2
    row = f">{count}H"
    ends = struct.unpack_from(row, data, offset + 14)
    starts, steps, jumps = (struct.unpack_from(row, data, offset + 16 + 2 * count * place) for place in (1, 2, 3))
    found: dict[int, int] = {}
    for place, (low, high, step, jump) in enumerate(zip(starts, ends, steps, jumps, strict=True)):
        for mark in range(low, min(high, 0xFFFE) + 1):
            if jump:
                at = offset + 16 + 6 * count + 2 * place + jump + 2 * (mark - low)
                glyph = struct.unpack_from(">H", data, at)[0]
                found[mark] = (glyph + step) & 0xFFFF if glyph else 0
            else:
                found[mark] = (mark + step) & 0xFFFF
    return found


@lru_cache(4096)
def width_pt(text: str, size_pt: float = SIZE_PT, is_bold: bool = False) -> float:
    """Return the width of a line of text in DejaVu Sans, points.

    Examples
    --------
    >>> round(width_pt("0:00"), 2)
    17.96
    """
    known = widths(is_bold)
    other = widths()
    return size_pt * sum(known.get(ord(mark), other.get(ord(mark), 1.0)) for mark in text)


@lru_cache(4096)
def label(text: Any, most: int = 40) -> str:
    """Return text of a log fit for a picture: known characters, one line, bounded length.

    Examples
    --------
    >>> label("a\\u4e00b"), label("a" * 50, 4)
    ('a�b', 'aaa…')
    """
    known = widths()
    kept = "".join(mark if ord(mark) in known else HIDDEN for mark in clean(str(text))[: 4 * most])
    return kept if len(kept) <= most else kept[: most - 1] + "…"


def lines_of(text: str, room_pt: float, most: int = 2, size_pt: float = SIZE_PT) -> list[str]:
    """Break text between words into at most ``most`` lines.

    Each is within ``room_pt`` where words allow it.

    Examples
    --------
    >>> lines_of("probability density, 1/°", 60.0)
    ['probability', 'density, 1/°']
    """
    lines: list[str] = []
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and (len(lines) == most or width_pt(longer, size_pt) <= room_pt):
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def written(
    text: str, x: float, y: float, anchor: str = "", *, size_pt: float = 0.0, look: str = "", is_upright: bool = False
) -> str:
    """Return text as an SVG element, its base line from (x, y) on; ``look`` are attributes.

    Upright text reads from below.
    """
    place = f'x="{x:.2f}" y="{y:.2f}"'
    if is_upright:
        place = f'transform="translate({x:.2f} {y:.2f})rotate(-90)"'
    size = f' font-size="{size_pt:g}"' if size_pt else ""
    side = f' text-anchor="{anchor}"' if anchor else ""
    return f"<text {place}{side}{size}{look}>{escape(text.replace('  ', NO_BREAK + ' '), quote=False)}</text>"


def middle(size_pt: float = SIZE_PT) -> float:
    """Return the distance from the middle of a line of text down to its base line, points."""
    return 0.5 * CAP_SHARE * size_pt
