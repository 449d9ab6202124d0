"""Arrays behind the figures: small named tables whose columns carry their units."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, overload

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import frozen
from groundstation.base.unit_names import units_of
from groundstation.base.words import counted

if TYPE_CHECKING:
    import pandas as pd


class FigureData:
    """The numbers of one figure (or of one plain table).

    Parameters
    ----------
    name : str
        File name in arrays/ and tables/: ``heading_samples``.
    columns : mapping of name to ndarray, shapes (n,)
        Units in the names; numbers, bool or text. NaN is a gap.
    digits : mapping of name to int
        Decimals a column is rounded to in tables/*.csv; 6 where nothing is said.
    """

    is_kept_apart: ClassVar[bool] = True  # from the answer that holds it: arrays have files of their own
    is_copied: ClassVar[bool] = True  # to tables/, for people; False: too many rows to read
    name: str
    columns: Mapping[str, NDArray[Any]]
    digits: Mapping[str, int]

    def __init__(self, name: str, columns: Mapping[str, Any], digits: Mapping[str, int]) -> None:
        self.name = name
        self.columns = MappingProxyType({name: frozen(np.asarray(values)) for name, values in columns.items()})
        self.digits = MappingProxyType(dict(digits))

    def __len__(self) -> int:
        return min((len(values) for values in self.columns.values()), default=0)

    def __repr__(self) -> str:
        return f"<FigureData {self.name}: {counted(len(self), 'row')} of {', '.join(self.columns)}>"

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    def to_frame(self) -> "pd.DataFrame":
        """Pandas frame of the columns, in flight seconds as they are.

        ``frame.attrs["units"]`` has the unit of each column that has one.
        """
        import pandas as pd

        frame = pd.DataFrame({name: values.copy() for name, values in self.columns.items()})
        frame.attrs["units"] = units_of(self.columns)
        return frame


class FigureSet(Sequence[FigureData]):
    """Figures by name that are read when they are first asked for, each once."""

    def __init__(self, names: Iterable[str], read: Callable[[str], FigureData]) -> None:
        self.names, self._read, self._known = tuple(names), read, dict[str, FigureData]()

    def named(self, name: str) -> FigureData | None:
        """The figure of that name, None where there is none."""
        if name not in self._known and name in self.names:
            self._known[name] = self._read(name)
        return self._known.get(name)

    @overload
    def __getitem__(self, place: int) -> FigureData: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[FigureData, ...]: ...
    def __getitem__(self, place: int | slice) -> FigureData | tuple[FigureData, ...]:
        if isinstance(place, slice):
            return tuple(self[one] for one in range(*place.indices(len(self))))
        found = self.named(self.names[place])
        assert found is not None
        return found

    def __len__(self) -> int:
        return len(self.names)


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
