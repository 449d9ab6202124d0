"""Rules that map fields of record types to canonical fields, and their documented units.

A documented unit is used when the log does not say the unit.
"""

from collections.abc import Iterator, Mapping
from math import isclose
from types import MappingProxyType

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage
from groundstation.base.units import CONVERSIONS
from groundstation.readers.dataflash.definitions import RecordDefinition, Units

# Unit of FMTU -> what it measures, and factor to the canonical unit.
_UNITS: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        **dict.fromkeys(("deg", "degheading", "deglatitude", "deglongitude"), CONVERSIONS["deg"]),
        "rad": CONVERSIONS["rad"],
        "deg/s": CONVERSIONS["dps"],
        "rad/s": CONVERSIONS["radps"],
        "m": CONVERSIONS["m"],
        "m/s": CONVERSIONS["mps"],
        "m/s/s": CONVERSIONS["mps2"],
        "Gauss": CONVERSIONS["gauss"],
        "A": CONVERSIONS["a"],
        "Pa": ("pa", 1.0),
        **dict.fromkeys(("", "satellites"), CONVERSIONS[""]),
    }
)
# The other units of ArduPilot's list, of any version.
_OF_OTHER_FIELDS = frozenset(
    (
        *("Ah", "A.s", "B", "B/s", "deg/s/s", "degC", "Hz", "instance", "l", "l/s", "N", "N.m", "Ohm", "ppm"),
        *("rad/s/s", "rpm", "s", "us", "V", "W", "Watt", "W.h", "W.s", "%"),
    )
)


@dataclass(frozen=True)
class FieldRule:
    """One field of a record type and the canonical field it becomes.

    Parameters
    ----------
    source, field : str
        ``Roll`` of the log, ``roll_deg`` of the canonical topic.
    unit : str
        In which ArduPilot documents it, as FMTU writes units; empty for a count or a ratio.
    multiplier : float
        Of that unit, where the log gives none: 1e-3 for a field logged in milligauss.
    integer_multiplier : float, optional
        The same for a plain integer (old firmware logged hundredths without saying so); None: as ``multiplier``.
    """

    source: str
    field: str
    unit: str = ""
    multiplier: float = 1.0
    integer_multiplier: float | None = None

    def scale(self, definition: RecordDefinition, units: Units) -> float | None:
        """Return the factor from the values of the raw column to the canonical unit.

        None when the log's unit is unknown.

        The unit of FMTU counts if it measures what the field measures. Where it is another of ArduPilot's units, it is
        a slip (HDop in m, the longitude in us, ACC in m/s) and the documented unit counts. A multiplier counts for
        plain integers, and for numbers whose documented unit has one. A scale of the format character is in the values
        already, and firmware that gives a multiplier for floats in SI (3.6 betas: GPS.Spd) logged them without it.

        Source: ArduPilot, libraries/AP_Logger/LogStructure.h and README.md; pull request 8643 (floats of GPS).
        """
        spec, stated = definition.find(self.source), units.of(definition, self.source)
        assert spec is not None
        quantity, factor = _UNITS[self.unit]
        if stated.text in _UNITS:
            stated_quantity, stated_factor = _UNITS[stated.text]
            factor = stated_factor if stated_quantity == quantity else factor
        elif stated.text not in _OF_OTHER_FIELDS:
            return None
        multiplier = self.multiplier
        if spec.divisor is not None:
            return factor * multiplier
        if spec.is_integer and self.integer_multiplier is not None:
            multiplier = self.integer_multiplier
        if stated.multiplier is not None and (spec.is_integer or self.multiplier != 1.0):
            multiplier = stated.multiplier
        return factor * multiplier

    def passed_over(self, definition: RecordDefinition, units: Units) -> float | None:
        """Return the log's multiplier of a float that is not applied; None without one."""
        spec, stated = definition.find(self.source), units.of(definition, self.source).multiplier
        assert spec is not None
        if stated is None or isclose(stated, 1.0) or spec.divisor is not None or spec.is_integer:
            return None
        return stated if self.multiplier == 1.0 else None


class UnknownUnits:
    """Count of values that stay raw because the log gives them an unknown unit."""

    def __init__(self) -> None:
        self._counts: dict[tuple[str, str, str], int] = {}

    def add(self, rule: FieldRule, definition: RecordDefinition, units: Units, count: int, topic: str) -> None:
        """Take in the values of a field in some records."""
        key = (f"{definition.name}.{rule.source}", units.of(definition, rule.source).text, topic)
        self._counts[key] = self._counts.get(key, 0) + count

    def damages(self) -> Iterator[Damage]:
        """Yield one damage for each field; the log's own values are kept."""
        for (source, unit, topic), count in self._counts.items():
            what = f"values of {source} in the unit {unit!r}, which is unknown, kept as raw values alone"
            yield Damage("unreadable_cells", f"raw.{source}", count, what, topic, loses_data=False)


ATTITUDE = (
    FieldRule("Roll", "roll_deg", "deg", integer_multiplier=0.01),
    FieldRule("Pitch", "pitch_deg", "deg", integer_multiplier=0.01),
)
TRUE_YAW = FieldRule("Yaw", "true_heading_deg", "deg", integer_multiplier=0.01)
MAGNETIC_YAW = FieldRule("Yaw", "magnetic_heading_deg", "deg", integer_multiplier=0.01)
POSITION = (
    FieldRule("Lat", "latitude_deg", "deg", integer_multiplier=1e-7),
    FieldRule("Lng", "longitude_deg", "deg", integer_multiplier=1e-7),
    FieldRule("Alt", "altitude_msl_m", "m", integer_multiplier=0.01),
)
VELOCITY = tuple(
    FieldRule(source, f"velocity_{axis}_mps", "m/s")
    for source, axis in (("VN", "north"), ("VE", "east"), ("VD", "down"))
)
RATES = tuple(FieldRule(f"Gyr{axis.upper()}", f"rate_{axis}_dps", "rad/s") for axis in "xyz")
ACCELERATIONS = tuple(FieldRule(f"Acc{axis.upper()}", f"accel_{axis}_mps2", "m/s/s") for axis in "xyz")
GNSS_VELOCITY = (
    FieldRule("Spd", "ground_speed_mps", "m/s", integer_multiplier=0.01),
    FieldRule("GCrs", "track_deg", "deg", integer_multiplier=0.01),
    FieldRule("VZ", "velocity_down_mps", "m/s", integer_multiplier=0.01),
)
SIGMAS = (
    FieldRule("SAcc", "velocity_sigma_mps", "m/s", integer_multiplier=0.01),
    FieldRule("HAcc", "horizontal_sigma_m", "m", integer_multiplier=0.01),
    FieldRule("VAcc", "vertical_sigma_m", "m", integer_multiplier=0.01),
)
GNSS_QUALITY = (FieldRule("HDop", "hdop", integer_multiplier=0.01),)
SATELLITES = (FieldRule("NSats", "satellites_used"),)
FIELD = tuple(
    FieldRule(f"Mag{axis}", f"field_{name}_nt", "Gauss", multiplier=1e-3)
    for axis, name in (("X", "forward"), ("Y", "right"), ("Z", "down"))
)
PRESSURE = FieldRule("Press", "pressure_altitude_m", "Pa")
CURRENT = (FieldRule("Curr", "current_a", "A", integer_multiplier=0.01),)
WIND = (FieldRule("VWN", "wind_north_mps", "m/s"), FieldRule("VWE", "wind_east_mps", "m/s"))
HEIGHT = (FieldRule("Dist", "height_m", "m", integer_multiplier=0.01),)

# Sources of `imu`, best first: the types of increments, of samples, and of samples of the gyros and the accelerometers
# alone, each with those that older firmware logged for further units.
IMU_TYPES: tuple[tuple[tuple[str, ...], ...], ...] = (
    (("IMT", "IMT2", "IMT3"),),
    (("IMU", "IMU2", "IMU3"),),
    (("GYR", "GYR1", "GYR2", "GYR3"), ("ACC", "ACC1", "ACC2", "ACC3")),
)
STATUS_OF = {"1": "4", "2": "4", "6": "9", "7": "9"}  # record of a filter's core -> the record of its status
INCREMENTS = (*(f"DelA{axis}" for axis in "XYZ"), *(f"DelV{axis}" for axis in "XYZ"))
ANGLE_INTERVAL, VELOCITY_INTERVAL, INTERVAL = "DelaT", "DelvT", "DelT"
SAMPLED = "SampleUS"  # of GYR and ACC: when the sample was taken
TEMPERATURE = ("T", "Temp")
FIX_2D, FIX_3D = 2, 3  # states of a receiver
# 0 and 1 no receiver and no fix, 4 with SBAS or DGPS. Source: ArduPilot, libraries/AP_GPS/AP_GPS.h, GPS_Status.
FIXES = np.array(["none", "none", "2d", "3d", "dgnss", "rtk_float", "rtk_fixed", "other"])
MOST_SENSORS = 16  # sensors of one type; a higher instance is damage
# Sensors of one kind in the order in which their topics are numbered; the first group that has records is taken.
SENSOR_TYPES: Mapping[str, tuple[tuple[str, ...], ...]] = MappingProxyType(
    {
        "gnss": (("GPS", "GPS2"),),
        "magnetometer": (("MAG", "MAG2", "MAG3"),),
        "baro": (("BARO", "BAR2", "BAR3"),),
        "electric": (("BAT", "BAT2"), ("CURR", "CUR2")),
        "radio_altimeter": (("RFND",),),
    }
)
