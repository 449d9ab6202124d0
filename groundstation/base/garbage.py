"""Imports kept out of the garbage collector's searches; freed memory given back.

A run imports some 1800 modules, and Python's search for garbage went through them again and again as they came, then at
the end of the process: a seventh of the processor time of `run` on a short log, a fifth of that of `convert`.
"""

import ctypes
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

NEW_OBJECTS = 200_000  # some 20 MB; a search among them takes 15 ms of a start


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


def search_rarely() -> None:
    """Search for garbage once in 200 000 new objects from now on, for a worker process.

    Python's own number is 700. What is in no circle is freed at once, as ever.
    """
    gc.set_threshold(NEW_OBJECTS, *gc.get_threshold()[1:])


@contextmanager
def rarely_searched() -> Iterator[None]:
    """Search for garbage once in 200 000 new objects, and not at the end of the process.

    For processes of the command line alone, like :func:`importing`.

    Examples
    --------
    >>> usual = gc.get_threshold()
    >>> with rarely_searched():
    ...     gc.get_threshold()[0]
    200000
    >>> gc.get_threshold() == usual
    True
    """
    usual = gc.get_threshold()
    search_rarely()
    try:
        yield
    finally:
        gc.freeze()
        gc.set_threshold(*usual)


def give_back() -> bool:
    """Give freed memory back to the system; tell whether the C library could.

    glibc keeps what was freed between blocks that are in use, and takes arrays of more than 32 MB from the system all
    the same: after a long log has been gone through, tens of megabytes lie idle while those are made.

    Examples
    --------
    >>> give_back() in (True, False)
    True
    """
    if sys.platform != "linux":
        return False
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # of glibc alone
    return trim is not None and bool(trim(0))
