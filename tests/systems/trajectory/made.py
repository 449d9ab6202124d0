"""Made tracks: a vehicle that rolls through turns, its states with sigmas, and the output of a filter on board."""

from typing import Any

import numpy as np

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.systems.trajectory.onboard_offsets import euler_deg
from groundstation.systems.trajectory.sampling import at_times
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates
from groundstation.tables.table import Flight, Table

LATITUDE_DEG, LONGITUDE_DEG, HEIGHT_M = 55.0, 37.0, 150.0
STEP_S = 0.05


def path(time_s: FloatArray, hovers: bool = False) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Velocities (n, 3), roll, pitch, heading (n, 3) and places (n, 3): north, east, down, of a winding way."""
    speed = np.zeros_like(time_s) if hovers else 12.0 + 5.0 * np.sin(0.05 * time_s)
    heading = 40.0 + 170.0 * np.sin(0.02 * time_s) + 60.0 * np.sin(0.11 * time_s)
    heading = 40.0 + 3.0 * np.sin(0.1 * time_s) if hovers else heading
    heading_rad = np.deg2rad(heading)
    climb = 0.3 * np.sin(0.03 * time_s)
    velocity = np.column_stack([speed * np.cos(heading_rad), speed * np.sin(heading_rad), -climb])
    steps = np.diff(time_s, prepend=time_s[0])[:, None]
    place = np.cumsum(velocity * steps, axis=0)
    attitude = np.column_stack([4.0 * np.sin(0.21 * time_s), 2.0 * np.sin(0.13 * time_s), wrap_360(heading)])
    return velocity, attitude, place


def track(
    length_s: float = 600.0, *, hovers: bool = False, gap_s: tuple[float, float] | None = None, sigma: float = 1.0
) -> TrackOfStates:
    """States every 0.05 s: position to 0.3 m, velocity to 0.03 m/s, tilt to 0.05 deg, heading to 0.15 deg."""
    time_s = np.arange(0.0, length_s, STEP_S)
    velocity, attitude, place = path(time_s, hovers)
    kept = np.ones(len(time_s), dtype=bool) if gap_s is None else (time_s < gap_s[0]) | (time_s > gap_s[1])
    latitude, longitude = degrees(place)
    segment = np.zeros(len(time_s), dtype=np.int64) if gap_s is None else (time_s > gap_s[1]).astype(np.int64)
    shape = (1.0 + 0.5 * np.sin(0.01 * time_s))[:, None] * sigma
    return TrackOfStates(
        time_s=time_s[kept],
        segment=segment[kept],
        latitude_deg=latitude[kept],
        longitude_deg=longitude[kept],
        height_m=(HEIGHT_M - place[:, 2])[kept],
        velocity_mps=velocity[kept],
        roll_deg=attitude[kept, 0],
        pitch_deg=attitude[kept, 1],
        heading_deg=attitude[kept, 2],
        position_sigma_m=(shape * [0.2, 0.25, 0.4])[kept],
        velocity_sigma_mps=(shape * [0.02, 0.02, 0.03])[kept],
        attitude_sigma_deg=(shape * [0.05, 0.05, 0.15])[kept],
    )


def degrees(place_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Latitude and longitude of places north and east of the start."""
    meridian, prime_vertical = curvature_radii_m(LATITUDE_DEG)
    latitude = LATITUDE_DEG + np.rad2deg(place_m[:, 0] / (meridian + HEIGHT_M))
    across = (prime_vertical + HEIGHT_M) * np.cos(np.deg2rad(LATITUDE_DEG))
    return latitude, LONGITUDE_DEG + np.rad2deg(place_m[:, 1] / across)


def onboard(
    of: TrackOfStates,
    *,
    turn: FloatArray | None = None,
    arm_m: tuple[float, float] = (0.0, 0.0),
    delay_s: float = 0.0,
    heading_error_deg: Any = 0.0,
    seed: int = 1,
    **columns: Any,
) -> Flight:
    """A flight with the topic ins: the track, turned, from another place, late, with errors and noise.

    ``heading_error_deg`` is a number or one for each of the rows, 10 in a second; ``columns`` replace fields.
    """
    rng = np.random.default_rng(seed)
    time_s = np.arange(of.time_s[0] + 1.0, of.time_s[-1] - 1.0, 0.1)
    true = at_times(of, time_s - delay_s)
    attitude = np.column_stack([true.roll_deg, true.pitch_deg, true.heading_deg])
    attitude = attitude if turn is None else euler_deg(rotation_n_from_b(attitude) @ turn)
    attitude = attitude + rng.normal(0.0, 0.05, attitude.shape)
    heading = np.deg2rad(true.heading_deg)
    meridian, prime_vertical = curvature_radii_m(true.latitude_deg)
    north = arm_m[0] * np.cos(heading) - arm_m[1] * np.sin(heading) + rng.normal(0.0, 0.05, len(time_s))
    east = arm_m[0] * np.sin(heading) + arm_m[1] * np.cos(heading) + rng.normal(0.0, 0.05, len(time_s))
    across = (prime_vertical + HEIGHT_M) * np.cos(np.deg2rad(true.latitude_deg))
    later, earlier = (at_times(of, time_s - delay_s + part).heading_deg for part in (0.05, -0.05))
    rate = np.deg2rad(wrap_180(later - earlier)) / 0.1
    velocity = true.velocity_mps + rng.normal(0.0, 0.02, (len(time_s), 3))
    velocity[:, 0] -= rate * (arm_m[0] * np.sin(heading) + arm_m[1] * np.cos(heading))
    velocity[:, 1] += rate * (arm_m[0] * np.cos(heading) - arm_m[1] * np.sin(heading))
    fields: dict[str, Any] = {
        "latitude_deg": true.latitude_deg + np.rad2deg(north / (meridian + HEIGHT_M)),
        "longitude_deg": true.longitude_deg + np.rad2deg(east / across),
        "altitude_msl_m": true.height_m - 14.5 + rng.normal(0.0, 0.05, len(time_s)),
        "velocity_north_mps": velocity[:, 0],
        "velocity_east_mps": velocity[:, 1],
        "velocity_down_mps": velocity[:, 2],
        "roll_deg": attitude[:, 0],
        "pitch_deg": attitude[:, 1],
        "true_heading_deg": wrap_360(attitude[:, 2] + heading_error_deg),
        **columns,
    }
    kept = {
        name: Column(np.asarray(values), np.isfinite(values)) for name, values in fields.items() if values is not None
    }
    time_ns = np.round(time_s * NS_PER_S).astype(np.int64)
    table = Table("ins", time_ns, kept, np.arange(len(time_s)), Column(time_ns))
    return flight(table)


def flight(*tables: Table) -> Flight:
    """A flight of some tables that begins at zero."""
    return Flight({table.topic: table for table in tables})
