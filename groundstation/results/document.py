"""Parts of summary.json around the answers.

The schema is generated from them and from the answers' types.
"""

from collections.abc import Mapping
from dataclasses import field
from typing import Any, ClassVar

from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.ledger import Ledger
from groundstation.results.flight import NotAssessable, Source, Status

SCHEMA_VERSION = 1
UTC = r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$"


@dataclass(frozen=True)
class FlightDocument:
    """Identity of the flight; ``start_utc`` is null without absolute time."""

    schema_name: ClassVar[str] = "flight"

    #: Name of the flight's folder: start, aircraft and number, or NOTIME and a digest.
    id: str = field(metadata={"pattern": "^[A-Za-z0-9_-]+$"})
    aircraft: str  #: Registration or name as logged or as the aircraft file has it; may be empty.
    flight: str  #: Number or name of the flight as logged; may be empty.
    start_utc: str | None = field(metadata={"pattern": UTC})  #: First corrected time, ISO 8601 with Z: flight second 0.
    duration_s: float  #: From the first to the last record.
    source: Source  #: The log the flight was read from.
    metadata: Mapping[str, str]  #: What the log says of itself, by name, as text.


@dataclass(frozen=True)
class SummaryDocument:
    """The whole of summary.json; ``results`` are the answers by the name of their analysis."""

    schema_version: int  #: Version of this file's form; another number may have other fields.
    flight: FlightDocument  #: Which flight it is, and the log it comes from.
    status: Status  #: ok; degraded: data was lost; failed: a finding of severity fail.
    completeness: Mapping[str, float] = field(default_factory=dict)  #: Samples there over samples expected, by topic.
    ledger: Ledger = field(default_factory=Ledger)  #: What the log holds topic by topic, and its damage.
    clock: Clock = field(default_factory=Clock)  #: How the recorder's clock was read and repaired.
    findings: tuple[Finding, ...] = ()  #: What a person should know, with stable codes for scripts.
    not_assessable: tuple[NotAssessable, ...] = ()  #: Analyses that could not run, each with its reason.
    results: Mapping[str, Any] = field(default_factory=dict)
