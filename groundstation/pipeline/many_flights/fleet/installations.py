"""Installations that the flights of an OUT teach, from stored figures alone.

They are kept in installations.json.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from groundstation.base.serial import from_json
from groundstation.pipeline.many_flights.fleet.rows import lesson_of
from groundstation.pipeline.many_flights.fleet.scan import Scan
from groundstation.pipeline.many_flights.fleet.table import lessons_of
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.sealing import note
from groundstation.reports.flight_report import REPORT
from groundstation.reports.installation import with_installation
from groundstation.results.files import load, write_text
from groundstation.results.installations import (
    INSTALLATIONS,
    METHOD_VERSION,
    Installations,
    LearnedHeading,
    LeftOut,
    Lesson,
    installations_in,
    installations_text,
)
from groundstation.systems import systems
from groundstation.systems.learning import LearnStep


def refresh_installations(out: Path, found: Scan, remade: Iterable[str]) -> list[str]:
    """Bring installations.json, and the reports that show it, up to date with the flights.

    The same flights give the same file, whatever was there before: an installation whose flights are as they were is
    taken over, of another the answers are made again. Without a flight that states a serial there is no file. It is
    written last: a run that is killed shows the answers again.

    Parameters
    ----------
    out : Path
    found : Scan
        The flights as they stand.
    remade : iterable of str
        Flights whose report was written since.

    Returns
    -------
    list of str
        Flights whose report changed; none where no system learns.

    Raises
    ------
    OSError
        When a file cannot be written.
    DamagedMonthError
        When a file of the dataset of flights cannot be read.
    """
    path, learn = out / INSTALLATIONS, systems().learn
    if learn is None:
        return []
    before = installations_in(out)
    after = _from_flights(out, found, before, learn)
    text = "" if after is None else installations_text(after)
    rounded = None if after is None else from_json(Installations, json.loads(text))  # taken over or made: the same
    old, new = answers_in(before), answers_in(rounded)
    changed = {name for name in {*old, *new} if old.get(name) != new.get(name)} | {*remade}.intersection(new)
    shown = _show_answers(out, new, sorted(changed), learn)
    if after is None:
        path.unlink(missing_ok=True)
    elif _text(path) != text:
        write_text(path, text)
    return shown


def _from_flights(out: Path, found: Scan, before: Installations | None, learn: LearnStep) -> Installations | None:
    """All installations; None where no flight states a serial."""
    lessons = sorted(_lessons(out, found), key=lambda one: one.flight_id)
    if not lessons:
        return None
    is_usable = before is not None and before.method_version == METHOD_VERSION
    installations = learn.installations(lessons, before.installations if before is not None and is_usable else ())
    listed = {lesson.flight_id for one in installations for lesson in one.lessons}
    left_out = (LeftOut(one.flight_id, one.not_taught) for one in lessons if one.flight_id not in listed)
    return Installations(
        without_serial=len(found) - len(lessons), left_out=tuple(left_out), installations=installations
    )


def _lessons(out: Path, found: Scan) -> Iterator[Lesson]:
    """Lessons of the flights in the dataset, then of those that it has not.

    Some flights are missing there when a file of the dataset could not be written.
    """
    for part in found.months_of(["lesson"]):
        yield from lessons_of(part)
    for name in found.stale:
        try:
            lesson = lesson_of(load(out / name, systems().answer_types))
        except Exception:  # it is told of where the index is written
            continue
        if lesson is not None:
            yield lesson


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""


def answers_in(found: Installations | None) -> dict[str, LearnedHeading]:
    """The learned answers by flight id."""
    flights = (flight for one in found.installations for flight in one.flights) if found is not None else ()
    return {flight.lesson.flight_id: flight.answer for flight in flights if flight.answer is not None}


def _show_answers(
    out: Path, answers: Mapping[str, LearnedHeading], names: Iterable[str], learn: LearnStep
) -> list[str]:
    """Fill learned answers into the reports of some flights.

    Returns the flights whose report changed.
    """
    changed = []
    for name in names:
        page = out / name / REPORT
        before, answer = _text(page), answers.get(name)
        after = with_installation(before, answer, learn) if before else before
        if after != before:
            write_text(page, after, is_synced=False)  # note syncs it
            note(out / name, [page])
            changed.append(name)
    return changed


def show_installation(folder: Path) -> None:
    """Fill what was learned into the report of one flight folder, from the file beside it."""
    learn = systems().learn
    if learn is not None:
        _show_answers(folder.parent, answers_in(installations_in(folder.parent)), [folder.name], learn)


def told(outcomes: Iterable[Outcome], out: Path) -> tuple[Outcome, ...]:
    """Outcomes of flights with what was learned behind their answers."""
    learn = systems().learn
    if learn is None:
        return tuple(outcomes)
    answers = answers_in(installations_in(out))
    return tuple(
        replace(one, text=f"{one.text}; {learn.line(answers[one.flight_id])}") if one.flight_id in answers else one
        for one in outcomes
    )
