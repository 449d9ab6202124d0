"""Check of recordings before they are served.

Rerun may end the process that reads a damaged one.
"""

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path

from groundstation.viewer.inner import viewer_executable

MOST_AT_ONCE = 50  # paths on one command line
PATIENCE_S = 60.0  # for so many; 2 MB take 0.04 s


def damaged(recordings: Sequence[Path]) -> dict[Path, str]:
    """Find the recordings that Rerun cannot decode from end to end, each with the reason.

    Rerun's own `rrd verify` reads them in a process of its own, so that a crash does not end this one. Where one of
    several is damaged, halves are checked again. A value changed into another that decodes is not found.

    Raises
    ------
    GroundstationError
        When the installation lacks Rerun's executable.
    """
    found: dict[Path, str] = {}
    batches = [recordings[first : first + MOST_AT_ONCE] for first in range(0, len(recordings), MOST_AT_ONCE)]
    while batches:
        batch = batches.pop()
        reason = _fault(batch)
        if reason and len(batch) == 1:
            found[batch[0]] = reason
        elif reason:
            middle = len(batch) // 2
            batches += [batch[middle:], batch[:middle]]
    return found


def _fault(batch: Sequence[Path]) -> str:
    """Return the fault of any of a few recordings in a line; empty when all are sound."""
    command = [str(viewer_executable()), "rrd", "verify", *(str(path.absolute()) for path in batch)]
    environment = os.environ | {"RUST_LOG": "off", "NO_COLOR": "1"}
    try:
        ran = subprocess.run(
            command,
            check=False,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PATIENCE_S,
        )
    except subprocess.TimeoutExpired:
        return f"not read within {PATIENCE_S:g} s"
    if ran.returncode == 0:
        return ""
    told = " ".join(ran.stderr.split()).removeprefix("Error: ")
    for path in batch:
        told = told.replace(f'"{path.absolute()}" -- skipping: ', "").replace(f'"{path.absolute()}": ', "")
    most = 160
    return (told[:most] + " ..." if len(told) > most else told) or f"Rerun ended with code {ran.returncode}"
