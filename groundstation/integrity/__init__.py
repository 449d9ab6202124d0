"""Integrity: the clock model of a log, its ledger of losses and oddities, and records in order of corrected time."""

from groundstation.integrity.clock import Clock
from groundstation.integrity.clock_steps import ClockSettings, ClockStep
from groundstation.integrity.ledger import FieldLedger, Ledger, TopicLedger
from groundstation.integrity.ledger_findings import ledger_findings
from groundstation.integrity.limits import Thresholds, thresholds_from
from groundstation.integrity.ordering import corrected
from groundstation.integrity.rhythm import Gaps
from groundstation.integrity.survey import Survey, survey

__all__ = [
    "Clock",
    "ClockSettings",
    "ClockStep",
    "FieldLedger",
    "Gaps",
    "Ledger",
    "Survey",
    "Thresholds",
    "TopicLedger",
    "corrected",
    "ledger_findings",
    "survey",
    "thresholds_from",
]
