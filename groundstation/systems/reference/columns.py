"""Columns that the comparison with a reference gives to the tables of flights."""

from groundstation.base.signals import kind_of
from groundstation.results.columns import AnswerColumn
from groundstation.systems.reference.answer import ReferenceResult


def _rmse(answer: ReferenceResult, kind: str, quantity: str, axis: str) -> float | None:
    """Return the RMS error along an axis of the first subject of a kind.

    None where it was not compared, or the reference judges nothing.
    """
    row = answer.error(_first(answer, kind, quantity, axis), quantity, axis) if answer.is_judge else None
    return None if row is None else row.spread.rmse


def _share(answer: ReferenceResult, kind: str) -> float | None:
    """Share of the horizontal position errors of the first of a kind inside the 95 % claimed."""
    place = ("position", "horizontal")
    row = answer.claim(_first(answer, kind, *place), *place) if answer.is_judge else None
    return None if row is None or row.state == "reference_too_coarse" else row.share_inside95


def _first(answer: ReferenceResult, kind: str, quantity: str, axis: str) -> str:
    """Return the first subject of a kind that was compared along an axis.

    It is ``gnss``, or ``gnss.b`` of another log.
    """
    compared = (row.subject for row in answer.errors if (row.quantity, row.axis) == (quantity, axis))
    return next((subject for subject in compared if kind_of(subject) == kind), kind)


REFERENCE_COLUMNS: tuple[AnswerColumn[ReferenceResult], ...] = (
    AnswerColumn("reference", "text", "reference that judged the flight", is_indexed=False),
    AnswerColumn(
        "gnss_reference_rmse_m",
        "number",
        "GNSS against the reference, horizontal",
        lambda answer: _rmse(answer, "gnss", "position", "horizontal"),
    ),
    AnswerColumn(
        "ins_reference_rmse_m",
        "number",
        "INS against the reference, horizontal",
        lambda answer: _rmse(answer, "ins", "position", "horizontal"),
    ),
    AnswerColumn(
        "corrected_reference_rmse_m",
        "number",
        "INS less its estimated errors against the reference, horizontal",
        lambda answer: _rmse(answer, "corrected", "position", "horizontal"),
    ),
    AnswerColumn(
        "trajectory_reference_rmse_m",
        "number",
        "best trajectory against the reference, horizontal",
        lambda answer: _rmse(answer, "trajectory", "position", "horizontal"),
    ),
    AnswerColumn(
        "trajectory_heading_reference_rmse_deg",
        "number",
        "its heading against the reference, mounting in it",
        lambda answer: _rmse(answer, "trajectory", "attitude", "heading"),
    ),
    AnswerColumn(
        "heading_reference_rmse_deg",
        "number",
        "INS heading against the reference",
        lambda answer: _rmse(answer, "ins", "attitude", "heading"),
    ),
    AnswerColumn(
        "gnss_inside95_share",
        "number",
        "share of GNSS positions inside the 95 % that receiver and reference claim",
        lambda answer: _share(answer, "gnss"),
        is_indexed=False,
    ),
    AnswerColumn(
        "corrected_inside95_share",
        "number",
        "the same of the INS less its estimated errors",
        lambda answer: _share(answer, "corrected"),
        is_indexed=False,
    ),
)
