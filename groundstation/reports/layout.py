"""Where axes, their limits, legends and labels stand in a figure; millimetres from its lower left corner."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from groundstation.chapters.wording import clock
from groundstation.reports.drawing import FAINT, LIMIT
from groundstation.reports.frames import MM_PER_INCH, TIME

PANEL_GAP_MM, LEAST_PANEL_MM = 9.0, 20.0


def place(figure: Any, left: float, bottom: float, right: float, top: float, **options: Any) -> Any:
    """Add axes whose edges lie so many millimetres from the lower left corner of the figure."""
    width, height = figure.get_size_inches() * MM_PER_INCH
    return figure.add_axes((left / width, bottom / height, (right - left) / width, (top - bottom) / height), **options)


def time_axis(axes: Any, low: float, high: float, title: bool = True, most: int = 9) -> None:
    """Scale the horizontal axis as flight time, written as minutes and seconds at ``most`` round steps."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    low, high = (low, high) if high > low else (low - 1.0, low + 1.0)
    steps = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400)
    step = next((step for step in steps if (high - low) / step <= most), 604800)
    first = int(np.ceil(low / step))
    ticks = [step * count for count in range(first, first + 12) if step * count <= high]
    axes.set_label(TIME)
    axes.set_xlim(low, high)
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: clock(float(value))))
    if title:
        axes.set_xlabel("flight time, h:min:s" if high >= 3600 else "flight time, min:s")
    else:
        axes.tick_params(labelbottom=False)


def time_panels(
    figure: Any,
    edges_mm: tuple[float, float, float, float],
    spans: Sequence[tuple[float, float]],
    *,
    title: bool = True,
    shared: bool = True,
) -> list[Any]:
    """Axes beside each other, one for each span of flight time: a time axis broken where nothing is to be seen.

    Parameters
    ----------
    edges_mm : (float, float, float, float)
        Left, bottom, right and top, from the lower left corner of the figure.
    title : bool
        Whether the time axis is written.
    shared : bool
        Whether all have the vertical scale of the first; else each has its own, written beside it.
    """
    left, bottom, right, top = edges_mm
    room = right - left - PANEL_GAP_MM * (len(spans) - 1)
    lengths = np.array([high - low for low, high in spans])
    widths = np.maximum(lengths / lengths.sum() * room, LEAST_PANEL_MM)
    widths *= room / widths.sum()
    panels: list[Any] = []
    for (low, high), width in zip(spans, widths.tolist(), strict=True):
        options = {"sharey": panels[0]} if panels and shared else {}
        axes = place(figure, left, bottom, left + width, top, **options)
        time_axis(axes, low, high, title=title and width == widths.max(), most=max(int(width / 16.0), 1))
        axes.tick_params(labelbottom=title, labelleft=not (panels and shared))
        panels.append(axes)
        left += width + PANEL_GAP_MM
    return panels


def legend_above(axes: Any, columns: int = 6) -> None:
    """Put the legend on one line above the axes, where it hides nothing."""
    handles, _ = axes.get_legend_handles_labels()
    if handles:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, columnspacing=1.2, borderpad=0.1)


def limit_line(axes: Any, value: float, text: str, vertical: bool = False, colour: str = LIMIT) -> None:
    """Draw a limit as a dashed line; its text goes to the legend, where it hides no curve. Empty: no text."""
    style = {"color": colour, "linewidth": 0.9, "linestyle": (0, (4, 2)), "zorder": 3, "label": text or None}
    (axes.axvline if vertical else axes.axhline)(value, **style)


def beside(axes: Any, x: float, y: float, text: str, colour: str, transform: Any, ha: str) -> None:
    """Write a short label just above a place, its letters edged in white to be legible over lines."""
    from matplotlib.patheffects import withStroke

    axes.annotate(
        text,
        (x, y),
        (0, 2),
        xycoords=transform,
        textcoords="offset points",
        color=colour,
        fontsize=8,
        va="bottom",
        ha=ha,
        path_effects=[withStroke(linewidth=1.6, foreground="white")],
        zorder=6,
    )


def nothing(axes: Any, text: str) -> None:
    """Say in the middle of empty axes why they are empty."""
    axes.set_yticks([])
    axes.text(0.5, 0.5, text, color=FAINT, ha="center", va="center", transform=axes.transAxes)
