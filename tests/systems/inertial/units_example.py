"""Several INS of one made flight with GNSS: errors of the units are Schuler waves that are known."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import curvature_radii_m
from groundstation.systems.inertial.units_track import ReferenceTrack, UnitTrack

SCHULER = 2.0 * np.pi / 5064.0
RADIUS_M = 6.371e6
SECONDS = 3600
Errors = tuple[FloatArray, FloatArray]  # position (n, 2), velocity (n, 2)
Change = Callable[[UnitTrack], UnitTrack]


def drift_of(dph: float, seconds: int = SECONDS) -> Errors:
    """Errors of a gyro with a constant drift, both axes alike."""
    time_s, rate = np.arange(float(seconds)), np.deg2rad(dph / 3600.0)
    velocity = RADIUS_M * rate * (1.0 - np.cos(SCHULER * time_s))
    position = RADIUS_M * rate * (time_s - np.sin(SCHULER * time_s) / SCHULER)
    return np.outer(position, [1.0, 1.0]) / np.sqrt(2.0), np.outer(velocity, [1.0, 1.0]) / np.sqrt(2.0)


def tilt_of(urad: float, seconds: int = SECONDS) -> Errors:
    """Errors of a platform that is tilted at the start."""
    time_s, size = np.arange(float(seconds)), 9.8 / SCHULER * urad * 1e-6
    return (
        np.outer(size / SCHULER * (1.0 - np.cos(SCHULER * time_s)), [0.6, 0.8]),
        np.outer(size * np.sin(SCHULER * time_s), [0.6, 0.8]),
    )


def plus(one: Errors, other: Errors) -> Errors:
    return one[0] + other[0], one[1] + other[1]


def motion(seconds: int = SECONDS) -> tuple[FloatArray, ...]:
    """Time, latitude, longitude, velocity (n, 2) and heading of a stand, a take-off and turns."""
    time_s = np.arange(float(seconds))
    speed = np.clip((time_s - 30.0) * 3.0, 0.0, 200.0)
    heading = np.deg2rad(30.0 + 60.0 * np.sin(2.0 * np.pi * np.maximum(time_s - 120.0, 0.0) / 600.0))
    velocity = np.column_stack([speed * np.cos(heading), speed * np.sin(heading)])
    moved = np.concatenate([np.zeros((1, 2)), np.cumsum(0.5 * (velocity[1:] + velocity[:-1]), axis=0)])
    latitude = 50.0 + np.rad2deg(moved[:, 0] / curvature_radii_m(50.0)[0])
    parallel = curvature_radii_m(latitude)[1] * np.cos(np.deg2rad(latitude))
    east = np.concatenate([[0.0], np.cumsum(np.diff(moved[:, 1]) / (0.5 * (parallel[1:] + parallel[:-1])))])
    return time_s, latitude, 10.0 + np.rad2deg(east), velocity, np.rad2deg(heading) % 360.0


def unit(topic: str, errors: Errors, seed: int, *, start_s: float | None = 0.0) -> UnitTrack:
    """Return a unit with its errors and a noise of 5 mm/s."""
    time_s, latitude, longitude, velocity, heading = motion(len(errors[0]))
    noise = 0.005 * np.random.default_rng(seed).standard_normal(velocity.shape)
    meridian, prime_vertical = curvature_radii_m(latitude)
    return UnitTrack(
        topic,
        time_s,
        latitude + np.rad2deg(errors[0][:, 0] / meridian),
        longitude + np.rad2deg(errors[0][:, 1] / (prime_vertical * np.cos(np.deg2rad(latitude)))),
        np.round(velocity + errors[1] + noise, 3),
        heading_deg=heading,
        kind="unaided",
        start_s=start_s,
    )


def gnss(seconds: int = SECONDS) -> ReferenceTrack:
    time_s, latitude, longitude, velocity, _ = motion(seconds)
    noise = np.random.default_rng(9).standard_normal((seconds, 4))
    return ReferenceTrack(
        "gnss",
        "gnss",
        time_s,
        latitude + 2e-5 * noise[:, 0],
        longitude + 2e-5 * noise[:, 1],
        velocity + 0.03 * noise[:, 2:],
    )


HONEST = (drift_of(0.004), tilt_of(15.0), plus(drift_of(-0.003), tilt_of(-10.0)))


def units(
    number: int, *, bad: Errors | None = None, change: Change | None = None, known: bool = True
) -> list[UnitTrack]:
    """Return honest units, the second with further errors or otherwise changed."""
    names = ["ins", "ins.1", "ins.2"][:number]
    errors = list(HONEST[:number])
    if bad is not None:
        errors[1] = plus(errors[1], bad)
    made = [
        unit(name, one, place, start_s=0.0 if known else None)
        for place, (name, one) in enumerate(zip(names, errors, strict=True))
    ]
    if change is not None:
        made[1] = change(made[1])
    return made


def stepped(metres: float, at: int = 2000) -> Errors:
    position = np.zeros((SECONDS, 2))
    position[at:] = np.array([0.6, 0.8]) * metres
    return position, np.zeros((SECONDS, 2))


def kicked(mps: float, at: int = 2000) -> Errors:
    """Errors behind a step of velocity."""
    after = np.maximum(np.arange(float(SECONDS)) - at, 0.0)
    velocity = np.where(np.arange(SECONDS) >= at, mps * np.cos(SCHULER * after), 0.0)
    return np.outer(mps / SCHULER * np.sin(SCHULER * after), [0.6, 0.8]), np.outer(velocity, [0.6, 0.8])


def swapped(one: UnitTrack) -> UnitTrack:
    return replace(one, velocity_mps=one.velocity_mps[:, ::-1].copy())


def stuck(one: UnitTrack, start: int = 1000, count: int = 120) -> UnitTrack:
    velocity = one.velocity_mps.copy()
    velocity[start : start + count, 0] = velocity[start, 0]
    return replace(one, velocity_mps=velocity)


def still(one: UnitTrack, start: int = 1000, count: int = 60) -> UnitTrack:
    """Return a unit all of whose outputs keep one value for a while."""
    rows = np.arange(len(one.time_s))
    rows[start : start + count] = start
    return replace(
        one,
        velocity_mps=one.velocity_mps[rows],
        latitude_deg=one.latitude_deg[rows],
        longitude_deg=one.longitude_deg[rows],
    )


def without_position(one: UnitTrack) -> UnitTrack:
    nothing = np.full(len(one.time_s), np.nan)
    return replace(one, latitude_deg=nothing, longitude_deg=nothing)
