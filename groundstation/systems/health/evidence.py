"""Evidence of an autopilot's health: quantities, events, and when it flew."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.base.units import NS_PER_S
from groundstation.systems.health.answer import WHOLE_LOG
from groundstation.systems.health.logged import is_number
from groundstation.systems.known import Known
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight
from groundstation.tables.wheels import contact_of

FloatArray = NDArray[np.float64]
Grade = Literal["info", "warn", "fail"]
SHORTEST_FLIGHT_S = 2.0  # a shorter span off the ground is a flag that bounces
NS = int(NS_PER_S)
ZERO = "zero throughout"
FLOWN = "in the air"
ARMED_BIT = 128  # of MAVLink's base mode


@dataclass(frozen=True, eq=False)
class Evidence:
    """One logged quantity that a check judges.

    Parameters
    ----------
    check : str
        Key of the check: ``innovations``, ``gnss``, ``vibration``.
    quantity : str
        Key of its thresholds in thresholds.toml.
    sensor : str
        Which of several, for people: ``magnetic heading``, ``GNSS 1``.
    source : str
        Topic and field: ``raw.estimator_status.mag_test_ratio``.
    unit : str
    time_ns : ndarray of int64, shape (n,)
        Corrected time, never decreasing.
    value : ndarray, shape (n,)
        NaN where absent.
    instance : int, optional
    blank : str
        Why it is logged without a value; empty where it has values.
    """

    check: str
    quantity: str
    sensor: str
    source: str
    unit: str
    time_ns: Int64Array
    value: FloatArray
    instance: int | None = None
    blank: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_ns", frozen(np.asarray(self.time_ns, dtype=np.int64)))
        object.__setattr__(self, "value", frozen(np.asarray(self.value, dtype=np.float64)))


def blank(check: str, source: str, time_ns: Int64Array, why: str) -> Evidence:
    """Return evidence of a quantity that is logged without a value, and why.

    ``why`` is in words: ``VIBRATION is zero throughout``.
    """
    return Evidence(check, "", "", source, "", time_ns, np.full(len(time_ns), np.nan), blank=why)


@dataclass(frozen=True)
class Event:
    """Something that happened at a time, with its grade and the text for people."""

    check: str
    time_ns: int
    grade: Grade
    text: str
    source: str


@dataclass(frozen=True, eq=False)
class Spans:
    """Spans of corrected time, in order and apart: shape (k,) each.

    ``method`` says what they rest on; ``words`` what they are: "in the air", "while armed", "in the whole log".
    """

    start_ns: Int64Array
    end_ns: Int64Array
    method: str = ""
    words: str = FLOWN

    @property
    def is_flown(self) -> bool:
        """Tell whether anything says that it flew, or was armed, in these spans."""
        return self.words != WHOLE_LOG

    @property
    def seconds(self) -> float:
        """Length of all spans together."""
        return float(np.sum(self.end_ns - self.start_ns)) / NS_PER_S

    def until(self, time_ns: Int64Array) -> FloatArray:
        """Return the seconds of the spans that lie before each time, shape as ``time_ns``."""
        if not len(self.start_ns):
            return np.zeros(np.shape(time_ns))
        zero = int(self.start_ns[0])
        edges = np.column_stack([self.start_ns, self.end_ns]).ravel() - zero
        lengths = np.column_stack([np.zeros(len(self.start_ns)), self.end_ns - self.start_ns]).ravel()
        return np.asarray(np.interp(np.asarray(time_ns) - zero, edges, np.cumsum(lengths)) / NS_PER_S)

    def hold(self, time_ns: Int64Array) -> NDArray[np.bool_]:
        """Tell which times lie in a span, shape as ``time_ns``."""
        place = np.searchsorted(self.start_ns, time_ns, side="right") - 1
        inside = place >= 0
        if len(self.start_ns):
            inside &= time_ns < self.end_ns[np.maximum(place, 0)]
        return np.asarray(inside)


def in_the_air(flight: Flight, known: Known) -> Spans:
    """Return the spans in which the autopilot flew.

    Its own flag of being landed comes first, then the flight phases, then the time it was armed, then the whole log:
    a rover, a boat and a log without any of them are judged too, and the words say over what.
    """
    for spans in (_by_landed_flag(flight), _by_flying(flight), _by_phases(flight, known.phases), _by_armed(flight)):
        if len(spans.start_ns):
            return spans
    return whole_log(flight)


def not_flown(flight: Flight, air: Spans) -> str:
    """Return the flag by which an aircraft did not fly.

    It is empty where it flew, or where no flag says it.
    """
    if air.words == FLOWN:
        return ""
    if "raw.STAT" in flight and is_number(flight["raw.STAT"], "isFlying"):
        return "" if np.any(flight["raw.STAT"].values("isFlying") == 1.0) else "STAT.isFlying 0"
    contact = contact_of(flight)
    is_whole = contact is not None and len(contact.time_ns) > 1 and bool(contact.on_ground.all())
    return contact.name.partition(" (")[0] if contact is not None and is_whole else ""


def whole_log(flight: Flight) -> Spans:
    """Return the whole log as one span."""
    end_ns = flight.start_ns + round(flight.duration_s * NS_PER_S) + 1  # its last sample belongs to it
    return Spans(np.array([flight.start_ns]), np.array([end_ns]), "nothing says that it flew", WHOLE_LOG)


def _by_landed_flag(flight: Flight) -> Spans:
    contact = contact_of(flight)
    if contact is None:
        return _none()
    return spans_where(contact.time_ns, ~contact.on_ground, contact.hold_ns, contact.name)


def _by_flying(flight: Flight) -> Spans:
    """Return when an ArduPilot plane took itself for flying."""
    if "raw.STAT" not in flight or not is_number(flight["raw.STAT"], "isFlying"):
        return _none()
    table = flight["raw.STAT"]
    return spans_where(table.time_ns, table.values("isFlying") == 1.0, 10 * NS, "STAT.isFlying")


def _by_phases(flight: Flight, phases: Phases) -> Spans:
    """Return the flight by phases, those that speed and height make likely among them."""
    found = [one for one in phases.likely or phases.intervals if one.phase == "airborne"]
    start = np.array([flight.start_ns + round(one.start_s * NS_PER_S) for one in found], dtype=np.int64)
    end = np.array([flight.start_ns + round(one.end_s * NS_PER_S) for one in found], dtype=np.int64)
    return Spans(start, end, phases.method)


def _by_armed(flight: Flight) -> Spans:
    if "raw.vehicle_status" in flight and is_number(flight["raw.vehicle_status"], "arming_state"):
        table = flight["raw.vehicle_status"]
        armed = table.values("arming_state") == 2.0
        return spans_where(table.time_ns, armed, 10 * NS, "vehicle_status.arming_state", "while armed")
    if "raw.HEARTBEAT" in flight and is_number(flight["raw.HEARTBEAT"], "base_mode"):
        table = flight["raw.HEARTBEAT"]
        armed = np.nan_to_num(table.values("base_mode")).astype(np.int64) & ARMED_BIT != 0
        return spans_where(table.time_ns, armed, 10 * NS, "HEARTBEAT.base_mode", "while armed")
    if "raw.STAT" in flight and is_number(flight["raw.STAT"], "Armed"):
        table = flight["raw.STAT"]
        return spans_where(table.time_ns, table.values("Armed") == 1.0, 10 * NS, "STAT.Armed", "while armed")
    for name, field, yes, no in (("ARM", "ArmState", 1.0, 0.0), ("EV", "Id", 10.0, 11.0)):
        if f"raw.{name}" in flight and is_number(flight[f"raw.{name}"], field):
            table = flight[f"raw.{name}"]
            told = table.take(np.isin(table.values(field), (yes, no)))
            if not len(told):
                continue
            end_ns = flight.start_ns + round(flight.duration_s * NS_PER_S)
            time_ns = np.append(told.time_ns, max(end_ns, int(told.time_ns[-1])))
            armed = np.append(told.values(field) == yes, False)
            return spans_where(time_ns, armed, end_ns - flight.start_ns + 1, f"{name}.{field}", "while armed")
    return _none()


def spans_where(
    time_ns: Int64Array, is_true: NDArray[np.bool_], hold_ns: int, method: str = "", words: str = FLOWN
) -> Spans:
    """Return the spans in which samples say yes.

    Each sample speaks until the next one, but no longer than ``hold_ns``.
    """
    if not len(time_ns):
        return _none()
    until = np.minimum(np.append(time_ns[1:], time_ns[-1]), time_ns + hold_ns)
    start, end = time_ns[is_true], until[is_true]
    if not len(start):
        return _none()
    fresh = np.concatenate([[True], start[1:] > end[:-1]])
    first = np.flatnonzero(fresh)
    last = np.append(first[1:], len(start)) - 1
    start, end = start[first], end[last]
    long = end - start >= round(SHORTEST_FLIGHT_S * NS_PER_S)
    return Spans(start[long], end[long], method, words)


def _none() -> Spans:
    nothing = np.zeros(0, dtype=np.int64)
    return Spans(nothing, nothing)
