"""Tab on the reference: errors of every subject over time in the claimed band, findings."""

import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.reference.answer import title_of
from groundstation.systems.reference.arrays import ReferenceErrors
from groundstation.systems.reference.chapter import reference as chapter
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document

PAGES = ("position", "velocity", "attitude")


def reference(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    data, section = results.rows_of(ReferenceErrors), chapter(results)
    if data is None or section is None or "reference" not in results.answers:
        return None
    recorder.document("reference/answer", markdown(section))
    pages = []
    for page in PAGES:
        columns = []
        for subject in dict.fromkeys(data.subject.tolist()):
            told = plot_of(recorder, "reference.errors", results, f"{subject} {page}")
            if views := panels_of(recorder, told, of=title_of(subject)):
                columns.append(rrb.Vertical(contents=views, name=title_of(subject)))
        if columns:
            pages.append(rrb.Horizontal(contents=columns, name=page.capitalize()))
    text = document("What was found", "reference/answer")
    return rrb.Horizontal(contents=[rrb.Tabs(contents=pages), text], column_shares=[3.0, 2.0], name="Reference")
