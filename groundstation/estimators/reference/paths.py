"""Errors of a whole path: absolute after an alignment, relative over times and ways."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Int64Array
from groundstation.estimators.reference.errors import Errors
from groundstation.estimators.reference.settings import ReferenceSettings
from groundstation.estimators.reference.statistics import independent, root_mean_interval
from groundstation.results.reference import PathRow, RelativeRow

NEAR = 0.1  # share of a time or way by which a pair may miss it
LEAST_PAIRS = 5


def path_rows(errors: Errors) -> tuple[PathRow, ...]:
    """Horizontal RMS as it is, after a shift, and after a shift and a turn about the vertical.

    Source: Horn, Closed-form solution of absolute orientation using unit quaternions, 1987, in two dimensions and
    without scale; Sturm et al., A benchmark for the evaluation of RGB-D SLAM systems, 2012, section VI (ATE, RPE).
    """
    known = np.isfinite(errors.position_m[:, :2]).all(axis=1) & np.isfinite(errors.place_m).all(axis=1)
    if known.sum() < 2:
        return ()
    error, true = errors.position_m[known, :2], errors.place_m[known]
    centred, middle = error - error.mean(axis=0), true - true.mean(axis=0)
    seen = middle + centred
    # the turn that brings what was seen upon the reference: right-handed about down, north to east
    turn = np.arctan2(np.sum(seen[:, 0] * middle[:, 1] - seen[:, 1] * middle[:, 0]), np.sum(seen * middle))
    cosine, sine = np.cos(turn), np.sin(turn)
    turned = np.stack([seen[:, 0] * cosine - seen[:, 1] * sine, seen[:, 0] * sine + seen[:, 1] * cosine], axis=1)
    return (
        PathRow(errors.subject, "none", _rms(error)),
        PathRow(errors.subject, "shift", _rms(centred)),
        PathRow(errors.subject, "shift_and_yaw", _rms(turned - middle), float(np.rad2deg(turn))),
    )


def relative_rows(errors: Errors, settings: ReferenceSettings) -> tuple[RelativeRow, ...]:
    """Return how much the horizontal position error changes over a time or a way.

    One row for each time and way of the settings that fits into the flight.
    """
    known = np.isfinite(errors.position_m[:, :2]).all(axis=1) & np.isfinite(errors.place_m).all(axis=1)
    if known.sum() < LEAST_PAIRS:
        return ()
    error, time_s = errors.position_m[known, :2], errors.time_s[known]
    way_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(errors.place_m[known], axis=0).T))])
    rows = []
    for lengths, progress, unit in ((settings.intervals_s, time_s, "s"), (settings.ways_m, way_m, "m")):
        for length in lengths:
            first, last = _pairs(progress, length)
            if len(first) < LEAST_PAIRS:
                continue
            change = np.hypot(*(error[last] - error[first]).T)
            mean_way = float(np.mean(way_m[last] - way_m[first]))
            count, rmse = independent(change), float(np.sqrt(np.mean(np.square(change))))
            rows.append(
                RelativeRow(
                    *(errors.subject, length, unit, len(first), count, rmse),
                    rmse95_m=root_mean_interval(np.square(change), count),
                    median_m=float(np.median(change)),
                    largest_m=float(np.max(change)),
                    share_of_way=rmse / mean_way if mean_way > rmse else None,
                )
            )
    return tuple(rows)


def _pairs(progress: FloatArray, length: float) -> tuple[Int64Array, Int64Array]:
    """Pair each row with the row nearest to a time or way later.

    Pairs that miss it by more than a tenth are left out.
    """
    wanted = progress + length
    after = np.clip(np.searchsorted(progress, wanted), 1, len(progress) - 1)
    nearest = after - (wanted - progress[after - 1] < progress[after] - wanted)
    good = (np.abs(progress[nearest] - wanted) <= NEAR * length) & (nearest > np.arange(len(progress)))
    moved = np.concatenate([[True], np.diff(progress) > 0.0])  # at standstill one pair is enough
    rows = np.flatnonzero(good & moved)
    return rows, nearest[rows]


def _rms(vectors: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(np.square(vectors), axis=1))))
