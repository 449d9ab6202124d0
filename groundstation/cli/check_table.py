"""Output of ``check`` on stdout: tables for people, JSON for programs."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

from groundstation.base.clock import Clock
from groundstation.base.findings import Finding
from groundstation.base.ledger import FieldEntry, Ledger, TopicEntry
from groundstation.base.signals import is_canonical
from groundstation.base.text_columns import columns
from groundstation.chapters.parts import Grid, Head
from groundstation.chapters.terminal import grid_text
from groundstation.cli.lines import tell_errors
from groundstation.cli.printing import totals
from groundstation.cli.text import as_json, printable, say, tell
from groundstation.pipeline.verbs.check import CheckedLog
from groundstation.results.grouped_findings import named_lines

MOST_LISTED = 8  # gaps or stretches of one topic; all are in the JSON


def show(
    checked: Sequence[CheckedLog], *, as_json_text: bool = False, quiet: bool = False, everything: bool = False
) -> None:
    """Print what was found in each log; failures with their reasons on stderr, then totals.

    ``everything`` lists every topic of the log, not only canonical ones and those with something odd.
    """
    if as_json_text:
        tell(as_json([one.to_dict() for one in checked]))
        return
    told = 0
    for one in checked:
        if one.outcome.state == "failed":
            tell_errors(one.outcome, with_traces=everything)
        elif not quiet:
            tell(("\n" if told else "") + text_of(one, everything))
            told += 1
    if len(checked) > 1 and not quiet:
        say(totals([one.outcome for one in checked]))


def text_of(one: CheckedLog, everything: bool = False) -> str:
    """Return the ledger of one log as text."""
    topics = one.ledger.topics
    shown = {name: topic for name, topic in topics.items() if everything or is_canonical(name) or _is_odd(topic)}
    usable = printable(one.usability.text) if one.usability else ""
    parts = [usable, _head(one), _clock(one.clock)]
    if shown:
        parts.append(_topics(shown))
    if len(shown) < len(topics):
        parts[-1] += f"\n{len(topics) - len(shown)} more topics of the source without irregularities (-v lists them)"
    tables = (_gaps(topics), _stuck(topics), _outside(topics), _counters(topics), _damages(one.ledger))
    parts += [table for table in tables if table]
    findings = [finding for finding in one.findings if everything or not _is_usual(finding)]
    if findings:
        rows = [[finding.severity, printable(finding.text)] for finding in named_lines(findings)]
        parts.append("findings\n" + columns(rows))
    if len(findings) < len(one.findings):
        usual = "on NaN and repeated times in topics of the source (-v lists them)"
        parts.append(f"{len(one.findings) - len(findings)} more findings {usual}")
    parts.append(f"{printable(one.outcome.source)}: {one.outcome.text}")
    return "\n\n".join(part for part in parts if part)


def _head(one: CheckedLog) -> str:
    wanted = ("file", "size", "sha256", "format", "first sample", "last sample")
    rows = [[f"{key}:", printable(one.facts[key])] for key in wanted if key in one.facts]
    used = one.ledger.thresholds
    if used.sha256:
        name = f"{printable(used.name)}, version {used.version}, sha256 {used.sha256[:16]}"
        rows.append(["thresholds:", name])
    return columns(rows)


def _clock(clock: Clock) -> str:
    """Return the clock: its start, how it was set, its rate against other clocks of the log."""
    if not clock.first_device_time:
        return ""
    time = "UTC" if clock.is_absolute else "no absolute time (NOTIME): counts from its own zero"
    began = f"{printable(clock.first_device_time)}{', not set' if clock.start == 'unset' else ''}"
    parts = ["clock\n" + columns([["time:", time], ["first reading:", began]])]
    steps = [
        [str(step.record_index), f"{step.size_s:+.3f}", f"{step.set_s:+.3f}", step.mistake.replace("_", " ")]
        for step in clock.steps
    ]
    parts.append(_titled("clock steps", ["record", "step s", "set by s", "what"], steps, right=(0, 1, 2)))
    lines, breaks = [], []
    for relation in clock.relations:
        name = printable(f"{relation.clock}: {relation.source}")
        if relation.reason:
            lines.append([name, "", "", str(relation.samples), relation.reason, "", ""])
        for segment in relation.segments:
            span = [segment.start if len(relation.segments) > 1 else "", f"{segment.length_s:.1f}"]
            told = [segment.offset, segment.drift, f"{relation.residual_s:.4f}"]
            lines.append([name, *span, str(segment.samples), *told])
        for one in relation.breaks:
            step = f"{one.step_s:+.3f} ± {one.step_sigma_s:.3f}" if one.kind == "step" else ""
            change = _number(one.drift_change_ppm, 1)
            breaks.append([name, one.kind, f"{one.time} ± {one.time_sigma_s:.1f} s", step, change])
        for mistake in relation.mistakes:
            breaks.append([name, "error", mistake.time or "", mistake.text, ""])
    heads = [
        "other clock",
        "from",
        "length s",
        "readings",
        "other minus recorder",
        "drift of the recorder",
        "scatter s",
    ]
    parts.append(_titled("recorder by other clocks (± 1 sigma)", heads, lines, right=(2, 3, 6)))
    heads = ["other clock", "break", "at", "step s", "drift change ppm"]
    parts.append(_titled("where the clocks diverge", heads, breaks))
    return "\n\n".join(part for part in parts if part)


def _is_usual(finding: Finding) -> bool:
    """Tell whether a finding is of the kind that fills pages and alarms nobody."""
    is_of_source = bool(finding.topic) and not is_canonical(finding.topic)
    return is_of_source and finding.severity == "info" and finding.code in ("values.nan", "time.duplicates")


def _is_odd(topic: TopicEntry) -> bool:
    """Tell whether a topic has more to report than its rate.

    Repeated times do not count: they are common in what a recorder writes.
    """
    lost = any(counter.lost or counter.resets for counter in topic.sequences)
    return bool(topic.gaps.count or topic.backward_steps or topic.stray_rows or topic.losses) or lost


def _topics(topics: Mapping[str, TopicEntry]) -> str:
    heads = ["topic", "rows", "span s", "nominal Hz", "actual Hz", "coverage", "gaps", "longest s"]
    counts: dict[str, Callable[[TopicEntry], int]] = {
        "repeated": lambda topic: topic.duplicates,
        "steps back": lambda topic: topic.backward_steps,
        "stray": lambda topic: topic.stray_rows,
        "lost": lambda topic: sum(topic.losses.values()),
        "missing": lambda topic: topic.missing,
        "NaN": lambda topic: sum(field.nan for field in topic.fields.values()),
        "out of range": lambda topic: topic.out_of_range,
        "stuck": lambda topic: topic.stuck,
    }
    told = {head: count for head, count in counts.items() if any(count(topic) for topic in topics.values())}
    rows = []
    for name, topic in topics.items():
        row = [
            printable(name),
            str(topic.rows),
            f"{topic.span_s:.1f}",
            _number(topic.nominal_rate_hz, 3),
            _number(topic.actual_rate_hz, 3),
            "-" if topic.coverage is None else f"{100.0 * topic.coverage:.2f} %",
            str(topic.gaps.count),
            f"{topic.gaps.longest_s:.2f}" if topic.gaps.count else "",
        ]
        rows.append([*row, *(str(count(topic) or "") for count in told.values())])
    return _titled("", [*heads, *told], rows, right=range(1, len(heads) + len(told)))


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _gaps(topics: Mapping[str, TopicEntry]) -> str:
    rows = []
    for name, topic in topics.items():
        if not is_canonical(name):
            continue
        listed = sorted(topic.gaps.listed, key=lambda gap: -gap[1])[:MOST_LISTED]
        rows += [[printable(name), start, f"{length:.3f}"] for start, length in sorted(listed)]
        more = topic.gaps.count - len(listed)
        if more:
            rows.append([printable(name), f"{more} shorter ones", ""])
    return _titled("gaps", ["topic", "after", "length s"], rows, right=(2,))


def _stuck(topics: Mapping[str, TopicEntry]) -> str:
    rows = []
    for name, field in _fields(topics):
        listed = field.stuck
        for one in listed[:MOST_LISTED]:
            length = f"{one.length_s:.1f}"
            rows.append([name, one.start, length, str(one.samples), f"{one.value:g}", printable(one.why)])
        if len(listed) > MOST_LISTED:
            rows.append([name, f"{len(listed) - MOST_LISTED} more", "", "", "", ""])
    return _titled("stuck values", ["field", "from", "length s", "samples", "value", "why"], rows, right=(2, 3))


def _outside(topics: Mapping[str, TopicEntry]) -> str:
    rows = []
    for name, field in _fields(topics):
        first = field.first_out_of_range
        if first is not None:
            low, high = ("" if end is None else f"{end:g}" for end in first.range)
            place = [str(first.record), first.time or ""]
            rows.append([name, str(field.out_of_range), f"[{low}, {high}]", *place])
    return _titled("values out of range", ["field", "count", "range", "first record", "at"], rows, right=(1, 3))


def _counters(topics: Mapping[str, TopicEntry]) -> str:
    rows = []
    for name, topic in topics.items():
        for entry in topic.sequences:
            first = entry.listed[0][0] if entry.listed else ""
            counts = [str(entry.lost), str(entry.before), str(entry.resets)]
            rows.append([printable(f"{name}.{entry.field}"), entry.kind, *counts, first])
    heads = ["counter", "counts", "missing", "before the log", "resets", "first loss before"]
    return _titled("counters", heads, rows, right=(2, 3, 4))


def _damages(ledger: Ledger) -> str:
    rows = [
        [
            entry.kind,
            str(entry.count),
            printable(entry.what),
            printable(f"{entry.topic} {entry.place}".strip()),
        ]
        for entry in ledger.damages
    ]
    table = _titled("damage", ["kind", "count", "what", "where"], rows, right=(1,))
    return table + (f"\nbytes skipped: {ledger.bytes_skipped}" if ledger.bytes_skipped else "")


def _fields(topics: Mapping[str, TopicEntry]) -> Iterator[tuple[str, FieldEntry]]:
    for name, topic in topics.items():
        for field, entry in topic.fields.items():
            yield printable(f"{name}.{field}"), entry


def _titled(title: str, heads: Sequence[str], rows: Sequence[Sequence[str]], right: Collection[int] = ()) -> str:
    return grid_text(Grid(title, [Head(head, place in right) for place, head in enumerate(heads)], rows))
