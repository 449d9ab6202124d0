"""Results as pandas frames: every list of rows is a table with a name."""

import typing
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from groundstation.base.errors import UnknownNameError
from groundstation.results.figures import FigureData

if TYPE_CHECKING:
    import pandas as pd


class Tabular:
    """A results dataclass whose lists of rows are pandas frames by the name of the field."""

    def table_names(self) -> tuple[str, ...]:
        """Names that :meth:`to_frame` takes."""
        return tuple(row_fields(type(self)))

    def to_frame(self, table: str = "") -> "pd.DataFrame":
        """A list of rows as a frame; the first list when no name is given.

        Parameters
        ----------
        table : str
            One of :meth:`table_names`. A list without rows gives a frame with its columns and no row.

        Raises
        ------
        UsageError
            When there is no such table.

        Examples
        --------
        >>> from groundstation.systems.inertial.forecast_answer import ForecastResult, SkillRow
        >>> rows = (SkillRow("raw_ins", 10.0, 3, 843.0, 700.0, 1500.0, None),)
        >>> forecast = ForecastResult("smoothed_start", 0.0, 300.0, True, "", rows)
        >>> forecast.to_frame()[["method", "horizon_min", "rms_m"]].values.tolist()
        [['raw_ins', 10.0, 843.0]]
        >>> len(forecast.to_frame("gaps")), forecast.table_names()[:2]
        (0, ('skill', 'gaps'))
        """
        known = row_fields(type(self))
        name = table or next(iter(known))
        if name not in known:
            raise UnknownNameError("tables", name, self.table_names())
        return rows_frame(known[name], getattr(self, name))

    def _repr_html_(self) -> str:
        """Return all fields that are no list, as a table for notebooks."""
        import pandas as pd

        shown = {part.name: getattr(self, part.name) for part in fields(cast(Any, self))}
        plain = {name: value for name, value in shown.items() if value is None or isinstance(value, str | int | float)}
        return pd.Series(plain, dtype=object).to_frame().to_html(header=False)


def row_fields(results: type) -> dict[str, type]:
    """Fields of a results dataclass that are lists of rows: name to the class of a row."""
    found: dict[str, type] = {}
    for name, hint in typing.get_type_hints(results).items():
        row = typing.get_args(hint)[0] if typing.get_origin(hint) is tuple else None
        if is_dataclass(row) and not issubclass(cast(type, row), FigureData):
            found[name] = cast(type, row)
    return found


def rows_frame(row_class: type, rows: Sequence[Any]) -> "pd.DataFrame":
    """Rows as a frame; a missing number is NaN, lists inside a row are left out."""
    import pandas as pd

    hints = typing.get_type_hints(row_class)
    names = [part.name for part in fields(row_class) if part.name not in row_fields(row_class)]
    columns: dict[str, Any] = {}
    for name in names:
        values = [getattr(row, name) for row in rows]
        columns[name] = np.array(values, dtype=np.float64) if hints[name] in (float, float | None) else values
    return pd.DataFrame(columns)
