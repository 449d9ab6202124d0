"""Lesson of one flight: what its stored answers teach of its installation."""

import math
from collections.abc import Mapping
from dataclasses import field
from typing import Any

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.results.answer import Answers, answer_meeting
from groundstation.results.flight import FlightResults
from groundstation.results.installations import Lesson, Measured, as_stored
from groundstation.results.roles import AzimuthByTurns, CompassCoefficients, Delays
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.gates_answer import STILL_TEACHES
from groundstation.systems.heading.installation.settings import (
    MOUNTING_DEG,
    ORDINARY_WIND_MPS,
    STEADY_DEG,
    alignment_sigma_deg,
)
from groundstation.systems.heading.references import REFERENCE_SIGMA_DEG, logged_reference
from groundstation.systems.heading.steady import FACTORS, STATED_AT_MPS

LARGEST = 1e3  # no angle in degrees, no wind in m/s is larger
RUNWAY_CRAB_DEG = 0.3  # of power and wind on the take-off run
LATER_ALIGNMENT = frozenset({"inertial.ins_reset", "inertial.realigned"})  # findings: in flight it is another azimuth


@dataclass(frozen=True)
class Stored:
    """Source of a lesson: the answers of a flight as stored, and who flew when.

    ``stated`` is the user's ``[aircraft]``: its ``ins_serial`` and ``ins_alignment`` stand above those of the log.
    """

    flight_id: str
    metadata: Mapping[str, str]
    start_utc_ns: int | None
    stated: Mapping[str, Any]
    heading: HeadingResult | None
    turns: AzimuthByTurns | None = None
    others: Answers = field(default_factory=dict)
    findings: frozenset[str] = frozenset()

    def said(self, key: str) -> str:
        """Return what is stated under a key, else what the log says."""
        return str(self.stated.get(key) or self.metadata.get(key, "")).strip()


def lesson_of_flight(results: FlightResults, stated: Mapping[str, Any], flight_id: str) -> Lesson:
    """Return the lesson of a flight from its folder; see :func:`lesson_of`."""
    return lesson_of(
        Stored(
            flight_id,
            results.metadata,
            results.start_utc_ns,
            stated,
            results.answer(HeadingResult),
            results.answer_meeting(AzimuthByTurns),
            results.answers,
            frozenset(finding.code for finding in results.findings),
        )
    )


def lesson_of(stored: Stored) -> Lesson:
    """Return the lesson of a flight, its numbers rounded as files have them.

    ``not_taught`` says why it teaches nothing.
    """
    heading, alignment = stored.heading, stored.said("ins_alignment")
    plain = Lesson(
        flight_id=stored.flight_id,
        aircraft=stored.metadata.get("aircraft", "").strip(),
        ins_serial=stored.said("ins_serial"),
        start_utc="" if stored.start_utc_ns is None else utc_ns_to_iso(stored.start_utc_ns),
        alignment=alignment,
        alignment_sigma_deg=alignment_sigma_deg(alignment),
    )
    fields = vars(plain) | ({} if heading is None else _of_heading(heading))
    if heading is not None and fields["number_deg"] is not None:
        fields |= _azimuth(stored, heading) | _reference(stored.metadata, heading)
    fields |= {"not_taught": _why_not(plain, heading), "measured": _measured(stored)}
    return as_stored(Lesson(**fields))


def _measured(stored: Stored) -> tuple[Measured, ...]:
    """Return what a flight says of compass, antenna and GNSS, as far as it observed them."""
    found: list[tuple[str, float | None, float | None]] = []
    magnetic = answer_meeting(stored.others, CompassCoefficients)
    latencies = answer_meeting(stored.others, Delays)
    heading = stored.heading
    if magnetic is not None and magnetic.verdict != "reject":
        found.append(("compass_a_deg", magnetic.coefficients_deg.get("A"), magnetic.coefficients_sigma_deg.get("A")))
    if heading is not None and heading.lever_arm_origin == "estimated":
        found.append(("antenna_arm_m", heading.lever_arm_m, heading.lever_arm_sigma_m))
    if heading is not None and latencies is not None:
        row = latencies.observed(heading.ins_topic, heading.gnss_topic)
        found += [] if row is None else [("gnss_latency_s", row.latency_s, row.sigma_s)]
    return tuple(
        Measured(name, value, sigma)
        for name, value, sigma in found
        if value is not None and sigma is not None and sigma > 0.0 and _is_sound(value, sigma)
    )


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
    if _of_heading(heading)["number_deg"] is None:
        return "numbers of its heading correction are missing"
    named = [gate.name for gate in heading.gates if gate.required and gate.state == "failed"]
    rejecting = [name for name in named if name not in STILL_TEACHES]
    return f"taxi rejected: {', '.join(rejecting)}" if rejecting else ""


def _is_sound(*values: float | None) -> bool:
    """Tell whether stored numbers can be computed with.

    A damaged summary has none, or absurd ones.
    """
    return all(value is None or (math.isfinite(value) and abs(value) <= LARGEST) for value in values)


def _of_heading(heading: HeadingResult) -> dict[str, Any]:
    """Return what the heading correction says, and what was known before it.

    ``number_deg`` is None where the stored answer lacks what a lesson needs.
    """
    low, high = heading.confidence95_deg
    decides = heading.settings.get("whole_decides") is not False
    found: dict[str, Any] = {
        "verdict": heading.verdict,
        "failed": tuple(gate.name for gate in heading.gates if gate.required and gate.state != "passed"),
        "error_deg": heading.error_deg,
        "half_width_deg": 0.5 * (high - low),
        "platform_error_deg": heading.platform_error_deg,
        "limit_deg": _stored_number(heading, "whole_half_width_max_deg") if decides else None,
        "entry_step_deg": heading.entry_step_deg,
        "number_deg": None,
    }
    taxi = next((part for part in heading.interval_parts if part.name == "taxi"), None)
    if heading.mean_direction is None or taxi is None:
        return found
    wind = () if heading.wind is None else (heading.wind.north_mps, heading.wind.east_mps, heading.wind.sigma_mps)
    stored = (heading.error_deg, heading.sideslip_deg, taxi.half_width_deg, low, high, *heading.mean_direction, *wind)
    if not (_is_sound(*stored) and taxi.half_width_deg > 0.0):
        return found
    is_uneven = heading.settings.get("aircraft.taxi_power") == "uneven"
    uneven_deg = _stored_number(heading, "uneven_power_sigma_deg") if is_uneven else None
    return (
        found
        | {
            "number_deg": float(wrap_180(heading.error_deg + (heading.sideslip_deg or 0.0))),
            # that of this flight alone
            "taxi_sigma_deg": math.hypot(taxi.half_width_deg / NORMAL_95, uneven_deg or 0.0),
        }
        | _sideslip(heading, *heading.mean_direction)
        | _steady_and_mounting(heading)
    )


def _stored_number(heading: HeadingResult, *names: str) -> float | None:
    """Return the first number that the settings of an answer have under one of these names."""
    values = (heading.settings.get(name) for name in names)
    return next((float(one) for one in values if isinstance(one, int | float) and not isinstance(one, bool)), None)


def _sideslip(heading: HeadingResult, north: float, east: float) -> dict[str, Any]:
    """Return the crosswind of the taxi and the prior of its factor.

    ``north`` and ``east`` are the mean direction of motion. The wind of a lesson is from the right: minus that from the
    left, by which :mod:`groundstation.systems.heading.steady` counts.
    """
    kind = heading.aircraft_class if heading.aircraft_class in FACTORS else ""
    factor, factor_sigma = next(value for name, value in FACTORS.items() if name == kind)
    stated_deg = _stored_number(heading, "aircraft.sideslip_sigma_deg", "sideslip_sigma_deg")
    if stated_deg is not None:
        factor_sigma = stated_deg / STATED_AT_MPS
    from_right_mps = 0.0
    wind_sigma_mps = _stored_number(heading, "ordinary_wind_mps") or ORDINARY_WIND_MPS
    if heading.wind is not None:
        wind_sigma_mps = heading.wind.sigma_mps
        from_right_mps = heading.wind.north_mps * east - heading.wind.east_mps * north
    elif stated_deg is not None:
        wind_sigma_mps = stated_deg / math.hypot(factor, factor_sigma)
    return {
        "crosswind_mps": from_right_mps,
        "crosswind_sigma_mps": wind_sigma_mps * math.hypot(north, east),
        "aircraft_class": kind,
        "factor": factor,
        "factor_sigma": factor_sigma,
    }


def _steady_and_mounting(heading: HeadingResult) -> dict[str, float]:
    """Return the priors of the mounting and of sideslip the same in every direction."""
    steady = _stored_number(heading, "aircraft.steady_sideslip_sigma_deg", "steady_sideslip_sigma_deg")
    mounting = _stored_number(heading, "aircraft.mounting_sigma_deg")
    return {
        "steady_sigma_deg": STEADY_DEG if steady is None else steady,
        "mounting_deg": _stored_number(heading, "aircraft.mounting_deg") or 0.0,
        "mounting_sigma_deg": MOUNTING_DEG if mounting is None else mounting,
    }


def _azimuth(stored: Stored, heading: HeadingResult) -> dict[str, float]:
    """Return the azimuth error in flight, carried back to the taxi.

    Nothing where the INS was another then.
    """
    turns = stored.turns
    early = None if turns is None or turns.azimuth is None else turns.azimuth.early
    if turns is None or early is None or turns.ins_topic != heading.ins_topic:
        return {}
    entered = None if heading.onboard is None else heading.onboard.correction_entered_deg
    if entered or heading.reference_time_s is None or heading.reference_time_s > early.time_s:
        return {}
    if LATER_ALIGNMENT & stored.findings:
        return {}
    error_deg, sigma_deg = early.at(heading.reference_time_s)
    return {"azimuth_deg": error_deg, "azimuth_sigma_deg": sigma_deg}


def _reference(metadata: Mapping[str, str], heading: HeadingResult) -> dict[str, float]:
    """Return the heading error against the stand, else the runway.

    It has the mounting in it, but no sideslip of taxi.
    """
    shown, reference = heading.parking_ins_heading_deg, heading.reference_parking_heading_deg
    if shown is not None and reference is not None and not heading.steps:
        logged = logged_reference(metadata)
        sigma = max(logged.sigma_deg if logged else 0.0, REFERENCE_SIGMA_DEG)
        return {"reference_deg": float(wrap_180(shown - reference)), "reference_sigma_deg": sigma}
    for runway in heading.runway:
        sigma = math.hypot(runway.sigma_deg, RUNWAY_CRAB_DEG)
        return {"reference_deg": runway.error_deg, "reference_sigma_deg": sigma}
    return {}
