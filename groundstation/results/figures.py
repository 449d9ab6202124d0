"""Arrays behind the figures: small named tables whose columns carry their units."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import frozen

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class FigureData:
    """The numbers of one figure (or of one plain table).

    Parameters
    ----------
    name : str
        File name in results.parquet/ and tables/: ``heading_samples``.
    columns : mapping of name to ndarray, shapes (n,)
        Units in the names; numbers, bool or text. NaN is a gap.
    digits : mapping of name to int
        Decimals a column is rounded to in tables/*.csv; 6 where nothing is said.
    """

    is_kept_apart: ClassVar[bool] = True  # from the answer that holds it: arrays have files of their own
    name: str
    columns: Mapping[str, NDArray[Any]]
    digits: Mapping[str, int]

    def __post_init__(self) -> None:
        columns = {name: frozen(np.asarray(values)) for name, values in self.columns.items()}
        object.__setattr__(self, "columns", MappingProxyType(columns))
        object.__setattr__(self, "digits", MappingProxyType(dict(self.digits)))

    def __len__(self) -> int:
        return min((len(values) for values in self.columns.values()), default=0)

    def __repr__(self) -> str:
        return f"<FigureData {self.name}: {len(self)} rows of {', '.join(self.columns)}>"

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    def to_frame(self) -> "pd.DataFrame":
        """Pandas frame of the columns, in flight seconds as they are."""
        import pandas as pd

        return pd.DataFrame({name: values.copy() for name, values in self.columns.items()})
