"""Touchdown: when, where, how fast, how hard."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.geodesy import continuous_longitude_deg
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.landing.answer import RunwayUsed
from groundstation.systems.landing.evidence import SLOWEST_MPS, Evidence, evidence_of
from groundstation.systems.landing.finals import End, Final
from groundstation.systems.landing.geometry import RelativeToRunway, along_and_across, line_through
from groundstation.systems.landing.ground import Ground
from groundstation.systems.landing.path import FlightPath
from groundstation.systems.landing.second_contact import second_contacts
from groundstation.systems.landing.sink import SinkRate, rate_before, sink_rate_of
from groundstation.systems.landing.touchdown_answer import (
    LAST_SINK_S,
    PEAK_S,
    SINK_S,
    Touchdown,
    TouchdownByStates,
)
from groundstation.systems.landing.witnesses import load_of

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

STEPS = 61  # at which the sink rate of states is taken


def with_evidence(flight: "Flight", path: FlightPath, end: End) -> End:
    """Return an end at the time that its witnesses show; as it was where there are none."""
    if not end.touches:
        return end
    evidence = evidence_of(flight, path, end.time_s, end.until_s)
    if evidence is None:
        return end
    return replace(end, time_s=evidence.time_s, sigma_s=evidence.sigma_s, found_by=evidence.found_by, evidence=evidence)


def is_set_down(path: FlightPath, end: End) -> bool:
    """Tell whether the aircraft comes down too slowly to roll: a helicopter, a multicopter."""
    speed_mps = float(np.interp(end.time_s, path.time_s, path.ground_speed_mps))
    return bool(speed_mps < SLOWEST_MPS)


def touchdown_of(
    flight: "Flight",
    path: FlightPath,
    final: Final,
    runway: RunwayUsed,
    relative: RelativeToRunway,
    estimated: StatesAlongTheFlight | None = None,
) -> Touchdown | None:
    """Measure the touchdown that a final ends in; None where nothing rolls.

    It is also told by the states of an estimate whose checks hold.
    """
    if is_set_down(path, final.end):
        return None
    at_s, evidence = final.end.time_s, final.end.evidence
    places = path.latitude_deg, continuous_longitude_deg(path.longitude_deg)
    latitude, longitude = (float(np.interp(at_s, path.time_s, one)) for one in places)
    longitude = longitude if abs(longitude) <= 180.0 else float(wrap_180(longitude))
    distance_m, _across = along_and_across(np.array([latitude]), np.array([longitude]), runway)
    on_ground = np.arange(relative.rows.start, relative.rows.stop)[~relative.is_final]
    course = None
    if len(on_ground) >= 3 and np.isfinite(path.ground_speed_mps[on_ground]).any():
        course = line_through(path, slice(int(on_ground[0]), int(on_ground[-1]) + 1)).course_deg
    speed_mps = float(np.interp(at_s, path.time_s, path.ground_speed_mps))
    speed = speed_mps if np.isfinite(speed_mps) else None
    sink, ground = _sink_rate(path, at_s, evidence), None if evidence is None else _surest_ground(evidence)
    return Touchdown(
        time_s=at_s,
        time_sigma_s=final.end.sigma_s,
        found_by=final.end.found_by,
        time_utc=utc_ns_to_iso(flight.start_ns + round(at_s * NS_PER_S), 1) if flight.has_utc else None,
        confidence95_s=None if evidence is None else evidence.confidence95_s,
        latitude_deg=latitude,
        longitude_deg=longitude,
        past_threshold_m=-float(distance_m[0]) if runway.is_surveyed else None,
        place_sigma_m=None if speed is None else speed * final.end.sigma_s,
        ground_speed_mps=speed,
        sink_rate_mps=None if sink is None else sink.rate_mps,
        sink_rate_sigma_mps=None if sink is None else sink.sigma_mps,
        sink_rate_by="" if sink is None else sink.topic,
        runway_slope=None if ground is None else ground.slope,
        runway_slope_sigma=None if ground is None else ground.slope_sigma,
        peak_load_g=_peak_load(flight, at_s),
        rollout_course_deg=course,
        witnesses=() if evidence is None else evidence.witnesses,
        second_contacts=() if evidence is None else second_contacts(evidence),
        by_states=None if estimated is None else _by_states(estimated, runway, at_s),
    )


def _by_states(estimated: StatesAlongTheFlight, runway: RunwayUsed, at_s: float) -> TouchdownByStates | None:
    """Return the touchdown by the states of the antenna; None where they do not reach to it."""
    states = estimated.states_at_antenna() if estimated.is_reference else None
    if states is None or not len(states):
        return None
    before = states.at(np.linspace(at_s - SINK_S, at_s, STEPS))
    if not np.isfinite(before.velocity_down_mps).all():
        return None
    distance_m, _across = along_and_across(before.latitude_deg[-1:], before.longitude_deg[-1:], runway)
    sigma = before.velocity_down_sigma_mps
    place_m = np.hypot(before.position_north_sigma_m[-1], before.position_east_sigma_m[-1]) / np.sqrt(2.0)
    return TouchdownByStates(
        words=estimated.by_it,
        sink_rate_mps=float(np.mean(before.velocity_down_mps)),
        sink_rate_sigma_mps=float(np.sqrt(np.mean(np.square(sigma)))),
        last_sink_rate_mps=float(np.mean(before.velocity_down_mps[before.time_s >= at_s - LAST_SINK_S])),
        past_threshold_m=-float(distance_m[0]) if runway.is_surveyed else None,
        past_threshold_sigma_m=float(place_m),
    )


def _sink_rate(path: FlightPath, at_s: float, evidence: Evidence | None) -> SinkRate | None:
    """Sink rate by the surest source of the evidence, else by the height of the approach."""
    found = None if evidence is None else sink_rate_of(evidence)
    return found if found is not None else rate_before(path.time_s, path.altitude_m, at_s, path.altitude_source)


def _surest_ground(evidence: Evidence) -> Ground | None:
    """Ground of an altitude, which shows the slope; a height above the ground does not."""
    found = [ground for heights, ground in evidence.heights if ground and not heights.kind.counts_from_ground]
    return min(found, key=lambda one: one.slope_sigma, default=None)


def _peak_load(flight: "Flight", at_s: float) -> float | None:
    """Greatest normal acceleration around a touchdown, spikes of single samples left out."""
    load = load_of(flight, at_s - PEAK_S, at_s + PEAK_S)
    return None if load is None or not len(load.load_g) else float(np.max(load.load_g))
