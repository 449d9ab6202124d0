"""Rerun recording of one flight, into a file or into a running viewer.

Both log the same; only the sink differs.
"""

import hashlib
import re
import socket
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.errors import GroundstationError
from groundstation.base.failures import attempt, failures, with_failures
from groundstation.base.to_disk import sync_file
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults
from groundstation.systems.system import Systems
from groundstation.tables.table import Flight
from groundstation.viewer.held_stream import FLUSH_SECONDS, HeldStream
from groundstation.viewer.inner import forget_closed, send_blueprint
from groundstation.viewer.names import clean_text
from groundstation.viewer.properties import send_properties
from groundstation.viewer.recorder import FLIGHT_TIME, Recorder
from groundstation.viewer.saved_layout import send_layout_content
from groundstation.viewer.tabs.generic import generic_tab
from groundstation.viewer.tabs.log import log
from groundstation.viewer.tabs.overview import overview
from groundstation.viewer.tabs.quality import quality
from groundstation.viewer.tabs.raw import raw

APPLICATION = "groundstation"
DEFAULT_VIEWER_URL = "rerun+http://127.0.0.1:9876/proxy"
DEFAULT_PORT = 9876
NamedTab = tuple[str, Callable[[], rrb.Container | None]]
CONNECT_SECONDS = 3.0


def write_recording(path: Path, flight: Flight, results: FlightResults, systems: Systems, layout: bytes = b"") -> None:
    """Write the recording of one flight, blueprint embedded.

    Parameters
    ----------
    path : Path
        The .rrd file. It is written under a temporary name and moved into place: a kill never leaves half a file.
    flight : Flight
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
    save_stream(path, results.flight_id, lambda stream: send_flight(stream, flight, results, systems, layout))


def save_stream(path: Path, identity: str, send: Callable[[rr.RecordingStream], object]) -> None:
    """Write what ``send`` logs as the recording of that name; see :func:`write_recording`."""
    temporary = path.with_name(f".{path.name}.partial")
    try:
        _save(temporary, identity, send)
        forget_closed()
        sync_file(temporary)
        temporary.replace(path)
    except (OSError, RuntimeError) as error:  # Rerun's own are RuntimeErrors
        raise GroundstationError(str(path), str(error), next_step="check the folder and the free space") from error
    finally:
        temporary.unlink(missing_ok=True)


def _save(path: Path, identity: str, send: Callable[[rr.RecordingStream], object]) -> None:
    with open_stream(identity) as stream:
        stream.save(path)
        send(stream)


def stream_recording(
    flight: Flight, results: FlightResults, systems: Systems, *, connect_url: str = DEFAULT_VIEWER_URL
) -> None:
    """Send the recording of one flight to a running viewer.

    Parameters
    ----------
    flight, results, systems
        As for :func:`write_recording`.
    connect_url : str
        Where the viewer listens: ``rerun+http://host:port/proxy``.

    Raises
    ------
    GroundstationError
        When no viewer took the data.
    """
    _expect_viewer(connect_url)
    with open_stream(results.flight_id) as stream:
        try:
            stream.connect_grpc(connect_url)
            send_flight(stream, flight, results, systems)
        except (ValueError, RuntimeError) as error:
            raise GroundstationError(
                connect_url, str(error), next_step="start the viewer first, or check its port"
            ) from error


def _expect_viewer(url: str) -> None:
    """Raise when nobody listens; Rerun itself would notice after a minute of waiting."""
    parts = urlsplit(url)
    try:
        socket.create_connection((parts.hostname or "", parts.port or DEFAULT_PORT), timeout=CONNECT_SECONDS).close()
    except (OSError, ValueError) as error:
        raise GroundstationError(
            url, f"no viewer ({error})", "rerun+http://host:port/proxy of a running one", "start the viewer first"
        ) from error


def send_flight(
    stream: rr.RecordingStream, flight: Flight, results: FlightResults, systems: Systems, layout: bytes = b""
) -> rrb.Blueprint:
    """Log everything to a stream that has its sink, and return the layout.

    The layout is sent first, or a saved one in its place; the call returns when all is out.
    """
    held = HeldStream(stream)
    recorder = Recorder(held.stream, flight.start_ns, flight.has_utc, systems)
    stream.send_recording_name(clean_text(results.flight_id))
    attempt("properties", "results", send_properties, stream, results)
    if flight.has_utc:
        stream.send_recording_start_time_nanos(flight.start_ns)
    tabs = with_log(tabs_of(recorder, flight, results), recorder, flight, results)
    return send_tabs(stream, held, tabs, layout)


def tabs_of(recorder: Recorder, flight: Flight, results: FlightResults) -> Iterator[NamedTab]:
    """Tabs of a flight but for the log, in their order: the name of each and what logs it."""
    yield "overview", partial(overview, recorder, results)
    yield "quality", partial(quality, recorder, flight, results)
    yield from answer_tabs(None, recorder, results)
    yield "raw", partial(raw, recorder, flight, results)


def with_log(
    tabs: Iterable[NamedTab], recorder: Recorder, flight: Flight, results: FlightResults
) -> Iterator[NamedTab]:
    """Tabs and, behind them, the log, which tells of those that failed and are left out."""
    yield from tabs
    yield "log", partial(_log, recorder, flight, results)


def _log(recorder: Recorder, flight: Flight, results: FlightResults) -> rrb.Container:
    return log(recorder, flight, replace(results, findings=with_failures(results.findings, failures())))


def send_tabs(
    stream: rr.RecordingStream, held: HeldStream, tabs: Iterable[NamedTab], layout: bytes = b""
) -> rrb.Blueprint:
    """Let tabs log in their order, send the layout, then what they logged.

    Returns their layout. A saved ``layout`` is sent in its place.
    """
    shown = [held.attempt("tab", name, tab) for name, tab in tabs]
    own = send_layout(stream, [tab for tab in shown if tab is not None], saved=layout)
    held.release()
    return own


def answer_tabs(kind: type[Answer] | None, recorder: Recorder, results: FlightResults) -> Iterator[NamedTab]:
    """Return the tabs of answers of a kind.

    They are those of the systems, then a generic one for each answer without any.
    """
    tabs = tuple(recorder.systems.tabs_of(kind))
    for tab in tabs:
        if tab.log is not None:
            yield tab.shows[0], partial(tab.log, recorder, results)
        elif not tab.part_of:
            yield from _generic(tab.shows, recorder, results)
    shown = {name for tab in tabs for name in tab.shows}
    yield from _generic([name for name in results.answers if name not in shown], recorder, results)


def _generic(names: Iterable[str], recorder: Recorder, results: FlightResults) -> Iterator[NamedTab]:
    for name in names:
        if (answer := results.answers.get(name)) is not None:
            yield name, partial(generic_tab, recorder, results, answer)


def send_layout(
    stream: rr.RecordingStream, tabs: Sequence[rrb.Container], *, timeline: str = FLIGHT_TIME, saved: bytes = b""
) -> rrb.Blueprint:
    """Send the layout of a recording, or a saved one; returns its own.

    In its own, the panels are closed and time stands still.
    """
    blueprint = rrb.Blueprint(
        rrb.Tabs(contents=tabs, active_tab=0 if tabs else None),
        rrb.TimePanel(state="collapsed", timeline=timeline, play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_layout=False,
        auto_views=False,
    )
    if saved:
        send_layout_content(stream, saved)
    else:
        send_blueprint(stream, blueprint)
    stream.flush(timeout_sec=FLUSH_SECONDS)  # else data that are sent next may overtake a part of it
    return blueprint


def application_id(flight_id: str) -> str:
    """Return the application id of a flight.

    Each flight has its own: Rerun binds a layout to it, and flights differ in their topics.

    Examples
    --------
    >>> application_id("20260504T060000Z_A12_7"), application_id("борт 7")
    ('groundstation 20260504T060000Z_A12_7', 'groundstation 7-1ea9aca8')
    """
    safe = re.sub(r"[^A-Za-z0-9_-]+", "-", flight_id).strip("-")
    if safe != flight_id:
        safe = f"{safe}-{hashlib.sha256(flight_id.encode()).hexdigest()[:8]}".lstrip("-")
    return f"{APPLICATION} {safe}"


@contextmanager
def open_stream(identity: str) -> Iterator[rr.RecordingStream]:
    """Open a stream in strict mode, without Rerun's own timelines.

    On leaving it is closed and the file footer written.
    """
    strict = rr.strict_mode()
    rr.set_strict_mode(True)  # else the SDK drops data with a mere warning
    stream = rr.RecordingStream(application_id(identity), recording_id=clean_text(identity), send_properties=False)
    try:
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        yield stream
    finally:
        stream.disconnect()
        rr.set_strict_mode(strict)
