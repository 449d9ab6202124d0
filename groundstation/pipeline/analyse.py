"""Tables of one flight in, all its answers out: everything the data allows, and the reason for what it does not."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.clock import Clock
from groundstation.base.errors import NotAssessableError, SettingsError
from groundstation.base.findings import Finding, Severity
from groundstation.base.ledger import Ledger
from groundstation.base.toml_settings import settings_from
from groundstation.estimators.heading.settings import AircraftData, HeadingRequest, HeadingSettings, Interval, SiteData
from groundstation.estimators.inertial.noise import choose_class
from groundstation.estimators.inertial.settings import InertialSettings
from groundstation.estimators.latency.settings import LatencySettings
from groundstation.estimators.magnetic.ground_settings import MagneticGroundSettings
from groundstation.estimators.magnetic.settings import MagneticSettings
from groundstation.integrity.limits import Thresholds, thresholds_from
from groundstation.pipeline import configuration as configured
from groundstation.pipeline import overview
from groundstation.pipeline.configuration import Configuration
from groundstation.pipeline.inertial import analyse_inertial
from groundstation.pipeline.intervals import seconds_of
from groundstation.pipeline.latency import analyse_latency
from groundstation.pipeline.leaning import leaning_findings
from groundstation.pipeline.magnetic import analyse_magnetic
from groundstation.pipeline.magnetic_ground import analyse_ground_deviation
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults, NotAssessable, Source, Status
from groundstation.results.heading import HeadingResult
from groundstation.results.latency import Latencies
from groundstation.tables.phases import Phases, flight_phases, ground_mask
from groundstation.tables.table import Flight

INFO: Severity = "info"
WARN: Severity = "warn"


@dataclass(frozen=True)
class Given:
    """What is known of a flight before anything is estimated."""

    flight_id: str
    source: Source
    ledger: Ledger
    clock: Clock
    findings: tuple[Finding, ...]
    has_lost_data: bool


@dataclass(frozen=True)
class UserSettings:
    """The user's tables as the dataclasses the estimators take."""

    heading: HeadingSettings
    inertial: InertialSettings
    latency: LatencySettings
    magnetic: MagneticSettings
    magnetic_ground: MagneticGroundSettings
    aircraft: AircraftData
    site: SiteData
    thresholds: Thresholds


def user_settings(configuration: Configuration) -> UserSettings:
    """Turn the user's tables into settings.

    Raises
    ------
    SettingsError
        For an unknown key or a value of the wrong kind.
    """
    settings = UserSettings(
        settings_from(HeadingSettings, configuration.heading, configuration.file_of("heading"), "heading"),
        settings_from(InertialSettings, configuration.inertial, configuration.file_of("inertial"), "inertial"),
        settings_from(LatencySettings, configuration.latency, configuration.file_of("latency"), "latency"),
        settings_from(MagneticSettings, configuration.magnetic, configuration.file_of("magnetic"), "magnetic"),
        settings_from(
            MagneticGroundSettings,
            configuration.magnetic_ground,
            configuration.file_of("magnetic_ground"),
            "magnetic_ground",
        ),
        settings_from(AircraftData, configuration.aircraft, configuration.file_of("aircraft"), "aircraft"),
        settings_from(SiteData, configuration.site, configuration.file_of("site"), "site"),
        configured_thresholds(configuration),
    )
    choose_class(
        settings.inertial, settings.aircraft.ins_class
    )  # a class that does not exist is found out before a run
    return settings


def configured_thresholds(configuration: Configuration) -> Thresholds:
    """The user's thresholds of the ledger, the shipped ones where none are set.

    Raises
    ------
    SettingsError
        For another version, an unknown key or a value of the wrong kind.
    """
    return thresholds_from(configuration.thresholds, configuration.file_of("thresholds"), "thresholds")


def analyse(flight: Flight, given: Given, configuration: Configuration) -> FlightResults:
    """Compute everything the data of a flight allows.

    Returns
    -------
    FlightResults
        Analyses that could not run stand in ``not_assessable`` with their reasons.
    """
    settings = user_settings(configuration)
    findings = list(given.findings)
    not_assessable: list[NotAssessable] = []
    phases, excluded_s = flight_phases(flight), _excluded(flight, configuration)
    inertial = analyse_inertial(
        flight,
        phases,
        settings.inertial,
        aircraft_class=settings.aircraft.ins_class,
        excluded_s=excluded_s,
    )
    latency = analyse_latency(flight, settings.latency, inertial.inertial)
    heading = _heading_or_reason(flight, configuration, settings, latency.latency, findings, not_assessable)
    magnetic = analyse_magnetic(
        flight,
        phases,
        settings.magnetic,
        aircraft=settings.aircraft,
        inertial=inertial.inertial,
        latencies=latency.latency,
        heading=heading,
        heading_settings=settings.heading,
        heading_request=_request_or_none(flight, configuration),
    )
    on_ground = analyse_ground_deviation(
        flight,
        phases,
        settings.magnetic_ground,
        aircraft=settings.aircraft,
        latencies=latency.latency,
        excluded_s=excluded_s,
    )
    findings += (*inertial.findings, *latency.findings, *magnetic.findings, *on_ground.findings)
    not_assessable += (*inertial.not_assessable, *latency.not_assessable)
    not_assessable += (*magnetic.not_assessable, *on_ground.not_assessable)
    figures = (
        *_figures(flight, given, settings, phases, heading),
        *inertial.figures,
        *(latency.latency.figures if latency.latency else ()),
        *(magnetic.magnetic.figures if magnetic.magnetic else ()),
        *(on_ground.magnetic_ground.figures if on_ground.magnetic_ground else ()),
    )
    findings += leaning_findings(flight, given.ledger, heading, inertial.inertial, settings.thresholds)
    if heading is not None:
        findings += heading_findings(heading)
        findings += _findings_of_what_was_set(flight, heading, configuration, settings)
    return FlightResults(
        flight_id=given.flight_id,
        source=given.source,
        metadata=flight.metadata,
        start_utc_ns=flight.start_ns if flight.has_utc else None,
        duration_s=flight.duration_s,
        status=_status(given, findings),
        completeness=given.ledger.completeness,
        ledger=given.ledger,
        clock=given.clock,
        findings=tuple(findings),
        not_assessable=tuple(not_assessable),
        heading=heading,
        inertial=inertial.inertial,
        forecast=inertial.forecast,
        latency=latency.latency,
        magnetic=magnetic.magnetic,
        magnetic_ground=on_ground.magnetic_ground,
        figures=figures,
    )


def estimate_heading(
    flight: Flight, configuration: Configuration, settings: UserSettings, latencies: Latencies | None = None
) -> HeadingResult:
    """Run system 1 on a flight, with the user's intervals, the proof of ground contact and what is known of latencies.

    Raises
    ------
    NotAssessableError
        When the data does not allow it; the reason is the message.
    """
    from groundstation.estimators.heading.estimate import estimate_heading_error
    from groundstation.tables.headings import true_heading

    return estimate_heading_error(
        flight,
        on_ground=lambda time_ns: ground_mask(flight, time_ns),
        heading=lambda topic: true_heading(flight, topic),
        settings=settings.heading,
        aircraft=settings.aircraft,
        site=settings.site,
        request=HeadingRequest(intervals=_intervals(flight, configuration)),
        latencies=latencies,
    )


def _heading_or_reason(
    flight: Flight,
    configuration: Configuration,
    settings: UserSettings,
    latencies: Latencies | None,
    findings: list[Finding],
    not_assessable: list[NotAssessable],
) -> HeadingResult | None:
    try:
        return estimate_heading(flight, configuration, settings, latencies)
    except NotAssessableError as error:
        reason, severity = str(error).removeprefix("heading: "), INFO
    except SettingsError as error:  # intervals in UTC for a flight without it: this flight's trouble alone
        reason, severity = str(error), WARN
    not_assessable.append(NotAssessable("heading", reason))
    findings.append(Finding(severity, "heading.not_assessable", f"heading correction not assessable: {reason}"))
    return None


def heading_findings(result: HeadingResult) -> tuple[Finding, ...]:
    """Findings that follow from the heading result: a rejected verdict is a warning."""
    grave = result.verdict == "reject"
    text = f"heading correction: {result.verdict}: {result.verdict_reason}"
    return (Finding("warn" if grave else "info", f"heading.{result.verdict}", text),)


def _findings_of_what_was_set(
    flight: Flight, heading: HeadingResult, configuration: Configuration, settings: UserSettings
) -> list[Finding]:
    """Findings on the user's references and intervals: what contradicts the log, or touches none of its samples."""
    from groundstation.estimators.heading.gating import intervals_without_epoch
    from groundstation.estimators.heading.references import reference_findings

    lines = reference_findings(heading, flight.metadata, settings.site)
    findings = [Finding("warn", "heading.reference", line) for line in lines]
    intervals = _intervals(flight, configuration)
    for part in intervals_without_epoch(flight.time_s(heading.gnss_topic), intervals):
        text = f"interval to {part.use}, {part.start_s:g} to {part.end_s:g} s: no GNSS epoch in it"
        findings.append(Finding("warn", "heading.interval", text))
    return findings


def _intervals(flight: Flight, configuration: Configuration) -> tuple[Interval, ...]:
    uses: tuple[tuple[Literal["exclude", "force"], tuple[configured.Interval, ...]], ...] = (
        ("exclude", configuration.exclude),
        ("force", configuration.force),
    )
    return tuple(Interval(start_s, end_s, use) for use, listed in uses for start_s, end_s in seconds_of(flight, listed))


def _request_or_none(flight: Flight, configuration: Configuration) -> HeadingRequest | None:
    try:
        return HeadingRequest(intervals=_intervals(flight, configuration))
    except SettingsError:  # intervals in UTC for a flight without it: said with the heading
        return None


def _excluded(flight: Flight, configuration: Configuration) -> tuple[tuple[float, float], ...]:
    try:
        return tuple(seconds_of(flight, configuration.exclude))
    except SettingsError:  # intervals in UTC for a flight without it: said with the heading
        return ()


def _status(given: Given, findings: list[Finding]) -> Status:
    if any(finding.severity == "fail" for finding in findings):
        return "failed"
    return "degraded" if given.has_lost_data else "ok"


def _figures(
    flight: Flight, given: Given, settings: UserSettings, phases: Phases, heading: HeadingResult | None
) -> tuple[FigureData, ...]:
    true_heading_deg, ins_topic = _heading_for_overview(flight, heading)
    general = (
        overview.overview(flight, true_heading_deg, ins_topic),
        overview.phase_figure(phases),
        overview.gnss_lanes(flight, settings.heading.geometry_max),
        overview.state_lanes(flight),
        *overview.ledger_figures(flight, given.ledger, settings.thresholds),
    )
    return (*(figure for figure in general if figure is not None), *(heading.figures if heading else ()))


def _heading_for_overview(
    flight: Flight, heading: HeadingResult | None
) -> tuple[NDArray[np.float64] | None, str | None]:
    from groundstation.tables.headings import true_heading

    topic = heading.ins_topic if heading else overview.first_of_kind(flight, "ins", "true_heading_deg")
    topic = topic or overview.first_of_kind(flight, "ins", "magnetic_heading_deg")
    if topic is None:
        return None, None
    try:
        return true_heading(flight, topic).values_deg, topic
    except NotAssessableError:
        return None, None
