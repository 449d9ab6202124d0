"""Tab on the installation learned from earlier flights: the chapter."""

import rerun.blueprint as rrb

from groundstation.results.flight import FlightResults
from groundstation.systems.heading.installation.answer import InstallationResult
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.tabs.generic import generic_tab


def installation(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None for a flight that was run without what earlier ones taught."""
    answer = results.answer(InstallationResult)
    return None if answer is None else generic_tab(recorder, results, answer)
