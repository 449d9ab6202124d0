"""Filters of vehicles that estimate alone, in plain numpy.

The method stands in cooperative/decentralised.py. Beyond the compiled form, who measures range and bearing of another
tells it where it stands (sighting.py): each of the two learns from what one of them measured, under the same rule. Both
then share the noise of the sensor: nothing of theirs is independent.
"""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.error_map import spectral_radius
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER, POINT
from groundstation.systems.cooperative.messages import Broadcast, decode
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun
from groundstation.systems.cooperative.vehicles import PATIENCE
from groundstation.tables.session import NO_SLOT
from tests.systems.cooperative.plain.error_map import Other, corrected_rows, unit_rows
from tests.systems.cooperative.plain.observation import LinearisedMeasurement, rows_of
from tests.systems.cooperative.plain.sighting import Sighting, sighting_of
from tests.systems.cooperative.plain.split_covariance import fuse
from tests.systems.cooperative.plain.steps import MeasurementEvent, RunRecorder, steps

RANKED = ("ranked", "modified")


@dataclass(frozen=True, slots=True)
class OwnFilter:
    """One vehicle's filter: state, covariance, independent part (split), error map rows.

    Also the covariance with the points.
    """

    time_s: float
    x: FloatArray
    P: FloatArray
    independent: FloatArray
    shared: FloatArray
    map_rows: FloatArray


@dataclass(frozen=True, slots=True)
class HeardBroadcast:
    """A broadcast and a square root of its covariance.

    For the error map alone: derivative and rows of its sender.
    """

    message: Broadcast
    root: FloatArray
    derivative: FloatArray
    map_rows: FloatArray


@dataclass(frozen=True, slots=True)
class OfferedMeasurement:
    """A measurement for one vehicle.

    It is its own with what the source broadcast, or where another has seen it.
    """

    who: int
    event: MeasurementEvent
    heard: HeardBroadcast | None
    sighting: Sighting | None = None


@dataclass(frozen=True, slots=True)
class Used:
    """One row ready for an update: its derivatives and what its source brings.

    The derivatives are by the state now and by the shared errors.
    """

    offer: OfferedMeasurement
    row: LinearisedMeasurement
    h: FloatArray
    by_shared: FloatArray

    @property
    def told(self) -> FloatArray:
        """Derivative by the place and clock that its source told."""
        return np.append(self.row.place, self.row.clock)

    @property
    def source(self) -> tuple[int, int]:
        """Vehicle or point whose error the row brings."""
        event = self.offer.event
        return event.kind, event.receiver if self.offer.sighting is not None else event.source


class Decentralised:
    """All vehicles of a session under one of the algorithms."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> None:
        self._prepared, self._settings, self._algorithm = prepared, settings, algorithm
        points = prepared.session.points
        self._uncertain = [i for i, point in enumerate(points) if point.position_sigma_m > 0.0]
        sigmas = [points[i].position_sigma_m for i in self._uncertain for _ in range(2)]
        self._Pc = np.diag(np.square(sigmas)) if sigmas else np.zeros((0, 0))
        self._inverse_Pc = np.diag(1.0 / np.square(sigmas)) if sigmas else np.zeros((0, 0))
        self.recorder = RunRecorder(prepared.vehicles)
        self._unit_map = unit_rows([vehicle.size for vehicle in prepared.vehicles], settings.map_window_s)
        self._window_end_s = float("-inf")
        self._own: list[OwnFilter] = []
        for rows, vehicle in zip(self._unit_map, prepared.vehicles, strict=True):
            x, P = vehicle.start()
            self._own.append(OwnFilter(vehicle.first_s, x, P, P.copy(), np.zeros((vehicle.size, len(sigmas))), rows))
        self._history: deque[tuple[int, list[OwnFilter]]] = deque(maxlen=settings.latency_slots + 1)
        self._heard: dict[tuple[int, int], HeardBroadcast] = {}
        self._rejected = [0] * len(prepared.vehicles)

    def run(self) -> AlgorithmRun:
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
        return self.recorder.finish(self._algorithm, "simultaneous" if together else "sequential")

    def _begin_window(self, at_s: float) -> None:
        """Judge the error map and begin it anew.

        Errors of messages under way count as those of their senders now.
        """
        if np.isfinite(self._window_end_s):
            self.recorder.map_time_s.append(at_s)
            self.recorder.map_radius.append(spectral_radius([own.map_rows for own in self._own]))
        self._window_end_s = at_s + (self._settings.map_window_s or np.inf)
        self._own = [replace(own, map_rows=rows) for own, rows in zip(self._own, self._unit_map, strict=True)]
        self._history.clear()
        self._heard.clear()

    def _moved(self, who: int, own: OwnFilter, to_s: float) -> OwnFilter:
        """Return a vehicle's filter at another time."""
        if abs(to_s - own.time_s) < 1e-12:
            return own
        x, phi, noise = self._prepared.vehicles[who].step(own.x, own.time_s, to_s)
        if to_s < own.time_s:
            noise = np.zeros_like(noise)
        return OwnFilter(
            to_s,
            x,
            phi @ own.P @ phi.T + noise,
            phi @ own.independent @ phi.T + noise,
            phi @ own.shared,
            phi @ own.map_rows,
        )

    def _use(self, events: tuple[MeasurementEvent, ...], at_s: float) -> None:
        """Use one measurement, or all of a frame, vehicle by vehicle.

        What is told is what was known before.
        """
        offers = [
            OfferedMeasurement(event.receiver, event, self._listen(event) if event.kind == PEER else None)
            for event in events
        ]
        offers = [offer for offer in offers if self._is_used(offer)]
        offers += [told for event in events if event.kind == PEER and (told := self._tell(event)) is not None]
        for who in dict.fromkeys(offer.who for offer in offers):
            self._own[who] = self._moved(who, self._own[who], at_s)
            pieces = [self._rows(offer) for offer in offers if offer.who == who]
            pieces = [rows for rows in pieces if rows and self._passes(who, rows)]
            if self._algorithm == "split_intersection":
                about = self._own[who].x
                for rows in pieces:
                    self._own[who] = self._split_update(self._own[who], rows, about)
            elif pieces:
                self._own[who] = self._update(self._own[who], [used for rows in pieces for used in rows])

    def _may_use(self, who: int, source: int) -> bool:
        """Tell whether the algorithm lets a vehicle use what another tells."""
        return self._algorithm not in RANKED or self._prepared.ranks[source] < self._prepared.ranks[who]

    def _is_used(self, offer: OfferedMeasurement) -> bool:
        event = offer.event
        if event.kind != PEER:
            return True
        if not self._may_use(event.receiver, event.source):
            self.recorder.counts["unused"] += 1
            return False
        if offer.heard is None:
            self.recorder.counts["lost"] += 1
        return offer.heard is not None

    def _tell(self, event: MeasurementEvent) -> OfferedMeasurement | None:
        """Return the place where the receiver of a range with bearing saw its source.

        It is a message to the source.
        """
        observer = event.receiver
        if not np.isfinite(event.bearing_rad) or not self._may_use(event.source, observer):
            return None
        own = self._moved(observer, self._own[observer], event.time_s)
        sighting = sighting_of(event, self._prepared.vehicles[observer], own.x)
        if sighting is None:
            return None
        told = np.concatenate([sighting.derivative, np.zeros((1, len(own.x)))])
        heard = self._send(observer, event.slot, sighting.place_m, 0.0, own, told)
        return OfferedMeasurement(event.source, event, heard, sighting)

    def _listen(self, event: MeasurementEvent) -> HeardBroadcast | None:
        """Return the broadcast of a range's source in its slot.

        It holds what the source knew some slots ago, at the time of transmission.
        """
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
        heard = self._send(event.source, event.slot, place, float(clock @ own.x), own, told)
        if event.slot != NO_SLOT:
            self._heard[key] = heard
        return heard

    def _send(
        self, who: int, slot: int, place_m: FloatArray, clock_m: float, own: OwnFilter, told: FloatArray
    ) -> HeardBroadcast:
        """Return a message as it arrives.

        ``told`` is the derivative of place and clock by the sender's state ``own``.
        """
        algorithm = self._algorithm
        message = Broadcast(
            who,
            self._prepared.ranks[who],
            max(slot, 0),
            place_m,
            clock_m,
            None if algorithm == "neighbour_exact" else told @ own.P @ told.T,
            told @ own.shared if algorithm == "modified" else None,
        )
        sent = message.encode()
        self.recorder.sent(who, len(sent))
        mine = self._own[who]
        self._own[who] = replace(mine, independent=np.zeros_like(mine.independent))  # all may be known now
        heard = decode(sent, algorithm)
        return HeardBroadcast(heard, _root(heard.covariance), told, own.map_rows)

    def _rows(self, offer: OfferedMeasurement) -> list[Used]:
        """Linearised measurements of an offer, referred to the vehicle's state now."""
        who, event, heard = offer.who, offer.event, offer.heard
        own, vehicle = self._own[who], self._prepared.vehicles[who]
        x, back = own.x, np.eye(vehicle.size)
        if abs(event.time_s - own.time_s) > 1e-12:
            x, back, _ = vehicle.step(own.x, own.time_s, event.time_s)
        if offer.sighting is not None and heard is not None:
            rows = offer.sighting.rows(vehicle, x, event.time_s, heard.message.place_m)
        else:
            source_m = None if heard is None else heard.message.place_m
            rows = rows_of(event, vehicle, x, source_m, 0.0 if heard is None else heard.message.clock_m)
        found = []
        for row in rows:
            by_shared = np.zeros(len(self._Pc))
            if event.kind == POINT and event.source in self._uncertain:
                at = 2 * self._uncertain.index(event.source)
                by_shared[at : at + 2] = -row.place @ self._prepared.points.axes[event.source]
            found.append(Used(offer, row, row.receiver @ back, by_shared))
        if not found:
            self.recorder.counts["lost"] += 1
        return found

    def _brought(self, rows: list[Used]) -> FloatArray:
        """Return the covariance of what the sources bring.

        Errors of one source are common to all its rows.
        """
        brought, parts = np.zeros((len(rows), len(rows))), []
        for i, used in enumerate(rows):
            heard = used.offer.heard
            if heard is not None:
                parts.append(used.told @ heard.root)
                for j in range(i + 1):
                    if rows[j].source == used.source:
                        brought[i, j] = brought[j, i] = float(parts[i] @ parts[j])
            else:
                parts.append(np.zeros(0))
                if self._algorithm != "neighbour_exact":
                    brought[i, i] = float(used.by_shared @ self._Pc @ used.by_shared)
        return brought

    def _passes(self, who: int, rows: list[Used]) -> bool:
        """Tell whether all rows of a measurement pass the gate.

        It also counts, and opens the doubtful states after many rejections.
        """
        own, vehicle = self._own[who], self._prepared.vehicles[who]
        offer, brought = rows[0].offer, np.diag(self._brought(rows))
        passes = True
        for used, noise in zip(rows, brought.tolist(), strict=True):
            total = float(used.h @ own.P @ used.h) + used.row.variance * offer.event.spread + noise
            fits = self._settings.gate_sigma <= 0.0 or used.row.innovation**2 <= self._settings.gate_sigma**2 * total
            passes = passes and fits
            if offer.sighting is None:
                self.recorder.judge(offer.event, used.row.innovation, total, passes)
            if not passes:
                break  # the bearing of a wrong range is another object's
        self._rejected[who] = 0 if passes else self._rejected[who] + 1
        if self._rejected[who] >= PATIENCE and offer.event.kind != HEIGHT:
            self._rejected[who] = 0
            self.recorder.opened(vehicle)
            P = own.P.copy()
            for state, variance in vehicle.doubts.items():
                P[state, state] += variance
            self._own[who] = replace(own, P=P)
        return passes

    def _update(self, own: OwnFilter, rows: list[Used]) -> OwnFilter:
        """Run the Kalman update with the noise of the algorithm.

        Shared errors are considered, not estimated.
        """
        H = np.array([used.h for used in rows])
        Hc = np.array([used.by_shared for used in rows])
        R = np.diag([used.row.variance for used in rows]) + self._brought(rows)
        shared, told = own.shared, np.zeros_like(Hc)
        if self._algorithm == "modified":
            for number, used in enumerate(rows):
                if used.offer.heard is not None and used.offer.heard.message.shared is not None:
                    told[number] = used.told @ used.offer.heard.message.shared
            R = R + self._through_what_they_share(rows, told)
        cross = shared @ (Hc + told @ self._inverse_Pc).T  # the points' errors are in the state and in what is told
        S = H @ own.P @ H.T + H @ cross + cross.T @ H.T + R
        gain = np.linalg.solve(S, (own.P @ H.T + cross).T).T
        x = own.x + gain @ np.array([used.row.innovation for used in rows])
        P = own.P - gain @ S @ gain.T
        if self._algorithm == "modified":
            shared = shared - gain @ (H @ shared + Hc @ self._Pc + told)
        return OwnFilter(own.time_s, x, 0.5 * (P + P.T), own.independent, shared, self._mixed(own, gain, H, rows))

    def _through_what_they_share(self, rows: list[Used], told: FloatArray) -> FloatArray:
        """Return the covariance of the noise of different neighbours and points.

        It comes through the uncertain ground points.
        """
        through = told + np.array([used.by_shared for used in rows]) @ self._Pc
        between = through @ self._inverse_Pc @ through.T if len(self._Pc) else np.zeros((len(rows), len(rows)))
        for i, one in enumerate(rows):
            for j, two in enumerate(rows):
                if i == j or (one.source == two.source and one.source[0] == PEER):  # in what they bring
                    between[i, j] = 0.0
        return between

    def _split_update(self, own: OwnFilter, rows: list[Used], about: FloatArray) -> OwnFilter:
        """Fuse the rows of one measurement by split covariance intersection.

        They are linearised about the state ``about``.
        """
        H, sensor = np.array([used.h for used in rows]), np.diag([used.row.variance for used in rows])
        fused = fuse(own.P, own.independent, H, sensor, self._brought(rows))
        if fused is None:
            return own
        innovation = np.array([used.row.innovation for used in rows]) - H @ (own.x - about)
        is_common = any(used.offer.sighting is not None for used in rows)  # its noise is in the observer's state too
        independent = np.zeros_like(fused.independent) if is_common else fused.independent
        mixed = self._mixed(own, fused.gain, H, rows)
        return OwnFilter(own.time_s, own.x + fused.gain @ innovation, fused.P, independent, own.shared, mixed)

    @staticmethod
    def _mixed(own: OwnFilter, gain: FloatArray, H: FloatArray, rows: list[Used]) -> FloatArray:
        """Rows of the error map after an update."""
        others: list[Other | None] = []
        for used in rows:
            heard = used.offer.heard
            others.append(None if heard is None else (used.told @ heard.derivative, heard.map_rows))
        return corrected_rows(own.map_rows, gain, H, others)


def _root(covariance: FloatArray | None) -> FloatArray:
    """Return the symmetric square root; zero without a covariance.

    Rounding to 4-byte numbers may leave an eigenvalue below 0.
    """
    if covariance is None:
        return np.zeros((4, 4))
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)


def run_decentralised(prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> AlgorithmRun:
    """Run one of the four decentralised algorithms."""
    return Decentralised(prepared, settings, algorithm).run()
