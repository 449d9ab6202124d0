"""The cooperative filters in plain numpy, as their books write them: an oracle for the compiled loops.

Slow and dense: no core, no skipping of zeros. Vehicles' own motion is the package's; everything else stands here again.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.estimators.cooperative.arrays import HEIGHT, PEER, POINT, SATELLITE
from groundstation.estimators.cooperative.decentralised import WEIGHTS
from groundstation.estimators.cooperative.events import Prepared
from groundstation.estimators.cooperative.joint import KNOWN_WRONG_SIGMAS, LEAP_M, PATIENCE
from groundstation.estimators.cooperative.messages import Broadcast, decode
from groundstation.estimators.cooperative.observation import LIGHT_MPS, NEAREST_M
from groundstation.estimators.cooperative.settings import CooperativeSettings
from groundstation.estimators.cooperative.timeline import timeline
from groundstation.estimators.cooperative.vehicles import Vehicle
from groundstation.tables.session import NO_SLOT

FloatArray = np.ndarray
RANKED = ("ranked", "modified")
Other = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, slots=True)
class Event:
    """One measurement."""

    time_s: float
    kind: int
    receiver: int
    source: int
    value_m: float
    variance_m2: float
    slot: int
    place_m: FloatArray
    bearing_rad: float
    bearing_variance_rad2: float
    is_two_way: bool


class Recorder:
    """States at the times of output, and what was judged."""

    def __init__(self, prepared: Prepared) -> None:
        self.rows: list[list[tuple[float, FloatArray, FloatArray]]] = [[] for _ in prepared.vehicles]
        self.judged: list[tuple[float, float, bool]] = []
        self.radius: list[float] = []

    def keep(self, who: int, time_s: float, x: FloatArray, P: FloatArray) -> None:
        self.rows[who].append((time_s, x.copy(), P.copy()))

    def judge(self, innovation: float, variance: float, passes: bool) -> None:
        self.judged.append((innovation, float(np.sqrt(variance)), passes))


def steps(prepared: Prepared, settings: CooperativeSettings, *, together: bool) -> list[tuple[float, object]]:
    """Outputs (a vehicle) and groups of measurements, in order."""
    items = timeline(prepared, settings, together=together)
    events = [Event(*row) for row in zip(*prepared.events, strict=True)]
    return [
        (at_s, int(who) if who >= 0 else tuple(events[first:last]))
        for at_s, who, first, last in zip(*items, strict=True)
    ]


@dataclass(frozen=True, slots=True)
class Row:
    """One scalar measurement, linearised: innovation = h (receiver) + place (source) + clock (source) + noise.

    Parameters
    ----------
    innovation : float
        Measured minus predicted.
    receiver : ndarray, shape (n,)
        Derivative of the prediction by the receiver's state.
    place : ndarray, shape (3,)
        By the source's position.
    clock : float
        By the source's clock offset.
    variance : float
        Of the sensor alone.
    """

    innovation: float
    receiver: FloatArray
    place: FloatArray
    clock: float
    variance: float

    def by_source(self, vehicle: Vehicle, derivative: FloatArray) -> FloatArray:
        """Derivative by the state of a vehicle that is the source."""
        h = self.place @ derivative
        if vehicle.clock >= 0 and self.clock != 0.0:
            h[vehicle.clock] += self.clock
        return h


def rows_of(
    event: Event,
    vehicle: Vehicle,
    x: FloatArray,
    source_m: FloatArray | None,
    source_clock_m: float,
    about_m: FloatArray | None = None,
) -> list[Row]:
    """Linearise one event about the receiver's state and what is known of the source.

    Parameters
    ----------
    event : Event
    vehicle : Vehicle
        The receiver.
    x : ndarray, shape (n,)
        Its state at the time of the event.
    source_m : ndarray, shape (3,), optional
        Position of a peer; points and satellites carry their own.
    source_clock_m : float
        Clock offset of a peer; 0 else.
    about_m : ndarray, shape (3,), optional
        Line from the source to the receiver about which the range is linearised; None: that of the estimate.

    Returns
    -------
    list of Row
        Range, then bearing, as far as the event has them.
    """
    place, derivative = vehicle.place(x, event.time_s)
    if event.kind == HEIGHT:
        h = np.zeros(vehicle.size)
        h[vehicle.height] = -1.0
        predicted = -float(vehicle.place(np.zeros(vehicle.size), event.time_s)[0][2]) - float(x[vehicle.height])
        return [Row(event.value_m - predicted, h, np.zeros(3), 0.0, event.variance_m2)]
    source = event.place_m if source_m is None else source_m
    assert source is not None
    line = place - source
    distance = float(np.sqrt(line @ line))
    if distance < NEAREST_M:
        return []
    rows = []
    if np.isfinite(event.value_m):
        direction = line / distance
        if about_m is not None:
            distance = float(np.sqrt(about_m @ about_m))
            direction = about_m / distance
            distance += float(direction @ (line - about_m))
        rows.append(_range_row(event, vehicle, x, place, derivative, source, source_clock_m, direction, distance))
    if np.isfinite(event.bearing_rad):
        rows.append(_bearing_row(event, vehicle, x, derivative, -line))
    return rows


def _range_row(
    event: Event,
    vehicle: Vehicle,
    x: FloatArray,
    place: FloatArray,
    derivative: FloatArray,
    source: FloatArray,
    source_clock_m: float,
    direction: FloatArray,
    distance: float,
) -> Row:
    if event.kind == SATELLITE:
        direction, distance = _while_the_earth_turns(place, source, distance)
    predicted = distance
    h = direction @ derivative
    clock, by_clock = vehicle.receiver_clock if event.kind == SATELLITE else vehicle.clock, 0.0
    if clock >= 0 and not event.is_two_way:
        predicted += float(x[clock]) - source_clock_m
        h[clock] += 1.0
        by_clock = 0.0 if event.kind in (POINT, SATELLITE) else -1.0
    if vehicle.bias >= 0 and event.kind != SATELLITE:
        predicted += float(x[vehicle.bias])
        h[vehicle.bias] += 1.0
    return Row(event.value_m - predicted, h, -direction, by_clock, event.variance_m2)


def _while_the_earth_turns(place: FloatArray, source: FloatArray, distance: float) -> tuple[FloatArray, float]:
    """Direction and distance from where a satellite was at emission, in the ECEF axes of the instant of reception."""
    line = place - source
    for _ in range(3):  # each gains six digits
        turn = EARTH_RATE_RADPS * distance / LIGHT_MPS
        cosine, sine = np.cos(turn), np.sin(turn)
        x, y = cosine * source[0] + sine * source[1], cosine * source[1] - sine * source[0]
        line = place - np.array([x, y, source[2]])
        distance = float(np.sqrt(line @ line))
    return line / distance, distance


def _bearing_row(event: Event, vehicle: Vehicle, x: FloatArray, derivative: FloatArray, line: FloatArray) -> Row:
    """Bearing from the nose: direction to the source less heading; line leads from the receiver to the source."""
    north, east = float(line[0]), float(line[1])
    square = north * north + east * east
    by_line = np.array([-east, north, 0.0]) / square
    h = -by_line @ derivative
    h[vehicle.at("heading_rad")] -= 1.0
    innovation = event.bearing_rad - (np.arctan2(east, north) - float(x[vehicle.at("heading_rad")]))
    wrapped = float((innovation + np.pi) % (2.0 * np.pi) - np.pi)
    return Row(wrapped, h, by_line, 0.0, event.bearing_variance_rad2)


def unit_rows(sizes: Sequence[int]) -> list[FloatArray]:
    """Rows of the unit map, a block (m, N) for each vehicle."""
    edges = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    unit = np.eye(int(edges[-1]))
    return [unit[one:two] for one, two in pairwise(edges)]


def spectral_radius(rows: Sequence[FloatArray]) -> float:
    """Largest absolute eigenvalue of the map.

    Examples
    --------
    >>> spectral_radius([np.array([[1.0, 0.5]]), np.array([[0.5, 1.0]])])
    1.5
    """
    return float(np.abs(np.linalg.eigvals(np.concatenate(rows))).max())


def corrected_rows(rows: FloatArray, gain: FloatArray, H: FloatArray, others: Sequence[Other | None]) -> FloatArray:
    """Rows of a vehicle after an update.

    Parameters
    ----------
    rows : ndarray, shape (m, N)
    gain : ndarray, shape (m, r)
    H : ndarray, shape (r, m)
    others : sequence of (ndarray (s,), ndarray (s, N)) or None
        For each measurement the derivative by its source's state and the source's rows; None for exact sources.
    """
    mixed = H @ rows
    for number, other in enumerate(others):
        if other is not None:
            mixed[number] += other[0] @ other[1]
    return np.asarray(rows - gain @ mixed)


class Joint:
    """State x and covariance P of all vehicles and uncertain points."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings) -> None:
        self.prepared, self.about_reckoning = prepared, settings.derivatives == "reckoning"
        starts = [vehicle.start() for vehicle in prepared.vehicles]
        sizes = [len(x) for x, _ in starts]
        edges = np.concatenate([[0], np.cumsum(sizes)])
        self.slices = [slice(int(one), int(two)) for one, two in pairwise(edges)]
        uncertain = [i for i, point in enumerate(prepared.session.points) if point.position_sigma_m > 0.0]
        total = int(edges[-1])
        self.shared = {i: slice(total + 2 * k, total + 2 * k + 2) for k, i in enumerate(uncertain)}
        total += 2 * len(uncertain)
        self.x, self.P = np.zeros(total), np.zeros((total, total))
        for place, (x, P) in zip(self.slices, starts, strict=True):
            self.x[place], self.P[place, place] = x, P
        for i, place in self.shared.items():
            self.P[place, place] = prepared.session.points[i].position_sigma_m ** 2 * np.eye(2)
        self.times = [vehicle.first_s for vehicle in prepared.vehicles]
        self.offsets_m = np.zeros((len(prepared.vehicles), 3))  # dead reckoning less reference place

    def advance(self, who: int, to_s: float) -> None:
        """Move one vehicle's block on."""
        if to_s <= self.times[who] + 1e-12:
            return
        place = self.slices[who]
        x, phi, noise = self.prepared.vehicles[who].step(self.x[place], self.times[who], to_s)
        self.x[place] = x
        whole = np.eye(len(self.x))
        whole[place, place] = phi
        self.P = whole @ self.P @ whole.T
        self.P[place, place] += noise
        self.times[who] = to_s

    def rows(self, event: Event) -> list[tuple[Row, FloatArray]]:
        """Rows of an event at the vehicles' own times, each with its derivative by the whole state."""
        vehicles, found = self.prepared.vehicles, []
        here = self._at(event.receiver, event.time_s)
        source_m, clock_m = None, 0.0
        there: tuple[FloatArray, FloatArray] | None = None
        derivative = np.zeros((3, 0))
        if event.kind == PEER:
            peer = vehicles[event.source]
            there = self._at(event.source, event.time_s)
            source_m, derivative = peer.place(there[0], event.time_s)
            clock_m = float(there[0][peer.clock]) if peer.clock >= 0 else 0.0
        elif event.kind == POINT and event.source in self.shared:
            assert event.place_m is not None
            source_m = event.place_m - self.prepared.points.axes[event.source] @ self.x[self.shared[event.source]]
        about = self._reference_line(event) if self.about_reckoning else None
        for row in rows_of(event, vehicles[event.receiver], here[0], source_m, clock_m, about):
            h = np.zeros(len(self.x))
            h[self.slices[event.receiver]] = row.receiver @ here[1]
            if there is not None:
                h[self.slices[event.source]] = row.by_source(vehicles[event.source], derivative) @ there[1]
            elif event.kind == POINT and event.source in self.shared:
                h[self.shared[event.source]] = -row.place @ self.prepared.points.axes[event.source]
            found.append((row, h))
        return found

    def _reference_line(self, event: Event) -> FloatArray | None:
        """Line between two aircraft about which their range is linearised; its ends move when known to be wrong."""
        vehicles = self.prepared.vehicles
        ends = (event.receiver, event.source)
        if event.kind != PEER or any(vehicles[who].clock < 0 for who in ends):
            return None
        x = [self._at(who, event.time_s)[0] for who in ends]
        (here, by_here), (there, by_there) = (
            vehicles[who].place(state, event.time_s) for who, state in zip(ends, x, strict=True)
        )
        read = [here - by_here @ x[0], there - by_there @ x[1]]
        line = read[0] - self.offsets_m[ends[0]] - read[1] + self.offsets_m[ends[1]]
        away = here - there - line
        across = away - line * float(line @ away) / float(line @ line)
        derivative = np.zeros((3, len(self.x)))
        derivative[:, self.slices[ends[0]]], derivative[:, self.slices[ends[1]]] = by_here, -by_there
        shared = across @ derivative
        if float(across @ across) ** 2 > KNOWN_WRONG_SIGMAS**2 * float(shared @ self.P @ shared):
            self.offsets_m[ends[0]], self.offsets_m[ends[1]] = read[0] - here, read[1] - there
            return np.asarray(here - there)
        return np.asarray(line)

    def _at(self, who: int, at_s: float) -> tuple[FloatArray, FloatArray]:
        """State of a vehicle at a time not later than its own, and its derivative by the state it has."""
        x = self.x[self.slices[who]]
        if abs(at_s - self.times[who]) < 1e-12:
            return x, np.eye(len(x))
        moved, phi, _ = self.prepared.vehicles[who].step(x, self.times[who], at_s)
        return moved, phi

    def update_together(self, H: FloatArray, innovation: FloatArray, variance: FloatArray) -> None:
        """Several measurements in one step."""
        shared = self.P @ H.T
        S = H @ shared + np.diag(variance)
        gain = np.linalg.solve(S, shared.T).T
        self.x += gain @ innovation
        self.P -= gain @ shared.T
        self.P = 0.5 * (self.P + self.P.T)


def plain_centralised(prepared: Prepared, settings: CooperativeSettings) -> Recorder:
    """All measurements of a group at once; a second row of a single one about the estimate that the first left."""
    joint, recorder, together = Joint(prepared, settings), Recorder(prepared), settings.update == "simultaneous"
    rejected = [0] * len(prepared.vehicles)
    for at_s, what in steps(prepared, settings, together=together):
        if isinstance(what, int):
            joint.advance(what, at_s)
            place = joint.slices[what]
            recorder.keep(what, at_s, joint.x[place], joint.P[place, place])
            continue
        assert isinstance(what, tuple)
        for event in what:
            for who in (event.receiver, event.source) if event.kind == PEER else (event.receiver,):
                joint.advance(who, at_s)
        if together:
            kept = [
                pair
                for event in what
                for pair in joint.rows(event)
                if passes(joint, event, *pair, settings, recorder, rejected)
            ]
            if kept:
                joint.update_together(
                    np.array([h for _, h in kept]),
                    np.array([row.innovation for row, _ in kept]),
                    np.array([row.variance for row, _ in kept]),
                )
            continue
        for number in range(len(joint.rows(what[0]))):
            row, h = joint.rows(what[0])[number]
            if not passes(joint, what[0], row, h, settings, recorder, rejected):
                break
            joint.update_together(h[None], np.array([row.innovation]), np.array([row.variance]))
    return recorder


def passes(
    joint: Joint,
    event: Event,
    row: Row,
    h: FloatArray,
    settings: CooperativeSettings,
    recorder: Recorder,
    rejected: list[int],
) -> bool:
    total = float(h @ joint.P @ h) + row.variance
    is_inside = settings.gate_sigma <= 0.0 or row.innovation**2 <= settings.gate_sigma**2 * total
    recorder.judge(row.innovation, total, is_inside)
    for who in (event.receiver, event.source) if event.kind == PEER else (event.receiver,):
        rejected[who] = 0 if is_inside else rejected[who] + 1
        vehicle = joint.prepared.vehicles[who]
        if rejected[who] >= PATIENCE and vehicle.clock >= 0 and event.kind != HEIGHT:
            rejected[who] = 0
            for clock in {vehicle.clock, vehicle.receiver_clock}:
                at = joint.slices[who].start + clock
                joint.P[at, at] += LEAP_M**2
    return is_inside


@dataclass(frozen=True, slots=True)
class Own:
    """One vehicle's filter: state, covariance, independent part (split), covariance with the points, error map rows."""

    time_s: float
    x: FloatArray
    P: FloatArray
    independent: FloatArray
    shared: FloatArray
    map_rows: FloatArray


@dataclass(frozen=True, slots=True)
class Heard:
    """A broadcast and, for the error map alone, the derivative and rows of its sender."""

    message: Broadcast
    derivative: FloatArray
    map_rows: FloatArray


@dataclass(frozen=True, slots=True)
class Used:
    """One row ready for an update: derivative by the state now, by the shared errors, and what its source brings."""

    event: Event
    row: Row
    h: FloatArray
    by_shared: FloatArray
    heard: Heard | None


class Decentralised:
    """All vehicles of a session under one of the algorithms."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> None:
        self._prepared, self._settings, self._algorithm = prepared, settings, algorithm
        points = prepared.session.points
        self._uncertain = [i for i, point in enumerate(points) if point.position_sigma_m > 0.0]
        sigmas = [points[i].position_sigma_m for i in self._uncertain for _ in range(2)]
        self._Pc = np.diag(np.square(sigmas)) if sigmas else np.zeros((0, 0))
        self._inverse_Pc = np.diag(1.0 / np.square(sigmas)) if sigmas else np.zeros((0, 0))
        self.recorder = Recorder(prepared)
        self._unit_map = unit_rows([vehicle.size for vehicle in prepared.vehicles])
        self._window_end_s = float("-inf")
        self._own: list[Own] = []
        for rows, vehicle in zip(self._unit_map, prepared.vehicles, strict=True):
            x, P = vehicle.start()
            self._own.append(Own(vehicle.first_s, x, P, P.copy(), np.zeros((vehicle.size, len(sigmas))), rows))
        self._history: deque[tuple[int, list[Own]]] = deque(maxlen=settings.latency_slots + 1)
        self._heard: dict[tuple[int, int], Heard] = {}
        self._rejected = [0] * len(prepared.vehicles)

    def run(self) -> Recorder:
        """Work through the session."""
        together = self._settings.update == "simultaneous" or self._algorithm == "modified"
        for at_s, what in steps(self._prepared, self._settings, together=together):
            if at_s >= self._window_end_s:
                self._begin_window(at_s)
            if isinstance(what, int):
                self._own[what] = self._moved(what, self._own[what], at_s)
                self.recorder.keep(what, at_s, self._own[what].x, self._own[what].P)
            else:
                self._use(what, at_s)
        return self.recorder

    def _begin_window(self, at_s: float) -> None:
        """Judge the error map and begin it anew; errors of messages under way count as those of their senders now."""
        if np.isfinite(self._window_end_s):
            self.recorder.radius.append(spectral_radius([own.map_rows for own in self._own]))
        self._window_end_s = at_s + self._settings.map_window_s
        self._own = [replace(own, map_rows=rows) for own, rows in zip(self._own, self._unit_map, strict=True)]
        self._history.clear()
        self._heard.clear()

    def _moved(self, who: int, own: Own, to_s: float) -> Own:
        """A vehicle's filter at another time."""
        if abs(to_s - own.time_s) < 1e-12:
            return own
        x, phi, noise = self._prepared.vehicles[who].step(own.x, own.time_s, to_s)
        if to_s < own.time_s:
            noise = np.zeros_like(noise)
        return Own(
            to_s,
            x,
            phi @ own.P @ phi.T + noise,
            phi @ own.independent @ phi.T + noise,
            phi @ own.shared,
            phi @ own.map_rows,
        )

    def _use(self, events: tuple[Event, ...], at_s: float) -> None:
        """One measurement, or all of a frame, receiver by receiver."""
        heard = [self._listen(event) if event.kind == PEER else None for event in events]
        for who in dict.fromkeys(event.receiver for event in events):
            mine = [(event, h) for event, h in zip(events, heard, strict=True) if event.receiver == who]
            mine = [(event, h) for event, h in mine if self._is_used(event, h)]
            if not mine:
                continue
            self._own[who] = self._moved(who, self._own[who], at_s)
            rows = [used for event, h in mine for used in self._rows(who, event, h)]
            rows = [used for used in rows if self._passes(who, used)]
            if rows and self._algorithm == "split_intersection":
                about = self._own[who].x
                for used in rows:
                    self._own[who] = self._split_update(self._own[who], used, about)
            elif rows:
                self._own[who] = self._update(self._own[who], rows)

    def _is_used(self, event: Event, heard: Heard | None) -> bool:
        if event.kind != PEER:
            return True
        if self._algorithm in RANKED and self._prepared.ranks[event.source] >= self._prepared.ranks[event.receiver]:
            return False
        return heard is not None

    def _listen(self, event: Event) -> Heard | None:
        """What the source of a range told in its slot: its knowledge of some slots ago, at the time of transmission."""
        key = (event.source, event.slot)
        if event.slot != NO_SLOT and key in self._heard:
            return self._heard[key]
        own = self._own[event.source]
        if event.slot != NO_SLOT:
            if not self._history or self._history[-1][0] != event.slot:
                self._history.append((event.slot, list(self._own)))
                self._heard.clear()
            own = self._history[0][1][event.source]
        own = self._moved(event.source, own, event.time_s)
        vehicle = self._prepared.vehicles[event.source]
        place, derivative = vehicle.place(own.x, event.time_s)
        clock = np.zeros(vehicle.size)
        if vehicle.clock >= 0:
            clock[vehicle.clock] = 1.0
        told = np.concatenate([derivative, clock[None]])
        algorithm = self._algorithm
        message = Broadcast(
            event.source,
            self._prepared.ranks[event.source],
            max(event.slot, 0),
            place,
            float(clock @ own.x),
            None if algorithm == "neighbour_exact" else told @ own.P @ told.T,
            told @ own.shared if algorithm == "modified" else None,
        )
        sent = message.encode()
        mine = self._own[event.source]
        self._own[event.source] = replace(mine, independent=np.zeros_like(mine.independent))  # all may be known now
        heard = Heard(decode(sent, algorithm), told, own.map_rows)
        if event.slot != NO_SLOT:
            self._heard[key] = heard
        return heard

    def _rows(self, who: int, event: Event, heard: Heard | None) -> list[Used]:
        """Linearised measurements of an event, referred to the receiver's state now."""
        own, vehicle = self._own[who], self._prepared.vehicles[who]
        x, back = own.x, np.eye(vehicle.size)
        if abs(event.time_s - own.time_s) > 1e-12:
            x, back, _ = vehicle.step(own.x, own.time_s, event.time_s)
        source_m = None if heard is None else heard.message.place_m
        clock_m = 0.0 if heard is None else heard.message.clock_m
        found = []
        for row in rows_of(event, vehicle, x, source_m, clock_m):
            by_shared = np.zeros(len(self._Pc))
            if event.kind == POINT and event.source in self._uncertain:
                at = 2 * self._uncertain.index(event.source)
                by_shared[at : at + 2] = -row.place @ self._prepared.points.axes[event.source]
            found.append(Used(event, row, row.receiver @ back, by_shared, heard))
        return found

    def _noise(self, used: Used) -> tuple[float, float]:
        """Variance that is the measurement's own, and that its source brings with it."""
        brought = 0.0
        if used.heard is not None and used.heard.message.covariance is not None:
            told = np.append(used.row.place, used.row.clock)
            brought = float(told @ used.heard.message.covariance @ told)
        elif self._algorithm != "neighbour_exact":
            brought = float(used.by_shared @ self._Pc @ used.by_shared)
        return used.row.variance, max(brought, 0.0)

    def _passes(self, who: int, used: Used) -> bool:
        """Whether the innovation is inside the gate; counts, and opens the clock after many rejections."""
        own, vehicle = self._own[who], self._prepared.vehicles[who]
        total = float(used.h @ own.P @ used.h) + sum(self._noise(used))
        passes = self._settings.gate_sigma <= 0.0 or used.row.innovation**2 <= self._settings.gate_sigma**2 * total
        self.recorder.judge(used.row.innovation, total, passes)
        self._rejected[who] = 0 if passes else self._rejected[who] + 1
        if self._rejected[who] >= PATIENCE and vehicle.clock >= 0 and used.event.kind != HEIGHT:
            self._rejected[who] = 0
            P = own.P.copy()
            for clock in {vehicle.clock, vehicle.receiver_clock}:
                P[clock, clock] += LEAP_M**2
            self._own[who] = replace(own, P=P)
        return passes

    def _update(self, own: Own, rows: list[Used]) -> Own:
        """Kalman update with the noise of the algorithm; shared errors are considered, not estimated."""
        H = np.array([used.h for used in rows])
        Hc = np.array([used.by_shared for used in rows])
        R = np.diag([sum(self._noise(used)) for used in rows])
        shared, told = own.shared, np.zeros_like(Hc)
        if self._algorithm == "modified":
            for number, used in enumerate(rows):
                if used.heard is not None and used.heard.message.shared is not None:
                    told[number] = np.append(used.row.place, used.row.clock) @ used.heard.message.shared
            R = R + self._through_what_they_share(rows, told)
        cross = shared @ Hc.T if self._algorithm == "modified" else np.zeros((len(own.x), len(rows)))
        S = H @ own.P @ H.T + H @ cross + cross.T @ H.T + R
        gain = np.linalg.solve(S, (own.P @ H.T + cross).T).T
        x = own.x + gain @ np.array([used.row.innovation for used in rows])
        P = own.P - gain @ S @ gain.T
        if self._algorithm == "modified":
            shared = shared - gain @ (H @ shared + Hc @ self._Pc + told)
        return Own(own.time_s, x, 0.5 * (P + P.T), own.independent, shared, self._mixed(own, gain, H, rows))

    def _through_what_they_share(self, rows: list[Used], told: FloatArray) -> FloatArray:
        """Covariance of the noise of different neighbours (and points) through the uncertain ground points."""
        through = told + np.array([used.by_shared for used in rows]) @ self._Pc
        between = through @ self._inverse_Pc @ through.T if len(self._Pc) else np.zeros((len(rows), len(rows)))
        sources = [(used.event.kind, used.event.source) for used in rows]
        for i, one in enumerate(sources):
            for j, two in enumerate(sources):
                if one == two and i != j and one[0] == PEER:  # two rows of one neighbour share all its error
                    a, b = (np.append(rows[k].row.place, rows[k].row.clock) for k in (i, j))
                    nearer = i if sum(self._noise(rows[i])) <= sum(self._noise(rows[j])) else j
                    heard = rows[nearer].heard
                    if heard is not None and heard.message.covariance is not None:
                        between[i, j] = float(a @ heard.message.covariance @ b)
        np.fill_diagonal(between, 0.0)
        return between

    def _split_update(self, own: Own, used: Used, about: FloatArray) -> Own:
        """Split covariance intersection with one scalar measurement; the weight that leaves the least position error.

        ``about`` is the state that the measurement was linearised about.
        """
        independent_noise, dependent_noise = self._noise(used)
        h, dependent = used.h, own.P - own.independent
        weight = 1.0
        if dependent_noise > 0.0:
            weight = self._best_weight(h, dependent, own.independent, dependent_noise, independent_noise)
        if weight == 0.0:
            return own  # every weight leaves a larger position error than none
        P1 = dependent / weight + own.independent
        noise = independent_noise + (dependent_noise / (1.0 - weight) if dependent_noise > 0.0 else 0.0)
        S = float(h @ P1 @ h) + noise
        gain = P1 @ h / S
        P = P1 - np.outer(gain, gain) * S
        kept = np.eye(len(own.x)) - np.outer(gain, h)
        independent = kept @ own.independent @ kept.T + np.outer(gain, gain) * independent_noise
        innovation = used.row.innovation - float(h @ (own.x - about))
        rows = self._mixed(own, gain[:, None], h[None], [used])
        return Own(own.time_s, own.x + gain * innovation, P, independent, own.shared, rows)

    @staticmethod
    def _best_weight(
        h: FloatArray, dependent: FloatArray, independent: FloatArray, dependent_noise: float, independent_noise: float
    ) -> float:
        by_dependent, by_independent = dependent @ h, independent @ h
        horizontal = by_dependent[:2, None] / WEIGHTS + by_independent[:2, None]
        S = (h @ by_dependent) / WEIGHTS + h @ by_independent + dependent_noise / (1.0 - WEIGHTS) + independent_noise
        trace = (dependent[0, 0] + dependent[1, 1]) / WEIGHTS + independent[0, 0] + independent[1, 1]
        left = trace - (horizontal**2).sum(axis=0) / S
        best = int(np.argmin(left))
        now = dependent[0, 0] + dependent[1, 1] + independent[0, 0] + independent[1, 1]
        return float(WEIGHTS[best]) if left[best] < now else 0.0

    @staticmethod
    def _mixed(own: Own, gain: FloatArray, H: FloatArray, rows: list[Used]) -> FloatArray:
        """Rows of the error map after an update."""
        others: list[Other | None] = []
        for used in rows:
            if used.heard is None:
                others.append(None)
            else:
                told = np.append(used.row.place, used.row.clock) @ used.heard.derivative
                others.append((told, used.heard.map_rows))
        return corrected_rows(own.map_rows, gain, H, others)


class _Member:
    """One vehicle: its time, state, covariance, factors towards the others, and rows of the error map."""

    def __init__(self, time_s: float, x: FloatArray, P: FloatArray, map_rows: FloatArray) -> None:
        self.time_s, self.x, self.P, self.map_rows = time_s, x, P, map_rows
        self.factors: dict[int, FloatArray] = {}


class Pairwise:
    """All vehicles of a session; sequential by its nature."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings) -> None:
        self._prepared, self._settings = prepared, settings
        self.recorder = Recorder(prepared)
        self._unit_map = unit_rows([vehicle.size for vehicle in prepared.vehicles])
        self._window_end_s = float("-inf")
        self._members = [
            _Member(vehicle.first_s, *vehicle.start(), rows)
            for vehicle, rows in zip(prepared.vehicles, self._unit_map, strict=True)
        ]
        self._rejected = [0] * len(prepared.vehicles)

    def run(self) -> Recorder:
        """Work through the session."""
        for at_s, what in steps(self._prepared, self._settings, together=False):
            if at_s >= self._window_end_s:
                self._begin_window(at_s)
            if isinstance(what, int):
                self._advance(what, at_s)
                self.recorder.keep(what, at_s, self._members[what].x, self._members[what].P)
            else:
                self._use(what[0])
        return self.recorder

    def _begin_window(self, at_s: float) -> None:
        if np.isfinite(self._window_end_s):
            self.recorder.radius.append(spectral_radius([one.map_rows for one in self._members]))
        self._window_end_s = at_s + self._settings.map_window_s
        for one, rows in zip(self._members, self._unit_map, strict=True):
            one.map_rows = rows

    def _advance(self, who: int, to_s: float) -> None:
        one = self._members[who]
        if to_s <= one.time_s + 1e-12:
            return
        one.x, phi, noise = self._prepared.vehicles[who].step(one.x, one.time_s, to_s)
        one.P = phi @ one.P @ phi.T + noise
        one.factors = {other: phi @ factor for other, factor in one.factors.items()}
        one.map_rows, one.time_s = phi @ one.map_rows, to_s

    def _use(self, event: Event) -> None:
        self._advance(event.receiver, event.time_s)
        if event.kind == PEER:
            self._advance(event.source, event.time_s)
        rows = self._rows(event)
        for number in range(len(rows)):
            if number:
                rows = self._rows(event)  # about the estimate that the row before left
            if not (self._relative if event.kind == PEER else self._private)(event, rows[number]):
                break

    def _rows(self, event: Event) -> list[Row]:
        one = self._members[event.receiver]
        source_m, clock_m = None, 0.0
        if event.kind == PEER:
            vehicle, other = self._prepared.vehicles[event.source], self._members[event.source]
            source_m, _ = vehicle.place(other.x, event.time_s)
            clock_m = float(other.x[vehicle.clock]) if vehicle.clock >= 0 else 0.0
        return rows_of(event, self._prepared.vehicles[event.receiver], one.x, source_m, clock_m)

    def _passes(self, event: Event, row: Row, total: float) -> bool:
        passes = self._settings.gate_sigma <= 0.0 or row.innovation**2 <= self._settings.gate_sigma**2 * total
        self.recorder.judge(row.innovation, total, passes)
        for who in (event.receiver, event.source) if event.kind == PEER else (event.receiver,):
            vehicle = self._prepared.vehicles[who]
            self._rejected[who] = 0 if passes else self._rejected[who] + 1
            if self._rejected[who] >= PATIENCE and vehicle.clock >= 0:
                self._rejected[who] = 0
                for clock in {vehicle.clock, vehicle.receiver_clock}:
                    self._members[who].P[clock, clock] += LEAP_M**2
        return passes

    def _private(self, event: Event, row: Row) -> bool:
        """A range to a point or satellite: nobody is told."""
        one, variance = self._members[event.receiver], row.variance
        if event.kind == POINT:
            sigma = self._prepared.session.points[event.source].position_sigma_m
            variance += sigma**2 * float(np.sum((row.place @ self._prepared.points.axes[event.source]) ** 2))
        shared = one.P @ row.receiver
        total = float(row.receiver @ shared) + variance
        if not self._passes(event, row, total):
            return False
        gain = shared / total
        kept = np.eye(len(one.x)) - np.outer(gain, row.receiver)
        one.x = one.x + gain * row.innovation
        one.P = one.P - np.outer(shared, gain)
        one.factors = {other: kept @ factor for other, factor in one.factors.items()}
        one.map_rows = kept @ one.map_rows
        return True

    def _relative(self, event: Event, row: Row) -> bool:
        """A range between two: both are updated as one filter."""
        i, j = event.receiver, event.source
        one, other = self._members[i], self._members[j]
        vehicle = self._prepared.vehicles[j]
        _, derivative = vehicle.place(other.x, event.time_s)
        n = len(one.x)
        h = np.concatenate([row.receiver, row.by_source(vehicle, derivative)])
        cross = one.factors[j] @ other.factors[i].T if j in one.factors else np.zeros((n, len(other.x)))
        P = np.block([[one.P, cross], [cross.T, other.P]])
        shared = P @ h
        total = float(h @ shared) + row.variance
        if total <= 0.0 or not self._passes(event, row, total):
            return False
        gain = shared / total
        after = P - np.outer(shared, gain)
        for who, before, place in ((one, one.P, slice(0, n)), (other, other.P, slice(n, None))):
            scale = _over(after[place, place], before)
            who.factors = {
                third: factor if third in (i, j) else scale @ factor for third, factor in who.factors.items()
            }
        mixed = h[:n] @ one.map_rows + h[n:] @ other.map_rows
        one.x, other.x = one.x + gain[:n] * row.innovation, other.x + gain[n:] * row.innovation
        one.P, other.P = after[:n, :n].copy(), after[n:, n:].copy()
        one.factors[j], other.factors[i] = after[:n, n:].copy(), np.eye(len(other.x))
        one.map_rows = one.map_rows - np.outer(gain[:n], mixed)
        other.map_rows = other.map_rows - np.outer(gain[n:], mixed)
        return True


def _over(after: FloatArray, before: FloatArray) -> FloatArray:
    """after @ inverse(before), scaled by the sigmas: states differ by eight powers of ten."""
    sigma = np.sqrt(np.diag(before))
    normal = before / np.outer(sigma, sigma)
    return np.asarray(np.linalg.solve(normal, (after / sigma).T).T / sigma)


def plain(prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> Recorder:
    """Run an algorithm in its plain form."""
    if algorithm == "centralised":
        return plain_centralised(prepared, settings)
    return (
        Pairwise(prepared, settings).run()
        if algorithm == "pairwise"
        else Decentralised(prepared, settings, algorithm).run()
    )
