"""Data of a page that its script draws live over its pictures.

The panels of each picture as data for uPlot, or only the frames of one that stays a picture. Panels of curves, dots,
bands and lanes over a number live; a figure with a map, cells or names along an axis stays a picture, of which the
frames of its axes are kept. The numbers are those that the picture shows, as float32.
"""

import base64
import json
from collections.abc import Iterable
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass

TIME = "flight time"  # what samples are of that tell it
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class CursorValues:
    """Places in a picture, each with a value that is shown when the cursor is near it.

    ``title`` names the quantity.
    """

    title: str
    x: FloatArray
    y: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class Frame:
    """One pair of axes: its place in the figure and its scales.

    The place is in millimetres from the lower left corner. ``names`` are those along the vertical axis with their
    places, none along an axis of numbers. A range whose first number is the greater runs backwards.
    """

    left_mm: float
    bottom_mm: float
    width_mm: float
    height_mm: float
    title: str
    x_title: str
    y_title: str
    is_time: bool
    has_log_x: bool
    has_log_y: bool
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    names: tuple[tuple[float, str], ...]
    samples: CursorValues | None = field(default=None, kw_only=True)


@dataclass(frozen=True)
class LiveCurve:
    """Mark on axes: line, dots, band (``y`` to ``upper``) or lanes (``x`` to ``upper``).

    ``kind`` says which. ``name`` is empty for what the legend leaves out.
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
class LivePanel(Frame):
    """One pair of axes with its marks.

    ``grounds`` are start, end, colour and name of shaded spans, ``marks`` place and colour of upright lines.
    """

    grounds: tuple[tuple[float, float, str, str], ...]
    marks: tuple[tuple[float, str], ...]
    curves: tuple[LiveCurve, ...]


class Svg(str):
    """Picture as an SVG element, with the panels by which a page draws the same figure live.

    Without panels it stays a picture. ``frames`` are those of its axes.
    """

    panels: tuple[LivePanel, ...]
    frames: tuple[Frame, ...]

    def __new__(cls, text: str, panels: tuple[LivePanel, ...] = (), frames: tuple[Frame, ...] = ()) -> "Svg":
        """Make the element from its text, with its panels and frames."""
        made = super().__new__(cls, text)
        made.panels, made.frames = panels, frames
        return made


def page_data(figures: Iterable[tuple[LivePanel, ...]], pictures: Iterable[tuple[Frame, ...]] = ()) -> str:
    """Return the panels of every live figure of a page as JSON for a script element.

    The frames of every picture are in it too. Arrays are base64 of little-endian float32, NaN where a line breaks;
    equal arrays stand once.
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


def _plain_panel(panel: LivePanel, kept: Any) -> dict[str, Any]:
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
