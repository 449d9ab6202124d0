"""Description of a log for the verb ``info``: format, clock, span and topics."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.ledger import Ledger
from groundstation.base.records import Damage, RecordBatch
from groundstation.base.signals import BUS_PREFIX
from groundstation.base.units import NS_PER_S
from groundstation.base.words import length_text
from groundstation.pipeline.many_flights.inputs import no_log
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.log import Log, as_log, open_log, open_one_of_several
from groundstation.pipeline.one_flight.segments import PowerUpTold, segments_in, segments_of, told_of
from groundstation.pipeline.verbs.recordings import facts_of_recording, is_of_rerun
from groundstation.store.info import StoreInfo

if TYPE_CHECKING:
    from groundstation.readers.chapter10.contents import BusContents


@dataclass(frozen=True)
class TopicDescription:
    """A topic of a log: rows, median rate, span in seconds, fields."""

    name: str
    rows: int | None
    rate_hz: float | None
    span_s: float | None
    fields: tuple[str, ...]


@dataclass(frozen=True)
class BusWord:
    """Messages of one terminal and subaddress, or words of one label, of a bus.

    ``place`` is the channel, of ARINC 429 with the number of the bus behind a dot; ``names`` are those that ICDs give.
    """

    place: str
    bus: str
    what: str
    count: int
    rate_hz: float | None
    names: tuple[str, ...]


@dataclass(frozen=True)
class Description:
    """Description of a log: facts (name to text), topics, findings, and words on its buses.

    ``has_records``: at least one record of the log could be read; ``power_ups``: where it holds several; ``loss``: in
    words, as the ledger has it.
    """

    facts: dict[str, str]
    topics: tuple[TopicDescription, ...]
    findings: tuple[Finding, ...]
    has_lost_data: bool
    buses: tuple[BusWord, ...] = ()
    has_records: bool = True
    power_ups: tuple[PowerUpTold, ...] = ()
    loss: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        plain = asdict(self)
        del plain["has_records"], plain["loss"]  # the exit code and the findings tell them
        if not self.power_ups:
            del plain["power_ups"]
        return plain


def describe(
    path: Path, profile: Path | None = None, icds: tuple[str, ...] = (), *, is_alone: bool = True
) -> Description:
    """Describe a recorded log, a groundstation MCAP or a recording.

    ``icds`` name the words of its buses. One of several logs is read by the profile if that describes it.

    Raises
    ------
    UsageError, UnreadableLogError
        When the file is missing, or nothing can be said about it.
    """
    from groundstation.base.errors import UsageError

    if not path.exists():
        raise UsageError(str(path), "no such file")
    path = as_log(path)
    if path.is_dir():
        raise no_log(path)
    if is_of_rerun(path):
        return Description(facts_of_recording(path), (), (), False)
    log = (open_log if is_alone else open_one_of_several)(path, profile, icds)
    return _stored(log) if log.is_store else _recorded(log)


def describe_together(paths: Sequence[Path], configuration: Configuration) -> Description:
    """Describe logs of one flight as one, joined as ``run --together`` joins them.

    Raises
    ------
    UsageError, UnreadableLogError
        When a log is missing or given twice, there is but one, or none can be read.
    """
    from groundstation.pipeline.one_flight.join import join_files

    with TemporaryDirectory(prefix="groundstation-") as folder:
        target = Path(folder) / "together.mcap"
        joined = join_files(paths, target, configuration)
        found = _stored(open_log(target, None, configuration.icds))
    size = sum(path.stat().st_size for path in paths)
    return replace(found, facts={**found.facts, "file": joined.info.source_name, "size": f"{size} bytes"})


def _recorded(log: Log) -> Description:
    from groundstation.integrity.ledger_findings import ledger_findings
    from groundstation.integrity.survey import survey

    items = log.replay()
    found = survey(items)
    ledger = found.ledger.document()
    fields: dict[str, dict[str, None]] = {}
    buses = _bus_contents(ledger)
    for item in items:
        if buses is not None:
            buses.add(item)
        if isinstance(item, RecordBatch):
            fields.setdefault(item.topic, {}).update(dict.fromkeys(item.columns))
    ends_ns = [found.ledger.start_ns, *(topic.last_ns for topic in found.ledger.topics)]
    facts = facts_of(log, dict(found.header.metadata), ledger, (max(ends_ns) - ends_ns[0]) / NS_PER_S)
    lost = any(damage.loses_data for damage in found.damages)
    topics, findings = _topics(ledger, fields), ledger_findings(found.ledger)
    power_ups = told_of(segments_of(found.power_ups), found.clock.is_absolute)
    return Description(facts, topics, findings, lost, _buses(buses, log), bool(topics), power_ups, ledger.loss)


def _bus_contents(ledger: Ledger) -> "BusContents | None":
    """Return a counter of the words on the buses; None for a log without buses.

    Such a log needs no numba either.
    """
    if not any(topic.startswith(BUS_PREFIX) for topic in ledger.topics):
        return None
    from groundstation.readers.chapter10.contents import BusContents

    return BusContents()


def _buses(contents: "BusContents | None", log: Log) -> tuple[BusWord, ...]:
    """Return what is on the buses, in the order of the channels."""
    if contents is None:
        return ()
    from groundstation.readers.chapter10.contents import named_by

    return tuple(
        BusWord(
            str(one.channel) if one.sub_channel is None else f"{one.channel}.{one.sub_channel}",
            one.bus,
            one.title,
            one.count,
            one.rate_hz if isfinite(one.rate_hz) else None,
            tuple(holder.name for holder in named_by(one, log.loaded_icds)),
        )
        for one in contents.entries()
    )


def suggest_icd(path: Path) -> str:
    """Return the beginning of an ICD, as YAML, from what is on the buses of a log.

    Raises
    ------
    UsageError
        When the log has no bus words.
    """
    from groundstation.base.errors import UsageError
    from groundstation.readers.chapter10.contents import BusContents
    from groundstation.readers.icd import suggest

    buses = BusContents()
    for item in open_log(path).items():
        buses.add(item)
    entries = buses.entries()
    if not entries:
        raise UsageError(path.name, "no words of 1553 or ARINC-429 buses", "a Chapter 10 recording, or its MCAP")
    return suggest(entries)


def _stored(log: Log) -> Description:
    from groundstation.integrity.ledger import damage_entry
    from groundstation.pipeline.one_flight.convert import damage_finding
    from groundstation.store.reader import read_info

    info = read_info(log.path)
    fields: dict[str, dict[str, None]] = {}
    damages, buses, ends_ns = [], _bus_contents(info.ledger), list[int]()
    for item in log.items():
        if buses is not None:
            buses.add(item)
        if isinstance(item, RecordBatch):
            fields.setdefault(item.topic, {}).update(dict.fromkeys(item.columns))
            ends_ns += [] if item.time_ns is None or not len(item) else [item.time_ns.min(), item.time_ns.max()]
        elif isinstance(item, Damage):
            damages.append(item)
    length_s = float(max(ends_ns) - min(ends_ns)) / NS_PER_S if ends_ns else None
    facts = facts_of(log, dict(info.metadata), info.ledger, length_s)
    facts["log"] = f"{info.source_name}, read as {info.reader}"
    findings = (*info.findings, *(damage_finding(damage) for damage in damages))
    lost, topics = _has_lost(info, damages), _topics(info.ledger, fields)
    power_ups = told_of(segments_in(info), info.has_utc)
    ledger = replace(info.ledger, damages=(*info.ledger.damages, *map(damage_entry, damages)))
    return Description(facts, topics, findings, lost, _buses(buses, log), bool(fields), power_ups, ledger.loss)


def _has_lost(info: StoreInfo, damages: list[Damage]) -> bool:
    """Tell whether data was lost: when the log was converted, or from the MCAP since."""
    return any(entry.get("loses_data") for entry in info.damages) or any(damage.loses_data for damage in damages)


def facts_of(log: Log, metadata: Mapping[str, str], ledger: Ledger, length_s: float | None = None) -> dict[str, str]:
    """Return facts of a log, name to text.

    File, size, format, first and last sample, metadata; ``length_s``, where given, is from the first to the last.
    """
    facts = {
        "file": log.source.name,
        "size": f"{log.source.size_bytes} bytes",
        "sha256": log.source.sha256,
        "format": log.source.reader,
    }
    topics = ledger.topics.values()
    if topics:
        # Texts of one clock sort as their times do: ISO UTC, or +mm:ss padded by what has the most digits.
        facts["first sample"] = min((topic.first for topic in topics), key=lambda text: (len(text), text))
        facts["last sample"] = max((topic.last for topic in topics), key=lambda text: (len(text), text))
        if length_s is not None:
            facts["duration"] = length_text(length_s)
    return {**facts, **{key: metadata[key] for key in sorted(metadata)}}


def _topics(ledger: Ledger, fields: dict[str, dict[str, None]]) -> tuple[TopicDescription, ...]:
    return tuple(
        TopicDescription(name, entry.rows, entry.nominal_rate_hz, entry.span_s, tuple(fields.get(name, ())))
        for name, entry in sorted(ledger.topics.items())
    )
