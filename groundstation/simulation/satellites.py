"""Positions of navigation satellites from published mean elements.

They are on Kepler's ellipse with a turning node and perigee. The elements (orbits/satellites.csv) are real ones of GPS
and GLONASS; the file says whose and of what day. A position is good to some kilometres within weeks of the epoch,
enough for a geometry: simulation and estimator share it.

Source: Vallado, Fundamentals of Astrodynamics and Applications, 4th ed. 2013, sections 2.2 (Kepler's equation), 3.5
(sidereal time, equation 3-45) and 9.6 (secular rates due to J2, equations 9-37 to 9-39).
"""

from functools import cache
from pathlib import Path

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import EARTH_RATE_RADPS, SEMI_MAJOR_M
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S

GRAVITATION_M3PS2 = 3.986004418e14  # WGS-84
J2 = 1.08262668e-3
LIGHT_MPS = 299_792_458.0
NS_PER_DAY = 86_400 * NS_PER_S
J2000_NS = 946_728_000 * NS_PER_S  # 2000-01-01T12:00:00 UTC
KEPLER_STEPS = 12


@dataclass(frozen=True)
class Orbit:
    """Mean elements of one satellite at an epoch.

    Angles are in degrees, the node is counted from the equinox.
    """

    satellite: str
    epoch_utc_ns: int
    inclination_deg: float
    node_deg: float
    eccentricity: float
    perigee_deg: float
    mean_anomaly_deg: float
    revolutions_per_day: float


@cache
def orbits() -> dict[str, Orbit]:
    """The shipped orbits by name: ``GPS-13``, ``GLO-730``."""
    text = Path(__file__).with_name("orbits").joinpath("satellites.csv").read_text(encoding="utf-8")
    rows = [line.split(",") for line in text.splitlines() if line and not line.startswith("#")][1:]
    found = {}
    for name, _catalogue, epoch, *elements in rows:
        found[name] = Orbit(name, iso_to_utc_ns(epoch)[0], *(float(element) for element in elements))
    return found


def orbit_of(name: str) -> Orbit:
    """A shipped orbit.

    Raises
    ------
    SettingsError
        When there is none of that name.
    """
    known = orbits()
    if name not in known:
        raise SettingsError("satellites", repr(name), f"one of {', '.join(known)}")
    return known[name]


def satellite_ecef_m(orbit: Orbit, start_utc_ns: int, time_s: FloatArray) -> FloatArray:
    """Position in ECEF at seconds after a UTC instant, metres, shape (n, 3).

    It ignores periodic perturbations, polar motion, UT1 - UTC.
    """
    since_s = (start_utc_ns - orbit.epoch_utc_ns) / NS_PER_S + time_s
    motion = orbit.revolutions_per_day * 2.0 * np.pi / 86_400.0
    axis = np.cbrt(GRAVITATION_M3PS2 / motion**2)
    eccentricity, cosine_i = orbit.eccentricity, np.cos(np.deg2rad(orbit.inclination_deg))
    rate = 1.5 * motion * J2 * (SEMI_MAJOR_M / (axis * (1.0 - eccentricity**2))) ** 2
    node = np.deg2rad(orbit.node_deg) - rate * cosine_i * since_s
    perigee = np.deg2rad(orbit.perigee_deg) + 0.5 * rate * (5.0 * cosine_i**2 - 1.0) * since_s
    mean = np.deg2rad(orbit.mean_anomaly_deg) + motion * since_s
    eccentric = mean
    for _ in range(KEPLER_STEPS):
        eccentric = mean + eccentricity * np.sin(eccentric)
    along = axis * (np.cos(eccentric) - eccentricity)
    across = axis * np.sqrt(1.0 - eccentricity**2) * np.sin(eccentric)
    radius, argument = np.hypot(along, across), np.arctan2(across, along) + perigee
    right_ascension = node - sidereal_angle_rad(start_utc_ns, time_s)
    x, y = radius * np.cos(argument), radius * np.sin(argument)
    sine_i = np.sin(np.deg2rad(orbit.inclination_deg))
    return np.stack(
        [
            x * np.cos(right_ascension) - y * cosine_i * np.sin(right_ascension),
            x * np.sin(right_ascension) + y * cosine_i * np.cos(right_ascension),
            y * sine_i,
        ],
        axis=-1,
    )


def sidereal_angle_rad(start_utc_ns: int, time_s: FloatArray) -> FloatArray:
    """Greenwich mean sidereal angle, radians, UT1 taken as UTC.

    Examples
    --------
    >>> angle = sidereal_angle_rad(iso_to_utc_ns("1992-08-20T12:14:00Z")[0], np.array([0.0]))
    >>> round(float(np.rad2deg(angle[0]) % 360.0), 4)  # Vallado, example 3-5: 152.578 788 10
    152.5788
    """
    centuries = (start_utc_ns - J2000_NS) / NS_PER_DAY / 36_525.0
    seconds = 67_310.54841 + (876_600.0 * 3600.0 + 8_640_184.812866) * centuries + 0.093104 * centuries**2
    return np.asarray(np.deg2rad(seconds / 240.0 % 360.0) + EARTH_RATE_RADPS * time_s)


def elevation_deg(satellite_m: FloatArray, place_m: FloatArray, down: FloatArray) -> FloatArray:
    """Return the elevation above the horizon, degrees, of positions (..., 3).

    They are seen from a place whose down axis is ``down``.
    """
    line = satellite_m - place_m
    return np.asarray(np.rad2deg(np.arcsin(-(line * down).sum(axis=-1) / np.linalg.norm(line, axis=-1))))


def emission_ecef_m(
    orbit: Orbit, start_utc_ns: int, time_s: FloatArray, receiver_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the satellite's position at emission, and the distance travelled.

    The signal is received at ``time_s``.

    Returns
    -------
    position_m : ndarray, shape (n, 3)
        ECEF of the instant of emission.
    range_m : ndarray, shape (n,)
        Distance in a frame that does not turn: the Earth's rotation while the signal travels is in it.
    """
    flight_s = np.full(len(time_s), 0.07)
    for _ in range(4):
        position = satellite_ecef_m(orbit, start_utc_ns, time_s - flight_s)
        turn = EARTH_RATE_RADPS * flight_s
        turned = np.stack(
            [
                np.cos(turn) * position[:, 0] + np.sin(turn) * position[:, 1],
                np.cos(turn) * position[:, 1] - np.sin(turn) * position[:, 0],
                position[:, 2],
            ],
            axis=-1,
        )
        distance = np.linalg.norm(turned - receiver_m, axis=-1)
        flight_s = distance / LIGHT_MPS
    return position, distance
