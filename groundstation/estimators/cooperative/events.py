"""A session as events in order of time, with what could not be used counted."""

from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.ecef import ecef_from_n, geodetic_deg_m
from groundstation.base.findings import Finding
from groundstation.base.records import BoolArray
from groundstation.estimators.cooperative.settings import CooperativeSettings
from groundstation.estimators.cooperative.vehicles import InertialVehicle, Vehicle
from groundstation.estimators.cooperative.wheeled_vehicle import WheeledVehicle
from groundstation.tables.session import NO_SLOT, DeadReckoning, Odometry, Ranges, Session

PEER, POINT, SATELLITE, HEIGHT = "peer", "point", "satellite", "height"
LOWEST_RANK = 1_000_000
AT_MOST_RANGE_M = 1e8


@dataclass(frozen=True, slots=True)
class Event:
    """One measurement.

    Parameters
    ----------
    time_s : float
    kind : {'peer', 'point', 'satellite', 'height'}
    receiver : int
        Vehicle.
    source : int
        Vehicle or point; -1 for a satellite or a height.
    value_m, variance_m2 : float
        Pseudo-range or height; NaN for a bearing alone.
    slot : int
    place_m : ndarray, shape (3,), optional
        Of a point or satellite.
    bearing_rad, bearing_variance_rad2 : float
        NaN without.
    is_two_way : bool
    arm_m : ndarray, shape (3,), optional
        From the source's antenna to its place, and from the receiver's place to its antenna.
    spread : float
        Share of the variances that is the spread of one reading, for the gate; the rest is for its repeating itself.
    """

    time_s: float
    kind: str
    receiver: int
    source: int
    value_m: float
    variance_m2: float
    slot: int
    place_m: FloatArray | None = None
    bearing_rad: float = float("nan")
    bearing_variance_rad2: float = float("nan")
    is_two_way: bool = False
    arm_m: FloatArray | None = None
    spread: float = 1.0


@dataclass(frozen=True)
class Prepared:
    """What every algorithm runs on.

    Parameters
    ----------
    session : Session
        Without the vehicles and rows of dead reckoning that cannot be used.
    vehicles : tuple of Vehicle
    events : tuple of Event
        In order of time; peers among vehicles that are there.
    point_axes : ndarray, shape (p, 3, 2)
        North and east at each ground point in the frame of the session.
    ranks : tuple of int
        Of the vehicles.
    findings : tuple of Finding
    """

    session: Session
    vehicles: tuple[Vehicle, ...]
    events: tuple[Event, ...]
    point_axes: FloatArray
    ranks: tuple[int, ...]
    findings: tuple[Finding, ...]

    def output_times_s(self, step_s: float) -> list[tuple[float, int]]:
        """Times of output with the vehicle each belongs to, in order of time."""
        found = []
        for index, vehicle in enumerate(self.vehicles):
            first = np.ceil(vehicle.first_s / step_s - 1e-9)
            for number in range(int(first), int(np.floor(vehicle.last_s / step_s + 1e-9)) + 1):
                found.append((number * step_s, index))
        return sorted(found)


def prepare(session: Session, settings: CooperativeSettings) -> Prepared:
    """Check a session and put its measurements in order of time.

    What cannot be used (no number, negative or absurd range, unknown peer, no dead reckoning at that time, time that
    steps back) is left out and counted, one finding a reason; nothing raises.
    """
    findings: list[Finding] = []
    tracks = [kept for kept in (_clean(track, findings) for track in session.vehicles) if kept is not None]
    vehicles = tuple(
        WheeledVehicle(track, settings)
        if isinstance(track, Odometry)
        else InertialVehicle(track, session.frame, settings)
        for track in tracks
    )
    places = {vehicle.name: index for index, vehicle in enumerate(vehicles)}
    points = {point.name: index for index, point in enumerate(session.points)}
    events = [
        *_link_events(session, vehicles, places, points, settings, findings),
        *_satellite_events(session, vehicles, places, findings),
        *_height_events(session, vehicles, places, findings),
    ]
    events.sort(key=lambda event: (event.time_s, event.slot))
    axes = np.zeros((len(session.points), 3, 2))
    for index, point in enumerate(session.points):
        axes[index] = np.eye(3)[:, :2]
        if session.frame == "ecef":
            latitude, longitude, _ = geodetic_deg_m(np.array(point.position_m))
            axes[index] = ecef_from_n(latitude, longitude)[:, :2]
    ranks = tuple(session.ranks.get(vehicle.name, LOWEST_RANK) for vehicle in vehicles)
    kept = replace(session, vehicles=tuple(tracks))
    return Prepared(kept, vehicles, tuple(events), axes, ranks, tuple(findings))


def _clean(track: DeadReckoning | Odometry, findings: list[Finding]) -> DeadReckoning | Odometry | None:
    """A track without rows that are no numbers or step back in time; None when nothing is left."""
    parts = {name: value for name, value in vars(track).items() if isinstance(value, np.ndarray)}
    needed = [value for name, value in parts.items() if name not in ("latitude_deg", "heading_deg")]
    good = np.ones(len(track), dtype=bool)
    for value in needed:
        good &= np.isfinite(value).reshape(len(track), -1 if value.size else 0).all(axis=1)
    latest = -np.inf
    for row in np.flatnonzero(good).tolist():
        if track.time_s[row] <= latest:
            good[row] = False
        else:
            latest = float(track.time_s[row])
    _count(
        findings, "dead_reckoning", "rows of dead reckoning that are no numbers or step back in time", ~good, track.name
    )
    if not good.any():
        findings.append(
            Finding("warn", "cooperative.no_dead_reckoning", f"{track.name} has no dead reckoning", track.name)
        )
        return None
    if good.all():
        return track
    return replace(track, **{name: value[good] for name, value in parts.items()})  # type: ignore[arg-type]


def _count(findings: list[Finding], code: str, text: str, bad: BoolArray, topic: str = "") -> None:
    count = int(bad.sum())
    if count:
        findings.append(Finding("warn", f"cooperative.{code}", f"left out {count} {text}", topic, count=count))


def _is_there(vehicles: tuple[Vehicle, ...], who: int, time_s: float) -> bool:
    return vehicles[who].first_s - 1e-9 <= time_s <= vehicles[who].last_s + 1e-9


def _link_events(
    session: Session,
    vehicles: tuple[Vehicle, ...],
    places: dict[str, int],
    points: dict[str, int],
    settings: CooperativeSettings,
    findings: list[Finding],
) -> list[Event]:
    table = session.ranges
    n = len(table)
    bearing = np.full(n, np.nan) if table.bearing_deg is None else np.deg2rad(table.bearing_deg)
    bearing_sigma = np.full(n, np.nan) if table.bearing_sigma_deg is None else np.deg2rad(table.bearing_sigma_deg)
    has_bearing = np.isfinite(bearing) & (bearing_sigma > 0.0)
    is_number = np.isfinite(table.pseudorange_m) & (table.sigma_m > 0.0) & np.isfinite(table.time_s)
    # a one-way pseudo-range has clocks in it and may be negative; a two-way one may not
    negative = is_number & (table.pseudorange_m < 0.0) if table.is_two_way else np.zeros(n, dtype=bool)
    absurd = is_number & (np.abs(table.pseudorange_m) > AT_MOST_RANGE_M)
    known = np.array(
        [
            r in places and (s in places or s in points) and r != s
            for r, s in zip(table.receiver, table.source, strict=True)
        ],
        dtype=bool,
    )
    _count(
        findings, "not_a_number", "link rows without a range and a bearing that are numbers", ~is_number & ~has_bearing
    )
    _count(findings, "negative_range", "negative two-way ranges", negative)
    _count(findings, "absurd_range", f"ranges beyond {AT_MOST_RANGE_M:g} m", absurd)
    _count(findings, "unknown_peer", "link rows of a vehicle or point that the session does not have", ~known)
    back = np.concatenate([[False], np.diff(table.time_s) < 0.0]) if n else np.zeros(0, dtype=bool)
    if back.any():
        count = int(back.sum())
        findings.append(
            Finding(
                "warn",
                "cooperative.clock_leap",
                f"time of the link steps back {count} times; rows put in order",
                count=count,
            )
        )
    as_white = _as_white(table, settings)
    stated = (table.sigma_m**2 + (settings.range_share * table.pseudorange_m) ** 2) * as_white
    usable = known & np.isfinite(table.time_s) & ((is_number & ~negative & ~absurd) | has_bearing)
    events, away = [], 0
    for row in np.flatnonzero(usable).tolist():
        time_s, source = float(table.time_s[row]), str(table.source[row])
        receiver = places[str(table.receiver[row])]
        is_peer = source in places
        if not _is_there(vehicles, receiver, time_s) or (is_peer and not _is_there(vehicles, places[source], time_s)):
            away += 1
            continue
        variance = float(stated[row]) + (settings.extra_range_sigma_m**2 if is_peer else 0.0)
        is_good = bool(is_number[row] and not negative[row] and not absurd[row])
        events.append(
            Event(
                time_s,
                PEER if is_peer else POINT,
                receiver,
                places[source] if is_peer else points[source],
                float(table.pseudorange_m[row]) if is_good else float("nan"),
                variance,
                int(table.slot[row]),
                None if is_peer else np.array(session.points[points[source]].position_m),
                float(bearing[row]) if has_bearing[row] else float("nan"),
                float(bearing_sigma[row] ** 2 * as_white[row]),
                table.is_two_way,
                None if table.arm_m is None else table.arm_m[row],
                1.0 / float(as_white[row]),
            )
        )
    _count_away(findings, away, "link rows")
    return events


def _as_white(table: Ranges, settings: CooperativeSettings) -> FloatArray:
    """Factor of the variance of each row, so that what repeats itself weighs no more than it tells.

    A share c of the variance decays with the time t: readings every dt seconds are worth white ones of the variance
    times 1 - c + c coth(dt / 2 t) (the spectral density at frequency 0 of a first-order Gauss-Markov sequence).
    """
    share, time_s = settings.correlated_share, settings.correlation_s
    if share <= 0.0:
        return np.ones(len(table))
    since_s, latest = np.full(len(table), np.inf), dict[tuple[str, str], tuple[float, float]]()
    for row, (at_s, receiver, source) in enumerate(
        zip(table.time_s.tolist(), table.receiver.tolist(), table.source.tolist(), strict=True)
    ):
        last_s, before_s = latest.get((receiver, source), (-np.inf, -np.inf))
        if at_s > last_s:  # several antennas of a pair measure at one time
            last_s, before_s = at_s, last_s
        since_s[row] = at_s - before_s
        latest[receiver, source] = last_s, before_s
    return np.asarray(1.0 - share + share / np.tanh(np.clip(since_s / time_s, 0.01, 100.0) / 2.0))


def _count_away(findings: list[Finding], away: int, what: str) -> None:
    if away:
        text = f"left out {away} {what} at times without dead reckoning"
        findings.append(Finding("warn", "cooperative.no_dead_reckoning_then", text, count=away))


def _satellite_events(
    session: Session, vehicles: tuple[Vehicle, ...], places: dict[str, int], findings: list[Finding]
) -> list[Event]:
    table = session.satellites
    good = np.isfinite(table.pseudorange_m) & np.isfinite(table.time_s) & np.isfinite(table.position_m).all(axis=1)
    good &= (table.sigma_m > 0.0) & (table.pseudorange_m > 0.0)
    known = np.array([str(name) in places for name in table.receiver], dtype=bool)
    _count(findings, "satellite_rows", "satellite rows that are no numbers or negative", ~good)
    _count(findings, "unknown_receiver", "satellite rows of a vehicle that the session does not have", ~known)
    events, away = [], 0
    for row in np.flatnonzero(good & known).tolist():
        receiver, time_s = places[str(table.receiver[row])], float(table.time_s[row])
        if not _is_there(vehicles, receiver, time_s):
            away += 1
            continue
        variance = float(table.sigma_m[row]) ** 2
        value, place = float(table.pseudorange_m[row]), table.position_m[row]
        events.append(Event(time_s, SATELLITE, receiver, -1, value, variance, NO_SLOT, place))
    _count_away(findings, away, "satellite rows")
    return events


def _height_events(
    session: Session, vehicles: tuple[Vehicle, ...], places: dict[str, int], findings: list[Finding]
) -> list[Event]:
    table = session.heights
    good = np.isfinite(table.height_m) & np.isfinite(table.time_s) & (table.sigma_m > 0.0)
    known = np.array([str(name) in places for name in table.aircraft], dtype=bool)
    _count(findings, "height_rows", "rows of heights that are no numbers", ~good)
    events = []
    for row in np.flatnonzero(good & known).tolist():
        who, time_s = places[str(table.aircraft[row])], float(table.time_s[row])
        if _is_there(vehicles, who, time_s) and vehicles[who].height >= 0:
            variance = float(table.sigma_m[row]) ** 2
            events.append(Event(time_s, HEIGHT, who, -1, float(table.height_m[row]), variance, NO_SLOT))
    return events
