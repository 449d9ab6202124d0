"""INS heading aligned by the GNSS track before lift-off, and how sure it still is when the figure is flown."""

import math

from groundstation.estimators.heading.verdict import CURED_BY_MORE_DATA, STANDSTILL_GATE
from groundstation.estimators.magnetic.before_lift_off import GroundRuns
from groundstation.estimators.magnetic.gyros import GyroDrift
from groundstation.estimators.magnetic.settings import MagneticSettings
from groundstation.results.heading import HeadingResult
from groundstation.results.magnetic import Alignment

S_PER_H = 3600.0
# What these gates find ends up in the honest sigma: too few or too noisy data, a GNSS velocity that errs at standstill.
CARRIED_BY_SIGMA = CURED_BY_MORE_DATA | {STANDSTILL_GATE}
NORMALITY = frozenset({"skewness", "kurtosis", "normal_distance"})  # of a few swings of the airframe they say nothing
BELIEVED_SIGMAS = 3.0  # of gyro drift and prior together: further off the rates are not those the INS navigates with


def align(
    heading: HeadingResult | None,
    ins_topic: str,
    figure_at_s: float,
    settings: MagneticSettings,
    runs: GroundRuns | None = None,
    gyros: GyroDrift | None = None,
) -> Alignment:
    """INS heading error carried from the ground to the figure.

    Taxi and take-off run together come first, then system 1's own answer ``heading`` from taxi alone.

    error(figure) = error + drift x hours; variance = that of the error + (sigma of drift x hours)^2. The drift that the
    runs show is weighed against 0 +- ``drift_sigma_deg_per_h``: minutes on the ground hardly show any. That of the
    gyros counts where its sigma is smaller than this one. Without a result for this INS, or where it is rejected,
    nothing is corrected and ``alignment_sigma_deg`` stands.
    """
    runs = runs or GroundRuns(taxi=heading)
    why_not, why_not_taxi = _why_not(runs.together, ins_topic), _why_not(runs.taxi, ins_topic)
    speed_mps, prior = runs.speed_min_mps, settings.drift_sigma_deg_per_h
    shown = (gyros.drift_deg_per_h, gyros.sigma_deg_per_h) if gyros else (None, None)
    if runs.together is not None and not why_not:
        used, slow = runs.together, runs.together.samples - runs.fast_epochs
        where = f"straight taxi ({slow} epochs) and " if slow else ""
        where += f"ground run above {speed_mps:.1f} m/s up to lift-off ({runs.fast_epochs} epochs)"
    elif runs.taxi is not None and not why_not_taxi:
        used, where = runs.taxi, f"straight taxi ({runs.taxi.samples} epochs)"
    else:
        origin, sigma = f"not aligned: {runs.why_not_taxi or why_not_taxi}", settings.alignment_sigma_deg
        return Alignment(origin, 0.0, sigma, 0.0, sigma, 0.0, prior, None, figure_at_s, speed_mps, *shown)
    aligned_at_s = used.reference_time_s or 0.0
    drift, drift_sigma = _drift(used, gyros, prior)
    hours = (figure_at_s - aligned_at_s) / S_PER_H
    sigma = _sigma(used)
    origin = f"{where}, verdict {used.verdict}" + (
        " for noise that the sigma includes" if used.verdict == "reject" else ""
    )
    if used is runs.together and runs.since:
        origin += f", after {runs.since}"
    if used is runs.taxi and (runs.why_not or runs.together):
        origin += f"; no faster run: {runs.why_not or why_not}"
    return Alignment(
        origin,
        used.azimuth[0] + drift * hours,
        math.hypot(sigma, drift_sigma * hours),
        used.azimuth[0],
        sigma,
        drift,
        drift_sigma,
        aligned_at_s,
        figure_at_s,
        speed_mps,
        *shown,
    )


def _why_not(heading: HeadingResult | None, ins_topic: str) -> str:
    """Why an answer of system 1 does not align; gates that its sigma carries anyhow do not refuse it."""
    if heading is None:
        return "no heading error from taxi"
    if heading.ins_topic != ins_topic:
        return f"the heading error is that of {heading.ins_topic}"
    if heading.verdict == "reject" and not _is_carried_by_sigma(heading):
        return f"the heading error is rejected ({heading.verdict_reason})"
    if not (math.isfinite(heading.error_deg) and math.isfinite(heading.standard_error_deg)):
        return "the heading error is not a number"
    return ""


def _sigma(heading: HeadingResult) -> float:
    """Of the error: what the ground shows, with the steady sideslip and mounting that the aircraft file states.

    Where it states none, A holds them.
    """
    is_stated = heading.steady_origin == "aircraft file"
    return heading.azimuth[1] if is_stated else heading.measured_sigma_deg


def _is_carried_by_sigma(heading: HeadingResult) -> bool:
    """Whether all that rejected an answer is noise that its sigma holds; a short run is not asked to be normal."""
    failed = {gate.name for gate in heading.gates if gate.required and gate.state == "failed"}
    carried = CARRIED_BY_SIGMA | NORMALITY if "taxi_seconds" in failed else CARRIED_BY_SIGMA
    return bool(failed) and failed <= carried


def _drift(heading: HeadingResult, gyros: GyroDrift | None, prior_sigma: float) -> tuple[float, float]:
    """Drift and its sigma, deg/h: measured and known beforehand, weighed by their variances."""
    drift, sigma = _weighed((0.0, prior_sigma), heading.drift_deg_per_h, heading.drift_sigma_deg_per_h)
    if gyros is None or not gyros.vertical_sigma_deg_per_h < prior_sigma:
        return drift, sigma
    if abs(gyros.vertical_deg_per_h) > BELIEVED_SIGMAS * math.hypot(prior_sigma, gyros.vertical_sigma_deg_per_h):
        return drift, sigma
    return _weighed((drift, sigma), gyros.vertical_deg_per_h, gyros.vertical_sigma_deg_per_h)


def _weighed(known: tuple[float, float], measured: float | None, sigma: float | None) -> tuple[float, float]:
    """A value and its sigma after a measurement; as known where there is none."""
    value, known_sigma = known
    if measured is None or sigma is None or not math.isfinite(measured) or not sigma > 0.0 or not known_sigma > 0.0:
        return known
    weight = known_sigma**2 / (known_sigma**2 + sigma**2)
    return value + weight * (measured - value), math.sqrt(weight) * sigma
