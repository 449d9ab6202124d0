"""Figures that are nothing but a frame of their size: a report on paper without three quarters of its work."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from groundstation.reports import drawing
from groundstation.reports.live import Svg


def blank(_key: str, height_mm: float, _paint: Callable[[Any], None], width_mm: float = drawing.WIDTH_MM) -> Svg:
    """What stands for ``drawing.draw``: an SVG element of the right size with nothing in it."""
    return Svg(f'<svg viewBox="0 0 {width_mm:g} {height_mm:g}" aria-hidden="true"></svg>')


@contextmanager
def blank_figures() -> Iterator[None]:
    """Leave the figures of reports blank: on paper, too, where ``sketching`` will not do."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_blank(monkeypatch)
        yield


def leave_blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures of reports blank until the test ends."""
    monkeypatch.setattr(drawing, "draw", blank)
