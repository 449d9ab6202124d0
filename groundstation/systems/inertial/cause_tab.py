"""Tab on the errors of an INS by cause: parts of the velocity error, the chapter."""

import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.cause_answer import CausesResult
from groundstation.systems.inertial.cause_chapter import causes as chapter
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document

PAGES = (("Velocity error by cause", "causes.velocity"), ("Along and across the track", "causes.along"))


def causes(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    section = chapter(results)
    if section is None or results.answer(CausesResult) is None:
        return None
    recorder.document("causes/answer", markdown(section))
    text = document("What explains the error", "causes/answer")
    pages = []
    for name, figure in PAGES:
        views = panels_of(recorder, plot_of(recorder, figure, results))
        if views:
            pages.append(rrb.Vertical(contents=views, name=name))
    if not pages:
        return rrb.Horizontal(contents=[text], name="INS by cause")
    over_time = rrb.Tabs(contents=pages, active_tab=0) if len(pages) > 1 else pages[0]
    return rrb.Horizontal(contents=[over_time, text], column_shares=[3.0, 2.0], name="INS by cause")
