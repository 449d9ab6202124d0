"""INS heading aligned by taxi (system 1), and how sure it still is when the figure is flown."""

import math

from groundstation.estimators.magnetic.settings import MagneticSettings
from groundstation.results.heading import HeadingResult
from groundstation.results.magnetic import Alignment

S_PER_H = 3600.0


def align(heading: HeadingResult | None, ins_topic: str, figure_at_s: float, settings: MagneticSettings) -> Alignment:
    """INS heading error carried from taxi to the figure.

    error(figure) = error + drift x hours; variance = that of the error + (sigma of drift x hours)^2. The drift that
    taxi shows is weighed against 0 +- ``drift_sigma_deg_per_h``: minutes of taxi hardly show any. Without a result for
    this INS, or where it is rejected, nothing is corrected and ``alignment_sigma_deg`` stands.
    """
    why_not = _why_not(heading, ins_topic)
    prior = settings.drift_sigma_deg_per_h
    if heading is None or why_not:
        return Alignment(
            f"not aligned: {why_not}", 0.0, settings.alignment_sigma_deg, 0.0, settings.alignment_sigma_deg, 0.0, prior,
            None, figure_at_s,
        )  # fmt: skip
    aligned_at_s = heading.reference_time_s or 0.0
    drift, sigma = _drift(heading, prior)
    hours = (figure_at_s - aligned_at_s) / S_PER_H
    return Alignment(
        f"straight taxi, {heading.samples} epochs, verdict {heading.verdict}",
        heading.error_deg + drift * hours,
        math.hypot(heading.standard_error_deg, sigma * hours),
        heading.error_deg,
        heading.standard_error_deg,
        drift,
        sigma,
        aligned_at_s,
        figure_at_s,
    )


def _why_not(heading: HeadingResult | None, ins_topic: str) -> str:
    if heading is None:
        return "no heading error from taxi"
    if heading.ins_topic != ins_topic:
        return f"the heading error from taxi is that of {heading.ins_topic}"
    if heading.verdict == "reject":
        return f"the heading error from taxi is rejected ({heading.verdict_reason})"
    if not (math.isfinite(heading.error_deg) and math.isfinite(heading.standard_error_deg)):
        return "the heading error from taxi is not a number"
    return ""


def _drift(heading: HeadingResult, prior_sigma: float) -> tuple[float, float]:
    """Drift and its sigma, deg/h: measured and known beforehand, weighed by their variances."""
    measured, sigma = heading.drift_deg_per_h, heading.drift_sigma_deg_per_h
    if measured is None or sigma is None or not math.isfinite(measured) or not sigma > 0.0 or not prior_sigma > 0.0:
        return 0.0, prior_sigma
    weight = prior_sigma**2 / (prior_sigma**2 + sigma**2)
    return weight * measured, math.sqrt(weight) * sigma
