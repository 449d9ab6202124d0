"""Arrays of several units from their tracks: errors and differences over time, thinned."""

from itertools import combinations

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.records import Int64Array
from groundstation.results.figures import FigureData
from groundstation.systems.inertial.units_arrays import UnitsErrors, UnitsPairs
from groundstation.systems.inertial.units_grid import apart_m
from groundstation.systems.inertial.units_prepare import Comparable

MOST_ROWS = 2000  # of a unit or a pair


def figures_of(found: Comparable) -> tuple[FigureData, ...]:
    """Return the errors of the units, where there is a reference, and their differences."""
    rows = np.unique(np.linspace(0, len(found.time_s) - 1, min(MOST_ROWS, len(found.time_s))).astype(np.int64))
    figures: list[FigureData] = []
    if found.reference is not None:
        errors = _errors(found, rows)
        if np.isfinite(errors.radial_m).any() or np.isfinite(errors.velocity_mps).any():
            figures.append(errors)
    figures.append(_pairs(found, rows))
    return tuple(figures)


def _errors(found: Comparable, rows: Int64Array) -> UnitsErrors:
    reference = found.reference
    assert reference is not None
    apart = [apart_m(one.raw, reference)[rows] for one in found.units]
    speeds = [_length(one.raw.velocity_mps - reference.velocity_mps)[rows] for one in found.units]
    return UnitsErrors(
        unit=_named([one.topic for one in found.units], rows),
        time_s=np.tile(found.time_s[rows], len(found.units)),
        north_m=np.concatenate([one[:, 0] for one in apart]),
        east_m=np.concatenate([one[:, 1] for one in apart]),
        radial_m=np.concatenate([_length(one) for one in apart]),
        velocity_mps=np.concatenate(speeds),
        latitude_deg=np.concatenate([one.raw.latitude_deg[rows] for one in found.units]),
        longitude_deg=np.concatenate([wrap_180(one.raw.longitude_deg[rows]) for one in found.units]),
    )


def _pairs(found: Comparable, rows: Int64Array) -> UnitsPairs:
    pairs = list(combinations(found.units, 2))
    return UnitsPairs(
        pair=_named([pair_name(first.topic, second.topic) for first, second in pairs], rows),
        time_s=np.tile(found.time_s[rows], len(pairs)),
        radial_m=np.concatenate([_length(apart_m(second.raw, first.raw))[rows] for first, second in pairs]),
        velocity_mps=np.concatenate(
            [_length(second.raw.velocity_mps - first.raw.velocity_mps)[rows] for first, second in pairs]
        ),
        heading_deg=np.concatenate(
            [wrap_180(second.raw.heading_deg - first.raw.heading_deg)[rows] for first, second in pairs]
        ),
    )


def pair_name(first: str, second: str) -> str:
    """Return the name of a pair: the second unit less the first.

    Examples
    --------
    >>> pair_name("ins", "ins.1")
    'ins.1 − ins'
    """
    return f"{second} − {first}"


def _named(names: list[str], rows: Int64Array) -> np.ndarray:
    return np.repeat(np.array(names, dtype=np.str_), len(rows))


def _length(values: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(*values.T))
