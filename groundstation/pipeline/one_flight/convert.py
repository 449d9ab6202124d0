"""A log becomes an MCAP: its clock is repaired, its ledger is kept beside the data."""

from dataclasses import asdict, dataclass, replace
from importlib import metadata as installed
from pathlib import Path

from groundstation.base.errors import UnreadableLogError
from groundstation.base.findings import Finding, Severity
from groundstation.base.ledger import TopicEntry
from groundstation.base.records import HEADING_IS_TRACK, Damage, RecordBatch, Remark
from groundstation.base.version import __version__
from groundstation.integrity.ledger import damage_entry
from groundstation.integrity.ledger_findings import TOPIC_CODES, topic_findings
from groundstation.integrity.limits import Thresholds, shipped
from groundstation.integrity.survey import Census
from groundstation.pipeline.one_flight.log import Log
from groundstation.store.info import StoreInfo

COUNTED_CAUSES = ("dropout", "stuck", "out_of_range", "sequence")  # of spans: counted again with the topics


@dataclass(frozen=True)
class Converted:
    """What an MCAP holds and what was found while it was made.

    ``has_lost_data``: something of the log could not be kept (exit code 3).
    """

    info: StoreInfo
    findings: tuple[Finding, ...]
    has_lost_data: bool


def convert_log(log: Log, target: Path, thresholds: Thresholds | None = None) -> Converted:
    """Write a log's MCAP, under a temporary name until it is whole.

    Parameters
    ----------
    log : Log
    target : Path
    thresholds : Thresholds, optional
        Limits of the ledger; the shipped ones when left out.

    Raises
    ------
    UnreadableLogError
        When the log holds no record at all.
    """
    limits = thresholds or shipped()
    return _copy_store(log, target, limits) if log.is_store else _convert_recorded(log, target, limits)


def _convert_recorded(log: Log, target: Path, limits: Thresholds) -> Converted:
    from groundstation.integrity.ledger_findings import ledger_findings
    from groundstation.integrity.ordering import corrected
    from groundstation.integrity.survey import survey
    from groundstation.store.writer import StoreWriter

    items = log.replay()
    found = survey(items, thresholds=limits)
    if not found.ledger.topics:
        raise UnreadableLogError(log.path.name, "no record that could be read", "", "`info` tells what the file is")
    findings = ledger_findings(found.ledger)
    info = StoreInfo(
        source_name=log.source.name,
        source_sha256=log.source.sha256,
        reader=found.header.reader,
        versions={"groundstation": __version__, "mcap": installed.version("mcap")},
        metadata={**found.header.metadata, **_told_of_fields(found.remarks)},
        has_utc=found.clock.is_absolute,
        start_ns=min(topic.first_ns for topic in found.ledger.topics),
        clock=found.clock.document(),
        ledger=found.ledger.document(),
        findings=findings,
        remarks=[asdict(remark) for remark in found.remarks],
        damages=[asdict(damage) for damage in found.damages],
    )
    with StoreWriter(target, info) as writer:
        for batch in corrected(items, found.clock):
            writer.write(batch)
    return Converted(info, findings, any(damage.loses_data for damage in found.damages))


def _told_of_fields(remarks: tuple[Remark, ...]) -> dict[str, str]:
    """What the analyses must know of a field: it stays with the flight.

    ``derived.<topic>.<field>``: what it was derived from; ``heading_is_track.<topic>.<field>``: in words.
    """
    origin = " derived from "
    return {
        f"{remark.code}.{remark.topic}.{field}": remark.text.rpartition(origin)[2]
        for remark in remarks
        if remark.code in ("derived", HEADING_IS_TRACK)
        for field in remark.fields
    }


def _copy_store(log: Log, target: Path, limits: Thresholds) -> Converted:
    """Write the intact content of a groundstation MCAP again; an undamaged one comes out equal in content."""
    from groundstation.store.reader import read_info
    from groundstation.store.writer import StoreWriter

    info = read_info(log.path)
    damages: list[Damage] = []
    census = census_of(info, limits)
    with StoreWriter(target, info) as writer:
        for item in log.items():
            if isinstance(item, RecordBatch):
                writer.write(item)
                census.add(item)
            elif isinstance(item, Damage):
                damages.append(item)
        if not census.rows:
            raise UnreadableLogError(log.path.name, "no intact record", "", "the file is damaged beyond its index")
        if damages or has_other_limits(info, limits):
            info = writer.info = recounted(info, damages, census)
    return Converted(info, info.findings, any(entry.get("loses_data") for entry in info.damages))


def census_of(info: StoreInfo, limits: Thresholds) -> Census:
    """Counts what is in a store file anew, by its kind of clock."""
    return Census(info.has_utc, limits, is_counting=info.clock.is_counting)


def has_other_limits(info: StoreInfo, limits: Thresholds) -> bool:
    """Whether the ledger in a store file was made with other thresholds."""
    return info.ledger.thresholds.sha256 != limits.sha256


def recounted(info: StoreInfo, damages: list[Damage], census: Census) -> StoreInfo:
    """Facts of a store file whose topics were counted anew: it is damaged, or other thresholds are asked for.

    What only the log could tell (its clock, the order of its records, what its reader lost) stays as it was found.
    """
    counts, before = census.ledger(damages), info.ledger
    anew = counts.document()
    kept = [span for span in before.spans if span.cause not in COUNTED_CAUSES]
    # Of a file that is whole, what was skipped and cut is what the log had of it.
    told = anew if damages else before
    ledger = replace(
        anew,
        topics={name: _with_what_the_log_told(topic, before.topics.get(name)) for name, topic in anew.topics.items()},
        bytes_skipped=told.bytes_skipped,
        skipped_spans=told.skipped_spans,
        truncated=told.truncated,
        spans=tuple(sorted((*kept, *anew.spans), key=lambda span: span.start_s)),
        damages=(*before.damages, *map(damage_entry, damages)),
        remarks=before.remarks,
    )
    findings = (
        *(finding for finding in info.findings if finding.code not in TOPIC_CODES),
        *topic_findings(counts),
        *map(damage_finding, damages),
    )
    return replace(info, ledger=ledger, findings=findings, damages=(*info.damages, *map(asdict, damages)))


def _with_what_the_log_told(topic: TopicEntry, before: TopicEntry | None) -> TopicEntry:
    """A topic counted anew, with what was out of order and unreadable in the log it came from."""
    if before is None:
        return topic
    losses = dict(sorted({**before.losses, **topic.losses}.items()))
    return replace(topic, backward_steps=before.backward_steps, stray_rows=before.stray_rows, losses=losses)


def damage_finding(damage: Damage) -> Finding:
    """A finding that tells of damage in an MCAP."""
    text = f"{damage.what}: {damage.count} at {damage.place}"
    severity: Severity = "warn" if damage.loses_data else "info"
    return Finding(severity, f"store.{damage.kind}", text, damage.topic, damage.place, damage.count)
