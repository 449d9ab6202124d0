"""Errors of positions, velocities and angles against the reference: estimate - reference."""

from collections.abc import Mapping
from dataclasses import fields, replace
from types import MappingProxyType

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import Int64Array, frozen
from groundstation.base.units import NS_PER_S
from groundstation.systems.reference.settings import ReferenceSettings
from groundstation.tables.resample import join
from groundstation.tables.table import Table

POSITION = ("latitude_deg", "longitude_deg")
HEIGHTS = ("altitude_ellipsoid_m", "altitude_msl_m")
VELOCITY = ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps")
ANGLES = ("roll_deg", "pitch_deg", "true_heading_deg")
SIGMAS = (
    *("horizontal_sigma_m", "vertical_sigma_m", "velocity_sigma_mps"),
    *("roll_sigma_deg", "pitch_sigma_deg", "true_heading_sigma_deg"),
)
FIELDS = (*POSITION, *HEIGHTS, *VELOCITY, *ANGLES, *SIGMAS)


@dataclass(frozen=True)
class Errors:
    """Errors of one subject at n times, NaN where it or the reference is absent.

    Parameters
    ----------
    subject : str
    time_s : ndarray, shape (n,)
        Flight seconds, by the clock of the log.
    position_m : ndarray, shape (n, 3)
        North, east, up.
    velocity_mps : ndarray, shape (n, 3)
        North, east, up.
    angles_deg : ndarray, shape (n, 3)
        Roll, pitch, heading; differences in [-180, 180).
    place_m : ndarray, shape (n, 2)
        Of the reference, north and east of where it first is in the log.
    motion_mps : ndarray, shape (n, 2)
        Velocity of the reference, north and east; from its positions where it has none.
    heading_deg : ndarray, shape (n,)
        Of the reference's nose, else the direction of its motion.
    claimed, reference : mappings of sigma to ndarray, shape (n,)
        One-sigma errors that subject and reference claim of themselves; those of :data:`SIGMAS` that they have.
    """

    subject: str
    time_s: FloatArray
    position_m: FloatArray
    velocity_mps: FloatArray
    angles_deg: FloatArray
    place_m: FloatArray
    motion_mps: FloatArray
    heading_deg: FloatArray
    claimed: Mapping[str, FloatArray]
    reference: Mapping[str, FloatArray]

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, frozen(value))
            elif isinstance(value, Mapping):
                kept = MappingProxyType({name: frozen(column) for name, column in value.items()})
                object.__setattr__(self, item.name, kept)

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def horizontal_m(self) -> FloatArray:
        """Length of the horizontal position error, shape (n,)."""
        return np.asarray(np.hypot(self.position_m[:, 0], self.position_m[:, 1]))

    def along_cross(self, north_east: FloatArray, moving_mps: float) -> tuple[FloatArray, FloatArray]:
        """Resolve north and east (n, 2) along the reference's motion and to its right.

        NaN where it hardly moves.
        """
        speed = np.hypot(*self.motion_mps.T)
        with np.errstate(invalid="ignore", divide="ignore"):
            north, east = np.where(speed > moving_mps, self.motion_mps.T / speed, np.nan)
        return (
            north_east[:, 0] * north + north_east[:, 1] * east,
            north_east[:, 1] * north - north_east[:, 0] * east,
        )

    def without_arm(self, forward_m: float, right_m: float) -> "Errors":
        """Return the errors of the subject moved to the reference's point.

        The lever arm is in body axes.
        """
        position, velocity = self.position_m.copy(), self.velocity_mps.copy()
        turned = turned_arm(self.heading_deg, forward_m, right_m)
        known = np.isfinite(turned).all(axis=1)
        position[known, :2] -= turned[known]
        velocity[:, :2] -= np.nan_to_num(_rate(turned, self.time_s))
        return replace(self, position_m=position, velocity_mps=velocity)


def turned_arm(heading_deg: FloatArray, forward_m: float, right_m: float) -> FloatArray:
    """A level arm in body axes turned north and east, shape (n, 2)."""
    cosine, sine = np.cos(np.deg2rad(heading_deg)), np.sin(np.deg2rad(heading_deg))
    return np.stack([forward_m * cosine - right_m * sine, forward_m * sine + right_m * cosine], axis=1)


def _rate(values: FloatArray, time_s: FloatArray) -> FloatArray:
    """Rate of change, per second, shape (n, c)."""
    return np.gradient(values, time_s, axis=0) if len(time_s) > 2 else np.zeros_like(values)


def errors_of(
    subject: str, table: Table, reference: Table, start_ns: int, *, settings: ReferenceSettings
) -> Errors | None:
    """Compare a table with the reference at the samples of the slower of the two.

    None without a common time.

    The faster one is interpolated linearly to them, over no gap longer than ``gap_max_s``. Samples without a position
    are compared in what they have.
    """
    table, reference = _with_values(table), _with_values(reference)
    if len(table) < 2 or len(reference) < 2:
        return None
    slower = table if _step_ns(table) >= _step_ns(reference) else reference
    at = _within(slower.time_ns, table, reference)
    at = at[:: max(-(-len(at) // settings.samples_max), 1)]
    seen, true = (join(one, at, FIELDS, largest_gap_s=settings.gap_max_s) for one in (table, reference))
    any_known = np.logical_or.reduce(
        [seen.valid(name) & true.valid(name) for name in (*POSITION, *VELOCITY[:1], *ANGLES)]
    )
    if not any_known.any():
        return None
    placed = reference.take(reference.valid(*POSITION))
    origin = tuple(float(placed.values(name)[0]) if len(placed) else np.nan for name in POSITION)
    return _compared(subject, seen.take(any_known), true.take(any_known), start_ns, origin)


def _with_values(table: Table) -> Table:
    """Rows with a position, velocity or angle, each time once."""
    known = np.logical_or.reduce([table.valid(name) for name in (*POSITION, *VELOCITY[:1], *ANGLES)])
    return table.take(known).unique_times()


def _step_ns(table: Table) -> float:
    return float(np.median(np.diff(table.time_ns)))


def _within(time_ns: Int64Array, *tables: Table) -> Int64Array:
    first, last = max(one.time_ns[0] for one in tables), min(one.time_ns[-1] for one in tables)
    return np.asarray(time_ns[(time_ns >= first) & (time_ns <= last)])


def _compared(subject: str, seen: Table, true: Table, start_ns: int, origin: tuple[float, ...]) -> Errors:
    time_s = (seen.time_ns - start_ns) / NS_PER_S
    latitude, height = true.values("latitude_deg"), _height(true)
    meridian, prime_vertical = curvature_radii_m(np.nan_to_num(latitude))
    along_meridian = meridian + np.nan_to_num(height)
    along_parallel = (prime_vertical + np.nan_to_num(height)) * np.cos(np.deg2rad(latitude))

    def metres(latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
        east = np.deg2rad(_turn(longitude_deg)) * along_parallel
        return np.stack([np.deg2rad(latitude_deg) * along_meridian, east], axis=1)

    longitude = true.values("longitude_deg")
    place = metres(latitude - origin[0], longitude - origin[1])
    horizontal = metres(seen.values("latitude_deg") - latitude, seen.values("longitude_deg") - longitude)
    velocity = np.stack([seen.values(name) - true.values(name) for name in VELOCITY], axis=1) * (1.0, 1.0, -1.0)
    angles = np.stack([_turn(seen.values(name) - true.values(name)) for name in ANGLES], axis=1)
    motion = np.stack([true.values(name) for name in VELOCITY[:2]], axis=1)
    motion = np.where(np.isfinite(motion), motion, _rate(place, time_s))
    heading = true.values("true_heading_deg")
    return Errors(
        subject,
        time_s,
        np.column_stack([horizontal, _height_error(seen, true)]),
        velocity,
        angles,
        place,
        motion,
        np.where(np.isfinite(heading), heading, _direction(motion)),
        *({name: one.values(name) for name in SIGMAS if one.has(name)} for one in (seen, true)),
    )


def _turn(angle_deg: FloatArray) -> FloatArray:
    known = np.isfinite(angle_deg)
    return np.where(known, wrap_180(np.where(known, angle_deg, 0.0)), np.nan)


def _direction(motion: FloatArray) -> FloatArray:
    moving = np.hypot(*motion.T) > 1.0
    return np.where(moving, direction_of(*np.nan_to_num(motion.T)), np.nan)


def _height(table: Table) -> FloatArray:
    name = next((one for one in HEIGHTS if table.has(one)), HEIGHTS[0])
    return table.values(name)


def _height_error(seen: Table, true: Table) -> FloatArray:
    """Height minus height of the same kind; NaN where the two have none in common."""
    name = next((one for one in HEIGHTS if seen.has(one) and true.has(one)), "")
    return seen.values(name) - true.values(name) if name else np.full(len(seen), np.nan)
