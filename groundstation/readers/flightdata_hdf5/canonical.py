"""Rules that map parameters to canonical fields, with their units and signs.

A topic has the times of its leading parameter, the first of its rules that the file has; the others are interpolated to
them between two neighbouring samples. The samples as recorded stay in ``raw.<parameter>``.
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.signals import Field, field_of
from groundstation.base.units import CONVERSIONS
from groundstation.readers.flightdata_hdf5.container import Container, Parameter

_UNITS: Mapping[str, str] = {
    "kts": "kt",
    "deg/sec": "dps",
    "%": "percent",
}  # units as these files write them -> as base.units does
Way = Literal["plain", "circle", "step"]


@dataclass(frozen=True)
class ParameterRule:
    """Parameter and the field it feeds: ``sign`` times the value.

    ``unit`` counts where the file names none. ``way`` is the way to bring it to another time; ``step`` keeps the last
    sample.
    """

    parameter: str
    field: str
    unit: str
    sign: float = 1.0
    way: Way = "plain"


# Topic -> its rules; of several for one field the first that the file has is taken.
RULES: Mapping[str, tuple[ParameterRule, ...]] = {
    "ins": (
        ParameterRule("Latitude", "latitude_deg", "deg"),
        ParameterRule("Heading True", "true_heading_deg", "deg", way="circle"),
        ParameterRule("Heading True Continuous", "true_heading_deg", "deg", way="circle"),
        ParameterRule("Heading", "magnetic_heading_deg", "deg", way="circle"),
        ParameterRule("Heading Continuous", "magnetic_heading_deg", "deg", way="circle"),
        ParameterRule("Longitude", "longitude_deg", "deg", way="circle"),
        ParameterRule("Pitch", "pitch_deg", "deg"),
        ParameterRule("Roll", "roll_deg", "deg"),
        ParameterRule("Groundspeed", "ground_speed_mps", "kt"),
    ),
    "ins.accelerometer": (ParameterRule("Acceleration Normal", "accel_z_mps2", "g", sign=-1.0),),
    "guidance": (
        # The recorder's localizer is positive with the aircraft left of the course, its glide slope above the path.
        ParameterRule("ILS Localizer", "lateral_deviation_dots", "dots", sign=-1.0),
        ParameterRule("ILS Glideslope", "vertical_deviation_dots", "dots"),
        ParameterRule("ILS (L) Frequency", "frequency_mhz", "MHz", way="step"),
        ParameterRule("ILS Frequency", "frequency_mhz", "MHz", way="step"),
    ),
    "radio_altimeter": (ParameterRule("Altitude Radio", "height_m", "ft"),),
    "radio_altimeter.1": (ParameterRule("Altitude Radio (A)", "height_m", "ft"),),
    "radio_altimeter.2": (ParameterRule("Altitude Radio (B)", "height_m", "ft"),),
    "baro": (
        ParameterRule("Altitude STD", "pressure_altitude_m", "ft"),
        ParameterRule("Altitude AAL", "height_above_airfield_m", "ft"),
    ),
    "air": (
        ParameterRule("Airspeed", "indicated_airspeed_mps", "kt"),
        ParameterRule("Airspeed True", "true_airspeed_mps", "kt"),
    ),
    "discrete": tuple(
        ParameterRule(name, "weight_on_wheels", "", way="step")
        for name in ("Gear On Ground", "Gear (L) On Ground", "Gear (R) On Ground")
    ),
    "discrete.wheel": tuple(
        ParameterRule(f"Wheel Speed{which}", "wheel_speed_mps", "kt")
        for which in ("", " (L)", " (L) (1)", " (R)", " (R) (1)")
    ),
    "configuration": (
        ParameterRule("Flap", "flap_deg", "deg", way="step"),
        ParameterRule("Flap (L)", "flap_deg", "deg", way="step"),
        ParameterRule("Gear Down", "gear_down", "", way="step"),
        ParameterRule("Gear (N) Down", "gear_nose_down", "", way="step"),
        ParameterRule("Gear (L) Down", "gear_left_down", "", way="step"),
        ParameterRule("Gear (R) Down", "gear_right_down", "", way="step"),
    ),
    **{f"engine.{n}": (ParameterRule(f"Eng ({n}) N1", "n1_share", "percent"),) for n in range(1, 5)},
}
TRACK = "Track True"  # gives the velocities of ins, with Groundspeed
# They give the wind of ``air``; the direction is the one the wind blows from.
WIND_FROM, WIND_SPEED = Field("Wind Direction", "deg", is_heading=True), Field("Wind Speed", "mps")
_SAID: Mapping[str, str] = {
    "Heading True Continuous": "counts on past north: brought into [0, 360)",
    "Heading Continuous": "counts on past north: brought into [0, 360)",
    "ILS Localizer": "positive with the aircraft left of the course: the field is its negative",
}


@dataclass(frozen=True, eq=False)
class ParameterFeed:
    """Parameter that feeds a field: value times factor."""

    parameter: Parameter
    field: Field
    factor: float
    way: Way


def feeds_of(container: Container) -> tuple[dict[str, tuple[ParameterFeed, ...]], tuple[tuple[str, str], ...]]:
    """Return feeds by topic, the leading one first, and remarks by topic."""
    by_name = {parameter.name: parameter for parameter in container.parameters}
    feeds: dict[str, tuple[ParameterFeed, ...]] = {}
    remarks: list[tuple[str, str]] = []
    for topic, rules in RULES.items():
        found: dict[str, ParameterFeed] = {}
        for rule in rules:
            parameter = by_name.get(rule.parameter)
            if parameter is None or rule.field in found:
                continue
            factor = _factor(parameter.unit, rule.unit)
            known = field_of(topic, rule.field)
            if factor is None or known is None:
                remarks.append((topic, f"{parameter.name} is in {parameter.unit}, which is no unit of {rule.field}"))
                continue
            found[rule.field] = ParameterFeed(parameter, known, rule.sign * factor, rule.way)
            if rule.parameter in _SAID:
                remarks.append((topic, f"{rule.parameter} {_SAID[rule.parameter]}"))
        if found:
            feeds[topic] = tuple(found.values())
    return feeds, tuple(remarks)


def wind_feeds(container: Container) -> tuple[ParameterFeed, ...]:
    """The parameters that give the wind, direction then speed; nothing where one lacks."""
    found = {one.name: one for one in container.parameters if one.name in (WIND_FROM.name, WIND_SPEED.name)}
    if len(found) < 2:
        return ()
    factor = _factor(found[WIND_SPEED.name].unit, "kt")
    if factor is None or _factor(found[WIND_FROM.name].unit, "deg") != 1.0:
        return ()
    direction = ParameterFeed(found[WIND_FROM.name], WIND_FROM, 1.0, "circle")
    return direction, ParameterFeed(found[WIND_SPEED.name], WIND_SPEED, factor, "plain")


def track_feed(container: Container) -> ParameterFeed | None:
    """The parameter that gives the direction of the velocities, None where there is none."""
    known = field_of("gnss", "track_deg")
    assert known is not None
    found = next((one for one in container.parameters if one.name == TRACK), None)
    return None if found is None or _factor(found.unit, "deg") != 1.0 else ParameterFeed(found, known, 1.0, "circle")


def _factor(unit: str, usual: str) -> float | None:
    """Return the factor from the file's unit to that of the field.

    Where the file names no unit, the usual one counts. None when the unit is of another kind.
    """
    wanted = _UNITS.get(usual, usual)
    found = _UNITS.get(unit, unit) or wanted
    if found == wanted and wanted not in CONVERSIONS:
        return 1.0
    if found not in CONVERSIONS or wanted not in CONVERSIONS or CONVERSIONS[found][0] != CONVERSIONS[wanted][0]:
        return None
    return CONVERSIONS[found][1]


def values_at(feed: ParameterFeed, times_ns: Int64Array) -> tuple[FloatArray, BoolArray]:
    """Return the values of a feed at given times, and where it has one.

    A value between samples needs both neighbours to be valid.
    """
    parameter = feed.parameter
    nothing = np.zeros(len(times_ns)), np.zeros(len(times_ns), dtype=bool)
    if not len(times_ns):
        return nothing
    first = max(parameter.first_from(int(times_ns[0])) - 1, 0)
    last = min(parameter.first_from(int(times_ns[-1])) + 1, parameter.samples)
    if last <= first:
        return nothing
    known_ns = parameter.times_ns(first, last)
    samples = parameter.read(first, last)
    values, is_valid = samples.values, samples.is_valid
    before = np.clip(np.searchsorted(known_ns, times_ns, side="right") - 1, 0, len(known_ns) - 1)
    since_ns = times_ns - known_ns[before]
    if feed.way == "step":
        present = is_valid[before] & (since_ns >= 0) & (since_ns <= 1.5e9 / parameter.frequency_hz)
        return np.where(present, feed.factor * values[before], 0.0), present & np.isfinite(values[before])
    behind = np.clip(np.searchsorted(known_ns, times_ns, side="left"), 0, len(known_ns) - 1)
    present = is_valid[before] & is_valid[behind] & (since_ns >= 0) & (known_ns[behind] >= times_ns)
    difference = values[behind] - values[before]
    if feed.way == "circle":
        difference = wrap_180(difference)
    out = feed.factor * (values[before] + since_ns / np.maximum(known_ns[behind] - known_ns[before], 1) * difference)
    if feed.way == "circle":
        out = wrap_360(out) if feed.field.is_heading else wrap_180(out)
    return np.where(present, out, 0.0), present & np.isfinite(out)
