"""Crews: what runs the jobs of many logs, and the one that runs them in this process."""

from collections.abc import Callable, Generator, Iterable
from typing import Protocol, TypeVar

from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Listener


class Work(Protocol):
    """Job of any kind: its log as the user would type it, and the log's name."""

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


def in_turn(
    tasks: Iterable[tuple[int, AnyJob]], run: Callable[[AnyJob, Listener], Outcome], *, listen: Listener
) -> Generator[tuple[int, Outcome]]:
    """Run jobs in this process, one after the other.

    Yields the number and the outcome of each.
    """
    for number, job in tasks:
        yield number, run(job, listen)
