"""The process of one log alone: what it may take, and the end of all that it has started.

A process that is isolated has another above it, which only keeps watch: it forks before anything but the standard
library is loaded (no thread runs yet), ends the other one at its limits, and then whatever that one has left behind.
What comes back is JSON, never a pickle: it may come from a log that has taken the process over.
"""

import ctypes
import json
import math
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NoReturn

from groundstation.base.dataclasses import dataclass
from groundstation.base.garbage import search_rarely

LOOK_EVERY_S = 0.05
ROOM_BYTES = 32 << 30  # of addresses beyond the memory: libraries set aside much more than they use
_PDEATHSIG, _CHILD_SUBREAPER, _NO_NEW_PRIVS = 1, 36, 38  # of prctl, linux/prctl.h
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096


@dataclass(frozen=True)
class ProcessLimits:
    """Limits of the process of one log.

    Parameters
    ----------
    time_s : float
        By the clock; infinite for no limit.
    time_from : str
        Which setting the limit of time comes from.
    memory_bytes, file_bytes : int
        0 for no limit: memory in use by it and by those that it starts, and the size of a file it writes.
    is_isolated : bool
        Whether a process keeps watch over it, and it gains no rights.
    """

    time_s: float = math.inf
    time_from: str = "--timeout"
    memory_bytes: int = 0
    file_bytes: int = 0
    is_isolated: bool = False

    @property
    def late(self) -> str:
        """Reason that is told of a log that took too long."""
        return f"not done within {self.time_s:g} s ({self.time_from}), ended"


def begin(sender: Connection, payload: bytes, bounds: ProcessLimits) -> None:
    """Run a job that was handed over, in this process or in one below it.

    What comes of it goes to ``sender``.
    """
    search_rarely()
    if bounds.is_isolated:
        _keep(sender, payload, bounds)
    else:
        threading.Thread(target=_end_with_the_run, name="parent", daemon=True).start()
        _work(sender, payload)


def _end_with_the_run() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _work(sender: Connection, payload: bytes) -> None:
    run: Callable[[Any, Callable[[Any], None]], Any]
    run, job = pickle.loads(payload)
    lock = threading.Lock()

    def send(message: dict[str, Any]) -> None:
        with lock, suppress(OSError):  # the run is gone
            sender.send_bytes(json.dumps(message).encode())

    found = run(job, lambda event: send({"event": asdict(event)}))
    from groundstation.base.serial import to_json_exactly

    send({"found": to_json_exactly(found)})


# ------------------------------------------------------------------------------------------------ the one above


def _keep(sender: Connection, payload: bytes, bounds: ProcessLimits) -> None:
    """Fork the process that does the work and watch it.

    Where it does not end by itself, the reason is told.
    """
    asked_to_end: list[int] = []
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the run is interrupted, and ends this process in its way
    signal.signal(signal.SIGTERM, lambda number, _frame: asked_to_end.append(number))
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGCHLD})
    _prctl(_CHILD_SUBREAPER, 1)  # what the work leaves behind becomes a child of this process
    above, worker = os.getppid(), os.fork()
    if worker == 0:
        _be_the_worker(sender, payload, bounds)
    reason = _watch(worker, above, bounds, asked_to_end)
    _end_all(worker)
    with suppress(OSError):
        sender.send_bytes(json.dumps({"ended": reason}).encode())


def _be_the_worker(sender: Connection, payload: bytes, bounds: ProcessLimits) -> NoReturn:
    code = 1
    try:
        os.setsid()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGCHLD})
        _prctl(_PDEATHSIG, signal.SIGKILL)
        _prctl(_NO_NEW_PRIVS, 1)
        _limit(bounds)
        _work(sender, payload)
        code = 0
    finally:
        with suppress(OSError, ValueError):
            sys.stderr.flush()
        os._exit(code)


def _limit(bounds: ProcessLimits) -> None:
    """Let the system keep the limits, as far as it knows them."""
    import resource  # not on Windows

    limits = {resource.RLIMIT_CORE: 0}
    if bounds.memory_bytes:
        limits[resource.RLIMIT_AS] = bounds.memory_bytes + ROOM_BYTES
    if bounds.file_bytes:
        limits[resource.RLIMIT_FSIZE] = bounds.file_bytes
    if math.isfinite(bounds.time_s):  # of processor time, on all cores: the clock is kept by the process above
        limits[resource.RLIMIT_CPU] = math.ceil(bounds.time_s * (os.cpu_count() or 1)) + 1
    for kind, most in limits.items():
        _, hard = resource.getrlimit(kind)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        with suppress(OSError, ValueError):
            resource.setrlimit(kind, (most, most))


def _watch(worker: int, above: int, bounds: ProcessLimits, asked_to_end: list[int]) -> str:
    """Wait for the end of the worker; returns why it has to end now, if it has to.

    It has to at its limits, or where the run is gone.
    """
    deadline = time.monotonic() + bounds.time_s
    while True:
        ended, status = os.waitpid(worker, os.WNOHANG)
        if ended:
            return _why(status, bounds)
        if asked_to_end or os.getppid() != above:
            return "interrupted"
        if time.monotonic() > deadline:
            return bounds.late
        if bounds.memory_bytes and _memory_bytes(worker, bounds.memory_bytes) > bounds.memory_bytes:
            return f"more than {bounds.memory_bytes / 1e6:.0f} MB of memory (isolation.memory_mb), ended"
        if hasattr(signal, "sigtimedwait"):
            signal.sigtimedwait({signal.SIGCHLD}, LOOK_EVERY_S)
        else:
            time.sleep(LOOK_EVERY_S)


def _why(status: int, bounds: ProcessLimits) -> str:
    """Reason why a process ended; empty where it did what it was to do."""
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        if number == signal.SIGXCPU:
            return bounds.late
        return f"its process died ({signal.Signals(number).name})"
    return "" if os.WEXITSTATUS(status) == 0 else "its process died"


def _end_all(worker: int) -> None:
    """End a process and all that it has started, also what has left its group.

    None of them is left when it returns.
    """
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        with suppress(OSError):
            os.killpg(worker, signal.SIGKILL)
        for child in _children(os.getpid()):
            with suppress(OSError):
                os.kill(child, signal.SIGKILL)
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            return
        time.sleep(0.005)


def _children(process: int) -> Iterator[int]:
    """Processes that a process has started; none where the system does not tell."""
    for file in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(OSError):
            yield from map(int, file.read_text().split())


def _tree(process: int) -> Iterator[int]:
    yield process
    for child in list(_children(process)):
        yield from _tree(child)


def _memory_bytes(worker: int, limit: int) -> int:
    """Memory in use by a process and those below it; 0 where the system does not tell.

    What several of them share counts once where it would be too much otherwise: to tell that takes longer.
    """
    processes = list(_tree(worker))
    found = sum(map(_resident_bytes, processes))
    return found if found <= limit or len(processes) == 1 else sum(map(_own_share_bytes, processes))


def _resident_bytes(process: int) -> int:
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * _PAGE_BYTES
    except (OSError, IndexError, ValueError):
        return 0


def _own_share_bytes(process: int) -> int:
    try:
        lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
        return sum(int(line.split()[1]) * 1024 for line in lines if line.startswith("Pss:"))
    except (OSError, IndexError, ValueError):
        return _resident_bytes(process)


def _prctl(option: int, value: int) -> None:
    """Ask Linux for something about this process; nothing elsewhere."""
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(option, value, 0, 0, 0)
