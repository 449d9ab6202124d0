"""A plot of every mark, drawn and empty, for the tests of painters."""

from collections.abc import Mapping

import numpy as np

from groundstation.plots.marks import (
    AnyMark,
    Band,
    Bars,
    Cells,
    Curve,
    Dots,
    Floats,
    Histogram,
    Intervals,
    Lanes,
    Limit,
    Outlines,
    Points,
    Spans,
    Told,
)
from groundstation.plots.plot import Axis, Panel, Plot, one_panel

X = np.arange(5.0)
Y = np.array([1.0, 3.0, 2.0, 5.0, 4.0])
SQUARE = np.array([(0.0, 1.0), (4.0, 1.0), (4.0, 4.0), (0.0, 1.0)])
NO_TEXT = np.zeros(0, dtype=np.str_)

DRAWN: Mapping[str, AnyMark] = {
    "curve": Curve(x=X, y=Y, role="ins", name="a curve"),
    "steps": Curve(x=X, y=Y, steps=True, dash="dashed"),
    "dots": Dots(x=X, y=Y, role="gnss"),
    "band": Band(x=X, low=Y - 1.0, high=Y + 1.0),
    "steps of a band": Band(x=X, low=Y - 1.0, high=Y + 1.0, steps=True),
    "histogram": Histogram(edges=np.arange(6.0), heights=Y),
    "lanes": Lanes(start=X, end=X + 0.5, state=np.array(["a", "b", "a", "b", "a"]), order=("a", "b")),
    "spans": Spans(start=X[:2], end=X[:2] + 0.5, kind=np.array(["taxi", "what"]), name="ground"),
    "limit": Limit(value=2.0, label="at most"),
    "upright limit": Limit(value=2.0, is_upright=True),
    "bars": Bars(x=X, y=Y, half=np.array([0.5, 0.5, np.nan, 0.5, 0.5])),
    "intervals": Intervals(row=0, value=1.0, thin=(0.5, 1.5), thick=(0.8, 1.2), symbol="diamond"),
    "points": Points(x=X, y=Y, symbol="star", labels=("A", "B", "", "D", "E")),
    "outlines": Outlines(rings=(SQUARE,), labels=("square",), is_filled=True),
    "cells": Cells(x=X, y=X, values=np.outer(Y, Y), low=1.0, high=20.0, title="sigma, m"),
}


def empty(mark: AnyMark) -> AnyMark | None:
    """The mark with nothing on it; None of one that is always drawn."""
    none: Floats = np.zeros(0)
    if isinstance(mark, Curve | Dots):
        return type(mark)(x=none, y=none)
    if isinstance(mark, Band):
        return Band(x=none, low=none, high=none, steps=mark.steps)
    if isinstance(mark, Histogram):
        return Histogram(edges=none, heights=none)
    if isinstance(mark, Lanes):
        return Lanes(start=none, end=none, state=NO_TEXT, order=())
    if isinstance(mark, Spans):
        return Spans(start=none, end=none, kind=NO_TEXT)
    if isinstance(mark, Limit):
        return Limit(value=np.nan, is_upright=mark.is_upright)
    if isinstance(mark, Bars):
        return Bars(x=none, y=none, half=none)
    if isinstance(mark, Intervals):
        return Intervals(row=0, value=np.nan)
    if isinstance(mark, Points):
        return Points(x=none, y=none)
    if isinstance(mark, Outlines):
        return Outlines(rings=())
    if isinstance(mark, Cells):
        return Cells(x=none, y=none, values=np.zeros((0, 0)), low=0.0, high=1.0, title="")
    return Told(x=none, y=none, value=none, title="")


def plot_of(*marks: AnyMark, x: Axis | None = None, y: Axis | None = None, name: str = "made") -> Plot:
    """A plot of one panel with some marks."""
    panel = Panel(marks, x or Axis("across"), y or Axis("up"), title="A panel")
    return Plot(name, "Made", "Made for a test.", "Made for a test.", one_panel(panel, 40.0))
