"""Tab on the heading: the INS heading error on straight taxi, its growth, its basis."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.chapters.wording import clock
from groundstation.plots.plot import Plot, one_panel
from groundstation.results.flight import FlightResults
from groundstation.systems.heading import distribution_tab as distribution
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.arrays import HeadingLanes, HeadingRunning, HeadingSamples
from groundstation.systems.heading.chapter import heading as heading_chapter
from groundstation.viewer.plot_views import panels_of, plot_of, runs_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document

AFTER_TAXI = ("too fast", "take-off run", "landing roll", "airborne")
WHOLE = 0.5  # a run that is this share of the flight needs no view of its own


def heading(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the heading tab; None when the flight was not assessed: the overview says why."""
    if results.answer(HeadingResult) is None:
        return None
    recorder.document("heading/verdict", markdown(heading_chapter(results)))
    verdict = document("Verdict and the number to type", "heading/verdict")
    on_ground = _on_ground(results)
    plots = [plot_of(recorder, name, on_ground) for name in ("heading.difference", "heading.taxi")]
    views = [view for one in plots for view in panels_of(recorder, one)]
    runs = _runs(recorder, results, plots)
    pictures = [
        *distribution.heading_error(recorder, results),
        *panels_of(recorder, _first_panel(plot_of(recorder, "standstill.components", results))),
        *panels_of(recorder, plot_of(recorder, "standstill.mean_speed", results), height=80.0),
    ]
    columns: list[rrb.View | rrb.Container] = []
    if views:
        shares = [3.0, 2.0, 2.0, 1.0][: len(views)]
        whole = rrb.Vertical(contents=views, row_shares=shares, name="The whole flight")
        columns.append(rrb.Tabs(contents=[runs, whole], active_tab=0) if runs is not None else whole)
    columns.append(verdict)
    if pictures:
        columns.append(rrb.Vertical(contents=pictures))
    widths = {1: [1.0], 2: [3.0, 2.0], 3: [5.0, 4.0, 3.5]}[len(columns)]
    return rrb.Horizontal(contents=columns, column_shares=widths, name="Heading")


def _first_panel(told: Plot | None) -> Plot | None:
    """Return the plot of velocities over time alone; the tab has no room for their plane."""
    return None if told is None else replace(told, rows=one_panel(told.panels[0], told.rows[0].height_mm))


def _on_ground(results: FlightResults) -> FlightResults:
    """Return the results without heading samples after the taxi.

    The axes of the taxi plots should show the taxi.
    """
    samples = results.rows_of(HeadingSamples)
    ground = None if samples is None else samples.where(~np.isin(samples.gate, AFTER_TAXI))
    figures = ground, results.rows_of(HeadingRunning), results.rows_of(HeadingLanes)
    return replace(results, figures=tuple(figure for figure in figures if figure is not None))


def _runs(recorder: Recorder, results: FlightResults, plots: Sequence[Plot | None]) -> rrb.Container | None:
    """Log each ground run on a time axis of its own; None where one fills the flight."""
    windows = next((one.panels[0].x.windows for one in plots if one is not None), ())
    if not windows or max(high - low for low, high in windows) > WHOLE * results.duration_s:
        return None
    drawn = [runs_of(recorder, one, "heading/run") for one in plots if one is not None]
    several = len(windows) > 1
    name = "Each ground run"
    panels = [
        rrb.Vertical(contents=[view for views in run for view in views], name=f"From {clock(low)}" if several else name)
        for (low, _), *run in zip(windows, *drawn, strict=True)
    ]
    return rrb.Tabs(contents=panels, name=name, active_tab=0) if several else panels[0]
