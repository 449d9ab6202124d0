"""GNSS reception: states, quality and scatter over time, and what the chapter says."""

import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.gnss.answer import GnssReception
from groundstation.systems.gnss.chapter import gnss as chapter
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document


def gnss(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    answer, section = results.answer(GnssReception), chapter(results)
    if answer is None or section is None:
        return None
    recorder.document("gnss/answer", markdown(section))
    lanes = panels_of(recorder, plot_of(recorder, "gnss.states", results))
    pages: list[rrb.Container] = []
    for one in answer.receivers:
        views = panels_of(recorder, plot_of(recorder, "gnss.quality", results, one.topic))
        views += panels_of(recorder, plot_of(recorder, "gnss.steps", results, one.topic))
        if views:
            pages.append(rrb.Vertical(contents=views, name=one.topic))
    for pair in answer.pairs:
        views = panels_of(recorder, plot_of(recorder, "gnss.pair", results, f"{pair.second} from {pair.first}"))
        if views:
            pages.append(rrb.Vertical(contents=views, name=f"{pair.second} from {pair.first}"))
    still = [
        view
        for one in answer.receivers
        for view in panels_of(recorder, plot_of(recorder, "gnss.standstill", results, one.topic))
    ]
    if still:
        pages.append(rrb.Vertical(contents=still, name="At standstill"))
    over_time: list[rrb.View | rrb.Container] = [*lanes]
    if pages:
        over_time.append(rrb.Tabs(contents=pages, active_tab=0) if len(pages) > 1 else pages[0])
    shares = [1.0] * len(lanes) + ([5.0] if pages else [])
    text = document("What was found", "gnss/answer")
    columns: list[rrb.View | rrb.Container] = [rrb.Vertical(contents=over_time, row_shares=shares), text]
    return rrb.Horizontal(contents=columns, column_shares=[3.0, 2.0], name="GNSS")
