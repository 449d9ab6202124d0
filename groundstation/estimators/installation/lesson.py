"""From the stored answers of one flight to what it teaches of its installation."""

import math
from collections.abc import Mapping
from typing import Any

from groundstation.base.angles import wrap_180
from groundstation.base.normal import NORMAL_95
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.estimators.heading.references import REFERENCE_SIGMA_DEG, logged_reference
from groundstation.estimators.heading.steady import FACTORS, STATED_AT_MPS
from groundstation.estimators.heading.verdict import CURED_BY_MORE_DATA, STANDSTILL_GATE
from groundstation.estimators.installation.settings import (
    MOUNTING_DEG,
    ORDINARY_WIND_MPS,
    STEADY_DEG,
    alignment_sigma_deg,
)
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult
from groundstation.results.inertial import InertialResult
from groundstation.results.installation import Lesson

RUNWAY_CRAB_DEG = 0.3  # of power and wind on the take-off run
LATER_ALIGNMENT = frozenset({"inertial.ins_reset", "inertial.realigned"})  # findings: in flight it is another azimuth
# Gates whose failure leaves the interval by this taxi alone as honest as it was: it is wide, or the standstill noisy.
STILL_TEACHES = CURED_BY_MORE_DATA | {STANDSTILL_GATE, "skewness", "kurtosis", "normal_distance", "variance_ratio"}


def lesson_of(results: FlightResults, stated: Mapping[str, Any], flight_id: str = "") -> Lesson:
    """What a flight teaches, from what it stored; ``not_taught`` says why it teaches nothing.

    Parameters
    ----------
    results : FlightResults
    stated : mapping
        The user's ``[aircraft]``: ``ins_serial`` and ``ins_alignment`` of it stand above those of the log.
    flight_id : str
        Name of its folder, where that differs.
    """

    def said(key: str) -> str:
        return str(stated.get(key) or results.metadata.get(key, "")).strip()

    start_ns = results.start_utc_ns
    plain = Lesson(
        flight_id=flight_id or results.flight_id,
        aircraft=results.metadata.get("aircraft", "").strip(),
        ins_serial=said("ins_serial"),
        start_utc="" if start_ns is None else utc_ns_to_iso(start_ns),
        alignment=said("ins_alignment"),
        alignment_sigma_deg=alignment_sigma_deg(said("ins_alignment")),
    )
    heading = results.answer(HeadingResult)
    fields = vars(plain) | ({} if heading is None else _of_heading(heading))
    if heading is not None and fields["number_deg"] is not None:
        fields |= _azimuth(results, heading) | _reference(results, heading)
    return Lesson(**(fields | {"not_taught": _why_not(plain, heading)}))


def _why_not(plain: Lesson, heading: HeadingResult | None) -> str:
    if not plain.ins_serial:
        return "no INS serial: state ins_serial in the aircraft file"
    if not plain.aircraft:
        return "no aircraft named: a mounting is that of a unit in an aircraft"
    if not plain.start_utc:
        return "no UTC: it has no place among the flights of its serial"
    if heading is None:
        return "no heading error found"
    if heading.mean_direction is None:
        return "saved by an older version: run the log again"
    named = [gate.name for gate in heading.gates if gate.required and gate.state == "failed"]
    rejecting = [name for name in named if name not in STILL_TEACHES]
    return f"taxi rejected: {', '.join(rejecting)}" if rejecting else ""


def _of_heading(heading: HeadingResult) -> dict[str, Any]:
    """What the heading correction says, and what was known before it."""
    settings = heading.settings

    def number(name: str) -> float | None:
        value = settings.get(name)
        return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None

    low, high = heading.confidence95_deg
    deciding = number("whole_half_width_max_deg") if settings.get("whole_decides") is not False else None
    found: dict[str, Any] = {
        "verdict": heading.verdict,
        "failed": tuple(gate.name for gate in heading.gates if gate.required and gate.state != "passed"),
        "error_deg": heading.error_deg,
        "half_width_deg": 0.5 * (high - low),
        "platform_error_deg": heading.platform_error_deg,
        "limit_deg": deciding,
        "entry_step_deg": heading.entry_step_deg,
    }
    taxi = next((part for part in heading.interval_parts if part.name == "taxi"), None)
    if heading.mean_direction is None or taxi is None:
        return found
    kind = heading.aircraft_class if heading.aircraft_class in FACTORS else ""
    factor, factor_sigma = next(value for name, value in FACTORS.items() if name == kind)
    sideslip = number("aircraft.sideslip_sigma_deg")
    sideslip = number("sideslip_sigma_deg") if sideslip is None else sideslip
    if sideslip is not None:
        factor_sigma = sideslip / STATED_AT_MPS
    north, east = heading.mean_direction
    wind_sigma = number("ordinary_wind_mps") or ORDINARY_WIND_MPS
    crosswind = 0.0
    if heading.wind is not None:
        wind_sigma = heading.wind.sigma_mps
        crosswind = heading.wind.north_mps * east - heading.wind.east_mps * north
    elif sideslip is not None:
        wind_sigma = sideslip / math.hypot(factor, factor_sigma)
    steady, mounting = number("aircraft.steady_sideslip_sigma_deg"), number("aircraft.mounting_sigma_deg")
    steady = number("steady_sideslip_sigma_deg") if steady is None else steady
    return found | {
        "number_deg": float(wrap_180(heading.error_deg + (heading.sideslip_deg or 0.0))),
        "taxi_sigma_deg": taxi.half_width_deg / NORMAL_95,
        "crosswind_mps": crosswind,
        "crosswind_sigma_mps": wind_sigma * math.hypot(north, east),
        "aircraft_class": kind,
        "factor": factor,
        "factor_sigma": factor_sigma,
        "steady_sigma_deg": STEADY_DEG if steady is None else steady,
        "mounting_deg": number("aircraft.mounting_deg") or 0.0,
        "mounting_sigma_deg": MOUNTING_DEG if mounting is None else mounting,
    }


def _azimuth(results: FlightResults, heading: HeadingResult) -> dict[str, float]:
    """Azimuth error in flight, carried back to the taxi; nothing where the INS was another then."""
    inertial = results.answer(InertialResult)
    early = None if inertial is None or inertial.azimuth is None else inertial.azimuth.early
    if inertial is None or early is None or inertial.ins_topic != heading.ins_topic:
        return {}
    entered = None if heading.onboard is None else heading.onboard.correction_entered_deg
    if entered or heading.reference_time_s is None or heading.reference_time_s > early.time_s:
        return {}
    if LATER_ALIGNMENT & {finding.code for finding in results.findings}:
        return {}
    error_deg, sigma_deg = early.at(heading.reference_time_s)
    return {"azimuth_deg": error_deg, "azimuth_sigma_deg": sigma_deg}


def _reference(results: FlightResults, heading: HeadingResult) -> dict[str, float]:
    """Heading error against the stand, else the runway: mounting in it, but no sideslip of taxi."""
    shown, reference = heading.parking_ins_heading_deg, heading.reference_parking_heading_deg
    if shown is not None and reference is not None and not heading.steps:
        logged = logged_reference(results.metadata)
        sigma = max(logged.sigma_deg if logged else 0.0, REFERENCE_SIGMA_DEG)
        return {"reference_deg": float(wrap_180(shown - reference)), "reference_sigma_deg": sigma}
    for runway in heading.runway:
        sigma = math.hypot(runway.sigma_deg, RUNWAY_CRAB_DEG)
        return {"reference_deg": runway.error_deg, "reference_sigma_deg": sigma}
    return {}
