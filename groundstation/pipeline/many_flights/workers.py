"""Worker processes that run jobs side by side; one that dies takes its own log with it and no other."""

import json
import multiprocessing
import os
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import asdict
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from typing import Any, Protocol, TypeVar

from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener, silent

TASKS_PER_PROCESS = 32  # Rerun leaves a few threads behind for every recording
MOST_EVENT_CHARACTERS = 160  # of a name or a text: an event is one write to a pipe, 4096 bytes that nothing cuts in two
_END = b""


class Work(Protocol):
    """What can be run: where its log is as the user would type it, and the log's name."""

    @property
    def log(self) -> str: ...

    @property
    def name(self) -> str: ...


AnyJob = TypeVar("AnyJob", bound=Work)


class Crew(Protocol):
    """Runs jobs, in whatever order; yields the number and the outcome of each as it ends."""

    def __call__(
        self, tasks: Iterable[tuple[int, AnyJob]], run: Callable[[AnyJob, Listener], Outcome], /
    ) -> Generator[tuple[int, Outcome]]: ...


# Spawned, never forked: numba, Arrow and Rerun hold threads that a fork would freeze.
_CONTEXT = multiprocessing.get_context("spawn")
_tell: Listener = silent  # of a worker process: how it tells the run of its stages


def in_turn(
    tasks: Iterable[tuple[int, AnyJob]], run: Callable[[AnyJob, Listener], Outcome], *, listen: Listener
) -> Generator[tuple[int, Outcome]]:
    """Run jobs in this process, one after the other; yields the number and the outcome of each."""
    for number, job in tasks:
        yield number, run(job, listen)


def side_by_side(
    tasks: Iterable[tuple[int, AnyJob]],
    run: Callable[[AnyJob, Listener], Outcome],
    *,
    workers: int,
    listen: Listener,
) -> Generator[tuple[int, Outcome]]:
    """Run jobs in several processes; yields number and outcome as each one ends.

    A process that is killed (by the system when memory runs out) breaks the pool with everything in it. What was in it
    is run again, one job at a time: the job whose process dies again has failed, and the others go on.
    """
    waiting = iter(tasks)
    with _events(listen) as sender:
        while True:
            suspects: list[tuple[int, AnyJob]] = []
            yield from _until_broken(waiting, run, workers, sender, suspects)
            if not suspects:
                return
            for task in suspects:
                broken: list[tuple[int, AnyJob]] = []
                yield from _until_broken(iter((task,)), run, 1, sender, broken)
                for number, job in broken:
                    reason = f"{job.name}: its process died (killed, or out of memory)"
                    yield number, Outcome(job.log, "failed", reason)


def _until_broken(
    waiting: Iterator[tuple[int, AnyJob]],
    run: Callable[[AnyJob, Listener], Outcome],
    workers: int,
    sender: Connection,
    broken: list[tuple[int, AnyJob]],
) -> Generator[tuple[int, Outcome]]:
    """Run jobs until there are none, or until a process dies: then those that were in the pool are ``broken``."""
    pool = ProcessPoolExecutor(
        workers, mp_context=_CONTEXT, initializer=_begin, initargs=(sender,), max_tasks_per_child=TASKS_PER_PROCESS
    )
    running: dict[Future[Outcome], tuple[int, AnyJob]] = {}

    def hand_over() -> None:
        """One job more than there are workers, so that none waits for its next."""
        while len(running) <= workers and not broken and (task := next(waiting, None)) is not None:
            try:
                running[pool.submit(_run, run, task[1])] = task
            except BrokenExecutor:
                broken.append(task)

    try:
        hand_over()
        while running:
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                task = running.pop(future)
                try:
                    outcome = future.result()
                except BrokenExecutor:
                    broken.append(task)
                else:
                    yield task[0], outcome
            hand_over()
    except BaseException:  # interrupted: nobody waits for the rest
        processes = list((getattr(pool, "_processes", None) or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        raise
    pool.shutdown()


def _run(run: Callable[[AnyJob, Listener], Outcome], job: AnyJob) -> Outcome:
    return run(job, _tell)


def _begin(sender: Connection) -> None:
    """Set up a worker process: its stages are told through the pipe, and it ends with the run, however that ends."""
    global _tell
    _tell = _teller(sender)
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
        with suppress(OSError):  # the run is gone
            sender.send_bytes(json.dumps(short).encode())

    return tell


@contextmanager
def _events(listen: Listener) -> Iterator[Connection]:
    """A pipe for the events of all workers, which a thread passes on.

    Every event is one short write, which the system does not mix with another's: no lock that a killed process holds.
    """
    receiver, sender = _CONTEXT.Pipe(duplex=False)

    def pass_on() -> None:
        while (data := receiver.recv_bytes()) != _END:
            document: dict[str, Any] = json.loads(data)
            listen(Event(**document))

    thread = threading.Thread(target=pass_on, name="events", daemon=True)
    thread.start()
    try:
        yield sender
    finally:
        sender.send_bytes(_END)
        thread.join()
        sender.close()
        receiver.close()


def cores() -> int:
    """How many processes run at once unless somebody says otherwise: the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
