"""Reading saved results without stumbling: any figure, column or key may be missing."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.results.explain import explained
from groundstation.results.figures import FigureData
from groundstation.results.files import SavedFlight
from groundstation.results.files import mapping as mapping


def objects(document: Any, key: str) -> list[Mapping[str, Any]]:
    """The objects in a list, none when the list is missing."""
    found = document.get(key) if isinstance(document, Mapping) else None
    return [item for item in found if isinstance(item, Mapping)] if isinstance(found, list | tuple) else []


def heading_of(saved: SavedFlight) -> Mapping[str, Any]:
    """``results.heading``, empty when the flight has none."""
    return mapping(saved.summary, "results", "heading")


def numbers(figure: FigureData, name: str) -> NDArray[np.float64]:
    """A column as float64; NaN throughout when the figure lacks it or it is text."""
    values = figure.columns.get(name)
    if values is None or values.dtype.kind not in "fiub":
        return np.full(len(figure), np.nan)
    return np.asarray(values, dtype=np.float64)


def flags(figure: FigureData, name: str) -> NDArray[np.bool_]:
    """A column as bool; False throughout when the figure lacks it."""
    values = numbers(figure, name)
    return np.asarray(np.isfinite(values) & (values != 0.0), dtype=np.bool_)


def texts(figure: FigureData, name: str) -> NDArray[np.str_]:
    """A column as text; empty throughout when the figure lacks it."""
    values = figure.columns.get(name)
    return np.full(len(figure), "") if values is None else values.astype(np.str_)


def not_assessable_reason(saved: SavedFlight, analysis: str) -> str:
    """Why an analysis could not be carried out, in plain words; empty when nothing is said about it."""
    entries = objects(saved.summary, "not_assessable")
    reason = next(
        (
            str(entry.get("reason", ""))
            for entry in entries
            if str(entry.get("analysis", "")).lower().startswith(analysis)
        ),
        "",
    )
    return explained(analysis, reason)
