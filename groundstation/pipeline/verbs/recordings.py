"""Recordings that exist: sound or damaged, and the facts of one for ``info``."""

from pathlib import Path

from groundstation.base.errors import GroundstationError, told_in_a_line

MAGIC = b"RRF"  # with a digit of the version, at the beginning of every recording and layout
MOST_VERIFIED_BYTES = 200_000_000  # 25 MB take 0.65 s of one core


def is_of_rerun(path: Path) -> bool:
    """Tell whether a file is a recording or a layout of Rerun."""
    if not path.is_file():
        return False
    with told_in_a_line(str(path)), path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def sound(recording: Path) -> Path:
    """Return a recording that Rerun can read from end to end.

    A damaged one may end the process that reads it without a word.
    """
    from groundstation.viewer.verification import damaged

    if recording.stat().st_size <= MOST_VERIFIED_BYTES and (fault := damaged([recording])):
        raise GroundstationError(str(recording), f"damaged: {fault[recording]}", next_step="run the log again")
    return recording


def facts_of_recording(path: Path) -> dict[str, str]:
    """Return the facts of a recording or layout: size, versions, timelines, entities, tabs."""
    from groundstation.viewer.file_contents import facts_of_file

    return facts_of_file(sound(path))
