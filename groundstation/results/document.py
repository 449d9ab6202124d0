"""Parts of summary.json around the answers.

The schema is generated from them and from the answers' types.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from groundstation.base.clock import Clock
from groundstation.base.findings import Finding
from groundstation.base.ledger import Ledger
from groundstation.results.flight import NotAssessable, Source, Status

SCHEMA_VERSION = 1
UTC = r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$"


@dataclass(frozen=True)
class FlightDocument:
    """Identity of the flight; ``start_utc`` is null without absolute time."""

    schema_name: ClassVar[str] = "flight"

    id: str = field(metadata={"pattern": "^[A-Za-z0-9_-]+$"})
    aircraft: str
    flight: str
    start_utc: str | None = field(metadata={"pattern": UTC})
    duration_s: float
    source: Source
    metadata: Mapping[str, str]


@dataclass(frozen=True)
class SummaryDocument:
    """The whole of summary.json; ``results`` are the answers by the name of their analysis."""

    schema_version: int
    flight: FlightDocument
    status: Status
    completeness: Mapping[str, float] = field(default_factory=dict)
    ledger: Ledger = field(default_factory=Ledger)
    clock: Clock = field(default_factory=Clock)
    findings: tuple[Finding, ...] = ()
    not_assessable: tuple[NotAssessable, ...] = ()
    results: Mapping[str, Any] = field(default_factory=dict)
