"""Tab on landing by locators: deviations of every approach, and the chapter.

Deviations are from course and glide path.
"""

import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.landing.beacons.answer import BeaconLanding
from groundstation.systems.landing.beacons.chapter import landing_beacons as chapter
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document


def landing_beacons(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer or its positions."""
    section = chapter(results)
    views = panels_of(recorder, plot_of(recorder, "landing_beacons.deviations", results), height=70.0)
    if results.answer(BeaconLanding) is None or section is None or not views:
        return None
    recorder.document("landing_beacons/answer", markdown(section))
    text = document("What was found", "landing_beacons/answer")
    columns: list[rrb.View | rrb.Container] = [rrb.Vertical(contents=views), text]
    return rrb.Horizontal(contents=columns, column_shares=[3.0, 2.0], name="Landing by locators")
