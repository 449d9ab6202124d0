"""Decentralised filters: every vehicle estimates its own states alone.

It hears what its neighbours broadcast. Four algorithms differ in what they make of a neighbour's estimate:

- ``neighbour_exact``: it is the truth.
- ``ranked``: only neighbours of a higher rank are used, and h P h' of their covariance is added to the noise.
- ``modified``: ranked, all ranges of a frame together; the noise of two neighbours is correlated by what they share:
  each keeps and broadcasts its covariance C with the errors of uncertain ground points (a consider filter), and the
  noise of neighbours a and b has the covariance h_a C_a Pc^-1 C_b' h_b'.
- ``split_intersection``: a covariance has an independent part and one that may be correlated with anything; the latter
  is fused by covariance intersection. All that was ever broadcast counts as correlated, and so does all that is heard:
  others have heard it too. What gathers between two transmissions is independent. Consistent whatever the correlation.

Who measures range and bearing of another tells it where it stands (sighting.py): each of the two learns from what one
of them measured, under the same rule. Both then share the noise of the sensor: nothing of theirs is independent.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapters 3 and 4 (the first three);
Schmidt, Application of state-space methods to navigation problems, 1966 (consider states); Julier and Uhlmann, General
decentralized data fusion with covariance intersection, 2001 (split form); Li and Nashashibi, Cooperative multi-vehicle
localization using split covariance intersection filter, 2013, equations 10 to 14.
"""

from collections import deque

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.error_map import spectral_radius, unit_rows
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.observation import rows_of
from groundstation.systems.cooperative.filters.own_filter import (
    HeardBroadcast,
    OfferedMeasurement,
    OwnFilter,
    UsedRow,
    brought,
    brought_alone,
)
from groundstation.systems.cooperative.filters.sighting import sighting_of
from groundstation.systems.cooperative.filters.split_covariance import fuse, fuse_one
from groundstation.systems.cooperative.filters.steps import MeasurementEvent, RunRecorder, steps
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER, POINT
from groundstation.systems.cooperative.messages import Broadcast
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun
from groundstation.systems.cooperative.vehicles import PATIENCE
from groundstation.tables.session import NO_SLOT

RANKED = ("ranked", "modified")
NO_COVARIANCE = np.zeros((4, 4))


class Decentralised:
    """All vehicles of a session under one of the algorithms."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> None:
        self._prepared, self._settings, self._algorithm = prepared, settings, algorithm
        self._vehicles, self._ranks = prepared.vehicles, prepared.ranks
        self._is_ranked, self._is_exact = algorithm in RANKED, algorithm == "neighbour_exact"
        self._is_modified, self._is_split = algorithm == "modified", algorithm == "split_intersection"
        points = prepared.session.points
        uncertain = [i for i, point in enumerate(points) if point.position_sigma_m > 0.0]
        self._uncertain = {point: 2 * number for number, point in enumerate(uncertain)}
        sigmas = [points[i].position_sigma_m for i in uncertain for _ in range(2)]
        self._Pc, self._inverse_Pc = np.diag(np.square(sigmas)), np.diag(1.0 / np.square(sigmas))
        self._no_shared = np.zeros(len(sigmas))
        self.recorder = RunRecorder(prepared.vehicles)
        self._unit_map = unit_rows([vehicle.size for vehicle in prepared.vehicles], settings.map_window_s)
        self._window_end_s = float("-inf")
        self._own: list[OwnFilter] = []
        for rows, vehicle in zip(self._unit_map, prepared.vehicles, strict=True):
            x, P = vehicle.start()
            shared = np.zeros((vehicle.size, len(sigmas)))
            self._own.append(OwnFilter(vehicle.first_s, x, P, P.copy() if self._is_split else None, shared, rows))
        self._history: deque[tuple[int, list[OwnFilter]]] = deque(maxlen=settings.latency_slots + 1)
        self._heard: dict[tuple[int, int], HeardBroadcast] = {}
        self._rejected = [0] * len(prepared.vehicles)
        covariance = None if self._is_exact else np.zeros((4, 4))
        message = Broadcast(
            0, 0, 0, np.zeros(3), 0.0, covariance, np.zeros((4, len(sigmas))) if self._is_modified else None
        )
        self._message_bytes = len(message.encode())

    def run(self) -> AlgorithmRun:
        """Work through the session."""
        together = self._settings.update == "simultaneous" or self._is_modified
        for at_s, what in steps(self._prepared, self._settings, together=together):
            if at_s >= self._window_end_s:
                self._begin_window(at_s)
            if isinstance(what, int):
                self._own[what] = own = self._own[what].moved(self._vehicles[what], at_s)
                self.recorder.keep(what, at_s, own.x, own.P)
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
        self._own = [own._replace(map_rows=rows) for own, rows in zip(self._own, self._unit_map, strict=True)]
        self._history.clear()
        self._heard.clear()

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
            self._own[who] = self._own[who].moved(self._vehicles[who], at_s)
            pieces = [self._rows(offer) for offer in offers if offer.who == who]
            pieces = [rows for rows in pieces if rows and self._passes(who, rows)]
            if self._is_split:
                about = self._own[who].x
                for rows in pieces:
                    self._own[who] = self._split_update(self._own[who], rows, about)
            elif pieces:
                rows = [used for piece in pieces for used in piece]
                is_simple = len(rows) == 1 and not self._is_modified
                self._own[who] = (self._update_by_one if is_simple else self._update)(self._own[who], rows)

    def _may_use(self, who: int, source: int) -> bool:
        """Tell whether the algorithm lets a vehicle use what another tells."""
        return not self._is_ranked or self._ranks[source] < self._ranks[who]

    def _is_used(self, offer: OfferedMeasurement) -> bool:
        event = offer.event
        if event.kind != PEER:
            return True
        if not self._may_use(event.receiver, event.source):
            self.recorder.counts["unused"] += 1
            return False
        return True

    def _tell(self, event: MeasurementEvent) -> OfferedMeasurement | None:
        """Return the place where the receiver of a range with bearing saw its source.

        It is a message to the source.
        """
        observer = event.receiver
        if not np.isfinite(event.bearing_rad) or not self._may_use(event.source, observer):
            return None
        own = self._own[observer].moved(self._vehicles[observer], event.time_s)
        sighting = sighting_of(event, self._vehicles[observer], own.x)
        if sighting is None:
            return None
        told = np.concatenate([sighting.derivative, np.zeros((1, len(own.x)))])
        heard = self._send(observer, sighting.place_m, 0.0, own, told)
        return OfferedMeasurement(event.source, event, heard, sighting)

    def _listen(self, event: MeasurementEvent) -> HeardBroadcast:
        """Return the broadcast of a range's source in its slot.

        It holds what the source knew some slots ago, at the time of transmission.
        """
        key, source = (event.source, event.slot), event.source
        if event.slot != NO_SLOT and key in self._heard:
            return self._heard[key]
        own = self._own[source]
        if event.slot != NO_SLOT:
            if not self._history or self._history[-1][0] != event.slot:
                self._history.append((event.slot, list(self._own)))
                self._heard.clear()
            own = self._history[0][1][source]
        vehicle, sight = self._vehicles[source], self._prepared.sights.source(event.number)
        own = own.moved(vehicle, event.time_s)
        told = np.zeros((4, vehicle.size))
        if sight is None:
            place_m, told[:3] = vehicle.place(own.x, event.time_s)
        else:
            told[:3] = sight.derivative
            place_m = sight.reading + sight.derivative @ own.x
        if vehicle.clock >= 0:
            told[3, vehicle.clock] = 1.0
        heard = self._send(source, place_m, float(own.x[vehicle.clock]) if vehicle.clock >= 0 else 0.0, own, told)
        if event.slot != NO_SLOT:
            self._heard[key] = heard
        return heard

    def _send(self, who: int, place_m: FloatArray, clock_m: float, own: OwnFilter, told: FloatArray) -> HeardBroadcast:
        """Return a message as it arrives: its covariances are 4-byte numbers (messages.py).

        ``told`` is the derivative of place and clock by the sender's state ``own``.
        """
        covariance = NO_COVARIANCE if self._is_exact else _as_sent(told @ own.P @ told.T)
        shared = _as_sent(told @ own.shared) if self._is_modified else None
        self.recorder.sent(who, self._message_bytes)
        if self._is_split:  # all may be known now
            self._own[who] = self._own[who]._replace(independent=np.zeros_like(own.P))
        return HeardBroadcast(place_m, clock_m, covariance, shared, told, own.map_rows)

    def _rows(self, offer: OfferedMeasurement) -> list[UsedRow]:
        """Linearised measurements of an offer, referred to the vehicle's state now."""
        who, event, heard = offer.who, offer.event, offer.heard
        own, vehicle = self._own[who], self._vehicles[who]
        x, back = own.x, None
        if abs(event.time_s - own.time_s) > 1e-12:
            x, back, _ = vehicle.step(own.x, own.time_s, event.time_s)
        if offer.sighting is not None and heard is not None:
            rows = offer.sighting.rows(vehicle, x, event.time_s, heard.place_m)
        else:
            source_m, clock_m = (None, 0.0) if heard is None else (heard.place_m, heard.clock_m)
            sight = self._prepared.sights.receiver(event.number)
            rows = rows_of(event, vehicle, x, source_m, clock_m, sight=sight)
        found = []
        for row in rows:
            by_shared = self._no_shared
            if event.kind == POINT and event.source in self._uncertain:
                at = self._uncertain[event.source]
                by_shared = np.zeros(len(self._Pc))
                by_shared[at : at + 2] = -row.place @ self._prepared.points.axes[event.source]
            told = np.append(row.place, row.clock)
            found.append(UsedRow(offer, row, row.receiver if back is None else row.receiver @ back, by_shared, told))
        if not found:
            self.recorder.counts["lost"] += 1
        return found

    def _passes(self, who: int, rows: list[UsedRow]) -> bool:
        """Tell whether all rows of a measurement pass the gate.

        It also counts, and opens the doubtful states after many rejections.
        """
        own, vehicle, offer, gate = self._own[who], self._vehicles[who], rows[0].offer, self._settings.gate_sigma
        passes = True
        for used in rows:
            noise = used.row.variance * offer.event.spread + brought_alone(used, self._is_exact, self._Pc)
            total = float(used.h @ own.P @ used.h) + noise
            passes = passes and (gate <= 0.0 or used.row.innovation * used.row.innovation <= gate * gate * total)
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
            self._own[who] = own._replace(P=P)
        return passes

    def _update_by_one(self, own: OwnFilter, rows: list[UsedRow]) -> OwnFilter:
        """Run the Kalman update with one row; what its source brings is noise."""
        used = rows[0]
        g = own.P @ used.h
        total = float(used.h @ g) + used.row.variance + brought_alone(used, self._is_exact, self._Pc)
        gain, scaled = g / total, g / np.sqrt(total)
        map_rows = own.map_rows - np.multiply.outer(gain, used.mixed(own)) if own.map_rows.size else own.map_rows
        P = own.P - np.multiply.outer(scaled, scaled)
        return OwnFilter(own.time_s, own.x + gain * used.row.innovation, P, own.independent, own.shared, map_rows)

    def _update(self, own: OwnFilter, rows: list[UsedRow]) -> OwnFilter:
        """Run the Kalman update with the noise of the algorithm.

        Shared errors are considered, not estimated: they are in the states, in the rows themselves and in what
        neighbours tell. Without the last of these a filter comes to claim less than the errors that it shares, and its
        covariance can lose its positive eigenvalues.
        """
        H = np.array([used.h for used in rows])
        Hc = np.array([used.by_shared for used in rows])
        R = np.diag([used.row.variance for used in rows]) + brought(rows, self._is_exact, self._Pc)
        shared, told = own.shared, np.zeros_like(Hc)
        if self._is_modified and len(self._Pc):
            for number, used in enumerate(rows):
                if used.offer.heard is not None and used.offer.heard.shared is not None:
                    told[number] = used.told @ used.offer.heard.shared
            R = R + self._through_what_they_share(rows, told)
        cross = shared @ (Hc + told @ self._inverse_Pc).T
        S = H @ own.P @ H.T + H @ cross + cross.T @ H.T + R
        gain = np.linalg.solve(S, (own.P @ H.T + cross).T).T
        x = own.x + gain @ np.array([used.row.innovation for used in rows])
        P = own.P - gain @ S @ gain.T
        if self._is_modified:
            shared = shared - gain @ (H @ shared + Hc @ self._Pc + told)
        return OwnFilter(own.time_s, x, 0.5 * (P + P.T), own.independent, shared, _mixed(own, gain, rows))

    def _through_what_they_share(self, rows: list[UsedRow], told: FloatArray) -> FloatArray:
        """Return the covariance of the noise of different neighbours and points.

        It comes through the uncertain ground points.
        """
        through = told + np.array([used.by_shared for used in rows]) @ self._Pc
        between = through @ self._inverse_Pc @ through.T
        for i, one in enumerate(rows):
            for j, two in enumerate(rows):
                if i == j or (one.source == two.source and one.source[0] == PEER):  # in what they bring
                    between[i, j] = 0.0
        return np.asarray(between)

    def _split_update(self, own: OwnFilter, rows: list[UsedRow], about: FloatArray) -> OwnFilter:
        """Fuse the rows of one measurement by split covariance intersection.

        They are linearised about the state ``about``.
        """
        assert own.independent is not None
        if len(rows) == 1:
            alone = brought_alone(rows[0], self._is_exact, self._Pc)
            fused = fuse_one(own.P, own.independent, rows[0].h, rows[0].row.variance, alone)
        else:
            H, sensor = np.array([used.h for used in rows]), np.diag([used.row.variance for used in rows])
            fused = fuse(own.P, own.independent, H, sensor, brought(rows, self._is_exact, self._Pc))
        if fused is None:
            return own
        innovation = np.array([used.row.innovation - used.h @ (own.x - about) for used in rows])
        is_common = any(used.offer.sighting is not None for used in rows)  # its noise is in the observer's state too
        independent = np.zeros_like(fused.independent) if is_common else fused.independent
        mixed = _mixed(own, fused.gain, rows)
        return OwnFilter(own.time_s, own.x + fused.gain @ innovation, fused.P, independent, own.shared, mixed)


def _mixed(own: OwnFilter, gain: FloatArray, rows: list[UsedRow]) -> FloatArray:
    """Rows of the error map after an update."""
    if not own.map_rows.size:
        return own.map_rows
    return np.asarray(own.map_rows - gain @ np.array([used.mixed(own) for used in rows]))


def _as_sent(values: FloatArray) -> FloatArray:
    """Return numbers as a message holds them."""
    return np.asarray(values.astype(np.float32).astype(np.float64))


def run_decentralised(prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> AlgorithmRun:
    """Run one of the four decentralised algorithms."""
    return Decentralised(prepared, settings, algorithm).run()
