"""Deviation of the installed heading sensor from ground runs in the pipeline, told as a finding."""

from collections.abc import Sequence
from dataclasses import dataclass

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.signals import topics_of_kind
from groundstation.estimators.heading.settings import AircraftData
from groundstation.estimators.magnetic.ground_settings import MagneticGroundSettings
from groundstation.results.flight import NotAssessable
from groundstation.results.latency import Latencies
from groundstation.results.magnetic_ground import GroundDeviation
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight

NAME = "magnetic_ground"
SURE_SIGMAS = 2.0


@dataclass(frozen=True)
class MagneticGroundAnswers:
    """What the ground runs of a flight tell of its heading sensor; the reason where nothing."""

    magnetic_ground: GroundDeviation | None = None
    findings: tuple[Finding, ...] = ()
    not_assessable: tuple[NotAssessable, ...] = ()


def analyse_ground_deviation(
    flight: Flight,
    phases: Phases,
    settings: MagneticGroundSettings,
    *,
    aircraft: AircraftData | None = None,
    latencies: Latencies | None = None,
    excluded_s: Sequence[tuple[float, float]] = (),
) -> MagneticGroundAnswers:
    """Find the errors on the ground runs; never raises for what the flight lacks."""
    from groundstation.estimators.magnetic.ground_runs import estimate_ground_deviation

    try:
        found = estimate_ground_deviation(
            flight,
            settings=settings,
            phases=phases,
            aircraft=aircraft,
            latencies=latencies,
            excluded_s=excluded_s,
        )
    except NotAssessableError as error:
        reason = str(error).removeprefix(f"{NAME}: ")
        has_heading = any(flight[topic].has("magnetic_heading_deg") for topic in topics_of_kind("ins", flight.topics()))
        text = f"heading sensor on ground runs not assessable: {reason}"
        findings = (Finding("info", f"{NAME}.not_assessable", text),) if has_heading else ()
        return MagneticGroundAnswers(findings=findings, not_assessable=(NotAssessable(NAME, reason),))
    return MagneticGroundAnswers(found, _findings(found, settings))


def _findings(found: GroundDeviation, settings: MagneticGroundSettings) -> tuple[Finding, ...]:
    """One line for all, and a warning for the run that is surely beyond the limit by most."""
    rows = [(run, run.error_deg, run.sigma_deg) for run in found.used]
    known = [(run, error, sigma) for run, error, sigma in rows if error is not None and sigma is not None]
    errors = [error for _run, error, _sigma in known]
    spanned = " to ".join(f"{round(error, 1) + 0.0:+.1f}" for error in sorted({min(errors), max(errors)}))
    runs = f"{_count(len(known), 'straight ground run')} in {_count(found.directions, 'direction')}"
    text = f"heading sensor on {runs}: error {spanned} deg"
    told = [Finding("info", f"{NAME}.found", text, found.ins_topic)]
    run, error, sigma = max(known, key=lambda row: abs(row[1]) - SURE_SIGMAS * row[2])
    if abs(error) - SURE_SIGMAS * sigma > settings.error_max_deg:
        text = (
            f"heading sensor reads {error:+.1f} deg wrong at {run.magnetic_heading_deg:.0f} deg on the ground run at "
            f"{run.start_s:.0f} s (sigma {sigma:.1f}), more than {settings.error_max_deg:g} deg"
        )
        told.append(Finding("warn", f"{NAME}.error", text, found.ins_topic))
    return tuple(told)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"
