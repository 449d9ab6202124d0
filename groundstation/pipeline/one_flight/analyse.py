"""Answers of one flight from its tables, and the reason for each answer that is missing.

Everything that the data allows is answered.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError, SettingsError
from groundstation.base.failures import attempt, left_out
from groundstation.base.findings import Finding, Severity
from groundstation.base.gaps import Gaps
from groundstation.base.ledger import Ledger
from groundstation.base.signals import topics_of_kind
from groundstation.integrity.ledger import gaps_of
from groundstation.methods import overview
from groundstation.methods.roles import LimitsOfTaxi
from groundstation.methods.taxi.settings import GroundLimits
from groundstation.pipeline.one_flight import configuration as configured
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.damage import damage_finding
from groundstation.pipeline.one_flight.intervals import seconds_of
from groundstation.results.answer import Answers, answer_meeting
from groundstation.results.chosen import Interval, chosen_intervals
from groundstation.results.figures import FigureData
from groundstation.results.flight import SIMULATED_BY, FlightResults, NotAssessable, Source, Status
from groundstation.results.roles import HeadingByTrack
from groundstation.systems import systems
from groundstation.systems.analysis import Analysis, Found, in_order_of_need
from groundstation.systems.known import Known
from groundstation.tables.phases import flight_phases
from groundstation.tables.simulated import CODE as SIMULATED
from groundstation.tables.simulated import simulated_by
from groundstation.tables.table import Flight
from groundstation.tables.vehicle import ALWAYS_ON_GROUND, CONTRADICTION, STATED_BY, VEHICLE

if TYPE_CHECKING:
    from groundstation.base.runways.table import RunwayTable
    from groundstation.systems.system import Systems

INFO: Severity = "info"
WARN: Severity = "warn"
TRUTH = "truth"


@dataclass(frozen=True)
class Given:
    """Facts of a flight before anything is estimated."""

    flight_id: str
    source: Source
    ledger: Ledger
    clock: Clock
    findings: tuple[Finding, ...]
    has_lost_data: bool


@dataclass(frozen=True)
class Answered:
    """Results of the analyses of a flight: answers and findings by analysis, and reasons.

    ``reasons`` has an entry for every analysis that applies and has no answer; ``not_assessable`` leaves out those that
    only lack the answer of another.
    """

    answers: Answers
    findings: Mapping[str, tuple[Finding, ...]]
    reasons: Mapping[str, str]
    not_assessable: tuple[NotAssessable, ...]
    workings: Mapping[str, Any] = field(default_factory=dict)

    def joined(self, later: "Answered") -> "Answered":
        """Return these results and those of later analyses together."""
        return Answered(
            {**self.answers, **later.answers},
            {**self.findings, **later.findings},
            {**self.reasons, **later.reasons},
            (*self.not_assessable, *later.not_assessable),
            {**self.workings, **later.workings},
        )


def analyse(flight: Flight, given: Given, configuration: Configuration) -> FlightResults:
    """Compute everything the data of a flight allows.

    Returns
    -------
    FlightResults
        Analyses that could not run stand in ``not_assessable`` with their reasons.
    """
    flight = _as_stated(flight, configuration)
    found, known = answers_of(flight, configuration)
    flight = flight.without(TRUTH)
    thresholds = configuration.thresholds
    gaps = {
        name: gaps_of(name, flight[name].time_ns, thresholds=thresholds, pauses=flight.pauses)
        for name in flight.topics()
    }
    findings = [*given.findings, *(Finding("warn", "plug_in.system", line) for line in systems().failures)]
    if known.phases.vehicle.contradiction:
        findings.append(Finding("warn", CONTRADICTION, known.phases.vehicle.contradiction))
    simulator = simulated_by(flight)
    if simulator:
        text = f"simulated vehicle ({simulator}): GNSS, vibration, latency and errors are those of models"
        findings.append(Finding("info", SIMULATED, text))
    for analysis in systems().analyses:
        findings += found.findings.get(analysis.name, ())
        findings += (
            attempt("damage check", analysis.name, _on_damage, analysis, flight, given, found.answers, gaps) or ()
        )
    figures = [*_general_figures(flight, given, known, found.answers, gaps)]
    for answer in found.answers.values():
        figures += answer.figures
    return FlightResults(
        flight_id=given.flight_id,
        source=given.source,
        metadata=MappingProxyType(
            {
                **flight.metadata,
                **overview.phase_facts(known.phases),
                **(attempt("arrays", "altitude", overview.altitude_facts, flight) or {}),
                **_simulated(simulator),
            }
        ),
        start_utc_ns=flight.start_ns if flight.has_utc else None,
        duration_s=flight.duration_s,
        status=_status(given, findings),
        completeness=given.ledger.completeness,
        ledger=given.ledger,
        clock=given.clock,
        findings=tuple(findings),
        not_assessable=found.not_assessable,
        answers=found.answers,
        figures=tuple(figures),
        chosen=chosen_intervals(configuration.to_dict()),
    )


def _simulated(simulator: str) -> dict[str, str]:
    return {SIMULATED_BY: simulator} if simulator else {}


def _as_stated(flight: Flight, configuration: Configuration) -> Flight:
    """Return the flight with the kind of vehicle that the aircraft file states."""
    kind = configuration.aircraft.stated_vehicle
    if not kind:
        return flight
    told = {VEHICLE: kind, ALWAYS_ON_GROUND: "true" if kind == "rolls" else "false", STATED_BY: "aircraft file"}
    return replace(flight, metadata=MappingProxyType({**flight.metadata, **told}))


def seen_by_analyses(flight: Flight, configuration: Configuration) -> Flight:
    """Return the flight as all analyses get it, except those that judge by the truth."""
    return _as_stated(flight, configuration).without(TRUTH)


def answers_of(flight: Flight, configuration: Configuration) -> tuple[Answered, Known]:
    """Run all analyses on a flight.

    Only analyses that judge by the truth see it, and they run after all others.
    """
    seen = flight.without(TRUTH)
    known = known_of(seen, configuration)
    every = tuple(_refused(one) if one.name in configuration.without else one for one in systems().analyses)
    found = run_analyses(tuple(one for one in every if not one.judges), seen, known)
    so_far = replace(known, answers=found.answers, workings=found.workings)
    judged = run_analyses(tuple(one for one in every if one.judges), flight, so_far)
    if not topics_of_kind(TRUTH, flight.topics()):
        judged = replace(judged, not_assessable=())  # no truth was given: no reason is needed
    return found.joined(judged), known


def _refused(analysis: Analysis) -> Analysis:
    """Return the analysis as one that the user leaves out."""

    def run(_data: Any, _known: Any, _settings: Any) -> Found[Any]:
        raise NotAssessableError(analysis.subject, "left out (--without)")

    return replace(analysis, run=run, is_expected=lambda _data, _known: False)


def known_of(flight: Flight, configuration: Configuration, among: "Systems | None" = None) -> Known:
    """Return what the analyses may use besides the tables of a flight.

    Phases, and all that the user states about it. ``among`` holds the systems that are asked, all by default; roles
    that others offer are found when they are asked for.
    """
    settings = configuration.settings if among is None else configuration.settings_among(among)
    known = Known(
        phases=flight_phases(flight),
        aircraft=settings.aircraft,
        site=settings.site,
        settings=settings.analyses,
        weather=configuration.weather,
        lessons=configuration.lessons,
        roles=systems().roles if among is None else _Roles(among),
        find_runways=_runways,
    )
    try:
        return replace(known, intervals=_intervals(flight, configuration))
    except SettingsError as error:  # intervals in UTC for a flight without it: this flight's trouble alone
        return replace(known, intervals_problem=error)


class _Roles(Mapping[type[Any], Callable[[Any], Any]]):
    """Roles that some systems offer, and those of all others once one of these is asked for."""

    def __init__(self, among: "Systems") -> None:
        self._among = among

    def __getitem__(self, role: type[Any]) -> Callable[[Any], Any]:
        offered = self._among.roles.get(role)
        return systems().roles[role] if offered is None else offered

    def __iter__(self) -> Iterator[type[Any]]:
        return iter(systems().roles)

    def __len__(self) -> int:
        return len(systems().roles)


def _runways() -> "tuple[RunwayTable, str]":
    from groundstation.base.runways.kept import usable_runways

    return usable_runways()


def run_analyses(analyses: tuple[Analysis, ...], data: Any, known: Any) -> Answered:
    """Run analyses on a flight or a session, each after those it builds on.

    An analysis that lacks data gives its reason. So does one that fails by a defect, where failures are gathered
    (:mod:`groundstation.base.failures`).

    Parameters
    ----------
    analyses : tuple of Analysis
    data : Flight
        What they analyse; for analyses of a session, the session.
    known : Known
        ``answers`` and ``workings`` are filled as the analyses run; it may come with those
        of analyses that ran before.
    """
    answers: dict[str, Any] = dict(known.answers)
    workings: dict[str, Any] = dict(known.workings)
    findings: dict[str, tuple[Finding, ...]] = {}
    reasons: dict[str, NotAssessable] = {}
    for analysis in in_order_of_need(analyses):
        so_far = replace(known, answers=answers, workings=workings)
        try:
            found = _run_one(analysis, data, so_far, reasons)
        except Exception as error:
            failure = left_out("analysis", analysis.name, error)
            found = _Unanswered(NotAssessable(analysis.name, failure.reason), (failure.finding(),))
        if isinstance(found, _Unanswered):
            reasons[analysis.name], findings[analysis.name] = found
        elif found is not None:
            answers[analysis.name], workings[analysis.name] = found.answer, found.workings
            findings[analysis.name] = found.findings
    names = [analysis.name for analysis in analyses]
    return Answered(
        {name: answers[name] for name in names if name in answers},
        findings,
        {name: reasons[name].reason for name in names if name in reasons},
        tuple(reasons[name] for name in names if name in reasons and reasons[name].analysis == name),
        workings,
    )


class _Unanswered(NamedTuple):
    """Reason why an analysis gave no answer, and findings on that."""

    reason: NotAssessable
    findings: tuple[Finding, ...]


def _run_one(
    analysis: Analysis, data: Any, known: Any, reasons: Mapping[str, NotAssessable]
) -> Found[Any] | _Unanswered | None:
    """Run an analysis; None where it does not apply.

    ``reasons`` are those of earlier analyses without an answer.
    """
    if not analysis.applies(data, known):
        return None
    missing = next((name for name in analysis.requires if name not in known.answers), None)
    if missing is not None:
        return _Unanswered(reasons.get(missing) or NotAssessable(missing, f"{missing} did not run"), ())
    try:
        return analysis.run(data, known, known.settings[analysis.settings_table])
    except NotAssessableError as error:
        reason, severity = str(error).removeprefix(f"{analysis.name}: "), INFO
    except SettingsError as error:
        reason, severity = str(error), WARN
    text = f"{analysis.subject} not assessable: {reason}"
    told = (Finding(severity, f"{analysis.name}.not_assessable", text),)
    return _Unanswered(NotAssessable(analysis.name, reason), told if analysis.is_expected(data, known) else ())


def _on_damage(
    analysis: Analysis, flight: Flight, given: Given, answers: Answers, gaps: Mapping[str, Gaps]
) -> tuple[Finding, ...]:
    """Return the finding on damage among the samples of an answer."""
    answer = answers.get(analysis.name)
    use = None if answer is None else analysis.rests_on(flight, answer)
    if use is None:
        return ()
    found = damage_finding(f"{analysis.name}.damaged_span", analysis.subject, use, given.ledger, flight, gaps)
    return (found,) if found else ()


def _intervals(flight: Flight, configuration: Configuration) -> tuple[Interval, ...]:
    uses: tuple[tuple[Literal["exclude", "force"], tuple[configured.WrittenInterval, ...]], ...] = (
        ("exclude", configuration.exclude),
        ("force", configuration.force),
    )
    return tuple(Interval(start_s, end_s, use) for use, listed in uses for start_s, end_s in seconds_of(flight, listed))


def _status(given: Given, findings: list[Finding]) -> Status:
    if any(finding.severity == "fail" for finding in findings):
        return "failed"
    return "degraded" if given.has_lost_data else "ok"


def _general_figures(
    flight: Flight, given: Given, known: Known, answers: Answers, gaps: Mapping[str, Gaps]
) -> tuple[FigureData, ...]:
    heading = attempt("arrays", "overview_heading", _heading_for_overview, flight, answers) or (None, None)
    limits = (known.role(LimitsOfTaxi) or LimitsOfTaxi(GroundLimits())).limits
    general = (
        attempt("arrays", "overview", overview.overview, flight, *heading),
        attempt("arrays", "phases", overview.phase_figure, known.phases),
        attempt("arrays", "gnss_lanes", overview.gnss_lanes, flight, limits.geometry_max),
        attempt("arrays", "state_lanes", overview.state_lanes, flight),
        *(attempt("arrays", "ledger", overview.ledger_figures, flight, given.ledger, gaps) or ()),
    )
    return tuple(figure for figure in general if figure is not None)


def _heading_for_overview(flight: Flight, answers: Answers) -> tuple[NDArray[np.float64] | None, str | None]:
    from groundstation.tables.headings import true_heading

    heading = answer_meeting(answers, HeadingByTrack)
    topic = heading.ins_topic if heading else overview.first_of_kind(flight, "ins", "true_heading_deg")
    topic = topic or overview.first_of_kind(flight, "ins", "magnetic_heading_deg")
    if topic is None:
        return None, None
    try:
        return true_heading(flight, topic).values_deg, topic
    except NotAssessableError:
        return None, None
