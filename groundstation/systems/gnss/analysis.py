"""The GNSS reception as an analysis: of every log with rows of a receiver."""

from typing import TYPE_CHECKING

from groundstation.results.answer import Answers, answer_of
from groundstation.results.columns import AnswerColumn
from groundstation.results.roles import Delays
from groundstation.systems.analysis import Analysis, Found, Shortfall
from groundstation.systems.gnss.answer import GnssReception
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.systems.known import Known

if TYPE_CHECKING:
    from groundstation.tables.table import Flight


def _run(flight: "Flight", known: Known, settings: GnssSettings) -> Found[GnssReception]:
    from groundstation.systems.gnss.estimate import reception_of

    found = reception_of(flight, known.phases, known.answer_meeting(Delays), settings=settings)
    return Found(found.answer, found.findings)


def _examine(flight: "Flight", known: Known, settings: GnssSettings) -> tuple[Shortfall, ...]:
    from groundstation.systems.gnss.examine import shortfalls_of

    return shortfalls_of(flight, known.phases, settings)


def _has_rows(flight: "Flight", _known: Known) -> bool:
    from groundstation.systems.gnss.estimate import topics_of

    return bool(topics_of(flight))


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, GnssReception)
    return "" if answer is None else answer.line


def _share(*states: str) -> "AnswerColumn[GnssReception]":
    name = "_".join(states)
    text = f"share of the recorded time after the first fix with {name.replace('_', ' ')}"
    return AnswerColumn(
        f"gnss_{name}_share", "number", text, lambda answer: answer.receiver.share_after_first_fix(*states)
    )


GNSS = Analysis(
    name="gnss",
    title="GNSS reception: states of the fix, satellites, claimed accuracy against scatter, losses, jumps",
    subject="GNSS reception",
    page_title="GNSS reception",
    needs="rows of a GNSS receiver",
    settings=GnssSettings,
    answer=GnssReception,
    run=_run,
    builds_on=("latency",),
    applies=_has_rows,
    sentence=_sentence,
    examine=_examine,
    columns=(
        AnswerColumn("gnss_grade", "category", "grade of the GNSS reception", lambda answer: answer.grade),
        AnswerColumn(
            "gnss_fix_share", "number", "share of the time with a fix", lambda answer: answer.receiver.fix_share
        ),
        _share("rtk_fixed"),
        _share("rtk_float"),
        AnswerColumn("gnss_losses", "count", "losses of the fix, and gaps", lambda answer: len(answer.receiver.losses)),
        AnswerColumn("gnss_jumps", "count", "jumps of the position", lambda answer: answer.receiver.jumps_found),
        AnswerColumn(
            "gnss_satellites",
            "number",
            "satellites in the solution, median",
            lambda answer: answer.receiver.satellites_used,
        ),
        AnswerColumn("gnss_hdop", "number", "HDOP, median", lambda answer: answer.receiver.hdop),
        AnswerColumn("gnss_cn0_dbhz", "number", "C/N0, median", lambda answer: answer.receiver.cn0_dbhz),
        AnswerColumn(
            "gnss_scatter_m",
            "number",
            "scatter of the position at standstill",
            lambda answer: answer.receiver.standstill and answer.receiver.standstill.scatter_m,
        ),
        AnswerColumn(
            "gnss_claimed_m",
            "number",
            "sigma of the horizontal position claimed, median",
            lambda answer: answer.receiver.horizontal_sigma_m,
        ),
    ),
)
