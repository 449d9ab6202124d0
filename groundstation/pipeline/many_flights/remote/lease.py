"""Lock that keeps an OUT elsewhere to one run at a time.

In a bucket it is a small file that says whose it is and when it ends.
"""

import json
import os
import platform
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.remote.folder import RemoteFolder

LOCKS = ".lock"  # folder of an OUT; names in it are numbers, the highest one counts
LEASE_S, RENEW_S = 600.0, 60.0


@dataclass(frozen=True)
class _Held:
    """Lock as it was read."""

    name: str
    token: str
    owner: str
    until_s: float  # since 1970, by the owner's clock


class Lease:
    """The lock that this run holds; renewed by a thread for as long as the run lasts."""

    def __init__(self, folder: RemoteFolder, name: str, token: str) -> None:
        self._folder, self._name, self._token = folder, name, token
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._renew, name="lease", daemon=True)
        self._thread.start()

    def require(self) -> None:
        """Raise GroundstationError when another run has taken over.

        It may do so once the lock has ended.
        """
        held = _held(self._folder)
        if held is None or held.token != self._token:
            owner = "the lock was removed" if held is None else held.owner
            raise GroundstationError(self._folder.url, f"another run took over ({owner})", "", "run again")

    def release(self) -> None:
        """Give the lock back; one that another run has by now under the same number stays."""
        self._ended.set()
        self._thread.join()
        with suppress(GroundstationError):  # then it ends by itself
            if _read(self._folder, self._name).token == self._token:
                self._folder.remove(f"{LOCKS}/{self._name}")

    def _renew(self) -> None:
        while not self._ended.wait(RENEW_S):
            with suppress(GroundstationError):  # the next time
                self.require()
                self._folder.write(f"{LOCKS}/{self._name}", _content(self._token))


@contextmanager
def alone_elsewhere(folder: RemoteFolder) -> Iterator[Lease]:
    """Keep other runs out of an OUT elsewhere.

    A lock that nobody renewed has ended, ten minutes after its owner died, and another run takes over: it writes the
    next number, which the store lets only one do.

    Raises
    ------
    UsageError
        When another run holds it.
    """
    token = uuid.uuid4().hex
    held = _held(folder)
    if held is not None and held.until_s > time.time():
        raise _taken(folder, held)
    name = str(0 if held is None else int(held.name) + 1)
    if not folder.create(f"{LOCKS}/{name}", _content(token)):
        raise _taken(folder, _held(folder))
    lease = Lease(folder, name, token)
    try:
        lease.require()
        for other in _numbers(folder):
            if int(other) < int(name):
                folder.remove(f"{LOCKS}/{other}")
        yield lease
    finally:
        lease.release()


def _taken(folder: RemoteFolder, held: _Held | None) -> UsageError:
    if held is None:
        return UsageError(folder.url, "another run began at the same moment", "", "run again")
    until = utc_ns_to_iso(int(held.until_s) * NS_PER_S)
    hint = f"wait for it; if it is dead, its lock ends at {until} (or remove {LOCKS}/{held.name} there)"
    return UsageError(folder.url, f"another run is writing into it ({held.owner})", "", hint)


def _content(token: str) -> bytes:
    owner = f"{platform.node()}, process {os.getpid()}"
    return json.dumps({"token": token, "owner": owner, "until_s": time.time() + LEASE_S}).encode()


def _numbers(folder: RemoteFolder) -> list[str]:
    return sorted((name for name in folder.names(LOCKS) if name.isdecimal()), key=int)


def _held(folder: RemoteFolder) -> _Held | None:
    """The lock that counts, None without any."""
    numbers = _numbers(folder)
    return _read(folder, numbers[-1]) if numbers else None


def _read(folder: RemoteFolder, name: str) -> _Held:
    """Read a lock; one that cannot be read has ended."""
    try:
        told = json.loads(folder.read(f"{LOCKS}/{name}") or b"")
        return _Held(name, str(told["token"]), str(told["owner"]), float(told["until_s"]))
    except (ValueError, KeyError, TypeError):
        return _Held(name, "", "unknown", 0.0)
