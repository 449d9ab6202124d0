"""Learned installation as an analysis: the heading error of one log by earlier flights.

A file tells what those say.
"""

from typing import TYPE_CHECKING

from groundstation.base.findings import Finding
from groundstation.base.serial import from_json, to_json
from groundstation.base.words import counted
from groundstation.results.answer import Answers, answer_of
from groundstation.results.installations import LearnedHeading
from groundstation.systems.analysis import Analysis, Found
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.installation.answer import InstallationResult
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import Known

if TYPE_CHECKING:
    from groundstation.tables.table import Flight


def _run(flight: "Flight", known: Known, _settings: HeadingSettings) -> Found[InstallationResult]:
    from groundstation.systems.heading.installation.lesson import Stored, lesson_of
    from groundstation.systems.heading.installation.series import answer_from
    from groundstation.systems.heading.installation.settings import InstallationSettings

    heading = known.answer(HeadingResult)
    assert heading is not None and known.lessons is not None
    aircraft = known.aircraft
    lesson = lesson_of(
        Stored(
            flight_id="",
            metadata=flight.metadata,
            start_utc_ns=flight.start_ns if flight.has_utc else None,
            stated={"ins_serial": aircraft.ins_serial, "ins_alignment": aircraft.ins_alignment},
            heading=from_json(HeadingResult, to_json(heading)),  # as a run stores it
        )
    )
    found = answer_from(lesson, known.lessons, InstallationSettings())
    return Found(found, (_finding(found),))


def _finding(found: InstallationResult) -> Finding:
    if found.why_not:
        return Finding("warn", "installation.not_learned", f"nothing learned of the installation: {found.why_not}")
    return Finding("info", f"installation.{found.verdict}", sentence_of(found))


def sentence_of(found: LearnedHeading) -> str:
    """A learned answer in a line."""
    if found.why_not:
        return f"nothing learned of the installation: {found.why_not}"
    half = found.half_width_deg * 60.0
    text = f"installation of {found.ins_serial} from {counted(found.flights, 'flight')}: {found.verdict}"
    text += f", heading error {found.error_deg:+.3f} deg +-{half:.0f} arcmin"
    return text if found.correction_deg is None else f"{text}, enter {found.correction_deg:+g} deg"


def _has_lessons(_flight: "Flight", known: Known) -> bool:
    return known.lessons is not None


def _sentence(answers: Answers) -> str:
    found = answer_of(answers, InstallationResult)
    return "" if found is None else sentence_of(found)


INSTALLATION = Analysis(
    name="installation",
    title="heading error with the mounting and the crosswind factor that earlier flights taught",
    subject="learned installation",
    page_title="Installation",
    needs="a heading error, aircraft, INS serial and UTC, and a file of earlier flights (--installation)",
    settings=HeadingSettings,
    answer=InstallationResult,
    run=_run,
    table="heading",
    builds_on=("heading",),
    requires=("heading",),
    applies=_has_lessons,
    sentence=_sentence,
)
