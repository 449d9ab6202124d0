"""One mutated log through the chain: reader, survey, MCAP and back; tells what must not have happened."""

import os
import sys
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Damage, LogHeader, NewLog, RecordBatch, Remark
from tests.fuzz.bases import FORMATS, Base, bases
from tests.fuzz.mutation import Edit, Mutant, random_edits

DEEP_EVERY = 3  # every third log is also written as MCAP and read back


@dataclass(frozen=True)
class Case:
    """A seed of a format, or edits of a base."""

    format: str
    seed: int


class Watch:
    """Opens for writing outside a folder, and programs started: an audit hook of this process."""

    def __init__(self) -> None:
        self.folder = ""
        self.seen: list[str] = []
        sys.addaudithook(self._hear)

    def _hear(self, event: str, values: tuple[Any, ...]) -> None:
        if not self.folder:
            return
        if event in ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "socket.connect"):
            self.seen.append(f"{event} {values[0]!r}")
        elif event == "open":
            path, mode, flags = values
            writes = flags & (os.O_WRONLY | os.O_RDWR) if mode is None else set(mode) & set("wax+")
            if writes and isinstance(path, (str, bytes)):
                self._note(event, path)
        elif event in ("os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.link", "os.symlink"):
            self._note(event, values[1] if event in ("os.rename", "os.link", "os.symlink") else values[0], values[-1])

    def _note(self, event: str, path: Any, folder: Any = None) -> None:
        named = os.fsdecode(path)
        if isinstance(folder, int) and folder >= 0:  # relative to an open folder
            named = str(Path(f"/proc/self/fd/{folder}").readlink() / named)
        name = os.path.realpath(named)
        if not (name + "/").startswith(self.folder + "/") and "/__pycache__" not in name and "numba" not in name:
            self.seen.append(f"{event} {name}")


def edits_of(case: Case) -> tuple[Base, Base, list[Edit]]:
    """The log of a case, the one that is spliced into it, and the edits."""
    rng = np.random.default_rng([FORMATS.index(case.format), case.seed])
    known = bases(case.format)
    base = known[int(rng.integers(len(known)))]
    everyone = [known[-1], *(bases(name, recorded=False)[0] for name in FORMATS)]
    other = everyone[int(rng.integers(len(everyone)))]
    return base, other, random_edits(len(base.data), len(other.data), base.starts, rng)


def content_of(base: Base, other: Base, edits: Sequence[Edit]) -> bytes:
    """The mutated file."""
    return Mutant(base.data, other.data, edits).content


def suffix_of(format_name: str) -> str:
    """A file's suffix; readers look at the content alone."""
    return {
        "ulog": ".ulg",
        "dataflash": ".BIN",
        "chapter10": ".ch10",
        "mcap": ".mcap",
        "robot-mcap": ".mcap",
        "flatbuffer": ".mcap",
        "ros1": ".bag",
        "sqlite3": ".db3",
        "hdf5": ".hdf5",
        "gzip": ".gz",
        "zstd": ".zst",
    }.get(format_name, ".csv")


def check_items(items: Sequence[Any]) -> None:
    """What holds of every reader's items whatever the file was."""
    assert isinstance(items[0], LogHeader), "no header first"
    for item in items[1:]:
        assert isinstance(item, RecordBatch | Damage | Remark | NewLog), f"{type(item).__name__} among the items"
        if isinstance(item, Damage):
            assert item.count >= 0 and "\n" not in item.place, f"damage {item}"
        elif isinstance(item, RecordBatch):
            assert len(item) > 0 and all(len(column) == len(item) for column in item.columns.values()), item.topic


def try_file(path: Path, folder: Path, *, is_deep: bool) -> str:
    """Read a file as every verb does; what it came to ("" is none of its records), an exception where ours is at fault.

    Raises
    ------
    Exception
        Anything but a GroundstationError is a crash found.
    """
    from groundstation.pipeline.one_flight.convert import convert_log
    from groundstation.pipeline.one_flight.log import open_log

    try:
        log = open_log(path)
        items = list(log.items())
    except GroundstationError as error:
        assert "\n" not in str(error) and len(str(error)) < 2_000, f"error of {len(str(error))} characters"
        return "refused"
    check_items(items)
    rows = sum(len(item) for item in items if isinstance(item, RecordBatch))
    if is_deep:
        target = folder / "flight.mcap"
        try:
            convert_log(log, target)
        except GroundstationError:
            assert not rows or log.is_store or not target.exists()
            return "not converted"
        again = list(open_log(target).items())
        check_items(again)
        left = sum(len(item) for item in again if isinstance(item, RecordBatch))
        target.unlink()
        assert left == rows, f"{rows} records read, {left} in the MCAP"
    return "read" if rows else "no record"


def run_case(case: Case, folder: Path, watch: Watch) -> dict[str, Any]:
    """Run a case in a folder; what it came to, and what was wrong."""
    base, other, edits = edits_of(case)
    path = folder / f"log{suffix_of(case.format)}"
    path.write_bytes(content_of(base, other, edits))
    watch.seen.clear()
    watch.folder = str(folder.resolve())
    fault = ""
    try:
        came_to = try_file(path, folder, is_deep=case.seed % DEEP_EVERY == 0)
    except Exception:
        came_to, fault = "crash", traceback.format_exc(limit=-6)
    watch.folder = ""
    left = sorted(entry.name for entry in folder.iterdir() if entry != path)
    if watch.seen or left:
        came_to, fault = "escape", fault + f"\nwritten: {watch.seen} left: {left}"
    for name in left:
        (folder / name).unlink()
    return {"came_to": came_to, "fault": fault, "base": base.name, "other": other.name, "edits": edits}
