"""Marks on a panel: curves, dots, bands, lanes, limits, each with a role for its colour.

Every array has one dimension unless said otherwise; NaN is a gap. A mark without a name is left out of the legend.
"""

from collections.abc import Mapping
from dataclasses import field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen

Floats: TypeAlias = NDArray[np.float64]
Texts: TypeAlias = NDArray[np.str_]

# What a mark means; each painter has one colour for each. A series is one of several alike: series 1, series 2 ...
Role = Literal[
    "truth",
    "gnss",
    "ins",
    "answer",
    "limit",
    "unused",
    "paper",
    "ink",
    "faint",
    "good",
    "warn",
    "bad",
    "other",
    "series 1",
    "series 2",
    "series 3",
    "series 4",
    "series 5",
    "series 6",
    "series 7",
]
SERIES: tuple[Role, ...] = ("series 1", "series 2", "series 3", "series 4", "series 5", "series 6", "series 7")
Emphasis = Literal["faint", "thin", "usual", "bold"]  # weight of a mark
Dash = Literal["", "dashed", "dotted"]
Symbol = Literal["dot", "circle", "ring", "triangle", "cross", "star", "diamond"]


def series(place: int) -> Role:
    """Return the role of one of several series alike, starting again behind the seventh.

    Examples
    --------
    >>> series(0), series(8)
    ('series 1', 'series 2')
    """
    return SERIES[place % len(SERIES)]


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Anything that is drawn on a panel.

    Parameters
    ----------
    role : Role
    name : str
        In the legend and beside the cursor; empty: neither.
    emphasis : {'faint', 'thin', 'usual', 'bold'}
    """

    role: Role = "ink"
    name: str = ""
    emphasis: Emphasis = "usual"

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                object.__setattr__(self, name, frozen(value))


@dataclass(frozen=True, kw_only=True)
class Curve(Mark):
    """Line through samples; it breaks at NaN.

    ``steps``: each value holds about its place, as of a histogram.
    """

    x: Floats
    y: Floats
    dash: Dash = ""
    steps: bool = False


@dataclass(frozen=True, kw_only=True)
class Dots(Mark):
    """Samples as single dots."""

    x: Floats
    y: Floats


@dataclass(frozen=True, kw_only=True)
class Band(Mark):
    """Area between two curves; with ``steps`` each edge holds about its place."""

    x: Floats
    low: Floats
    high: Floats
    steps: bool = False


@dataclass(frozen=True, kw_only=True)
class Histogram(Mark):
    """Bars from zero that touch: ``edges`` has one value more than ``heights``."""

    edges: Floats
    heights: Floats


@dataclass(frozen=True, kw_only=True)
class Lanes(Mark):
    """States over time, a lane each, drawn where they hold.

    ``roles`` are those of some states, the others take ``role``. ``order`` names the lanes from the top; what is not in
    it is not drawn.
    """

    start: Floats
    end: Floats
    state: Texts
    order: tuple[str, ...]
    roles: Mapping[str, Role] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Spans(Mark):
    """Shaded background between places of the horizontal axis.

    A phase of flight as ``kind`` has a shade of its own, any other a faint one of the role. With a name each kind
    stands in the legend once, as itself; where it is empty, by the name.
    """

    start: Floats
    end: Floats
    kind: Texts


@dataclass(frozen=True, kw_only=True)
class Limit(Mark):
    """Dashed line across the panel at a value; upright at a place of the horizontal axis.

    A ``label`` stands beside the line, where the name stands in the legend.
    """

    value: float
    is_upright: bool = False
    role: Role = "limit"
    dash: Dash = "dashed"
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Bars(Mark):
    """Values with their 95 % intervals, upright.

    ``half`` is half of each interval, NaN where it is not known.
    """

    x: Floats
    y: Floats
    half: Floats


@dataclass(frozen=True, kw_only=True)
class Intervals(Mark):
    """Rows with nested horizontal intervals, one row each as in a forest plot.

    Parameters
    ----------
    row : int
        From the top; its name is in ``Axis.names``.
    value : float
    thin, thick : pair of floats, optional
        Ends of the outer and the inner interval.
    symbol
        Symbol of the value.
    """

    row: int
    value: float
    thin: tuple[float, float] | None = None
    thick: tuple[float, float] | None = None
    symbol: Symbol = "dot"


@dataclass(frozen=True, kw_only=True)
class Points(Mark):
    """Points with a symbol, and a label where there is one.

    ``is_hollow`` marks those that are not judged.
    """

    x: Floats
    y: Floats
    symbol: Symbol = "dot"
    labels: tuple[str, ...] = ()
    is_hollow: bool = False


@dataclass(frozen=True, kw_only=True)
class Outlines(Mark):
    """Closed lines: ellipses, polygons, coasts. ``rings`` have shape (n, 2), horizontal first.

    ``magnified`` is how many times their size ellipses are drawn; ``is_filled`` fills them with a faint shade.
    ``makes_room``: axes are long enough for them; else they are cut at the frame.
    """

    rings: tuple[Floats, ...]
    magnified: float = 1.0
    is_filled: bool = False
    labels: tuple[str, ...] = ()
    dash: Dash = ""
    makes_room: bool = True


@dataclass(frozen=True, kw_only=True)
class Cells(Mark):
    """Grid of values by colour, shape (len(y), len(x)), NaN empty.

    Values beyond ``high`` have its colour.
    """

    x: Floats
    y: Floats
    values: Floats
    low: float
    high: float
    title: str  # title of the scale, with its unit
    is_log: bool = False


@dataclass(frozen=True, kw_only=True)
class Told(Mark):
    """Value that is shown when the cursor is near a place; nothing is drawn.

    ``title`` says of what it is.
    """

    x: Floats
    y: Floats
    value: Floats
    title: str
    is_time: bool = False


AnyMark: TypeAlias = (
    Curve | Dots | Band | Histogram | Lanes | Spans | Limit | Bars | Intervals | Points | Outlines | Cells | Told
)
