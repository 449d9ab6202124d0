"""Heading corrections that the crew entered on board, as the log shows them."""

from typing import NamedTuple

import numpy as np

from groundstation.base.signals import topics_of_kind
from groundstation.tables.table import Flight


class Entered(NamedTuple):
    """A correction entered or changed: flight seconds, its value, change from the one before."""

    time_s: float
    correction_deg: float
    change_deg: float


def corrections_entered(flight: Flight) -> list[Entered]:
    """Return every entry after the first row of its topic, in order of time.

    Where none stood before, the change is all.
    """
    found: list[Entered] = []
    for topic in topics_of_kind("onboard", flight.topics()):
        entered, time_s = flight[topic].values("correction_entered_deg"), flight.time_s(topic)
        before = np.nan
        for row in np.flatnonzero(np.isfinite(entered)):
            if entered[row] != before and row > 0:
                change_deg = float(entered[row] - (before if np.isfinite(before) else 0.0))
                found.append(Entered(float(time_s[row]), float(entered[row]), change_deg))
            before = entered[row]
    return sorted(found)
