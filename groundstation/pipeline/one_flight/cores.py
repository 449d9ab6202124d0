"""How many processes work at once."""

import os


def cores() -> int:
    """How many processes run at once unless somebody says otherwise: the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def painters_of(processes: int, logs: int) -> int:
    """How many processes paint the figures of each log where so many run in all: those that no log needs are shared.

    Examples
    --------
    >>> painters_of(8, 1), painters_of(8, 3), painters_of(2, 100)
    (8, 2, 1)
    """
    return max(1, processes // max(1, logs))
