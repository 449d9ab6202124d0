"""Work in two halves: on two cores at once where there are two."""

import os
from collections.abc import Callable, Sequence
from threading import Lock, Thread
from typing import TypeVar

One = TypeVar("One")
Other = TypeVar("Other")

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


def both(first: Callable[[], Other], second: Callable[[], object]) -> Other:
    """Run two functions at once, the second in a thread of its own.

    It is for work in compiled loops, which run beside Python. Returns what the first returns, and raises what one of
    them raises, when both have ended.

    Examples
    --------
    >>> done = []
    >>> both(lambda: len("four"), lambda: done.append(2)), done
    (4, [2])
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
        made = first()
    finally:
        thread.join()
    if errors:
        raise errors[0]
    return made


def two_at_once(function: Callable[[One], Other], items: Sequence[One]) -> list[Other]:
    """Return what a function makes of each item, in their order.

    Two are made at once where there are two cores. It is for work in compiled loops, as :func:`both`.

    Examples
    --------
    >>> two_at_once(lambda one: 2 * one, [1, 2, 3])
    [2, 4, 6]
    """
    if len(items) < 2 or cores() < 2:
        return [function(one) for one in items]
    made, left, lock = dict[int, Other](), iter(range(len(items))), Lock()

    def run() -> None:
        while True:
            with lock:
                at = next(left, -1)
            if at < 0:
                return
            made[at] = function(items[at])

    both(run, run)
    return [made[at] for at in range(len(items))]
