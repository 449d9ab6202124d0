"""Figures painted by several processes: equal bytes, and whatever becomes of the others every figure is there."""

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import psutil
import pytest

from groundstation.chapters.parts import Document, Front, Section
from groundstation.reports import painting
from groundstation.reports.drawing import Drawing, Sketch, draw, sketching

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")


def sketches(paint: Callable[[Any, int], None]) -> dict[str, Sketch]:
    def of(number: int) -> Callable[[Any], None]:
        return lambda figure: paint(figure, number)

    return {f"figure-{number}": Sketch(20.0, of(number), 40.0) for number in range(6)}


def curve(figure: Any, number: int) -> None:
    figure.subplots().plot([0.0, 1.0, 2.0], [number, 1.0, 0.5])


def by_another(then: Callable[[], object]) -> Callable[[Any, int], None]:
    """Curves; another process than this one does something else before its first."""
    this = os.getpid()

    def paint(figure: Any, number: int) -> None:
        if os.getpid() != this:
            then()
        time.sleep(0.02)  # the other one takes some
        curve(figure, number)

    return paint


@pytest.fixture(autouse=True)
def _no_process_is_left() -> Iterator[None]:
    before = {child.pid for child in psutil.Process().children()}
    yield
    assert {child.pid for child in psutil.Process().children()} <= before


@pytest.mark.parametrize("processes", [2, 3])
def test_the_number_of_processes_changes_no_byte(processes: int) -> None:
    asked = sketches(curve)
    alone = {key: draw(key, sketch.height_mm, sketch.paint, sketch.width_mm) for key, sketch in asked.items()}
    found = painting.painted(asked, processes)
    assert list(found) == list(alone) and found == alone
    assert [repr(found[key].panels) for key in alone] == [repr(alone[key].panels) for key in alone]


@pytest.mark.parametrize(
    "then",
    [
        lambda: os.kill(os.getpid(), signal.SIGKILL),
        lambda: time.sleep(60.0),
        lambda: 1 / 0,
        lambda: os._exit(3),
    ],
    ids=["killed", "hangs", "fails", "ends"],
)
def test_what_another_process_does_not_deliver_is_painted_here(
    then: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(painting, "LATE_S", 0.2)
    monkeypatch.setattr(painting, "LATE", 0.1)
    found = painting.painted(sketches(by_another(then)), 2)
    assert found == painting.painted(sketches(curve))


def test_where_no_process_can_be_had_this_one_paints(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> int:
        raise BlockingIOError("Resource temporarily unavailable")

    monkeypatch.setattr(os, "fork", refuse)
    assert painting.painted(sketches(curve), 3) == painting.painted(sketches(curve))


def test_processes_that_the_system_buries_are_no_trouble() -> None:
    before = signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    try:
        assert painting.painted(sketches(curve), 2) == painting.painted(sketches(curve))
    finally:
        signal.signal(signal.SIGCHLD, before)


def test_what_cannot_be_painted_fails_as_it_does_alone() -> None:
    def paint(figure: Any, number: int) -> None:
        if number == 4:
            raise ValueError("no such curve")
        curve(figure, number)

    for processes in (1, 2):
        with pytest.raises(ValueError, match="no such curve"):
            painting.painted(sketches(paint), processes)


def test_within_sketching_nothing_is_painted() -> None:
    def tell() -> Document:
        part = Drawing("", "", "", draw("only", 20.0, lambda _figure: pytest.fail("painted"), 40.0))
        return Document("", "", Front("", ()), (Section("", "", "", (part,)),))

    with sketching() as gathered:
        assert painting.with_painted_figures(tell, 2) == tell()
    assert list(gathered) == ["only"]
