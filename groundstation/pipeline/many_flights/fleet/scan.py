"""Scan of a folder of flights: which ones the dataset has, and which changed since.

The dataset, flights.parquet/, has a file a month with what each flight adds to the fleet.

What has not changed is not read again.
"""

import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.version import __version__
from groundstation.pipeline.many_flights.fleet.columns import DETAILS, FLIGHT_COLUMNS, dataset_schema
from groundstation.pipeline.many_flights.fleet.keys import (
    FlightKeys,
    read_keys,
)
from groundstation.pipeline.many_flights.inputs import is_flight, is_session
from groundstation.results.file_names import ARRAYS, SUMMARY

FLIGHTS = "flights.parquet"
_COLUMNS = [(column.name, column.kind, column.meaning) for column in FLIGHT_COLUMNS]
VERSION = repr((__version__, _COLUMNS, DETAILS))  # with another one everything is read again
SAMPLES_FILE = f"{ARRAYS}/heading_samples.parquet"
MOST_LISTED = 20_000  # flights: of more there is no index.json with a row of each, and no fleet.parquet
_VERSION = int.from_bytes(blake2b(VERSION.encode(), digest_size=8).digest(), "big")


class DamagedMonthError(GroundstationError):
    """A month of the dataset cannot be read; ``month`` says which."""

    def __init__(self, out: Path, month: str, found: str) -> None:
        place, hint = str(month_path(out, month)), "a run, or `report OUT`, makes it again from the flight folders"
        super().__init__(place, found, "a file of a run", hint)
        self.month = month


@dataclass(frozen=True)
class Scan:
    """The flight folders of an OUT as they stand.

    Parameters
    ----------
    out : Path
    fresh : FlightKeys
        Those that have not changed since the dataset was written.
    stale : tuple of str
        The others, in order.
    others : tuple of str
        Folders of sessions and plans.
    months : mapping
        How many flights the dataset has of each of its months.
    """

    out: Path
    fresh: FlightKeys
    stale: tuple[str, ...]
    others: tuple[str, ...]
    months: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.fresh) + len(self.stale)

    def with_sessions(self, names: Iterable[str]) -> "Scan":
        """The same with session folders that were made since."""
        return replace(self, others=tuple(sorted({*self.others, *names})))

    def with_only(self, flight_ids: Collection[str]) -> "Scan":
        """The same with some of the flights alone."""
        return replace(self, fresh=self.fresh.only(flight_ids), stale=())

    @property
    def sessions(self) -> list[Path]:
        """Session folders, in order."""
        return [self.out / name for name in self.others if is_session(self.out / name)]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All flight folders, in order."""
        return tuple(sorted((*self.fresh, *self.stale)))

    def table(self, columns: Sequence[str] | None = None) -> Any:
        """The shares of the fresh flights, or some columns of them, in the order of flight ids.

        Raises
        ------
        DamagedMonthError
            When a file of the dataset cannot be read.
        """
        import pyarrow as pa

        empty = dataset_schema().empty_table()
        empty = empty if columns is None else empty.select(_with_id(columns))
        return _sorted(pa.concat_tables([empty, *self.months_of(columns)]))

    def months_of(self, columns: Sequence[str] | None = None) -> Iterator[Any]:
        """The same, a month at a time.

        Raises
        ------
        DamagedMonthError
            When a file of the dataset cannot be read.
        """
        import pyarrow.parquet as pq

        for month, places in self.fresh.by_month().items():
            names = self.fresh.names_at(places)
            try:
                with pq.ParquetFile(month_path(self.out, month), page_checksum_verification=True) as file:
                    found = rows_of(file.read(None if columns is None else _with_id(columns)), names)
            except (OSError, ValueError, KeyError) as error:
                raise DamagedMonthError(self.out, month, type(error).__name__) from error
            if len(found) != len(names):
                raise DamagedMonthError(self.out, month, f"{len(found)} flights instead of {len(names)}")
            yield found


def _with_id(columns: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(("flight_id", *columns)))


def _sorted(table: Any) -> Any:
    """Rows in the order of flight ids.

    The months are in that order too, but for flights without a time.
    """
    names = table.column("flight_id").to_pylist()
    return table if names == sorted(names) else table.take(np.argsort(np.array(names, dtype=object), kind="stable"))


def scan(out: Path) -> Scan:
    """Look at the flight folders of an OUT and at the dataset.

    Of a known flight only times and sizes are asked for.
    """
    by_month = _keys_by_month(out)
    keys = FlightKeys.joined(list(by_month.values()))
    stamps, root = dict(zip(keys.names, keys.stamps(), strict=True)), str(out)
    fresh: list[str] = []
    changed: list[str] = []
    for name in names_in(out):
        if (stamp := stamp_of(root, name)) is not None:
            (fresh if stamps.get(name) == stamp else changed).append(name)
    stale: list[str] = []
    others: list[str] = []
    for name in sorted(changed):
        (stale if is_flight(out / name) else others).append(name)
    months = {month: len(found) for month, found in by_month.items()}
    known = keys if len(fresh) == len(keys) else keys.only(fresh)
    return Scan(out, known, tuple(stale), tuple(others), months)


def remembered(out: Path) -> FlightKeys:
    """Keys of the flights of an OUT, also of those that have changed since or are gone."""
    return FlightKeys.joined(list(_keys_by_month(out).values()))


def _keys_by_month(out: Path) -> dict[str, FlightKeys]:
    return {path.stem: read_keys(out, path.stem) for path in sorted((out / FLIGHTS).glob("*.parquet"))}


def names_in(out: Path) -> list[str]:
    """Names of what is in an OUT and not hidden, flight folders among it, in no order."""
    try:
        return [name for name in os.listdir(out) if name[0] != "."]  # noqa: PTH208 (an object each, and 0.2 s of 100 000)
    except FileNotFoundError:
        return []


def stamp_of(out: Path | str, name: str) -> int | None:
    """Stamp of a flight: times and sizes that change with it, in one number.

    None where there is no summary.

    Asked for are the folder, whose time every file that is put there or replaced changes, the summary and the samples.
    """
    path = f"{out}/{name}"  # a Path costs more than the question
    try:
        folder, summary = os.stat(path), os.stat(f"{path}/{SUMMARY}")  # noqa: PTH116
    except OSError:
        return None
    told = folder.st_mtime_ns, 0, summary.st_mtime_ns, summary.st_size
    try:
        samples = os.stat(f"{path}/{SAMPLES_FILE}")  # noqa: PTH116
    except OSError:
        return hash((_VERSION, *told))
    return hash((_VERSION, *told, samples.st_mtime_ns, samples.st_size))  # of whole numbers: the same in every process


def month_path(out: Path, month: str) -> Path:
    return out / FLIGHTS / f"{month}.parquet"


def rows_of(table: Any, keys: Iterable[str]) -> Any:
    """The rows of some flights, in the order of their ids."""
    wanted, names = sorted(keys), table.column("flight_id").to_pylist()
    if names == wanted:
        return table
    places = {name: place for place, name in enumerate(names)}
    return table.take(np.array([places[name] for name in wanted if name in places], dtype=np.int64))
