"""Integrity ledger of a log as it is kept in the MCAP, in summary.json and in reports.

Times are text for people. Fields stand in alphabetical order, as the JSON of the MCAP has its keys: what was read back
is written equal.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from groundstation.base.serial import LEFT_OUT_WHEN_DEFAULT

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null


@dataclass(frozen=True, kw_only=True)
class ThresholdsUsed:
    """Thresholds the ledger was made with: name, version of the layout, digest of the values."""

    name: str = ""
    sha256: str = field(default="", metadata={"pattern": "^([0-9a-f]{64})?$"})
    version: int = 0


@dataclass(frozen=True, kw_only=True)
class GapDefinition:
    """Definition of a gap: longer than ``periods`` nominal periods and than ``min_s`` seconds."""

    min_s: float = 0.0
    periods: float = 0.0


@dataclass(frozen=True, kw_only=True)
class OutOfRange:
    """First value outside its range: record, time, and the range (None where it has no end)."""

    range: tuple[float | None, float | None]
    record: int | None
    time: str | None


@dataclass(frozen=True, kw_only=True)
class StuckStretch:
    """Stretch in which a field was stuck at ``value``, and the evidence."""

    length_s: float
    record: int
    samples: int = field(metadata={"least": 1})
    start: str
    value: float
    why: str


@dataclass(frozen=True, kw_only=True)
class FieldEntry:
    """Counts of one field: samples, NaN of the device, values out of range, stuck stretches.

    ``at_end``: samples of an inertial unit at the end of its range.
    """

    schema_name: ClassVar[str] = "ledger_field"

    at_end: int = field(default=0, metadata=LEFT_OUT_WHEN_DEFAULT)
    first_out_of_range: OutOfRange | None = field(default=None, metadata=LEFT_OUT_WHEN_DEFAULT)
    nan: int = 0
    out_of_range: int = 0
    present: int = 0
    stuck: tuple[StuckStretch, ...] = field(default=(), metadata=LEFT_OUT_WHEN_DEFAULT)


@dataclass(frozen=True, kw_only=True)
class TopicGaps:
    """Gaps of a topic: number, total and longest.

    ``listed`` are the first ones: time of the last sample before the gap, and seconds to the next sample.
    """

    count: int
    listed: tuple[tuple[str, float], ...] = ()
    longest_s: float
    total_s: float = 0.0


@dataclass(frozen=True, kw_only=True)
class CounterEntry:
    """Losses that one counter of the log shows; ``kind``: it counts ``records`` or ``losses``.

    ``listed`` holds the record after each loss and how many were lost.
    """

    before: int = 0
    field: str
    kind: str = dataclasses.field(metadata={"one_of": ("records", "losses")})
    listed: tuple[tuple[str, int], ...] = ()
    lost: int
    resets: int = 0


@dataclass(frozen=True, kw_only=True)
class TopicEntry:
    """Counts of one topic; rate and coverage are None where no step is usual.

    ``losses`` counts by kind what was unreadable. Of an inertial unit: ``jitter_s`` of its steps, and the share of the
    time that its increments cover.
    """

    schema_name: ClassVar[str] = "ledger_topic"

    actual_rate_hz: float | None
    backward_steps: int
    coverage: float | None
    duplicates: int
    fields: Mapping[str, FieldEntry] = field(default_factory=dict)
    first: str
    gaps: TopicGaps
    increments_share: float | None = field(default=None, metadata=LEFT_OUT_WHEN_DEFAULT)
    jitter_s: float | None = field(default=None, metadata=LEFT_OUT_WHEN_DEFAULT)
    last: str
    losses: Mapping[str, int] = field(default_factory=dict)
    nominal_rate_hz: float | None
    rows: int
    sequences: tuple[CounterEntry, ...] = ()
    span_s: float
    stray_rows: int

    @property
    def missing(self) -> int:
        """Number of records that its counters show as missing."""
        return sum(counter.lost for counter in self.sequences)

    @property
    def out_of_range(self) -> int:
        """Number of values outside their range."""
        return sum(one.out_of_range for one in self.fields.values())

    @property
    def stuck(self) -> int:
        """Number of stretches in which a value was stuck."""
        return sum(len(one.stuck) for one in self.fields.values())


@dataclass(frozen=True, kw_only=True)
class DamagedSpan:
    """Span of time with damage.

    ``start_s`` counts from the first record of the log, as flight time does. An empty topic is the whole log, an empty
    field the whole topic. ``is_exact``: everything within is damaged; else the damage lies somewhere within.
    """

    schema_name: ClassVar[str] = "ledger_span"

    cause: str
    count: int
    field: str
    is_exact: bool
    length_s: float
    start: str
    start_s: float
    topic: str


@dataclass(frozen=True, kw_only=True)
class DamageEntry:
    """Data that was lost or is odd: kind, place, how many of what."""

    count: int
    kind: str
    loses_data: bool
    place: str
    topic: str
    what: str


@dataclass(frozen=True, kw_only=True)
class RemarkEntry:
    """Something the reader derived, converted or assumed."""

    code: str
    text: str
    topic: str = ""


@dataclass(frozen=True, kw_only=True)
class Dropouts:
    """Number and total length of the times the recorder could not write.

    A whole 0 where it always could.
    """

    count: int = 0
    total_s: float | int = 0


@dataclass(frozen=True, kw_only=True)
class PauseEntry:
    """Time in which nothing was logged, as the vehicle was disarmed.

    ``start_s`` counts from the first record of the log, as flight time does.
    """

    schema_name: ClassVar[str] = "ledger_pause"

    length_s: float
    start: str
    start_s: float


@dataclass(frozen=True, kw_only=True)
class Truncation:
    """Place where a log is cut, and how much of it is lost."""

    count: int
    place: str
    what: str


@dataclass(frozen=True, kw_only=True)
class Ledger:
    """Contents of a log topic by topic, with its damage, remarks and oddities.

    Parameters
    ----------
    bytes_skipped : int
        Bytes that no record was made of; ``skipped_spans`` are [first, last, bytes].
    damages, remarks : tuples
        Losses and remarks of the reader.
    pauses : tuple of PauseEntry
        Times in which nothing was logged while the vehicle was disarmed: no gap of a topic.
    spans, spans_more
        Damaged spans of time, in order of time; how many more there are.
    topics : mapping of topic to TopicEntry
        In alphabetical order.
    """

    bytes_skipped: int = 0
    damages: tuple[DamageEntry, ...] = ()
    dropouts: Dropouts = field(default_factory=Dropouts)
    gap_definition: GapDefinition = field(default_factory=GapDefinition)
    pauses: tuple[PauseEntry, ...] = field(default=(), metadata=LEFT_OUT_WHEN_DEFAULT)
    remarks: tuple[RemarkEntry, ...] = ()
    skipped_spans: tuple[tuple[int, int, int], ...] = ()
    spans: tuple[DamagedSpan, ...] = ()
    spans_more: int = 0
    thresholds: ThresholdsUsed = field(default_factory=ThresholdsUsed)
    topics: Mapping[str, TopicEntry] = field(default_factory=dict)
    truncated: Truncation | None = None

    def __repr__(self) -> str:
        rows = sum(one.rows for one in self.topics.values())
        gaps = sum(one.gaps.count for one in self.topics.values())
        told = [f"{rows} rows of {len(self.topics)} topics", f"{gaps} gaps", f"{len(self.damages)} damages"]
        if self.truncated is not None:
            told.append(f"cut at {self.truncated.place}")
        return f"<Ledger: {', '.join(told)}; {'data lost' if self.loses_data else 'no data lost'}>"

    @property
    def rows(self) -> dict[str, int]:
        """Number of records of each topic."""
        return {name: topic.rows for name, topic in self.topics.items()}

    @property
    def completeness(self) -> dict[str, float]:
        """Share of expected samples by topic, where it is known."""
        return {name: topic.coverage for name, topic in self.topics.items() if topic.coverage is not None}

    @property
    def loses_data(self) -> bool:
        """Tell whether anything recorded could not be read, or the log is cut."""
        return self.truncated is not None or any(damage.loses_data for damage in self.damages)
