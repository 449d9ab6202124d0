"""Figure data of tests: typed where the figure is known, with all its columns and no other."""

import importlib
import pkgutil
from functools import cache
from typing import Any

import numpy as np

import groundstation.results.arrays as shared
from groundstation import systems
from groundstation.results.arrays.typed import Arrays, MissingColumnError
from groundstation.results.figures import FigureData

FILLERS: dict[type, Any] = {
    np.float64: np.nan,
    np.bool_: False,
    np.int64: 0,
    np.str_: "",
    np.datetime64: np.datetime64("NaT", "ns"),
}


@cache
def _load_all() -> None:
    """Import every module that has arrays."""
    for room in (shared, systems):
        for module in pkgutil.walk_packages(room.__path__, f"{room.__name__}."):
            if room is shared or module.name.endswith("arrays"):
                importlib.import_module(module.name)


def kinds() -> dict[str, type[Arrays]]:
    """Every class of arrays by the name of its figure."""
    _load_all()
    return {kind.figure: kind for kind in Arrays.__subclasses__() if kind.__module__.startswith("groundstation.")}


def figure(name: str, **columns: Any) -> FigureData:
    """Figure data from its columns."""
    made = FigureData(name, {key: np.asarray(values) for key, values in columns.items()}, {})
    kind = kinds().get(name)
    if kind is None:
        return made
    found = kind.of(made)
    unknown = set(columns) - set(found.columns)
    assert not unknown, f"{name} has no {', '.join(sorted(unknown))}"
    return found


def filled(name: str, **columns: Any) -> FigureData:
    """Figure data from some of its columns; the others that it must have are without values."""
    kind, known = kinds()[name], {key: np.asarray(values) for key, values in columns.items()}
    count = len(next(iter(known.values())))
    while True:
        try:
            return kind.of(FigureData(name, known, {}))
        except MissingColumnError as error:
            known[error.column] = np.full(count, FILLERS[error.kind])
