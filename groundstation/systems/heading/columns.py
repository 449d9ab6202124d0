"""Columns that the heading correction gives to the tables of flights."""

from collections.abc import Callable

from groundstation.results.columns import AnswerColumn
from groundstation.systems.heading.answer import HeadingResult, OnboardComparison, Standstill


def _onboard(value: Callable[[OnboardComparison], float | None]) -> Callable[[HeadingResult], float | None]:
    return lambda heading: None if heading.onboard is None else value(heading.onboard)


def _standstill(value: Callable[[Standstill], float | None]) -> Callable[[HeadingResult], float | None]:
    return lambda heading: None if heading.standstill is None else value(heading.standstill)


def _of_the_samples(_heading: HeadingResult) -> None:
    """Return None: the fleet fills it from the samples, which the answer does not hold."""


COLUMNS: tuple[AnswerColumn[HeadingResult], ...] = (
    AnswerColumn("verdict", "category", "of the heading correction: accept, advisory, reject, extend, undecided"),
    AnswerColumn("verdict_reason", "text", "why, in words"),
    AnswerColumn("error_deg", "number", "heading error, INS - true, used for the correction"),
    AnswerColumn("standard_error_deg", "number", "of error_deg, with errors correlated over seconds"),
    AnswerColumn(
        "confidence95_low_deg",
        "number",
        "lower end of the 95 % interval of error_deg",
        lambda heading: heading.confidence95_deg[0],
    ),
    AnswerColumn("confidence95_high_deg", "number", "its upper end", lambda heading: heading.confidence95_deg[1]),
    AnswerColumn("steady_sigma_deg", "number", "steady sideslip left in error_deg, sigma", is_indexed=False),
    AnswerColumn("platform_error_deg", "number", "heading error less the mounting of the INS", is_indexed=False),
    AnswerColumn("platform_standard_error_deg", "number", "its sigma, that of the mounting included", is_indexed=False),
    AnswerColumn("sideslip_deg", "number", "mean sideslip taken off, by the wind known", is_indexed=False),
    AnswerColumn("correction_deg", "number", "the number to enter; missing unless accepted"),
    AnswerColumn("paper_error_deg", "number", "plain running mean of the paper", is_indexed=False),
    AnswerColumn("precision_deg", "number", "the paper's e"),
    AnswerColumn("quality_deg", "number", "spread of the running mean"),
    AnswerColumn("estimate_sd_deg", "number", "standard deviation of the differences"),
    AnswerColumn("samples", "count", "distinct GNSS epochs used"),
    AnswerColumn(
        "sample_mean_deg",
        "number",
        "mean of the used differences INS heading - track",
        _of_the_samples,
        is_indexed=False,
    ),
    AnswerColumn(
        "sample_m2_deg2",
        "number",
        "sum of squares of the used differences about their mean",
        _of_the_samples,
        is_indexed=False,
    ),
    AnswerColumn("taxi_seconds", "number", "straight taxi used"),
    AnswerColumn("drift_deg_per_h", "number", "azimuth drift during taxi"),
    AnswerColumn("drift_sigma_deg_per_h", "number", "its sigma", is_indexed=False),
    AnswerColumn(
        "standstill_speed_of_mean_mps",
        "number",
        "length of the mean GNSS velocity at standstill",
        _standstill(lambda standstill: standstill.speed_of_mean_mps),
        is_indexed=False,
    ),
    AnswerColumn("lever_arm_m", "number", "GNSS antenna ahead of the main gear", is_indexed=False),
    AnswerColumn("time_offset_s", "number", "age of the GNSS velocity against the INS heading", is_indexed=False),
    AnswerColumn("parking_heading_deg", "number", "INS heading at the stand, corrected"),
    AnswerColumn("parking_sigma_deg", "number", "its sigma", is_indexed=False),
    AnswerColumn("reference_residual_arcmin", "number", "corrected parking heading - reference"),
    AnswerColumn(
        "onboard_error_deg",
        "number",
        "heading error the aircraft found itself",
        _onboard(lambda onboard: onboard.heading_error_deg),
    ),
    AnswerColumn(
        "onboard_difference_deg", "number", "onboard - ours", _onboard(lambda onboard: onboard.difference_error_deg)
    ),
)
