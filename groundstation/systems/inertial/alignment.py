"""Alignment, stand, shutdown and alignments between, of one INS of a flight."""

from contextlib import suppress

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.errors import NotAssessableError
from groundstation.methods.ins_noise import InsNoise, choose_class
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.inertial.alignment_answer import ErrorsAtStart, GroundResult, StandingDrift
from groundstation.systems.inertial.alignment_ends import (
    heading_while_standing,
    realignments_of,
    shutdown_of,
    standing_drift,
    velocities,
)
from groundstation.systems.inertial.alignment_modes import alignment_before
from groundstation.systems.inertial.alignment_stands import GroundMotion, ground_motion
from groundstation.systems.inertial.alignment_start import errors_at_start
from groundstation.systems.inertial.answer import NavigationStart
from groundstation.systems.inertial.differences import VELOCITY_FIELDS, InsDifferences, navigating
from groundstation.systems.inertial.estimate import Estimation
from groundstation.systems.inertial.examine import compared_with_kind
from groundstation.systems.inertial.kind import stated_kind
from groundstation.systems.inertial.mode_spans import mode_spans
from groundstation.systems.inertial.navigation_start import navigation_start, stated_start
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.known import Known
from groundstation.tables.sources import (
    AIDED,
    UNAIDED,
    UNKNOWN,
    Need,
    aided_share,
    choose_source,
    is_mostly_aided,
    said_of,
)
from groundstation.tables.table import Flight, Table

NAME = "ins_ground"
VELOCITIES = Need("ins", "INS velocity", VELOCITY_FIELDS, takes_longest=True)
GNSS = Need("gnss", "GNSS velocity", VELOCITY_FIELDS, takes_longest=True)
NO_START = NavigationStart(None, "unknown", "nothing to compare the INS with")
HELD = "GNSS holds its velocity: it cannot drift"


def ground_result(flight: Flight, known: Known, settings: InertialSettings) -> GroundResult:
    """Describe the INS on the ground.

    Raises
    ------
    NotAssessableError
        Where there is no INS with velocities, or it never navigated.
    """
    compared, kind, start = _against_gnss(flight, known, settings)
    topic = compared.ins_topic if compared is not None else choose_source(flight, VELOCITIES, NAME)
    noise, _ = choose_class(settings.ins_class, known.aircraft.ins_class, said_of(flight, topic, "ins_class"))
    ins, _ = navigating(flight[topic].unique_times())
    if len(ins) < 2 or not ins.has(*VELOCITY_FIELDS):
        raise NotAssessableError(NAME, f"{topic} has no velocities after an alignment")
    gnss = _gnss(flight, compared)
    motion = ground_motion(flight, ins, gnss, known.excluded_s)
    modes = mode_spans(flight, topic)
    before = alignment_before(flight, topic, modes, motion, start, kind, _stated(flight, known, topic))
    start_s = start.time_s
    is_shown = before.basis in ("mode", "still_output") and before.end_s is not None
    if is_shown and (start_s is None or start_s < (before.end_s or 0.0)):  # a flicker of the flag, or no GNSS there
        start_s = before.end_s
    time_s, velocity = velocities(flight, ins)
    is_unaided = kind[0] == UNAIDED
    drift, why_not = _drift(time_s, velocity, motion, start_s, before.end_s, kind[0], noise)
    aligned_s = modes.first_s if before.end_s is None else before.end_s
    later = tuple(one for one in modes.spans_s if one[0] >= aligned_s - 1.0)
    again = realignments_of(later, compared, _heading(known, ins, flight, motion, later), motion, start_s)
    return GroundResult(
        ins_topic=topic,
        gnss_topic="" if gnss is None else gnss.topic,
        kind=kind[0],
        ins_class=noise.name,
        start_s=start_s,
        alignment=before,
        at_start=_at_start(known, compared, settings, start_s) if is_unaided else None,
        standing=drift,
        standing_reason=why_not,
        shutdown=shutdown_of(time_s, velocity, motion, compared, noise, start_s, is_unaided=is_unaided),
        realignments=tuple(one for one in again if one.is_aligned or is_unaided),
        mode_flicker=modes.flicker,
    )


def _against_gnss(
    flight: Flight, known: Known, settings: InertialSettings
) -> tuple[InsDifferences | None, tuple[str, str], NavigationStart]:
    """Return INS minus GNSS, the kind of the INS with the reason, and the start of navigation."""
    estimation = known.workings_of(Estimation)
    if estimation is not None:
        result = estimation.result
        return estimation.compared, (result.kind, result.kind_reason), result.navigation_start or NO_START
    with suppress(NotAssessableError):
        compared, kind = compared_with_kind(flight, known, settings)
        noise, _ = choose_class(
            settings.ins_class, known.aircraft.ins_class, said_of(flight, compared.ins_topic, "ins_class")
        )
        stated = stated_start(known.aircraft.nav_start_utc, flight, compared.ins_topic)
        start, _ = navigation_start(flight, compared, noise.gnss, stated)
        return compared, kind, start
    topic = choose_source(flight, VELOCITIES, NAME)
    stated_as = stated_kind(known.aircraft.ins_kind, {"ins_kind": said_of(flight, topic, "ins_kind")})
    if not stated_as[0]:
        is_aided = is_mostly_aided(flight[topic])
        stated_as = (AIDED, "its mode in the log is gnss_aided") if is_aided else (UNKNOWN, NO_START.reason)
    return None, stated_as, NO_START


def _gnss(flight: Flight, compared: InsDifferences | None) -> Table | None:
    if compared is not None and flight[compared.gnss_topic].has(*VELOCITY_FIELDS):
        return flight[compared.gnss_topic].unique_times()
    with suppress(NotAssessableError):
        return flight[choose_source(flight, GNSS, NAME)].unique_times()
    return None


def _stated(flight: Flight, known: Known, topic: str) -> str:
    return known.aircraft.ins_alignment or said_of(flight, topic, "ins_alignment")


def _drift(
    time_s: FloatArray,
    velocity_mps: FloatArray,
    motion: GroundMotion,
    start_s: float | None,
    aligned_s: float | None,
    kind: str,
    noise: InsNoise,
) -> tuple[StandingDrift | None, str]:
    if kind == AIDED:
        return None, HELD
    judged = noise if start_s is not None else None
    return standing_drift(time_s, velocity_mps, motion.spans(), start_s if start_s is not None else aligned_s, judged)


def _at_start(
    known: Known, compared: InsDifferences | None, settings: InertialSettings, start_s: float | None
) -> ErrorsAtStart | None:
    estimation = known.workings_of(Estimation)
    if compared is None or estimation is None:
        return None
    return errors_at_start(compared, estimation.noise, settings, start_s, estimation.result.azimuth)


def _heading(
    known: Known, ins: Table, flight: Flight, motion: GroundMotion, later: tuple[tuple[float, float], ...]
) -> tuple[FloatArray, FloatArray] | None:
    """Return the heading of the INS less that of the trajectory, else its own near stands."""
    if not ins.has("true_heading_deg") or not later:
        return None
    time_s, heading = flight.seconds(ins.time_ns), ins.values("true_heading_deg")
    best = known.answer_meeting(StatesAlongTheFlight)
    if best is not None and best.is_reference:
        states = best.states_at_antenna()
        if states is not None and len(states.time_s) > 1:
            inside = (time_s >= states.time_s[0]) & (time_s <= states.time_s[-1]) & np.isfinite(heading)
            true = np.rad2deg(np.interp(time_s[inside], states.time_s, np.unwrap(np.deg2rad(states.true_heading_deg))))
            return time_s[inside], np.asarray(wrap_180(heading[inside] - true))
    return heading_while_standing(time_s, heading, motion, later)


def is_alone(flight: Flight, _known: Known) -> bool:
    """Tell whether a flight has an INS of which alignment and shutdown mean something.

    Estimators of autopilots, that GNSS holds and that log no alignment, have none.
    """
    try:
        table = flight[choose_source(flight, VELOCITIES, NAME)]
    except NotAssessableError:
        return False
    return aided_share(table) == 0.0 or bool(mode_spans(flight, table.topic).spans_s)
