"""End of a process of the command line, without taking its objects apart.

Python frees every module and object of a process that ends, and the system then frees their memory again: 3 % of a run,
8 % of the conversion of a short log. Threads have ended before, what asked to be called at the end has been called, and
the streams are flushed, all as ever.
"""

import atexit
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def ending_at_once() -> Iterator[None]:
    """End the process as soon as the block has raised SystemExit.

    All that others asked for at the end is done before. A block that ends in another way leaves the end to Python. So
    does a process in which somebody has asked before to be called at its end, as measurements of coverage do: they
    would be left out.
    """
    codes: list[int] = []

    def leave() -> None:
        try:
            sys.stdout.flush()
            sys.stderr.flush()
        except (AttributeError, OSError, ValueError):  # no stream, a reader that went away, a closed one
            return
        if codes:
            os._exit(codes[0])

    if _is_first():
        atexit.register(leave)  # what is registered first is called last
    try:
        yield
    except SystemExit as stop:
        if stop.code is None or isinstance(stop.code, int):
            codes.append((stop.code or 0) & 0xFF)
        raise


def _is_first() -> bool:
    """Tell whether nobody has asked yet to be called at the end.

    A Python that does not know is taken to have somebody.
    """
    asked: int = getattr(atexit, "_ncallbacks", lambda: 1)()
    return asked == 0
