"""Layout of a delimited table: canonical field of each column, and form of the time."""

from collections.abc import Callable, Mapping
from dataclasses import field
from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_360
from groundstation.base.atmosphere import SEA_LEVEL_PA, pressure_altitude_m
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column
from groundstation.base.signals import Field

RuleKind = Literal["double", "bool", "text", "raw"]
TimeKind = Literal[
    "seconds", "nanoseconds", "iso", "local", "unix", "gps_week", "time_of_day", "utc_counter", "utc_fraction"
]
Form = Literal["", "dms", "ddmm", "variance"]
Key: TypeAlias = tuple[str, str]  # topic, field
FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class LayoutRule:
    """Rule for one column of a file: its topic, its field, and how its cells are converted.

    Canonical value = number in the cell x ``factor`` + ``offset``.

    Parameters
    ----------
    column : int
        Position in the row.
    topic, field : str
    kind : {'double', 'bool', 'text', 'raw'}
        ``raw`` is settled before reading: float64 where every cell of the file is a number, else text.
    factor, offset : float
        To the unit of the canonical field.
    is_heading : bool
        Values are brought into [0, 360).
    raw : (topic, field), optional
        Where the number in the cell is kept when it is no value of the field.
    form : {'', 'dms', 'variance'}
        Degrees, minutes and seconds in one cell; a square whose root is the number.
    values : tuple of (text, value)
        Value of each text that a cell may hold: number, text or flag by ``kind``; empty: the cell is the value.
    missing : tuple of text
        Texts and numbers that mean no value.
    part : int
        Which of several words of the cell, from 1; 0: the whole cell.
    side : int, optional
        Position of the column whose letters N, S, E or W give the sign.
    """

    column: int
    topic: str
    field: str
    kind: RuleKind
    factor: float = 1.0
    offset: float = 0.0
    is_heading: bool = False
    raw: Key | None = None
    form: Form = ""
    values: tuple[tuple[str, float | str | bool], ...] = ()
    missing: tuple[str, ...] = ()
    part: int = 0
    side: int | None = None

    @property
    def is_parsed(self) -> bool:
        """Tell whether its cells are numbers that the CSV parser itself converts."""
        return self.kind == "double" and self.form not in ("dms", "ddmm") and not self.values and not self.part

    @property
    def key(self) -> Key:
        """Topic and field."""
        return self.topic, self.field

    @property
    def target(self) -> str:
        """Text ``topic.field``, for messages."""
        return f"{self.topic}.{self.field}"


@dataclass(frozen=True)
class TimeRule:
    """Rule for the time of a row: the form in which it is written.

    Parameters
    ----------
    kind : {'seconds', 'nanoseconds', 'iso', 'local', 'unix', 'gps_week', 'time_of_day', 'utc_counter', 'utc_fraction'}
        ``local`` is a date, a time of day and, as third, an offset from UTC in three columns of text. ``gps_week`` is
        week and seconds of the week. The last two are a counter and, behind it, the columns of UTC in whole seconds:
        the counter runs on, or begins anew with each second.
    columns : tuple of int
        Positions of one column, or of date, time and (optionally) offset.
    names : tuple of str
        Their names, for messages.
    digits, multiple : int
        The unit is ``10**digits`` x ``multiple`` nanoseconds, for ``seconds``.
    date_formats : tuple of str
        strptime formats tried in turn, for ``local``.
    weeks : int
        Weeks to add, where the week rolled over.
    day_ns : int
        Beginning of the first row's day, for ``time_of_day``.
    modulus_ns : int
        Nanoseconds after which a counter beside UTC begins anew; 0: it does not.
    """

    kind: TimeKind
    columns: tuple[int, ...]
    names: tuple[str, ...]
    digits: int = 9
    multiple: int = 1
    date_formats: tuple[str, ...] = ()
    weeks: int = 0
    day_ns: int = 0
    modulus_ns: int = 0


@dataclass(frozen=True)
class DerivationMethod:
    """Method that derives fields from others.

    It states the names and units of its inputs, what it gives, and the text for the user.
    """

    inputs: tuple[str, ...]
    units: tuple[str, ...]
    function: Callable[..., tuple[FloatArray, ...]]
    outputs: tuple[str, ...]
    text: str


@dataclass(frozen=True)
class Derivation:
    """Fields of a topic that the reader computes row by row from other fields.

    Each input is multiplied by its entry of ``factors`` (1 where empty).

    A zero of an input that is named in ``not_zero`` is no value.
    """

    method: str
    topic: str
    outputs: tuple[str, ...]
    inputs: tuple[Key, ...]
    factors: tuple[float, ...] = ()
    not_zero: tuple[Key, ...] = ()


@dataclass(frozen=True)
class TableLayout:
    """Layout of a table: time, columns, derived fields.

    ``missing`` are texts that mean no value in any column.
    """

    time: TimeRule
    rules: tuple[LayoutRule, ...]
    derivations: tuple[Derivation, ...] = ()
    decimal_comma: bool = False
    metadata: Mapping[str, str] = field(default_factory=dict)
    missing: tuple[str, ...] = ()


def true_from_magnetic(magnetic_deg: FloatArray, variation_deg: FloatArray) -> tuple[FloatArray, ...]:
    """Return true direction, degrees in [0, 360): magnetic + declination, east positive.

    Examples
    --------
    >>> float(true_from_magnetic(np.array([359.0]), np.array([2.0]))[0][0])
    1.0
    """
    return (np.asarray(wrap_360(magnetic_deg + variation_deg)),)


def velocity_from_track(track_deg: FloatArray, speed_mps: FloatArray) -> tuple[FloatArray, ...]:
    """Return velocities north and east from true track and ground speed.

    Examples
    --------
    >>> [round(float(part[0]), 9) for part in velocity_from_track(np.array([90.0]), np.array([50.0]))]
    [0.0, 50.0]
    """
    with np.errstate(invalid="ignore", over="ignore"):  # an infinite direction or speed gives NaN
        track_rad = np.deg2rad(track_deg)
        return speed_mps * np.cos(track_rad), speed_mps * np.sin(track_rad)


def wind_from_direction(from_deg: FloatArray, speed_mps: FloatArray) -> tuple[FloatArray, ...]:
    """Return the wind velocity north and east of a wind direction and speed.

    The direction is true, and the one the wind blows from.

    Examples
    --------
    >>> [round(float(part[0]), 9) for part in wind_from_direction(np.array([270.0]), np.array([10.0]))]
    [0.0, 10.0]
    """
    north, east = velocity_from_track(from_deg, speed_mps)
    return -north, -east


def pressure_altitude(indicated_m: FloatArray, setting_inhg: FloatArray) -> tuple[FloatArray, ...]:
    """Return altitude above 1013.25 hPa from one indicated with another altimeter setting.

    The altitude of the setting in the standard atmosphere is added to the indicated altitude; 1013.25 hPa are 29.92126
    inHg.

    Examples
    --------
    >>> float(pressure_altitude(np.array([100.0]), np.array([29.92126]))[0][0])
    100.0
    >>> round(float(pressure_altitude(np.array([0.0]), np.array([28.92126]))[0][0]), 1)  # 979.39 hPa
    285.8
    """
    setting_altitude_m, _is_refused = pressure_altitude_m(setting_inhg / 29.92126 * SEA_LEVEL_PA)
    return (indicated_m + setting_altitude_m,)


def degrees_of(degrees_deg: FloatArray, minutes_deg: FloatArray, seconds_deg: FloatArray) -> tuple[FloatArray, ...]:
    """Return an angle from degrees, which have the sign (-0 too), minutes and seconds.

    Examples
    --------
    >>> float(degrees_of(np.array([-0.0]), np.array([30.0 / 60.0]), np.array([0.0]))[0][0])
    -0.5
    """
    return (np.copysign(np.abs(degrees_deg) + np.abs(minutes_deg) + np.abs(seconds_deg), degrees_deg),)


def root_of_squares(one: FloatArray, other: FloatArray) -> tuple[FloatArray, ...]:
    """Return the root of the sum of squares: the horizontal sigma of two.

    Examples
    --------
    >>> float(root_of_squares(np.array([3.0]), np.array([4.0]))[0][0])
    5.0
    """
    return (np.hypot(one, other),)


def attitude_of_quaternion(x: FloatArray, y: FloatArray, z: FloatArray, w: FloatArray) -> tuple[FloatArray, ...]:
    """Return roll, pitch and heading of a quaternion.

    It turns axes forward, left, up into east, north, up.

    Examples
    --------
    A turn of 90 degrees about the vertical, from east to north:

    >>> half = np.array([np.sqrt(0.5)])
    >>> [round(float(one[0]), 9) for one in attitude_of_quaternion(0.0 * half, 0.0 * half, half, half)]
    [0.0, -0.0, 0.0]
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.sqrt(x * x + y * y + z * z + w * w)
        x, y, z, w = x / size, y / size, z / size, w / size
        roll = np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        pitch = -np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))
        east_to_nose = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return np.rad2deg(roll), np.rad2deg(pitch), np.asarray(wrap_360(90.0 - np.rad2deg(east_to_nose)))


METHODS: Mapping[str, DerivationMethod] = MappingProxyType(
    {
        "true_from_magnetic": DerivationMethod(
            ("magnetic", "variation"), ("deg", "deg"), true_from_magnetic, (), "magnetic direction plus variation"
        ),
        "velocity_from_track": DerivationMethod(
            ("track", "speed"),
            ("deg", "mps"),
            velocity_from_track,
            ("velocity_north_mps", "velocity_east_mps"),
            "true track and ground speed",
        ),
        "wind_from_direction": DerivationMethod(
            ("direction", "speed"),
            ("deg", "mps"),
            wind_from_direction,
            ("wind_north_mps", "wind_east_mps"),
            "the direction the wind blows from and its speed",
        ),
        "pressure_altitude": DerivationMethod(
            ("indicated", "setting"),
            ("m", "inhg"),
            pressure_altitude,
            ("pressure_altitude_m",),
            "indicated altitude and altimeter setting",
        ),
        "from_degrees_minutes_seconds": DerivationMethod(
            ("degrees", "minutes", "seconds"), ("deg", "deg", "deg"), degrees_of, (), "degrees, minutes and seconds"
        ),
        "horizontal_sigma": DerivationMethod(
            ("north", "east"), ("m", "m"), root_of_squares, (), "the sigmas north and east"
        ),
        "velocity_sigma": DerivationMethod(
            ("north", "east"), ("mps", "mps"), root_of_squares, (), "the sigmas of the velocity north and east"
        ),
        "attitude_from_quaternion": DerivationMethod(
            ("x", "y", "z", "w"),
            ("", "", "", ""),
            attitude_of_quaternion,
            ("roll_deg", "pitch_deg", "true_heading_deg"),
            "a quaternion, taken as one that turns forward, left, up into east, north, up",
        ),
    }
)


def number_of(text: str) -> float | None:
    """Return the finite number that a text states, None where it is none.

    Examples
    --------
    >>> number_of("9999"), number_of("N/A"), number_of("nan")
    (9999.0, None, None)
    """
    try:
        number = float(text)
    except ValueError:
        return None
    return number if np.isfinite(number) else None


def rule_for(
    column: int, topic: str, known: Field, factor: float = 1.0, offset: float = 0.0, raw: Key | None = None
) -> LayoutRule:
    """Return the rule that feeds a canonical field from a column."""
    return LayoutRule(column, topic, known.name, known.kind, factor, offset, known.is_heading, raw)


def apply(derivation: Derivation, known: Mapping[Key, Column]) -> dict[Key, Column]:
    """Return the columns that a derivation adds: present where all its inputs are.

    A column of the file is not filled from others where it is empty: a Garmin G5 without a fix writes no velocity
    beside a speed of 150 kt.
    """
    inputs = [known[key] for key in derivation.inputs]
    masks = [column.mask for column in inputs]
    masks += [known[key].values != 0.0 for key in derivation.not_zero]
    present = np.logical_and.reduce(masks)
    factors = derivation.factors or (1.0,) * len(inputs)
    with np.errstate(over="ignore", invalid="ignore"):  # absurd numbers become infinite or NaN
        values = [np.where(present, one.values * factor, np.nan) for one, factor in zip(inputs, factors, strict=True)]
        results = METHODS[derivation.method].function(*values)
    found = {
        (derivation.topic, name): Column(np.asarray(result), present)
        for name, result in zip(derivation.outputs, results, strict=True)
    }
    return {key: column for key, column in found.items() if key not in known}
