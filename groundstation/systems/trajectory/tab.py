"""Tab on the best trajectory: beside the on-board filter, in space, sigmas, checks."""

import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.trajectory.answer import BestTrajectory
from groundstation.systems.trajectory.chapter import trajectory as chapter
from groundstation.systems.trajectory.space_tab import space
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document

# Name of each page, and its figures.
PAGES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("On-board attitude", ("trajectory.onboard_attitude",)),
    ("On-board motion", ("trajectory.onboard_motion",)),
    ("Attitude", ("trajectory.attitude",)),
    ("Sigmas", ("trajectory.sigmas",)),
    ("Forward − smoothed", ("trajectory.separation",)),
    ("Outages", ("trajectory.outages",)),
    ("GNSS residuals", ("trajectory.residuals",)),
    ("Biases", ("trajectory.biases",)),
)


def trajectory(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    answer, section = results.answer(BestTrajectory), chapter(results)
    if answer is None or section is None:
        return None
    recorder.document("trajectory/answer", markdown(section))
    pages: list[rrb.Container] = []
    for name, figures in PAGES:
        views = [view for one in figures for view in panels_of(recorder, plot_of(recorder, one, results))]
        if views:
            pages.append(rrb.Vertical(contents=views, name=name))
    in_space = space(recorder, results)
    text = document("What was found", "trajectory/answer")
    right: list[rrb.View | rrb.Container] = [text] if in_space is None else [in_space, text]
    columns: list[rrb.View | rrb.Container] = [rrb.Tabs(contents=pages, active_tab=0)] if pages else []
    columns.append(rrb.Vertical(contents=right) if len(right) > 1 else text)
    return rrb.Horizontal(contents=columns, column_shares=[3.0, 2.0][: len(columns)], name="Best trajectory")
