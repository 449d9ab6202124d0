"""Modules of the later steps of a run, imported while its log is read.

A log is read, digested and compressed mostly by libraries in C, which let Python run beside them. On a second core the
imports of estimating and drawing, some 0.4 s, then cost a user no time; on one core they cost what they always do.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from threading import Event, Thread

from groundstation.systems import systems

COMPUTING = ("scipy.special", "cattrs")
DRAWING = ("groundstation.viewer.recording", "groundstation.reports.page", "jinja2")
FLEET_DRAWING = ("groundstation.viewer.fleet", "groundstation.reports.page", "jinja2")


@contextmanager
def imported_meanwhile(*, with_pages: bool) -> Iterator[None]:
    """Import in a second thread what computes a flight, and what draws it ``with_pages``.

    The block ends when all is imported: whoever imports it next finds it whole. A block that fails waits for the module
    at hand alone. What cannot be imported fails where it is needed.

    Examples
    --------
    >>> with imported_meanwhile(with_pages=False):
    ...     print("reading")
    reading
    """
    with _meanwhile(_imports(with_pages=with_pages)):
        yield


@contextmanager
def fleet_imported_meanwhile(*, with_pages: bool) -> Iterator[None]:
    """Import like :func:`imported_meanwhile` what puts flights together to a fleet.

    It is for the process that waits for the flights of others.
    """
    with _meanwhile(_fleet_imports(with_pages=with_pages)):
        yield


@contextmanager
def _meanwhile(imports: Iterator[Callable[[], object]]) -> Iterator[None]:
    is_over = Event()
    thread = Thread(target=_import_all, args=(tuple(imports), is_over), name="imports")
    thread.start()
    try:
        yield
    except BaseException:
        is_over.set()
        raise
    finally:
        thread.join()


def _imports(*, with_pages: bool) -> Iterator[Callable[[], object]]:
    """Yield what imports a module, or those of the systems that are drawn."""
    yield from (partial(import_module, name) for name in (*COMPUTING, *(DRAWING if with_pages else ())))
    if with_pages:
        yield from (lambda: systems().tabs, lambda: systems().chapters, lambda: systems().plots)


def _fleet_imports(*, with_pages: bool) -> Iterator[Callable[[], object]]:
    yield partial(import_module, "cattrs")
    yield lambda: systems().in_fleet
    if with_pages:
        yield from (partial(import_module, name) for name in FLEET_DRAWING)
        yield from (lambda: systems().fleet_chapters, lambda: systems().fleet_plots, lambda: systems().fleet_tabs)


def _import_all(imports: tuple[Callable[[], object], ...], is_over: Event) -> None:
    for one in imports:
        if is_over.is_set():
            return
        with suppress(Exception):
            one()
