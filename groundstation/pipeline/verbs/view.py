"""Verb ``view``: a folder, recording, MCAP or log of a flight in the Rerun viewer."""

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.pipeline.many_flights.fleet.publishing import FLEET_RECORDING
from groundstation.pipeline.many_flights.inputs import COMPARISON_RECORDING, file_in, is_remote
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.one_flight.layout import SavedLayout, saved_layout
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.verbs.recordings import is_of_rerun, sound
from groundstation.results.files import load_manifest

ADDRESSES = ("rerun://", "rerun+http://", "rerun+https://")


def look_at(
    what: str,
    *,
    web: bool,
    host: str,
    port: int | None,
    power_up: int = 1,
    profile: Path | None,
    layout: Path | None = None,
    say: Callable[[str], None],
) -> None:
    """Open a flight in the Rerun viewer; an MCAP or log is run into a temporary folder first.

    Parameters
    ----------
    what : str
        Path of a folder that ``run`` or ``compare`` made, of a flight folder, recording, MCAP or log; or the address
        that ``serve`` tells.
    web : bool
        In the browser.
    host, port
        Where the viewer listens; see :func:`groundstation.viewer.launch.open_viewer`.
    power_up : int
        Which of several power-ups in an MCAP or log, from 1.
    layout : Path, optional
        Layout saved in the viewer, which it opens with.

    Raises
    ------
    UsageError
        When the path is missing or a folder without a recording, or the layout is none.
    GroundstationError
        When the log cannot be run, the file is no recording or a damaged one, or the viewer does not start.
    """
    from groundstation.viewer.launch import open_viewer, require_display

    path = Path(what)
    is_address = what.startswith(ADDRESSES)
    if not is_address and not path.exists():
        raise UsageError(what, "no such file or folder")
    if is_address and layout is not None:
        raise UsageError("--layout", "the address of a catalog", "a recording, flight folder, MCAP or log")
    saved = None if layout is None else saved_layout(layout)
    if not web:
        require_display(os.environ)  # before anything is computed
    if is_address:
        code = open_viewer(what, web=web, host=host, port=port)
    elif path.is_dir() or path.suffix == ".rrd":
        recording = sound(_recording(path))
        with _laid_out(recording, saved) as shown:
            code = open_viewer(shown, web=web, host=host, port=port, links=recording.parent, say=say)
    else:
        with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
            say(f"computing {path.name} ...")
            layouts = () if saved is None else (replace(saved, of="flight"),)
            configuration = Configuration(profile=str(profile) if profile else None, layouts=layouts)
            outcome = run_flight(Job(path, Path(folder), configuration, power_up=power_up))
            if outcome.state == "failed":
                where, _, found = outcome.text.partition(": ")
                raise GroundstationError(where, found)
            if outcome.power_up and (told := load_manifest(Path(outcome.folder)).power_up) is not None:
                say(f"power-up {told.number} of {told.count} in {path.name}; --power-up shows another one")
            for failure in outcome.failures:
                say(f"error: {path.name}: {failure.text}")
            code = open_viewer(_recording(Path(outcome.folder)), web=web, host=host, port=port, say=say)
    if code:
        raise GroundstationError("the Rerun viewer", f"ended with code {code}; see its output above")


def require_recordings_to_open(out: str, *, only_results: bool) -> None:
    """Refuse ``run --open`` before anything is computed.

    Raises
    ------
    UsageError
        When no recording is made, or the results go elsewhere.
    GroundstationError
        When this machine has no display.
    """
    from groundstation.viewer.launch import require_display

    if only_results or is_remote(out):
        raise UsageError("--open", "no recording on this machine", "--open without --only results, and a local folder")
    require_display(os.environ)


def open_results(out: str, outcomes: Sequence[Outcome], *, say: Callable[[str], None]) -> None:
    """Open the recording of the one flight or session of a run, or that of all of them."""
    folders = [one.folder for one in outcomes if one.folder and one.flight_id]
    if folders:
        place = folders[0] if len(folders) == 1 else out
        look_at(place, web=False, host="127.0.0.1", port=None, profile=None, say=say)


def _recording(path: Path) -> Path:
    """Return a recording, or that in a folder of a flight, of all flights, of a comparison."""
    recording = file_in(path, ".rrd", FLEET_RECORDING, COMPARISON_RECORDING) if path.is_dir() else path
    if not is_of_rerun(recording):
        raise GroundstationError(str(recording), "no Rerun recording", next_step="run the log again")
    return recording


@contextmanager
def _laid_out(recording: Path, layout: SavedLayout | None) -> Iterator[Path]:
    """Yield the recording, or a temporary copy of it with a layout in place of its own."""
    if layout is None:
        yield recording
        return
    from groundstation.viewer.saved_layout import write_with_layout

    with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
        copy = Path(folder) / recording.name
        write_with_layout(recording, layout.content, copy)
        yield copy
