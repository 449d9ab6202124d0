"""Saved flights as the package reads them, with every analysis's answers."""

from pathlib import Path

from groundstation.reports.flight_report import Written
from groundstation.reports.flight_report import write_flight_report as write
from groundstation.results import files
from groundstation.systems import systems


def load(folder: Path) -> files.SavedFlight:
    """A flight folder, every answer in it as its type."""
    return files.load(folder, systems().answer_types)


def write_flight_report(folder: Path, *, with_pdf: bool = False) -> Written:
    """The report of a flight folder."""
    return write(folder, systems(), with_pdf=with_pdf)
