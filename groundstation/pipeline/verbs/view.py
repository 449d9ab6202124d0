"""Verb ``view``: a folder, recording, MCAP or log of a flight in the Rerun viewer."""

import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from groundstation.base.errors import GroundstationError, UsageError, told_in_a_line
from groundstation.pipeline.many_flights.fleet.publishing import FLEET_RECORDING
from groundstation.pipeline.many_flights.inputs import COMPARISON_RECORDING, file_in, is_remote
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.files import load_manifest

ADDRESSES = ("rerun://", "rerun+http://", "rerun+https://")
MOST_VERIFIED_BYTES = 200_000_000  # 25 MB take 0.65 s of one core
MAGIC = b"RRF"  # with a digit of the version, at the beginning of every recording


def look_at(
    what: str,
    *,
    web: bool,
    host: str,
    port: int | None,
    power_up: int = 1,
    profile: Path | None,
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

    Raises
    ------
    UsageError
        When the path is missing or a folder without a recording.
    GroundstationError
        When the log cannot be run, the file is no recording or a damaged one, or the viewer does not start.
    """
    from groundstation.viewer.launch import open_viewer, require_display

    path = Path(what)
    is_address = what.startswith(ADDRESSES)
    if not is_address and not path.exists():
        raise UsageError(what, "no such file or folder")
    if not web:
        require_display(os.environ)  # before anything is computed
    if is_address:
        code = open_viewer(what, web=web, host=host, port=port)
    elif path.is_dir() or path.suffix == ".rrd":
        code = open_viewer(_sound(_recording(path)), web=web, host=host, port=port, say=say)
    else:
        with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
            say(f"computing {path.name} ...")
            configuration = Configuration(profile=str(profile) if profile else None)
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


def _sound(recording: Path) -> Path:
    """Return a recording that Rerun can read from end to end.

    A damaged one may end the viewer without a word.
    """
    from groundstation.viewer.verification import damaged

    if recording.stat().st_size <= MOST_VERIFIED_BYTES and (fault := damaged([recording])):
        raise GroundstationError(str(recording), f"damaged: {fault[recording]}", next_step="run the log again")
    return recording


def _recording(path: Path) -> Path:
    """Return a recording, or that in a folder of a flight, of all flights, of a comparison."""
    recording = file_in(path, ".rrd", FLEET_RECORDING, COMPARISON_RECORDING) if path.is_dir() else path
    with told_in_a_line(str(recording)), recording.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise GroundstationError(str(recording), "no Rerun recording", next_step="run the log again")
    return recording
