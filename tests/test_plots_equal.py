"""A plot that is described shows what its matplotlib drawer shows: every series, band, limit, range and word."""

import dataclasses
import inspect
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.chapters.control import title_of
from groundstation.chapters.plots import PLOTS
from groundstation.chapters.plots.acceptance import JUDGED
from groundstation.chapters.plots.comparison import COMPARED, OVERLAYS, Side
from groundstation.pipeline.many_flights.acceptance import accept
from groundstation.plots.marks import Floats
from groundstation.plots.plot import Plot
from groundstation.reports import comparison
from groundstation.reports.acceptance import DRAWN
from groundstation.reports.drawing import Drawing, Sketch, sketching
from groundstation.reports.figures import DRAWERS
from groundstation.results.files import save
from groundstation.results.flight import FlightResults
from tests.acceptance_example import save_flight
from tests.painted_axes import Shown, Thing, described, painted
from tests.plot_cases import CASES, RECORDED, names_of, recorded
from tests.real_logs import real_log
from tests.report_example import MANIFEST
from tests.saved import load

THINNED = 400  # a drawer thins no series of fewer samples
ROUNDING = {"rtol": 1e-9, "atol": 1e-9}
MILLIMETRE = 0.51
OFTEN = 4  # recorded logs that are compared each time
LEAST_COMPARED = 7  # a session has the others
LEAST_FIGURES = 2  # of any recorded log: track and profile
BESIDE_KM = 0.3

# Differences that are allowed, beside thinning:
# the title of the time axis under the upper right panel of an odd number: each panel of its row has one now
WRITTEN_TWICE = {("cooperative.errors", "A, m"), ("cooperative.errors", "B, m")}
SHARED = "up, m"  # of landing_ranges.space: its horizontal axis is that of the panel above
OF_THREE_WEIGHTS = {title_of("eigenvalue")}  # of control.measures: wide under the one law and over the other
# FIRST_OF_A_WINDOW: a heading that jumped through north just before a window begins has its break there, too


def drawn(name: str, results: FlightResults, of: tuple[str, ...]) -> tuple[Drawing, Sketch] | None:
    """What the drawer tells and would paint."""
    with sketching() as sketches:
        found: Any = DRAWERS[name](results, *of)
    return None if found is None else (found, sketches[found.svg])


def every() -> Iterator[Any]:
    for case in CASES:
        for name in PLOTS:
            yield pytest.param(case, name, id=f"{case}-{name}")


@pytest.mark.parametrize(("case", "name"), list(every()))
def test_the_description_shows_what_the_drawer_paints(case: str, name: str) -> None:
    compare_figure(CASES[case](), name)


@pytest.mark.real_log
@pytest.mark.parametrize(
    "log", [pytest.param(log, marks=[] if place < OFTEN else pytest.mark.slow) for place, log in enumerate(RECORDED)]
)
def test_the_description_of_a_recorded_log_shows_what_the_drawer_paints(log: str, tmp_path: Path) -> None:
    results = recorded(real_log(log), tmp_path)
    assert sum(compare_figure(results, name) for name in PLOTS) >= LEAST_FIGURES


def compare_figure(results: FlightResults, name: str) -> int:
    """Compare a figure with its description, all of those alike; how many there are."""
    count = 0
    for of in names_of(name, results):
        old, new = drawn(name, results, of), PLOTS[name](results, *of)
        assert (old is None) == (new is None), of
        if old is None or new is None:
            continue
        drawing, sketch = old
        assert new.name == ".".join((name, *of))
        same_words(drawing, new)
        compare(painted(sketch), new)
        count += 1
    return count


def compare(old: list[Shown], plot: Plot) -> None:
    panels = described(plot)
    assert len(old) == sum(map(len, panels))
    left = iter(old)
    for panel, windows in zip(plot.panels, panels, strict=True):
        group = [next(left) for _ in windows]
        new = windows[0]
        assert new.y_title == group[0].y_title
        if (plot.name, new.y_title) not in WRITTEN_TWICE:
            assert {one.x_title for one in group} - {""} == {new.x_title} - {""}
        assert {one.title for one in group} - {""} == {new.title} - {""}
        assert group[-1].legend == new.legend, new.y_title
        for before, after in zip(group, windows, strict=True):
            compare_panel(before, after, is_window=bool(panel.x.windows))


def compare_panel(old: Shown, new: Shown, *, is_window: bool) -> None:
    where = new.y_title or new.title
    assert (new.scales, new.is_map, new.nothing) == (old.scales, old.is_map, old.nothing), where
    assert abs(new.height_mm - old.height_mm) < MILLIMETRE, (where, old.height_mm)
    for axis in ("x_range", "y_range"):
        mine, its = getattr(new, axis), getattr(old, axis)
        if old.is_map and old.nothing == "" and mine != (None, None) and its == (None, None):
            continue  # a map of an aircraft at rest: matplotlib only knows what is to be seen
        for one, other in zip(mine, its, strict=True):
            if one is not None:
                assert other is not None, (where, axis, mine)
                np.testing.assert_allclose(one, other, err_msg=f"{where} {axis}", **ROUNDING)
        assert mine != (None, None) or its == (None, None) or where == SHARED, (where, axis, its)
    assert names(new) == names(old), where
    compare_told(old, new)
    compare_things(list(old.things), list(new.things), where, is_window=is_window)


def names(shown: Shown) -> list[tuple[float, str]]:
    """Names beside the axis as far as they are written."""
    return [(place, text[:20]) for place, text in shown.names]


def compare_told(old: Shown, new: Shown) -> None:
    assert (old.told is None) == (new.told is None)
    if old.told is not None and new.told is not None:
        assert new.told.title == old.told.title
        rows = [points(one.told.x, one.told.y, one.told.value) for one in (old, new) if one.told is not None]
        contained(rows[0], rows[1], "told")


def compare_things(old: list[Thing], new: list[Thing], where: str, *, is_window: bool) -> None:
    """Each thing of the one is one of the other, and none is left over."""
    old, new = with_dots_joined(old), with_dots_joined(new)
    for thing in old:
        candidates = [
            one
            for one in new
            if told_of(one) == told_of(thing)
            and (thing.colours <= one.colours or not thing.colours)
            and (one.weight == thing.weight or one.name in OF_THREE_WEIGHTS)
        ]
        fits = [one for one in candidates if is_same(thing, one, is_window=is_window)]
        assert fits, (where, brief(thing), [brief(one) for one in new])
        new.remove(fits[0])
    assert not new, (where, [brief(one) for one in new])


def told_of(thing: Thing) -> tuple[Any, ...]:
    return thing.kind, thing.name, thing.text, thing.is_dashed


def with_dots_joined(things: list[Thing]) -> list[Thing]:
    """Things with a point; dots of one colour without a name are one: a drawer had a call each, or one over another."""
    kept = [one for one in things if has_points(one)]
    loose: dict[frozenset[str], list[Thing]] = {}
    for one in kept:
        if one.kind == "dots" and not one.name:
            loose.setdefault(one.colours, []).append(one)
    joined = []
    for colours, dots in loose.items():
        rows = np.unique(np.concatenate([finite_rows(one) for one in dots]), axis=0)
        joined.append(Thing("dots", "", colours, x=rows[:, 0], y=rows[:, 1]))
    return [*(one for one in kept if one.kind != "dots" or one.name), *joined]


def brief(thing: Thing) -> tuple[Any, ...]:
    known = finite_rows(thing)
    return (
        thing.kind,
        thing.name,
        thing.text,
        sorted(thing.colours),
        thing.is_dashed,
        thing.weight,
        known.shape,
        known[:2].tolist(),
    )


def has_points(thing: Thing) -> bool:
    return len(finite_rows(thing)) > 0


def finite_rows(thing: Thing) -> Floats:
    return points(*(values for values in (thing.x, thing.y, thing.upper) if len(values)))


def points(*columns: Floats) -> Floats:
    """Rows of columns of one length, those without a value left out."""
    if len({len(values) for values in columns}) != 1:
        columns = tuple(np.asarray(values, dtype=float)[: min(map(len, columns))] for values in columns)
    rows = (
        np.column_stack([np.asarray(values, dtype=np.float64).ravel() for values in columns])
        if columns
        else np.zeros((0, 1))
    )
    return rows[np.isfinite(rows).all(axis=1)] if len(rows) else rows


def is_same(old: Thing, new: Thing, *, is_window: bool) -> bool:
    if new.kind == "cells":  # levels of a contour go up to the first beyond the highest value that has its own colour
        return bool(old.x[0] == new.x[0] and old.y[0] < new.y[0] <= old.upper[0])
    if new.kind == "text":  # beside its place
        return bool(np.abs(finite_rows(old) - finite_rows(new)).max() < BESIDE_KM)
    if new.kind == "stepped band":
        return is_same_steps(old, new)
    rows, others = finite_rows(old), finite_rows(new)
    is_cut = is_window and len(rows) == len(others) + 1  # FIRST_OF_A_WINDOW
    try:
        contained(rows[1:] if is_cut else rows, others, new.kind)
    except AssertionError:
        return False
    return True


def is_same_steps(old: Thing, new: Thing) -> bool:
    """Tell whether the corners of a stepped band have the heights of its steps, and all of them."""
    first, second = ({*np.round(one.y, 9).tolist(), *np.round(one.upper, 9).tolist()} for one in (old, new))
    return first == second


def contained(old: Floats, new: Floats, what: str) -> None:
    """Samples drawn are those described: all of them or, of very many, some."""
    if len(old) == len(new):
        order_old, order_new = (np.lexsort(np.round(rows, 6).T) for rows in (old, new))
        np.testing.assert_allclose(old[order_old], new[order_new], err_msg=what, **ROUNDING)
        return
    assert THINNED <= len(old) < len(new), what
    known = {tuple(row) for row in np.round(new, 9).tolist()}
    assert all(tuple(row) in known for row in np.round(old, 9).tolist()), what


@pytest.mark.parametrize("name", JUDGED)
def test_the_description_of_an_acceptance_shows_what_the_drawer_paints(name: str, tmp_path: Path) -> None:
    for number, rate in enumerate((0.3, 0.5, 0.7, 1.4, 0.9)):
        save_flight(tmp_path, number, rate)
    found = accept(tmp_path, "app-g")
    with sketching() as sketches:
        drawing = DRAWN[name](found)
    same_words(drawing, JUDGED[name](found))
    compare(painted(sketches[drawing.svg]), JUDGED[name](found))


def test_the_descriptions_of_a_comparison_show_what_the_drawers_paint(tmp_path: Path) -> None:
    folders = []
    for letter, case in (("a", "report"), ("b", "viewer")):
        save(tmp_path / letter, CASES[case](), MANIFEST)
        folders.append(load(tmp_path / letter))
    sides = [comparison._Side("A", folders[0], comparison.A), comparison._Side("B", folders[1], comparison.B, 3.0)]
    told = [Side("A", folders[0], "drift_windows"), Side("B", folders[1], "drift_windows", 3.0)]
    drawers = {"tracks": comparison._tracks, "growth": comparison._growth}
    drawers |= {one.name: partial(comparison._overlay, told=one) for one in OVERLAYS}
    assert list(COMPARED) == ["tracks", *(one.name for one in OVERLAYS), "growth"]
    count = 0
    for name, describe in COMPARED.items():
        with sketching() as sketches:
            drawing, plot = drawers[name](sides), describe(told)
        assert (drawing is None) == (plot is None), name
        if drawing is not None and plot is not None:
            same_words(drawing, plot)
            compare(painted(sketches[drawing.svg]), plot)
            count += 1
    assert count >= LEAST_COMPARED


def same_words(drawing: Drawing, plot: Plot) -> None:
    assert (plot.title, plot.caption, plot.alt) == (drawing.title, drawing.caption, drawing.alt)
    assert tuple(plot.numbers) == tuple(drawing.numbers)


def test_every_described_plot_has_a_drawer_and_takes_the_same() -> None:
    assert set(PLOTS) <= set(DRAWERS)
    for name, told in PLOTS.items():
        assert len(inspect.signature(told).parameters) == len(inspect.signature(DRAWERS[name]).parameters), name


@pytest.mark.parametrize("name", PLOTS)
def test_every_plot_is_told_in_some_case(name: str) -> None:
    assert any(
        PLOTS[name](results, *of) for case in CASES.values() for results in (case(),) for of in names_of(name, results)
    )


def test_arrays_of_a_description_are_read_only() -> None:
    results = CASES["report"]()
    plot = PLOTS["heading.difference"](results)  # type: ignore[call-arg]
    assert plot is not None
    for panel in plot.panels:
        for mark in panel.marks:
            for part in dataclasses.fields(mark):
                values = getattr(mark, part.name)
                assert not isinstance(values, np.ndarray) or not values.flags.writeable
