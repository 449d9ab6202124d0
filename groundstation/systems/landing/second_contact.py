"""Contacts after the touchdown: a bounce, or a strut that rebounds."""

import numpy as np

from groundstation.systems.landing.evidence import Evidence
from groundstation.systems.landing.touchdown_answer import SecondContact
from groundstation.systems.landing.witnesses import SLOWEST_LOAD_HZ, jumps_of

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
        between = (load.time_s > before_s) & (load.time_s < at_s)
        light_s = float(np.count_nonzero(load.load_g[between] < LIGHT_G)) / load.rate_hz
        mean_g = float(np.mean(load.load_g[between])) if between.any() else 1.0
        if light_s >= LIGHT_S and mean_g < 1.0:
            here = (load.time_s >= at_s - 0.1) & (load.time_s <= at_s + 0.4)
            found.append(
                SecondContact(float(at_s), float(np.max(load.load_g[here])), f"{load.topic}, {light_s:.1f} s light")
            )
        before_s = float(at_s)
    return tuple(found)
