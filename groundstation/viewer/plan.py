"""The Rerun recording of a plan."""

from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from groundstation.chapters.by_answer import without_chapter
from groundstation.results.flight import FlightResults
from groundstation.tables.table import Flight
from groundstation.viewer.names import clean_text
from groundstation.viewer.properties import send_properties
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.recording import save_stream, send_layout
from groundstation.viewer.tabs.control import control
from groundstation.viewer.tabs.generic import generic_tab
from groundstation.viewer.tabs.landing_ranges import landing_ranges
from groundstation.viewer.tabs.log import log
from groundstation.viewer.tabs.placement import placement

PLAN_TABS = (control, placement, landing_ranges)  # in the order of the report


def write_plan_recording(path: Path, results: FlightResults) -> None:
    """Write the recording of a plan, blueprint embedded; see :func:`recording.write_recording`.

    Raises
    ------
    GroundstationError
        When Rerun refused the data or the file could not be written.
    """
    save_stream(path, results.flight_id, lambda stream: send_plan(stream, results))


def send_plan(stream: rr.RecordingStream, results: FlightResults) -> rrb.Blueprint:
    """Log everything to a stream that has its sink and send the layout; returns the layout."""
    recorder = Recorder(stream, 0, has_utc=False)
    stream.send_recording_name(clean_text(results.flight_id))
    send_properties(stream, results)
    clock = Flight({}, results.metadata)  # findings have places in time alone
    own = (tab(recorder, results) for tab in PLAN_TABS)
    tabs = (
        *(tab for tab in own if tab is not None),
        *(generic_tab(recorder, results, answer) for answer in without_chapter(results)),
        log(recorder, clock, results),
    )
    return send_layout(stream, tabs)
