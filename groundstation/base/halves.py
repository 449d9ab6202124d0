"""Work in two halves: on two cores at once where there are two."""

import os
from collections.abc import Callable
from threading import Thread


def has_two_cores() -> bool:
    """Tell whether this process may use two cores or more.

    Examples
    --------
    >>> has_two_cores() in (True, False)
    True
    """
    allowed = getattr(os, "sched_getaffinity", None)
    return (len(allowed(0)) if allowed else os.cpu_count() or 1) > 1


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
