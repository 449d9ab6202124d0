"""End of a log in the air: an aircraft that sinks fast at its last sample did not land."""

from collections.abc import Iterator

import numpy as np

from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.systems.health.answer import FALL
from groundstation.systems.health.evidence import Event, Spans
from groundstation.tables.table import Flight

LAST_S = 1.0  # of the log: its median is the rate of descent at the end
SINKS_MPS = 8.0  # ours: a multirotor lowers itself by 1 to 3 m/s, a plane on approach by 1 to 4
DOWN = "velocity_down_mps"


def ends_in_the_air(flight: Flight, air: Spans) -> Iterator[Event]:
    """Yield a failure where an aircraft in the air sinks fast at the end of its log."""
    if not air.is_flown or not len(air.end_ns):
        return
    end_ns = flight.start_ns + round(flight.duration_s * NS_PER_S)
    for topic in (*topics_of_kind("ins", flight.topics()), *topics_of_kind("gnss", flight.topics())):
        table = flight[topic]
        if not table.has(DOWN):
            continue
        rows = (table.time_ns >= end_ns - round(LAST_S * NS_PER_S)) & (table.time_ns >= air.start_ns[-1])
        down = table.values(DOWN)[rows]
        down = down[np.isfinite(down)]
        if not len(down):
            continue
        is_open = end_ns - air.end_ns[-1] <= round(LAST_S * NS_PER_S)
        if is_open and np.median(down) > SINKS_MPS:
            text = f"{FALL}, sinking at {np.median(down):.0f} m/s"
            yield Event("faults", int(table.time_ns[rows][0]), "fail", text, f"{topic}.{DOWN}")
        return
