"""Columns of the topic ``imu``: increments over an interval, or samples.

All readers make them here, in single precision as the topic is stored.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import BoolArray, Column

RATES = tuple(f"rate_{axis}_dps" for axis in "xyz")
ACCELERATIONS = tuple(f"accel_{axis}_mps2" for axis in "xyz")
ANGLES = tuple(f"delta_angle_{axis}_rad" for axis in "xyz")
VELOCITIES = tuple(f"delta_velocity_{axis}_mps" for axis in "xyz")
POINT_SAMPLES = "point samples: what happens between them is not in the log"
TOLD_SAMPLES: Mapping[str, str] = MappingProxyType(dict.fromkeys((*RATES, *ACCELERATIONS), POINT_SAMPLES))
WHOLE_SHARE = 0.5  # a source that is better by its kind is taken with this share of the records of the fullest


def first_whole(counts: Sequence[int]) -> int | None:
    """Return the place of the first source with enough of the records of the fullest one.

    Sources are best first; loggers thin out some messages, of which increments are then of no use.

    Examples
    --------
    >>> first_whole((12, 1298, 1812)), first_whole((1290, 1298)), first_whole((0, 0))
    (1, 0, None)
    """
    most = max(counts, default=0)
    return next((place for place, count in enumerate(counts) if count and count >= WHOLE_SHARE * most), None)


def increments(
    angles_rad: Sequence[NDArray[Any]],
    velocities_mps: Sequence[NDArray[Any]],
    interval_s: NDArray[Any],
    velocity_interval_s: NDArray[Any] | None = None,
    *,
    has_velocity: BoolArray | None = None,
) -> dict[str, Column]:
    """Return columns of increments; absent where their interval is none.

    Parameters
    ----------
    angles_rad, velocities_mps : three ndarrays each, shape (n,)
        About and along forward, right and down.
    interval_s : ndarray, shape (n,)
    velocity_interval_s : ndarray, shape (n,), optional
        Of the increments of velocity, where it is another; told only if it differs.
    has_velocity : ndarray of bool, shape (n,), optional

    Examples
    --------
    >>> zero, one = np.zeros(1), np.full(1, 0.005)
    >>> list(increments((zero, zero, zero), (zero, zero, one), one, one))[-2:]
    ['interval_s', 'is_integral']
    """
    with np.errstate(invalid="ignore"):
        known = interval_s > 0.0
        other_s = interval_s if velocity_interval_s is None else velocity_interval_s
        known_velocity = other_s > 0.0
    if has_velocity is not None:
        known_velocity = known_velocity & has_velocity
    by_angle, by_velocity = _unless_all(known), _unless_all(known_velocity)
    columns = {name: _single(values, by_angle) for name, values in zip(ANGLES, angles_rad, strict=True)}
    columns |= {name: _single(values, by_velocity) for name, values in zip(VELOCITIES, velocities_mps, strict=True)}
    columns["interval_s"] = _single(interval_s, by_angle)
    if velocity_interval_s is not None and (velocity_interval_s != interval_s).any():
        columns["velocity_interval_s"] = _single(velocity_interval_s, by_velocity)
    columns["is_integral"] = Column(np.ones(len(interval_s), dtype=bool), _unless_all(known | known_velocity))
    return columns


def integrals(angles_rad: Sequence[NDArray[Any]], velocities_mps: Sequence[NDArray[Any]]) -> dict[str, Column]:
    """Return columns of increments since the record before, each: their interval is not told.

    Examples
    --------
    >>> zero = np.zeros(1)
    >>> list(integrals((zero, zero, zero), (zero, zero, zero)))[-2:]
    ['delta_velocity_z_mps', 'is_integral']
    """
    columns = {name: _single(values, None) for name, values in zip(ANGLES, angles_rad, strict=True)}
    columns |= {name: _single(values, None) for name, values in zip(VELOCITIES, velocities_mps, strict=True)}
    return columns | {"is_integral": Column(np.ones(len(angles_rad[0]), dtype=bool))}


def samples(columns: Mapping[str, Column]) -> dict[str, Column]:
    """Return columns of samples: rates and specific force, each marked as no increment."""
    found = {name: _single(one.values, one.present) for name, one in columns.items()}
    told = [one.mask for name, one in found.items() if name in RATES or name in ACCELERATIONS]
    if not told:
        return {}
    present = np.logical_or.reduce(told)
    return found | {"is_integral": Column(np.zeros(len(present), dtype=bool), _unless_all(present))}


def bits(flags: NDArray[Any]) -> Column:
    """Return the number of bits that are set: axes that were clipped.

    Examples
    --------
    >>> bits(np.array([0.0, 1.0, 5.0, 7.0])).values.tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    with np.errstate(invalid="ignore"):
        numbers = np.nan_to_num(flags).astype(np.int64)
    return _single((numbers & 1) + (numbers >> 1 & 1) + (numbers >> 2 & 1), None)


def number(values: NDArray[Any], present: BoolArray | None = None) -> Column:
    """Return a column in single precision."""
    return _single(values, present)


def _single(values: NDArray[Any], present: BoolArray | None) -> Column:
    with np.errstate(over="ignore", invalid="ignore"):
        return Column(np.asarray(values).astype(np.float32), present)


def _unless_all(mask: BoolArray) -> BoolArray | None:
    return None if mask.all() else mask
