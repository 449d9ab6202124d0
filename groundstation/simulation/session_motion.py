"""True motion of the aircraft of a session.

It is straight flight and turns at constant speed and height.
"""

from functools import lru_cache

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.ecef import ecef_from_n, ecef_m, geodetic_deg_m
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import frozen
from groundstation.simulation.session_scenario import SessionAircraft, SessionPoint, SessionScenario


@dataclass(frozen=True)
class AircraftMotion:
    """One aircraft at the times of a fine grid.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    position_m : ndarray, shape (n, 3)
        Frame of the session.
    velocity_mps : ndarray, shape (n, 3)
        North, east, down.
    track_deg : ndarray, shape (n,)
        Not wrapped.
    axes : ndarray, shape (n, 3, 3)
    latitude_deg : ndarray, shape (n,)
        NaN in a local frame.
    """

    time_s: FloatArray
    position_m: FloatArray
    velocity_mps: FloatArray
    track_deg: FloatArray
    axes: FloatArray
    latitude_deg: FloatArray

    def __post_init__(self) -> None:
        for name in ("time_s", "position_m", "velocity_mps", "track_deg", "axes", "latitude_deg"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def grid_s(scenario: SessionScenario) -> FloatArray:
    """Times of the fine grid: one for each slot of the link."""
    count = round(scenario.duration_s / scenario.link.slot_s) + 1
    return np.asarray(scenario.link.slot_s * np.arange(count), dtype=np.float64)


@lru_cache(maxsize=64)  # motion has no randomness: the runs of a study share it
def fly(scenario: SessionScenario, aircraft: SessionAircraft) -> AircraftMotion:
    """Fly one aircraft over the grid of times.

    Displacements of a step are those of an arc of a circle, exact in the plane; in the global frame they are laid on
    the ellipsoid at the mid-latitude of the step, which is good to a millimetre in a minute.
    """
    time_s = grid_s(scenario)
    track_deg = _track_deg(aircraft, time_s)
    track_rad = np.deg2rad(track_deg)
    velocity = np.zeros((len(time_s), 3))
    velocity[:, 0], velocity[:, 1] = aircraft.speed_mps * np.cos(track_rad), aircraft.speed_mps * np.sin(track_rad)
    half_turn_rad = 0.5 * np.diff(track_rad)
    chord_m = aircraft.speed_mps * np.diff(time_s) * np.sinc(half_turn_rad / np.pi)
    middle_rad = track_rad[:-1] + half_turn_rad
    step = np.stack([chord_m * np.cos(middle_rad), chord_m * np.sin(middle_rad)])
    if scenario.frame == "local":
        moved = np.concatenate([np.zeros((2, 1)), np.cumsum(step, axis=1)], axis=1)
        position = np.stack(
            [aircraft.north_m + moved[0], aircraft.east_m + moved[1], np.full(len(time_s), -aircraft.height_m)], axis=-1
        )
        axes = np.broadcast_to(np.eye(3), (len(time_s), 3, 3)).copy()
        return AircraftMotion(time_s, position, velocity, track_deg, axes, np.full(len(time_s), np.nan))
    latitude, longitude = _over_the_ellipsoid(scenario, aircraft, step)
    position = ecef_m(latitude, longitude, aircraft.height_m)
    return AircraftMotion(time_s, position, velocity, track_deg, ecef_from_n(latitude, longitude), latitude)


def _track_deg(aircraft: SessionAircraft, time_s: FloatArray) -> FloatArray:
    track = np.full(len(time_s), aircraft.track_deg)
    for turn in aircraft.turns:
        track += turn.rate_dps * np.clip(time_s - turn.at_s, 0.0, turn.duration_s)
    return track


def _over_the_ellipsoid(
    scenario: SessionScenario, aircraft: SessionAircraft, step: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Latitude and longitude, degrees, from steps north and east in metres."""
    first, _, _ = geodetic_deg_m(place_m(scenario, aircraft))
    _, longitude_0, _ = geodetic_deg_m(place_m(scenario, aircraft))
    latitude = np.concatenate([[float(first)], np.zeros(step.shape[1])])
    for k, north in enumerate(step[0].tolist()):
        meridian, _ = curvature_radii_m(latitude[k])
        middle, _ = curvature_radii_m(latitude[k] + np.rad2deg(0.5 * north / (meridian + aircraft.height_m)))
        latitude[k + 1] = latitude[k] + np.rad2deg(north / (middle + aircraft.height_m))
    middle_deg = 0.5 * (latitude[1:] + latitude[:-1])
    _, normal = curvature_radii_m(middle_deg)
    moved = np.rad2deg(step[1] / ((normal + aircraft.height_m) * np.cos(np.deg2rad(middle_deg))))
    longitude = float(longitude_0) + np.concatenate([[0.0], np.cumsum(moved)])
    return latitude, longitude


def place_m(scenario: SessionScenario, one: SessionAircraft | SessionPoint) -> FloatArray:
    """Return the start of an aircraft, or the place of a point, shape (3,).

    It is in the frame of the session. In the global frame north and east are counted along the ellipsoid from the
    origin.
    """
    if scenario.frame == "local":
        return np.array([one.north_m, one.east_m, -one.height_m])
    meridian, _ = curvature_radii_m(scenario.latitude_deg)
    latitude = scenario.latitude_deg + np.rad2deg(one.north_m / float(meridian))
    _, normal = curvature_radii_m(latitude)
    longitude = scenario.longitude_deg + np.rad2deg(one.east_m / (float(normal) * np.cos(np.deg2rad(latitude))))
    return ecef_m(latitude, longitude, one.height_m)
