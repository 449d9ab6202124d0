"""System 2 in the pipeline: the errors of the INS, and the forecast of them replayed on the flight."""

from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.estimators.inertial.settings import InertialSettings
from groundstation.results.figures import FigureData
from groundstation.results.flight import NotAssessable
from groundstation.results.forecast import ForecastResult
from groundstation.results.inertial import InertialResult
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight


@dataclass(frozen=True)
class InertialAnswers:
    """What system 2 has to say of a flight; the reasons where it has nothing."""

    inertial: InertialResult | None = None
    forecast: ForecastResult | None = None
    findings: tuple[Finding, ...] = ()
    not_assessable: tuple[NotAssessable, ...] = ()

    @property
    def figures(self) -> tuple[FigureData, ...]:
        """Arrays of both."""
        return tuple(figure for part in (self.inertial, self.forecast) if part is not None for figure in part.figures)


def analyse_inertial(
    flight: Flight,
    phases: Phases,
    settings: InertialSettings,
    *,
    aircraft_class: str = "",
    excluded_s: tuple[tuple[float, float], ...] = (),
) -> InertialAnswers:
    """Run system 2; never raises for what the flight lacks.

    Parameters
    ----------
    flight : Flight
    phases : Phases
    settings : InertialSettings
    aircraft_class : str
        INS class of the aircraft file.
    excluded_s : tuple of (float, float)
        Flight seconds in which the user does not want GNSS to be used.
    """
    from groundstation.estimators.inertial.estimate import estimate_ins_errors
    from groundstation.estimators.inertial.forecast import assess_forecast

    try:
        found = estimate_ins_errors(flight, settings=settings, aircraft_class=aircraft_class, excluded_s=excluded_s)
    except NotAssessableError as error:
        return _without("inertial", "INS errors", error)
    answers = InertialAnswers(found.result, findings=found.findings)
    try:
        forecast = assess_forecast(found, settings=settings, phase_of=phases.at, take_off_s=take_off_s(phases))
    except NotAssessableError as error:
        lacking = _without("forecast", "forecast of INS errors", error)
        findings = answers.findings
        if not any(finding.code == "inertial.gnss_aided" for finding in findings):  # that finding says it already
            findings += lacking.findings
        return replace(answers, findings=findings, not_assessable=lacking.not_assessable)
    return replace(answers, forecast=forecast)


def take_off_s(phases: Phases) -> float:
    """Flight time of the first lift-off; 0 for a log that begins in the air or never leaves the ground."""
    airborne = np.flatnonzero(phases.phase == "airborne")
    return float(phases.start_s[airborne[0]]) if airborne.size else 0.0


def _without(analysis: str, title: str, error: NotAssessableError) -> InertialAnswers:
    reason = str(error).removeprefix(f"{analysis}: ")
    finding = Finding("info", f"{analysis}.not_assessable", f"{title} not assessable: {reason}")
    return InertialAnswers(findings=(finding,), not_assessable=(NotAssessable(analysis, reason),))
