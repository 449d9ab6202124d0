"""System 2 as analyses: errors of the INS, and their forecast replayed on the flight."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.methods.ins_noise import choose_class
from groundstation.methods.roles import InsKinds
from groundstation.results.answer import Answers, answer_of
from groundstation.systems.analysis import Analysis, Found, RestsOn, Shortfall, main_numbers
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.cause_answer import CausesResult
from groundstation.systems.inertial.columns import CAUSES_COLUMNS, FORECAST_COLUMNS, INERTIAL_COLUMNS, UNITS_COLUMNS
from groundstation.systems.inertial.drift_answer import sentence as unaided_sentence
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.inertial.judged_answer import judged_filter
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units_answer import UnitsResult
from groundstation.systems.known import AircraftData, Known
from groundstation.tables.phases import Phases

if TYPE_CHECKING:
    from groundstation.systems.inertial.estimate import Estimation
    from groundstation.tables.table import Flight

FIELDS = ("latitude_deg", "longitude_deg", "velocity_north_mps", "velocity_east_mps")


def take_off_s(phases: Phases) -> float:
    """Return the flight time of the first lift-off.

    0 for a log that begins in the air or never leaves the ground.
    """
    airborne = np.flatnonzero(phases.phase == "airborne")
    return float(phases.start_s[airborne[0]]) if airborne.size else 0.0


def _run(flight: "Flight", known: Known, settings: InertialSettings) -> Found[InertialResult]:
    from groundstation.systems.inertial.aided import compare_aided
    from groundstation.systems.inertial.estimate import estimate_compared
    from groundstation.systems.inertial.examine import compared_with_kind
    from groundstation.tables.sources import UNAIDED

    compared, kind = compared_with_kind(flight, known, settings)
    if kind[0] != UNAIDED:
        return Found(
            *compare_aided(flight, kind, settings=settings, excluded_s=known.excluded_s, answers=known.answers)
        )
    aircraft = known.aircraft
    found = estimate_compared(
        flight,
        compared,
        kind,
        settings=settings,
        aircraft_class=aircraft.ins_class,
        nav_start_utc=aircraft.nav_start_utc,
    )
    return Found(found.result, found.findings, found)


def _examine(flight: "Flight", known: Known, settings: InertialSettings) -> tuple[Shortfall, ...]:
    from groundstation.systems.inertial.examine import examine_inertial

    return examine_inertial(flight, known, settings)


def _gives(flight: "Flight", known: Known, settings: InertialSettings) -> tuple[str, ...]:
    from groundstation.systems.inertial.gives import given_by

    return given_by(flight, known, settings)


def _run_units(flight: "Flight", known: Known, settings: InertialSettings) -> Found[UnitsResult]:
    from groundstation.systems.inertial.units_findings import compare_units

    return Found(*compare_units(flight, known, settings))


def _has_several_units(flight: "Flight", _known: Known) -> bool:
    from groundstation.systems.inertial.units_log import unit_topics

    return len(unit_topics(flight)) > 1


def _units_rest_on(flight: "Flight", result: UnitsResult) -> RestsOn:
    topics = (*(one.topic for one in result.units), *((result.against,) if result.against in flight else ()))
    times = [flight.time_s(topic) for topic in topics]
    return RestsOn(topics, FIELDS, ((min(float(one[0]) for one in times), max(float(one[-1]) for one in times)),))


def _units_sentence(answers: Answers) -> str:
    units = answer_of(answers, UnitsResult)
    return "" if units is None or units.verdict not in ("off", "one_of") else units.sentence


def _ins_kinds(known: Known) -> InsKinds:
    from groundstation.systems.inertial.examine import offered

    return offered(known)


def _estimated(known: Known, analysis: str) -> "Estimation":
    """Return the estimated errors of the INS.

    NotAssessableError where it is not unaided, with what says so.
    """
    from groundstation.systems.inertial.estimate import Estimation
    from groundstation.systems.inertial.kind import WHY_NOT
    from groundstation.tables.sources import AIDED

    estimation = known.workings_of(Estimation)
    if estimation is not None:
        return estimation
    inertial = known.answer(InertialResult)
    says = WHY_NOT[AIDED if inertial is None else inertial.kind]
    why = f" ({inertial.kind_reason})" if inertial is not None else ""
    judged = None if inertial is None else judged_filter(known.answers, inertial.ins_topic)
    left = "its errors are not estimated" if judged is None else f"its errors are known {judged.by}, none grows"
    raise NotAssessableError(analysis, f"{says}{why}: {left}")


def _run_causes(_flight: "Flight", known: Known, _settings: InertialSettings) -> Found[CausesResult]:
    from groundstation.systems.inertial.causes import assess_causes

    found = _estimated(known, "ins_causes")
    start = found.result.navigation_start
    return Found(assess_causes(found.compared, found.run, None if start is None else start.time_s))


def _run_forecast(_flight: "Flight", known: Known, settings: InertialSettings) -> Found[ForecastResult]:
    from groundstation.systems.inertial.forecast import assess_forecast

    estimation = _estimated(known, "forecast")
    phases = known.phases
    return Found(assess_forecast(estimation, settings=settings, phase_of=phases.at, take_off_s=take_off_s(phases)))


def _check(settings: InertialSettings, aircraft: AircraftData) -> None:
    choose_class(settings.ins_class, aircraft.ins_class)


def _rests_on(flight: "Flight", result: InertialResult) -> RestsOn:
    topics = (result.ins_topic, result.gnss_topic)
    both = [flight.time_s(topic) for topic in topics]
    return RestsOn(topics, FIELDS, ((max(float(time[0]) for time in both), min(float(time[-1]) for time in both)),))


def _is_forecast_expected(_flight: "Flight", known: Known) -> bool:
    """Tell whether a forecast is expected.

    For an INS that GNSS corrects, or may correct, a finding says already that a forecast means nothing.
    """
    inertial = known.answer(InertialResult)
    return inertial is None or inertial.kind == "unaided"


def _sentence(answers: Answers) -> str:
    inertial = answer_of(answers, InertialResult)
    if inertial is None:
        return ""
    if inertial.kind != "unaided":
        position = inertial.difference("position")
        says = "INS corrected by GNSS" if inertial.kind == "gnss_aided" else "INS perhaps corrected by GNSS"
        within = "" if position is None else f", within {position.p95:.1f} m of it (95 %)"
        left = inertial.worst_departure
        judged = judged_filter(answers, inertial.ins_topic)
        if left is not None:
            of, told = inertial.filter_of_ins, "" if judged is None else f"; {judged.sentence}"
            return f"{of.title} and GNSS {left.apart}apart for {left.end_s - left.start_s:.0f} s{of.use}{told}"
        return f"{says}{within}{': no errors, no forecast' if judged is None else f'; {judged.sentence}'}"
    return unaided_sentence(answers)


def _is_main_of_forecast(path: str, saved: tuple[Mapping[str, Any], ...]) -> bool:
    """Tell the main numbers: the default methods, and the errors of each."""
    parts = path.split(".")
    if parts[0] != "skill" or len(parts) == 1:
        return path == "default_method"
    return parts[1] in {str(one.get("default_method")) for one in saved} and parts[-1] == "rms_m"


INERTIAL = Analysis(
    name="inertial",
    title="INS errors estimated against GNSS, two channels of six states (Neusypin et al. 2003)",
    subject="INS errors",
    needs="ins and gnss positions (velocities too if logged), five minutes of both together",
    settings=InertialSettings,
    answer=InertialResult,
    run=_run,
    builds_on=("trajectory",),
    rests_on=_rests_on,
    sentence=_sentence,
    check=_check,
    columns=INERTIAL_COLUMNS,
    examine=_examine,
    gives=_gives,
    offers={InsKinds: _ins_kinds},
    is_main=main_numbers(
        r"kind|radial_error_rate_(fit|\d\d)_nmiph|velocity_error_rms_mps|azimuth\.error_deg"
        r"|(north|east)\.states\.[^.]+\.value"
    ),
)
FORECAST = Analysis(
    name="forecast",
    title="forecast of the INS errors without GNSS, replayed throughout the flight",
    subject="forecast of INS errors",
    page_title="Forecast without GNSS",
    needs="what inertial needs, of an INS that GNSS does not correct; a calibration needs one Schuler period",
    settings=InertialSettings,
    answer=ForecastResult,
    run=_run_forecast,
    table="inertial",
    requires=("inertial",),
    is_expected=_is_forecast_expected,
    columns=FORECAST_COLUMNS,
    is_main=_is_main_of_forecast,
)
CAUSES = Analysis(
    name="ins_causes",
    title="errors of an unaided INS by cause: Schuler, drift, azimuth, body axes, straight legs",
    subject="INS errors by cause",
    needs="what inertial needs, of an INS that GNSS does not correct, with velocities of both",
    settings=InertialSettings,
    answer=CausesResult,
    run=_run_causes,
    table="inertial",
    requires=("inertial",),
    is_expected=_is_forecast_expected,
    columns=CAUSES_COLUMNS,
    is_main=main_numbers(r"start_(mps|tilt_arcsec)\.value|parameters\.mean_drift_(north|east)\.value"),
)
UNITS = Analysis(
    name="ins_units",
    title="several INS of one flight: each against GNSS, in pairs, and which one is off",
    subject="several INS",
    needs="two INS or more; GNSS or the best trajectory tells which is off, else three units do",
    settings=InertialSettings,
    answer=UnitsResult,
    run=_run_units,
    table="inertial",
    builds_on=("inertial", "trajectory"),
    applies=_has_several_units,
    rests_on=_units_rest_on,
    sentence=_units_sentence,
    columns=UNITS_COLUMNS,
    is_main=main_numbers(r"verdict|units\.[^.]+\.(rate_fit_nmiph|velocity_rms_mps)\.value"),
)
