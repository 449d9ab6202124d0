"""What the comparison with a reference gives to the tables of flights."""

from groundstation.results.columns import AnswerColumn
from groundstation.results.reference import ReferenceResult


def _rmse(answer: ReferenceResult, subject: str, quantity: str, axis: str) -> float | None:
    """RMS of an axis; None where it was not compared, or the reference judges nothing."""
    row = answer.error(subject, quantity, axis) if answer.is_judge else None
    return None if row is None else row.spread.rmse


def _share(answer: ReferenceResult, subject: str) -> float | None:
    """Share of the horizontal position errors inside the 95 % claimed."""
    row = answer.claim(subject, "position", "horizontal") if answer.is_judge else None
    return None if row is None or row.state == "reference_too_coarse" else row.share_inside95


REFERENCE_COLUMNS: tuple[AnswerColumn[ReferenceResult], ...] = (
    AnswerColumn("reference", "text", "what the flight was judged by", is_indexed=False),
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
