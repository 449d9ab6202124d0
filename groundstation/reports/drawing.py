"""Figures as inline SVG: one look, one palette, the same bytes for the same numbers.

matplotlib is used through its object-oriented interface alone: no pyplot, no global figure, safe in worker processes.
"""

import gc
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from groundstation.chapters.parts import Part
from groundstation.chapters.wording import clean
from groundstation.plots.ranges import thin
from groundstation.reports.frames import MM_PER_INCH, Samples, frames_of
from groundstation.reports.live import Svg, panels_of

WIDTH_MM = 178.0  # the printable width of A4
MAX_POINTS = 5000
DOT_LENGTH = 1e-9  # of the span of all; a PNG shows no strokes of no length

# Okabe and Ito (2008), colour-blind safe. One meaning, one colour, in every figure.
INS = "#0072b2"
GNSS = "#d55e00"
USED = "#007f5f"
UNUSED = "#a9b1ba"
LIMIT = "#8a2be2"
INK = "#1c2530"
FAINT = "#6b7683"
FILL = "#cfe5dd"
SERIES = (INS, GNSS, USED, "#cc79a7", "#e69f00", "#56b4e9", "#7a6a00")

PHASE_COLOURS = {
    "unknown": "#eef0f2",
    "standstill": "#d9dee3",
    "taxi": "#f6e3b4",
    "take-off run": "#f2b8a0",
    "airborne": "#d3e7f5",
    "landing roll": "#e3cfe6",
}

STYLE: dict[str, Any] = {
    "svg.hashsalt": "groundstation",
    "svg.fonttype": "path",  # glyphs travel with the page: it looks the same on every machine
    "text.parse_math": False,  # a dollar sign in a topic's name is a dollar sign
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 6.0,
    "axes.labelsize": 8.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": "#8d97a3",
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#e4e8ec",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "lines.linewidth": 1.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "legend.borderaxespad": 0.2,
    "path.simplify": True,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "axes.facecolor": "none",
    "text.color": INK,
}

_PROLOG = re.compile(r"^.*?(?=<svg)", re.DOTALL)
_DROPPED = re.compile(r"<!--.*?-->|<metadata>.*?</metadata>|<style[^>]*>.*?</style>", re.DOTALL)
_SIZE = re.compile(r'<svg [^>]*?viewBox="([^"]*)"[^>]*>', re.DOTALL)
_GEOMETRY = re.compile(r'(?<= (?:d|x|y)=")[^"]*|(?<= points=")[^"]*')
_LONG_DECIMAL = re.compile(r"-?\d+\.\d{3,}")
_NAME = re.compile(r'((?<= id=")|(?<=url\(#)|(?<=xlink:href="#))')
_BETWEEN = re.compile(r">\s+<")


@dataclass(frozen=True)
class Drawing(Part):
    """One figure.

    Parameters
    ----------
    title, caption, alt : str
        The caption says what one sees, how many samples, what the lines are; alt is for those who cannot see it.
    svg : Svg
        The only text that the page passes on unescaped: made by reports.drawing alone.
    numbers : sequence of str
        Names of the figure data; the readable copies are tables/<name>.csv.
    name : str
        What the chapter calls the figure.
    """

    kind: ClassVar[str] = "drawing"
    title: str
    caption: str
    alt: str
    svg: Svg
    numbers: Sequence[str] = ()
    name: str = ""


@dataclass(frozen=True)
class Sketch:
    """A figure that is not painted yet: its size and who paints it."""

    height_mm: float
    paint: Callable[[Any], None]
    width_mm: float


_sketches: ContextVar[dict[str, Sketch] | None] = ContextVar("sketches", default=None)


@contextmanager
def sketching() -> Iterator[dict[str, Sketch]]:
    """Gather sketches by key in place of drawing: within, :func:`draw` paints nothing and returns the key."""
    sketches: dict[str, Sketch] = {}
    token = _sketches.set(sketches)
    try:
        yield sketches
    finally:
        _sketches.reset(token)


def is_sketching() -> bool:
    """Whether somebody gathers sketches, and no figure is to be painted."""
    return _sketches.get() is not None


@contextmanager
def report_style() -> Iterator[None]:
    """Set matplotlib's look to the report's for a while; a user's matplotlibrc does not reach it."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)  # type: ignore[arg-type]
        yield


@contextmanager
def _collected_once() -> Iterator[None]:
    """Let the collector wait for a figure: its thousands of objects are looked through once, when it is done."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def draw(key: str, height_mm: float, paint: Callable[[Any], None], width_mm: float = WIDTH_MM) -> Svg:
    """Paint a figure and return it as an SVG element that can stand in a page.

    Parameters
    ----------
    key : str
        Unique in the page: names inside the SVG start with it.
    height_mm, width_mm : float
        Size on paper; on a screen it scales.
    paint : callable
        Receives the empty ``matplotlib.figure.Figure``.

    Returns
    -------
    Svg
        One ``<svg>`` element without comments, metadata, style sheets or anything from outside.
    """
    import io

    sketches = _sketches.get()
    if sketches is not None:
        sketches[key] = Sketch(height_mm, paint, width_mm)
        return Svg(key)
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with report_style(), _collected_once():
        figure = Figure(figsize=(width_mm / MM_PER_INCH, height_mm / MM_PER_INCH))
        FigureCanvasSVG(figure)
        paint(figure)
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
        panels = panels_of(figure)
        return Svg(_for_page(buffer.getvalue(), key), panels, () if panels else frames_of(figure))


def _for_page(svg: str, key: str) -> str:
    svg = _DROPPED.sub("", _PROLOG.sub("", svg, count=1))
    svg = _SIZE.sub(r'<svg xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="\1" aria-hidden="true">', svg, count=1)
    svg = _GEOMETRY.sub(lambda part: _LONG_DECIMAL.sub(_shorter, part[0].replace("\n", "")), svg)
    svg = _NAME.sub(lambda _: f"{key}-", svg)
    return _BETWEEN.sub("><", svg).strip()


def _shorter(match: re.Match[str]) -> str:
    return f"{float(match[0]):.2f}".rstrip("0").rstrip(".")


def label(text: Any, most: int = 40) -> str:
    """Text of a log fit for a figure: characters the font has, one line, bounded length."""
    characters = _font_characters()
    kept = "".join(mark if ord(mark) in characters else "\ufffd" for mark in clean(str(text)))
    return kept if len(kept) <= most else kept[: most - 1] + "…"


_characters: frozenset[int] = frozenset()


def _font_characters() -> frozenset[int]:
    global _characters
    if not _characters:
        from matplotlib.font_manager import FontProperties, findfont, get_font

        font = get_font(findfont(FontProperties(family="DejaVu Sans")))
        _characters = frozenset(font.get_charmap())
    return _characters


def dots(axes: Any, x: Any, y: Any, colour: str, size: float = 1.8, most: int = MAX_POINTS, **options: Any) -> None:
    """Draw samples as dots: strokes of hardly any length with round ends, in one path; a tenth of markers' bytes."""
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    shown = known[thin(len(known), most)]
    x, y = np.asarray(x, dtype=np.float64)[shown], np.asarray(y, dtype=np.float64)[shown]
    name = options.pop("label", None)
    length = DOT_LENGTH * ((np.ptp(x) if len(x) else 0.0) or 1.0)
    _strokes(axes, x, x + length, y, color=colour, linewidth=size, capstyle="round", **options)
    if name:
        axes.plot([], [], "o", color=colour, markersize=2.6, label=name)


def tell(axes: Any, x: Any, y: Any, value: Any, title: str) -> None:
    """Have a page say the value of the sample that is nearest to the cursor; ``title`` says of what."""
    columns = [np.asarray(values, dtype=np.float64).ravel() for values in (x, y, value)]
    known = np.flatnonzero(np.isfinite(columns).all(axis=0))
    shown = known[thin(len(known), MAX_POINTS)]
    axes.samples_told = Samples(title, *(column[shown] for column in columns))


def bars(axes: Any, start: Any, end: Any, place: float, colour: str, width_pt: float) -> None:
    """Draw intervals as thick strokes at one height, in a single path."""
    known = np.isfinite(start) & np.isfinite(end)
    heights = np.full(int(known.sum()), place)
    _strokes(axes, start[known], end[known], heights, color=colour, linewidth=width_pt, capstyle="butt")


def _strokes(axes: Any, start: Any, end: Any, height: Any, **options: Any) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if not len(start):
        return
    corners = np.column_stack([np.column_stack([start, end]).ravel(), np.repeat(height, 2)])
    codes = np.tile([Path.MOVETO, Path.LINETO], len(start)).astype(np.uint8)
    path = Path(corners, codes)
    path.should_simplify = False  # simplifying drops short strokes
    axes.add_artist(PathPatch(path, fill=False, snap=False, **options))  # snapped ends of a dot are one: no dot
    axes.update_datalim(corners)  # add_patch would look for the turning points of every stroke
    axes.autoscale_view()


def line(axes: Any, x: Any, y: Any, colour: str, width: float = 1.0, most: int = MAX_POINTS, **options: Any) -> None:
    """Draw a line that breaks at NaN, thinned without losing its gaps."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    keep = np.zeros(len(x), dtype=bool)
    keep[thin(len(x), most)] = True
    keep |= ~(np.isfinite(x) & np.isfinite(y))
    y = np.where(np.isfinite(x), y, np.nan)
    axes.plot(x[keep], y[keep], color=colour, linewidth=width, **options)


def spans(axes: Any, start: Any, end: Any, name: Any, colours: dict[str, str]) -> None:
    """Shade the background by phase, each phase named once in the legend."""
    seen: set[str] = set()
    for low, high, text in zip(start.tolist(), end.tolist(), name.tolist(), strict=True):
        if np.isfinite(low) and np.isfinite(high):
            colour = colours.get(text, "#eef0f2")
            axes.axvspan(low, high, color=colour, linewidth=0, zorder=0, label=None if text in seen else label(text))
            seen.add(text)


def lanes(axes: Any, start: Any, end: Any, state: Any, states: list[str], colours: dict[str, str]) -> None:
    """Draw one lane per state, strokes where the state holds."""
    for place, name in enumerate(states):
        rows = state == name
        bars(axes, start[rows], end[rows], place, colours.get(name, "#e69f00" if " > " in name else FAINT), 7.0)
    axes.set_yticks(range(len(states)), [label(name, 22) for name in states])
    axes.set_ylim(len(states) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    axes.tick_params(axis="y", length=0)
