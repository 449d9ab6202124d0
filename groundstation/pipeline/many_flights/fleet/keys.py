"""Keys: facts of every flight folder that are known without reading it.

They are kept as columns; an object is made only of the one that is asked for.
"""

import operator
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.results.files import parquet_bytes, write_bytes

KEYS, UNKNOWN = ".flights", "unknown"
DAY_CHARACTERS = 9  # of a flight id: date and the letter behind it, from which the month follows
NUMBERS = ("stamp", "start_ns", "end_ns")


class Key(NamedTuple):
    """Facts of a flight folder that are known without reading it.

    ``stamp`` is of its files when it was read.

    ``parts`` are the digests of the consecutive logs of the flight but the first, one a line.
    """

    flight_id: str
    stamp: int
    path: str
    sha256: str
    link_name: str
    hears: str
    start_ns: int | None
    end_ns: int | None
    samples: str
    parts: str = ""


class FlightKeys(Mapping[str, Key]):
    """Keys of flights by flight id, in that order; kept as columns.

    Parameters
    ----------
    table : pyarrow.Table
        The fields of :class:`Key`.
    """

    def __init__(self, table: Any) -> None:
        self._table = table

    @cached_property
    def _ordered(self) -> tuple[Any, list[str]]:
        """The table in the order of the flights, each once, and their names; files are written so."""
        table, names = self._table, self._table.column("flight_id").to_pylist()
        if not all(map(operator.lt, names, islice(names, 1, None))):
            last = {name: place for place, name in enumerate(names)}  # of a name that stands twice
            table = table.take(np.array([last[name] for name in sorted(last)], dtype=np.int64))
            names = sorted(last)
        return table, names

    @property
    def table(self) -> Any:
        """The fields of :class:`Key`, a row for each flight."""
        return self._ordered[0]

    @property
    def names(self) -> list[str]:
        """The flight ids."""
        return self._ordered[1]

    @classmethod
    def of(cls, keys: Iterable[Key]) -> "FlightKeys":
        """Keys from keys, in whatever order."""
        import pyarrow as pa

        columns = list(zip(*keys, strict=True)) or [()] * len(Key._fields)
        kinds = [pa.int64() if name in NUMBERS else pa.string() for name in Key._fields]
        arrays = [pa.array(values, kind) for values, kind in zip(columns, kinds, strict=True)]
        return cls(pa.table(dict(zip(Key._fields, arrays, strict=True))))

    @classmethod
    def joined(cls, parts: Sequence["FlightKeys"]) -> "FlightKeys":
        """Several of them as one."""
        import pyarrow as pa

        return cls(pa.concat_tables([cls.of(()).table, *(part._table for part in parts)]).combine_chunks())

    @cached_property
    def _places(self) -> dict[str, int]:
        return {name: place for place, name in enumerate(self.names)}

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self._places

    def __getitem__(self, name: str) -> Key:
        place = self._places[name]
        return Key(*(self.table.column(field)[place].as_py() for field in Key._fields))

    def place(self, name: str) -> int | None:
        """Row of a flight; None when there is none."""
        return self._places.get(name)

    def column(self, name: str) -> list[Any]:
        """A field of all flights, in their order."""
        found: list[Any] = self.table.column(name).to_pylist()
        return found

    def stamps(self) -> list[int]:
        """The stamps, in the order of the flights."""
        return self.column("stamp")

    def only(self, names: Collection[str]) -> "FlightKeys":
        """Keys of some flights."""
        import pyarrow as pa
        import pyarrow.compute as pc

        is_named = pc.is_in(self.table.column("flight_id"), value_set=pa.array(names, pa.string()))
        found = self.table.filter(is_named)
        return self if len(found) == len(self) else FlightKeys(found)

    def without(self, values: Collection[str], field: str) -> "FlightKeys":
        """Keys without some values of a field."""
        if not values:
            return self
        return self.only([name for name, one in zip(self, self.column(field), strict=True) if one not in values])

    def at(self, places: NDArray[np.intp]) -> "FlightKeys":
        """Keys in some rows."""
        return FlightKeys(self.table.take(places))

    def by_month(self) -> dict[str, NDArray[np.intp]]:
        """Places of the flights of each month, months and places in order."""
        import pyarrow.compute as pc

        from groundstation.base import arrow_values as arrow

        days = pc.utf8_slice_codeunits(self.table.column("flight_id"), 0, DAY_CHARACTERS).combine_chunks()
        encoded = days.dictionary_encode()
        month_of_day = list(map(month_of, encoded.dictionary.to_pylist()))
        months = sorted(set(month_of_day))
        numbers = np.array([months.index(one) for one in month_of_day], dtype=np.intp)
        number = numbers[arrow.column(encoded.indices)]
        return {month: np.flatnonzero(number == place) for place, month in enumerate(months)}

    def names_at(self, places: NDArray[np.intp]) -> list[str]:
        """Flight ids at some places."""
        return [self.names[place] for place in places.tolist()]


def month_of(flight_id: str) -> str:
    """The month by whose name a flight's file goes.

    Examples
    --------
    >>> month_of("20260504T060000Z_A12_7"), month_of("NOTIME_0123abcd")
    ('2026-05', 'unknown')
    """
    digits, letter = flight_id[:8], flight_id[8:DAY_CHARACTERS]
    return f"{digits[:4]}-{digits[4:6]}" if letter == "T" and digits.isascii() and digits.isdecimal() else UNKNOWN


def key_path(out: Path, month: str) -> Path:
    """The file with the keys of a month."""
    return out / KEYS / f"{month}.parquet"


def read_keys(out: Path, month: str) -> FlightKeys:
    """Read the keys of the flights of a month; none when they cannot be read."""
    import pyarrow.parquet as pq

    empty = FlightKeys.of(())
    try:
        with pq.ParquetFile(key_path(out, month)) as file:
            table = file.read(use_threads=False)  # small files: threads take longer
        return FlightKeys(table) if table.schema.equals(empty.table.schema) else empty
    except (OSError, ValueError):
        return empty


def write_keys(out: Path, month: str, keys: FlightKeys) -> None:
    """Write what is known of the flights of a month."""
    path = key_path(out, month)
    path.parent.mkdir(exist_ok=True)
    write_bytes(path, parquet_bytes(keys.table))
