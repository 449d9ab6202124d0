"""Integrity ledger of a log as it is kept in the MCAP, in summary.json and in reports.

Times are text for people. Fields stand in alphabetical order, as the JSON of the MCAP has its keys: what was read back
is written equal.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

from groundstation.base.dataclasses import dataclass
from groundstation.base.serial import LEFT_OUT_WHEN_DEFAULT
from groundstation.base.words import counted

DATA_LOST, END_CUT = "data lost", "end cut off"
TRUNCATED = "truncated"  # kind of the damage that the end of a file makes
UNFINISHED = ("bytes of a", "row ")  # what such damage counts where a record was begun and not finished
NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null


@dataclass(frozen=True, kw_only=True)
class ThresholdsUsed:
    """Thresholds the ledger was made with: name, version of the layout, digest of the values."""

    name: str = ""  #: Name in the file of thresholds.
    sha256: str = field(default="", metadata={"pattern": "^([0-9a-f]{64})?$"})  #: Digest of the values.
    version: int = 0  #: Version of the layout of that file.


@dataclass(frozen=True, kw_only=True)
class GapDefinition:
    """Definition of a gap: longer than ``periods`` nominal periods and than ``min_s`` seconds."""

    min_s: float = 0.0  #: A gap is longer than so many seconds,
    periods: float = 0.0  #: and than so many nominal periods of its topic.


@dataclass(frozen=True, kw_only=True)
class OutOfRange:
    """First value outside its range: record, time, and the range (None where it has no end)."""

    range: tuple[float | None, float | None]  #: Lowest and highest value allowed; null where there is no end.
    record: int | None  #: Place of the record in the log.
    time: str | None  #: When, for people.


@dataclass(frozen=True, kw_only=True)
class StuckStretch:
    """Stretch in which a field was stuck at ``value``, and the evidence."""

    length_s: float  #: How long it stood still.
    record: int  #: Place of its first record in the log.
    samples: int = field(metadata={"least": 1})
    start: str  #: When it began, for people.
    value: float  #: Value at which it stood.
    why: str  #: What shows that it should have moved.


@dataclass(frozen=True, kw_only=True)
class FieldEntry:
    """Counts of one field: samples, NaN of the device, values out of range, stuck stretches.

    ``at_end``: samples of an inertial unit at the end of its range.
    """

    schema_name: ClassVar[str] = "ledger_field"

    #: Samples of an inertial unit that stand at the end of its range.
    at_end: int = field(default=0, metadata=LEFT_OUT_WHEN_DEFAULT)
    #: First value outside its range; null without any.
    first_out_of_range: OutOfRange | None = field(default=None, metadata=LEFT_OUT_WHEN_DEFAULT)
    nan: int = 0  #: Samples that the device itself wrote as NaN.
    out_of_range: int = 0  #: Samples outside the range of the signal.
    present: int = 0  #: Samples that have the field.
    #: Stretches in which the value did not move though it should have.
    stuck: tuple[StuckStretch, ...] = field(default=(), metadata=LEFT_OUT_WHEN_DEFAULT)


@dataclass(frozen=True, kw_only=True)
class TopicGaps:
    """Gaps of a topic: number, total and longest.

    ``listed`` are the first ones: time of the last sample before the gap, and seconds to the next sample.
    """

    count: int  #: Number of gaps.
    listed: tuple[tuple[str, float], ...] = ()  #: First gaps: time of the sample before, seconds to the next one.
    longest_s: float  #: Length of the longest.
    total_s: float = 0.0  #: Length of all gaps together.


@dataclass(frozen=True, kw_only=True)
class CounterEntry:
    """Losses that one counter of the log shows; ``kind``: it counts ``records`` or ``losses``.

    ``listed`` holds the record after each loss and how many were lost.
    """

    before: int = 0  #: Losses that stood in the counter at its first record.
    field: str  #: Field that counts.
    #: What it counts: every record written, or every loss.
    kind: str = dataclasses.field(metadata={"one_of": ("records", "losses")})
    listed: tuple[tuple[str, int], ...] = ()  #: Record after each loss, and how many were lost there.
    lost: int  #: Losses that it shows altogether.
    resets: int = 0  #: Times that it began anew.


@dataclass(frozen=True, kw_only=True)
class TopicEntry:
    """Counts of one topic; rate and coverage are None where no step is usual.

    ``losses`` counts by kind what was unreadable. Of an inertial unit: ``jitter_s`` of its steps, and the share of the
    time that its increments cover.
    """

    schema_name: ClassVar[str] = "ledger_topic"

    actual_rate_hz: float | None  #: Samples over the time they span.
    backward_steps: int  #: Steps back of device time.
    coverage: float | None  #: Samples there over those that the nominal rate expects.
    duplicates: int  #: Rows at the time of the one before, in order of time.
    fields: Mapping[str, FieldEntry] = field(default_factory=dict)  #: Counts of each field, by name.
    first: str  #: Time of the first row, for people.
    gaps: TopicGaps  #: Steps that are longer than a gap may be.
    #: Of an inertial unit that logs increments, share of the time that they cover.
    increments_share: float | None = field(default=None, metadata=LEFT_OUT_WHEN_DEFAULT)
    #: RMS of the steps of an inertial unit less the nominal one, gaps left out.
    jitter_s: float | None = field(default=None, metadata=LEFT_OUT_WHEN_DEFAULT)
    last: str  #: Time of the last row, for people.
    losses: Mapping[str, int] = field(default_factory=dict)  #: Unreadable rows, by kind.
    nominal_rate_hz: float | None  #: Rate by the usual step between samples.
    rows: int  #: Rows that were read.
    sequences: tuple[CounterEntry, ...] = ()  #: Counters of the log that show losses.
    span_s: float  #: From the first row to the last.
    stray_rows: int  #: Rows out of order.

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

    cause: str  #: What damaged it, as a word.
    count: int  #: Records or samples that are damaged within.
    field: str  #: Field concerned; empty for all fields of the topic.
    is_exact: bool  #: True: everything within is damaged; else the damage lies somewhere within.
    length_s: float  #: From beginning to end.
    start: str  #: Beginning as the log's clock tells it, for people.
    start_s: float  #: Seconds from the first record of the log, as flight time counts.
    topic: str  #: Topic concerned; empty for the whole log.


@dataclass(frozen=True, kw_only=True)
class DamageEntry:
    """Data that was lost or is odd: kind, place, how many of what."""

    count: int  #: How many of `what`.
    kind: str  #: Short name of the damage.
    loses_data: bool  #: Whether something is missing from the flight by it.
    place: str  #: Record, byte or time at which it stands, as text.
    topic: str  #: Topic concerned; empty for the whole log.
    what: str  #: Noun that is counted: records, bytes, samples.


@dataclass(frozen=True, kw_only=True)
class RemarkEntry:
    """Something the reader derived, converted or assumed."""

    code: str  #: Stable name for scripts.
    text: str  #: One line for people.
    topic: str = ""  #: Topic concerned; empty for the whole log.


@dataclass(frozen=True, kw_only=True)
class Dropouts:
    """Number and total length of the times the recorder could not write.

    A whole 0 where it always could.
    """

    count: int = 0  #: How often writing stopped.
    total_s: float | int = 0  #: Length of all of them together.


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

    count: int  #: How much is lost, of `what`.
    place: str  #: Where the log ends, as text.
    what: str  #: Noun that is counted: bytes, records.


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
    damages: tuple[DamageEntry, ...] = ()  #: Losses and oddities, each with its kind, place and count.
    dropouts: Dropouts = field(default_factory=Dropouts)  #: Times at which the recorder could not write.
    #: How long a step between samples must be to count as a gap.
    gap_definition: GapDefinition = field(default_factory=GapDefinition)
    #: Times without log while disarmed; left out of summary.json where there is none.
    pauses: tuple[PauseEntry, ...] = field(default=(), metadata=LEFT_OUT_WHEN_DEFAULT)
    remarks: tuple[RemarkEntry, ...] = ()  #: What the reader derived, converted or assumed.
    #: First byte, last byte and length of every part that made no record.
    skipped_spans: tuple[tuple[int, int, int], ...] = ()
    spans: tuple[DamagedSpan, ...] = ()  #: Damaged spans of time, in order.
    spans_more: int = 0  #: Number of damaged spans beyond those listed.
    thresholds: ThresholdsUsed = field(default_factory=ThresholdsUsed)  #: Limits that the ledger was made with.
    topics: Mapping[str, TopicEntry] = field(default_factory=dict)
    truncated: Truncation | None = None  #: Where the log is cut; null where it is whole.

    def __repr__(self) -> str:
        rows = sum(one.rows for one in self.topics.values())
        gaps = sum(one.gaps.count for one in self.topics.values())
        told = [
            f"{counted(rows, 'row')} of {counted(len(self.topics), 'topic')}",
            counted(gaps, "gap"),
            counted(len(self.damages), "damage"),
        ]
        if self.truncated is not None:
            told.append(f"cut at {self.truncated.place}")
        return f"<Ledger: {', '.join(told)}; {self.loss or 'no data lost'}>"

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

    @property
    def loss(self) -> str:
        """The loss in words: the end alone, or more than it; empty where nothing is lost.

        Examples
        --------
        >>> cut = Truncation(count=41, place="bytes 55 to 95", what="bytes of a frame that is cut off")
        >>> Ledger(truncated=cut).loss, Ledger().loss
        ('end cut off', '')
        """
        if not self.loses_data:
            return ""
        return DATA_LOST if any(one.loses_data and one.kind != TRUNCATED for one in self.damages) else END_CUT

    @property
    def is_in_midst(self) -> bool:
        """Tell whether all that is lost is the record that was being written when the log ended."""
        return self.loss == END_CUT and self.truncated is not None and self.truncated.what.startswith(UNFINISHED)
