"""Tab on several INS: errors of each unit, differences of pairs, the chapter."""

import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.units_answer import UnitsResult
from groundstation.systems.inertial.units_chapter import units as chapter
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document

PAGES = (
    ("Each unit", "units.errors", ("radial", "velocity")),
    ("Pairs", "units.pairs", ("radial", "velocity", "heading")),
)


def units(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    section = chapter(results)
    if section is None or results.answer(UnitsResult) is None:
        return None
    recorder.document("units/answer", markdown(section))
    pages = []
    for name, figure, quantities in PAGES:
        views = [
            view for which in quantities for view in panels_of(recorder, plot_of(recorder, figure, results, which))
        ]
        if views:
            pages.append(rrb.Vertical(contents=views, name=name))
    text = document("What was found", "units/answer")
    if not pages:
        return rrb.Horizontal(contents=[text], name="Several INS")
    over_time = rrb.Tabs(contents=pages, active_tab=0) if len(pages) > 1 else pages[0]
    return rrb.Horizontal(contents=[over_time, text], column_shares=[3.0, 2.0], name="Several INS")
