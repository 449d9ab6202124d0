"""Tab on INS errors: estimates of position, velocity, tilt and drift, and trust in them.

Each channel has its own.
"""

from collections.abc import Sequence

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.arrays.flight import PhaseSpans
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.arrays import InertialStates
from groundstation.systems.inertial.chapter import inertial as chapter
from groundstation.viewer import colours
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import runs
from groundstation.viewer.views import document, lanes

# Name of each page, prefixes of its axis titles, and its figures, each with panels north and east.
PAGES: tuple[tuple[str, str, tuple[tuple[str, ...], ...]], ...] = (
    (
        "Position, velocity, tilt, drift",
        "",
        tuple(("inertial.state", name) for name in ("position", "velocity", "tilt", "drift")),
    ),
    (
        "Slow drifts, innovations, observability",
        "",
        (
            ("inertial.state", "drift_rate"),
            ("inertial.state", "random_drift"),
            ("inertial.innovations",),
            ("inertial.observability",),
        ),
    ),
    ("INS − GNSS", "INS − GNSS", (("inertial.differences", "position"), ("inertial.differences", "velocity"))),
    ("Its own filter", "GNSS − predicted", (("inertial.own_innovations",),)),
)


def inertial(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab of the INS errors; None when the flight was not assessed.

    The overview says why.
    """
    section = chapter(results)
    if section is None or results.answer(InertialResult) is None:
        return None
    recorder.document("inertial/answer", markdown(section))
    right: list[rrb.View] = [document("Errors of this INS against GNSS", "inertial/answer")]
    right += panels_of(recorder, plot_of(recorder, "inertial.radial", results), apart=True)
    column = rrb.Vertical(contents=right, row_shares=[2.0, 1.0, 1.0][: len(right)])
    pages = [page for told in PAGES if (page := _page(recorder, results, *told)) is not None]
    if not pages:
        return rrb.Horizontal(contents=[column], name="INS errors")
    left: list[rrb.View | rrb.Container] = [rrb.Tabs(contents=pages, active_tab=0), *_lanes(recorder, results)]
    column_left = rrb.Vertical(contents=left, row_shares=[6.0, 1.0][: len(left)])
    return rrb.Horizontal(contents=[column_left, column], column_shares=[2.6, 1.0], name="INS errors")


def _page(
    recorder: Recorder, results: FlightResults, name: str, of: str, figures: Sequence[tuple[str, ...]]
) -> rrb.Container | None:
    """A page of plots, north on the left and east on the right."""
    plots = (plot_of(recorder, figure, results, *which) for figure, *which in figures)
    views = [view for one in plots for view in panels_of(recorder, one, of=of)]
    columns = [rrb.Vertical(contents=side) for side in (views[::2], views[1::2])]
    return rrb.Horizontal(contents=columns, name=name) if views else None


def _lanes(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Log when the filter had GNSS and when it forecast.

    The flight phase, logged by the overview, is above it.
    """
    states, answer = results.rows_of(InertialStates), results.answer(InertialResult)
    if states is None or answer is None:
        return []
    state = np.where(states.is_gnss_used, "GNSS used", "GNSS not used")
    state = np.where(states.is_forecast, "forecast", state)
    time_s = states.time_s
    ends = [end for outage in answer.outages for end in (outage.start_s, outage.end_s)]
    every = np.unique(np.concatenate([time_s, ends]))  # a short outage may lie between two rows
    state = state[np.clip(np.searchsorted(time_s, every, side="right") - 1, 0, len(time_s) - 1)]
    for outage in answer.outages:
        state[(every >= outage.start_s) & (every < outage.end_s)] = "forecast"
    rows = runs(state)
    recorder.lane("inertial/filter", recorder.time_ns(every[rows]), state[rows].tolist(), colours.FILTER_STATES)
    phases = ["flight/phase"] if results.rows_of(PhaseSpans) is not None else []
    return [lanes("Filter and flight phase", ["inertial/filter", *phases])]
