"""Imports kept out of the garbage collector's searches.

A run imports some 1800 modules, and Python's search for garbage went through them again and again as they came, then at
the end of the process: a seventh of the processor time of `run` on a short log.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def importing() -> Iterator[None]:
    """Switch garbage collection off while modules are imported.

    Objects that exist at its end are left out of every later search (``gc.freeze``).

    For processes of the command line alone: in a notebook, garbage of others would stay with it.

    Examples
    --------
    >>> with importing():
    ...     import json
    >>> gc.isenabled()
    True
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_enabled:
            gc.enable()
