"""Checks of positions and attitudes: the last step of ``gnss`` and ``ins``."""

import numpy as np

from groundstation.base.angles import wrap_360
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.readers.places import placed
from groundstation.readers.receiver.messages import Columns
from groundstation.readers.receiver.tally import (
    IMPOSSIBLE_ATTITUDE,
    MOST_HEADING_DEG,
    MOST_PITCH_DEG,
    MOST_ROLL_DEG,
    ZERO_POSITION,
    StreamTally,
)

DILUTIONS, MOST_DILUTION = ("gdop", "pdop", "hdop"), 99.985
HEADINGS = ("true_heading_deg", "magnetic_heading_deg")
_MOST_DEG = {"roll_deg": MOST_ROLL_DEG, "pitch_deg": MOST_PITCH_DEG} | dict.fromkeys(HEADINGS, MOST_HEADING_DEG)


def credible_position(columns: Columns, topic: str, places: Int64Array, tally: StreamTally) -> Columns:
    """Drop positions that are no numbers, and the values of fixes at 0, 0.

    ``tally`` counts the fixes at 0, 0.

    Parameters
    ----------
    columns : mapping of field to Column
        Those of ``topic``, with or without a position.
    places : ndarray of int64, shape (n,)
        Where the rows begin in the file.
    """
    if "latitude_deg" not in columns or "longitude_deg" not in columns:
        return columns
    columns, zeros = placed(topic, columns)
    tally.add(ZERO_POSITION, topic, places[zeros])
    place = {name: columns[name] for name in ("latitude_deg", "longitude_deg") if name in columns}
    finite = np.logical_and.reduce([np.isfinite(one.values) for one in place.values()] or [np.ones(len(places), bool)])
    return columns | {name: _without(one, ~finite) for name, one in place.items()}


def credible_dilution(columns: Columns) -> Columns:
    """Drop dilutions of 99.99 and more, by which a receiver says that it has none."""
    told = {name: columns[name] for name in DILUTIONS if name in columns}
    return columns | {name: _without(one, one.values > MOST_DILUTION) for name, one in told.items()}


def credible_attitude(columns: Columns, places: Int64Array, tally: StreamTally) -> Columns:
    """Drop impossible attitudes and bring headings into [0, 360).

    A row with one impossible angle keeps none of its angles.

    Parameters
    ----------
    columns : mapping of field to Column
        Angles, degrees, as the device wrote them, and their sigmas; others are left as they are.
    places : ndarray of int64, shape (n,)
        Where the rows begin in the file.
    tally : StreamTally
        Counts the rows that were refused.
    """
    angles = [name for name in _MOST_DEG if name in columns]
    impossible: BoolArray = np.zeros(len(places), dtype=bool)
    for name in angles:
        impossible |= columns[name].mask & (np.abs(columns[name].values) > _MOST_DEG[name])
    tally.add(IMPOSSIBLE_ATTITUDE, "ins", places[impossible])
    found = dict(columns)
    for name in angles:
        values = np.where(impossible, 0.0, columns[name].values)
        found[name] = _without(
            Column(wrap_360(values) if name in HEADINGS else values, columns[name].present), impossible
        )
        sigma = name.replace("_deg", "_sigma_deg")
        if sigma in found:
            found[sigma] = _without(found[sigma], impossible)
    return found


def _without(column: Column, rows: BoolArray) -> Column:
    return Column(column.values, column.mask & ~rows) if rows.any() else column
