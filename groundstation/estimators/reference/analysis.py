"""Analysis against the reference; it alone may see the truth, after all others have run."""

from typing import TYPE_CHECKING

from groundstation.base.signals import topics_of_kind
from groundstation.estimators.analysis import Analysis, Found
from groundstation.estimators.known import Known
from groundstation.estimators.reference.columns import REFERENCE_COLUMNS
from groundstation.estimators.reference.settings import ReferenceSettings
from groundstation.results.answer import Answers, answer_of
from groundstation.results.reference import ReferenceResult, title_of

if TYPE_CHECKING:
    from groundstation.tables.table import Flight


def _run(flight: "Flight", known: Known, settings: ReferenceSettings) -> Found[ReferenceResult]:
    from groundstation.estimators.reference.judge import judged

    return judged(flight, known, settings)


def _is_expected(flight: "Flight", _known: Known) -> bool:
    return bool(topics_of_kind("truth", flight.topics()))


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, ReferenceResult)
    if answer is None:
        return ""
    if not answer.is_judge:
        return f"the reference judges nothing: {answer.reason}"
    best = [row for row in answer.errors if (row.quantity, row.axis) == ("position", "horizontal")]
    told = [f"{title_of(row.subject)} {row.spread.rmse:.2f} m" for row in best]
    headings = [row for row in answer.errors if row.axis == "heading"]
    told += [f"{title_of(row.subject)} heading {row.spread.rmse:.2f} deg" for row in headings[:1]]
    return f"against the reference (RMS): {', '.join(told)}" if told else ""


REFERENCE = Analysis(
    name="reference",
    title="errors of GNSS, INS and the answers against a reference, and claimed against measured accuracy",
    subject="comparison with the reference",
    needs="a truth in the log, or a reference by --reference FILE",
    settings=ReferenceSettings,
    answer=ReferenceResult,
    run=_run,
    builds_on=("heading", "inertial", "forecast"),
    is_expected=_is_expected,
    sentence=_sentence,
    columns=REFERENCE_COLUMNS,
    judges=True,
)
