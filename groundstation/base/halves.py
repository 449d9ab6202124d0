"""Work in two halves: on two cores at once where there are two."""

import os
from collections.abc import Callable
from threading import Thread

_sharing = [1]  # processes that share the cores, this one among them


def share_cores(processes: int) -> None:
    """Note that so many processes work side by side: each takes its share of the cores."""
    _sharing[0] = max(processes, 1)


def cores() -> int:
    """Return the number of cores that this process may use.

    Where several work side by side it is a share of them.

    Examples
    --------
    >>> cores() >= 1
    True
    """
    every = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(every // _sharing[0], 1)


def both(first: Callable[[], object], second: Callable[[], object]) -> None:
    """Run two functions at once, the second in a thread of its own.

    It is for work in compiled loops, which run beside Python. Raises what one of them raises, when both have ended.

    Examples
    --------
    >>> done = []
    >>> both(lambda: done.append(1), lambda: done.append(2))
    >>> sorted(done)
    [1, 2]
    """
    errors: list[BaseException] = []

    def run() -> None:
        try:
            second()
        except BaseException as error:
            errors.append(error)

    thread = Thread(target=run, name="half")
    thread.start()
    try:
        first()
    finally:
        thread.join()
    if errors:
        raise errors[0]
