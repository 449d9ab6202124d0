"""Arrays behind the figures of the comparison with a reference, thinned to what a page or a viewer can show."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.records import Int64Array
from groundstation.estimators.reference.errors import SIGMAS, Errors
from groundstation.estimators.reference.judging import Checked
from groundstation.results.figures import FigureData

ROWS = 2_000  # of each subject
COLUMNS = (
    *("north_m", "east_m", "up_m", "north_mps", "east_mps", "up_mps"),
    *("roll_deg", "pitch_deg", "heading_deg"),
)
DIGITS = {"time_s": 3} | dict.fromkeys(COLUMNS, 4) | {"place_north_m": 2, "place_east_m": 2}


def errors_figure(listed: Sequence[Errors]) -> FigureData:
    """Errors of every subject over time with the sigmas that it and the reference claim together."""
    columns: dict[str, list[NDArray]] = {"subject": [], "time_s": []}
    for errors in listed:
        rows = _thinned(len(errors))
        columns["subject"].append(np.full(len(rows), errors.subject))
        columns["time_s"].append(errors.time_s[rows])
        values = np.column_stack([errors.position_m, errors.velocity_mps, errors.angles_deg])[rows]
        for name, column in zip(COLUMNS, values.T, strict=True):
            columns.setdefault(name, []).append(column)
        for name in SIGMAS:
            columns.setdefault(name, []).append(_total(errors, name)[rows])
    return FigureData("reference_errors", {name: np.concatenate(parts) for name, parts in columns.items()}, DIGITS)


def _total(errors: Errors, name: str) -> FloatArray:
    claimed, own = errors.claimed.get(name), errors.reference.get(name)
    if claimed is None:
        return np.full(len(errors), np.nan)
    return claimed if own is None else np.hypot(claimed, np.nan_to_num(own))


def track_figure(listed: Sequence[Errors]) -> FigureData | None:
    """Plan view: the reference and every subject with positions, metres from where the reference begins."""
    with_place = [one for one in listed if np.isfinite(one.position_m[:, :2]).any()]
    if not with_place:
        return None
    longest = max(with_place, key=lambda one: float(np.ptp(one.time_s)))
    columns: dict[str, list[NDArray]] = {"subject": [], "time_s": [], "place_north_m": [], "place_east_m": []}
    tracks = [("reference", longest, 0.0), *((one.subject, one, 1.0) for one in with_place)]
    for name, errors, share in tracks:
        rows = _thinned(len(errors))
        place = errors.place_m[rows] + share * np.nan_to_num(errors.position_m[rows, :2], nan=np.nan if share else 0.0)
        columns["subject"].append(np.full(len(rows), name))
        columns["time_s"].append(errors.time_s[rows])
        columns["place_north_m"].append(place[:, 0])
        columns["place_east_m"].append(place[:, 1])
    return FigureData("reference_track", {name: np.concatenate(parts) for name, parts in columns.items()}, DIGITS)


def checks_figure(listed: Sequence[Checked]) -> FigureData | None:
    """Of every claim as many samples, evenly spaced, as are independent: what a fleet may count."""
    columns: dict[str, list[NDArray]] = {}
    for one in listed:
        rows = np.unique(np.linspace(0, len(one.z) - 1, max(int(one.row.effective_samples), 1)).round().astype(int))
        parts = {
            "subject": np.full(len(rows), one.row.subject),
            "quantity": np.full(len(rows), one.row.quantity),
            "axis": np.full(len(rows), one.row.axis),
            "time_s": one.time_s[rows],
            "z": one.z[rows],
            "is_inside": one.is_inside[rows],
        }
        for name, values in parts.items():
            columns.setdefault(name, []).append(values)
    if not columns:
        return None
    return FigureData("reference_checks", {name: np.concatenate(parts) for name, parts in columns.items()}, {"z": 4})


def _thinned(count: int) -> Int64Array:
    return np.unique(np.linspace(0, count - 1, min(count, ROWS)).round().astype(np.int64))
