"""Canonical topics and fields.

schemas/*.proto is the list; a test holds this module against it.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.words import counted

EVENT_SEPARATOR = ", "  # between the names of events that one record tells of

Kind = Literal["double", "bool", "text"]


@dataclass(frozen=True)
class Field:
    """One field of a canonical topic.

    Parameters
    ----------
    name : str
        ``quantity_..._unit``; no suffix means no unit.
    unit : str
        As in the name: deg, rad, m, mps, dps, mps2, nt, a, dots, mhz, dbhz, s, c, or empty.
    kind : {'double', 'bool', 'text'}
    low, high : float
        Physical range; values outside are findings, not corrected.
    is_heading : bool
        Lives on the circle [0, 360): never averaged or interpolated as a plain number.
    is_single : bool
        Stored in single precision: of a sensor that is sampled fast, whose noise is far above the rounding.
    """

    name: str
    unit: str = ""
    kind: Kind = "double"
    low: float = float("-inf")
    high: float = float("inf")
    is_heading: bool = False
    is_single: bool = False


def _double(name: str, unit: str, low: float = float("-inf"), high: float = float("inf")) -> Field:
    return Field(name, unit, "double", low, high)


def _single(name: str, unit: str, low: float = float("-inf"), high: float = float("inf")) -> Field:
    return Field(name, unit, "double", low, high, is_single=True)


def _heading(name: str) -> Field:
    return Field(name, "deg", "double", 0.0, 360.0, is_heading=True)


def _flag(name: str) -> Field:
    return Field(name, "", "bool")


def _text(name: str) -> Field:
    return Field(name, "", "text")


_POSITION = (
    _double("latitude_deg", "deg", -90.0, 90.0),
    _double("longitude_deg", "deg", -180.0, 180.0),
    _double("altitude_ellipsoid_m", "m", -1_000.0, 100_000.0),
    _double("altitude_msl_m", "m", -1_000.0, 100_000.0),
)
_POSITION_SIGMA = (
    _double("horizontal_sigma_m", "m", 0.0, 100_000.0),
    _double("vertical_sigma_m", "m", 0.0, 100_000.0),
)
_VELOCITY = tuple(_double(f"velocity_{axis}_mps", "mps", -3_000.0, 3_000.0) for axis in ("north", "east", "down"))
_INS = (
    *_POSITION,
    *_VELOCITY,
    _double("roll_deg", "deg", -180.0, 180.0),
    _double("pitch_deg", "deg", -90.0, 90.0),
    _heading("true_heading_deg"),
    _heading("magnetic_heading_deg"),
    *(_double(f"rate_{axis}_dps", "dps", -4_000.0, 4_000.0) for axis in "xyz"),
    *(_double(f"accel_{axis}_mps2", "mps2", -1_000.0, 1_000.0) for axis in "xyz"),
    _text("mode"),
    _flag("valid"),
    _double("ground_speed_mps", "mps", 0.0, 3_000.0),
    *(_double(f"position_{axis}_m", "m", -100_000.0, 100_000.0) for axis in ("north", "east", "down")),
    *(_double(f"{angle}_sigma_deg", "deg", 0.0, 360.0) for angle in ("roll", "pitch", "true_heading")),
    *_POSITION_SIGMA,
    _double("velocity_sigma_mps", "mps", 0.0, 1_000.0),
)
# Standard deviations by axis, beside those that a receiver states for all; that of height is vertical_sigma_m.
_AXIS_SIGMAS = (
    *(_double(f"position_{axis}_sigma_m", "m", 0.0, 100_000.0) for axis in ("north", "east")),
    *(_double(f"velocity_{axis}_sigma_mps", "mps", 0.0, 1_000.0) for axis in ("north", "east", "down")),
)
# Increments over an interval that ends at the time of the record, or rates and specific force at that time.
_IMU = (
    *(_single(f"delta_angle_{axis}_rad", "rad", -100.0, 100.0) for axis in "xyz"),
    *(_single(f"delta_velocity_{axis}_mps", "mps", -1_000.0, 1_000.0) for axis in "xyz"),
    _single("interval_s", "s", 0.0, 10.0),
    _single("velocity_interval_s", "s", 0.0, 10.0),
    *(_single(f"rate_{axis}_dps", "dps", -4_000.0, 4_000.0) for axis in "xyz"),
    *(_single(f"accel_{axis}_mps2", "mps2", -1_000.0, 1_000.0) for axis in "xyz"),
    _flag("is_integral"),
    _single("temperature_c", "c", -100.0, 200.0),
    _single("gyro_clipping", "", 0.0),
    _single("accel_clipping", "", 0.0),
)
# Protection levels by the satellite-based augmentation and by fault detection in the receiver.
_PROTECTION = tuple((axis, by) for axis in ("horizontal", "vertical") for by in ("sbas", "fd"))
_RELATIVE_BEARING = _double("relative_bearing_deg", "deg", -360.0, 360.0)

# Topic kind -> its fields. `ins.1`, `ins.2`, `link.<peer>` are instances of a kind.
TOPICS: Mapping[str, tuple[Field, ...]] = MappingProxyType(
    {
        "ins": _INS,
        "gnss": (
            *_POSITION,
            *_VELOCITY,
            _heading("track_deg"),
            _double("ground_speed_mps", "mps", 0.0, 3_000.0),
            _double("gdop", "", 0.0, 100.0),
            _double("pdop", "", 0.0, 100.0),
            _double("hdop", "", 0.0, 100.0),
            _double("velocity_sigma_mps", "mps", 0.0, 1_000.0),
            _double("satellites_used", "", 0.0, 200.0),
            _text("constellation"),
            _flag("integrity_ok"),
            *_POSITION_SIGMA,
            _text("fix"),
            _double("satellites_tracked", "", 0.0, 200.0),
            _double("cn0_dbhz", "dbhz", 0.0, 100.0),
            _double("age_of_corrections_s", "s", 0.0, 1e6),
            *_AXIS_SIGMAS,
        ),
        "imu": _IMU,
        "onboard": (
            _double("heading_error_deg", "deg", -180.0, 180.0),
            _double("precision_deg", "deg", 0.0, 360.0),
            _double("quality_deg", "deg", 0.0, 360.0),
            _double("cycles", "", 0.0),
            _double("correction_entered_deg", "deg", -180.0, 180.0),
            _text("status"),
        ),
        "magnetometer": tuple(_double(f"field_{axis}_nt", "nt", -1e6, 1e6) for axis in ("forward", "right", "down")),
        "electric": (_double("current_a", "a", -10_000.0, 10_000.0),),
        "baro": (
            _double("pressure_altitude_m", "m", -1_000.0, 100_000.0),
            _double("height_above_airfield_m", "m", -1_000.0, 100_000.0),
        ),
        "air": (
            _double("true_airspeed_mps", "mps", 0.0, 2_000.0),
            _double("wind_north_mps", "mps", -200.0, 200.0),
            _double("wind_east_mps", "mps", -200.0, 200.0),
            _double("indicated_airspeed_mps", "mps", 0.0, 2_000.0),
        ),
        "radio_altimeter": (_double("height_m", "m", -50.0, 10_000.0),),
        "gnss_integrity": (
            *(_double(f"{axis}_protection_{by}_m", "m", 0.0, 100_000.0) for axis, by in _PROTECTION),
            *(_double(f"{axis}_alarm_limit_m", "m", 0.0, 100_000.0) for axis in ("horizontal", "vertical")),
        ),
        "guidance": (
            _double("lateral_deviation_dots", "dots", -1_000.0, 1_000.0),
            _double("vertical_deviation_dots", "dots", -1_000.0, 1_000.0),
            _text("source"),
            _double("frequency_mhz", "mhz", 0.0, 1_000.0),
            _heading("course_magnetic_deg"),
        ),
        "discrete": (_flag("weight_on_wheels"), _double("wheel_speed_mps", "mps", -10.0, 200.0)),
        "configuration": (
            _double("flap_deg", "deg", -10.0, 90.0),
            *(_flag(f"gear_{leg}down") for leg in ("", "nose_", "left_", "right_")),
        ),
        "engine": tuple(_double(f"{name}_share", "", -1.0, 2.0) for name in ("n1", "power", "throttle")),
        "event": (_text("name"), _text("severity")),
        "link": (
            _double("pseudorange_m", "m"),
            _double("transmission_time_s", "s"),
            _double("slot", ""),
            *(_double(f"position_{axis}_m", "m") for axis in "xyz"),
            *(_double(f"covariance_{pair}_m2", "m2") for pair in ("xx", "xy", "xz", "yy", "yz", "zz")),
            _double("rank", ""),
            _RELATIVE_BEARING,
        ),
        "satellite": (_double("pseudorange_m", "m"), *(_double(f"{axis}_m", "m") for axis in "xyz")),
        "adf": (_RELATIVE_BEARING,),
        "odometry": (_double("speed_mps", "mps", -100.0, 100.0), _double("turn_rate_dps", "dps", -4_000.0, 4_000.0)),
        "corrected_heading": (
            _heading("magnetic_heading_deg"),
            _heading("uncorrected_magnetic_heading_deg"),
            _double("deviation_deg", "deg", -180.0, 180.0),
            _heading("true_heading_deg"),
        ),
        "truth": _INS,
    }
)
_FIELD_NAMES = frozenset(field.name for fields in TOPICS.values() for field in fields)
INS_MODES = ("align", "nav", "attitude", "gnss_aided")
FIXES = ("none", "2d", "3d", "dgnss", "rtk_float", "rtk_fixed", "ppp", "gnss_ins", "dead_reckoning", "other")
RAW_PREFIX = "raw."
BUS_PREFIX, BYTES_PREFIX = "raw.bus.", "raw.bytes."  # words and bytes as recorded: no numbers to look at
HOW_TO_NAME = "--icd FILE names them, info --suggest-icd drafts one"  # words of buses


def without_icd(buses: int) -> str:
    """Return that the words of so many bus channels have no names, and what names them."""
    return f"words of {counted(buses, 'bus channel')} without ICD: {HOW_TO_NAME}"


def kind_of(topic: str) -> str:
    """Return the kind of a topic: the part before the first dot.

    Examples
    --------
    >>> kind_of("gnss.2"), kind_of("raw.csv"), kind_of("link.tanker.2")
    ('gnss', 'raw', 'link')
    """
    return topic.partition(".")[0]


def is_canonical(topic: str) -> bool:
    """Tell whether a topic is canonical (``ins``, ``gnss.1``), not ``raw.*`` or unknown.

    Examples
    --------
    >>> is_canonical("ins.2"), is_canonical("raw.ins"), is_canonical("insx")
    (True, False, False)
    """
    return kind_of(topic) in TOPICS


def has_values(topic: str) -> bool:
    """Tell whether the columns of a topic are values.

    Otherwise they are words or bytes that mean something only by an ICD or the like.

    Examples
    --------
    >>> has_values("ins"), has_values("raw.irig_time.1"), has_values("raw.bus.429.7")
    (True, True, False)
    """
    return not topic.startswith((BUS_PREFIX, BYTES_PREFIX))


def field_of(topic: str, name: str) -> Field | None:
    """The canonical field of a topic, None when there is none of that name.

    Examples
    --------
    >>> field_of("gnss.1", "track_deg").unit
    'deg'
    """
    return next((field for field in TOPICS.get(kind_of(topic), ()) if field.name == name), None)


def is_field_name(name: str) -> bool:
    """Tell whether some canonical topic has a field of that name.

    Examples
    --------
    >>> is_field_name("roll_deg"), is_field_name("roll")
    (True, False)
    """
    return name in _FIELD_NAMES


def topics_of_kind(kind: str, topics: "list[str] | tuple[str, ...]") -> tuple[str, ...]:
    """Instances of a kind among ``topics``, the plain one first, then in natural order.

    Examples
    --------
    >>> topics_of_kind("ins", ["gnss", "ins.10", "ins.2", "ins"])
    ('ins', 'ins.2', 'ins.10')
    """
    found = [topic for topic in topics if kind_of(topic) == kind]
    return tuple(sorted(found, key=lambda topic: (len(topic), topic)))
