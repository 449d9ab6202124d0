"""Chapter: how good the data are: rates, gaps, order, clock."""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from groundstation.base.clock import Clock, RelationEntry
from groundstation.base.ledger import DamageEntry, Ledger
from groundstation.base.signals import RAW_PREFIX
from groundstation.base.words import capitalised, counted
from groundstation.chapters.parts import Facts, Figure, Grid, Head, Note, Section, kept
from groundstation.chapters.provenance import source_pairs
from groundstation.chapters.wording import (
    ABSENT,
    any_value,
    named_quantity,
    number,
    number_with_unit,
    significant,
    typeset,
    with_full_stop,
    words,
)
from groundstation.chapters.wording import clock as clock_of_flight
from groundstation.results.arrays.flight import LedgerRows
from groundstation.results.flight import FlightResults

LEAD = ""
CLOCK_REMARKS = ("clock_used", "link_delay")
MOST_CLOCK_NOTES = 4
MOST_TOPICS = 60
MOST_ENTRIES = 20
MOST_DAMAGES = 60
NOTHING = ("0", "no", "none", ABSENT)
IN_TABLES = ("topics", "damages", "remarks", "spans", "spans_more", "steps", "relations", "pauses")  # remarks: findings
STEP_HEADS = (
    *(Head(title, True) for title in ("Record", "Step, s", "Clock set by, s", "Records before it, moved")),
    Head("What"),
)
CLOCK_HEADS = (
    *(Head("Other clock"), Head("From"), Head("Length, s", True)),
    *(Head("Other − recorder"), Head("Drift of the recorder"), Head("Scatter, s", True)),
)
CLOCK_CAPTION = "±: standard error; positive drift: the recorder is fast. Drift does not change corrected time."
PAUSE_HEADS = (Head("From"), Head("Flight time", True), Head("Length, s", True))
PAUSE_CAPTION = "The autopilot logs nothing while disarmed: no gap. Rates and coverage are of the logged time."
DAMAGE_HEADS = (Head("Kind"), Head("What"), Head("Where"), Head("Count", True), Head("Data lost"))
WHOLE = "Nothing lost, nothing unreadable."


def quality(results: FlightResults) -> Section:
    """Return the chapter; every flight has a ledger."""
    parts = (
        *(_damages(results.ledger), _topics(results), _pauses(results.ledger), Figure("quality.gaps")),
        *(_clock_steps(results.clock), _other_clocks(results.clock), *_clock_notes(results.ledger)),
    )
    workings = (_nested(results.clock, "Clock model"), _nested(results.ledger, "Ledger of the log"))
    headline, above = f"{results.flight_id}: {results.status}", (Facts("", source_pairs(results.source)),)
    return Section("quality", "Data quality", LEAD, kept(parts), headline, above, appendix=kept(workings))


def _clock_notes(ledger: Ledger) -> tuple[Note, ...]:
    """Return by which clock times are, and how late a link was."""
    told = [one.text for one in ledger.remarks if one.code in CLOCK_REMARKS]
    return tuple(Note(with_full_stop(capitalised(typeset(text)))) for text in told[:MOST_CLOCK_NOTES])


def _topics(results: FlightResults) -> Grid | None:
    """Return the topics that answers rest on, with their losses, and raw ones with gaps.

    All topics of raw data where there are no others. Counts of zero are left out.
    """
    data = results.rows_of(LedgerRows)
    if data is None:
        return None
    names = data.topic.tolist()
    own = [place for place, name in enumerate(names) if not name.startswith(RAW_PREFIX)]
    with_gaps = [place for place in np.flatnonzero(data.gaps > 0).tolist() if own and place not in own]
    shown = (own or list(range(len(names))))[:MOST_TOPICS]
    shown += with_gaps[: MOST_TOPICS - len(shown)]
    columns = (
        ("Gaps", data.gaps),
        ("Duplicates", data.duplicates),
        ("Steps back", data.backward_steps),
        ("Stray", data.stray_rows),
        ("Dropped", data.dropped_rows),
        ("Lost by counter", data.lost_by_counter),
        ("Out of range", data.out_of_range),
        ("Stuck", data.stuck),
    )
    counts = [(title, values) for title, values in columns if values[shown].sum() > 0]
    rows = []
    for place in shown:
        rates = f"{significant(data.actual_rate_hz[place])} / {significant(data.nominal_rate_hz[place])}"
        whole = number(100.0 * data.coverage[place], 1, "%")
        gap = number(data.longest_gap_s[place], 2) if data.gaps[place] else ABSENT
        others = (number(int(values[place]), 0) for _, values in counts)
        rows.append((names[place], number(int(data.rows[place]), 0), rates, whole, gap, *others))
    titles = ("Topic", "Rows", "Rate / nominal, Hz", "Coverage", "Longest gap, s", *(title for title, _ in counts))
    heads = [Head(title, title != "Topic") for title in titles]
    more = len(data) - len(rows)
    left_out = f"{counted(more, 'raw topic' if own else 'more topic')} in the table file." if more else ""
    caption = " ".join(filter(None, (_definitions(results.ledger), left_out)))
    return Grid("Topics", heads, rows, caption, ("ledger",))


def _definitions(ledger: Ledger) -> str:
    """Return what coverage and a gap are, by the limits of the ledger."""
    gap = ledger.gap_definition
    if not gap.periods:
        return ""
    return (
        "Coverage: samples that are there, of those that the nominal rate expects. Gap: from sample to sample, longer "
        f"than {gap.periods:g} periods and {gap.min_s:g} s; single missing samples lower the coverage alone."
    )


def _pauses(ledger: Ledger) -> Grid | None:
    """Return the times in which nothing was logged; None without any."""
    rows = [(one.start, clock_of_flight(one.start_s), number(one.length_s, 1)) for one in ledger.pauses[:MOST_ENTRIES]]
    more = len(ledger.pauses) - len(rows)
    caption = f"{PAUSE_CAPTION} {more} more in summary.json." if more else PAUSE_CAPTION
    return Grid("Not logged", PAUSE_HEADS, rows, caption) if rows else None


def _clock_steps(clock: Clock) -> Grid | None:
    rows = [
        (
            number(step.record_index, 0),
            number(step.size_s, 3, signed=True),
            number(step.set_s, 3, signed=True),
            number(step.records_before, 0),
            words(step.mistake),
        )
        for step in clock.steps[:MOST_ENTRIES]
    ]
    return Grid("Steps of the recorder clock", STEP_HEADS, rows) if rows else None


def _other_clocks(clock: Clock) -> Grid | None:
    """Return the recorder's clock against the other clocks of the log.

    Segments, the breaks between them, errors that have a name.
    """
    rows = [row for relation in clock.relations for row in _relation_rows(relation)]
    title = "Recorder clock against other clocks"
    return Grid(title, CLOCK_HEADS, rows[:MOST_TOPICS], CLOCK_CAPTION) if rows else None


def _relation_rows(relation: RelationEntry) -> list[tuple[str, ...]]:
    name = f"{relation.clock.upper()} · {relation.source}"
    rows: list[tuple[str, ...]] = [(name, "", "", relation.reason, "", "")] if relation.reason else []
    for one in relation.segments:
        told = (typeset(one.offset), typeset(one.drift), number(relation.residual_s, 4))
        rows.append((name, one.start, number(one.length_s, 1), *told))
    for two in relation.breaks:
        step = number(two.step_s, 3, "s", signed=True) if two.kind == "step" else ""
        change = number(two.drift_change_ppm, 1, "ppm", signed=True)
        rows.append((f"{name}: {two.kind} changes", two.time, "", step, change, ""))
    rows += [(f"{name}: error", error.time or "", "", typeset(error.text), "", "") for error in relation.mistakes]
    return rows


def _damages(ledger: Ledger) -> Grid | Note:
    if not ledger.damages:
        return Note(WHOLE, "good")
    rows = [_damage_row(damage) for damage in ledger.damages[:MOST_DAMAGES]]
    more = len(ledger.damages) - len(rows)
    return Grid("Damage to the log", DAMAGE_HEADS, rows, f"{more} more in summary.json." if more else "")


def _damage_row(damage: DamageEntry) -> tuple[str, ...]:
    where = " · ".join(filter(None, (damage.topic, damage.place)))
    lost = "yes" if damage.loses_data else "no"
    return (words(damage.kind), damage.what, where, number(damage.count, 0), lost)


def _nested(document: Clock | Ledger, title: str) -> Facts | None:
    """Return facts of a document by the names of its fields.

    Fields with a table of their own and empty values are left out.
    """
    pairs = [(name, value, "") for name, value in _flat(document) if value.partition("\u202f")[0] not in NOTHING]
    return Facts(title, pairs) if pairs else None


def _flat(document: Any, above: str = "") -> list[tuple[str, str]]:
    """Return a dataclass as pairs of a title and a value, nested ones included."""
    out: list[tuple[str, str]] = []
    for one in fields(document):
        value = getattr(document, one.name)
        name, unit = named_quantity(one.name)
        title = f"{above} · {name}" if above else name
        if one.name in IN_TABLES:
            continue
        if is_dataclass(value):
            out += _flat(value, title)
        elif isinstance(value, tuple) and len(value) > MOST_ENTRIES:
            out.append((title, f"{len(value)} entries in summary.json"))
        else:
            out.append((title, number_with_unit(any_value(value), unit)))
    return out
