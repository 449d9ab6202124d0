"""Kind of the vehicle that made a log: it rolls, flies, walks or floats.

Stated by the aircraft file, the head of the log or the firmware of the autopilot; else found from what only one kind
carries (wheel odometry, a switch on the wheels, air data) and from the way it moves. A kind that was found names
phases and says which are likely; it proves no ground contact.
"""

from collections.abc import Mapping
from typing import Literal, get_args

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.base.signals import topics_of_kind
from groundstation.tables.detector import Detection
from groundstation.tables.table import Flight
from groundstation.tables.travel import Travel, apart_at_one_place_m, lasts
from groundstation.tables.wheels import WHEELS, Contact, contact_of

VehicleKind = Literal["rolls", "flies", "walks", "floats"]
KINDS: tuple[VehicleKind, ...] = get_args(VehicleKind)
VEHICLE = "vehicle"  # metadata: the head of a log, a profile or the aircraft file
ALWAYS_ON_GROUND = "always_on_ground"  # the same for "rolls", as it was first called
STATED_BY = "vehicle.stated_by"  # metadata: who said it, where that is not the log
CONTRADICTION = "vehicle.contradiction"  # code of the finding
YES = ("true", "yes", "1")

FIRMWARES: tuple[tuple[str, VehicleKind], ...] = (
    *(("plane", "flies"), ("copter", "flies"), ("blimp", "flies")),
    *(("rover", "rolls"), ("sub", "floats")),
)  # what the names of ArduPilot's vehicles hold
MAV_TYPES: dict[int, VehicleKind] = {
    **dict.fromkeys((1, 2, 3, 4, 7, 8, 13, 14, 15, 16, 19, 20, 21, 22, 23, 24, 25, 28, 29), "flies"),
    10: "rolls",
    11: "floats",
    12: "floats",
}  # MAV_TYPE of MAVLink's common messages, which PX4 logs as vehicle_status.system_type
TYPE_FIELDS = (("raw.vehicle_status", "system_type"), ("raw.HEARTBEAT", "type"))
ROTORCRAFT = (2, 3, 4, 13, 14, 15, 29)  # MAV_TYPE: multirotors and helicopters; not one with wings too

STANDS_MPS = 0.5  # receivers at rest show less
WALKS_MPS = 2.5  # nobody walks faster
STROLLS_MPS = 0.6  # nobody walks slower for long
DRIVES_MPS = 3.5
FASTEST_CAR_MPS = 70.0
FLIES_MPS, FLIES_AIRSPEED_MPS, FLIES_S = 100.0, 40.0, 30.0  # no car and no train is so fast for so long
STEEP_AT_MPS = (0.0, 5.0, 15.0, 25.0, 35.0, 60.0)
STEEP_SLOPE = (0.5, 0.35, 0.2, 0.13, 0.09, 0.06)  # no road is so steep where one drives so fast
STEEP_CLIMB_M, STEEP_S = 10.0, 15.0  # climb across 10 s, and how long it lasts
UPRIGHT_CLIMB_M, UPRIGHT_S = 5.0, 3.0
SAME_PLACE_M = 15.0  # of altitude between two visits: more than a bridge, less than a circuit
AIRBORNE_S = 10.0
WALK_S, DRIVE_S, STOP_S = 20.0, 5.0, 3.0
SAILS_MPS = 40.0  # no boat is so fast


@dataclass(frozen=True)
class Vehicle:
    """Kind of the vehicle, None where it is not known.

    Parameters
    ----------
    kind : {'rolls', 'flies', 'walks', 'floats'}, optional
    why : str
        Who stated it, or what it was found by.
    is_stated : bool
    contradiction : str
        What the log shows against the kind that was stated; empty where nothing does.
    """

    kind: VehicleKind | None
    why: str
    is_stated: bool = False
    contradiction: str = ""

    @property
    def told(self) -> str:
        """Source of the kind: who stated it, or what it was found by."""
        return f"stated: {self.why}" if self.is_stated else f"found: {self.why}" if self.kind else self.why


def is_stated_to_roll(metadata: Mapping[str, str]) -> bool:
    """Tell whether the head of a log or the aircraft file states a vehicle that only rolls."""
    stated = metadata.get(VEHICLE, "").strip().lower()
    return stated == "rolls" or metadata.get(ALWAYS_ON_GROUND, "").strip().lower() in YES


def vehicle_of(flight: Flight, travel: Travel, contact: Contact | None, detection: Detection) -> Vehicle:
    """Return the kind of vehicle, as stated or else as found.

    With a stated kind comes what the log shows against it.

    Parameters
    ----------
    flight : Flight
    travel : Travel
        Its speed and height on the grid.
    contact : Contact, optional
        Weight on wheels or landed flag, where it can be believed.
    detection : Detection
        What the detector proves on the same grid.
    """
    stated = _stated(flight)
    flown = _flown(travel, contact, detection)
    if stated is None:
        return _found(flight, travel, flown)
    against = _against(stated.kind, travel, flown)
    return Vehicle(stated.kind, stated.why, True, f"{stated.why}: {stated.kind}, but {against}" if against else "")


def _stated(flight: Flight) -> Vehicle | None:
    by = flight.metadata.get(STATED_BY, "") or "head of the log"
    said = flight.metadata.get(VEHICLE, "").strip().lower()
    for kind in KINDS:
        if said == kind:
            return Vehicle(kind, by, True)
    if is_stated_to_roll(flight.metadata):
        return Vehicle("rolls", by, True)
    for part, kind in FIRMWARES:
        if part in said:
            return Vehicle(kind, f"firmware {flight.metadata[VEHICLE].strip()}", True)
    return _by_mav_type(flight)


def _by_mav_type(flight: Flight) -> Vehicle | None:
    for topic, name in TYPE_FIELDS:
        if topic in flight and flight[topic].has(name):
            values = flight[topic].values(name)
            numbers, counts = np.unique(values[np.isin(values, list(MAV_TYPES))], return_counts=True)
            if len(numbers):
                number = int(numbers[np.argmax(counts)])
                return Vehicle(MAV_TYPES[number], f"the autopilot's MAV_TYPE {number}", True)
    return None


def is_rotorcraft(flight: Flight) -> bool:
    """Tell whether the log says that it is of a multirotor or helicopter, which does not taxi."""
    for topic, name in TYPE_FIELDS:
        if topic in flight and flight[topic].has(name) and np.isin(flight[topic].values(name), ROTORCRAFT).any():
            return True
    return "copter" in f"{flight.metadata.get(VEHICLE, '')} {flight.metadata.get('firmware', '')}".lower()


def _flown(travel: Travel, contact: Contact | None, detection: Detection) -> str:
    """Return what shows that it flew; empty where nothing does."""
    if contact is not None and len(contact.time_ns):
        air_ns = np.diff(contact.time_ns, append=contact.time_ns[-1])[~contact.on_ground]
        off_s = float(np.sum(np.minimum(air_ns, contact.hold_ns))) / 1e9
        if off_s >= AIRBORNE_S:
            return f"{contact.name.partition(' (')[0]}: {_length(off_s)} off the ground"
    for speed, limit, what in (
        (travel.speed_mps, FLIES_MPS, ""),
        (travel.airspeed_mps, FLIES_AIRSPEED_MPS, " of airspeed"),
    ):
        fast_s = lasts(speed > limit, FLIES_S)
        if fast_s:
            return f"{_length(fast_s)} above {limit:.0f} m/s{what}"
    up_s = lasts(travel.above_ground_m > 30.0, AIRBORNE_S)
    if up_s:
        return f"{_length(up_s)} more than 30 m above the ground"
    air_s = lasts(detection.airborne, AIRBORNE_S)
    if air_s:
        return f"{_length(air_s)} higher than ground can be"
    steep_s = lasts(_is_steep(travel), STEEP_S)
    if steep_s:
        return f"{_length(steep_s)} steeper than a road"
    return "it rises or sinks on the spot" if lasts(_is_upright(travel), UPRIGHT_S) else ""


def _is_steep(travel: Travel) -> BoolArray:
    """Tell where it climbs or sinks as no road does at that speed."""
    slope = np.interp(travel.travelled_m / 10.0, STEEP_AT_MPS, STEEP_SLOPE)
    return np.asarray(travel.climbed_m > np.maximum(slope * travel.travelled_m, STEEP_CLIMB_M))


def _is_upright(travel: Travel) -> BoolArray:
    """Tell where it climbs or sinks more than it moves ahead."""
    return np.asarray(travel.climbed_m > np.maximum(travel.travelled_m, UPRIGHT_CLIMB_M))


def _found(flight: Flight, travel: Travel, flown: str) -> Vehicle:
    if flown:
        return Vehicle("flies", flown)
    for kind, why in _carried(flight):
        return Vehicle(kind, why)
    apart_m, perhaps_m = apart_at_one_place_m(travel)
    if apart_m > SAME_PLACE_M:
        return Vehicle("flies", f"it passed one place at altitudes {apart_m:.0f} m apart")
    speed = travel.slow_speed_mps
    known = speed[np.isfinite(speed)]
    if not known.size:
        return Vehicle(None, "the log has no speed and no positions that give one")
    fastest = float(np.max(known))
    moves_s = lasts(speed > STANDS_MPS, 1.0)
    if moves_s < DRIVE_S:
        return Vehicle(None, f"it never moved, {fastest:.1f} m/s at most")
    stops = lasts(speed <= STANDS_MPS, STOP_S) > 0.0
    if lasts(speed > DRIVES_MPS, DRIVE_S) and fastest < FASTEST_CAR_MPS:
        if perhaps_m > SAME_PLACE_M:
            return Vehicle(None, f"up to {fastest:.1f} m/s, with altitudes {perhaps_m:.0f} m apart at one place")
        if stops:
            return Vehicle("rolls", f"stops, up to {fastest:.1f} m/s, and never steeper than a road")
        return Vehicle(None, f"{float(np.min(known)):.1f} to {fastest:.1f} m/s without a stop or a steep climb")
    usual = float(np.median(known[known > STANDS_MPS]))
    if fastest <= WALKS_MPS and usual >= STROLLS_MPS and moves_s >= WALK_S:
        return Vehicle("walks", f"mostly {usual:.1f} m/s, never above {fastest:.1f} m/s, and no wheels in the log")
    return Vehicle(None, f"up to {fastest:.1f} m/s, as several kinds move")


def _carried(flight: Flight) -> list[tuple[VehicleKind, str]]:
    """Return the kinds by what only they carry, the surest first."""
    found: list[tuple[VehicleKind, str]] = []
    topics = flight.topics()
    if topics_of_kind("odometry", topics):
        found.append(("rolls", "wheel odometry in the log"))
    contact = contact_of(flight)
    if contact is not None and contact.name == WHEELS:
        found.append(("flies", "a flag of weight on wheels in the log"))
    if any(
        flight[topic].has(name)
        for topic in topics_of_kind("air", topics)
        for name in ("true_airspeed_mps", "indicated_airspeed_mps")
    ):
        found.append(("flies", "airspeed in the log"))
    if topics_of_kind("guidance", topics):
        found.append(("flies", "approach guidance in the log"))
    return found


def _against(kind: VehicleKind | None, travel: Travel, flown: str) -> str:
    """Return what the log shows against a kind; empty where nothing does."""
    if kind in ("rolls", "walks", "floats") and flown:
        return flown
    speed = travel.slow_speed_mps
    if kind == "walks" and lasts(speed > 3.0 * WALKS_MPS, DRIVE_S):
        return f"up to {float(np.nanmax(speed)):.1f} m/s"
    if kind == "floats" and lasts(speed > SAILS_MPS, DRIVE_S):
        return f"up to {float(np.nanmax(speed)):.1f} m/s"
    return ""


def _length(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} min" if seconds >= 120.0 else f"{seconds:.0f} s"
