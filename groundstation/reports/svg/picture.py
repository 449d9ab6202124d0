"""Plot as a picture: one SVG element, and the panels by which a page draws it live.

The element has neither style sheet nor script and refers to nothing outside of itself. Its text takes the font of where
it stands. Equal descriptions give equal bytes.
"""

import re
import zlib
from collections.abc import Callable, Iterator

import numpy as np

from groundstation.plots.extents import has_rows, names_of
from groundstation.plots.marks import AnyMark, Cells, Floats, Spans
from groundstation.plots.plot import Plot
from groundstation.reports.live import Svg
from groundstation.reports.svg import boxes as b
from groundstation.reports.svg import legend
from groundstation.reports.svg.alive import frames_of, panels_of
from groundstation.reports.svg.boxes import Box, PlacedPanel, placed
from groundstation.reports.svg.cells import scale_beside
from groundstation.reports.svg.colours import EDGE, FAINT, GRID, INK, PAPER
from groundstation.reports.svg.font import LINE_SHARE, SIZE_PT, TITLE_PT, label, lines_of, middle, written
from groundstation.reports.svg.labels import HALO_PT, labels_of
from groundstation.reports.svg.map_scale import map_scale
from groundstation.reports.svg.shapes import is_within, shape
from groundstation.reports.svg.ticks import Tick

HALO = f' stroke="{PAPER}" stroke-width="{HALO_PT:g}" paint-order="stroke"'
_NOT_IN_AN_ID = re.compile(r"[^A-Za-z0-9_-]+")


def picture_of(plot: Plot) -> Svg:
    """Write a plot as an SVG element for a page, with its panels.

    A plot that cannot be drawn live has its frames instead.
    """
    panels, height = placed(plot)
    key = key_of(plot.name)
    clips, parts, number = [], [], 0
    for one in panels:
        for box in one.boxes:
            frame = f"M{box.left:.2f} {box.top:.2f}h{box.width:.2f}v{box.height:.2f}h-{box.width:.2f}z"
            clips.append(f'<clipPath id="{key}-c{number}"><path d="{frame}"/></clipPath>')
            parts.append(_frame(box, f"{key}-c{number}"))
            number += 1
        parts.append(_around(one))
    head = f'<svg viewBox="0 0 {b.WIDTH_PT:.2f} {height:.2f}" aria-hidden="true" font-size="{SIZE_PT:g}" fill="{INK}">'
    live = panels_of(panels, height)
    return Svg(
        f"{head}<defs>{''.join(clips)}</defs>{''.join(parts)}</svg>", live, () if live else frames_of(panels, height)
    )


def key_of(name: str) -> str:
    """Return the prefix of all names within a plot's picture.

    Examples
    --------
    >>> key_of("heading.difference"), key_of("a b") == key_of("a/b")
    ('heading-difference-21a38b2c', False)
    """
    kept = _NOT_IN_AN_ID.sub("-", name)
    return kept if kept == name else f"{kept[:60]}-{zlib.crc32(name.encode('utf-8', 'replace')):08x}"


def _frame(box: Box, clip: str) -> str:
    """Return one frame as SVG: grid, axes, marks."""
    under: list[tuple[AnyMark, str]] = []
    over: list[tuple[AnyMark, str]] = []
    for mark in box.panel.marks:
        (under if is_within(mark) else over).append((mark, shape(mark, box)))
    has_grid = not any(isinstance(mark, Cells) for mark in box.panel.marks)
    grounds = "".join(told for mark, told in under if isinstance(mark, Spans | Cells))
    rest = "".join(told for mark, told in under if not isinstance(mark, Spans | Cells))
    within = f'<g clip-path="url(#{clip})">{grounds}{_grid(box) if has_grid else ""}{rest}</g>'
    return within + _axes(box) + "".join(told for _, told in over) + map_scale(box) + _labels(box) + _nothing(box)


def _x_places(box: Box) -> list[tuple[float, str]]:
    return _places(box.x_ticks, box.across, box.left, box.right)


def _y_places(box: Box) -> list[tuple[float, str]]:
    return _places(box.y_ticks, box.down, box.top, box.bottom)


def _places(
    ticks: tuple[Tick, ...], along: Callable[[Floats], Floats], low: float, high: float
) -> list[tuple[float, str]]:
    """Return ticks by their points along an edge, those that lie on it."""
    points = along(np.array([place for place, _ in ticks], dtype=np.float64))
    found = zip(points.tolist(), (text for _, text in ticks), strict=True)
    return [(point, text) for point, text in found if low - 0.1 <= point <= high + 0.1]


def _grid(box: Box) -> str:
    lines = [f"M{x:.2f} {box.top:.2f}v{box.height:.2f}" for x, _ in _x_places(box)]
    if not (names_of(box.panel) or has_rows(box.panel)):
        lines += [f"M{box.left:.2f} {y:.2f}h{box.width:.2f}" for y, _ in _y_places(box)]
    return f'<path d="{"".join(lines)}" stroke="{GRID}" stroke-width=".5"/>' if lines else ""


def _axes(box: Box) -> str:
    """Return edges, ticks and their texts as SVG."""
    parts = [f"M{box.left:.2f} {box.top:.2f}V{box.bottom:.2f}H{box.right:.2f}"]
    texts = []
    for x, text in _x_places(box):
        parts.append(f"M{x:.2f} {box.bottom:.2f}v{b.TICK_PT:g}")
        if box.has_x_texts:
            texts.append(written(text, x, box.bottom + b.TICK_PT + b.TO_TEXT_PT + 2 * middle(), "middle"))
    for y, text in _y_places(box):
        if not names_of(box.panel):
            parts.append(f"M{box.left:.2f} {y:.2f}h-{b.TICK_PT:g}")
        if box.has_y_texts:
            texts.append(written(text, box.left - b.TICK_PT - b.TO_TEXT_PT, y + middle(), "end"))
    if box.x_title:
        y = box.bottom + b.TICK_PT + b.TO_TEXT_PT + 2 * LINE_SHARE * SIZE_PT
        texts.append(written(box.x_title, box.left + 0.5 * box.width, y, "middle"))
    texts += _upright_title(box)
    return f'<path d="{"".join(parts)}" fill="none" stroke="{EDGE}" stroke-width=".6"/>' + "".join(texts)


def _upright_title(box: Box) -> Iterator[str]:
    lines = b.title_lines(box.y_title, box.height + 16.0)
    x = box.left - b.TICK_PT - b.TO_TEXT_PT - b.widest(box.y_ticks) - b.TO_TITLE_PT
    for place, line in enumerate(reversed(lines)):
        at = x - LINE_SHARE * SIZE_PT * place - 0.2 * SIZE_PT
        yield written(line, at, box.top + 0.5 * box.height, "middle", is_upright=True)


def _nothing(box: Box) -> str:
    """Return why a panel is empty, as text in the middle of its frame."""
    if not box.panel.nothing:
        return ""
    lines = lines_of(label(box.panel.nothing, 200), box.width - 8.0, 4)
    x, y = box.left + 0.5 * box.width, box.top + 0.5 * box.height + middle()
    first = y - 0.5 * LINE_SHARE * SIZE_PT * (len(lines) - 1)
    return "".join(
        written(line, x, first + LINE_SHARE * SIZE_PT * place, "middle", look=f' fill="{FAINT}"')
        for place, line in enumerate(lines)
    )


def _labels(box: Box) -> str:
    """Return the labels in a frame as SVG, with a halo of paper around their letters."""
    told = (written(one.text, one.left, one.base, look=f' fill="{one.colour}"{HALO}') for one in labels_of(box))
    return "".join(told)


def _around(one: PlacedPanel) -> str:
    """Return the title and legend of a panel, and the scale of its cells."""
    first = one.boxes[0]
    parts = []
    y = first.top - 3.0 - 0.5 * legend.LINE_PT
    for line in reversed(one.lines):
        parts.append(legend.drawn_line(line, one.right, y))
        y -= legend.LINE_PT
    if one.title:
        at = y if one.has_own_line or not one.lines else first.top - 3.0 - 0.5 * legend.LINE_PT
        bold = ' font-weight="bold"'
        parts.append(written(one.title, first.left, at + middle(TITLE_PT), size_pt=TITLE_PT, look=bold))
    cells = b.scale_of(one.panel)
    if cells is not None and one.has_scale:
        parts.append(scale_beside(cells, one.boxes[-1]))
    if one.panel.legend == "beside":
        right = one.right + 8.0 + (b.SCALE_PT if one.has_scale else 0.0)
        parts += [
            legend.drawn(entry, right, first.top + 6.0 + legend.LINE_PT * 1.1 * place)
            for place, entry in enumerate(one.entries)
        ]
    return "".join(parts)
