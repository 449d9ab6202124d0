"""Verb ``serve``: the recordings of a folder of flights on Rerun's catalog server."""

import ipaddress
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.pipeline.many_flights.fleet.publishing import FLEET_RECORDING
from groundstation.pipeline.many_flights.inputs import file_in, flight_folders, session_folders

PATIENCE_S = 1.0  # between two looks at whether it shall end


def serve(
    out: Path, *, host: str, port: int, web: bool, tell: Callable[[str], None], say: Callable[[str], None]
) -> None:
    """Offer the recordings of a folder that ``run`` made, until Ctrl-C.

    Parameters
    ----------
    out : Path
    host : str
        Address to listen on.
    port : int
        0 for any free one.
    web : bool
        Serve the web viewer too.
    tell, say : callable
        Take the address of the catalog, and everything else.

    Raises
    ------
    UsageError
        When the folder has no recordings, or the page could not reach the catalog.
    GroundstationError
        When the port is taken or no recording is readable.
    """
    from groundstation.viewer.fleet_catalog import catalog_server

    if web and not _is_loopback(host):
        raise UsageError(
            f"--web --host {host}",
            "Rerun's catalog server serves only pages of its own machine",
            next_step="omit --web; others open the catalog in their own viewer",
        )
    flights, sessions, fleet = recordings_in(out, say)
    stop = threading.Event()
    with (
        catalog_server(flights, fleet, host=host, port=port, sessions=sessions) as catalog,
        _set_by_signals(stop, asked=not web),
    ):
        for path, reason in catalog.refused:
            say(f"warning: {path}: left out ({reason})")
        recordings = len(catalog.flights) + len(catalog.sessions)
        if not recordings and not catalog.has_fleet:
            raise GroundstationError(str(out), "no recording can be read", next_step="run the logs again")
        fleet_too = ", and fleet.rrd" if catalog.has_fleet else ""
        tell(catalog.url)
        say(f"{recordings} recordings{fleet_too}; open them with: groundstation view {catalog.table_url}")
        say("Ctrl-C ends")
        try:
            if web:
                _serve_page(catalog.table_url, host)
            while not web and not stop.wait(PATIENCE_S):
                pass
        except KeyboardInterrupt:
            pass
        say("ended")


@contextmanager
def _set_by_signals(stop: threading.Event, *, asked: bool) -> Iterator[None]:
    """Set an event at Ctrl-C or SIGTERM.

    An exception in the midst of anything might be lost.
    """
    if not asked or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {one: signal.signal(one, lambda *_: stop.set()) for one in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


def recordings_in(out: Path, say: Callable[[str], None]) -> tuple[list[Path], list[Path], Path | None]:
    """Return the recordings of the flights, the sessions and the fleet in a folder.

    Folders without one are reported by ``say``.

    Raises
    ------
    UsageError
        When there are none.
    """
    if not out.is_dir():
        raise UsageError(str(out), "no such folder")
    flights, sessions = (_recordings(folders, say) for folders in (flight_folders(out), session_folders(out)))
    fleet = out / FLEET_RECORDING
    if not flights and not sessions and not fleet.is_file():
        raise UsageError(str(out), "no recordings", "a folder that `run` made")
    return flights, sessions, fleet if fleet.is_file() else None


def _recordings(folders: Iterable[Path], say: Callable[[str], None]) -> list[Path]:
    found = []
    for folder in folders:
        try:
            found.append(file_in(folder, ".rrd"))
        except UsageError as error:
            say(f"warning: left out: {error}")
    return found


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:  # no address at all: the server says so
        return True


def _serve_page(url: str, host: str) -> None:
    """Serve the web viewer until it ends; it prints the address of its page."""
    from groundstation.viewer.launch import viewer_command, viewer_environment

    command = viewer_command(url, web=True, host=host, headless=True)
    code = subprocess.run(command, check=False, env=viewer_environment(os.environ)).returncode
    if code:
        raise GroundstationError("the Rerun web viewer", f"ended with code {code}; see its output above")
