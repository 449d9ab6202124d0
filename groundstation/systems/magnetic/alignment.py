"""Alignment of the INS heading by what the flight shows, and its sigma at the figure.

A compass swing is about the axis of the airframe, so what is taken off is the error of the *airframe's* heading: the
answer of the heading analysis as it stands, whose interval needs no mounting. The platform's number would need the
sigma of the mounting for nothing: the mounting is in the INS heading that taxi compares with the track, and in the one
that the magnetometer is compared with. Azimuth by turns (inertial analysis) is the platform's: there the mounting is
added.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from groundstation.base.dataclasses import dataclass
from groundstation.base.units import S_PER_H
from groundstation.base.words import counted
from groundstation.results.roles import AzimuthByTurns, HeadingByTrack
from groundstation.systems.known import AircraftData
from groundstation.systems.magnetic.answer import Alignment, AlignmentSource, SourceName
from groundstation.systems.magnetic.before_lift_off import GroundRuns
from groundstation.systems.magnetic.gyros import GyroDrift
from groundstation.systems.magnetic.settings import MagneticSettings

BELIEVED_SIGMAS = 3.0  # of gyro drift and prior together: further off the rates are not those the INS navigates with


@dataclass(frozen=True)
class _Carried:
    """Source carried to the figure: its error there, sigma with and without drift until then."""

    source: AlignmentSource
    aligned_error_deg: float
    aligned_sigma_deg: float
    error_deg: float
    sigma_deg: float
    at_s: float
    drift_deg_per_h: float
    drift_sigma_deg_per_h: float


def align(
    heading: HeadingByTrack | None,
    ins_topic: str,
    figure_at_s: float,
    settings: MagneticSettings,
    runs: GroundRuns | None = None,
    gyros: GyroDrift | None = None,
    *,
    by_turns: AzimuthByTurns | None = None,
    aircraft: AircraftData | None = None,
) -> Alignment:
    """INS heading error carried from where it was seen to the figure.

    On the ground ``heading``, the heading analysis's own answer, comes first, with its whole interval and whatever its
    verdict, unless what refused it is not in that interval; then the run before lift-off. Azimuth by turns is weighed
    with it by the variances where both agree, and stands alone where the ground says nothing.

    error(figure) = error + drift x hours; variance = that of the error + (sigma of drift x hours)^2. The drift that
    the ground shows is weighed against 0 +- ``drift_sigma_deg_per_h``: minutes hardly show any. That of the gyros
    counts where its sigma is smaller than this one. Without any source nothing is corrected and
    ``alignment_sigma_deg`` stands.

    The mounting that the aircraft file states is taken off apart, here and in the sources.
    """
    runs = runs or GroundRuns(taxi=heading)
    aircraft = aircraft or AircraftData()
    prior = settings.drift_sigma_deg_per_h
    shown = (gyros.drift_deg_per_h, gyros.sigma_deg_per_h) if gyros else (None, None)
    listed = {
        "taxi": _from_ground("taxi", runs.taxi, runs.why_not_taxi, ins_topic, aircraft, settings),
        "ground run": _from_ground("ground run", runs.fast, runs.why_not, ins_topic, aircraft, settings),
        "turns": _from_turns(by_turns, ins_topic, aircraft, settings),
    }
    carried = {name: _carry(one, figure_at_s, _drift(found, gyros, prior)) for name, (one, found) in listed.items()}
    usable = {name: one for name, one in carried.items() if one is not None and not one.source.reason}
    order = ("taxi", "ground run") if settings.uses_slower_taxi else ("ground run", "taxi")
    ground = next((usable[name] for name in order if name in usable), None)
    used = _chosen(ground, usable.get("turns"))
    sources = tuple(_told(one, carried[name], used) for name, (one, _) in listed.items())
    if not used:
        origin, sigma = f"not aligned: {_why_not(sources)}", settings.alignment_sigma_deg
        unaligned = Alignment(origin, 0.0, sigma, 0.0, sigma, 0.0, prior, None, figure_at_s, runs.speed_min_mps, *shown)
        return replace(unaligned, sources=sources)
    origin = " and ".join(_origin(one, runs) for one in used)
    weights = _weights([one.sigma_deg for one in used])
    aligned = Alignment(
        origin=origin,
        error_deg=_mean(weights, [one.error_deg for one in used]),
        sigma_deg=_sigma([one.sigma_deg for one in used]),
        aligned_error_deg=_mean(weights, [one.aligned_error_deg for one in used]),
        aligned_sigma_deg=_sigma_of_mean(weights, [one.aligned_sigma_deg for one in used]),
        drift_deg_per_h=_mean(weights, [one.drift_deg_per_h for one in used]),
        drift_sigma_deg_per_h=_mean(weights, [one.drift_sigma_deg_per_h for one in used]),
        aligned_at_s=_mean(weights, [one.at_s for one in used]),
        figure_at_s=figure_at_s,
        speed_min_mps=runs.speed_min_mps,
        gyro_drift_deg_per_h=shown[0],
        gyro_drift_sigma_deg_per_h=shown[1],
    )
    return replace(aligned, sources=sources)


def against_heading(alignment: Alignment) -> float | None:
    """Return by how many sigma the alignment, hence A, contradicts the heading analysis.

    None without a heading analysis. Where that analysis aligned, it is compared with the turns that had a say; where it
    was refused, with what was used.
    """
    taxi = alignment.source("taxi")
    if taxi is None or taxi.error_deg is None or taxi.sigma_deg is None:
        return None
    if not taxi.is_used:
        return abs(taxi.error_deg - alignment.error_deg) / math.hypot(taxi.sigma_deg, alignment.sigma_deg)
    turns = alignment.source("turns")
    if turns is None or turns.error_deg is None or turns.sigma_deg is None:
        return 0.0
    return abs(taxi.error_deg - turns.error_deg) / math.hypot(taxi.sigma_deg, turns.sigma_deg)


def _from_ground(
    name: SourceName,
    found: HeadingByTrack | None,
    missing: str,
    ins_topic: str,
    aircraft: AircraftData,
    settings: MagneticSettings,
) -> tuple[AlignmentSource, HeadingByTrack | None]:
    """Return an answer of the heading analysis as a source.

    The error of the source is that of the airframe less the mounting that is stated.
    """
    if found is None or found.ins_topic != ins_topic:
        reason = missing or (
            "no heading error from taxi" if found is None else f"the heading error is that of {found.ins_topic}"
        )
        return AlignmentSource(name, None, None, None, False, reason), None
    sigma = found.standard_error_deg
    if name == "ground run":
        sigma = math.hypot(sigma, settings.take_off_sideslip_deg)
    if not (math.isfinite(found.error_deg) and math.isfinite(sigma)):
        return AlignmentSource(name, None, None, None, False, "the heading error is not a number"), None
    error, reason = found.error_deg - aircraft.mounting_deg, refused(found)
    return AlignmentSource(name, error, sigma, found.reference_time_s or 0.0, False, reason, found.verdict), found


def refused(found: HeadingByTrack) -> str:
    """Return why an answer of the heading analysis does not align; empty where it does.

    Something failed that its interval does not hold.
    """
    is_told_why = any(gate.required and gate.state == "failed" for gate in found.gates)
    if not found.failed_beside_interval and (is_told_why or found.verdict != "reject"):
        return ""
    return f"the heading error is rejected ({found.verdict_reason})"


def _from_turns(
    by_turns: AzimuthByTurns | None, ins_topic: str, aircraft: AircraftData, settings: MagneticSettings
) -> tuple[AlignmentSource, None]:
    """Azimuth by turns as a source: the mounting is not in it, its sigma is."""
    azimuth = by_turns.azimuth if by_turns is not None and by_turns.ins_topic == ins_topic else None
    if azimuth is None or azimuth.error_deg is None or azimuth.sigma_deg is None or azimuth.time_s is None:
        reason = "no azimuth by turns" if azimuth is None else f"azimuth by turns: {azimuth.reason}"
        return AlignmentSource("turns", None, None, None, False, reason), None
    mounting = aircraft.mounting_sigma_deg
    sigma = math.hypot(azimuth.sigma_deg, settings.mounting_sigma_deg if mounting is None else mounting)
    return AlignmentSource("turns", azimuth.error_deg, sigma, azimuth.time_s, False), None


def _carry(source: AlignmentSource, figure_at_s: float, drift: tuple[float, float]) -> _Carried | None:
    """A source at the figure; None where it has no number."""
    if source.error_deg is None or source.sigma_deg is None or source.at_s is None:
        return None
    hours = (figure_at_s - source.at_s) / S_PER_H
    sigma = math.hypot(source.sigma_deg, drift[1] * hours)
    error = source.error_deg + drift[0] * hours
    return _Carried(source, source.error_deg, source.sigma_deg, error, sigma, source.at_s, *drift)


def _chosen(ground: _Carried | None, turns: _Carried | None) -> list[_Carried]:
    """Choose what aligns: both where they agree, else the ground.

    The ground shows the airframe itself.
    """
    if ground is None or turns is None:
        return [one for one in (ground, turns) if one is not None]
    apart = abs(ground.error_deg - turns.error_deg) / math.hypot(ground.sigma_deg, turns.sigma_deg)
    return [ground, turns] if apart <= BELIEVED_SIGMAS else [ground]


def _told(source: AlignmentSource, carried: _Carried | None, used: Sequence[_Carried]) -> AlignmentSource:
    """The source with error and sigma at the figure."""
    if carried is None:
        return source
    is_used = any(one.source is source for one in used)
    reason = source.reason or ("" if is_used else "another source of the same flight is used")
    return AlignmentSource(
        source.name, carried.error_deg, carried.sigma_deg, source.at_s, is_used, reason, source.verdict
    )


def _why_not(sources: Sequence[AlignmentSource]) -> str:
    """The reasons of all sources, each once; those of the ground first."""
    reasons = dict.fromkeys(one.reason for one in sources if one.reason)
    return "; ".join(reasons)


def _origin(one: _Carried, runs: GroundRuns) -> str:
    """A source in words."""
    name, verdict = one.source.name, one.source.verdict
    if name == "turns":
        return "azimuth by turns"
    told = f"straight taxi ({counted(runs.taxi.samples, 'epoch')})" if name == "taxi" and runs.taxi else ""
    if name == "ground run" and runs.fast:
        told = f"ground run above {runs.speed_min_mps:.1f} m/s up to lift-off ({counted(runs.fast.samples, 'epoch')})"
    told += f", verdict {verdict}" + (" for what its interval includes" if verdict == "reject" else "")
    return told + (f", after {runs.since}" if runs.since else "")


def _weights(sigmas: Sequence[float]) -> list[float]:
    """Weights by variance, sum 1."""
    total = sum(sigma**-2 for sigma in sigmas)
    return [sigma**-2 / total for sigma in sigmas]


def _sigma(sigmas: Sequence[float]) -> float:
    return 1.0 / math.sqrt(sum(sigma**-2 for sigma in sigmas))


def _sigma_of_mean(weights: Sequence[float], sigmas: Sequence[float]) -> float:
    return math.sqrt(sum((part * sigma) ** 2 for part, sigma in zip(weights, sigmas, strict=True)))


def _mean(weights: Sequence[float], values: Sequence[float]) -> float:
    return sum(part * value for part, value in zip(weights, values, strict=True))


def _drift(heading: HeadingByTrack | None, gyros: GyroDrift | None, prior_sigma: float) -> tuple[float, float]:
    """Drift and its sigma, deg/h: measured and known beforehand, weighed by their variances."""
    drift, sigma = 0.0, prior_sigma
    if heading is not None:
        drift, sigma = _weighed((drift, sigma), heading.drift_deg_per_h, heading.drift_sigma_deg_per_h)
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
