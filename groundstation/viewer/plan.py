"""Rerun recording of a plan."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.failures import attempt
from groundstation.chapters.by_answer import without_chapter
from groundstation.results.flight import FlightResults
from groundstation.tables.table import Flight
from groundstation.viewer.names import clean_text
from groundstation.viewer.properties import send_properties
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.recording import logged, save_stream, send_layout
from groundstation.viewer.tabs.control import control
from groundstation.viewer.tabs.generic import generic_tab
from groundstation.viewer.tabs.landing_ranges import landing_ranges
from groundstation.viewer.tabs.placement import placement

PLAN_TABS: dict[str, Callable[[Recorder, FlightResults], rrb.Container | None]] = {  # in the order of the report
    "control": control,
    "placement": placement,
    "landing_ranges": landing_ranges,
}


def write_plan_recording(path: Path, results: FlightResults) -> None:
    """Write the recording of a plan with its blueprint.

    See :func:`recording.write_recording`.

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
    attempt("properties", "results", send_properties, stream, results)
    clock = Flight({}, results.metadata)  # findings have places in time alone
    generic = {answer.analysis: partial(generic_tab, recorder, results, answer) for answer in without_chapter(results)}
    tabs = {name: partial(tab, recorder, results) for name, tab in PLAN_TABS.items()} | generic
    return send_layout(stream, logged(tabs.items(), recorder, clock, results))
