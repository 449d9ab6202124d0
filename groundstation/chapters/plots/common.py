"""Parts that the plots of several chapters share.

Labels, spans of time, roles of lanes, whether a column has values.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from groundstation.chapters.wording import clean
from groundstation.plots.marks import Curve, Dots, Floats, Role
from groundstation.plots.ranges import finite

M_PER_KM = 1000.0
MOST_IN_LEGEND = 40  # characters


def label(text: Any, most: int = MOST_IN_LEGEND) -> str:
    """Return text of a log fit for a plot: one line of bounded length.

    Examples
    --------
    >>> label("a b"), label("abcdef", 4)
    ('a b', 'abc…')
    """
    kept = clean(str(text))
    return kept if len(kept) <= most else kept[: most - 1] + "…"


def has_values(*columns: Floats | None) -> bool:
    """Tell whether each of the columns is there and has a finite value."""
    return all(column is not None and bool(np.isfinite(column).any()) for column in columns)


def span(*times_s: Floats) -> tuple[float, float]:
    """Return the first and last moment of some columns; 0 and 1 where there is none."""
    times = finite(*times_s)
    return (float(times.min()), float(times.max())) if times.size else (0.0, 1.0)


def positive(values: Floats) -> Floats:
    """Return values that a logarithmic axis can show, NaN for the others."""
    return np.where(values > 0.0, values, np.nan)


def lane_roles(states: Iterable[str], known: Mapping[str, Role]) -> dict[str, Role]:
    """Return roles of states; those that name a limit that was passed (``gdop > 2``) warn.

    Examples
    --------
    >>> lane_roles(["good", "gdop > 2", "held"], {"good": "answer"})
    {'good': 'answer', 'gdop > 2': 'warn'}
    """
    roles: dict[str, Role] = {}
    for state in states:
        if state in known:
            roles[state] = known[state]
        elif " > " in state:
            roles[state] = "warn"
    return roles


def line_with_dots(x: Floats, y: Floats, role: Role, name: str = "") -> tuple[Curve, Dots]:
    """Return a few values joined by a line, each with a dot."""
    return Curve(x=x, y=y, role=role, name=name), Dots(x=x, y=y, role=role, emphasis="bold")
