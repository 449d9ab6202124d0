"""Columns of the tables of flights: index.json, index.csv and fleet.parquet."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

from groundstation.results.answer import Answer

Kind = Literal["text", "category", "number", "count", "time", "flag"]
AnswerT = TypeVar("AnswerT", bound=Answer)


@dataclass(frozen=True)
class FlightColumn:
    """Column of the table of flights: name with unit, kind, and description in plain words.

    In memory ``number`` and ``count`` are float64 (NaN where missing), ``flag`` is bool, ``time`` datetime64[ns] in UTC
    (NaT where missing), the rest text (empty where missing). In fleet.parquet a missing value is null.
    """

    name: str
    kind: Kind
    meaning: str


@dataclass(frozen=True)
class AnswerColumn(FlightColumn, Generic[AnswerT]):
    """A column that an analysis fills from its answer.

    Parameters
    ----------
    of : callable, optional
        ``of(answer)``: its value, None where there is none. Left out: the field of the answer that has its name.
    is_indexed : bool
        True where it stands in index.json and index.csv as well as in fleet.parquet.
    """

    of: Callable[[AnswerT], Any] | None = None
    is_indexed: bool = True

    def value(self, answer: AnswerT) -> Any:
        """Return the column's value for an answer."""
        return getattr(answer, self.name) if self.of is None else self.of(answer)
