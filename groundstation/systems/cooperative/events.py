"""A session as events in order of time, with what could not be used counted."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.ecef import ecef_from_n, geodetic_deg_m
from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.records import BoolArray, Int64Array
from groundstation.systems.cooperative.aircraft import aircraft_of
from groundstation.systems.cooperative.filters.sights import Sights
from groundstation.systems.cooperative.loop_types import (
    HEIGHT,
    PEER,
    POINT,
    SATELLITE,
    Events,
    PointNumbers,
)
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.vehicles import Vehicle
from groundstation.systems.cooperative.wheeled_vehicle import WheeledVehicle
from groundstation.tables.session import NO_SLOT, DeadReckoning, Odometry, Ranges, Session

LOWEST_RANK = 1_000_000
AT_MOST_RANGE_M = 1e8


@dataclass(frozen=True)
class Prepared:
    """Inputs of every algorithm.

    Parameters
    ----------
    session : Session
        Without the vehicles and rows of dead reckoning that cannot be used.
    vehicles : tuple of Vehicle
    events : Events
        In order of time; peers among vehicles that are there.
    points : PointNumbers
    ranks : tuple of int
        Of the vehicles.
    findings : tuple of Finding
    """

    session: Session
    vehicles: tuple[Vehicle, ...]
    events: Events
    points: PointNumbers
    ranks: tuple[int, ...]
    findings: tuple[Finding, ...]

    @cached_property
    def sights(self) -> Sights:
        """Places of antennas at the measurements, for all filters."""
        return Sights(self.vehicles, self.events)


def require_vehicles(prepared: "Prepared") -> None:
    """Raise NotAssessableError when no vehicle has dead reckoning."""
    if not prepared.vehicles:
        raise NotAssessableError("cooperative", "no vehicle with dead reckoning")


def prepare(session: Session, settings: CooperativeSettings) -> Prepared:
    """Check a session and put its measurements in order of time.

    What cannot be used (no number, negative or absurd range, unknown peer, no dead reckoning at that time, time that
    steps back) is left out and counted, one finding a reason; nothing raises.
    """
    findings: list[Finding] = []
    tracks = [kept for kept in (_clean(track, findings) for track in session.vehicles) if kept is not None]
    vehicles = tuple(
        WheeledVehicle(track, settings) if isinstance(track, Odometry) else aircraft_of(track, session.frame, settings)
        for track in tracks
    )
    places = {vehicle.name: index for index, vehicle in enumerate(vehicles)}
    points = {point.name: index for index, point in enumerate(session.points)}
    parts = (
        _link_events(session, vehicles, places, points, settings, findings),
        _satellite_events(session, vehicles, places, findings),
        _height_events(session, vehicles, places, findings),
    )
    joined = Events._make(np.concatenate(columns) for columns in zip(*parts, strict=True))
    order = np.lexsort((joined.slot, joined.time_s))
    ranks = tuple(session.ranks.get(vehicle.name, LOWEST_RANK) for vehicle in vehicles)
    return Prepared(
        replace(session, vehicles=tuple(tracks)),
        vehicles,
        Events._make(np.ascontiguousarray(column[order]) for column in joined),
        _points_of(session),
        ranks,
        tuple(findings),
    )


def _points_of(session: Session) -> PointNumbers:
    axes = np.zeros((len(session.points), 3, 2))
    for index, point in enumerate(session.points):
        axes[index] = np.eye(3)[:, :2]
        if session.frame == "ecef":
            latitude, longitude, _ = geodetic_deg_m(np.array(point.position_m))
            axes[index] = ecef_from_n(latitude, longitude)[:, :2]
    sigma = np.array([point.position_sigma_m for point in session.points], dtype=np.float64)
    number = np.cumsum(sigma > 0.0, dtype=np.int64) - 1
    return PointNumbers(axes, sigma, np.where(sigma > 0.0, number, -1))


def _clean(track: DeadReckoning | Odometry, findings: list[Finding]) -> DeadReckoning | Odometry | None:
    """Drop rows of a track that are no numbers or step back in time; None when none is left."""
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
        findings,
        "dead_reckoning",
        "rows of dead reckoning that are not numbers or step back in time",
        ~good,
        track.name,
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


def _is_there(vehicles: tuple[Vehicle, ...], who: Int64Array, time_s: FloatArray) -> BoolArray:
    """Tell whether each vehicle has dead reckoning then; ``who`` below 0: nobody asks."""
    spans = np.array([(vehicle.first_s, vehicle.last_s) for vehicle in vehicles] + [(-np.inf, np.inf)])
    return np.asarray((spans[who, 0] - 1e-9 <= time_s) & (time_s <= spans[who, 1] + 1e-9))


def _numbers_of(names: np.ndarray, places: dict[str, int]) -> Int64Array:
    """Number of each name, -1 for one that is not there."""
    unique, inverse = np.unique(names, return_inverse=True)
    found = np.array([places.get(str(name), -1) for name in unique], dtype=np.int64)
    return np.asarray(found[inverse] if len(names) else np.zeros(0, dtype=np.int64))


def _columns(
    time_s: FloatArray,
    kind: int | Int64Array,
    receiver: Int64Array,
    value_m: FloatArray,
    variance_m2: FloatArray,
    *,
    source: int | Int64Array = -1,
    slot: int | Int64Array = NO_SLOT,
    place_m: FloatArray | float = 0.0,
    bearing_rad: FloatArray | float = np.nan,
    bearing_variance_rad2: FloatArray | float = np.nan,
    is_two_way: bool = False,
    arm_m: FloatArray | float = 0.0,
    spread: FloatArray | float = 1.0,
) -> Events:
    """Columns of one length; ``kind`` and what else is the same for all are given once."""
    n = len(time_s)

    def whole(value: object) -> Int64Array:
        return np.broadcast_to(np.asarray(value, dtype=np.int64), n)

    def real(value: object, *more: int) -> FloatArray:
        return np.broadcast_to(np.asarray(value, dtype=np.float64), (n, *more))

    return Events(
        real(time_s),
        whole(kind),
        whole(receiver),
        whole(source),
        real(value_m),
        real(variance_m2),
        whole(slot),
        real(place_m, 3),
        real(bearing_rad),
        real(bearing_variance_rad2),
        np.full(n, is_two_way),
        real(arm_m, 3),
        real(spread),
    )


def _link_events(
    session: Session,
    vehicles: tuple[Vehicle, ...],
    places: dict[str, int],
    points: dict[str, int],
    settings: CooperativeSettings,
    findings: list[Finding],
) -> Events:
    table = session.ranges
    n = len(table)
    bearing = np.full(n, np.nan) if table.bearing_deg is None else np.deg2rad(table.bearing_deg)
    bearing_sigma = np.full(n, np.nan) if table.bearing_sigma_deg is None else np.deg2rad(table.bearing_sigma_deg)
    is_number = np.isfinite(table.pseudorange_m) & (table.sigma_m > 0.0) & np.isfinite(table.time_s)
    # a one-way pseudo-range has clocks in it and may be negative; a two-way one may not
    negative = is_number & (table.pseudorange_m < 0.0) if table.is_two_way else np.zeros(n, dtype=bool)
    absurd = is_number & (np.abs(table.pseudorange_m) > AT_MOST_RANGE_M)
    receiver, peer, point = (
        _numbers_of(names, of)
        for names, of in ((table.receiver, places), (table.source, places), (table.source, points))
    )
    has_heading = np.array([vehicle.heading >= 0 for vehicle in vehicles] + [False])[receiver]
    has_bearing = np.isfinite(bearing) & (bearing_sigma > 0.0) & has_heading
    is_peer = peer >= 0
    known = (receiver >= 0) & (is_peer | (point >= 0)) & (receiver != peer)
    _count(findings, "not_a_number", "link rows whose range and bearing are not numbers", ~is_number & ~has_bearing)
    _count(findings, "negative_range", "negative two-way ranges", negative)
    _count(findings, "absurd_range", f"ranges beyond {AT_MOST_RANGE_M:g} m", absurd)
    _count(findings, "unknown_peer", "link rows of a vehicle or point that is not in the session", ~known)
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
    is_good = is_number & ~negative & ~absurd
    usable = known & np.isfinite(table.time_s) & (is_good | has_bearing)
    is_there = _is_there(vehicles, receiver, table.time_s) & _is_there(vehicles, peer, table.time_s)
    _count_away(findings, int((usable & ~is_there).sum()), "link rows")
    kept = usable & is_there
    place = np.array([point.position_m for point in session.points] + [(0.0, 0.0, 0.0)], dtype=np.float64)
    as_white = _as_white(table, settings)
    stated = (table.sigma_m**2 + (settings.range_share * table.pseudorange_m) ** 2) * as_white
    variance = stated + np.where(is_peer, settings.extra_range_sigma_m**2, 0.0)
    return _columns(
        table.time_s[kept],
        np.where(is_peer, PEER, POINT)[kept],
        receiver[kept],
        np.where(is_good, table.pseudorange_m, np.nan)[kept],
        variance[kept],
        source=np.where(is_peer, peer, point)[kept],
        slot=table.slot[kept],
        place_m=place[np.where(is_peer, -1, point)[kept]],
        bearing_rad=np.where(has_bearing, bearing, np.nan)[kept],
        bearing_variance_rad2=(bearing_sigma**2 * as_white)[kept],
        is_two_way=table.is_two_way,
        arm_m=0.0 if table.arm_m is None else table.arm_m[kept],
        spread=1.0 / as_white[kept],
    )


def _as_white(table: Ranges, settings: CooperativeSettings) -> FloatArray:
    """Return the factor of the variance of each row.

    It makes repetitions weigh no more than they tell. A share c of the variance decays with the time t: readings every
    dt seconds are worth white ones of the variance times 1 - c + c coth(dt / 2 t) (the spectral density at frequency 0
    of a first-order Gauss-Markov sequence).
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
) -> Events:
    table = session.satellites
    good = np.isfinite(table.pseudorange_m) & np.isfinite(table.time_s) & np.isfinite(table.position_m).all(axis=1)
    good &= (table.sigma_m > 0.0) & (table.pseudorange_m > 0.0)
    receiver = _numbers_of(table.receiver, places)
    known = receiver >= 0
    _count(findings, "satellite_rows", "satellite rows that are not numbers or negative", ~good)
    _count(findings, "unknown_receiver", "satellite rows of a vehicle that is not in the session", ~known)
    is_there = _is_there(vehicles, receiver, table.time_s)
    _count_away(findings, int((good & known & ~is_there).sum()), "satellite rows")
    kept = good & known & is_there
    return _columns(
        table.time_s[kept],
        SATELLITE,
        receiver[kept],
        table.pseudorange_m[kept],
        table.sigma_m[kept] ** 2,
        place_m=table.position_m[kept],
    )


def _height_events(
    session: Session, vehicles: tuple[Vehicle, ...], places: dict[str, int], findings: list[Finding]
) -> Events:
    table = session.heights
    good = np.isfinite(table.height_m) & np.isfinite(table.time_s) & (table.sigma_m > 0.0)
    who = _numbers_of(table.aircraft, places)
    _count(findings, "height_rows", "rows of heights that are not numbers", ~good)
    has_height = np.array([vehicle.height >= 0 for vehicle in vehicles] + [False])
    kept = good & (who >= 0) & has_height[who] & _is_there(vehicles, who, table.time_s)
    return _columns(table.time_s[kept], HEIGHT, who[kept], table.height_m[kept], table.sigma_m[kept] ** 2)
