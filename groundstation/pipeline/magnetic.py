"""System 3 in the pipeline: the deviation of the magnetic heading, told as a finding."""

from dataclasses import dataclass

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.signals import topics_of_kind
from groundstation.estimators.heading.settings import AircraftData, HeadingRequest, HeadingSettings
from groundstation.estimators.magnetic.settings import MagneticSettings
from groundstation.results.flight import NotAssessable
from groundstation.results.heading import HeadingResult
from groundstation.results.inertial import InertialResult
from groundstation.results.latency import Latencies
from groundstation.results.magnetic import MagneticResult
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight


@dataclass(frozen=True)
class MagneticAnswers:
    """What is known of the deviation of a flight; the reason where nothing is."""

    magnetic: MagneticResult | None = None
    findings: tuple[Finding, ...] = ()
    not_assessable: tuple[NotAssessable, ...] = ()


def analyse_magnetic(
    flight: Flight,
    phases: Phases,
    settings: MagneticSettings,
    *,
    aircraft: AircraftData | None = None,
    inertial: InertialResult | None = None,
    latencies: Latencies | None = None,
    heading: HeadingResult | None = None,
    heading_settings: HeadingSettings | None = None,
    heading_request: HeadingRequest | None = None,
) -> MagneticAnswers:
    """Find the deviation; never raises for what the flight lacks.

    Parameters
    ----------
    flight : Flight
    phases : Phases
    settings : MagneticSettings
    aircraft, inertial, latencies, heading : optional
        The aircraft file, and what the other analyses know: the kind of INS, the latency of the magnetometer, the
        alignment of the INS.
    heading_settings, heading_request : optional
        With which system 1 looks at the ground runs up to lift-off once more.
    """
    from groundstation.estimators.magnetic.estimate import estimate_deviation

    try:
        found = estimate_deviation(
            flight,
            settings=settings,
            heading=heading,
            heading_settings=heading_settings,
            heading_request=heading_request,
            latencies=latencies,
            kinds={inertial.ins_topic: inertial.kind} if inertial else {},
            aircraft=aircraft,
            phases=phases,
        )
    except NotAssessableError as error:
        reason = str(error).removeprefix("magnetic: ")
        text = f"magnetic deviation not assessable: {reason}"
        has_readings = any(topics_of_kind("magnetometer", flight.topics()))  # else nobody expects a deviation
        findings = (Finding("info", "magnetic.not_assessable", text),) if has_readings else ()
        return MagneticAnswers(findings=findings, not_assessable=(NotAssessable("magnetic", reason),))
    return MagneticAnswers(found, (_finding(found),))


def _finding(found: MagneticResult) -> Finding:
    """The verdict: a rejected one is a warning."""
    text = f"magnetic deviation: {found.verdict}: {found.verdict_reason}"
    topic = found.magnetometer_topic
    return Finding("warn" if found.verdict == "reject" else "info", f"magnetic.{found.verdict}", text, topic)
