"""Folder that results go into.

It is ours or not, one run at a time writes into it, and what a killed run left is cleared.
"""

import errno
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from groundstation.base.errors import UsageError
from groundstation.pipeline.many_flights.fleet.index import write_index_of
from groundstation.pipeline.many_flights.inputs import FLIGHT_FOLDER_MARK, OUT_FOLDER_MARK, is_ours
from groundstation.pipeline.one_flight.flight import PARTIAL_PREFIX
from groundstation.results.file_names import INDEX_CSV, INDEX_JSON

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LOCK = ".lock"
HELD = (errno.EACCES, errno.EAGAIN, errno.EWOULDBLOCK)  # a lock that another one holds
BEGUN = frozenset((INDEX_CSV, INDEX_JSON, f".{INDEX_CSV}.partial", f".{INDEX_JSON}.partial"))


def refuse_foreign(out: Path, force: bool) -> None:
    """Refuse to write results into what another made, or into a flight folder."""
    if out.exists() and not out.is_dir():
        raise UsageError(str(out), "a file", "a folder for the results")
    if out.is_dir() and not is_ours(out) and not force and not _is_begun(out):
        raise UsageError(
            str(out), "a folder that groundstation did not make", "a new folder or one it made", "-f uses it"
        )
    if (out / FLIGHT_FOLDER_MARK).exists():
        raise UsageError(str(out), "a flight folder", "a folder that holds flight folders", "name another -o")


def _is_begun(out: Path) -> bool:
    """Tell whether a folder is empty, or a run was killed in it before it was marked as ours."""
    names = {one.name for one in out.iterdir()}
    return not names or names == {LOCK} or (LOCK in names and names <= {LOCK, *BEGUN})


@contextmanager
def alone_in(out: Path) -> Iterator[None]:
    """Keep other runs out of a folder; the system takes the lock off a run that is killed."""
    out.mkdir(parents=True, exist_ok=True)
    release = _locked(out / LOCK)
    if release is None:
        raise UsageError(str(out), "another run is writing into it", "", "wait for it, or name another -o")
    try:
        yield
    finally:
        release()


def _locked(path: Path) -> Callable[[], object] | None:
    """Lock a file as filelock does, and return what takes the lock off.

    It is None where another one holds the lock.

    filelock imports asyncio, and has Python called at every file that is opened and every import until the process
    ends: 3 to 7 % of a run. It is used where the system, or the file system, knows no ``flock``.
    """
    if fcntl is not None:
        number = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return partial(os.close, number)
        except OSError as error:
            os.close(number)
            if error.errno in HELD:
                return None
            if error.errno != errno.ENOSYS:
                raise
    from filelock import FileLock, Timeout

    lock = FileLock(path, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        return None
    return lock.release


def prepare(out: Path) -> None:
    """Clear away what a killed run left, and mark the folder as ours."""
    clear_unfinished(out)
    if not (out / OUT_FOLDER_MARK).exists():
        write_index_of(out, ())  # from now on the folder is known for ours, whatever happens to the run


def clear_unfinished(out: Path) -> None:
    """Clear away what nobody writes any more.

    This run is alone in here, and none of its jobs is running.
    """
    for name in os.listdir(out):  # noqa: PTH208 (a pattern is three times as slow, which 100 000 folders tell)
        if name.startswith(PARTIAL_PREFIX):
            shutil.rmtree(out / name, ignore_errors=True)
