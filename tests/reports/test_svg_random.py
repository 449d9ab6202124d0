"""Plots of random marks, numbers and axes: every one is a whole picture, without a warning."""

import random
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from groundstation.plots.marks import (
    SERIES,
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
from groundstation.plots.plot import Axis, Panel, Plot, Row
from groundstation.reports.live import page_data
from groundstation.reports.svg.picture import picture_of

SEEDS = range(40)  # each a plot of up to nine panels


def values(rng: random.Random, count: int) -> Floats:
    """Numbers of one kind, some of them not finite."""
    kinds = (
        lambda: rng.uniform(-1.0, 1.0),
        lambda: rng.gauss(0.0, 1e6),
        lambda: rng.choice([0.0, 1.0]),
        lambda: 10.0 ** rng.uniform(-320.0, 308.0),
        lambda: rng.uniform(0.0, 4e9),
    )
    kind = rng.choice(kinds)
    made = np.array([kind() for _ in range(count)])
    if count and rng.random() < 0.5:
        made[[rng.randrange(count) for _ in range(rng.randrange(1, count + 1))]] = rng.choice([np.nan, np.inf, -np.inf])
    return np.sort(made) if rng.random() < 0.5 else made


def pair(rng: random.Random) -> tuple[float, float] | None:
    low, high = values(rng, 2).tolist()
    return rng.choice([None, (low, high)])


def texts(rng: random.Random, count: int) -> np.ndarray[tuple[int], np.dtype[np.str_]]:
    return np.array([rng.choice(["taxi", "", "b"]) for _ in range(count)], dtype=np.str_)


def mark(rng: random.Random) -> AnyMark:
    count = rng.choice([0, 1, 2, 3, 30, 1200])
    x, y, z = (values(rng, count) for _ in range(3))
    name, role = rng.choice(["", "a", "x" * 300, "\x00<&"]), rng.choice(SERIES)
    is_so, one = rng.random() < 0.5, float(values(rng, 1)[0])
    places = rng.choice([0, 1, 4, 100])
    columns = min(count, 100)
    made: tuple[AnyMark, ...] = (
        Curve(x=x, y=y, steps=is_so, dash=rng.choice(["", "dashed", "dotted"]), name=name, role=role),
        Dots(x=x, y=y, name=name, role=role),
        Band(x=x, low=y, high=z, steps=is_so, name=name),
        Histogram(edges=values(rng, count + 1), heights=y, name=name),
        Lanes(start=x, end=y, state=texts(rng, count), order=rng.choice([(), ("taxi", "b"), ("c",)])),
        Spans(start=x, end=y, kind=texts(rng, count), name=name),
        Limit(value=one, is_upright=is_so, label=name),
        Bars(x=x, y=y, half=z, name=name),
        Intervals(row=rng.randrange(5), value=one, thin=pair(rng), thick=pair(rng), symbol="diamond"),
        Points(x=x, y=y, symbol=rng.choice(["ring", "triangle", "cross", "star"]), labels=("a", name), is_hollow=is_so),
        Outlines(rings=(np.column_stack([x, y]),), labels=(name,), is_filled=is_so),
        Cells(
            x=x[:columns],
            y=values(rng, places),
            values=values(rng, columns * places).reshape(places, columns),
            low=one,
            high=float(values(rng, 1)[0]),
            title=name,
            is_log=is_so,
        ),
        Told(x=x, y=y, value=z, title=name, is_time=is_so),
    )
    return rng.choice(made)


def axis(rng: random.Random) -> Axis:
    return Axis(
        rng.choice(["", "t", "long " * 30]),
        rng.choice(["linear", "log", "symlog", "time", "angle", "date"]),
        rng.choice([None, float(values(rng, 1)[0])]),
        rng.choice([None, float(values(rng, 1)[0])]),
        rng.choice([(), (), ((0.0, "z"), (1.0, "y"))]),
        rng.choice([1.0, 20.0, 0.0, -1.0, np.nan, 1e-300]),
        rng.choice([(), (), ((0.0, 5.0), (10.0, 11.0)), ((1.0, 1.0),)]),
        rng.choice([(), ((0.0, 1.0), (2.0, 3.0))]),
        rng.choice([(), (), (0.0, 1.5)]),
    )


def panel(rng: random.Random) -> Panel:
    marks = [mark(rng) for _ in range(rng.randrange(4))]
    legend = rng.choice(["above", "beside", ""])
    is_map = rng.random() < 0.2
    unit_m = rng.choice([0.0, 1.0, 1000.0]) if is_map else 0.0
    return Panel(
        marks,
        axis(rng),
        axis(rng),
        rng.choice(["", "T"]),
        legend,
        is_map,
        unit_m=unit_m,
        nothing=rng.choice(["", "no"]),
    )


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("seed", SEEDS)
def test_random_plot_is_a_whole_picture(seed: int) -> None:
    rng = random.Random(seed)
    rows = [
        Row(
            tuple(panel(rng) for _ in range(rng.choice([1, 1, 2, 3]))),
            rng.choice([40.0, 5.0, 100.0]),
            rng.random() < 0.4,
            rng.choice([0, 0, 2, 3]),
        )
        for _ in range(rng.choice([1, 2, 3]))
    ]
    picture = picture_of(Plot("made", "", "", "", tuple(rows)))
    ET.fromstring(picture)
    assert not re.search(r"\b(nan|inf)\b", picture)
    page_data([picture.panels], [picture.frames])
