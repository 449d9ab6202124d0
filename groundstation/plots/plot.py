"""Plot: panels in rows, each with two axes and marks; sizes on paper in millimetres."""

from collections.abc import Callable, Sequence
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.plots.marks import AnyMark

WIDTH_MM = 178.0  # the printable width of A4

# A scale of time is written as minutes and seconds; of an angle in steps of 30; a symlog one is linear about zero; one
# of dates holds seconds since 1970, UTC.
Scale = Literal["linear", "log", "symlog", "time", "angle", "date"]


@dataclass(frozen=True)
class Axis:
    """One axis of a panel.

    Parameters
    ----------
    title : str
        With its unit.
    scale : Scale
    low, high : float, optional
        The range; None: that of what is drawn, a little around it. A range that runs backwards has the greater first.
    names : tuple of (float, str)
        Places that have a name instead of a number: lanes, rows.
    linear_to : float
        Value up to which a symlog axis is linear.
    windows : tuple of (float, float)
        Spans of time that are shown, each in a frame of its own: the axis is broken between them.
    ranges : tuple of (float, float)
        Range of an upright axis in each window of the other axis; none: ``low`` to ``high`` in all.
    ticks : tuple of float
        Places of numbers, where they are not at the usual steps.
    """

    title: str = ""
    scale: Scale = "linear"
    low: float | None = None
    high: float | None = None
    names: tuple[tuple[float, str], ...] = ()
    linear_to: float = 1.0
    windows: tuple[tuple[float, float], ...] = ()
    ranges: tuple[tuple[float, float], ...] = ()
    ticks: tuple[float, ...] = ()


@dataclass(frozen=True)
class Panel:
    """Pair of axes with its marks, the first mark behind.

    Parameters
    ----------
    marks : sequence of marks
    x, y : Axis
    title : str
        Above it, at the left.
    legend : {'above', 'beside', ''}
    is_map : bool
        One metre is as long upright as it is across; the range of one axis grows to fit.
    unit_m : float
        Of a map whose axes are north and east, metres of a unit: it has a scale bar and an arrow to the north. 0: none.
    nothing : str
        Why the panel is empty, where it is: written in its middle.
    share : float
        Share of the width of its row.
    """

    marks: Sequence[AnyMark]
    x: Axis = Axis()
    y: Axis = Axis()
    title: str = ""
    legend: Literal["above", "beside", ""] = "above"
    is_map: bool = False
    unit_m: float = 0.0
    nothing: str = ""
    share: float = 1.0


@dataclass(frozen=True)
class Row:
    """Panels side by side, of one height.

    ``shares_x``: their axis is that of the row below, where it is written. The height is that of the frames; titles,
    legends and numbers stand around them. ``columns``: each panel is as wide as one of so many, where the row holds
    fewer.
    """

    panels: tuple[Panel, ...]
    height_mm: float = 40.0
    shares_x: bool = False
    columns: int = 0


@dataclass(frozen=True)
class Plot:
    """A figure of a chapter.

    Parameters
    ----------
    name : str
        Name in the chapter; unique on a page.
    title, caption, alt : str
        The caption says what one sees, how many samples, what the lines are; alt is for those who cannot see it.
    rows : tuple of Row
        From the top.
    numbers : tuple of str
        Names of the arrays behind it; the readable copies are tables/<name>.csv.
    """

    name: str
    title: str
    caption: str
    alt: str
    rows: tuple[Row, ...]
    numbers: tuple[str, ...] = ()

    @property
    def panels(self) -> tuple[Panel, ...]:
        """All panels, row by row."""
        return tuple(panel for row in self.rows for panel in row.panels)


def one_panel(panel: Panel, height_mm: float) -> tuple[Row, ...]:
    """Return the rows of a plot of one panel."""
    return (Row((panel,), height_mm),)


# Describes a figure, None where there is nothing to show: ``describe(results)``; of several alike with which one it is.
Describe = Callable[..., Plot | None]
