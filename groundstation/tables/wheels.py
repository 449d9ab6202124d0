"""Weight on wheels and landed flags, and whether they can be believed."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array, frozen
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.tables.motion import RATE_HZ, Motion, running_mean, runs
from groundstation.tables.table import Flight, Table

SHORTEST_HOLD_S, LONGEST_HOLD_S = 2.0, 10.0
STEPS_HELD = 3.0
WHEELS = "weight on wheels"  # name of the flag of a switch
PX4_LANDED = "raw.vehicle_land_detected"
NOT_BELIEVED_S = 10.0
NOT_BELIEVED_HEIGHT_M, NOT_BELIEVED_SLOPE, NOT_BELIEVED_SPEED_MPS = 30.0, 0.02, 5.0


@dataclass(frozen=True)
class Contact:
    """A logged flag of ground contact.

    Parameters
    ----------
    name : str
        ``weight on wheels`` or ``landed flag``, with what is said of its origin.
    time_ns : ndarray of int64, shape (n,)
    on_ground : ndarray of bool, shape (n,)
    hold_ns : int
        Longest time for which a sample speaks: three median steps, within 2 and 10 s.
    """

    name: str
    time_ns: Int64Array
    on_ground: BoolArray
    hold_ns: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_ns", frozen(self.time_ns))
        object.__setattr__(self, "on_ground", frozen(self.on_ground))


def contact_of(flight: Flight) -> Contact | None:
    """The flag of ground contact of a flight; None when there is none."""
    for topic in topics_of_kind("discrete", flight.topics()):
        if flight[topic].has("weight_on_wheels"):
            origin = flight.metadata.get(f"derived.{topic}.weight_on_wheels", "")
            name = f"landed flag ({origin})" if "land" in origin.lower() else WHEELS
            return _contact(name, flight[topic], "weight_on_wheels")
    for topic in flight.topics():
        if topic.startswith(PX4_LANDED) and flight[topic].has("landed"):
            return _contact("landed flag", flight[topic], "landed")
    return None


def held(contact: Contact, time_ns: Int64Array) -> tuple[BoolArray, BoolArray]:
    """Tell where the flag proves contact and where it denies it.

    Both masks have the shape of ``time_ns``. Contact needs a sample on either side that says so, each within the hold
    (one side only past the ends of the flag): between the last sample on the ground and the first in the air the
    lift-off may have been anywhere. Denial is the newest sample within the hold.
    """
    count = len(contact.time_ns)
    after = np.searchsorted(contact.time_ns, time_ns, side="left")
    before = np.searchsorted(contact.time_ns, time_ns, side="right") - 1
    newest, next_one = np.clip(before, 0, count - 1), np.clip(after, 0, count - 1)
    is_near_newest = (before >= 0) & (time_ns - contact.time_ns[newest] <= contact.hold_ns)
    is_near_next = (after < count) & (contact.time_ns[next_one] - time_ns <= contact.hold_ns)
    proves = is_near_newest & contact.on_ground[newest]
    proves &= np.where(after < count, is_near_next & contact.on_ground[next_one], True)
    return np.asarray(proves), np.asarray(is_near_newest & ~contact.on_ground[newest])


def disbelief(contact: Contact, motion: Motion, grid_ns: Int64Array) -> str:
    """Explain why the flag cannot be right; empty when nothing speaks against it.

    While a flag says ground without a break, nothing rises 30 m (and 2 % of the distance) above the lowest point of
    that stretch and moves there for ten seconds.
    """
    proves, _ = held(contact, grid_ns)
    altitude = running_mean(motion.all_altitudes_m, 1.0)
    for start, end in runs(proves):
        rows = slice(start, end)
        above, speed = _height_above_lowest(motion, altitude, rows), motion.speed_mps[rows]
        flies = (above > NOT_BELIEVED_HEIGHT_M) & (speed > NOT_BELIEVED_SPEED_MPS)
        if np.count_nonzero(flies) > NOT_BELIEVED_S * RATE_HZ:
            height = float(np.nanmax(above))
            return (
                f"{contact.name} not believed: on the ground from {start / RATE_HZ:.0f} to {end / RATE_HZ:.0f} s, "
                f"rising {height:.0f} m at up to {float(np.nanmax(speed)):.0f} m/s"
            )
    return ""


def _height_above_lowest(motion: Motion, altitude_m: FloatArray, rows: slice) -> FloatArray:
    """Return the height above the lowest point of a stretch, shape (rows,).

    The slope of ground is taken off; the least of the sources counts.
    """
    heights = []
    for source in altitude_m[:, rows]:
        if np.isfinite(source).any():
            lowest = int(np.nanargmin(source))
            distance = motion.distance_m(np.array(rows.start + lowest), rows)
            heights.append(source - source[lowest] - NOT_BELIEVED_SLOPE * distance)
    return np.fmin.reduce(heights) if heights else np.full(rows.stop - rows.start, np.nan)


def _contact(name: str, table: Table, field: str) -> Contact:
    known = table.valid(field)
    time_ns = table.time_ns[known]
    steps = np.diff(time_ns)
    steps = steps[steps > 0]
    step_s = float(np.median(steps)) / NS_PER_S if steps.size else 0.0
    hold_s = min(max(STEPS_HELD * step_s, SHORTEST_HOLD_S), LONGEST_HOLD_S)
    return Contact(name, time_ns, table.values(field)[known] != 0.0, int(hold_s * NS_PER_S))
