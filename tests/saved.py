"""Saved flights as the package reads them, with every analysis's answers."""

from pathlib import Path

from groundstation.estimators.analyses import ANSWER_TYPES
from groundstation.reports.flight_report import Written
from groundstation.reports.flight_report import write_flight_report as write
from groundstation.results import files


def load(folder: Path) -> files.SavedFlight:
    """A flight folder, every answer in it as its type."""
    return files.load(folder, ANSWER_TYPES)


def write_flight_report(folder: Path, *, with_pdf: bool = False) -> Written:
    """The report of a flight folder."""
    return write(folder, ANSWER_TYPES, with_pdf=with_pdf)
