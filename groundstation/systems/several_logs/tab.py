"""Tab on several logs of one flight: both motions, their difference, and the chapter.

The motions lie over each other.
"""

import rerun.blueprint as rrb

from groundstation.results.flight import FlightResults
from groundstation.systems.several_logs.answer import Together
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.tabs.generic import generic_tab


def together(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None for a flight of one log."""
    answer = results.answer(Together)
    return None if answer is None else generic_tab(recorder, results, answer)
