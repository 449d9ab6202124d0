"""The axes of a painted figure as frames: where they stand, their titles and scales, what a cursor finds in them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

TIME = "flight time"  # the label of axes over flight time, and of samples that tell it
COLOUR_BAR = "<colorbar>"  # the label that matplotlib gives its axes
MM_PER_INCH = 25.4
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Samples:
    """Places in a picture, each with a value that is told when the cursor is near it; ``title`` says of what."""

    title: str
    x: FloatArray
    y: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class Frame:
    """One pair of axes: its place in the figure, in millimetres from the lower left corner, and its scales.

    ``names`` are those along the vertical axis with their places, none along an axis of numbers. A range whose first
    number is the greater runs backwards.
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
    samples: Samples | None = field(default=None, kw_only=True)


def frames_of(figure: Any) -> tuple[Frame, ...]:
    """The frames of a painted figure, but for scales of colour."""
    found = (frame_of(figure, axes) for axes in figure.axes if axes.get_label() != COLOUR_BAR)
    return tuple(frame for frame in found if frame is not None)


def frame_of(figure: Any, axes: Any) -> Frame | None:
    """The frame of axes; None of scales that are neither linear nor logarithmic."""
    if {axes.get_xscale(), axes.get_yscale()} - {"linear", "log"}:
        return None
    width, height = figure.get_size_inches() * MM_PER_INCH
    box = axes.get_position()
    return Frame(
        *(box.x0 * width, box.y0 * height, box.width * width, box.height * height),
        *(axes.get_title(loc="left") or axes.get_title(), axes.get_xlabel(), axes.get_ylabel()),
        *(axes.get_label() == TIME, axes.get_xscale() == "log", axes.get_yscale() == "log"),
        *(_limits(axes.get_xlim()), _limits(axes.get_ylim())),
        _names(axes),
        samples=getattr(axes, "samples_told", None),
    )


def _names(axes: Any) -> tuple[tuple[float, str], ...]:
    """Where the vertical axis has a tick and what stands there, if it is more than numbers."""
    places = axes.get_yticks()
    labels = [str(label) for label in axes.yaxis.get_major_formatter().format_ticks(places)]
    if not any(text and not _is_number(text) for text in labels):
        return ()
    return tuple((float(place), label) for place, label in zip(places, labels, strict=True))


def _is_number(text: str) -> bool:
    try:
        float(text.replace("\u2212", "-"))
    except ValueError:
        return False
    return True


def _limits(limits: tuple[float, float]) -> tuple[float, float]:
    return float(np.float32(limits[0])), float(np.float32(limits[1]))
