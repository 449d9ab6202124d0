"""Moment at which an INS began to navigate, and its proof.

Without it no error rate can be stated.
"""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.findings import Finding
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.methods.ins_noise import GnssNoise
from groundstation.systems.inertial.answer import NavigationStart
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.mode_spans import mode_spans
from groundstation.tables.sources import said_of
from groundstation.tables.table import Flight

NAV_START = "nav_start_utc"  # key of a log's head and of the aircraft file
STAND_S = 30.0  # a standstill is looked for so long
LEAST_STAND_S = 5.0
COMPARED_S = 10.0  # positions are means over so long
STAND_MPS = 0.5  # mean velocity of GNSS below which the aircraft stands
INS_STAND_MPS = 3.0  # the INS's own: its error may be in it
STAND_M = 20.0  # what the INS's position may jump while it stands
MEAN_EPOCHS = 5
LATER_S = 600.0  # after its start an INS is no longer within the noise of GNSS
LONGEST_WAIT_S = 300.0  # for GNSS, over which a velocity error is taken for constant
CALM_MPS = 0.3  # an INS that was just aligned has hardly a velocity error
SIGMAS = 3.0
LONGEST_H = 48.0  # before the log; an older start is a mistyped one
EARTH_M = 6.371e6


@dataclass(frozen=True)
class Stated:
    """Start of navigation as somebody stated it: ISO 8601 text, and who did.

    Empty where nobody did.
    """

    utc: str = ""
    by: str = ""


NOBODY = Stated()


def stated_start(aircraft_utc: str, flight: Flight, ins_topic: str) -> Stated:
    """Start of navigation that the aircraft file, else the head of the log states."""
    if aircraft_utc:
        return Stated(aircraft_utc, "the aircraft file")
    logged = said_of(flight, ins_topic, NAV_START).strip()
    return Stated(logged, "the head of the log") if logged else NOBODY


def navigation_start(
    flight: Flight, compared: InsDifferences, gnss: GnssNoise, stated: Stated = NOBODY
) -> tuple[NavigationStart, tuple[Finding, ...]]:
    """Prove when the INS began to navigate.

    A start that is stated comes first; then the first of a logged change from alignment to navigation and a standstill
    at the beginning of the INS record at which INS and GNSS agree. An INS whose log begins later has drifted for an
    unknown time, and its error over the time in the log is no rate.

    Parameters
    ----------
    flight : Flight
    compared : InsDifferences
    gnss : GnssNoise
        The position sigma, by which INS and GNSS may differ.
    stated : Stated

    Returns
    -------
    NavigationStart
        ``time_s`` None where nothing proves it; ``reason`` says what does, or what is missing.
    findings : tuple of Finding
        A stated start that cannot be used; alignments after the start.
    """
    began_s = np.array(mode_spans(flight, compared.ins_topic).ended_s, dtype=np.float64)
    found, findings = _by_statement(flight, compared, stated)
    if found is not None:
        findings = (*findings, *_set_later(compared, gnss, found))
    else:
        found = _by_standstill(compared, gnss)
        if len(began_s) and (found.time_s is None or began_s[0] <= found.time_s + STAND_S):
            found = NavigationStart(float(began_s[0]), "mode", "its mode changes from align to navigation")
    again_s = began_s[began_s > (compared.epochs.time_s[0] if found.time_s is None else found.time_s)]
    if len(again_s):
        text = "the INS aligned again and navigated on: its errors begin anew there"
        place = f"at {again_s[0]:.1f} s"
        findings = (*findings, Finding("info", "inertial.realigned", text, compared.ins_topic, place, len(again_s)))
    return found, findings


def _by_statement(
    flight: Flight, compared: InsDifferences, stated: Stated
) -> tuple[NavigationStart | None, tuple[Finding, ...]]:
    if not stated.utc:
        return None, ()
    start_s, why_not = 0.0, ""
    first_s, last_s = float(compared.epochs.time_s[0]), float(compared.epochs.time_s[-1])
    try:
        start_s = (iso_to_utc_ns(stated.utc)[0] - flight.start_ns) / NS_PER_S
    except GroundstationError:
        why_not = "it is no ISO 8601 time such as 2026-05-04T06:00:00Z"
    if not why_not and not flight.has_utc:
        why_not = "the flight has no UTC"
    elif start_s >= last_s:
        why_not = "it lies after the flight"
    elif first_s - start_s > LONGEST_H * 3600.0:
        why_not = f"it lies more than {LONGEST_H:.0f} h before the flight"
    if why_not:
        text = f"start of navigation stated by {stated.by} ({NAV_START} = {stated.utc}) is not used: {why_not}"
        return None, (Finding("warn", "inertial.nav_start", text, compared.ins_topic),)
    return NavigationStart(start_s, "stated", f"{stated.by} says {stated.utc}"), ()


def _set_later(compared: InsDifferences, gnss: GnssNoise, stated: NavigationStart) -> tuple[Finding, ...]:
    """Warn where INS and GNSS agree at the begin of a log that is long after the stated start.

    An INS that has navigated for so long is not within the noise of GNSS: its position was set in between.
    """
    both = np.flatnonzero(np.isfinite(compared.epochs.position_m).all(axis=1))
    if not len(both) or stated.time_s is None:
        return ()
    after_s = float(compared.epochs.time_s[both[0]]) - stated.time_s
    apart_m = float(np.hypot(*compared.epochs.position_m[both[0]]))
    if after_s < LATER_S or apart_m > _limit_m(gnss):
        return ()
    text = (
        f"INS and GNSS are {apart_m:.0f} m apart {after_s / 60.0:.0f} min after the stated start of navigation: if the "
        "position of the INS was set in between, its rate counts from there and is larger than told"
    )
    return (Finding("warn", "inertial.nav_start", text, compared.ins_topic),)


def _limit_m(gnss: GnssNoise) -> float:
    """Return the distance by which INS and GNSS may differ by the noise of GNSS alone."""
    return SIGMAS * float(np.hypot(gnss.position_white_m, gnss.position_correlated_m))


def _by_standstill(compared: InsDifferences, gnss: GnssNoise) -> NavigationStart:
    """Return the first standstill at which INS and GNSS agree, or what speaks against it.

    It is at the beginning of the INS record.
    """
    epochs = compared.epochs
    both = np.flatnonzero(np.isfinite(epochs.position_m).all(axis=1))
    if not len(both):
        return _unproven("no GNSS position beside the INS")
    seen_s = float(epochs.time_s[both[0]])
    still_s = _moves_from_s(compared, seen_s + STAND_S)
    limit_m = _limit_m(gnss)
    if still_s - seen_s < LEAST_STAND_S:
        first_m = float(np.hypot(*epochs.position_m[both[0]]))
        is_set = f", {first_m:.0f} m apart, as after its position was set to GNSS" if first_m <= limit_m else ""
        return _unproven(f"the aircraft moves where INS and GNSS are first logged together{is_set}")
    stand = (epochs.time_s >= seen_s) & (epochs.time_s < min(still_s, seen_s + COMPARED_S))
    apart_m = np.nanmean(epochs.position_m[stand], axis=0)
    known = stand & np.isfinite(epochs.velocity_mps).all(axis=1)
    error_mps = np.mean(epochs.velocity_mps[known], axis=0) if known.any() else np.zeros(2)
    # GNSS may come some minutes after the INS: what the velocity error made of the position by then is taken off.
    waited_s = float(np.mean(epochs.time_s[stand])) - float(epochs.time_s[0])
    at_first_m = apart_m - error_mps * waited_s if waited_s <= LONGEST_WAIT_S else apart_m
    nearest_m = min(float(np.hypot(*apart_m)), float(np.hypot(*at_first_m)))
    if nearest_m > limit_m:
        seen_m = float(np.hypot(*apart_m))
        return _unproven(f"at the standstill where the log begins the INS is {seen_m:.0f} m off GNSS already")
    text = f"the log begins at a standstill, with the INS {nearest_m:.0f} m from GNSS"
    speed_mps = float(np.hypot(*error_mps))
    if speed_mps > CALM_MPS:  # an error of velocity that had lasted would show in the position
        text += f"; its velocity is off by {speed_mps:.2f} m/s, for {limit_m / speed_mps:.0f} s at most before"
    return NavigationStart(float(epochs.time_s[0]), "standstill", text)


def _moves_from_s(compared: InsDifferences, end_s: float) -> float:
    """Return the time at which the aircraft first moves, by means over some seconds.

    ``end_s`` where it stands until then.
    """
    rows = compared.epochs.time_s <= end_s
    time_s, velocity = compared.epochs.time_s[rows], compared.velocity_mps[rows]
    by_gnss = velocity - compared.epochs.velocity_mps[rows]
    moves = _mean_speed(velocity) > INS_STAND_MPS
    moves |= _mean_speed(by_gnss) > STAND_MPS
    north, east = compared.latitude_deg[rows], compared.longitude_deg[rows]
    known = np.flatnonzero(np.isfinite(north) & np.isfinite(east))
    if len(known):
        first = known[0]
        along = np.deg2rad(wrap_180(east - east[first])) * np.cos(np.deg2rad(north[first]))
        moved_m = EARTH_M * np.hypot(np.deg2rad(north - north[first]), along)
        moves |= moved_m > STAND_M + INS_STAND_MPS * (time_s - time_s[first])
    return float(time_s[np.argmax(moves)]) if moves.any() else end_s


def _mean_speed(velocity_mps: FloatArray) -> FloatArray:
    """Return the speed of the mean velocity over :data:`MEAN_S` epochs, shape (n,).

    NaN where none of them is known.
    """
    known = np.asarray(np.isfinite(velocity_mps).all(axis=1))
    window = np.ones(MEAN_EPOCHS)
    count = np.convolve(known, window, "same")[: len(known)]
    total = [np.convolve(np.where(known, axis, 0.0), window, "same")[: len(known)] for axis in velocity_mps.T]
    return np.where(count > 0, np.hypot(*total) / np.maximum(count, 1.0), np.nan)


def _unproven(why: str) -> NavigationStart:
    return NavigationStart(None, "unknown", why)
