"""``view``: whatever stands for a flight - folder, recording, MCAP or log - opens in the Rerun viewer."""

import tempfile
from collections.abc import Callable
from pathlib import Path

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.pipeline.configuration import Configuration
from groundstation.pipeline.flight import Job, run_flight


def look_at(
    path: Path,
    *,
    web: bool,
    host: str,
    port: int | None,
    profile: Path | None,
    say: Callable[[str], None],
) -> None:
    """Open a flight in the Rerun viewer; an MCAP or log is run into a temporary folder first.

    Raises
    ------
    UsageError
        When the path is missing or a folder without a recording.
    GroundstationError
        When the log cannot be run, or the viewer does not start.
    """
    from groundstation.viewer.launch import open_viewer

    if not path.exists():
        raise UsageError(str(path), "no such file or folder")
    if path.is_dir() or path.suffix == ".rrd":
        recording = recording_in(path) if path.is_dir() else path
        code = open_viewer(recording, web=web, host=host, port=port)
    else:
        with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
            say(f"computing {path.name} ...")
            configuration = Configuration(profile=str(profile) if profile else None)
            outcome = run_flight(Job(path, Path(folder), configuration))
            if outcome.state == "failed":
                raise GroundstationError(path.parent.name or ".", outcome.text)
            code = open_viewer(recording_in(Path(outcome.folder)), web=web, host=host, port=port)
    if code:
        raise GroundstationError("the Rerun viewer", f"ended with code {code}; its own lines stand above")


def recording_in(folder: Path) -> Path:
    """The recording of a flight folder.

    Raises
    ------
    UsageError
        When there is none, or more than one.
    """
    found = sorted(folder.glob("*.rrd"))
    if len(found) != 1:
        raise UsageError(str(folder), f"{len(found)} recordings", "a flight folder that `run` made", "name the .rrd")
    return found[0]
