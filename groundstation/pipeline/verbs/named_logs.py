"""Logs that a verb is given by name: files, and in folders those that a reader claims."""

import os
from collections.abc import Sequence
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UsageError
from groundstation.base.words import counted
from groundstation.pipeline.many_flights.inputs import collect, is_ours, is_session, no_log
from groundstation.pipeline.one_flight.log import as_log, is_claimed


@dataclass(frozen=True)
class NamedLogs:
    """Logs in the order in which they are looked at.

    Parameters
    ----------
    logs : tuple of Path
    folder : Path, optional
        The folder that they lie in; None where a file was named.
    has_folder : bool
        A folder was among what was named: each log is told in a line.
    others : int
        Files in the folders that no reader claims.
    empty : int
        Those of them that hold nothing.
    """

    logs: tuple[Path, ...]
    folder: Path | None = None
    has_folder: bool = False
    others: int = 0
    empty: int = 0

    @property
    def passed_over(self) -> str:
        """Files in the folders that are no logs, in words; empty without any.

        Examples
        --------
        >>> NamedLogs((), others=3, empty=1).passed_over, NamedLogs((), others=1, empty=1).passed_over
        ('2 other files that no reader claims; 1 empty file', '1 empty file')
        """
        unclaimed = self.others - self.empty
        told = f"{counted(unclaimed, 'other file')} that no reader claims" if unclaimed else ""
        return "; ".join(filter(None, (told, counted(self.empty, "empty file") if self.empty else "")))

    def name(self, path: Path | str) -> str:
        """Return the name of a log in a list: its path in the folder."""
        return str(path) if self.folder is None else os.path.relpath(path, self.folder)


def logs_named(paths: Sequence[Path], profile: Path | None = None) -> NamedLogs:
    """Return the logs that are named, and those in the folders that are.

    The folder of a ROS 2 bag is a log.

    Raises
    ------
    UsageError
        When a folder is one that groundstation made, or has no log.
    """
    logs: list[Path] = []
    others, empty, folders = 0, 0, [path for path in paths if as_log(path).is_dir()]
    for path in paths:
        if path not in folders:
            logs.append(path)
            continue
        if is_ours(path) or is_session(path):
            raise no_log(path)
        found = [one.path for one in collect([path])]
        claimed = [one for one in found if is_claimed(one, profile)]
        if not claimed:
            raise UsageError(str(path), f"no log among {counted(len(found), 'file')}", "a log, or a folder with logs")
        others += len(found) - len(claimed)
        empty += sum(one not in claimed and one.is_file() and not one.stat().st_size for one in found)
        logs += claimed
    alone = folders[0] if len(paths) == len(folders) == 1 else None
    return NamedLogs(tuple(dict.fromkeys(logs)), alone, bool(folders), others, empty)
