"""Which fields of which record types become canonical fields, and in what unit they are when the log does not say."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from groundstation.base.signals import field_of
from groundstation.base.units import CONVERSIONS, DEG_PER_RAD, NT_PER_GAUSS
from groundstation.readers.dataflash.definitions import Definition, Units

# Unit of FMTU -> unit of a profile.
_NAMES = {
    **dict.fromkeys(("deg", "degheading", "deglatitude", "deglongitude"), "deg"),
    "rad": "rad",
    "deg/s": "dps",
    "rad/s": "radps",
    "m": "m",
    "m/s": "mps",
    "m/s/s": "mps2",
    "Gauss": "gauss",
    "A": "a",
}
# Unit of FMTU -> unit of a canonical field and factor.
_FACTORS = {name: CONVERSIONS[unit] for name, unit in _NAMES.items()}


@dataclass(frozen=True)
class Rule:
    """One field of a record type and the canonical field it becomes.

    Parameters
    ----------
    source, field : str
        ``Roll`` of the log, ``roll_deg`` of the canonical topic.
    factor : float
        To the canonical unit, where the log gives no unit.
    integer_factor : float, optional
        The same for a plain integer (old firmware logged hundredths without saying so); None: as ``factor``.
    """

    source: str
    field: str
    factor: float = 1.0
    integer_factor: float | None = None

    def scale(self, topic: str, definition: Definition, units: Units) -> float:
        """Factor from the values of the raw column to the canonical unit; the log's own unit comes first."""
        spec, known = definition.find(self.source), field_of(topic, self.field)
        assert spec is not None and known is not None
        unit = units.of(definition, self.source)
        kind, factor = _FACTORS.get(unit.text, ("", 0.0))
        if unit.multiplier and kind == known.unit:
            further = unit.multiplier * (spec.divisor or 1.0)  # the multiplier is that of the stored number
            return factor if abs(further - 1.0) < 1e-6 else further * factor
        if spec.is_integer and self.integer_factor is not None:
            return self.integer_factor
        return self.factor


ATTITUDE = (
    Rule("Roll", "roll_deg", integer_factor=0.01),
    Rule("Pitch", "pitch_deg", integer_factor=0.01),
)
TRUE_YAW = Rule("Yaw", "true_heading_deg", integer_factor=0.01)
MAGNETIC_YAW = Rule("Yaw", "magnetic_heading_deg", integer_factor=0.01)
POSITION = (
    Rule("Lat", "latitude_deg", integer_factor=1e-7),
    Rule("Lng", "longitude_deg", integer_factor=1e-7),
    Rule("Alt", "altitude_msl_m", integer_factor=0.01),
)
VELOCITY = tuple(
    Rule(source, f"velocity_{axis}_mps") for source, axis in (("VN", "north"), ("VE", "east"), ("VD", "down"))
)
RATES = tuple(Rule(f"Gyr{axis.upper()}", f"rate_{axis}_dps", DEG_PER_RAD) for axis in "xyz")
ACCELERATIONS = tuple(Rule(f"Acc{axis.upper()}", f"accel_{axis}_mps2") for axis in "xyz")
GNSS_VELOCITY = (
    Rule("Spd", "ground_speed_mps", integer_factor=0.01),
    Rule("GCrs", "track_deg", integer_factor=0.01),
    Rule("VZ", "velocity_down_mps", integer_factor=0.01),
)
GNSS_QUALITY = (Rule("HDop", "hdop", integer_factor=0.01),)
SATELLITES = (Rule("NSats", "satellites_used"),)
FIELD = tuple(
    Rule(f"Mag{axis}", f"field_{name}_nt", NT_PER_GAUSS * 1e-3)
    for axis, name in (("X", "forward"), ("Y", "right"), ("Z", "down"))
)
CURRENT = (Rule("Curr", "current_a", integer_factor=0.01),)
WIND = (Rule("VWN", "wind_north_mps"), Rule("VWE", "wind_east_mps"))
HEIGHT = (Rule("Dist", "height_m", integer_factor=0.01),)

MOST_SENSORS = 16  # of one type; another instance is damage
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
EVENTS: Mapping[int, str] = MappingProxyType(
    {
        10: "armed",
        11: "disarmed",
        15: "auto armed",
        16: "take-off",
        17: "land complete maybe",
        18: "land complete",
        19: "GPS lost",
        25: "home set",
        28: "not landed",
        41: "fence enabled",
        42: "fence disabled",
        49: "parachute disabled",
        50: "parachute enabled",
        51: "parachute released",
        52: "landing gear deployed",
        53: "landing gear retracted",
        54: "motors emergency stopped",
        55: "motors emergency stop cleared",
        60: "EKF altitude reset",
        62: "EKF yaw reset",
    }
)
_PLANE = (
    *("MANUAL", "CIRCLE", "STABILIZE", "TRAINING", "ACRO", "FBWA", "FBWB", "CRUISE", "AUTOTUNE", "", "AUTO", "RTL"),
    *("LOITER", "TAKEOFF", "AVOID_ADSB", "GUIDED", "INITIALISING", "QSTABILIZE", "QHOVER", "QLOITER", "QLAND", "QRTL"),
    *("QAUTOTUNE", "QACRO", "THERMAL"),
)
_COPTER = (
    *(
        "STABILIZE",
        "ACRO",
        "ALT_HOLD",
        "AUTO",
        "GUIDED",
        "LOITER",
        "RTL",
        "CIRCLE",
        "",
        "LAND",
        "",
        "DRIFT",
        "",
        "SPORT",
    ),
    *("FLIP", "AUTOTUNE", "POSHOLD", "BRAKE", "THROW", "AVOID_ADSB", "GUIDED_NOGPS", "SMART_RTL", "FLOWHOLD", "FOLLOW"),
    *("ZIGZAG", "SYSTEMID", "AUTOROTATE", "AUTO_RTL"),
)
MODES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"ArduPlane": _PLANE, "APM:Plane": _PLANE, "ArduCopter": _COPTER, "APM:Copter": _COPTER}
)
