"""Kind of INS: whether GNSS corrects it, and how often its mode says so, by its log."""

import numpy as np

from groundstation.tables.table import Table

UNAIDED, AIDED, UNKNOWN = "unaided", "gnss_aided", "unknown"
STATED = (UNAIDED, AIDED)  # kinds that an aircraft file or the head of a log may state
HALF = 0.5


def aided_share(table: Table) -> float:
    """Share of the samples with a mode whose mode is ``gnss_aided``; 0 where none has a mode."""
    modes = table.text("mode")
    stated = modes != ""
    return float(np.mean(modes[stated] == AIDED)) if stated.any() else 0.0


def is_mostly_aided(table: Table) -> bool:
    """Tell whether the logged mode of an INS is ``gnss_aided`` for more than half of the time."""
    return aided_share(table) > HALF
