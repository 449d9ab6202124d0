"""The figures of a report painted by several processes, each taking the next one when it is free.

Processes are forked: they share the arrays and whatever is loaded, where new ones would spend more on imports than most
reports take. A forked process must not touch threads of the one it came from, and painting needs none: matplotlib and
numpy alone. Whatever a process does not deliver is painted here, so that a process that ends, hangs or is killed costs
time and nothing else.
"""

import os
import pickle
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from types import MappingProxyType
from typing import IO

from groundstation.base.failures import attempt
from groundstation.chapters.parts import Document, Part
from groundstation.reports.drawing import Drawing, Sketch, draw, is_sketching, sketching
from groundstation.reports.live import Svg

CAN_FORK = sys.platform == "linux"
FEWEST = 4  # figures that are worth another process
LATE, LATE_S = 3.0, 10.0  # another process may end so many times the time of this one later, and at least so long
LOOK_EVERY_S = 0.005
NUMBER_BYTES = 2


class Painting:
    """Document that is told and whose figures are being painted (or gathered as sketches)."""

    def __init__(self, document: Document, finish: Callable[[], dict[str, Svg]] | None) -> None:
        self._document, self._finish = document, finish
        self._pictures: dict[str, Svg] = {}

    def finished(self) -> Document:
        """Finish the document, painting with the others; figures that fail are left out."""
        if self._finish is None:
            return self._document
        self._pictures = self._finish()
        return self._with_pictures(self._document)

    def told_again(self, tell: Callable[[], Document]) -> Document:
        """The document told another time, with the figures that were painted."""
        if self._finish is None:
            return tell()
        with sketching():
            document = tell()
        return self._with_pictures(document)

    def _with_pictures(self, document: Document) -> Document:
        sections = (
            replace(section, parts=tuple(_painted(section.parts, self._pictures))) for section in document.sections
        )
        return replace(document, sections=tuple(sections))


def with_painted_figures(tell: Callable[[], Document], processes: int = 1) -> Document:
    """A document with the figures that it draws while it is told, which then are painted.

    ``processes`` paint side by side; equal bytes whatever their number. Who gathers sketches gets a document with
    these.
    """
    with document_begun(tell, processes) as painting:
        return painting.finished()


@contextmanager
def document_begun(tell: Callable[[], Document], processes: int = 1) -> Iterator[Painting]:
    """Tell a document; other processes paint its figures while this one does something else."""
    if is_sketching():
        yield Painting(tell(), None)
        return
    with sketching() as sketches:
        document = tell()
    drawings = (part for section in document.sections for part in section.parts if isinstance(part, Drawing))
    with painting_begun(
        sketches, processes, {drawing.svg: drawing.name for drawing in drawings if not drawing.svg.is_painted}
    ) as finish:
        yield Painting(document, finish)


def _painted(parts: Iterable[Part], pictures: Mapping[str, Svg]) -> Iterator[Part]:
    """Parts with pictures; a drawing that has none is left out."""
    for part in parts:
        if not isinstance(part, Drawing) or part.svg.is_painted:
            yield part
        elif part.svg in pictures:
            yield replace(part, svg=pictures[part.svg])


def painted(sketches: Mapping[str, Sketch], processes: int = 1) -> dict[str, Svg]:
    """Paint sketches: pictures by key; without those that failed, where failures are gathered.

    Parameters
    ----------
    sketches : mapping of key to Sketch
    processes : int
        How many paint side by side, this one among them. One where the system cannot fork, or figures are few.
    """
    with painting_begun(sketches, processes) as finish:
        return finish()


@contextmanager
def painting_begun(
    sketches: Mapping[str, Sketch], processes: int = 1, names: Mapping[str, str] = MappingProxyType({})
) -> Iterator[Callable[[], dict[str, Svg]]]:
    """Let other processes begin to paint, as :func:`painted` has it; what is yielded paints with them to the end.

    ``names`` are those of the figures by key: what fails is told by its name, in the order of the sketches. matplotlib
    is not loaded for that: each process loads it, side by side, where it is not there already.
    """
    keys = list(sketches)
    others = min(processes, len(keys) // 2) - 1 if CAN_FORK and len(keys) >= FEWEST else 0

    def with_rest(pictures: Mapping[str, Svg]) -> dict[str, Svg]:
        """Pictures of all: those that lack are painted here, and fail where it can be told."""
        found = (
            (key, pictures.get(key) or attempt("figure", names.get(key) or key, _paint, key, sketches[key]))
            for key in keys
        )
        return {key: picture for key, picture in found if picture is not None}

    if others < 1:
        yield lambda: with_rest({})
        return
    started = time.monotonic()
    at_work: list[_Painter] = []
    with _queue(len(keys)) as queue, ExitStack() as painters:
        with suppress(OSError):  # no further process is allowed, or there is nowhere to write: those at work go on
            for _ in range(others):
                at_work.append(painters.enter_context(_painter(keys, sketches, queue)))

        def finish() -> dict[str, Svg]:
            pictures = {}
            for number in _taken(queue):
                with suppress(Exception):  # what fails is painted again below
                    pictures[keys[number]] = _paint(keys[number], sketches[keys[number]])
            now = time.monotonic()
            for painter in at_work:
                pictures |= painter.delivered(now + max(LATE_S, LATE * (now - started)))
            return with_rest(pictures)

        yield finish


@contextmanager
def _queue(count: int) -> Iterator[int]:
    """A pipe that holds the numbers from zero on and ends behind them: each is read by one process alone."""
    reading, writing = os.pipe()
    try:
        os.write(writing, b"".join(number.to_bytes(NUMBER_BYTES) for number in range(count)))
        os.close(writing)
        yield reading
    finally:
        os.close(reading)


def _taken(queue: int) -> Iterator[int]:
    while number := os.read(queue, NUMBER_BYTES):
        yield int.from_bytes(number)


class _Painter:
    """Another process that paints; what it has painted stands in a file."""

    def __init__(self, pid: int, results: IO[bytes]) -> None:
        self.pid, self.results, self.has_ended = pid, results, False

    def delivered(self, deadline: float) -> dict[str, Svg]:
        """The pictures of the process by key, once it has ended; at the deadline it is ended."""
        while not self._look(os.WNOHANG) and time.monotonic() < deadline:
            time.sleep(LOOK_EVERY_S)
        self.end()
        pictures: dict[str, Svg] = {}
        self.results.seek(0)
        with suppress(EOFError, pickle.UnpicklingError):  # the last one of a process that was ended may be cut
            while True:
                key, picture = pickle.load(self.results)
                pictures[key] = picture
        return pictures

    def end(self) -> None:
        """End the process if it has not ended."""
        if not self._look(os.WNOHANG):
            os.kill(self.pid, signal.SIGKILL)
            self._look(0)

    def _look(self, options: int) -> bool:
        """Whether the process has ended; waits for it unless told not to."""
        try:
            self.has_ended = self.has_ended or os.waitpid(self.pid, options)[0] != 0
        except ChildProcessError:  # the system was told to bury them
            self.has_ended = True
        return self.has_ended


@contextmanager
def _painter(keys: Sequence[str], sketches: Mapping[str, Sketch], queue: int) -> Iterator[_Painter]:
    """A process that takes numbers from the queue and paints what they stand for; none is left behind."""
    parent = os.getpid()
    with tempfile.TemporaryFile() as results:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of threads, whose locks painting does not take
            pid = os.fork()
        if pid == 0:
            _paint_on(keys, sketches, queue, results, parent)
        painter = _Painter(pid, results)
        try:
            yield painter
        finally:
            painter.end()


def _paint_on(keys: Sequence[str], sketches: Mapping[str, Sketch], queue: int, results: IO[bytes], parent: int) -> None:
    """The life of another process. What it cannot paint is painted, and fails, where it can be told."""
    try:
        for number in _taken(queue):
            with suppress(Exception):
                picture = _paint(keys[number], sketches[keys[number]])
                pickle.dump((keys[number], picture), results)
                results.flush()
            if os.getppid() != parent:
                break
    finally:
        os._exit(0)  # nothing of the process it came from is closed or written here


def _paint(key: str, sketch: Sketch) -> Svg:
    return draw(key, sketch.height_mm, sketch.paint, sketch.width_mm)
