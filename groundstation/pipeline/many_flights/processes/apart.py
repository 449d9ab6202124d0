"""Jobs each in a process of its own, with limits.

A log that goes beyond them costs itself alone.
"""

import json
import math
import multiprocessing
import os
import pickle
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UsageError
from groundstation.base.serial import MismatchError, from_json
from groundstation.pipeline.many_flights.processes.confined import ProcessLimits, begin
from groundstation.pipeline.many_flights.processes.crew import AnyJob, Work
from groundstation.pipeline.one_flight.isolation import Isolation
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener

_CONTEXT = multiprocessing.get_context("spawn")
MOST_MESSAGE_BYTES = 1 << 28  # of what a process tells; a ledger of 10 000 topics takes 20 MB
END_S = 15.0  # for a process that keeps watch to end what it watches
DIED = "its process died (killed, or out of memory)"
Found = TypeVar("Found")


def bounds_of(isolation: Isolation | None, timeout_s: float = math.inf) -> ProcessLimits:
    """Limits of one log.

    The settings give them where it is read apart (``isolation``), else ``--timeout`` alone.

    Raises
    ------
    UsageError
        When this system cannot read a log apart.
    """
    if isolation is None:
        return ProcessLimits(timeout_s)
    if not hasattr(os, "fork"):
        raise UsageError("--isolate", "a system without limits for processes", "Linux or macOS")
    is_shorter = timeout_s <= isolation.time_s
    return ProcessLimits(
        min(timeout_s, isolation.time_s),
        "--timeout" if is_shorter else "isolation.time_s",
        round(isolation.memory_mb * 1e6),
        round(isolation.file_mb * 1e6),
        is_isolated=True,
    )


def outcomes_apart(
    tasks: Iterable[tuple[int, AnyJob]],
    run: Callable[[AnyJob, Listener], Outcome],
    *,
    workers: int,
    listen: Listener,
    bounds: ProcessLimits,
) -> Generator[tuple[int, Outcome]]:
    """Run jobs each in a process of its own, several side by side.

    Yields number and outcome as each ends.
    """

    def failed(job: Work, reason: str) -> Outcome:
        return Outcome(job.log, "failed", f"{job.name}: {reason}")

    yield from each_apart(tasks, run, Outcome, failed, workers=workers, listen=listen, bounds=bounds)


def each_apart(
    tasks: Iterable[tuple[int, AnyJob]],
    run: Callable[[AnyJob, Listener], Found],
    kind: type[Found],
    failed: Callable[[AnyJob, str], Found],
    *,
    workers: int,
    listen: Listener,
    bounds: ProcessLimits,
) -> Generator[tuple[int, Found]]:
    """Run jobs each in a process of its own; yields the number of each and what it found.

    Parameters
    ----------
    tasks : iterable of (int, job)
    run : callable
        A function of a module, or a partial of one, that takes a job and a listener.
    kind : type
        The dataclass that ``run`` returns.
    failed : callable
        Makes one of those from a job and the reason why its process gave none.
    workers : int
        Processes side by side.
    listen : callable
        Is told the events of all of them.
    bounds : ProcessLimits
        What each may take.
    """
    waiting, running = iter(tasks), dict[Connection, _Running[AnyJob]]()
    try:
        while True:
            while len(running) < workers and (task := next(waiting, None)) is not None:
                one = _started(*task, run, bounds)
                running[one.receiver] = one
            if not running:
                return
            for receiver in _heard(running.values()):
                one = running[receiver]
                for event in one.take():
                    listen(event)
                if one.is_ended:
                    del running[receiver]
                    one.end()
                    yield one.number, one.answer(kind, failed)
    finally:
        for one in running.values():
            one.end()


def _heard(running: Iterable["_Running[Any]"]) -> list[Connection]:
    """Processes that have something to tell, or whose time is over."""
    by_receiver = {one.receiver: one for one in running}
    next_end = min(one.deadline for one in by_receiver.values()) - time.monotonic()
    ready = wait(list(by_receiver), None if math.isinf(next_end) else max(next_end, 0.0))
    late = [receiver for receiver, one in by_receiver.items() if time.monotonic() >= one.deadline]
    return [receiver for receiver in by_receiver if receiver in ready or receiver in late]


@dataclass
class _Running(Generic[AnyJob]):
    """A process that runs a job, and what it has told so far."""

    number: int
    job: AnyJob
    process: BaseProcess
    receiver: Connection
    bounds: ProcessLimits
    deadline: float
    is_ended: bool = False
    found: Any = None
    reason: str = ""

    def take(self) -> Iterator[Event]:
        """Take in what the process has told; yields its events."""
        try:
            while not self.is_ended and self.receiver.poll():
                message = json.loads(self.receiver.recv_bytes(MOST_MESSAGE_BYTES))
                if "event" in message:
                    yield Event(**message["event"])
                elif "found" in message:
                    self.found = message["found"]
                else:
                    self.reason = str(message["ended"])
        except (EOFError, OSError):
            self.is_ended = True
        except (ValueError, TypeError, KeyError, RecursionError):
            self.is_ended, self.found, self.reason = True, None, "its process told what cannot be understood"
        if time.monotonic() >= self.deadline:
            self.is_ended, self.reason = True, self.reason or self.bounds.late

    def end(self) -> None:
        """End the process, at once unless it keeps watch over another."""
        if self.process.is_alive() and self.bounds.is_isolated:
            self.process.terminate()
            self.process.join(END_S)
        self.process.kill()
        self.process.join()
        self.receiver.close()
        self.process.close()

    def answer(self, kind: type[Found], failed: Callable[[AnyJob, str], Found]) -> Found:
        """Answer of the process, or that it found nothing."""
        if self.reason or self.found is None:
            return failed(self.job, self.reason or DIED)
        try:
            return from_json(kind, self.found)
        except MismatchError:
            return failed(self.job, "its process told what cannot be understood")


def _started(
    number: int, job: AnyJob, run: Callable[[AnyJob, Listener], Found], bounds: ProcessLimits
) -> _Running[AnyJob]:
    receiver, sender = _CONTEXT.Pipe(duplex=False)
    process = _CONTEXT.Process(target=begin, args=(sender, pickle.dumps((run, job)), bounds), name="log")
    process.start()
    sender.close()
    allowed_s = bounds.time_s + (END_S if bounds.is_isolated else 0.0)  # the one that keeps watch comes first
    return _Running(number, job, process, receiver, bounds, time.monotonic() + allowed_s)
