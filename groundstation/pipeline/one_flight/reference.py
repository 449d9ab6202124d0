"""Reference beside a log: any file that a reader knows.

It is put on the flight's clock by UTC and kept as ``truth``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.climb import OPPOSITE, climb_agreement
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.findings import Finding
from groundstation.base.geodesy import METRES_PER_DEG
from groundstation.base.records import HEADING_IS_TRACK, MAX_BATCH_ROWS, Damage, Int64Array, RecordBatch
from groundstation.base.signals import TOPICS, kind_of, topics_of_kind
from groundstation.base.timescales import GPS_EPOCH_NS, gps_week_to_utc_ns, leap_seconds_at, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.pipeline.one_flight.configuration import References
from groundstation.pipeline.one_flight.log import Log, open_log

if TYPE_CHECKING:
    from groundstation.tables.table import Flight, Table

TRUTH = "truth"
FACTS = "truth."  # how the facts about a reference begin in the metadata of a flight
WEEK_NS = 604_800 * NS_PER_S
NS_PER_MS = 1_000_000
POSITION = ("latitude_deg", "longitude_deg")
HEADING = "true_heading_deg"
HEIGHTS = ("altitude_ellipsoid_m", "altitude_msl_m")
DOWN = "velocity_down_mps"
NEAR_M, NEAR_SHARE, LEAST_NEAR = 30.0, 0.95, 30  # of an INS from its GNSS, for so much of them, of so many
ANGLES = (HEADING, "roll_deg")
_FIELDS = frozenset(one.name for one in TOPICS[TRUTH])


@dataclass(frozen=True)
class Reference:
    """File that may judge a flight, with its best topic.

    Its times are UTC, or seconds of a GPS week that the flight must tell. ``damages`` are what its reader could not
    read.
    """

    name: str
    sha256: str
    reader: str
    table: "Table"
    is_weekly: bool
    damages: tuple[Damage, ...] = ()

    @property
    def facts(self) -> Mapping[str, str]:
        """Facts about it for the metadata of a flight."""
        told = {"source_name": self.name, "sha256": self.sha256, "reader": self.reader, "topic": self.table.topic}
        return {FACTS + name: value for name, value in told.items()}


@dataclass(frozen=True)
class Laid:
    """Reference on the clock of a flight: batches of ``truth``, metadata, findings."""

    batches: tuple[RecordBatch, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    def within(self, start_ns: int, end_ns: int) -> "Laid":
        """Return its part between two times, both included."""
        parts = []
        for batch in self.batches:
            assert batch.time_ns is not None, "a reference is on the flight's clock"
            first, end = np.searchsorted(batch.time_ns, (start_ns, end_ns + 1))
            parts += [batch.take(slice(int(first), int(end)))] if first < end else []
        return Laid(tuple(parts), self.facts if parts else {}, self.findings)


def laid_beside(log_name: str, span_ns: tuple[int, int], has_utc: bool, references: References) -> Laid:
    """Find the reference of a flight and put it on its clock; empty where no file is given.

    Parameters
    ----------
    log_name : str
    span_ns : (int, int)
        Corrected times of the log's first and last record.
    has_utc : bool
        Whether those are UTC.
    references : References

    Raises
    ------
    GroundstationError
        When a file cannot be read, several overlap, or one is expected and none overlaps or the log has no UTC.
    """
    if not references.paths:
        return Laid()
    from groundstation.tables.assemble import batches_from_flight
    from groundstation.tables.table import Flight

    if not has_utc and references.is_expected:
        raise GroundstationError(log_name, "a log without UTC", "UTC, which a reference needs")
    if not has_utc:
        text = "no reference used: the log has no UTC, which a reference needs"
        return Laid(findings=(Finding("info", "reference.none", text),))
    found, unread = [], []
    for path in references.paths:
        try:
            table = _of_its_time(path, span_ns, references.topic)
        except GroundstationError as error:
            if len(references.paths) == 1:
                raise
            unread.append(Finding("warn", "reference.unreadable", str(error), TRUTH))
            continue
        if table is not None and len(table):
            found.append((load_reference(path, references.topic), table))
    if len(found) > 1:
        names = ", ".join(reference.name for reference, _ in found)
        raise GroundstationError(log_name, f"several references cover its time: {names}", "one", "name the one to use")
    if not found:
        nothing = _nothing(log_name, span_ns, references)
        return replace(nothing, findings=(*unread, *nothing.findings))
    reference, table = found[0]
    table, upward = _without_upward(reference.name, table)
    truth = Flight({TRUTH: replace(table, topic=TRUTH)}, {}, int(table.time_ns[0]), True)
    findings = (*unread, *_findings(reference, table), *upward)
    return Laid(tuple(batches_from_flight(truth, MAX_BATCH_ROWS)), reference.facts, findings)


def _of_its_time(path: Path, span_ns: tuple[int, int], named: str) -> "Table | None":
    """Return the part of a reference at the time of a log, on UTC; None without one.

    A file of another time is not read a second time.
    """
    ends_ns, is_weekly = _ends_of(*_as_it_stands(path), named)
    spans = [_utc_of_week(week, ends_ns) for week in _weeks_about(span_ns)] if is_weekly else [ends_ns]
    if not any(first <= span_ns[1] and last >= span_ns[0] for first, last in spans):
        return None
    return _cropped(_on_utc(load_reference(path, named), span_ns), span_ns)


def _without_upward(name: str, table: "Table") -> "tuple[Table, tuple[Finding, ...]]":
    """Leave out a downward velocity that goes up with the height; return the finding too."""
    height = next((one for one in HEIGHTS if table.has(one)), "")
    if not height or not table.has(DOWN):
        return table, ()
    time_s = (table.time_ns - table.time_ns[0]) / NS_PER_S
    found = climb_agreement(time_s, table.values(height), table.values(DOWN))
    if found is None or found >= OPPOSITE:
        return table, ()
    text = (
        f"{DOWN} of {name} goes up with its height (correlation with its rate of sinking {found:.2f}): vertical "
        "velocity is not judged"
    )
    columns = {one: column for one, column in table.columns.items() if one != DOWN}
    return replace(table, columns=columns), (Finding("warn", "reference.vertical_velocity", text, TRUTH),)


def _nothing(log_name: str, span_ns: tuple[int, int], references: References) -> Laid:
    if references.is_expected:
        names, theirs = (
            ", ".join(tell(path, references.topic) for path in references.paths) for tell in (_name_of, _span_text)
        )
        when = " to ".join(utc_ns_to_iso(one, 0) for one in span_ns)
        raise GroundstationError(names, f"a reference that covers {theirs}", f"one that covers {log_name}, {when}")
    text = f"none of {len(references.paths)} references covers the time of this log"
    return Laid(findings=(Finding("info", "reference.none", text),))


def _name_of(path: Path, named: str) -> str:
    return load_reference(path, named).name


def _span_text(path: Path, named: str) -> str:
    reference = load_reference(path, named)
    if reference.is_weekly:
        first, last = (one / NS_PER_S for one in (reference.table.time_ns[0], reference.table.time_ns[-1]))
        return f"seconds {first:.0f} to {last:.0f} of a GPS week"
    return " to ".join(utc_ns_to_iso(int(one), 0) for one in (reference.table.time_ns[0], reference.table.time_ns[-1]))


def _findings(reference: Reference, table: "Table") -> list[Finding]:
    name = reference.name
    samples = counted(len(table), "sample")
    text = f"{name} ({reference.reader}, {reference.table.topic}) judges this flight: {samples} as truth"
    found = [Finding("info", "reference.laid", text, TRUTH)]
    if reference.is_weekly:
        text = f"{name} has seconds of a GPS week but no date: the week of the log is used"
        found.append(Finding("info", "reference.week", text, TRUTH))
    lost = [damage for damage in reference.damages if damage.loses_data]
    if lost:
        text = f"{name}: {lost[0].what}: {lost[0].count} ({lost[0].place})"
        more = f", and {len(lost) - 1} more places" if len(lost) > 1 else ""
        found.append(Finding("warn", "reference.damaged", text + more, TRUTH, lost[0].place, len(lost)))
    return found


def load_reference(path: Path, named: str = "") -> Reference:
    """Read a reference by a named topic or the best; the last few stay in memory.

    Raises
    ------
    UnreadableLogError
        When no reader claims it, or it holds neither positions, velocities nor attitude.
    """
    return _load(*_as_it_stands(path), named)


def _as_it_stands(path: Path) -> tuple[Path, int, int]:
    """Return a file with the time of its last change and its size."""
    try:
        status = path.stat()
    except OSError as error:
        raise UnreadableLogError(str(path), error.strerror or "cannot be opened", "a reference") from error
    return path, status.st_mtime_ns, status.st_size


@cache
def _ends_of(path: Path, time_ns: int, size: int, named: str) -> tuple[Int64Array, bool]:
    """Return first and last time of a file, shape (2,), and whether they are of a GPS week."""
    reference = _load(path, time_ns, size, named)
    times_ns = reference.table.time_ns
    return np.array([times_ns.min(), times_ns.max()]), reference.is_weekly


@lru_cache(maxsize=4)
def _load(path: Path, _time_ns: int, _size: int, named: str) -> Reference:
    log = open_log(path)
    flight, damages, has_utc = _read(log)
    if named and not (named in flight and len(flight[named])):
        raise UnreadableLogError(path.name, f"no topic {named}", "the topic that [reference] names")
    topic = named or best_topic(flight)
    if not topic:
        raise UnreadableLogError(path.name, "no position, velocity or attitude", "a reference")
    table = flight[topic].trusted()
    if not len(table):
        raise UnreadableLogError(path.name, f"no sample of {topic} that its source trusts", "a reference")
    if f"{HEADING_IS_TRACK}.{topic}.true_heading_deg" in flight.metadata:  # it says nothing of the nose
        table = replace(table, columns={name: one for name, one in table.columns.items() if name != HEADING})
    table = replace(table, columns={name: one for name, one in table.columns.items() if name in _FIELDS})
    is_weekly = not has_utc and log.source.reader.startswith("sbet")
    if not has_utc and not is_weekly:
        raise UnreadableLogError(path.name, "no UTC", "a reference with absolute time")
    if is_weekly:
        table = replace(table, time_ns=np.asarray(table.device_time_ns.values, dtype=np.int64))
    return Reference(log.source.name, log.source.sha256, log.source.reader, table, is_weekly, damages)


def _read(log: Log) -> "tuple[Flight, tuple[Damage, ...], bool]":
    """Read the tables of the canonical topics of a log.

    Returns its damage too, and whether its times are UTC.
    """
    from groundstation.integrity.ordering import corrected
    from groundstation.integrity.survey import survey
    from groundstation.store.reader import read_info
    from groundstation.tables.assemble import flight_from_batches

    def tables(
        batches: Sequence[RecordBatch], metadata: Mapping[str, str], has_utc: bool, rows: Mapping[str, int]
    ) -> "Flight":
        name = log.source.name
        return flight_from_batches(batches, metadata=metadata, has_utc=has_utc, source_name=name, rows=rows)

    kinds = (TRUTH, "ins", "gnss")
    if log.is_store:
        info, items = read_info(log.path), list(log.items())
        kept = [one for one in items if isinstance(one, RecordBatch) and kind_of(one.topic) in kinds]
        damages = tuple(one for one in items if isinstance(one, Damage))
        return tables(kept, info.metadata, info.has_utc, info.ledger.rows), damages, info.has_utc
    replay = log.replay()
    found = survey(replay)
    kept = [one for one in corrected(replay, found.clock, for_tables=True) if kind_of(one.topic) in kinds]
    told = {f"{one.code}.{one.topic}.{name}": one.text for one in found.remarks for name in one.fields}
    return (
        tables(kept, {**found.header.metadata, **told}, found.clock.is_absolute, found.ledger.rows),
        found.damages,
        found.clock.is_absolute,
    )


def best_topic(flight: "Flight") -> str:
    """Return the topic of a log that judges best.

    Its truth, else an INS that GNSS corrects, else GNSS, else any. With GNSS in the same file an INS is taken as
    corrected by it where it stays near to it; one that drifts is not: then GNSS is the reference.
    """
    topics = [topic for topic in flight.topics() if len(flight[topic])]
    with_place = [topic for topic in topics if flight[topic].has(*POSITION)]
    inertial = topics_of_kind("ins", with_place)
    aided = [topic for topic in inertial if _is_aided(flight, topic)]
    aided += [topic for topic in inertial if topic not in aided and _stays_near(flight, topic)]
    listed = (
        *topics_of_kind(TRUTH, topics),
        *aided,
        *sorted(topics_of_kind("gnss", with_place), key=lambda topic: not flight[topic].has("horizontal_sigma_m")),
        *topics_of_kind("ins", with_place),
        *(topic for topic in topics if flight[topic].has("velocity_north_mps") or flight[topic].has(*ANGLES)),
    )
    return next(iter(listed), "")


def _is_aided(flight: "Flight", topic: str) -> bool:
    modes = flight[topic].text("mode")
    return flight.metadata.get("ins_kind") == "gnss_aided" or bool(np.mean(modes == "gnss_aided") > 0.5)


def _stays_near(flight: "Flight", topic: str) -> bool:
    """Tell whether an INS stays as near to the GNSS of its file as a corrected one."""
    if flight.metadata.get("ins_kind") == "unaided":
        return False
    ins = flight[topic]
    for name in topics_of_kind("gnss", flight.topics()):
        gnss = flight[name].trusted()
        if not gnss.has(*POSITION) or len(gnss) < LEAST_NEAR or len(ins) < 2:
            continue
        row = np.searchsorted(ins.time_ns, gnss.time_ns).clip(0, len(ins) - 1)
        beside = np.abs(ins.time_ns[row] - gnss.time_ns) <= NS_PER_S
        latitude, longitude = (gnss.values(one) for one in POSITION)
        north_deg = ins.values(POSITION[0])[row] - latitude
        east_deg = wrap_180(ins.values(POSITION[1])[row] - longitude) * np.cos(np.deg2rad(latitude))
        far_m = METRES_PER_DEG * np.hypot(north_deg, east_deg)[beside]
        far_m = far_m[np.isfinite(far_m)]
        if len(far_m) >= LEAST_NEAR:
            return float(np.quantile(far_m, NEAR_SHARE)) <= NEAR_M
    return False


def _on_utc(reference: Reference, span_ns: tuple[int, int]) -> "Table":
    """Return the table on UTC; seconds of a week go to the week that overlaps the log most."""
    if not reference.is_weekly:
        return reference.table
    tables = [
        replace(reference.table, time_ns=_utc_of_week(one, reference.table.time_ns)) for one in _weeks_about(span_ns)
    ]
    return max(tables, key=lambda table: len(_cropped(table, span_ns)))


def _weeks_about(span_ns: tuple[int, int]) -> tuple[int, ...]:
    """Return GPS weeks in which a log may lie: that of its middle, and those beside it."""
    middle_ns = (span_ns[0] + span_ns[1]) // 2
    week = (middle_ns + leap_seconds_at(middle_ns) * NS_PER_S - GPS_EPOCH_NS) // WEEK_NS
    return week, week - 1, week + 1


def _utc_of_week(week: int, week_ns: Int64Array) -> Int64Array:
    whole_ms, rest_ns = np.divmod(week_ns, NS_PER_MS)
    return np.asarray(gps_week_to_utc_ns(int(week), whole_ms) + rest_ns)


def _cropped(table: "Table", span_ns: tuple[int, int]) -> "Table":
    """Return the part of a reference at the time of the log.

    The flight begins and ends with what was recorded.
    """
    return table.take((table.time_ns >= span_ns[0]) & (table.time_ns <= span_ns[1]))
