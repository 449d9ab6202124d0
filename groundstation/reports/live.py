"""Figures that a reader can zoom into: the axes of a painted figure as data for uPlot, beside the picture of them.

Only axes of curves, dots, bands and lanes over a number are taken; a figure with a map, an image or names along an axis
stays a picture, of which the frames of its axes are kept (reports/frames.py). The numbers are those that the picture
shows, as float32.
"""

import base64
import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from groundstation.reports.frames import FloatArray, Frame, frame_of


@dataclass(frozen=True)
class Curve:
    """What stands on axes: ``kind`` is line, dots, band (``y`` to ``upper``) or lanes (from ``x`` to ``upper``).

    ``name`` is empty for what the legend leaves out.
    """

    kind: str
    name: str
    colour: str
    width: float
    is_dashed: bool
    x: FloatArray
    y: FloatArray
    upper: FloatArray


@dataclass(frozen=True)
class Panel(Frame):
    """One pair of axes with what stands on it.

    ``grounds`` are start, end, colour and name of shaded spans, ``marks`` place and colour of upright lines.
    """

    grounds: tuple[tuple[float, float, str, str], ...]
    marks: tuple[tuple[float, str], ...]
    curves: tuple[Curve, ...]


class Svg(str):
    """A picture as an SVG element, and the panels by which a page draws the same figure live; none: a picture alone.

    ``frames`` are those of its axes.
    """

    panels: tuple[Panel, ...]
    frames: tuple[Frame, ...]

    def __new__(cls, text: str, panels: tuple[Panel, ...] = (), frames: tuple[Frame, ...] = ()) -> "Svg":
        """The text of the element, with its panels and frames."""
        made = super().__new__(cls, text)
        made.panels, made.frames = panels, frames
        return made

    @property
    def is_painted(self) -> bool:
        """Whether it is a picture, not the key of one that is to be painted."""
        return self.startswith("<svg")


def panels_of(figure: Any) -> tuple[Panel, ...]:
    """The axes of a painted figure from left to right and from top to bottom; none where one of them cannot live."""
    panels = [_panel(figure, axes) for axes in figure.axes]
    found = [panel for panel in panels if panel is not None]
    if len(found) < len(panels):
        return ()
    return tuple(sorted(found, key=lambda panel: (-round(panel.bottom_mm), panel.left_mm)))


def page_data(figures: Iterable[tuple[Panel, ...]], pictures: Iterable[tuple[Frame, ...]] = ()) -> str:
    """The panels of every live figure of a page, and the frames of every picture, as JSON for a script element.

    Arrays are base64 of little-endian float32, NaN where a line breaks; equal arrays stand once.
    """
    pool: dict[str, int] = {}

    def kept(values: FloatArray) -> int:
        text = base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")
        return pool.setdefault(text, len(pool))

    whole = {
        "figures": [[_plain_panel(panel, kept) for panel in panels] for panels in figures],
        "pictures": [[_plain(frame, kept) for frame in frames] for frames in pictures],
        "arrays": list(pool),
    }
    return json.dumps(whole, ensure_ascii=True, separators=(",", ":")).replace("<", "\\u003c")


def _plain_panel(panel: Panel, kept: Any) -> dict[str, Any]:
    curves = [
        {
            "kind": one.kind,
            "name": one.name,
            "colour": one.colour,
            "width": round(one.width, 2),
            "dashed": one.is_dashed,
            "x": kept(one.x),
            "y": kept(one.y),
            "upper": kept(one.upper),
        }
        for one in panel.curves
    ]
    return {**_plain(panel, kept), "grounds": panel.grounds, "marks": panel.marks, "curves": curves}


def _plain(frame: Frame, kept: Any) -> dict[str, Any]:
    told = frame.samples
    return {
        "place": [round(value, 1) for value in (frame.left_mm, frame.bottom_mm, frame.width_mm, frame.height_mm)],
        "titles": [frame.title, frame.x_title, frame.y_title],
        "time": frame.is_time,
        "log": [frame.has_log_x, frame.has_log_y],
        "x": list(frame.x_range),
        "y": list(frame.y_range),
        "names": frame.names,
        **({} if told is None else {"samples": [kept(told.x), kept(told.y), kept(told.value)], "of": told.title}),
    }


def _panel(figure: Any, axes: Any) -> Panel | None:
    curves, frame = _curves(axes), frame_of(figure, axes)
    if curves is None or frame is None or axes.get_aspect() != "auto":
        return None
    if frame.names and not any(curve.kind == "lanes" for curve in curves):
        return None  # a place for each name, and no number to zoom into
    marks = tuple((float(one.get_xdata()[0]), _colour(one)) for one in axes.lines if _is_upright(axes, one))
    return Panel(**vars(frame), grounds=tuple(_grounds(axes)), marks=marks, curves=tuple(curves))


def _curves(axes: Any) -> list[Curve] | None:
    """What stands on axes; None with anything among it that is not known here."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import PathPatch, Rectangle, StepPatch

    if axes.images or axes.texts or axes.containers:
        return None
    found: list[Curve | None] = []
    for band in axes.collections:
        found.append(_band(band) if isinstance(band, PolyCollection) else None)
    for patch in axes.patches:
        if isinstance(patch, StepPatch):
            found.append(_steps(patch))
        elif isinstance(patch, PathPatch):
            found.append(_strokes(patch))
        elif not isinstance(patch, Rectangle):
            return None
    named = {
        _colour(one): _name(one) for one in axes.lines if not len(one.get_xdata())
    }  # that stand in the legend alone
    found += [_line(axes, one) for one in axes.lines if not _is_upright(axes, one) and len(one.get_xdata())]
    kept = [one for one in found if one is not None]
    if len(kept) < len(found):
        return None
    return [replace(one, name=one.name or named.get(one.colour, "")) if one.kind == "dots" else one for one in kept]


def _name(artist: Any) -> str:
    text = str(artist.get_label())
    return "" if text.startswith("_") or text == "None" else text


def _colour(artist: Any) -> str:
    from matplotlib.colors import to_hex

    return str(to_hex(artist.get_color()))


def _is_upright(axes: Any, line: Any) -> bool:
    """Whether a line is one across the axes at one place of the horizontal scale."""
    return bool(line.get_transform() == axes.get_xaxis_transform(which="grid"))


def _line(axes: Any, line: Any) -> Curve | None:
    x, y = (np.asarray(values, dtype=np.float64) for values in line.get_data(orig=False))
    if line.get_transform() == axes.get_yaxis_transform(which="grid"):
        x = np.array(axes.get_xlim(), dtype=np.float64)
    kind = "dots" if line.get_linestyle() in ("None", "none", "") else "line"
    if line.get_drawstyle() != "default":
        return None
    known = np.isfinite(x)
    x, y = x[known].copy(), y[known]
    if len(x) > 1 and x[0] > x[-1]:
        x, y = x[::-1], y[::-1]
    breaks = np.flatnonzero(np.isnan(y[:-1])) + 1 if len(y) else np.zeros(0, dtype=np.intp)
    breaks = breaks[(breaks >= 2) & (x[breaks - 1] == x[breaks])] if len(breaks) else breaks
    x[breaks - 1] = 0.5 * (x[breaks - 2] + x[breaks])  # a break of its own place, or it would be lost to the sample
    if kind == "line" and np.any(np.diff(x) < 0.0):
        return None
    is_dashed = line.get_linestyle() in ("--", ":", "-.")
    return Curve(kind, _name(line), _colour(line), float(line.get_linewidth()), is_dashed, x, y, np.zeros(0))


def _strokes(patch: Any) -> Curve:
    """Dots (strokes of no length) or lanes."""
    from matplotlib.colors import to_hex

    corners = patch.get_path().vertices
    start, end, y = corners[::2, 0], corners[1::2, 0], corners[::2, 1]
    colour, width = str(to_hex(patch.get_edgecolor())), float(patch.get_linewidth())
    if patch.get_capstyle() == "round":
        order = np.argsort(start, kind="stable")
        return Curve("dots", _name(patch), colour, width, False, start[order], y[order], np.zeros(0))
    return Curve("lanes", "", colour, width, False, start, y, end)


def _band(band: Any) -> Curve | None:
    """The pieces of a filled band: out along the one edge, back along the other."""
    from matplotlib.colors import to_hex

    xs, lows, highs = [], [], []
    for path in band.get_paths():
        corners = path.vertices
        count = (len(corners) - 3) // 2
        there, back = corners[1 : count + 1], corners[count + 2 : 2 * count + 2][::-1]
        if count < 1 or len(back) != count or not np.array_equal(there[:, 0], back[:, 0]):
            return None
        xs += [there[:, 0], there[-1:, 0]]
        lows += [there[:, 1], [np.nan]]
        highs += [back[:, 1], [np.nan]]
    if not xs:
        return Curve("band", "", "#000000", 0.0, False, *(np.zeros(0),) * 3)
    colour = str(to_hex(band.get_facecolor()[0], keep_alpha=True))
    edges = (np.concatenate(values)[:-1] for values in (xs, lows, highs))
    return Curve("band", _name(band), colour, 0.0, False, *edges)


def _steps(patch: Any) -> Curve:
    """A histogram: a band from zero whose upper edge goes in steps."""
    from matplotlib.colors import to_hex

    values, edges, _ = patch.get_data()
    x, upper = np.repeat(edges, 2)[1:-1], np.repeat(values, 2)
    colour = str(to_hex(patch.get_facecolor()))
    inner = x.copy()
    inner[1:-1:2] = (
        np.nextafter(np.float32(1.0), np.float32(0.0)) * x[1:-1:2]
    )  # two edges at one place: the first before
    return Curve(
        "band", _name(patch), colour, 0.0, False, np.sort(inner), np.zeros(len(x)), np.asarray(upper, dtype=float)
    )


def _grounds(axes: Any) -> Iterable[tuple[float, float, str, str]]:
    from matplotlib.colors import to_hex
    from matplotlib.patches import Rectangle

    for patch in axes.patches:
        if isinstance(patch, Rectangle):
            low = float(patch.get_x())
            colour = str(to_hex(patch.get_facecolor(), keep_alpha=True))
            yield low, low + float(patch.get_width()), colour, _name(patch)
