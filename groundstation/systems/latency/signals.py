"""Signals of an INS and of another sensor that show the same motion, ready to compare."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import direction_of, unwrap
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.dataclasses import dataclass
from groundstation.methods.lag.settings import SLOW_MPS, LatencySettings
from groundstation.methods.lag.windows import ReferenceSignals
from groundstation.systems.latency.answer import Quantity
from groundstation.tables.epochs import distinct_epochs
from groundstation.tables.sources import sources_of_kind
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]
VELOCITY = ("velocity_north_mps", "velocity_east_mps")
POSITION = ("latitude_deg", "longitude_deg")  # tells the epochs of a receiver apart
ALTITUDES = ("altitude_ellipsoid_m", "altitude_msl_m")
FIELD = ("field_forward_nt", "field_right_nt", "field_down_nt")
ATTITUDE = ("roll_deg", "pitch_deg")
HEADINGS = ("true_heading_deg", "magnetic_heading_deg")
LEAST_SAMPLES, LEAST_NODES = 10, 3


@dataclass(frozen=True)
class SignalComparison:
    """Reference signal and the samples of another sensor, on flight seconds.

    Times have shape (n,), values (n, c) in ``unit``.

    ``prior_sigma`` (q,): of the nuisances in the reference.
    """

    reference: ReferenceSignals
    time_s: FloatArray
    values: FloatArray
    prior_sigma: FloatArray
    unit: str


class NotComparableError(Exception):
    """Reason why two topics cannot be compared, in a few words."""


def pairs_of(flight: Flight) -> list[tuple[str, str, Quantity]]:
    """Return the topics and quantities that may be compared.

    The first INS that has the signal is paired with every other sensor.
    """
    units = [topic for topic in sources_of_kind(flight, "ins") if len(flight[topic])]

    def others(kind: str, *fields: str) -> list[str]:
        return [topic for topic in sources_of_kind(flight, kind) if flight[topic].has(*fields)]

    def first(*fields: str) -> str:
        return next((topic for topic in units if flight[topic].has(*fields)), "")

    pairs: list[tuple[str, str, Quantity]] = []
    moving = first(*VELOCITY)
    climbing = first("velocity_down_mps") or next((topic for name in ALTITUDES if (topic := first(name))), "")
    tilting = next((topic for topic in units if flight[topic].has(*ATTITUDE) and _heading_of(flight[topic])), "")
    if moving:
        pairs += [(moving, topic, "velocity") for topic in others("gnss", *VELOCITY)]
    if climbing:
        pairs += [(climbing, topic, "altitude") for topic in others("baro", "pressure_altitude_m")]
    if tilting:
        pairs += [(tilting, topic, "field") for topic in others("magnetometer", *FIELD)]
        pairs += [
            (tilting, topic, "attitude")
            for topic in units
            if topic != tilting and flight[topic].has(*ATTITUDE) and _heading_of(flight[topic])
        ]
    return pairs


def compare(flight: Flight, pair: tuple[str, str, Quantity], settings: LatencySettings) -> SignalComparison:
    """Make the signals of a pair comparable.

    Raises
    ------
    NotComparableError
        When rates or time stamps do not allow it.
    """
    reference, other, quantity = pair
    unit, sensor = _compared_part(flight[reference]), flight[other]
    shown, seen = _columns(unit, sensor, quantity)
    unit = unit.take(unit.valid(*shown))
    sensor = _compared_part(sensor) if quantity == "attitude" else sensor.trusted()
    compared = {name: column for name, column in sensor.columns.items() if name in (*seen, *POSITION)}
    sensor = replace(sensor, columns=compared).take(sensor.valid(*seen))
    for topic, table in ((reference, unit), (other, sensor)):
        _check_stamps(topic, table, settings)
    if quantity == "velocity":
        sensor = distinct_epochs(sensor)
    _check_rates(reference, unit.unique_times(), settings.reference_interval_max_s)
    _check_rates(other, sensor, settings.other_interval_max_s)
    maker = {"velocity": _velocity, "altitude": _altitude, "field": _field, "attitude": _attitude}[quantity]
    made = maker(flight, unit, sensor, settings)
    samples = round(len(sensor) / max(len(made.time_s), 1))
    return replace(made, reference=made.reference.smoothed(_nodes(made, samples, settings)))


def _columns(unit: Table, sensor: Table, quantity: Quantity) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the fields that are compared, of the reference and of the other sensor."""
    if quantity == "velocity":
        return VELOCITY, VELOCITY
    if quantity == "altitude":
        return (next(name for name in ("velocity_down_mps", *ALTITUDES) if unit.has(name)),), ("pressure_altitude_m",)
    if quantity == "field":
        return (*ATTITUDE, _heading_of(unit)), FIELD
    heading = next((name for name in HEADINGS if unit.has(name) and sensor.has(name)), "")
    if not heading:
        raise NotComparableError("headings of different kinds")
    return (*ATTITUDE, heading), (*ATTITUDE, heading)


def _nodes(made: SignalComparison, samples: int, settings: LatencySettings) -> int:
    """Return how many reference samples to average.

    They span as much time as the means of the other sensor, and are enough that their noise does not show.
    """
    step_s = float(np.median(np.diff(made.reference.time_s))) if len(made.reference.time_s) > 1 else 1.0
    width_s = settings.other_step_s if samples > 1 else 0.0
    return max(LEAST_NODES, 2 * round(0.5 * width_s / step_s) + 1)


def _velocity(flight: Flight, unit: Table, sensor: Table, settings: LatencySettings) -> SignalComparison:
    """Compare GNSS velocity with INS velocity.

    Azimuth error, scale and the lever arm of the antenna are nuisances.
    """
    names = [name for name in (*VELOCITY, *ATTITUDE, *HEADINGS) if unit.has(name)]
    time_s, columns = _averaged(flight, unit, names, settings.reference_step_s)
    north, east = columns[VELOCITY[0]], columns[VELOCITY[1]]
    arms = np.gradient(_rotation(columns, _nose(columns, north, east))[:, :2, :], time_s, axis=0)

    def build(base: FloatArray) -> FloatArray:
        built = np.empty((*base.shape[:-1], 2, 6))
        built[..., 0] = built[..., 1] = base[..., :2]
        built[..., 0, 2], built[..., 1, 2] = -base[..., 1], base[..., 0]
        built[..., 3:] = base[..., 2:].reshape(*base.shape[:-1], 2, 3)
        return built

    base = np.column_stack([north, east, arms.reshape(-1, 6)])
    at_s, measured = _averaged(flight, sensor, VELOCITY, settings.other_step_s)
    sigma = [settings.scale_sigma, np.deg2rad(settings.azimuth_sigma_deg), *[settings.arm_sigma_m] * 3]
    values = np.stack([measured[name] for name in VELOCITY], axis=-1)
    return SignalComparison(
        ReferenceSignals(time_s, base, build, settings.gap_max_s), at_s, values, np.array(sigma), "m/s"
    )


def _altitude(flight: Flight, unit: Table, sensor: Table, settings: LatencySettings) -> SignalComparison:
    """Compare pressure altitude with the height of the INS; a scale is the nuisance.

    The height is integrated from the vertical speed of the INS, or is its altitude.
    """
    (name,), _seen = _columns(unit, sensor, "altitude")
    time_s, columns = _averaged(flight, unit, [name], settings.reference_step_s)
    height = columns[name]
    if name == "velocity_down_mps":
        steps = np.diff(time_s)
        height = np.concatenate([[0.0], np.cumsum(-0.5 * (height[1:] + height[:-1]) * steps)])
    at_s, measured = _averaged(flight, sensor, ["pressure_altitude_m"], settings.other_step_s)
    values = measured["pressure_altitude_m"][:, None]
    sigma = np.array([3.0 * settings.scale_sigma])  # air that is not standard
    reference = ReferenceSignals(
        time_s, height[:, None], lambda base: np.stack([base, base], axis=-1), settings.gap_max_s
    )
    return SignalComparison(reference, at_s, values, sigma, "m")


def _field(flight: Flight, unit: Table, sensor: Table, settings: LatencySettings) -> SignalComparison:
    """Magnetic field along body axes against a constant field turned by the attitude.

    Soft iron with mounting, and the field itself, are nuisances.
    """
    shown, _seen = _columns(unit, sensor, "field")
    time_s, columns = _averaged(flight, unit, shown, settings.reference_step_s)
    body_from_n = np.swapaxes(_rotation(columns, columns[shown[-1]]), 1, 2)
    at_s, measured = _averaged(flight, sensor, FIELD, settings.other_step_s)
    values = np.stack([measured[name] for name in FIELD], axis=-1)
    base = body_from_n.reshape(-1, 9)
    bare = ReferenceSignals(time_s, base, lambda base: base, settings.gap_max_s)
    known = bare.covers(at_s, 0.0)
    if np.count_nonzero(known) < LEAST_SAMPLES:
        raise NotComparableError("too few samples while the attitude is known")
    turning, seen = bare.signal_at(at_s[known]).reshape(-1, 3, 3), values[known]
    turning, seen = turning - turning.mean(axis=0), seen - seen.mean(axis=0)
    constant = np.linalg.lstsq(turning.reshape(-1, 3), seen.reshape(-1), rcond=1e-6)[0]
    size = max(float(np.linalg.norm(constant)), 1.0)

    def build(base: FloatArray) -> FloatArray:
        turn = base.reshape(*base.shape[:-1], 3, 3)
        turned = turn @ constant
        built = np.zeros((*turned.shape, 13))
        built[..., 0] = turned
        for axis in range(3):
            built[..., axis, 1 + 3 * axis : 4 + 3 * axis] = turned
        np.multiply(size, turn, out=built[..., 10:])
        return built

    sigma = np.full(12, settings.iron_sigma)
    return SignalComparison(ReferenceSignals(time_s, base, build, settings.gap_max_s), at_s, values, sigma, "nT")


def _attitude(flight: Flight, unit: Table, sensor: Table, settings: LatencySettings) -> SignalComparison:
    """Roll, pitch and heading of two INS."""
    sides = []
    names, _seen = _columns(unit, sensor, "attitude")
    for table, step_s in ((unit, settings.reference_step_s), (sensor, settings.other_step_s)):
        time_s, columns = _averaged(flight, table, names, step_s)
        sides.append((time_s, np.stack([columns[name] for name in names], axis=-1)))
    (time_s, shown), (at_s, values) = sides
    reference = ReferenceSignals(time_s, shown, lambda base: base[..., None], settings.gap_max_s)
    return SignalComparison(reference, at_s, values, np.zeros(0), "deg")


def _compared_part(unit: Table) -> Table:
    """Return the rows that an INS trusts itself, with the columns that are compared."""
    names = (*VELOCITY, "velocity_down_mps", *ALTITUDES, *ATTITUDE, *HEADINGS)
    unit = unit.trusted()
    return replace(unit, columns={name: unit.columns[name] for name in names if name in unit})


def _heading_of(table: Table) -> str:
    return next((name for name in HEADINGS if table.has(name)), "")


def _check_stamps(topic: str, table: Table, settings: LatencySettings) -> None:
    if len(table) > 1 and float(np.mean(np.diff(table.time_ns) == 0)) > settings.repeated_share_max:
        raise NotComparableError(f"time stamps of {topic} are coarser than its rate: many samples share one")


def _check_rates(topic: str, table: Table, longest_s: float) -> None:
    if len(table) < 2:
        raise NotComparableError(f"{topic} has no samples")
    interval_s = float(np.median(np.diff(table.time_ns))) * 1e-9
    if interval_s > longest_s:
        raise NotComparableError(
            f"{topic} is too slow: one sample in {interval_s:.2g} s, at least {1 / longest_s:g} Hz"
        )


def _averaged(
    flight: Flight, table: Table, names: Sequence[str], step_s: float
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Average the rows of a table over ``step_s``, at their mean times.

    Headings and roll are made continuous first.
    """
    table = table.unique_times()
    time_s = flight.seconds(table.time_ns)
    columns = {
        name: unwrap(table.values(name)) if name in ("roll_deg", *HEADINGS) else table.values(name) for name in names
    }
    cell = np.floor((time_s - time_s[:1]) / max(step_s, 1e-9) + 1e-6).astype(np.int64)
    starts = np.flatnonzero(np.diff(cell, prepend=-1))
    if len(starts) < LEAST_SAMPLES:
        raise NotComparableError(f"{table.topic} has too few samples")
    if len(starts) == len(time_s):
        return time_s, columns
    count = np.diff(np.append(starts, len(time_s)))
    return np.add.reduceat(time_s, starts) / count, {
        name: np.add.reduceat(values, starts) / count for name, values in columns.items()
    }


def _nose(columns: dict[str, FloatArray], north: FloatArray, east: FloatArray) -> FloatArray:
    """Return the heading (deg) that turns the antenna's arm.

    It is the logged one, else the track of the moving aircraft, held while it is slow.
    """
    for name in HEADINGS:
        if name in columns and np.isfinite(columns[name]).all():
            return columns[name]
    track = np.where(np.hypot(north, east) > SLOW_MPS, direction_of(north, east), np.nan)
    known = np.flatnonzero(np.isfinite(track))
    if not known.size:
        return np.zeros(len(track))
    return np.interp(np.arange(len(track)), known, unwrap(track[known]))


def _rotation(columns: dict[str, FloatArray], heading_deg: FloatArray) -> FloatArray:
    """Rotations n_from_b, shape (m, 3, 3); roll and pitch that are not logged are level."""
    level = np.zeros(len(heading_deg))
    tilt = [columns.get(name, level) for name in ATTITUDE]
    return rotation_n_from_b(np.column_stack([*tilt, heading_deg]))
