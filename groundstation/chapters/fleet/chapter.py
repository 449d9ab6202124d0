"""A chapter of the fleet report with its place among those of all systems."""

from collections.abc import Callable
from typing import NamedTuple

from groundstation.chapters.parts import Section
from groundstation.results.fleet import FleetResults

KeyFigure = tuple[str, str, str]  # title, value, remark


def no_figures(_fleet: FleetResults) -> tuple[KeyFigure, ...]:
    """Return nothing."""
    return ()


def always(_fleet: FleetResults) -> bool:
    """Return True."""
    return True


class FleetChapter(NamedTuple):
    """Chapter of the fleet report.

    Parameters
    ----------
    key : str
        Its name where it fails.
    place : int
        Chapters stand in the order of their places; those of all flights have 0 and 900 to 999.
    build : callable
        ``build(fleet)`` returns None where there is nothing to say.
    panel : str
        Text panel of the recording that shows it: ``aircraft``, ``flights``; empty for none.
    is_in_panel : callable
        Tells whether the panel shows it for this fleet.
    figures : callable
        Key figures on top of the report: title, value, remark.
    """

    key: str
    place: int
    build: Callable[[FleetResults], Section | None]
    panel: str = ""
    is_in_panel: Callable[[FleetResults], bool] = always
    figures: Callable[[FleetResults], tuple[KeyFigure, ...]] = no_figures
