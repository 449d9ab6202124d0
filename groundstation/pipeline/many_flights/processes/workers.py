"""Worker processes that run jobs side by side.

One that dies or hangs takes its own log with it and no other.
"""

import json
import math
import multiprocessing
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import asdict, field
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from typing import Any, Generic

from groundstation.base.dataclasses import dataclass
from groundstation.base.garbage import search_rarely
from groundstation.base.halves import share_cores
from groundstation.base.without_pandas import spare_pandas
from groundstation.pipeline.many_flights.processes.crew import AnyJob, Work
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener, silent

TASKS_PER_PROCESS = 128  # a process grows by a megabyte with every recording
RESULTS_PER_PROCESS = 512  # without recordings a process does not grow, and a new one imports for a second
MOST_EVENT_CHARACTERS = 160  # of a name or a text: an event is one write to a pipe, 4096 bytes that nothing cuts in two
LOOK_EVERY_S, END_S = 0.2, 5.0  # for jobs that take too long; given to their processes to end
_END = b""


# Spawned, never forked: numba, Arrow and Rerun hold threads that a fork would freeze.
_CONTEXT = multiprocessing.get_context("spawn")
_tell: Listener = silent  # of a worker process: how it tells the run of its stages
_tell_begin: Callable[[object], None] = print  # ... and of the number of a job that it begins


def side_by_side(
    tasks: Iterable[tuple[int, AnyJob]],
    run: Callable[[AnyJob, Listener], Outcome],
    *,
    workers: int,
    listen: Listener,
    timeout_s: float = math.inf,
    tasks_per_process: int = TASKS_PER_PROCESS,
) -> Generator[tuple[int, Outcome]]:
    """Run jobs in several processes; yields number and outcome as each one ends.

    A process that is killed (by the system when memory runs out) breaks the pool with everything in it. What was in it
    is run again, one job at a time: the job whose process dies again has failed, and the others go on. A job that takes
    longer than ``timeout_s`` has failed, too; its pool is ended, and what else was in it is run again as it was.
    """
    queue = _Queue(iter(tasks))
    until_broken = partial(_until_broken, timeout_s=timeout_s, tasks_per_process=tasks_per_process)
    with _events(listen, queue) as sender:
        while True:
            suspects: list[tuple[int, AnyJob]] = []
            yield from until_broken(queue, run, workers, sender, suspects)
            for task in suspects:
                broken: list[tuple[int, AnyJob]] = []
                yield from until_broken(_Queue(iter((task,)), queue.begun), run, 1, sender, broken)
                for number, job in broken:
                    reason = f"{job.name}: its process died (killed, or out of memory)"
                    yield number, Outcome(job.log, "failed", reason)
            if queue.is_empty:
                return


@dataclass
class _Queue(Generic[AnyJob]):
    """Jobs that wait: those to be run again, then the others.

    It also has when each of those that run began, by number.
    """

    waiting: Iterator[tuple[int, AnyJob]]
    begun: dict[int, float] = field(default_factory=dict)
    again: deque[tuple[int, AnyJob]] = field(default_factory=deque)
    is_empty: bool = False

    def next(self) -> tuple[int, AnyJob] | None:
        task = self.again.popleft() if self.again else next(self.waiting, None)
        self.is_empty = task is None
        return task

    def put_back(self, tasks: Iterable[tuple[int, AnyJob]]) -> None:
        self.again.extend(tasks)
        self.is_empty &= not self.again

    def is_overdue(self, number: int, timeout_s: float) -> bool:
        return time.monotonic() - self.begun.get(number, math.inf) > timeout_s


def overdue(job: Work, timeout_s: float) -> Outcome:
    """The outcome of a job that was ended because it took too long."""
    return Outcome(job.log, "failed", f"{job.name}: not done within {timeout_s:g} s (--timeout), ended")


def _until_broken(
    queue: _Queue[AnyJob],
    run: Callable[[AnyJob, Listener], Outcome],
    workers: int,
    sender: Connection,
    broken: list[tuple[int, AnyJob]],
    timeout_s: float,
    tasks_per_process: int,
) -> Generator[tuple[int, Outcome]]:
    """Run jobs until there are none, or until a process dies.

    Then those that were in the pool are ``broken``.

    Where a job takes too long, those that were in the pool with it are in the queue again.
    """
    pool = ProcessPoolExecutor(
        workers,
        mp_context=_CONTEXT,
        initializer=_begin,
        initargs=(sender, workers),
        max_tasks_per_child=tasks_per_process,
    )
    running: dict[Future[Outcome], tuple[int, AnyJob]] = {}

    def hand_over() -> None:
        """One job more than there are workers, so that none waits for its next."""
        while len(running) <= workers and not broken and (task := queue.next()) is not None:
            queue.begun.pop(task[0], None)
            try:
                running[pool.submit(_run, run, task[0], task[1])] = task
            except BrokenExecutor:
                broken.append(task)

    try:
        hand_over()
        while running:
            done, _ = wait(running, LOOK_EVERY_S if math.isfinite(timeout_s) else None, return_when=FIRST_COMPLETED)
            late = {future for future in running.keys() - done if queue.is_overdue(running[future][0], timeout_s)}
            for future in done:
                task = running.pop(future)
                try:
                    outcome = future.result()
                except BrokenExecutor:
                    broken.append(task)
                else:
                    yield task[0], outcome
            if late:
                queue.put_back(task for future, task in running.items() if future not in late)
                _end(pool, at_once=True)
                yield from ((running[future][0], overdue(running[future][1], timeout_s)) for future in late)
                return
            hand_over()
    except BaseException:  # interrupted: nobody waits for the rest
        _end(pool, at_once=False)
        raise
    pool.shutdown(wait=False)  # its processes end while this one goes on


def _end(pool: ProcessPoolExecutor, *, at_once: bool) -> None:
    """End the processes of a pool, ``at_once`` also those that do not listen.

    One that cannot end is not waited for.
    """
    processes = list((getattr(pool, "_processes", None) or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.kill() if at_once else process.terminate()
    if at_once:
        wait_for([process.sentinel for process in processes], END_S)


def _run(run: Callable[[AnyJob, Listener], Outcome], number: int, job: AnyJob) -> Outcome:
    _tell_begin(number)
    return run(job, _tell)


def _begin(sender: Connection, workers: int) -> None:
    """Set up a worker process, one of so many.

    Its stages are told through the pipe, and it ends with the run, however that ends.
    """
    global _tell, _tell_begin
    _tell = _teller(sender)
    _tell_begin = partial(_send, sender)
    spare_pandas()
    search_rarely()
    share_cores(workers)
    threading.Thread(target=_end_with_the_run, name="parent", daemon=True).start()


def _end_with_the_run() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for([parent.sentinel])
        os._exit(1)


def _teller(sender: Connection) -> Callable[[Event], None]:
    def tell(event: Event) -> None:
        short = {
            key: value[:MOST_EVENT_CHARACTERS] if isinstance(value, str) else value
            for key, value in asdict(event).items()
        }
        _send(sender, short)

    return tell


def _send(sender: Connection, message: object) -> None:
    with suppress(OSError):  # the run is gone
        sender.send_bytes(json.dumps(message).encode())


@contextmanager
def _events(listen: Listener, queue: _Queue[Any]) -> Iterator[Connection]:
    """Pipe for the events of all workers, and for the numbers of the jobs that they begin.

    A thread passes the events on.

    Every event is one short write, which the system does not mix with another's: no lock that a killed process holds.
    """
    receiver, sender = _CONTEXT.Pipe(duplex=False)

    def pass_on() -> None:
        while (data := receiver.recv_bytes()) != _END:
            message: dict[str, Any] | int = json.loads(data)
            if isinstance(message, int):
                queue.begun[message] = time.monotonic()
            else:
                listen(Event(**message))

    thread = threading.Thread(target=pass_on, name="events", daemon=True)
    thread.start()
    try:
        yield sender
    finally:
        sender.send_bytes(_END)
        thread.join()
        sender.close()
        receiver.close()
