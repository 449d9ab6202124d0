"""Faults of one unit: those of its errors, and those of what it writes."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.simulation.ins_class import InsClass
from groundstation.simulation.ins_draw import Streams, draw_sensor_errors
from groundstation.simulation.ins_errors import SensorErrors, TrueMotion, propagate
from groundstation.simulation.ins_units.settings import (
    AnyUnitFault,
    UnitAided,
    UnitClock,
    UnitExchanged,
    UnitFrozen,
    UnitHeading,
    UnitReset,
    UnitStep,
    UnitStuck,
    UnitSwapped,
    UnitWithoutPosition,
)
from groundstation.simulation.processes import gauss_markov

AIDED_POSITION_S, AIDED_VELOCITY_S = 60.0, 20.0  # correlation of the errors of an aided unit
SPREAD_OF_COAST = (
    *("gyro_constant_dph", "gyro_trend_dph_per_h", "gyro_random_dph", "accelerometer_constant_ug"),
    *("accelerometer_random_ug", "initial_tilt_rad", "initial_azimuth_deg"),
)


@dataclass(frozen=True)
class UnitErrors:
    """Errors of a unit, unit - truth.

    Shape (n, 2), north and east; ``azimuth_rad`` is that of the heading output, shape (n,).
    """

    position_m: FloatArray
    velocity_mps: FloatArray
    tilt_rad: FloatArray
    azimuth_rad: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))


@dataclass(frozen=True)
class UnitRecord:
    """Log of one unit, and the errors behind it.

    Parameters
    ----------
    topic : str
    serials : tuple of (float, str)
        From which second of the flight the topic has which serial.
    stamp_s : ndarray, shape (n,)
        Times as the unit writes them.
    latitude_deg, longitude_deg, altitude_m, velocity_down_mps, heading_deg, roll_deg : ndarray, shape (n,)
    velocity_mps : ndarray, shape (n, 2)
        North, east.
    errors : UnitErrors
        Without noise and rounding, and without the faults of outputs.
    has_position, is_aided, states_aiding : bool
    """

    topic: str
    serials: tuple[tuple[float, str], ...]
    stamp_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_mps: FloatArray
    velocity_down_mps: FloatArray
    heading_deg: FloatArray
    roll_deg: FloatArray
    errors: UnitErrors
    has_position: bool = True
    is_aided: bool = False
    states_aiding: bool = False

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, frozen(value))


def with_error_faults(
    errors: UnitErrors,
    faults: Iterable[AnyUnitFault],
    motion: TrueMotion,
    ins: InsClass,
    outages: Sequence[tuple[float, float]],
    draw: Callable[[str], UnitErrors],
    streams: Streams,
) -> UnitErrors:
    """Add steps, resets, aiding and an exchange to the errors of a unit.

    The equations are linear: a step adds the errors that it would make alone.

    Parameters
    ----------
    draw : callable
        Draws the errors of a further unit of a name.
    """
    for fault in faults:
        if isinstance(fault, UnitStep):
            position, velocity = (fault.north_m, fault.east_m), (fault.north_mps, fault.east_mps)
            errors = _stepped(errors, fault.at_s, np.array(position), np.array(velocity), motion, ins)
        elif isinstance(fault, UnitReset):
            k = _first(motion.time_s, fault.at_s)
            errors = _stepped(errors, fault.at_s, -errors.position_m[k], -errors.velocity_mps[k], motion, ins)
        elif isinstance(fault, UnitAided):
            errors = _aided(errors, fault, motion, ins, outages, streams)
        elif isinstance(fault, UnitExchanged):
            errors = _joined(errors, draw(f"spare {fault.unit}"), _first(motion.time_s, fault.at_s), len(motion.time_s))
    return errors


def _first(time_s: FloatArray, at_s: float) -> int:
    return int(np.searchsorted(time_s, at_s))


def _stepped(
    errors: UnitErrors,
    at_s: float,
    position_m: FloatArray,
    velocity_mps: FloatArray,
    motion: TrueMotion,
    ins: InsClass,
) -> UnitErrors:
    k = _first(motion.time_s, at_s)
    source = replace(
        SensorErrors.none(1, len(motion.time_s) - k), position_m=position_m[None], velocity_mps=velocity_mps[None]
    )
    added = propagate(_rest(motion, k), source, body_fixed=ins.is_strapdown)
    return UnitErrors(
        _added(errors.position_m, added.position_m[0], k),
        _added(errors.velocity_mps, added.velocity_mps[0], k),
        _added(errors.tilt_rad, added.tilt_rad[0], k),
        _added(errors.azimuth_rad, added.azimuth_rad[0], k),
    )


def _rest(motion: TrueMotion, start: int, end: int | None = None) -> TrueMotion:
    """Return a part of the motion."""
    parts = {item.name: np.asarray(getattr(motion, item.name))[..., start:end].copy() for item in fields(motion)}
    return TrueMotion(**parts)


def _added(values: FloatArray, more: FloatArray, start: int) -> FloatArray:
    out = np.array(values)
    out[start:] += more
    return out


def _joined(errors: UnitErrors, other: UnitErrors, start: int, end: int) -> UnitErrors:
    """Take the errors of another unit between two rows."""
    parts = {}
    for item in fields(UnitErrors):
        values = np.array(getattr(errors, item.name))
        values[start:end] = getattr(other, item.name)[start:end]
        parts[item.name] = values
    return UnitErrors(**parts)


def _aided(
    errors: UnitErrors,
    fault: UnitAided,
    motion: TrueMotion,
    ins: InsClass,
    outages: Sequence[tuple[float, float]],
    streams: Streams,
) -> UnitErrors:
    """Hold the errors to those of GNSS; in outages a calibrated unit goes on from there."""
    n, step_s = len(motion.time_s), float(motion.time_s[1] - motion.time_s[0])
    rng = streams("aided")
    held = UnitErrors(
        gauss_markov(rng, (2, n), step_s, fault.position_m, AIDED_POSITION_S).T,
        gauss_markov(rng, (2, n), step_s, fault.velocity_mps, AIDED_VELOCITY_S).T,
        np.zeros((n, 2)),
        errors.azimuth_rad,
    )
    calibrated = replace(ins, **{name: fault.share * getattr(ins, name) for name in SPREAD_OF_COAST})
    for number, (from_s, to_s) in enumerate(outages):
        start, end = _first(motion.time_s, from_s), _first(motion.time_s, to_s)
        if end - start < 2:
            continue
        part = _rest(motion, start, end)

        def own(name: str, number: int = number) -> np.random.Generator:
            return streams(f"coast {number} {name}")

        sensors = replace(
            draw_sensor_errors(calibrated, part, own, body_fixed=ins.is_strapdown, deflection=False),
            position_m=held.position_m[start][None],
            velocity_mps=held.velocity_mps[start][None],
        )
        coast = propagate(part, sensors, body_fixed=ins.is_strapdown)
        whole = UnitErrors(*(np.zeros_like(getattr(held, item.name)) for item in fields(UnitErrors)))
        placed = UnitErrors(
            _added(whole.position_m, _padded(coast.position_m[0], n - start), start),
            _added(whole.velocity_mps, _padded(coast.velocity_mps[0], n - start), start),
            _added(whole.tilt_rad, _padded(coast.tilt_rad[0], n - start), start),
            errors.azimuth_rad,
        )
        held = _joined(held, placed, start, end)
    return held


def _padded(values: FloatArray, length: int) -> FloatArray:
    out = np.zeros((length, *values.shape[1:]))
    out[: len(values)] = values
    return out


def with_output_faults(record: UnitRecord, faults: Iterable[AnyUnitFault]) -> UnitRecord:
    """Put the faults of outputs into what a unit writes."""
    time_s = record.stamp_s
    for fault in faults:
        match fault:
            case UnitSwapped():
                velocity = np.array(record.velocity_mps)
                velocity[time_s >= fault.at_s] = velocity[time_s >= fault.at_s][:, ::-1]
                record = replace(record, velocity_mps=velocity)
            case UnitStuck():
                axes = {"north": [0], "east": [1], "both": [0, 1]}[fault.axis]
                record = replace(record, velocity_mps=_held(record.velocity_mps, time_s, fault, axes))
            case UnitFrozen():
                names = ("latitude_deg", "longitude_deg", "altitude_m", "velocity_down_mps", "heading_deg", "roll_deg")
                parts: dict[str, Any] = {
                    name: _held(getattr(record, name)[:, None], time_s, fault, [0])[:, 0] for name in names
                }
                velocity = _held(record.velocity_mps, time_s, fault, [0, 1])
                record = replace(record, velocity_mps=velocity, **parts)
            case UnitHeading():
                record = replace(record, heading_deg=wrap_360(record.heading_deg + fault.offset_deg))
            case UnitClock():
                record = replace(record, stamp_s=record.stamp_s * (1.0 + 1e-6 * fault.rate_ppm) + fault.late_s)
            case UnitWithoutPosition():
                record = replace(record, has_position=False)
            case UnitAided():
                record = replace(record, is_aided=True, states_aiding=fault.is_stated)
            case UnitExchanged():
                record = replace(record, serials=(*record.serials, (fault.at_s, f"SIM-{200 + fault.unit}")))
            case _:
                pass
    return record


def _held(values: FloatArray, time_s: FloatArray, fault: UnitStuck | UnitFrozen, axes: list[int]) -> FloatArray:
    """Keep columns of (n, k) values at what they are at the start of a span."""
    out = np.array(values)
    inside = np.flatnonzero((time_s >= fault.from_s) & (time_s < fault.to_s))
    for axis in axes if inside.size else ():
        out[inside, axis] = values[inside[0], axis]
    return out
