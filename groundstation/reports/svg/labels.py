"""Places of labels beside points, within outlines, at lines; no label covers another."""

from collections.abc import Iterator

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.plots.marks import Limit, Outlines, Points
from groundstation.reports.svg.boxes import EDGE_PT, Box
from groundstation.reports.svg.colours import COLOURS, FAINT
from groundstation.reports.svg.font import LINE_SHARE, SIZE_PT, label, middle, width_pt

MOST_LABELS, MOST_OF_A_LABEL = 60, 24
MOST_STEPS = 6  # of a label along its line, away from others
LABEL_SHARE = 0.66  # of the width: where the label of a line across begins
HALO_PT = 2.4  # of paper, about the letters
Bounds = tuple[float, float, float, float]


@dataclass(frozen=True)
class Label:
    """Text at a place (x, y), and where its line begins.

    Units are points from the upper left corner of the picture.
    """

    text: str
    colour: str
    x: float
    y: float
    left: float
    base: float


def labels_of(box: Box) -> tuple[Label, ...]:
    """Return labels of lines across a frame, then those of points and outlines in it."""
    taken: list[Bounds] = []
    return (*_beside_lines(box, taken), *_at_places(box, taken))


def _beside_lines(box: Box, taken: list[Bounds]) -> Iterator[Label]:
    """Yield labels above level lines and right of upright ones.

    Of two that would meet the later one moves along its line.
    """
    for mark in box.panel.marks:
        if not isinstance(mark, Limit) or not mark.label:
            continue
        shown, colour = label(mark.label, MOST_OF_A_LABEL), COLOURS[mark.role]
        place = float((box.across if mark.is_upright else box.down)(np.array([mark.value]))[0])
        low, high = (box.left, box.right) if mark.is_upright else (box.top, box.bottom)
        if not low <= place <= high:
            continue
        if mark.is_upright:
            base = _clear(place + 2.0, box.top + SIZE_PT, shown, taken, (0.0, LINE_SHARE * SIZE_PT), box)[1]
            yield Label(shown, colour, place, base, place + 2.0, base)
        else:
            wide = width_pt(shown)
            first = box.left + min(LABEL_SHARE * box.width, max(box.width - wide - 2.0, 0.0))
            left = _clear(first, place - 2.0, shown, taken, (-wide - SIZE_PT, 0.0), box)[0]
            yield Label(shown, colour, left, place, left, place - 2.0)


def _clear(
    left: float, base: float, text: str, taken: list[Bounds], step: tuple[float, float], box: Box
) -> tuple[float, float]:
    """Return left end and base line of a label where no other stands, in steps along its line.

    They are the first ones where there is no such place.
    """
    tries = [(left + number * step[0], base + number * step[1]) for number in range(MOST_STEPS)]
    inside = [one for one in tries if one[0] >= box.left and one[1] <= box.bottom]
    free = (one for one in inside if not any(_meet(_bounds(*one, width_pt(text)), other) for other in taken))
    place = next(free, tries[0])
    taken.append(_bounds(*place, width_pt(text)))
    return place


def _bounds(left: float, base: float, wide: float) -> Bounds:
    return left, base - SIZE_PT, left + wide, base + 0.2 * SIZE_PT


def _at_places(box: Box, taken: list[Bounds]) -> Iterator[Label]:
    wanted: list[tuple[float, float, str, str, bool]] = []
    for mark in box.panel.marks:
        if isinstance(mark, Points):
            places = zip(box.across(mark.x).tolist(), box.down(mark.y).tolist(), mark.labels, strict=False)
            wanted += [(x, y, text, COLOURS[mark.role], False) for x, y, text in places]
        elif isinstance(mark, Outlines):
            for ring, text in zip(mark.rings, mark.labels, strict=False):
                corners = np.column_stack([box.across(ring[:-1, 0]), box.down(ring[:-1, 1])])
                corners = corners[np.isfinite(corners).all(axis=1)]
                if len(corners):
                    middle_x, middle_y = corners.mean(axis=0).tolist()
                    wanted.append((middle_x, middle_y, text, FAINT, True))
    inside = [one for one in wanted if box.left <= one[0] <= box.right and box.top <= one[1] <= box.bottom and one[2]]
    for x, y, text, colour, is_middle in inside[:MOST_LABELS]:
        shown = label(text, MOST_OF_A_LABEL)
        left, base = _free(x, y, width_pt(shown), taken, box, is_middle)
        yield Label(shown, colour, x, y, left, base)


def _free(x: float, y: float, wide: float, taken: list[Bounds], box: Box, is_middle: bool) -> tuple[float, float]:
    """Return left end and base line of a label where no other stands.

    Above its place, below, right or left of it.
    """
    high = SIZE_PT
    above, below, level = y - 4.5, y + 4.0 + 2 * middle(), y + middle()
    tries = [(x - 0.5 * wide, above), (x - 0.5 * wide, below), (x + 5.0, level), (x - 5.0 - wide, level)]
    if is_middle:
        tries.insert(0, (x - 0.5 * wide, level))
    tries += [(x - 0.5 * wide, above - high), (x - 0.5 * wide, below + high)]
    tries += [(x + 3.0, above), (x - 3.0 - wide, above), (x + 3.0, below), (x - 3.0 - wide, below)]
    bounds = [_bounds(*one, wide) for one in tries]
    is_free = [_inside(one, box) and not any(_meet(one, other) for other in taken) for one in bounds]
    place = is_free.index(True) if True in is_free else 0
    taken.append(bounds[place])
    return tries[place]


def _inside(one: Bounds, box: Box) -> bool:
    return one[0] >= box.left - 20.0 and one[2] <= box.right + EDGE_PT and one[1] >= box.top and one[3] <= box.bottom


def _meet(one: Bounds, other: Bounds) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
