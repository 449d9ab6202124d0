"""Bring the dataset of flights up to date.

Months with flights that are new, changed or gone are written again.

The files of the dataset are a function of the flights alone. Beside them, hidden, stands for each month what tells
whether a flight folder has changed since, and what a run must know of flights that it does not touch. Both are replaced
whole, the hidden one last, so that a run that is killed leaves a month that is written again.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.fleet.columns import FlightShare, dataset_schema
from groundstation.pipeline.many_flights.fleet.keys import FlightKeys, Key, key_path, month_of, read_keys, write_keys
from groundstation.pipeline.many_flights.fleet.rows import share_of
from groundstation.pipeline.many_flights.fleet.samples import SampleStore
from groundstation.pipeline.many_flights.fleet.scan import FLIGHTS, Scan, month_path, rows_of, scan, stamp_of
from groundstation.pipeline.many_flights.fleet.table import to_arrow
from groundstation.pipeline.many_flights.processes.crew import Crew, in_turn
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Listener, silent
from groundstation.results.files import parquet_bytes, utf8_text, write_bytes

MOST_READ_HERE = 300  # flights, by the process that leads a run
MOST_READ_EARLY = 1000  # logs of a run whose shares are read as their flights end; of more, all workers read them


@dataclass(frozen=True)
class MonthJob:
    """Month of the dataset to write: flights kept as they are, and flights to read."""

    out: Path
    month: str
    kept: frozenset[str]
    read: tuple[str, ...]

    @property
    def log(self) -> str:
        """Path of its file, by which messages name it."""
        return str(month_path(self.out, self.month))

    @property
    def name(self) -> str:
        """The same in short."""
        return self.month


class EarlyShares:
    """Shares of flights in the fleet, read as each flight ends, with the stamp of its folder.

    The process that leads a run waits while others compute: reading then costs a user no time. At the end, the shares
    of 64 flights took as long as two flights.

    Parameters
    ----------
    out : Path
        Holds the flight folders, and the samples that are put there with each share.
    """

    def __init__(self, out: Path) -> None:
        self._out, self._samples = out, SampleStore(out)
        self._found: dict[str, tuple[int, FlightShare]] = {}

    def read(self, flight_ids: Iterable[str]) -> None:
        """Read the shares of flights that are in place.

        One that cannot be read is left out: whoever puts the fleet together reads it again, and tells why.
        """
        for name in flight_ids:
            stamp = stamp_of(self._out, name)
            with suppress(Exception):
                if stamp is not None:
                    self._found[name] = stamp, share_of(self._out / name, self._samples)

    def of(self, name: str, stamp: int | None) -> FlightShare | None:
        """Share of a flight whose folder has this stamp; None where none was read with it."""
        found = self._found.get(name)
        return found[1] if found is not None and found[0] == stamp else None

    def unread(self, flight_ids: Iterable[str]) -> list[str]:
        """Return those of the flights that have not been read."""
        return [name for name in flight_ids if name not in self._found]


def refresh(out: Path, crew: Crew | None = None, early: EarlyShares | None = None) -> tuple[Scan, tuple[Outcome, ...]]:
    """Bring the datasets of flights and of samples up to date with the flight folders.

    Parameters
    ----------
    out : Path
    crew : Crew, optional
        Who reads the folders that changed, where they are many; left out: this process.
    early : EarlyShares, optional
        Shares of flights that have been read already.

    Returns
    -------
    Scan, tuple of Outcome
        After it, ``stale`` has the flights that cannot be read; and what could not be written.
    """
    before, samples = scan(out), SampleStore(out)
    there, known = samples.files(), before.fresh.column("samples")
    others = there.keys() - set(known)
    lost = set(known).difference((name for name, size in there.items() if size), ("",))
    fresh = before.fresh.without(lost, "samples")
    jobs = list(_jobs(before, fresh))
    here: Crew = partial(in_turn, listen=silent)
    early = EarlyShares(out) if early is None else early
    if crew is not None and sum(len(early.unread(job.read)) for job in jobs) > MOST_READ_HERE:
        ended = dict(crew(enumerate(jobs), write_month))
    else:
        ended = dict(here(enumerate(jobs), partial(write_month, early=early)))
    problems = tuple(one for _, one in sorted(ended.items()) if one.state == "failed")
    if problems:
        return scan(out), problems
    after = _after(before, fresh, jobs)
    if others:
        others.difference_update(after.fresh.column("samples"))
        samples.remove(name for name in others if Path(name).stem not in after.stale)
    return after, ()


def _after(before: Scan, fresh: FlightKeys, jobs: Sequence[MonthJob]) -> Scan:
    """The scan once some months are written: what is in none of them could not be read."""
    if not jobs:
        return replace(before, fresh=fresh)
    new = {job.month: read_keys(before.out, job.month) for job in jobs}
    unchanged = [places for month, places in fresh.by_month().items() if month not in new]
    keys = FlightKeys.joined([*map(fresh.at, unchanged), *new.values()])
    stale = sorted(name for job in jobs for name in (*job.kept, *job.read) if name not in new[job.month])
    months = {**before.months, **{month: len(found) for month, found in new.items()}}
    return replace(before, fresh=keys, stale=tuple(stale), months=months)


def _jobs(before: Scan, fresh: FlightKeys) -> Iterator[MonthJob]:
    """Months to write: those with flights that changed or are gone."""
    lost = set(before.fresh).difference(fresh) if len(before.fresh) > len(fresh) else ()
    read: dict[str, list[str]] = {}
    for name in sorted({*before.stale, *lost}):
        read.setdefault(month_of(name), []).append(name)
    kept = _names_by_month(fresh)
    gone = (month for month, count in before.months.items() if count != len(kept.get(month, ())))
    for month in sorted({*read, *gone}):
        yield MonthJob(before.out, month, frozenset(kept.get(month, ())), tuple(read.get(month, ())))


def _names_by_month(keys: FlightKeys) -> dict[str, list[str]]:
    return {month: keys.names_at(places) for month, places in keys.by_month().items()}


def restamp(out: Path, names: Iterable[str]) -> None:
    """Note how flight folders stand now.

    Changes made since the folders were read do not concern the dataset.
    """
    import pyarrow as pa

    by_month: dict[str, set[str]] = {}
    for name in names:
        by_month.setdefault(month_of(name), set()).add(name)
    for month, changed in sorted(by_month.items()):
        keys = read_keys(out, month)
        stamps = [
            stamp_of(out, name) or 0 if name in changed else stamp
            for name, stamp in zip(keys.names, keys.stamps(), strict=True)
        ]
        place = keys.table.schema.get_field_index("stamp")
        write_keys(out, month, FlightKeys(keys.table.set_column(place, "stamp", pa.array(stamps, pa.int64()))))


def forget_month(out: Path, month: str) -> None:
    """Remove a month of the dataset: its flights are read again."""
    for path in (key_path(out, month), month_path(out, month)):
        path.unlink(missing_ok=True)


def write_month(job: MonthJob, listen: Listener = silent, early: EarlyShares | None = None) -> Outcome:
    """Write one month of the dataset, and the samples of the flights that changed.

    The outcome says what is wrong.
    """
    try:
        _write(job, EarlyShares(job.out) if early is None else early)
    except OSError as error:
        reason = f"{job.out}: {FLIGHTS} and the samples of {job.month} cannot be written ({error.strerror or error})"
        return Outcome(job.log, "failed", reason, is_beside=True)
    return Outcome(job.log, "done", "", is_beside=True)


def _write(job: MonthJob, early: EarlyShares) -> None:
    import pyarrow as pa

    keys = read_keys(job.out, job.month).only(job.kept)
    old = rows_of(_read(month_path(job.out, job.month)), keys)
    keys = keys.only(old.column("flight_id").to_pylist())
    samples, shares = SampleStore(job.out), []
    new: list[Key] = []
    for name in sorted({*job.read, *job.kept}.difference(keys)):
        stamp = stamp_of(job.out, name)
        try:
            share = early.of(name, stamp) or share_of(job.out / name, samples)
        except GroundstationError:  # it is told of where the fleet is put together
            continue
        shares.append(share)
        new.append(key_of(share, stamp or 0))
    put_month(
        job.out, job.month, pa.concat_tables([old, to_arrow(shares)]), FlightKeys.joined([keys, FlightKeys.of(new)])
    )


def put_month(out: Path, month: str, table: Any, keys: FlightKeys) -> None:
    """Put a month of the dataset.

    It has the shares of the flights that have a key, in the order of their ids.
    """
    if not len(keys):
        forget_month(out, month)
        return
    path = month_path(out, month)
    path.parent.mkdir(exist_ok=True)
    write_bytes(path, parquet_bytes(rows_of(table, keys)))
    write_keys(out, month, keys)


def _read(path: Path) -> Any:
    """A file of the dataset; an empty one where there is none, or one of another version."""
    import pyarrow.parquet as pq

    empty = dataset_schema().empty_table()
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            found = file.read()
    except (OSError, ValueError):
        return empty
    return found if found.schema.equals(empty.schema, check_metadata=True) else empty


def key_of(share: FlightShare, stamp: int) -> Key:
    """Key of a flight whose folder had this stamp when its share was read."""
    row, start_ns = share.row, share.row["start_utc"]
    duration_s = row["duration_s"]
    is_timed = start_ns is not None and duration_s == duration_s
    end_ns = start_ns + round(duration_s * NS_PER_S) if is_timed else None
    path, name, hears = map(utf8_text, (share.path, share.link_name, "\n".join(share.hears)))
    sha256 = str(share.index.sha256)
    parts = "\n".join(share.parts)
    return Key(row["flight_id"], stamp, path, sha256, name, hears, start_ns, end_ns, share.samples, parts)
