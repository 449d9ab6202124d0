"""Files flushed to the disk, so that a loss of power leaves none of them empty.

The system writes what it was given within some seconds, in whatever order. Where a file is renamed before its content
is written, a loss of power in between leaves it empty under its name.
"""

import errno
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

SIDE_BY_SIDE = 8  # files at a time: a disk writes many in the time of a few
_NOT_HERE = {errno.EINVAL, errno.ENOTSUP, errno.ENOSYS, errno.EBADF, errno.EACCES, errno.EPERM}


def sync_file(path: Path) -> None:
    """Wait until a file is on the disk.

    Raises
    ------
    OSError
        When it cannot be written; not where the file system knows no such thing.
    """
    number = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
    try:
        sync_open(number, path)
    finally:
        os.close(number)


def sync_open(number: int, path: Path) -> None:
    """Wait until an open file is on the disk."""
    try:
        os.fsync(number)
    except OSError as error:
        if error.errno not in _NOT_HERE:
            raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def sync_folder(path: Path) -> None:
    """Wait until the names in a folder are on the disk, where the system can do that."""
    with suppress(OSError):
        sync_file(path)


def sync_files(paths: Iterable[Path]) -> None:
    """Wait until files are on the disk, several at a time."""
    listed = list(paths)
    if len(listed) < 2:
        for path in listed:
            sync_file(path)
        return
    from concurrent.futures import ThreadPoolExecutor  # with logging, 5 ms that a verb without files is spared

    with ThreadPoolExecutor(SIDE_BY_SIDE, "disk") as threads:
        for _ in threads.map(sync_file, listed):
            pass


def sync_tree(folder: Path) -> None:
    """Wait until a folder is on the disk with all that is in it."""
    entries = [folder, *folder.rglob("*")]
    sync_files(path for path in entries if path.is_file() and not path.is_symlink())
    for path in reversed(entries):
        if path.is_dir() and not path.is_symlink():
            sync_folder(path)
