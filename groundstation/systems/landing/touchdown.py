"""Touchdown: where, how fast, how hard."""

from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.geodesy import continuous_longitude_deg
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import MPS2_PER_G
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.landing.answer import (
    LAST_SINK_S,
    PEAK_S,
    SINK_S,
    RunwayUsed,
    Touchdown,
    TouchdownByStates,
)
from groundstation.systems.landing.finals import Final
from groundstation.systems.landing.geometry import RelativeToRunway, along_and_across, line_through
from groundstation.systems.landing.path import FlightPath, slope

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

LOAD_RANGE_G = (-1.0, 4.0)  # beyond it a sample is a fault of the recorder
SPIKE_G = 1.5  # of one sample against both its neighbours
STEPS = 61  # at which the sink rate of states is taken, every 0.05 s


def touchdown_of(
    flight: "Flight",
    path: FlightPath,
    final: Final,
    runway: RunwayUsed,
    relative: RelativeToRunway,
    estimated: StatesAlongTheFlight | None = None,
) -> Touchdown:
    """Measure the touchdown that a final ends in.

    It is also told by the states of an estimate whose checks hold.
    """
    at_s = final.end.time_s
    places = path.latitude_deg, continuous_longitude_deg(path.longitude_deg)
    latitude, longitude = (float(np.interp(at_s, path.time_s, one)) for one in places)
    longitude = longitude if abs(longitude) <= 180.0 else float(wrap_180(longitude))
    distance_m, _across = along_and_across(np.array([latitude]), np.array([longitude]), runway)
    on_ground = np.arange(relative.rows.start, relative.rows.stop)[~relative.is_final]
    course = None
    if len(on_ground) >= 3 and np.isfinite(path.ground_speed_mps[on_ground]).any():
        course = line_through(path, slice(int(on_ground[0]), int(on_ground[-1]) + 1)).course_deg
    speed_mps = float(np.interp(at_s, path.time_s, path.ground_speed_mps))
    return Touchdown(
        time_s=at_s,
        time_sigma_s=final.end.sigma_s,
        found_by=final.end.found_by,
        latitude_deg=latitude,
        longitude_deg=longitude,
        past_threshold_m=-float(distance_m[0]) if runway.is_surveyed else None,
        ground_speed_mps=speed_mps if np.isfinite(speed_mps) else None,
        sink_rate_mps=_sink_rate(flight, path, at_s),
        peak_load_g=_peak_load(flight, at_s),
        rollout_course_deg=course,
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


def _sink_rate(flight: "Flight", path: FlightPath, at_s: float) -> float | None:
    """Return the sink rate before a touchdown.

    The radio altimeter shows it where there is one, else by the source of the height.
    """
    for topic in topics_of_kind("radio_altimeter", flight.topics()):
        rate = _rate_before(flight.time_s(topic), flight[topic].values("height_m"), at_s)
        if rate is not None:
            return -rate
    rate = _rate_before(path.time_s, path.altitude_m, at_s)
    return None if rate is None else -rate


def _rate_before(time_s: np.ndarray, height_m: np.ndarray, at_s: float) -> float | None:
    window = (time_s >= at_s - SINK_S - 1.0) & (time_s <= at_s) & np.isfinite(height_m)
    if window.sum() < 2:
        return None
    rate = slope(time_s[window], height_m[window], 2.0 * SINK_S)[-1]
    return float(rate) if np.isfinite(rate) else None


def _peak_load(flight: "Flight", at_s: float) -> float | None:
    """Greatest normal acceleration around a touchdown, spikes of single samples left out."""
    for topic in topics_of_kind("ins", flight.topics()):
        if not flight[topic].has("accel_z_mps2"):
            continue
        time_s = flight.time_s(topic)
        load_g = -flight[topic].values("accel_z_mps2") / MPS2_PER_G
        window = (np.abs(time_s - at_s) <= PEAK_S) & (load_g > LOAD_RANGE_G[0]) & (load_g < LOAD_RANGE_G[1])
        load_g = load_g[window]
        if len(load_g) < 3:
            continue
        middle = load_g[1:-1]
        is_spike = np.minimum(np.abs(middle - load_g[:-2]), np.abs(middle - load_g[2:])) > SPIKE_G
        return float(np.max(middle[~is_spike])) if (~is_spike).any() else None
    return None
