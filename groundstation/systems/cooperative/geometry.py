"""Geometry of ranging, and the information bound.

Dilution of precision, determinant, smallest eigenvalue, Gram determinant. H holds one row for each source that a
vehicle hears in a frame: the horizontal direction from the source to it (two columns), and 1 for its clock where ranges
are one-way. Sources count as exact.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapters 4.3 and 5.2 (det(H'H), Gram);
Misra and Enge, Global Positioning System, 2nd ed. 2006, section 6.1 (dilution); Tichavsky, Muravchik and Nehorai,
Posterior Cramer-Rao bounds for discrete-time nonlinear filtering, 1998 (for a Gaussian model that is linear along the
true tracks the bound is the covariance of the Kalman filter linearised there).
"""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.events import prepare
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER, SATELLITE, Events
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun, VehicleTrack
from groundstation.systems.cooperative.vehicles import Vehicle
from groundstation.tables.session import DeadReckoning, Session

GRAM_S = 60.0
SINGULAR = 1e-12


@dataclass(frozen=True)
class Geometry:
    """Geometry of one vehicle, one row for each frame in which it hears anything.

    Parameters
    ----------
    name : str
    time_s, sources : ndarrays, shape (n,)
    hdop, gdop : ndarrays, shape (n,)
        Horizontal part, and with the clock; NaN where H is short of rank.
    determinant, eigenvalue : ndarrays, shape (n,)
        Of H'H, horizontal columns.
    gram_determinant : ndarray, shape (n,)
        Determinant of the mean of H'H over the last ``GRAM_S`` seconds.
    """

    name: str
    time_s: FloatArray
    sources: FloatArray
    hdop: FloatArray
    gdop: FloatArray
    determinant: FloatArray
    eigenvalue: FloatArray
    gram_determinant: FloatArray

    def __post_init__(self) -> None:
        for name in ("time_s", "sources", "hdop", "gdop", "determinant", "eigenvalue", "gram_determinant"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def dilution(H: FloatArray, has_clock: bool) -> tuple[float, float]:
    """HDOP and GDOP of horizontal directions (n, 2), NaN without a solution.

    Examples
    --------
    >>> hdop, gdop = dilution(np.array([[1.0, 0.0], [0.0, 1.0]]), has_clock=False)
    >>> round(hdop, 6), round(gdop, 6)
    (1.414214, 1.414214)
    """
    full = np.column_stack([H, np.ones(len(H))]) if has_clock else H
    information = full.T @ full
    if len(full) < full.shape[1] or np.linalg.det(information) < SINGULAR:
        return float("nan"), float("nan")
    variance = np.diag(np.linalg.inv(information))
    return float(np.sqrt(variance[:2].sum())), float(np.sqrt(variance.sum()))


def geometry_of(session: Session, settings: CooperativeSettings, run: AlgorithmRun) -> tuple[Geometry, ...]:
    """Geometry of every vehicle with time, seen from the positions of a run.

    The frame in which the session ends is left out: it holds but a part of what is heard in one.
    """
    prepared = prepare(session, settings)
    events = prepared.events
    frames: list[dict[int, dict[tuple[int, int, bytes], int]]] = [{} for _ in prepared.vehicles]
    number = np.floor((events.time_s + 1e-9) / settings.frame_s).astype(np.int64)
    for event in np.flatnonzero((events.kind != HEIGHT) & np.isfinite(events.value_m)).tolist():
        kind, source = int(events.kind[event]), int(events.source[event])
        place = events.place_m[event].tobytes() if kind == SATELLITE else b""
        frames[events.receiver[event]].setdefault(int(number[event]), {})[(kind, source, place)] = event
    last = max((number for heard in frames for number in heard), default=0)
    if last:
        frames = [{number: heard[number] for number in heard if number != last} for heard in frames]
    return tuple(
        _one(vehicle, heard, events, run.tracks, index, settings, prepared.session)
        for index, (vehicle, heard) in enumerate(zip(prepared.vehicles, frames, strict=True))
    )


def _one(
    vehicle: Vehicle,
    heard: dict[int, dict[tuple[int, int, bytes], int]],
    events: Events,
    tracks: tuple[VehicleTrack, ...],
    index: int,
    settings: CooperativeSettings,
    session: Session,
) -> Geometry:
    track = session.vehicles[index]
    has_clock = vehicle.clock >= 0 and not session.ranges.is_two_way
    rows: list[tuple[float, ...]] = []
    history: list[tuple[float, FloatArray]] = []
    for number in sorted(heard):
        time_s = number * settings.frame_s
        here = _position_at(tracks[index], time_s)
        axes = np.eye(3)
        if isinstance(track, DeadReckoning):
            axes = track.axes[min(int(np.searchsorted(track.time_s, time_s)), len(track) - 1)]
        lines = []
        for event in heard[number].values():
            is_peer = events.kind[event] == PEER
            there = _position_at(tracks[events.source[event]], time_s) if is_peer else events.place_m[event]
            line = here - there
            lines.append((line / np.linalg.norm(line)) @ axes[:, :2])
        H = np.array(lines)
        information = H.T @ H
        history = [(at, past) for at, past in history if at > time_s - GRAM_S] + [(time_s, information)]
        gram = np.mean([past for _, past in history], axis=0)
        eigenvalue = float(np.linalg.eigvalsh(information)[0])
        rows.append((time_s, len(H), *dilution(H, has_clock), _det(information), max(eigenvalue, 0.0), _det(gram)))
    columns = np.array(rows, dtype=np.float64).reshape(len(rows), 7).T
    return Geometry(vehicle.name, *columns)


def _det(matrix: FloatArray) -> float:
    return max(float(np.linalg.det(matrix)), 0.0)


def _position_at(track: VehicleTrack, time_s: float) -> FloatArray:
    """The position of the output nearest to a time."""
    return track.position_m[int(np.argmin(np.abs(track.time_s - time_s)))] if len(track.time_s) else np.full(3, np.nan)


Truth = dict[str, tuple[FloatArray, FloatArray]]


def bound_of(
    session: Session, settings: CooperativeSettings, truth: Truth, algorithm: str = "centralised"
) -> AlgorithmRun:
    """Run the centralised filter along the true tracks; its covariance is the bound.

    That of an answer from the whole session is the smoother's.

    No reading has an error. Vehicles without truth keep their own dead reckoning; then the bound is one along the
    tracks as they were read. Measured values have no say in it: innovations far from zero only move the point of
    linearisation, so the gate is off and every measurement is replaced by what is predicted.
    """
    vehicles = []
    for vehicle in session.vehicles:
        if isinstance(vehicle, DeadReckoning) and vehicle.name in truth:
            time_s, position = truth[vehicle.name]
            true = np.column_stack([np.interp(vehicle.time_s, time_s, position[:, axis]) for axis in range(3)])
            vehicle = replace(vehicle, position_m=true)
        vehicles.append(vehicle)
    along = replace(session, vehicles=tuple(vehicles))
    prepared = prepare(along, settings)
    smoother = replace(settings.smoother, robust_sigmas=0.0)
    exact = replace(settings, gate_sigma=0.0, smoother=smoother)
    return run_algorithm(prepared, exact, algorithm, innovates=False)
