"""Meaning of the elements of an ICD as canonical signals.

The ICD states a signal (``signal``), or name and unit make it plain.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from groundstation.base.angles import wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.signals import field_of, kind_of
from groundstation.base.units import CONVERSIONS, factor_to
from groundstation.readers.icd.model import Element, FloatArray, Transform

AnyElement = TypeVar("AnyElement", bound=Element)

# Spellings of units in ICDs -> names of base.units; spaces, full stops and capitals do not matter.
_SPELLINGS: Mapping[str, tuple[str, ...]] = {
    "deg": ("degree", "degrees", "°"),
    "rad": ("radian", "radians"),
    "semicircle": ("semicircles", "pirad", "pi"),
    "fps": ("ft/s", "ft/sec", "feet/s", "feet/sec", "f/s"),
    "fps2": ("ft/s^2", "ft/s2", "ft/s/s", "ft/sec^2", "ft/sec2", "ft/sec/sec", "ft/s**2"),
    "fpm": ("ft/min", "ft/mn", "feet/min"),
    "ft": ("feet", "foot"),
    "kt": ("kts", "kn", "knot", "knots"),
    "mps": ("m/s", "m/sec"),
    "kmh": ("km/h", "kph"),
    "mps2": ("m/s^2", "m/s2", "m/s/s", "m/sec^2"),
    "g": ("gs", "g's"),
    "dps": ("deg/s", "deg/sec", "degree/s", "degrees/s", "°/s"),
    "radps": ("rad/s", "rad/sec"),
    "nmi": ("nm", "nauticalmiles"),
    "m": ("meter", "metre", "meters", "metres"),
}
UNITS: Mapping[str, str] = MappingProxyType(
    {name: name for name in CONVERSIONS}
    | {"1": "", "none": "", "n/a": "", "unitless": ""}
    | {spelling: name for name, spellings in _SPELLINGS.items() for spelling in spellings}
)


@dataclass(frozen=True)
class Named:
    """The field that a name stands for, and the sign between them."""

    field: str
    sign: float = 1.0
    transform: Transform = ""


_NAMES: Mapping[str, Named] = MappingProxyType(
    {name: Named(f"{name}_deg") for name in ("latitude", "longitude", "roll", "pitch", "true_heading")}
    | {
        "magnetic_heading": Named("magnetic_heading_deg"),
        "cxz": Named("latitude_deg", transform="asin_deg"),
        "cxz_sine_of_latitude": Named("latitude_deg", transform="asin_deg"),
        "altitude": Named("altitude_msl_m"),
        "inertial_altitude": Named("altitude_msl_m"),
        "altitude_msl": Named("altitude_msl_m"),
        "altitude_ellipsoid": Named("altitude_ellipsoid_m"),
        "velocity_north": Named("velocity_north_mps"),
        "velocity_east": Named("velocity_east_mps"),
        "velocity_down": Named("velocity_down_mps"),
        "velocity_up": Named("velocity_down_mps", -1.0),
        "vertical_speed": Named("velocity_down_mps", -1.0),
        "ground_speed": Named("ground_speed_mps"),
        "track": Named("true_track_deg"),
        "true_track": Named("true_track_deg"),
        "roll_rate": Named("rate_x_dps"),
        "pitch_rate": Named("rate_y_dps"),
        "yaw_rate": Named("rate_z_dps"),
        "body_roll_rate": Named("rate_x_dps"),
        "body_pitch_rate": Named("rate_y_dps"),
        "body_yaw_rate": Named("rate_z_dps"),
        "body_longitudinal_acceleration": Named("accel_x_mps2"),
        "body_lateral_acceleration": Named("accel_y_mps2"),
        "body_normal_acceleration": Named("accel_z_mps2", -1.0),
        "hdop": Named("hdop"),
        "pdop": Named("pdop"),
        "gdop": Named("gdop"),
    }
)
# An inertial system tells its track, which is no canonical field of ``ins``: readers derive the velocities from it.
TRUE_TRACK = "true_track_deg"
_GNSS_WORDS = ("gps", "gnss")


def canonical_factor(unit: str, signal: str) -> float | None:
    """Return the factor from an ICD's unit to that of a canonical signal.

    None when the unit is unknown or of another kind.

    Examples
    --------
    >>> canonical_factor("ft/s", "ins.velocity_north_mps"), canonical_factor("ft/s", "ins.roll_deg")
    (0.3048, None)
    """
    wanted = unit_of(signal)
    name = UNITS.get(unit.lower().replace(" ", "").replace(".", ""))
    return None if wanted is None or name is None else factor_to(name, wanted)


def unit_of(signal: str) -> str | None:
    """Return the unit of a signal that an ICD may feed, empty when it has none.

    None when there is no such signal of numbers.

    Examples
    --------
    >>> unit_of("ins.2.roll_deg"), unit_of("ins.true_track_deg"), unit_of("ins.mode")
    ('deg', 'deg', None)
    """
    topic, _, name = signal.rpartition(".")
    if kind_of(topic) == "ins" and name == TRUE_TRACK:
        return "deg"
    known = field_of(topic, name)
    return None if known is None or known.kind == "text" else known.unit


def by_name(element: AnyElement, holders: Iterable[str]) -> AnyElement:
    """Return the element with the signal that its name and unit imply, else unchanged.

    A name of the holder or its equipment with ``gps`` or ``gnss`` in it makes it ``gnss``, all else is ``ins``.

    Examples
    --------
    >>> by_name(Element("Latitude", "SIGNED32", 90.0, "deg"), ["EGI"]).signal
    'ins.latitude_deg'
    """
    named = _NAMES.get(element.name.strip().lower().replace(" ", "_").replace("-", "_"))
    if named is None:
        return element
    is_gnss = any(word in name.lower() for name in (*holders, element.name) for word in _GNSS_WORDS)
    field = "track_deg" if is_gnss and named.field == TRUE_TRACK else named.field
    signal = f"{'gnss' if is_gnss else 'ins'}.{field}"
    factor = named.sign if named.transform else canonical_factor(element.unit, signal)
    if factor is None or unit_of(signal) is None or is_count(element):
        return element
    sign = 1.0 if named.transform else named.sign
    return replace(element, signal=signal, factor=sign * factor, transform=named.transform, is_by_name=True)


def is_count(element: Element) -> bool:
    """Tell whether an element is a plain count: whole numbers without a scale.

    Its unit says nothing then.

    Examples
    --------
    >>> is_count(Element("Latitude", "SIGNED32", 0.0, "deg")), is_count(Element("Latitude", "FLOAT32_IEEE", 0.0, "deg"))
    (True, False)
    """
    return element.msbval == 0.0 and element.schema != "BCD" and not element.schema.startswith(("FLOAT", "CAPS"))


def signal_values(values: FloatArray, element: Element) -> FloatArray:
    """Values of an element's signal, in its canonical unit, from those of the word.

    NaN where the sine of an angle is beyond 1. Headings and tracks are in [0, 360).

    Examples
    --------
    >>> sine = Element("cxz", "SIGNED32", 1.0, signal="ins.latitude_deg", transform="asin_deg")
    >>> round(float(signal_values(np.array([0.5]), sine)[0]), 9)
    30.0
    """
    if element.transform == "asin_deg":
        sine = np.where(np.abs(values) <= 1.0, values, np.nan)
        values = np.rad2deg(np.arcsin(sine))
    if element.factor != 1.0:
        values = values * element.factor
    return np.asarray(wrap_360(values)) if _is_heading(element) else values


def word_values(values: FloatArray, element: Element) -> FloatArray:
    """Return the values of a word from those of its element's signal.

    The inverse of :func:`signal_values`.
    """
    values = values / element.factor
    return np.asarray(np.sin(np.deg2rad(values))) if element.transform == "asin_deg" else values


def turns_around(element: Element) -> bool:
    """Tell whether the element is an angle with a full scale of half a turn.

    There 180 deg and -180 deg are one.
    """
    unit = CONVERSIONS.get(UNITS.get(element.unit.lower().replace(" ", "").replace(".", ""), "?"))
    return unit is not None and unit[0] == "deg" and abs(2.0 * element.msbval * unit[1] - 180.0) < 1e-9


def _is_heading(element: Element) -> bool:
    topic, _, name = (element.signal or "").rpartition(".")
    known = field_of(topic, name)
    return name == TRUE_TRACK or (known is not None and known.is_heading)
