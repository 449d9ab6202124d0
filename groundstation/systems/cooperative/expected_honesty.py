"""Real covariance of the pairwise filter beside the one it claims, without truth.

Stored pairwise cross-covariances are right where errors of two vehicles are correlated through one chain of encounters.
Where encounters close loops the factors towards third vehicles go wrong, the more the denser they are, and the filter
claims less than it makes. Its gains depend on the geometry and on the stated
sigmas alone, so the covariance that its errors really have under these sigmas can be worked out beside it: the joint
covariance S of all vehicles and uncertain points goes through the same transitions and gains,
S = (I - K h) S (I - K h)' + K r K'. The trace of P^-1 S in the plane is the NEES to expect, 2 where P is right.

It ignores the gate, and it linearises about the track that is given, not about what the filter itself would estimate.

Source: Gelb (editor), Applied optimal estimation, 1974, section 7.2 (true covariance of a suboptimal filter); Luft,
Schubert, Roumeliotis and Burgard, International Journal of Robotics Research 37(10), 2018, section 4 (the filter).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.records import frozen
from groundstation.base.words import counted
from groundstation.systems.cooperative.answer import AlgorithmRow
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.pairwise import after_over_before
from groundstation.systems.cooperative.filters.steps import MeasurementEvent, steps
from groundstation.systems.cooperative.joint_covariance import JointCovariance, LinearisedRow
from groundstation.systems.cooperative.loop_types import PEER
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import VehicleTrack

ENOUGH = 4.0  # times the limit: what comes after is not worked out


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


class PairwiseCovariances:
    """Claimed covariances and factors of all vehicles beside the real joint covariance."""

    def __init__(self, prepared: Prepared, about: Sequence[VehicleTrack]) -> None:
        self.prepared, self.joint = prepared, JointCovariance(prepared, about)
        self.claimed = [vehicle.start()[1] for vehicle in prepared.vehicles]
        self.factors: list[dict[int, FloatArray]] = [{} for _ in prepared.vehicles]

    def advance(self, who: int, to_s: float) -> None:
        """Move one vehicle on."""
        moved = self.joint.advance(who, to_s)
        if moved is not None:
            phi, noise = moved
            self.claimed[who] = phi @ self.claimed[who] @ phi.T + noise
            self.factors[who] = {other: phi @ factor for other, factor in self.factors[who].items()}

    def output(self, who: int) -> float:
        """Return the NEES to expect of a vehicle, and take its state from the given track."""
        self.joint.output(who)
        first = self.joint.places[who].start
        real = self.joint.P[first : first + 2, first : first + 2]
        claimed = self.claimed[who][:2, :2]
        return float(np.trace(np.linalg.solve(claimed, real))) if claimed.any() else 2.0  # a start known exactly

    def relative_m2(self, one: int, two: int) -> FloatArray:
        """Return the claimed covariance of the place of one vehicle to another, shape (2, 2)."""
        both = self.claimed[one][:2, :2] + self.claimed[two][:2, :2]
        if two not in self.factors[one]:
            return both
        cross = (self.factors[one][two] @ self.factors[two][one].T)[:2, :2]
        return np.asarray(both - cross - cross.T)

    def use(self, event: MeasurementEvent) -> None:
        """Update as the filter would."""
        self.advance(event.receiver, event.time_s)
        if event.kind == PEER:
            self.advance(event.source, event.time_s)
        for one in self.joint.rows(event):
            (self._relative if event.kind == PEER else self._private)(event, one)

    def _private(self, event: MeasurementEvent, one: LinearisedRow) -> None:
        who, variance, h = event.receiver, one.row.variance, one.row.receiver
        if one.by_source is not None:
            sigma = self.prepared.session.points[event.source].position_sigma_m
            variance += sigma**2 * float(one.by_source @ one.by_source)
        P = self.claimed[who]
        shared = P @ h
        gain = shared / (float(h @ shared) + variance)
        self.claimed[who] = P - np.outer(shared, gain)
        kept = np.eye(len(gain)) - np.outer(gain, h)
        self.factors[who] = {other: kept @ factor for other, factor in self.factors[who].items()}
        self.joint.correct(self.joint.parts(event, one), [(self.joint.places[who], gain)], one.row.variance)

    def _relative(self, event: MeasurementEvent, one: LinearisedRow) -> None:
        i, j = event.receiver, event.source
        assert one.by_source is not None
        mine, others, n = self.factors[i], self.factors[j], len(self.claimed[i])
        h = np.concatenate([one.row.receiver, one.by_source])
        cross = mine[j] @ others[i].T if j in mine else np.zeros((n, len(one.by_source)))
        P = np.block([[self.claimed[i], cross], [cross.T, self.claimed[j]]])
        shared = P @ h
        total = float(h @ shared) + one.row.variance
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
        self.factors[i][j], self.factors[j][i] = after[:n, n:].copy(), np.eye(len(one.by_source))
        places = self.joint.places
        self.joint.correct(
            self.joint.parts(event, one), [(places[i], gain[:n]), (places[j], gain[n:])], one.row.variance
        )


def expected_nees(
    prepared: Prepared, settings: CooperativeSettings, about: Sequence[VehicleTrack], limit: float = np.inf
) -> ExpectedNees:
    """Return the NEES to expect of the pairwise filter over a session.

    Parameters
    ----------
    prepared : Prepared
    settings : CooperativeSettings
    about : sequence of VehicleTrack
        Tracks at the times of output about which to linearise, those of a trusted algorithm; empty: dead reckoning.
    limit : float
        The work ends where the mean over the vehicles is above it.
    """
    analysis = PairwiseCovariances(prepared, about)
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
    if limit <= 0.0 or (len(prepared.vehicles) < 3 and not (prepared.points.sigma_m > 0.0).any()):
        return HonestyCheck(2.0, "")  # two vehicles are one filter, and honest
    found = expected_nees(prepared, settings, about, ENOUGH * limit)
    if found.worst <= limit:
        return HonestyCheck(found.worst, "")
    at_s = float(found.time_s[int(np.argmax(found.nees))])
    reason = (
        f"a NEES of {found.worst:.3g}{'' if found.is_whole else ' or more'} is to be expected at {at_s:.0f} s where 2 "
        f"is honest (limit {limit:g}), with {_density(prepared)}: it is for encounters that close no loops"
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
    text = f"{each:.3g} encounters a minute of each of {counted(pairs, 'pair')} ({counted(loops, 'loop')})"
    others = int((~is_peer).sum())
    return f"{text} and {counted(others, 'range')} to points or satellites" if others else text


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
