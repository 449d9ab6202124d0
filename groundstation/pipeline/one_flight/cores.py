"""How many processes work at once."""

import os


def cores() -> int:
    """How many processes run at once unless somebody says otherwise: the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
