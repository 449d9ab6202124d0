"""Chapters, pages and recordings with the systems that ship, for tests that do not choose them."""

from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from groundstation.chapters import by_answer
from groundstation.chapters.front import front as top
from groundstation.chapters.next_steps import next_steps as steps
from groundstation.chapters.parts import Document, Front, Section
from groundstation.chapters.plots.comparison import COMPARED as OF_ALL
from groundstation.reports import comparison as comparing
from groundstation.reports import flight_report, sections
from groundstation.results.answer import Answer
from groundstation.results.comparison import Comparison
from groundstation.results.files import SavedFlight
from groundstation.results.fleet import FleetResults
from groundstation.results.flight import FlightResults
from groundstation.systems import systems
from groundstation.systems.system import Systems
from groundstation.tables.table import Flight
from groundstation.viewer import comparison as recorded
from groundstation.viewer import fleet as viewer_fleet
from groundstation.viewer import recording
from groundstation.viewer.recorder import Recorder

PLOTS = systems().plots
COMPARED = {**OF_ALL, **{name: tell for one in systems().compared for name, tell in one.figures.items()}}


def front(results: FlightResults) -> Front:
    """Return the top of a report."""
    return top(results, systems().chapters)


def next_steps(results: FlightResults) -> Section | None:
    """Return the chapter on what to do next."""
    return steps(results, systems().chapters)


def answer_chapters(results: FlightResults) -> tuple[Section, ...]:
    """Return the chapters of a flight that have an answer."""
    return by_answer.answer_chapters(results, systems().chapters)


def chapters_of(results: FlightResults) -> tuple[Section, ...]:
    """Return the chapters on all answers."""
    return by_answer.chapters_of(results, systems().chapters)


def chapter_of(results: FlightResults, answer: Answer) -> Section:
    """Return the chapter that tells an answer."""
    return by_answer.chapter_of(results, answer, systems().chapters)


def without_chapter(results: FlightResults) -> tuple[Answer, ...]:
    """Return the answers without a chapter of their own."""
    return by_answer.without_chapter(results, systems().chapters)


def flight_document(saved: SavedFlight) -> Document:
    """Return the report of a saved flight."""
    return flight_report.flight_document(saved, systems())


def flight_sections(saved: SavedFlight) -> tuple[Section, ...]:
    """Return the chapters of the report of a saved flight."""
    return sections.flight_sections(saved, systems())


def comparison_html(comparison: Comparison, a: SavedFlight, b: SavedFlight) -> str:
    """Return the page of a comparison."""
    return comparing.comparison_html(comparison, a, b, systems())


def write_comparison(path: Path, comparison: Comparison, a: SavedFlight, b: SavedFlight) -> None:
    """Write the recording of a comparison."""
    recorded.write_comparison(path, comparison, a, b, systems())


def recorder_of(stream: rr.RecordingStream, start_ns: int, has_utc: bool) -> Recorder:
    """Return a recorder into a stream."""
    return Recorder(stream, start_ns, has_utc, systems())


def write_recording(path: Path, flight: Flight, results: FlightResults) -> None:
    """Write the recording of a flight."""
    recording.write_recording(path, flight, results, systems())


def write_fleet_recording(path: Path, fleet: FleetResults) -> None:
    """Write the recording of a fleet."""
    viewer_fleet.write_fleet_recording(path, fleet, systems())


def stream_recording(flight: Flight, results: FlightResults, *, connect_url: str) -> None:
    """Send the recording of a flight to a viewer."""
    recording.stream_recording(flight, results, systems(), connect_url=connect_url)


def send_flight(stream: rr.RecordingStream, flight: Flight, results: FlightResults) -> rrb.Blueprint:
    """Send a flight to a stream."""
    return recording.send_flight(stream, flight, results, systems())


def shipped_but(**parts: Any) -> Systems:
    """Return the shipped systems with what they list replaced: analyses, tabs, ... as tuples."""
    found = Systems(systems().every)
    found.__dict__.update(parts)
    return found


def missing_in(text: str, *wanted: str) -> list[str]:
    """What a sentence lacks of the numbers, names and verdicts it has to tell; its other words are free."""
    return [one for one in wanted if one not in text]
