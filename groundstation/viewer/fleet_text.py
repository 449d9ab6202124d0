"""Text panels of the recording of a fleet: the chapters of its page, with links.

Links lead to recordings and entities.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from groundstation.base.failures import attempt
from groundstation.chapters.fleet import flights, rest
from groundstation.chapters.fleet.common import aircraft_name
from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Grid, Note, Section, shortened
from groundstation.chapters.wording import plural
from groundstation.results.fleet import FleetResults
from groundstation.systems.system import Systems
from groundstation.viewer.fleet_recorder import FleetRecorder

MOST_ROWS = 500  # of a table: the viewer lays out the whole text again and again
WIDEST_CELL = 90  # a panel of its own has room for more than one beside charts
EVERY_ONE = "flights.parquet"
SAFE_PATH = re.compile(r"[A-Za-z0-9_-]+(/[A-Za-z0-9_-]+)*\.rrd")  # what needs no quoting in a link
LINKS = (
    "The name of a flight is a link to its recording; it opens in a viewer that was started in the folder of "
    "fleet.rrd (groundstation view does that), or that is connected to groundstation serve."
)


def aircraft_text(fleet: FleetResults, entities: Mapping[str, str], systems: Systems) -> str:
    """Return what is told by aircraft, each a link to its entity.

    Empty where there is no table.
    """
    names = {aircraft_name(name): f"recording://{entity}" for name, entity in entities.items() if name}
    links = {name: link for name, link in names.items() if link.isascii()}
    sections = list(_of_panel("aircraft", fleet, systems))
    if not any(isinstance(part, Grid) for section in sections for part in section.parts):
        return ""
    return "\n\n".join(text_of(section, links) for section in sections)


def _of_panel(panel: str, fleet: FleetResults, systems: Systems) -> Iterator[Section]:
    """Chapters of a text panel."""
    for chapter in systems.fleet_chapters:
        if chapter.panel == panel and chapter.is_in_panel(fleet):
            section = attempt("chapter", chapter.key, chapter.build, fleet)
            if section is not None:
                yield section


def flights_text(recorder: FleetRecorder, fleet: FleetResults) -> str:
    """Return the table of the flights in order, then what stands below it: the sessions.

    Each name is a link to its recording.
    """
    rows = recorder.order[-MOST_ROWS:]
    numbers = recorder.numbers(fleet.flights["flight_id"].astype(np.str_)[rows])
    told = flights.by_number(fleet, rows, numbers)
    ids, recordings = (fleet.flights[name][rows].tolist() for name in ("flight_id", "recording"))
    links = _recordings(zip(ids, recordings, strict=True))
    parts = [text_of(replace(told, above=(*_notes(recorder, fleet), *told.above)), links)]
    of_sessions = _recordings((one.session_id, one.recording) for one in fleet.sessions)
    parts += [text_of(section, of_sessions) for section in _of_panel("flights", fleet, recorder.systems)]
    return "\n\n".join(parts)


def failed_text(fleet: FleetResults) -> str:
    """Return the table of the logs that gave no flight, and why."""
    return text_of(rest.not_in_fleet(fleet), where="index.csv")


def text_of(section: Section, links: Mapping[str, str] | None = None, where: str = EVERY_ONE) -> str:
    """Return a chapter as a text panel; cells that are in ``links`` become links."""
    return markdown(shortened(section, MOST_ROWS, where), widest=WIDEST_CELL, links=links or {})


def _recordings(named: Iterable[tuple[str, str]]) -> dict[str, str]:
    return {name: recording for name, recording in named if SAFE_PATH.fullmatch(recording)}


def _notes(recorder: FleetRecorder, fleet: FleetResults) -> Iterator[Note]:
    yield Note(LINKS)
    untimed = len(fleet) - recorder.timed
    if untimed:
        told = plural(untimed, "flight has", "flights have")
        yield Note(f"{told} no absolute time: not on the timeline utc, only on flight_number.")
