"""Touchdown: where, how fast, how hard."""

from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.geodesy import continuous_longitude_deg
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import MPS2_PER_G
from groundstation.systems.landing.answer import PEAK_S, SINK_S, RunwayUsed, Touchdown
from groundstation.systems.landing.finals import Final
from groundstation.systems.landing.geometry import RelativeToRunway, along_and_across, line_through
from groundstation.systems.landing.path import FlightPath, slope

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

LOAD_RANGE_G = (-1.0, 4.0)  # beyond it a sample is a fault of the recorder
SPIKE_G = 1.5  # of one sample against both its neighbours


def touchdown_of(
    flight: "Flight", path: FlightPath, final: Final, runway: RunwayUsed, relative: RelativeToRunway
) -> Touchdown:
    """Measure the touchdown that a final ends in."""
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
        past_threshold_m=-float(distance_m[0]) if runway.placed_by == "site file" else None,
        ground_speed_mps=speed_mps if np.isfinite(speed_mps) else None,
        sink_rate_mps=_sink_rate(flight, path, at_s),
        peak_load_g=_peak_load(flight, at_s),
        rollout_course_deg=course,
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
