"""Rerun recording of a plan."""

from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.failures import attempt
from groundstation.results.answer import PlanAnswer
from groundstation.results.flight import FlightResults
from groundstation.systems.system import Systems
from groundstation.tables.table import Flight
from groundstation.viewer.held_stream import HeldStream
from groundstation.viewer.names import clean_text
from groundstation.viewer.properties import send_properties
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.recording import answer_tabs, save_stream, send_tabs, with_log


def write_plan_recording(path: Path, results: FlightResults, systems: Systems) -> None:
    """Write the recording of a plan, blueprint embedded.

    See :func:`recording.write_recording`.

    Raises
    ------
    GroundstationError
        When Rerun refused the data or the file could not be written.
    """
    save_stream(path, results.flight_id, lambda stream: send_plan(stream, results, systems))


def send_plan(stream: rr.RecordingStream, results: FlightResults, systems: Systems) -> rrb.Blueprint:
    """Log everything to a stream that has its sink with its layout first; returns the layout."""
    held = HeldStream(stream)
    recorder = Recorder(held.stream, 0, has_utc=False, systems=systems)
    stream.send_recording_name(clean_text(results.flight_id))
    attempt("properties", "results", send_properties, stream, results)
    clock = Flight({}, results.metadata)  # findings have places in time alone
    tabs = answer_tabs(PlanAnswer, recorder, results)
    return send_tabs(stream, held, with_log(tabs, recorder, clock, results))
