"""Files that a run takes: named files, and logs found in folders.

Nothing that groundstation itself made is among them.
"""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UsageError
from groundstation.pipeline.one_flight.log import as_log
from groundstation.results.file_names import ARRAYS, CORRECTED, INDEX_CSV, INDEX_JSON, MANIFEST, OLD_ARRAYS, SUMMARY

FLIGHT_FOLDER_MARK, OUT_FOLDER_MARK, STUDY_MARK = MANIFEST, INDEX_JSON, ".groundstation-study"
SESSION_ARRAYS = "session_clocks.parquet"  # what a session of several aircraft has and no flight
SESSION_MARKS = tuple(f"{folder}/{SESSION_ARRAYS}" for folder in (ARRAYS, OLD_ARRAYS))
PLAN_MARK = "plan.toml"  # the scenario of a plan, which is no flight
COMPARISON_MARKS = "compare.html", "compare.csv"
COMPARISON_RECORDING = "compare.rrd"
NO_LOGS = ".toml"  # settings, stations, aircraft, profiles: they stand beside logs and are none


@dataclass(frozen=True)
class Input:
    """File to process.

    ``is_named``: the user named it, so that failing to recognise it is an error.
    """

    path: Path
    is_named: bool


def collect(paths: Sequence[Path], out: Path | None = None) -> tuple[Input, ...]:
    """List the files that ``paths`` (files or folders, recursive) stand for, each once.

    Their order is stable.

    OUT and folders that groundstation made (they hold its manifest or index) are never inputs of a folder walk; nor
    are hidden files and settings (TOML). A folder that is a bag of ROS 2 is one log, named by its metadata.

    Raises
    ------
    UsageError
        When a path does not exist.
    """
    found: dict[Path, Input] = {}
    for path in paths:
        if not path.exists():
            raise UsageError(str(path), "no such file or folder")
        if path.is_dir():
            walked = _walk(path, out.resolve() if out else None)
            for place, one in sorted(walked, key=lambda item: str(item[1].path)):
                found.setdefault(place, one)
        else:
            found[path.resolve()] = Input(path, is_named=True)
    return tuple(sorted(found.values(), key=lambda item: str(item.path)))


def is_ours(folder: Path) -> bool:
    """Tell whether groundstation made the folder: a flight folder or an OUT."""
    names = {FLIGHT_FOLDER_MARK, SUMMARY}, {OUT_FOLDER_MARK, INDEX_CSV}, {STUDY_MARK}, set(COMPARISON_MARKS)
    try:
        return any(all((folder / name).is_file() for name in marks) for marks in names)
    except OSError:
        return False


def is_session(folder: Path) -> bool:
    """Tell whether a folder is that of a session of several aircraft."""
    return any((folder / mark).is_file() for mark in SESSION_MARKS)


def no_log(folder: Path, *, takes_flights: bool = False) -> UsageError:
    """Error for a folder that is not the log that a verb takes.

    Some verbs take the folder of a flight too.
    """
    if is_session(folder):
        return UsageError(str(folder), "a session of several aircraft", "a log", "manifest.json in it names its logs")
    expected = "a log or the folder of one flight" if takes_flights else "a log"
    if (folder / FLIGHT_FOLDER_MARK).is_file():
        return UsageError(str(folder), "the folder of a flight", expected, "name the .mcap in it")
    try:
        has_flights = any((one / FLIGHT_FOLDER_MARK).is_file() for one in folder.iterdir())
    except OSError:
        has_flights = False
    if has_flights:
        next_step = "name a flight in it" if takes_flights else "name the .mcap of a flight in it"
        return UsageError(str(folder), "a folder of flights", expected, next_step)
    return UsageError(str(folder), "a folder", expected, "`run` takes folders")


def file_in(folder: Path, ending: str, *others: str) -> Path:
    """Find the file with an ending in a folder that ``run`` made.

    It is that of the folder's name, of ``others``, or the only one.

    Raises
    ------
    UsageError
        When there is none, or several of other names.
    """
    named = (folder / name for name in (f"{folder.resolve().name}{ending}", *others))
    found = [path for path in named if path.is_file()][:1] or [
        path for path in sorted(folder.glob(f"*{ending}")) if not path.name.endswith(CORRECTED)
    ]
    if not found and is_session(folder):
        raise no_log(folder)
    if len(found) != 1:
        what = f"{len(found)} files *{ending}"
        raise UsageError(str(folder), what, "a flight folder that `run` made", f"name the {ending}")
    return found[0]


def flight_folders(out: Path) -> list[Path]:
    """Flight folders in an OUT, in the order of their names."""
    return list(filter(is_flight, _finished_folders(out)))


def saved_flights(out: Path) -> list[Path]:
    """Flight folders in an OUT that is asked about; it may have none.

    Raises
    ------
    UsageError
        When the folder is not one that ``run`` made, or is that of a flight.
    """
    expected = "a folder that `run` made"
    if (out / FLIGHT_FOLDER_MARK).is_file():
        raise UsageError(str(out), "the folder of a flight", expected, f"name {out.parent}")
    folders = flight_folders(out) if out.is_dir() else []
    if not folders and not (out.is_dir() and is_ours(out)):
        raise UsageError(str(out), "no results", expected)
    return folders


def is_flight(folder: Path) -> bool:
    """Tell whether a folder with a summary is that of a flight, not of a session or a plan."""
    return not any((folder / mark).is_file() for mark in (*SESSION_MARKS, PLAN_MARK))


def session_folders(out: Path) -> list[Path]:
    """Session folders in an OUT, in the order of their names."""
    return [folder for folder in _finished_folders(out) if is_session(folder)]


def plan_folders(out: Path) -> list[Path]:
    """Folders of plans in an OUT, in the order of their names."""
    return [folder for folder in _finished_folders(out) if (folder / PLAN_MARK).is_file()]


def _finished_folders(out: Path) -> list[Path]:
    return sorted(folder for folder in out.iterdir() if folder.name[0] != "." and (folder / SUMMARY).is_file())


def _walk(folder: Path, out: Path | None) -> Iterator[tuple[Path, Input]]:
    """Files below a folder, each behind its place once links are followed."""
    folders = [(folder, folder.resolve())]
    while folders:
        folder, place = folders.pop()
        if place == out or is_ours(folder):
            continue
        if (bag := as_log(folder)) != folder:
            yield bag.resolve(), Input(bag, is_named=False)
            continue
        try:
            with os.scandir(folder) as entries:
                listed = [one for one in entries if one.name[0] != "." and not one.name.lower().endswith(NO_LOGS)]
        except OSError:
            yield place, Input(folder, is_named=True)  # it fails in its turn, with its name, and stops nothing else
            continue
        for entry in listed:
            path = folder / entry.name
            if entry.is_dir(follow_symlinks=False):
                folders.append((path, place / entry.name))
            elif entry.is_file():
                yield path.resolve() if entry.is_symlink() else place / entry.name, Input(path, is_named=False)


def is_remote(place: str) -> bool:
    """Tell whether a place is named by URL.

    Examples
    --------
    >>> is_remote("s3://flights/2026"), is_remote("flights/2026")
    (True, False)
    """
    return "://" in place
