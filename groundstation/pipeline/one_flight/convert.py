"""Conversion of a log to MCAP: clock repaired, ledger beside the data."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from itertools import chain, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.findings import Finding, Severity
from groundstation.base.ledger import Ledger, TopicEntry
from groundstation.base.records import HEADING_IS_TRACK, Damage, Item, RecordBatch, Remark
from groundstation.base.signals import kind_of
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.base.version import __version__
from groundstation.integrity.breaks_off import BREAKS_OFF, broken_off
from groundstation.integrity.ledger import damage_entry
from groundstation.integrity.ledger_findings import TOPIC_CODES, topic_findings
from groundstation.integrity.ledger_findings import damage_finding as log_damage_finding
from groundstation.integrity.limits import Thresholds, shipped
from groundstation.integrity.survey import Census
from groundstation.pipeline.one_flight.configuration import NO_REFERENCES, References
from groundstation.pipeline.one_flight.log import Log, Replay
from groundstation.pipeline.one_flight.reference import FACTS, TRUTH, Laid, laid_beside
from groundstation.pipeline.one_flight.segments import Segment, document_of, segments_in, segments_of
from groundstation.store.info import StoreInfo

if TYPE_CHECKING:
    from groundstation.integrity.survey import Survey

OWN_TRUTH = ("a truth of its own", "a log without one", "leave --reference out")
OF_JOINTS = ("log.power_ups", "data.repeated_header", "data.comment_line")  # findings on files that stand behind others
PARTS_TOLD, PARTS = 5, "parts"  # names in a finding; the key of metadata
COUNTED_CAUSES = ("dropout", "stuck", "out_of_range", "sequence")  # of spans: counted again with the topics


@dataclass(frozen=True)
class Converted:
    """Content of an MCAP, and findings made while it was written.

    ``has_lost_data``: something of the log could not be kept (exit code 3). ``sha256`` is the digest of the MCAP.
    """

    info: StoreInfo
    findings: tuple[Finding, ...]
    has_lost_data: bool
    sha256: str = ""


def convert_log(
    log: Log, target: Path, thresholds: Thresholds | None = None, references: References = NO_REFERENCES
) -> Converted:
    """Write a log's MCAP, under a temporary name until it is whole.

    Several power-ups in a log stay together.

    Parameters
    ----------
    log : Log
    target : Path
    thresholds : Thresholds, optional
        Limits of the ledger; the shipped ones when left out.
    references : References, optional
        Files of which the one of the log's time is kept beside it as ``truth``.

    Raises
    ------
    UnreadableLogError
        When the log holds no record at all.
    GroundstationError
        When there is no reference for it, or several.
    """
    limits = thresholds or shipped()
    if log.is_store:
        return _copy_store(log, target, limits, references)
    items = log.replay()
    return _convert_recorded(log, items, survey_of(log, items, limits), target, references)


def convert_flight(
    log: Log, target: Path, thresholds: Thresholds | None = None, references: References = NO_REFERENCES
) -> Converted | tuple[Log, ...]:
    """Write the MCAP of a log of one flight.

    For a log with several power-ups nothing is written; a log for each is returned.

    Parameters and errors are those of :func:`convert_log`.
    """
    limits = thresholds or shipped()
    if log.is_store:
        parts = () if log.segment is not None else segments_in(log.info())
        return tuple(map(log.only, parts)) or _copy_store(log, target, limits, references)
    items = log.replay()
    found = survey_of(log, items, limits)
    several = _segments(log, found)
    if several:
        return tuple(log.only(one, items) for one in several)
    return _convert_recorded(log, items, found, target, references)


def survey_of(log: Log, items: Iterable[Item], limits: Thresholds) -> "Survey":
    """Survey a log that is to be converted.

    Raises
    ------
    UnreadableLogError
        When it holds no record.
    """
    from groundstation.integrity.survey import survey

    found = survey(items, thresholds=limits)
    if not found.ledger.topics:
        from groundstation.integrity.ledger_findings import ledger_findings

        why = why_nothing_is_placed(ledger_findings(found.ledger))
        raise UnreadableLogError(log.path.name, why, "", "`info` shows what the file is")
    return found


def why_nothing_is_placed(findings: Iterable[Finding]) -> str:
    """Return the reason why a log has no topic.

    Its records have no time, or no record can be read.
    """
    timeless = next((one.count for one in findings if one.code == "clock.no_times"), 0)
    return f"no readable record has a time, of {timeless}" if timeless else "no readable record"


def _segments(log: Log, found: "Survey") -> tuple[Segment, ...]:
    """Return the power-ups of a log.

    Empty for a log that is read for one of them alone, or of consecutive files.

    Raises
    ------
    GroundstationError
        When the counter starts again in a later file, and nothing tells how the clock goes on.
    """
    if log.parts:
        from groundstation.pipeline.one_flight.parts import LATE_S

        for one, other in pairwise(found.power_ups):
            has_utc = one.is_absolute and other.is_absolute
            if not has_utc or other.start_ns - one.end_ns < -LATE_S * NS_PER_S:
                raise GroundstationError(log.source.name, "parts whose clock does not go on", "one recording")
    return () if log.segment is not None or log.parts else segments_of(found.power_ups)


def _convert_recorded(log: Log, items: Replay, found: "Survey", target: Path, references: References) -> Converted:
    from groundstation.integrity.ordering import corrected
    from groundstation.store.writer import StoreWriter

    limits = found.ledger.thresholds
    topics = found.ledger.topics
    if references.paths and any(kind_of(one.topic) == TRUTH for one in topics):
        raise GroundstationError(log.path.name, *OWN_TRUTH)
    span_ns = min(one.first_ns for one in topics), max(one.last_ns for one in topics)
    laid = laid_beside(log.path.name, span_ns, found.clock.is_absolute, references.besides(log.path))
    info = _facts_of(log, found, laid)
    if several := _segments(log, found):
        documents = []
        for one in several:
            alone = log.only(one, items)
            facts = _facts_of(alone, survey_of(alone, alone.items(), limits), laid.within(one.start_ns, one.end_ns))
            documents.append(document_of(one, facts, found.clock))
        info = replace(info, segments=documents)
    with StoreWriter(target, info) as writer:
        for batch in chain(corrected(items, found.clock), laid.batches):
            writer.write(batch)
    return Converted(info, info.findings, any(damage.loses_data for damage in found.damages), writer.sha256)


def _facts_of(log: Log, found: "Survey", laid: Laid) -> StoreInfo:
    """Return facts of the MCAP of a log, with those of the reference that is laid beside it."""
    from groundstation.integrity.ledger_findings import ledger_findings
    from groundstation.store.writer import MCAP_VERSION

    of_segment = () if log.segment is None else (log.segment.finding,)
    of_parts = _told_joined(log) if log.parts else ()
    findings = [one for one in ledger_findings(found.ledger) if not (log.parts and one.code in OF_JOINTS)]
    return StoreInfo(
        source_name=log.source.name,
        source_sha256=log.source.sha256,
        reader=found.header.reader,
        versions={"groundstation": __version__, "mcap": MCAP_VERSION},
        metadata={**found.header.metadata, **told_of_fields(found.remarks), **laid.facts, **_facts_of_parts(log)},
        has_utc=found.clock.is_absolute,
        start_ns=found.ledger.start_ns,
        clock=found.clock.document(),
        ledger=_with_truth(found.ledger.document(), laid, found.ledger.thresholds),
        findings=(*of_segment, *of_parts, *findings, *laid.findings),
        remarks=[asdict(remark) for remark in found.remarks],
        damages=[asdict(damage) for damage in found.damages],
    )


def _told_joined(log: Log) -> tuple[Finding, ...]:
    """Return the finding that a flight was put together from consecutive files."""
    names = [path.name for path in log.parts]
    more = f" and {len(names) - PARTS_TOLD} more" if len(names) > PARTS_TOLD else ""
    text = f"{len(names)} consecutive files joined as one flight: {', '.join(names[:PARTS_TOLD])}{more}"
    return (Finding("info", "log.parts", text, count=len(names)),)


def _facts_of_parts(log: Log) -> dict[str, str]:
    """Return names and digests of the consecutive files of a flight, as metadata."""
    if not log.parts:
        return {}
    parts = [{"name": path.name, "sha256": sha256} for path, sha256 in zip(log.parts, log.digests, strict=True)]
    return {PARTS: json.dumps(parts)}


def parts_told(metadata: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the name and digest of each of the consecutive files of a flight, by its metadata."""
    try:
        told = json.loads(metadata.get(PARTS, "[]"))
        yield from ((str(one["name"]), str(one["sha256"])) for one in told)
    except (ValueError, KeyError, TypeError):  # the MCAP is damaged there
        return


def _with_truth(ledger: Ledger, laid: Laid, limits: Thresholds) -> Ledger:
    """Return a ledger with the topic of a reference."""
    if not laid.batches:
        return ledger
    census = Census(True, limits)
    for batch in laid.batches:
        census.add(batch)
    counted = census.ledger().document().topics
    return replace(ledger, topics=dict(sorted({**ledger.topics, **counted}.items())))


def told_of_fields(remarks: tuple[Remark, ...]) -> dict[str, str]:
    """Return facts of fields that the analyses need, for the metadata of the flight.

    ``derived.<topic>.<field>``: what it was derived from; ``heading_is_track.<topic>.<field>``: in words.
    """
    origin = " derived from "
    return {
        f"{remark.code}.{remark.topic}.{field}": remark.text.rpartition(origin)[2]
        for remark in remarks
        if remark.code in ("derived", HEADING_IS_TRACK)
        for field in remark.fields
    }


def _copy_store(log: Log, target: Path, limits: Thresholds, references: References) -> Converted:
    """Write the intact content of a groundstation MCAP again.

    An undamaged one comes out equal in content.
    """
    from groundstation.store.writer import StoreWriter

    info = log.info()
    laid = _laid_beside_store(log, info, references)
    if laid.batches:
        info = _with_another_truth(info, laid, limits)
    elif laid.findings:  # why there is none
        info = replace(info, findings=(*info.findings, *laid.findings))
    damages: list[Damage] = []
    census = census_of(info, limits)
    with StoreWriter(target, info) as writer:
        for item in chain(_without_truth(log.items(), laid), laid.batches):
            if isinstance(item, RecordBatch):
                writer.write(item)
                census.add(item)
            elif isinstance(item, Damage):
                damages.append(item)
        if not census.rows:
            raise UnreadableLogError(log.path.name, "no intact record", "", "the file is damaged beyond its index")
        if damages or has_other_limits(info, limits):
            info = writer.info = recounted(info, damages, census)
    return Converted(info, info.findings, any(entry.get("loses_data") for entry in info.damages), writer.sha256)


def _laid_beside_store(log: Log, info: StoreInfo, references: References) -> Laid:
    """Return the reference for an MCAP, in place of that of an earlier run.

    A truth that came with the log is never replaced.
    """
    has_truth = any(kind_of(topic) == TRUTH for topic in info.ledger.topics)
    if not references.paths:
        return Laid()
    if has_truth and f"{FACTS}source_name" not in info.metadata:
        raise GroundstationError(log.path.name, *OWN_TRUTH)
    if not info.has_utc:  # its times are no dates
        return laid_beside(log.path.name, (0, 0), info.has_utc, references.besides(log.path))
    ends = [iso_to_utc_ns(end)[0] for topic in info.ledger.topics.values() for end in (topic.first, topic.last)]
    start_ns = min(ends, default=0) if info.start_ns is None else info.start_ns
    return laid_beside(log.path.name, (start_ns, max(ends, default=0)), info.has_utc, references.besides(log.path))


def _without_truth(items: Iterable[Item], laid: Laid) -> Iterator[Item]:
    """Yield items of a log, without the truth where another takes its place."""
    return (item for item in items if not (laid.batches and isinstance(item, RecordBatch) and item.topic == TRUTH))


def _with_another_truth(info: StoreInfo, laid: Laid, limits: Thresholds) -> StoreInfo:
    """Return the facts of a store file with another truth."""
    metadata = {name: value for name, value in info.metadata.items() if not name.startswith(FACTS)}
    findings = tuple(finding for finding in info.findings if not finding.code.startswith("reference."))
    return replace(
        info,
        metadata={**metadata, **laid.facts},
        ledger=_with_truth(info.ledger, laid, limits),
        findings=(*findings, *laid.findings),
    )


def census_of(info: StoreInfo, limits: Thresholds) -> Census:
    """Count the content of a store file again, by its kind of clock."""
    return Census(info.has_utc, limits, is_counting=info.clock.is_counting)


def has_other_limits(info: StoreInfo, limits: Thresholds) -> bool:
    """Tell whether the ledger in a store file was made with other thresholds."""
    return info.ledger.thresholds.sha256 != limits.sha256


def recounted(info: StoreInfo, damages: list[Damage], census: Census) -> StoreInfo:
    """Return the facts of a store file with its topics counted again.

    The file is damaged, or other thresholds are asked for. What only the log could tell (its clock, the order of its
    records, what its reader lost) stays as it was found.
    """
    counts, before = census.ledger(damages), info.ledger
    ends = broken_off(counts)
    anew = replace(counts, damages=(*ends, *damages)).document()
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
        damages=(
            *(one for one in before.damages if one.kind != BREAKS_OFF),
            *map(damage_entry, (*ends, *damages)),
        ),
        remarks=before.remarks,
    )
    findings = (
        *(finding for finding in info.findings if finding.code not in (*TOPIC_CODES, f"data.{BREAKS_OFF}")),
        *map(log_damage_finding, ends),
        *topic_findings(counts),
        *map(damage_finding, damages),
    )
    listed = (*(one for one in info.damages if one.get("kind") != BREAKS_OFF), *map(asdict, (*ends, *damages)))
    return replace(info, ledger=ledger, findings=findings, damages=listed)


def _with_what_the_log_told(topic: TopicEntry, before: TopicEntry | None) -> TopicEntry:
    """Return a topic counted again, with the order and losses that only its log could tell."""
    if before is None:
        return topic
    told = {kind: count for kind, count in before.losses.items() if kind != BREAKS_OFF}
    losses = dict(sorted({**told, **topic.losses}.items()))
    return replace(topic, backward_steps=before.backward_steps, stray_rows=before.stray_rows, losses=losses)


def damage_finding(damage: Damage) -> Finding:
    """Return the finding on damage in an MCAP."""
    text = f"{damage.what}: {damage.count} at {damage.place}"
    severity: Severity = "warn" if damage.loses_data else "info"
    return Finding(severity, f"store.{damage.kind}", text, damage.topic, damage.place, damage.count)
