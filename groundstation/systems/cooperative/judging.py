"""Log of a judged measurement and count of rejections in a row, for every compiled loop."""

from groundstation.base.compile import in_place
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.loop_types import CLOCK_LEAPS, GATED, JUDGED, USED, Fleet, FloatArray, RunRecords

PATIENCE = 30  # rejections of a vehicle in a row: then its clock has leapt, or it is not where it thinks
LEAP_M = 1e5


@in_place
def write_down(event: int, innovation: float, variance: float, passes: bool, log: RunRecords) -> None:
    """Log a measurement as it was judged."""
    at = log.counts[JUDGED]
    log.event[at], log.innovation[at], log.variance[at] = event, innovation, variance
    log.mark[at] = USED if passes else GATED
    log.counts[JUDGED] += 1


@in_place
def count_rejection(
    fleet: Fleet,
    who: int,
    passes: bool,
    may_open: bool,
    rejected: Int64Array,
    first: int,
    P: FloatArray,
    log: RunRecords,
) -> None:
    """Count rejections in a row; open the clock of a vehicle that no range fits any more.

    ``first`` is where its states begin in ``P``.
    """
    rejected[who] = 0 if passes else rejected[who] + 1
    if rejected[who] < PATIENCE or fleet.clock[who] < 0 or not may_open:
        return
    rejected[who] = 0
    log.counts[CLOCK_LEAPS] += 1
    clock, other = first + fleet.clock[who], first + fleet.receiver_clock[who]
    P[clock, clock] += LEAP_M**2
    if other != clock:
        P[other, other] += LEAP_M**2
