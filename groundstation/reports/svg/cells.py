"""A grid of values by colour, and its scale beside the frame."""

import numpy as np
from numpy.typing import NDArray

from groundstation.plots.extents import edges
from groundstation.plots.marks import Cells, Floats
from groundstation.plots.ranges import thin
from groundstation.plots.scales import NO_PLACES, ScaleSpan, span_of
from groundstation.plots.viridis import viridis
from groundstation.reports.svg import path
from groundstation.reports.svg.boxes import BAR_PT, MOST_OF_A_TITLE, TICK_PT, TO_BAR_PT, TO_TEXT_PT, Box
from groundstation.reports.svg.colours import EDGE, STEPS
from groundstation.reports.svg.font import SIZE_PT, label, middle, width_pt, written
from groundstation.reports.svg.ticks import ticks_of

MOST_CELLS = 90  # along either axis


def cells_shape(mark: Cells, box: Box) -> str:
    """Return the cells of a grid as SVG, for each colour all cells at least as high.

    One over the other, so that no seam shows.
    """
    columns, rows = thin(len(mark.x), MOST_CELLS), thin(len(mark.y), MOST_CELLS)
    if not len(columns) or not len(rows) or mark.values.shape != (len(mark.y), len(mark.x)):
        return ""
    across, down = box.across(edges(mark.x[columns])), box.down(edges(mark.y[rows]))
    if not (np.isfinite(across).all() and np.isfinite(down).all()):
        return ""
    across, down = np.clip(across, box.left, box.right), np.clip(down, box.top, box.bottom)
    levels = _levels(mark, mark.values[np.ix_(rows, columns)])
    parts = []
    for step in np.unique(levels[levels >= 0]).tolist():
        left, right, low, high = _blocks(levels >= step)
        blocks = path.boxes(across[left], across[right], down[low], down[high])
        parts.append(f'<path d="{blocks}" fill="{colour_of_step(step)}"/>')
    return f'<g shape-rendering="crispEdges">{"".join(parts)}</g>'


def colour_of_step(step: int) -> str:
    """Return one of the colours of a scale, from the lowest."""
    return "#" + "".join(f"{part:02x}" for part in viridis((step + 0.5) / STEPS))


def _levels(mark: Cells, values: Floats) -> NDArray[np.int64]:
    """Return the number of the colour of each cell, -1 for none."""
    shares = np.clip(span_of_colours(mark).shares(values), 0.0, 1.0)
    if mark.is_log:
        shares = np.where(values <= 0.0, 0.0, shares)
    known = np.isfinite(shares)
    found = np.clip(np.floor(np.where(known, shares, 0.0) * STEPS), 0, STEPS - 1).astype(np.int64)
    return np.where(known, found, -1)


def span_of_colours(mark: Cells) -> ScaleSpan:
    """Return the scale of the colours of cells with its ends."""
    return span_of("log" if mark.is_log else "linear", mark.low, mark.high, NO_PLACES, is_tight=True)


def _blocks(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], ...]:
    """Return blocks of cells: first column and last + 1, first row and last + 1.

    No cell is in two.
    """
    padded = np.pad(mask.astype(np.int8), ((0, 0), (1, 1)))
    row, left = np.nonzero(np.diff(padded, axis=1) == 1)
    right = np.nonzero(np.diff(padded, axis=1) == -1)[1]
    order = np.lexsort((row, right, left))
    row, left, right = row[order], left[order], right[order]
    is_new = np.ones(len(row), dtype=bool)
    is_new[1:] = (np.diff(left) != 0) | (np.diff(right) != 0) | (np.diff(row) != 1)
    first = np.flatnonzero(is_new)
    last = np.append(first[1:], len(row)) - 1
    return left[first], right[first], row[first], row[last] + 1


def scale_beside(mark: Cells, box: Box) -> str:
    """Return the scale of colours right of a frame, with its ticks and title."""
    span = span_of_colours(mark)
    left, step = box.right + TO_BAR_PT, box.height / STEPS
    parts = []
    for place in range(STEPS):  # each over the one before
        edge = np.array([left]), np.array([left + BAR_PT]), np.array([box.top]), np.array([box.bottom - place * step])
        parts.append(f'<path d="{path.boxes(*edge)}" fill="{colour_of_step(place)}"/>')
    right, widest, marks = left + BAR_PT, 0.0, []
    for value, text in ticks_of(span, box.height, is_upright=True):
        y = box.bottom - box.height * span.share(value)
        marks.append(f"M{right:.2f} {y:.2f}h{TICK_PT:g}")
        parts.append(written(text, right + TICK_PT + TO_TEXT_PT, y + middle()))
        widest = max(widest, width_pt(text))
    parts.append(f'<path d="{"".join(marks)}" stroke="{EDGE}" stroke-width=".6"/>')
    title = label(mark.title, MOST_OF_A_TITLE)
    x = right + TICK_PT + TO_TEXT_PT + widest + SIZE_PT + 2.0
    parts.append(written(title, x, box.top + 0.5 * box.height, "middle", is_upright=True))
    return "".join(parts)
