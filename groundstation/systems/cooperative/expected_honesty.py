"""Real covariance of the pairwise filter beside the one it claims, without truth.

Stored pairwise cross-covariances are right as long as errors of two vehicles are correlated through one chain of
encounters. Where encounters are frequent and close loops, or where ground points are heard by some, the factors towards
third vehicles go wrong and the filter claims less than it makes. Its gains depend on the geometry and on the stated
sigmas alone, so the covariance that its errors really have under these sigmas can be worked out beside it: the joint
covariance S of all vehicles and uncertain points goes through the same transitions and gains,
S = (I - K h) S (I - K h)' + K r K'. The trace of P^-1 S in the plane is the NEES to expect, 2 where P is right.

It ignores the gate, and it linearises about the track that is given, not about what the filter itself would estimate.

Source: Gelb (editor), Applied optimal estimation, 1974, section 7.2 (true covariance of a suboptimal filter); Luft,
Schubert, Roumeliotis and Burgard, International Journal of Robotics Research 37(10), 2018, section 4 (the filter).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.findings import Finding
from groundstation.base.records import frozen
from groundstation.systems.cooperative.answer import AlgorithmRow
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.observation import LinearisedMeasurement, rows_of
from groundstation.systems.cooperative.filters.pairwise import after_over_before
from groundstation.systems.cooperative.filters.steps import MeasurementEvent, steps
from groundstation.systems.cooperative.loop_types import PEER, POINT
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import VehicleTrack


@dataclass(frozen=True)
class ExpectedNees:
    """NEES to expect of the pairwise filter, mean over the vehicles, at times of output.

    Parameters
    ----------
    time_s, nees : ndarrays, shape (n,)
        As far as it was worked out.
    is_whole : bool
        False where the work ended because a NEES was above the limit.
    """

    time_s: FloatArray
    nees: FloatArray
    is_whole: bool

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_s", frozen(self.time_s))
        object.__setattr__(self, "nees", frozen(self.nees))

    @property
    def worst(self) -> float:
        """Largest NEES; 2 where there is none."""
        return float(self.nees.max(initial=2.0))


@dataclass(frozen=True)
class HonestyCheck:
    """Expected NEES of an algorithm, worst time, and why it is refused; empty where it is not."""

    nees: float
    refused: str


class _Analysis:
    """Claimed covariances and factors of all vehicles, and the real joint covariance."""

    def __init__(self, prepared: Prepared, about: tuple[VehicleTrack, ...]) -> None:
        self.prepared, self.about = prepared, about
        vehicles = prepared.vehicles
        edges = [0, *accumulate(vehicle.size for vehicle in vehicles)]
        self.places = [slice(one, two) for one, two in pairwise(edges)]
        starts = [vehicle.start() for vehicle in vehicles]
        self.x, self.claimed = [x for x, _ in starts], [P for _, P in starts]
        self.times = [vehicle.first_s for vehicle in vehicles]
        self.factors: list[dict[int, FloatArray]] = [{} for _ in vehicles]
        uncertain = [i for i, point in enumerate(prepared.session.points) if point.position_sigma_m > 0.0]
        self.points = {i: slice(edges[-1] + 2 * k, edges[-1] + 2 * k + 2) for k, i in enumerate(uncertain)}
        self.real = np.zeros((edges[-1] + 2 * len(uncertain),) * 2)
        for place, P in zip(self.places, self.claimed, strict=True):
            self.real[place, place] = P
        for i, place in self.points.items():
            self.real[place, place] = prepared.session.points[i].position_sigma_m ** 2 * np.eye(2)
        self.outputs = [0 for _ in vehicles]

    def advance(self, who: int, to_s: float) -> None:
        """Move one vehicle on."""
        if to_s <= self.times[who] + 1e-12:
            return
        place = self.places[who]
        self.x[who], phi, noise = self.prepared.vehicles[who].step(self.x[who], self.times[who], to_s)
        self.claimed[who] = phi @ self.claimed[who] @ phi.T + noise
        self.factors[who] = {other: phi @ factor for other, factor in self.factors[who].items()}
        self.real[place] = phi @ self.real[place]
        self.real[:, place] = self.real[:, place] @ phi.T
        self.real[place, place] += noise
        self.times[who] = to_s

    def output(self, who: int) -> float:
        """Return the NEES to expect of a vehicle, and take its state from the given track."""
        if self.about and self.outputs[who] < len(self.about[who].state):
            self.x[who] = np.array(self.about[who].state[self.outputs[who]])
        self.outputs[who] += 1
        first = self.places[who].start
        real = self.real[first : first + 2, first : first + 2]
        return float(np.trace(np.linalg.solve(self.claimed[who][:2, :2], real)))

    def use(self, event: MeasurementEvent) -> None:
        """Update as the filter would."""
        self.advance(event.receiver, event.time_s)
        source_m, clock_m, derivative = None, 0.0, np.zeros((3, 0))
        if event.kind == PEER:
            self.advance(event.source, event.time_s)
            peer, x = self.prepared.vehicles[event.source], self.x[event.source]
            source_m, derivative = peer.place(x, event.time_s)
            clock_m = float(x[peer.clock]) if peer.clock >= 0 else 0.0
        mine = self.prepared.vehicles[event.receiver]
        for row in rows_of(event, mine, self.x[event.receiver], source_m, clock_m):
            if event.kind == PEER:
                self._relative(event, row, derivative)
            else:
                self._private(event, row)

    def _private(self, event: MeasurementEvent, row: LinearisedMeasurement) -> None:
        who, variance, h_point = event.receiver, row.variance, np.zeros(2)
        if event.kind == POINT and event.source in self.points:
            h_point = -row.place @ self.prepared.points.axes[event.source]
            sigma = self.prepared.session.points[event.source].position_sigma_m
            variance += sigma**2 * float(h_point @ h_point)
        P = self.claimed[who]
        shared = P @ row.receiver
        gain = shared / (float(row.receiver @ shared) + variance)
        self.claimed[who] = P - np.outer(shared, gain)
        kept = np.eye(len(gain)) - np.outer(gain, row.receiver)
        self.factors[who] = {other: kept @ factor for other, factor in self.factors[who].items()}
        h = [(self.places[who], row.receiver)]
        if event.source in self.points and event.kind == POINT:
            h.append((self.points[event.source], h_point))
        self._correct(h, [(self.places[who], gain)], row.variance)

    def _relative(self, event: MeasurementEvent, row: LinearisedMeasurement, derivative: FloatArray) -> None:
        i, j = event.receiver, event.source
        mine, others, n = self.factors[i], self.factors[j], len(self.claimed[i])
        by_source = row.by_source(self.prepared.vehicles[j], derivative)
        h = np.concatenate([row.receiver, by_source])
        cross = mine[j] @ others[i].T if j in mine else np.zeros((n, len(by_source)))
        P = np.block([[self.claimed[i], cross], [cross.T, self.claimed[j]]])
        shared = P @ h
        total = float(h @ shared) + row.variance
        if total <= 0.0:
            return
        gain = shared / total
        after = P - np.outer(shared, gain)
        for who, part in ((i, slice(0, n)), (j, slice(n, None))):
            if any(third not in (i, j) for third in self.factors[who]):
                scale = after_over_before(after[part, part], self.claimed[who])
                self.factors[who] = {
                    third: factor if third in (i, j) else scale @ factor for third, factor in self.factors[who].items()
                }
            self.claimed[who] = after[part, part].copy()
        self.factors[i][j], self.factors[j][i] = after[:n, n:].copy(), np.eye(len(by_source))
        pairs = [(self.places[i], row.receiver), (self.places[j], by_source)]
        self._correct(pairs, [(self.places[i], gain[:n]), (self.places[j], gain[n:])], row.variance)

    def _correct(
        self, h: list[tuple[slice, FloatArray]], gain: list[tuple[slice, FloatArray]], variance: float
    ) -> None:
        """Give the real covariance (I - K h) S (I - K h)' + K r K'."""
        shared = sum((self.real[:, place] @ part for place, part in h), start=np.zeros(len(self.real)))
        total = sum(float(part @ shared[place]) for place, part in h) + variance
        for place, part in gain:
            self.real[place] -= np.outer(part, shared)
            self.real[:, place] -= np.outer(shared, part)
        for place, part in gain:
            for other, other_part in gain:
                self.real[place, other] += total * np.outer(part, other_part)


def expected_nees(
    prepared: Prepared, settings: CooperativeSettings, about: tuple[VehicleTrack, ...], limit: float = np.inf
) -> ExpectedNees:
    """Return the NEES to expect of the pairwise filter over a session.

    Parameters
    ----------
    prepared : Prepared
    settings : CooperativeSettings
    about : tuple of VehicleTrack
        Tracks at the times of output about which to linearise, those of a trusted algorithm; empty: dead reckoning.
    limit : float
        The work ends where the mean over the vehicles is above it.
    """
    analysis = _Analysis(prepared, about)
    times: list[float] = []
    found: list[float] = []
    latest = {}
    for at_s, what in steps(prepared, settings, together=False):
        if isinstance(what, int):
            analysis.advance(what, at_s)
            latest[what] = analysis.output(what)
            if times and times[-1] == at_s:
                found[-1] = float(np.mean(list(latest.values())))
                continue
            if found and found[-1] > limit:
                return ExpectedNees(np.array(times), np.array(found), False)
            times.append(at_s)
            found.append(float(np.mean(list(latest.values()))))
        else:
            analysis.use(what[0])
    return ExpectedNees(np.array(times), np.array(found), True)


def check_pairwise(prepared: Prepared, settings: CooperativeSettings, about: tuple[VehicleTrack, ...]) -> HonestyCheck:
    """Tell from a session itself whether the pairwise filter can be honest in it."""
    limit = settings.pairwise_nees_limit
    if limit <= 0.0:
        return HonestyCheck(2.0, "")
    found = expected_nees(prepared, settings, about, limit)
    if found.worst <= limit:
        return HonestyCheck(found.worst, "")
    at_s = float(found.time_s[int(np.argmax(found.nees))])
    reason = (
        f"NEES {found.worst:.3g} to expect at {at_s:.0f} s where 2 is honest (limit {limit:g}), with "
        f"{_density(prepared)}: it is for sparse encounters that close no loops"
    )
    return HonestyCheck(found.worst, reason)


def _density(prepared: Prepared) -> str:
    """Say how many pairs met, how often, and how many ranges came from points and satellites."""
    events = prepared.events
    is_peer = events.kind == PEER
    pairs = np.unique(np.sort(np.stack([events.receiver[is_peer], events.source[is_peer]]), axis=0), axis=1).shape[1]
    start_s, end_s = (min(one.first_s for one in prepared.vehicles), max(one.last_s for one in prepared.vehicles))
    minutes = max(end_s - start_s, 1.0) / 60.0
    each = int(is_peer.sum()) / max(pairs, 1) / minutes
    loops = max(pairs - len(prepared.vehicles) + 1, 0)
    text = f"{each:.3g} encounters a minute of each of {pairs} pairs ({loops} loops)"
    others = int((~is_peer).sum())
    return f"{text} and {others} ranges to points or satellites" if others else text


def refusals(checks: Mapping[str, HonestyCheck]) -> list[Finding]:
    """Return a finding for each algorithm that was refused."""
    return [
        Finding("info", "cooperative.refused", f"{name} was not run: {check.refused}")
        for name, check in checks.items()
        if check.refused
    ]


def with_checks(
    rows: Sequence[AlgorithmRow], checks: Mapping[str, HonestyCheck], order: Sequence[str]
) -> tuple[AlgorithmRow, ...]:
    """Return the rows of all algorithms in their order, those refused among them."""
    found = {row.algorithm: row for row in rows}
    for name, check in checks.items():
        row = found.get(name) or AlgorithmRow(
            *(name, "sequential", None, None, None, None, None, None, None, None, None), *(0, 0, 0, 0, 0.0)
        )
        found[name] = replace(
            row, expected_nees=check.nees, refused=f"refused: {check.refused}" if check.refused else ""
        )
    return tuple(found[name] for name in order)
