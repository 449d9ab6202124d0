"""Rerun recording of a session of several aircraft."""

from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.failures import attempt
from groundstation.results.answer import SessionAnswer
from groundstation.results.flight import FlightResults
from groundstation.systems.system import Systems
from groundstation.tables.session_assemble import AssembledSession
from groundstation.tables.table import Flight
from groundstation.viewer.held_stream import HeldStream
from groundstation.viewer.names import clean_text
from groundstation.viewer.properties import send_properties
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.recording import answer_tabs, save_stream, send_tabs, with_log


def write_session_recording(
    path: Path, assembled: AssembledSession, results: FlightResults, systems: Systems, layout: bytes = b""
) -> None:
    """Write the recording of a session, blueprint embedded.

    See :func:`recording.write_recording`.

    Parameters
    ----------
    path : Path
        The .rrd file.
    assembled : AssembledSession
        Its clock and its ground points.
    results : FlightResults
    systems : Systems
        Those whose tabs it has.
    layout : bytes
        A saved layout in place of the default one; empty: none.

    Raises
    ------
    GroundstationError
        When Rerun refused the data or the file could not be written.
    """
    save_stream(path, results.flight_id, lambda stream: send_session(stream, assembled, results, systems, layout))


def send_session(
    stream: rr.RecordingStream,
    assembled: AssembledSession,
    results: FlightResults,
    systems: Systems,
    layout: bytes = b"",
) -> rrb.Blueprint:
    """Log everything to a stream that has its sink with its layout first; returns the layout."""
    held = HeldStream(stream)
    recorder = Recorder(held.stream, assembled.start_ns, assembled.has_utc, systems)
    stream.send_recording_name(clean_text(results.flight_id))
    attempt("properties", "results", send_properties, stream, results)
    if assembled.has_utc:
        stream.send_recording_start_time_nanos(assembled.start_ns)
    clock = Flight({}, results.metadata, assembled.start_ns, assembled.has_utc)  # findings have places in time alone
    tabs = answer_tabs(SessionAnswer, recorder, results)
    return send_tabs(stream, held, with_log(tabs, recorder, clock, results), layout)
