"""Rerun recording of a session of several aircraft."""

from functools import partial
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.failures import attempt
from groundstation.results.flight import FlightResults
from groundstation.tables.session_assemble import AssembledSession
from groundstation.tables.table import Flight
from groundstation.viewer.names import clean_text
from groundstation.viewer.properties import send_properties
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.recording import logged, save_stream, send_layout
from groundstation.viewer.tabs.cooperative import cooperative


def write_session_recording(path: Path, assembled: AssembledSession, results: FlightResults) -> None:
    """Write the recording of a session with its blueprint.

    See :func:`recording.write_recording`.

    Parameters
    ----------
    path : Path
        The .rrd file.
    assembled : AssembledSession
        Its clock and its ground points.
    results : FlightResults

    Raises
    ------
    GroundstationError
        When Rerun refused the data or the file could not be written.
    """
    save_stream(path, results.flight_id, lambda stream: send_session(stream, assembled, results))


def send_session(stream: rr.RecordingStream, assembled: AssembledSession, results: FlightResults) -> rrb.Blueprint:
    """Log everything to a stream that has its sink and send the layout; returns the layout."""
    recorder = Recorder(stream, assembled.start_ns, assembled.has_utc)
    stream.send_recording_name(clean_text(results.flight_id))
    attempt("properties", "results", send_properties, stream, results)
    if assembled.has_utc:
        stream.send_recording_start_time_nanos(assembled.start_ns)
    clock = Flight({}, results.metadata, assembled.start_ns, assembled.has_utc)  # findings have places in time alone
    tabs = [("cooperative", partial(cooperative, recorder, assembled.session.points, results))]
    return send_layout(stream, logged(tabs, recorder, clock, results))
