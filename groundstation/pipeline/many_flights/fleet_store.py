"""flights.parquet/: what every flight adds to the fleet, one file a month; what has not changed is not read again.

The files of the dataset are a function of the flights alone. Beside them, hidden, stands for each month what tells
whether a flight folder has changed since, and what a run must know of flights that it does not touch. Both are replaced
whole, the hidden one last, so that a run that is killed leaves a month that is written again.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple

from groundstation.base.errors import GroundstationError
from groundstation.base.units import NS_PER_S
from groundstation.base.version import __version__
from groundstation.pipeline.many_flights.fleet_columns import FLIGHT_COLUMNS
from groundstation.pipeline.many_flights.fleet_samples import SampleStore
from groundstation.pipeline.many_flights.fleet_share import DETAILS, FlightShare, parquet_bytes, share_of, to_arrow
from groundstation.pipeline.many_flights.inputs import is_flight, is_session
from groundstation.pipeline.many_flights.workers import Crew, in_turn
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Listener, silent
from groundstation.results.file_names import ARRAYS, MANIFEST, SUMMARY
from groundstation.results.files import utf8_text, write_bytes

FLIGHTS, KEYS = "flights.parquet", ".flights"
UNKNOWN = "unknown"
_COLUMNS = [(column.name, column.kind, column.meaning) for column in FLIGHT_COLUMNS]
VERSION = repr((__version__, _COLUMNS, DETAILS))  # with another one everything is read again
STAMPED = ("", SUMMARY, MANIFEST, f"{ARRAYS}/heading_samples.parquet")  # "": the folder, whose time its names change
MOST_LISTED = 20_000  # flights: of more there is no index.json with a row of each, and no fleet.parquet
MOST_READ_HERE = 300  # flights, by the process that leads a run
_VERSION = int.from_bytes(blake2b(VERSION.encode(), digest_size=8).digest(), "big")


class Key(NamedTuple):
    """What is known of a flight folder without reading it; ``stamp`` is of its files when it was read."""

    flight_id: str
    stamp: int
    path: str
    sha256: str
    link_name: str
    hears: str
    start_ns: int | None
    end_ns: int | None
    samples: str


@dataclass(frozen=True)
class Scan:
    """The flight folders of an OUT as they stand.

    Parameters
    ----------
    out : Path
    fresh : mapping
        Those that have not changed since the dataset was written, by flight id, in that order.
    stale : tuple of str
        The others, in order.
    others : tuple of str
        Folders of sessions and plans.
    months : mapping
        How many flights the dataset has of each of its months.
    """

    out: Path
    fresh: Mapping[str, Key]
    stale: tuple[str, ...]
    others: tuple[str, ...]
    months: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.fresh) + len(self.stale)

    def with_sessions(self, names: Iterable[str]) -> "Scan":
        """The same with session folders that were made since."""
        return replace(self, others=tuple(sorted({*self.others, *names})))

    @property
    def sessions(self) -> list[Path]:
        """Session folders, in order."""
        return [self.out / name for name in self.others if is_session(self.out / name)]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All flight folders, in order."""
        return tuple(sorted((*self.fresh, *self.stale)))

    def table(self, columns: Sequence[str] | None = None) -> Any:
        """The shares of the fresh flights, or some columns of them, in the order of flight ids."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        months = sorted({month_of(name) for name in self.fresh})
        wanted = None if columns is None else list(dict.fromkeys(("flight_id", *columns)))
        tables = [to_arrow([]) if wanted is None else to_arrow([]).select(wanted)]
        place, hint = str(self.out / FLIGHTS), "remove it: `report OUT` makes it again"
        try:
            for month in months:
                with pq.ParquetFile(_path(self.out, month)) as file:
                    tables.append(file.read(wanted))
            found = _chosen(pa.concat_tables(tables), self.fresh)
        except (OSError, ValueError) as error:
            raise GroundstationError(place, type(error).__name__, "files of a run", hint) from error
        if len(found) != len(self.fresh):
            raise GroundstationError(place, f"{len(found)} flights", f"{len(self.fresh)}", hint)
        return found


def month_of(flight_id: str) -> str:
    """The month by whose name a flight's file goes.

    Examples
    --------
    >>> month_of("20260504T060000Z_A12_7"), month_of("NOTIME_0123abcd")
    ('2026-05', 'unknown')
    """
    digits, letter = flight_id[:8], flight_id[8:9]
    return f"{digits[:4]}-{digits[4:6]}" if letter == "T" and digits.isascii() and digits.isdecimal() else UNKNOWN


def scan(out: Path) -> Scan:
    """Look at the flight folders of an OUT and at the dataset: of a known flight only times and sizes are asked for."""
    by_month = {path.stem: _keys(out, path.stem) for path in sorted((out / FLIGHTS).glob("*.parquet"))}
    keys = {key.flight_id: key for found in by_month.values() for key in found}
    fresh: dict[str, Key] = {}
    stale: list[str] = []
    others: list[str] = []
    for name in sorted(_folder_names(out)):
        key, stamp = keys.get(name), stamp_of(out, name)
        if key is not None and key.stamp == stamp:
            fresh[name] = key
        elif stamp is not None:
            (stale if is_flight(out / name) else others).append(name)
    return Scan(out, fresh, tuple(stale), tuple(others), {month: len(found) for month, found in by_month.items()})


def _folder_names(out: Path) -> list[str]:
    try:
        with os.scandir(out) as entries:
            return [entry.name for entry in entries if entry.name[0] != "." and entry.is_dir()]
    except FileNotFoundError:
        return []


def stamp_of(out: Path, name: str) -> int | None:
    """Times and sizes of what a share is made from, in one number; None where there is no summary."""
    told: list[int] = []
    for file in STAMPED:
        try:
            found = os.stat(f"{out}/{name}/{file}")  # noqa: PTH116 - a Path costs more than the question
            told += [found.st_mtime_ns, found.st_size if file else 0]
        except OSError:
            if file == SUMMARY:
                return None
            told += [0, -1]
    return hash((_VERSION, *told))  # of whole numbers: the same in every process


@dataclass(frozen=True)
class MonthJob:
    """A month of the dataset to be written: flights that are kept as they are, flights to read."""

    out: Path
    month: str
    kept: frozenset[str]
    read: tuple[str, ...]

    @property
    def log(self) -> str:
        """What it is told by."""
        return str(_path(self.out, self.month))

    @property
    def name(self) -> str:
        """The same in short."""
        return self.month


def refresh(out: Path, crew: Crew | None = None) -> tuple[Scan, tuple[Outcome, ...]]:
    """Bring the dataset of flights, and that of samples, up to what stands in the flight folders.

    Parameters
    ----------
    out : Path
    crew : Crew, optional
        Who reads the folders that changed, where they are many; left out: this process.

    Returns
    -------
    Scan, tuple of Outcome
        After it, ``stale`` has the flights that cannot be read; and what could not be written.
    """
    before, samples = scan(out), SampleStore(out)
    there = samples.files()
    fresh = {name for name, key in before.fresh.items() if not key.samples or key.samples in there}
    jobs = list(_jobs(before, fresh))
    here: Crew = partial(in_turn, listen=silent)
    is_much = crew is not None and sum(len(job.read) for job in jobs) > MOST_READ_HERE
    ended = dict((crew if crew is not None and is_much else here)(enumerate(jobs), write_month))
    problems = tuple(one for _, one in sorted(ended.items()) if one.state == "failed")
    if problems:
        return scan(out), problems
    keys = {name: before.fresh[name] for name in fresh}
    months = dict(before.months)
    for job in jobs:
        written = {key.flight_id: key for key in _keys(out, job.month)}
        keys, months[job.month] = keys | written, len(written)
    keys = {name: keys[name] for name in before.names if name in keys}
    unread = tuple(name for name in before.names if name not in keys)
    expected = {key.samples for key in keys.values()}
    samples.remove(name for name in there - expected if Path(name).stem not in unread)
    return Scan(out, keys, unread, before.others, months), ()


def _jobs(before: Scan, fresh: set[str]) -> Iterator[MonthJob]:
    """The months that are to be written: with flights that changed, and with some that are gone."""
    kept: dict[str, list[str]] = {}
    read: dict[str, list[str]] = {}
    for name in before.names:
        (kept if name in fresh else read).setdefault(month_of(name), []).append(name)
    for month in sorted({*before.months, *read}):
        if month in read or before.months.get(month) != len(kept.get(month, ())):
            yield MonthJob(before.out, month, frozenset(kept.get(month, ())), tuple(read.get(month, ())))


def write_month(job: MonthJob, listen: Listener = silent) -> Outcome:
    """Write one month of the dataset, and the samples of the flights that changed; its outcome says what is wrong."""
    try:
        _write(job)
    except OSError as error:
        reason = f"{job.out}: {FLIGHTS} and the samples of {job.month} cannot be written ({error.strerror or error})"
        return Outcome(job.log, "failed", reason)
    return Outcome(job.log, "done", "")


def _write(job: MonthJob) -> None:
    import pyarrow as pa

    keys = [key for key in _keys(job.out, job.month) if key.flight_id in job.kept]
    old = _chosen(_read(_path(job.out, job.month)), {key.flight_id: key for key in keys})
    samples, shares = SampleStore(job.out), []
    for name in sorted({*job.read, *job.kept} - set(old.column("flight_id").to_pylist())):
        stamp = stamp_of(job.out, name)
        try:
            share = share_of(job.out / name, samples)
        except GroundstationError:  # it is told of where the fleet is put together
            continue
        shares.append(share)
        keys.append(key_of(share, stamp or 0))
    put_month(job.out, job.month, pa.concat_tables([old, to_arrow(shares)]), keys)


def put_month(out: Path, month: str, table: Any, keys: Sequence[Key]) -> None:
    """Put a month of the dataset: the shares of the flights that have a key, in the order of their ids."""
    by_id = {key.flight_id: key for key in keys}
    paths = _path(out, month), _key_path(out, month)
    if not by_id:
        for path in paths:
            path.unlink(missing_ok=True)
        return
    for path, content in zip(paths, (_chosen(table, by_id), _key_table(by_id)), strict=True):
        path.parent.mkdir(exist_ok=True)
        write_bytes(path, parquet_bytes(content))


def _path(out: Path, month: str) -> Path:
    return out / FLIGHTS / f"{month}.parquet"


def _read(path: Path) -> Any:
    """A file of the dataset; an empty one where there is none, or one of another version."""
    import pyarrow.parquet as pq

    empty = to_arrow([])
    try:
        with pq.ParquetFile(path) as file:
            found = file.read()
    except (OSError, ValueError):
        return empty
    return found if found.schema.equals(empty.schema, check_metadata=True) else empty


def _chosen(table: Any, keys: Iterable[str]) -> Any:
    """The rows of some flights, in the order of their ids."""
    import numpy as np

    wanted, names = sorted(keys), table.column("flight_id").to_pylist()
    if names == wanted:
        return table
    places = {name: place for place, name in enumerate(names)}
    return table.take(np.array([places[name] for name in wanted if name in places], dtype=np.int64))


def _key_path(out: Path, month: str) -> Path:
    return out / KEYS / f"{month}.parquet"


def _keys(out: Path, month: str) -> list[Key]:
    """What is known of the flights of a month; nothing where it cannot be read."""
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(_key_path(out, month)) as file:
            table = file.read()
        return list(map(Key, *(table.column(name).to_pylist() for name in Key._fields)))
    except (OSError, ValueError, KeyError):
        return []


def key_of(share: FlightShare, stamp: int) -> Key:
    """What a run must know of a flight whose folder had a stamp when its share was read."""
    row, start_ns = share.row, share.row["start_utc"]
    duration_s = row["duration_s"]
    is_timed = start_ns is not None and duration_s == duration_s
    end_ns = start_ns + round(duration_s * NS_PER_S) if is_timed else None
    path, name, hears = map(utf8_text, (share.path, share.link_name, "\n".join(share.hears)))
    sha256 = str(share.index.sha256)
    return Key(row["flight_id"], stamp, path, sha256, name, hears, start_ns, end_ns, share.samples)


def _key_table(by_id: Mapping[str, Key]) -> Any:
    import pyarrow as pa

    numbers = ("stamp", "start_ns", "end_ns")
    columns = zip(*(by_id[name] for name in sorted(by_id)), strict=True)
    arrays = {
        name: pa.array(values, pa.int64() if name in numbers else pa.string())
        for name, values in zip(Key._fields, columns, strict=True)
    }
    return pa.table(arrays)
