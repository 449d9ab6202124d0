"""Scale bar of a map and its arrow to the north, in the corner that the track leaves free."""

import math

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.chapters.wording import NARROW_SPACE
from groundstation.plots.marks import Curve, Floats, Points
from groundstation.reports.svg.boxes import Box
from groundstation.reports.svg.colours import INK, PAPER
from groundstation.reports.svg.font import CAP_SHARE, SIZE_PT, width_pt, written
from groundstation.reports.svg.labels import HALO_PT

LONGEST_SHARE, LONGEST_PT = 0.25, 90.0  # of a bar: of the width of the frame, and at all
LEAST_PT = 60.0  # of a frame with a bar
FROM_EDGE_PT, TO_ARROW_PT, TO_NUMBER_PT = 7.0, 9.0, 3.0
END_PT, BAR_PT = 3.0, 1.0  # height of the ends of the bar, width of its line
ARROW_PT, HALF_ARROW_PT, NOTCH_PT, TO_LETTER_PT = 9.0, 3.2, 2.2, 1.6
NORTH = "N"
HEIGHT_PT = ARROW_PT + TO_LETTER_PT + CAP_SHARE * SIZE_PT
PER_KM = 1000.0


@dataclass(frozen=True)
class MapScale:
    """Places of bar, its number, arrow and letter.

    Units are points from the upper left corner of the picture.
    """

    left: float
    right: float
    bottom: float  # of bar and arrow
    text: str
    arrow: float  # middle of the arrow

    @property
    def middle(self) -> float:
        """Middle of the bar."""
        return 0.5 * (self.left + self.right)

    @property
    def number_base(self) -> float:
        """Base line of the number."""
        return self.bottom - TO_NUMBER_PT

    @property
    def letter_base(self) -> float:
        """Base line of the letter above the arrow."""
        return self.bottom - ARROW_PT - TO_LETTER_PT

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Corners of the arrow."""
        x, y = self.arrow, self.bottom
        return (x, y - ARROW_PT), (x + HALF_ARROW_PT, y), (x, y - NOTCH_PT), (x - HALF_ARROW_PT, y)


def map_scale_of(box: Box) -> MapScale | None:
    """Return the scale of a frame that is a map; None of another, or of one too small."""
    panel = box.panel
    if not (panel.is_map and panel.unit_m > 0.0) or panel.nothing or min(box.width, box.height) < LEAST_PT:
        return None
    metres_per_pt = panel.unit_m * (box.x.high - box.x.low) / box.width
    length_m = round_length_m(metres_per_pt * min(LONGEST_SHARE * box.width, LONGEST_PT))
    bar = length_m / metres_per_pt
    if not math.isfinite(bar) or length_m <= 0.0:
        return None
    text = length_text(length_m)
    wide = max(bar, width_pt(text))
    left, bottom = _corner(box, wide + TO_ARROW_PT + HALF_ARROW_PT, HEIGHT_PT)
    start = left + 0.5 * (wide - bar)
    return MapScale(start, start + bar, bottom, text, left + wide + TO_ARROW_PT)


def round_length_m(most_m: float) -> float:
    """Return the greatest of 1, 2 and 5 times a power of ten that is not more.

    0 where there is none.

    Examples
    --------
    >>> round_length_m(70.0), round_length_m(2400.0), round_length_m(1.0), round_length_m(0.3)
    (50.0, 2000.0, 1.0, 0.2)
    """
    if not (math.isfinite(most_m) and most_m > 0.0):
        return 0.0
    power = 10.0 ** math.floor(math.log10(most_m) + 1e-12)
    return next((part * power for part in (5.0, 2.0) if part * power <= most_m * (1.0 + 1e-9)), power)


def length_text(length_m: float) -> str:
    """Return a round length with its unit.

    Examples
    --------
    >>> [length_text(length_m).replace(NARROW_SPACE, " ") for length_m in (0.2, 50.0, 2000.0, 1e6)]
    ['0.2 m', '50 m', '2 km', '1000 km']
    """
    size, unit = (length_m / PER_KM, "km") if length_m >= PER_KM else (length_m, "m")
    return f"{size:.10g}{NARROW_SPACE}{unit}"


def _corner(box: Box, wide: float, high: float) -> tuple[float, float]:
    """Return the left and lower end of a field in the corner that is the emptiest."""
    lefts = box.right - FROM_EDGE_PT - wide, box.left + FROM_EDGE_PT
    bottoms = box.bottom - FROM_EDGE_PT, box.top + FROM_EDGE_PT + high
    corners = [(left, bottom) for bottom in bottoms for left in lefts]
    x, y = _places(box)
    counts = []
    for left, bottom in corners:
        inside = (x >= left - HALO_PT) & (x <= left + wide + HALO_PT)
        inside &= (y >= bottom - high - HALO_PT) & (y <= bottom + HALO_PT)
        counts.append(int(inside.sum()))
    return corners[counts.index(min(counts))]


def _places(box: Box) -> tuple[Floats, Floats]:
    marks = [mark for mark in box.panel.marks if isinstance(mark, Curve | Points)]
    x = np.concatenate([np.zeros(0), *(box.across(mark.x) for mark in marks)])
    y = np.concatenate([np.zeros(0), *(box.down(mark.y) for mark in marks)])
    return x, y


def map_scale(box: Box) -> str:
    """Return bar and arrow of a map as SVG, with a halo of paper; empty of what is no map."""
    scale = map_scale_of(box)
    if scale is None:
        return ""
    bar = f"M{scale.left:.2f} {scale.bottom - END_PT:.2f}v{END_PT:g}H{scale.right:.2f}v-{END_PT:g}"
    arrow = "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in scale.corners) + "z"
    halo = f'<path d="{bar}{arrow}" fill="none" stroke="{PAPER}" stroke-width="{BAR_PT + HALO_PT:g}"/>'
    drawn = f'<path d="{bar}" fill="none" stroke="{INK}" stroke-width="{BAR_PT:g}"/><path d="{arrow}" fill="{INK}"/>'
    look = f' stroke="{PAPER}" stroke-width="{HALO_PT:g}" paint-order="stroke"'
    number = written(scale.text, scale.middle, scale.number_base, "middle", look=look)
    return halo + number + written(NORTH, scale.arrow, scale.letter_base, "middle", look=look) + drawn
