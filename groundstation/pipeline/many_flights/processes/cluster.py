"""Jobs on a cluster of Dask, which schedules and repeats them.

groundstation must be installed on its workers.
"""

import logging
import math
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future as Promise
from concurrent.futures import wait
from contextlib import contextmanager, suppress
from itertools import islice
from typing import TYPE_CHECKING

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.version import __version__
from groundstation.pipeline.many_flights.processes.crew import AnyJob, Work
from groundstation.pipeline.many_flights.processes.workers import overdue
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Listener, silent

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_S, RESTART_S = 10, 30
AHEAD = 2  # jobs for each thread of the cluster that are handed over before one has ended
_one_at_a_time = threading.Lock()  # a worker may have several threads; figures and recordings are for one


def on_cluster(
    tasks: Iterable[tuple[int, AnyJob]],
    run: Callable[[AnyJob, Listener], Outcome],
    *,
    scheduler: str,
    timeout_s: float = math.inf,
) -> Generator[tuple[int, Outcome]]:
    """Run jobs on the workers of a scheduler; yields number and outcome as each one ends.

    A job whose worker dies is run again by another; one that has killed several has failed. One that takes longer than
    ``timeout_s`` has failed, too: its worker is started anew, if it has a nanny, or goes on beside what hangs.

    Parameters
    ----------
    tasks : iterable of (int, job)
    run : callable
        Of the package, and the same in all processes: what a worker calls with a job.
    scheduler : str
        Its address, ``tcp://HOST:PORT``.

    Raises
    ------
    UsageError
        When there is no scheduler, no worker, or one with another version.
    GroundstationError
        When the scheduler goes away.
    """
    with _connected(scheduler) as client:
        from distributed import as_completed

        waiting = iter(tasks)
        running: dict[object, tuple[int, AnyJob]] = {}

        def handed_over(most: int) -> list["Future"]:
            futures = []
            for task in islice(waiting, most):
                futures.append(client.submit(_alone, run, task[1], timeout_s, pure=False))
                running[futures[-1].key] = task
            return futures

        ended = as_completed(handed_over(AHEAD * sum(client.nthreads().values())), loop=client.loop)
        for future in ended:
            number, job = running.pop(future.key)
            if future.cancelled():
                hint = "start it and run again: finished work is kept"
                raise GroundstationError(scheduler, "the scheduler is gone", "", hint)
            error = future.exception()
            result = future.result() if error is None else _failed(job, error)
            future.release()  # what has been fetched is not computed again when its worker dies later
            if isinstance(error, _HangingError):
                _start_anew(client, error.worker)
                result = overdue(job, timeout_s)
            yield number, result
            ended.update(handed_over(1))


class _HangingError(Exception):
    """Error that a worker raises when a job takes too long.

    It is no result: those are kept by their worker, and computed again by another one when that worker is started anew
    before its scheduler hears that they were fetched. The job would hang there, too.
    """

    def __init__(self, worker: str) -> None:
        super().__init__(worker)
        self.worker = worker


def _alone(run: Callable[[AnyJob, Listener], Outcome], job: AnyJob, timeout_s: float) -> Outcome:
    with _one_at_a_time:
        if math.isinf(timeout_s):
            return run(job, silent)
        promise: Promise[Outcome] = Promise()
        threading.Thread(target=_keep, args=(promise, run, job), name="job", daemon=True).start()
        wait([promise], timeout_s)
        if promise.done():
            return promise.result()
    from distributed import get_worker

    raise _HangingError(get_worker().address)


def _keep(promise: Promise[Outcome], run: Callable[[AnyJob, Listener], Outcome], job: AnyJob) -> None:
    try:
        promise.set_result(run(job, silent))
    except BaseException as error:
        promise.set_exception(error)


def _start_anew(client: "Client", worker: str) -> None:
    """End a worker's process, which its nanny starts again.

    A worker without a nanny stays as it is.
    """
    with suppress(Exception):  # whatever is wrong with that worker concerns no other
        client.restart_workers([worker], timeout=RESTART_S, raise_for_error=False)


def _failed(job: Work, error: BaseException) -> Outcome:
    return Outcome(job.log, "failed", f"{job.name}: its worker ended ({' '.join(str(error).split())[:200]})")


@contextmanager
def _connected(scheduler: str) -> Iterator["Client"]:
    try:
        from distributed import Client
    except ImportError as error:
        raise UsageError(scheduler, "no package distributed", "", "pip install 'groundstation[cluster]'") from error
    for name in ("distributed", "distributed.client"):  # the second has a level of its own
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what is wrong is told in one line here
    try:
        client = Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UsageError(scheduler, f"no scheduler answers ({error})", "tcp://HOST:PORT of a running one") from error
    with client:
        _refuse_others(client, scheduler)
        yield client


def _refuse_others(client: "Client", scheduler: str) -> None:
    """Raise UsageError unless there are workers, all of them with this version."""
    found = client.run(_installed_version, on_error="return")
    if not found:
        raise UsageError(scheduler, "no worker", "one or more", "start some: dask worker " + scheduler)
    for worker, version in sorted(found.items()):
        if version != __version__:
            raise UsageError(worker, f"groundstation {version}", __version__, "install the same version on all workers")


def _installed_version() -> str:
    return __version__
