"""Installations learned from the flights of a folder, as the step that the pipeline takes."""

from collections.abc import Iterable, Sequence

from groundstation.results.files import SavedFlight, mapping
from groundstation.results.installations import Installation, Lesson
from groundstation.systems.heading.installation.analysis import sentence_of
from groundstation.systems.heading.installation.chapter import parts, sentence
from groundstation.systems.heading.installation.lesson import lesson_of_flight
from groundstation.systems.heading.installation.series import UnitFlights, installation_of, series_of
from groundstation.systems.heading.installation.settings import InstallationSettings
from groundstation.systems.learning import LearnStep


def lesson_of_saved(saved: SavedFlight) -> Lesson | None:
    """Lesson of a flight on its installation; None where the INS has no serial number."""
    lesson = lesson_of_flight(saved.results, mapping(saved.manifest.configuration, "aircraft"), saved.folder.name)
    return lesson if lesson.ins_serial else None


def installations_of(lessons: Iterable[Lesson], known: Sequence[Installation]) -> tuple[Installation, ...]:
    """Every installation of the flights.

    One of ``known`` that has the same lessons is taken over.
    """
    before, settings = {_key(one): one for one in known}, InstallationSettings()
    return tuple(before.get(_key(one)) or installation_of(one, settings) for one in series_of(lessons))


def _key(one: UnitFlights | Installation) -> tuple[str, str, tuple[Lesson, ...]]:
    return one.ins_serial, one.aircraft, one.lessons


STEP = LearnStep(lesson_of_saved, installations_of, sentence_of, sentence, parts)
