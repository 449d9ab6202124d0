"""Contacts after the touchdown: a bounce, or a strut that rebounds."""

import numpy as np

from groundstation.systems.landing.evidence import Evidence
from groundstation.systems.landing.touchdown_answer import SecondContact
from groundstation.systems.landing.witnesses import SLOWEST_LOAD_HZ, jumps_of
from groundstation.tables.motion import runs

IMPACT_S = 0.4  # of the contact before, which is left out
SOONEST_S, LATEST_S = 0.5, 6.0  # of a second contact behind the first
LIGHT_G, LIGHT_S = 0.95, 0.4  # the load in between stays below that for so long
SECOND_G = 0.15  # least jump


def second_contacts(evidence: Evidence) -> tuple[SecondContact, ...]:
    """Return jumps of the load behind the touchdown that come after a light load."""
    load = evidence.load
    if load is None or load.rate_hz < SLOWEST_LOAD_HZ:
        return ()
    jumps = jumps_of(load, evidence.time_s - 8.0)
    found: list[SecondContact] = []
    before_s = evidence.time_s
    for at_s, size_g in zip(jumps.time_s, jumps.size_g, strict=True):
        if not SOONEST_S <= at_s - evidence.time_s <= LATEST_S or size_g < SECOND_G:
            continue
        between = (load.time_s > before_s + IMPACT_S) & (load.time_s < at_s)
        spells = runs(load.load_g[between] < LIGHT_G)  # scattered samples are the noise of a roll-out
        light_s = max((last - first for first, last in spells), default=0) / load.rate_hz
        mean_g = float(np.mean(load.load_g[between])) if between.any() else 1.0
        if light_s >= LIGHT_S and mean_g < 1.0:
            here = np.flatnonzero((load.time_s >= at_s) & (load.time_s <= at_s + IMPACT_S + 0.1))
            top = int(here[np.argmax(load.load_g[here])]) if here.size else len(load.time_s) - 1
            told = f"{load.topic}, {light_s:.1f} s light"
            found.append(SecondContact(float(load.time_s[top]), float(load.load_g[top]), told))
        before_s = float(at_s)
    return tuple(found)
