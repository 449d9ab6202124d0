"""Integrity: clock model of a log, ledger of losses and oddities, records in time order."""

from groundstation.base.gaps import Gaps
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.clock_steps import ClockSettings, ClockStep
from groundstation.integrity.ledger import FieldCounts, LedgerCounts, TopicCounts
from groundstation.integrity.ledger_findings import ledger_findings
from groundstation.integrity.limits import Thresholds, thresholds_from
from groundstation.integrity.ordering import corrected
from groundstation.integrity.survey import Survey, survey

__all__ = [
    "ClockModel",
    "ClockSettings",
    "ClockStep",
    "FieldCounts",
    "Gaps",
    "LedgerCounts",
    "Survey",
    "Thresholds",
    "TopicCounts",
    "corrected",
    "ledger_findings",
    "survey",
    "thresholds_from",
]
