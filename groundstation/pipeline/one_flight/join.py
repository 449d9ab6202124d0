"""Several logs of one flight as one MCAP.

Each is converted and put on one clock, and its topics get names of their own.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnreadableLogError, UsageError
from groundstation.base.findings import Finding
from groundstation.base.ledger import DamagedSpan, Ledger
from groundstation.base.records import HEADING_IS_TRACK, Damage, Int64Array, RecordBatch
from groundstation.base.source_units import PREFIX as UNITS
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.ledger import damage_entry
from groundstation.integrity.limits import Thresholds, shipped
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.continued import in_recordings, with_strangers
from groundstation.pipeline.one_flight.convert import Converted, census_of, convert_log, recounted
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import Log, as_log, open_one_of_several
from groundstation.pipeline.one_flight.missing_utc import with_next_step
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.store.info import StoreInfo
from groundstation.systems import systems
from groundstation.systems.joining import (
    FlightClock,
    JoinRecord,
    JoinStep,
    NoCommonClockError,
    NotOneFlightError,
    PlacedLog,
    Timed,
    name_in_flight,
)
from groundstation.tables.sources import TOGETHER

LABELS = "bcdefghijklmnopqrstuvwxyz"  # labels of the logs behind the first, whose topics keep their names
OF_FIELDS = ("derived.", f"{HEADING_IS_TRACK}.")  # keys about a field, <topic>.<field> behind them
OF_AN_INS = ("ins_serial", "ins_kind")  # <topic> behind the key of every other INS
OF_THE_AIRCRAFT = ("aircraft", "flight", "start_utc")  # taken from another log where the first lacks them


@dataclass(frozen=True)
class _Part:
    """One log, converted: its MCAP, its tables, and its clock against that of the flight.

    ``relation`` is None for the log whose clock is that of the flight.
    """

    label: str
    log: Log
    mcap: Path
    converted: Converted
    timed: Timed
    relation: FlightClock | None = None

    def name(self, topic: str) -> str:
        """Return the name of one of its topics in the flight."""
        return name_in_flight(topic, self.label)

    def time_ns(self, own_ns: Int64Array) -> Int64Array:
        """Return its times on the clock of the flight."""
        return own_ns if self.relation is None else self.relation.first_time_ns(own_ns)

    @property
    def start_ns(self) -> int:
        """Time of its first sample on the clock of the flight."""
        return int(self.time_ns(np.array([self.timed.flight.start_ns]))[0])


def _step() -> JoinStep:
    step = systems().join
    if step is None:
        raise UsageError("--together", "no system that joins logs")
    return step


def joined_name(logs: Sequence[Log]) -> str:
    """Return the name of a flight of several logs."""
    return " + ".join(log.source.name for log in logs)


def join_files(
    paths: Sequence[Path], target: Path, configuration: Configuration, listen: Listener = silent
) -> Converted:
    """Write one MCAP of several logs of one flight, by their paths; see :func:`join_logs`.

    A file that no reader claims is left out as one that cannot be read.

    Raises
    ------
    UsageError
        When a path is missing or a folder, and as :func:`join_logs`, as is all else.
    """
    logs: list[Log] = []
    unclaimed: list[tuple[Path, GroundstationError]] = []
    for path in paths:
        if not path.exists():
            raise UsageError(str(path), "no such file")
        if as_log(path).is_dir():
            raise UsageError(str(path), "a folder", "the logs of one flight by name", "--together takes files")
        try:
            logs.append(open_one_of_several(path, configuration.profile_path, configuration.icds))
        except UnreadableLogError as error:
            unclaimed.append((path, error))
    if not logs and unclaimed:
        raise unclaimed[0][1]
    logs, used = with_strangers(logs, [path for path, _error in unclaimed])
    listen(Event("stage", joined_name(logs), "joining"))
    target.parent.mkdir(parents=True, exist_ok=True)
    settings = configuration.settings.of(_step().settings)
    left_out = [_left_out(path.name, error) for path, error in unclaimed if path not in used]
    return join_logs(logs, target, configuration.thresholds, settings=settings, left_out=left_out)


def join_logs(
    logs: Sequence[Log],
    target: Path,
    thresholds: Thresholds | None = None,
    *,
    settings: Any = None,
    left_out: Sequence[Damage] = (),
) -> Converted:
    """Write one MCAP of several logs of one flight.

    The flight has the clock of the first log that GNSS tells the time, else of the first with UTC, else of the first.
    Topics of the first log keep their names; those of the second end in ``.b``, of the third in ``.c``. A log that
    cannot be read is left out with a finding, as are those of ``left_out``, and the others close up; where one is left
    the flight is that of this log. Logs that nothing puts on one clock are one recording where one goes on from the
    other, however long after: they are read as one.

    Raises
    ------
    UsageError
        When fewer than two logs are given, or one of them twice.
    NotOneFlightError
        When two of them cannot be put on one clock.
    UnreadableLogError
        When none can be read.
    """
    limits, step = thresholds or shipped(), _step()
    settings = settings or step.settings()
    _require_different(logs, len(left_out))
    with TemporaryDirectory(prefix="groundstation-") as folder:
        parts, unread = _converted(logs, Path(folder), limits, step, settings)
        left_out = (*left_out, *unread)
        if len(parts) == 1:
            info = _alone(parts[0], target, left_out)
            return Converted(info, info.findings, bool(left_out) or parts[0].converted.has_lost_data)
        clock_of = next((one for one in parts if one.timed.gnss_time), None)
        clock_of = clock_of or next((one for one in parts if one.timed.flight.has_utc), parts[0])
        try:
            parts = [_related(one, clock_of, step, settings) for one in parts]
        except NotOneFlightError:
            whole = in_recordings([(one.log, one.converted, one.timed.flight) for one in parts])
            if len(whole) == len(parts):
                raise
            return join_logs(whole, target, thresholds, settings=settings, left_out=left_out)
        info = _written(parts, clock_of, step, target, limits, left_out)
    has_lost = bool(left_out) or any(one.converted.has_lost_data for one in parts)
    return Converted(info, info.findings, has_lost)


def _related(part: _Part, clock_of: _Part, step: JoinStep, settings: Any) -> _Part:
    if part is clock_of:
        return part
    try:
        return replace(part, relation=step.relate(clock_of.timed, part.timed, settings))
    except NoCommonClockError as error:
        without_utc = [one.log for one in (clock_of, part) if not one.timed.flight.has_utc]
        raise with_next_step(error, without_utc) from error


def _require_different(logs: Sequence[Log], left_out: int) -> None:
    count = sum(max(1, len(log.parts)) for log in logs) + left_out
    if not 2 <= count <= len(LABELS) + 1:
        raise UsageError(
            "--together", counted(count, "log"), f"2 to {len(LABELS) + 1} logs"
        )  # files of one recording count each
    first: dict[str, str] = {}
    for log in logs:
        if log.source.sha256 in first:
            raise UsageError(
                log.path.name, f"the same content as {first[log.source.sha256]}", "another log of the flight"
            )
        first[log.source.sha256] = log.path.name


def _converted(
    logs: Sequence[Log], folder: Path, limits: Thresholds, step: JoinStep, settings: Any
) -> tuple[list[_Part], list[Damage]]:
    """Convert the logs that can be read, and return a damage for each of the others.

    The first log has no label.
    """
    parts: list[_Part] = []
    left_out: list[Damage] = []
    error: GroundstationError | None = None
    for log in logs:
        label = ("", *LABELS)[len(parts)]
        mcap = folder / f"{label or 'a'}.mcap"
        try:
            converted = convert_log(log, mcap, limits)
            flight = read_flight(mcap, converted)
        except GroundstationError as reason:
            error = error or reason
            left_out.append(_left_out(log.source.name, reason))
            continue
        timed = step.timed(flight, converted.info.clock, converted.info.reader, settings)
        parts.append(_Part(label, log, mcap, converted, timed))
    if not parts:
        raise error or UnreadableLogError("--together", "no log")
    return parts, left_out


def _left_out(name: str, reason: GroundstationError) -> Damage:
    return Damage("unreadable_log", name, 1, f"log that is left out ({reason})")


def _told_left_out(left_out: Sequence[Damage]) -> Iterator[Finding]:
    for one in left_out:
        yield Finding("fail", "together.unreadable", f"{one.place}: {one.what}")


def _alone(part: _Part, target: Path, left_out: Sequence[Damage]) -> StoreInfo:
    """Write the MCAP of the only log that could be read, with findings on the others."""
    from groundstation.store.reader import read
    from groundstation.store.writer import StoreWriter

    info = part.converted.info
    told = replace(
        info,
        ledger=replace(info.ledger, damages=(*map(damage_entry, left_out), *info.ledger.damages)),
        findings=(*_told_left_out(left_out), *info.findings),
        damages=(*map(asdict, left_out), *info.damages),
    )
    with StoreWriter(target, told) as writer:
        for item in read(part.mcap):
            if isinstance(item, RecordBatch):
                writer.write(item)
    return told


def _written(
    parts: Sequence[_Part],
    clock_of: _Part,
    step: JoinStep,
    target: Path,
    limits: Thresholds,
    left_out: Sequence[Damage],
) -> StoreInfo:
    from groundstation.store.writer import StoreWriter

    start_ns = min(one.start_ns for one in parts)
    of_clock = clock_of.converted.info
    blank = replace(of_clock, start_ns=start_ns)
    infos: list[StoreInfo] = []
    placed: list[PlacedLog] = []
    with StoreWriter(target, blank) as writer:
        for part in parts:
            info = _renamed(part, of_clock, start_ns)
            census, mover = census_of(info, limits), _Mover(part)
            for batch in mover.batches():
                writer.write(batch)
                census.add(batch)
            if part is not clock_of:  # its times are others now
                info = recounted(info, [], census)
            infos.append(info)
            placed.append(_placed(part, census.rows, mover.reordered))
        writer.info = _merged(parts, infos, step.told(placed, start_ns), of_clock, left_out)
    return replace(writer.info, start_ns=start_ns)


def _placed(part: _Part, rows: int, reordered: int) -> PlacedLog:
    return PlacedLog(part.label, part.log.source, part.timed.flight.duration_s, part.relation, rows, reordered)


class _Mover:
    """Source of a log's batches, with times on the flight's clock and names in the flight."""

    def __init__(self, part: _Part) -> None:
        self._part = part
        self._last: dict[str, int] = {}
        self.reordered = 0

    def batches(self) -> Iterator[RecordBatch]:
        """Yield batches whose times never decrease within a topic.

        Where a stretch begins with a step back, records get the time of those before.
        """
        from groundstation.store.reader import read

        part = self._part
        for item in read(part.mcap):
            if not isinstance(item, RecordBatch) or item.time_ns is None or not len(item):
                continue
            time_ns = part.time_ns(item.time_ns)
            floor = self._last.get(item.topic, int(time_ns[0]))
            ordered = np.maximum.accumulate(np.maximum(time_ns, floor))
            self.reordered += int(np.count_nonzero(ordered != time_ns))
            self._last[item.topic] = int(ordered[-1])
            validity_ns = None if item.validity_time_ns is None else part.time_ns(item.validity_time_ns)
            yield replace(item, topic=part.name(item.topic), time_ns=ordered, validity_time_ns=validity_ns)


def _renamed(part: _Part, of_clock: StoreInfo, start_ns: int) -> StoreInfo:
    """Return the facts of a log with its topics' names in the flight.

    Places in time are by the flight's clock.
    """
    info = part.converted.info
    shift_s = (part.start_ns - start_ns) / NS_PER_S
    clock, log = ClockModel(is_absolute=of_clock.has_utc), part.log.source.name

    def moved(span: DamagedSpan) -> DamagedSpan:
        start_s = round(span.start_s + shift_s, 3)
        start = span.start
        if part.relation is not None:
            start = clock.text(start_ns + round(start_s * NS_PER_S))
        return replace(span, topic=part.name(span.topic), start_s=start_s, start=start)

    def of(place: str) -> str:
        return f"{log}, {place}" if place else log

    def said(text: str) -> str:
        return f"{log}: {text}" if part.label else text

    before = info.ledger
    ledger = replace(
        before,
        topics={part.name(topic): entry for topic, entry in before.topics.items()},
        spans=tuple(moved(span) for span in before.spans),
        damages=tuple(replace(one, topic=part.name(one.topic), place=of(one.place)) for one in before.damages),
        remarks=tuple(replace(one, topic=part.name(one.topic), text=said(one.text)) for one in before.remarks),
        truncated=None if before.truncated is None else replace(before.truncated, place=of(before.truncated.place)),
    )
    findings = tuple(replace(one, topic=part.name(one.topic), text=said(one.text)) for one in info.findings)
    return replace(info, has_utc=of_clock.has_utc, ledger=ledger, findings=findings)


def _merged(
    parts: Sequence[_Part],
    infos: Sequence[StoreInfo],
    told: JoinRecord,
    of_clock: StoreInfo,
    left_out: Sequence[Damage],
) -> StoreInfo:
    ledgers = [one.ledger for one in infos]
    spans = sorted((span for one in ledgers for span in one.spans), key=lambda span: span.start_s)
    ledger: Ledger = replace(
        ledgers[0],
        topics=dict(sorted(item for one in ledgers for item in one.topics.items())),
        spans=tuple(spans),
        spans_more=sum(one.spans_more for one in ledgers),
        pauses=(),  # of one recorder each: the others went on
        damages=(*map(damage_entry, left_out), *(damage for one in ledgers for damage in one.damages)),
        remarks=tuple(remark for one in ledgers for remark in one.remarks),
        bytes_skipped=sum(one.bytes_skipped for one in ledgers),
        skipped_spans=ledgers[0].skipped_spans,
        truncated=next((one.truncated for one in ledgers if one.truncated is not None), None),
        dropouts=replace(
            ledgers[0].dropouts,
            count=sum(one.dropouts.count for one in ledgers),
            total_s=round(sum(one.dropouts.total_s for one in ledgers), 3),
        ),
    )
    shas = [part.log.source.sha256 for part in parts]
    return replace(
        of_clock,
        source_name=joined_name([part.log for part in parts]),
        source_sha256=hashlib.sha256("".join(shas).encode()).hexdigest(),
        reader=" + ".join(info.reader for info in infos),
        metadata=_metadata(parts, told.text),
        start_ns=min(part.start_ns for part in parts),
        ledger=ledger,
        findings=(
            *_told_left_out(left_out),
            *told.findings,
            *(finding for info in infos for finding in info.findings),
        ),
        remarks=tuple(remark for info in infos for remark in info.remarks),
        damages=(*map(asdict, left_out), *(damage for info in infos for damage in info.damages)),
    )


def _metadata(parts: Sequence[_Part], joining: str) -> dict[str, str]:
    """Return the metadata of all logs, and how they were joined.

    The first log's keys stay as they are, the others' are under their labels.
    """
    found = dict(parts[0].converted.info.metadata)
    for part in parts[1:]:
        for key, value in part.converted.info.metadata.items():
            if key.startswith(OF_FIELDS):
                code, _, about = key.partition(".")
                topic, _, field = about.rpartition(".")
                found[f"{code}.{part.name(topic)}.{field}"] = value
            elif key.startswith(UNITS):
                found[part.name(key)] = value
            else:
                found[f"{part.label}.{key}"] = value
            code, _, topic = key.partition(".")
            if code in OF_AN_INS:
                found[f"{code}.{part.name(topic or 'ins')}"] = value
        for key in OF_THE_AIRCRAFT:
            found.setdefault(key, part.converted.info.metadata.get(key, ""))
    return {key: value for key, value in {**found, TOGETHER: joining}.items() if value}
