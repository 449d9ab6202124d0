"""Study of recorded robots: every algorithm on every set, against motion capture.

Nothing is calibrated with the truth. What differs from robot to robot (scales of odometry, range, angle and lag of the
camera) are states of the filters. The settings below hold for all sets of a kind; docs/cooperative.md says where each
comes from.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.findings import Finding
from groundstation.chapters.parts import Section
from groundstation.results.figures import FigureData
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.consistency import judge, normalised
from groundstation.systems.cooperative.events import prepare
from groundstation.systems.cooperative.relative import Relative, relative_covariances
from groundstation.systems.cooperative.settings import (
    ALGORITHMS,
    CameraBelief,
    CooperativeSettings,
    InsBelief,
    OdometryBelief,
    SmootherSettings,
)
from groundstation.systems.cooperative.tracks import AlgorithmRun
from groundstation.systems.study import StudyResult, grid, section, table
from groundstation.tables.session import Session
from recorded_robots.robots import blinded

Truth = Mapping[str, tuple[FloatArray, FloatArray]]
Progress = Callable[[str], None]
SETTINGS = {
    "utias": CooperativeSettings(
        odometry=OdometryBelief(
            position_m=0.05,
            heading_deg=2.0,
            along_m_per_sqrt_s=0.03,
            turn_deg_per_sqrt_s=3.0,
            speed_scale=0.1,
            turn_scale=0.1,
        ),
        camera=CameraBelief(range_scale=0.05, marker_bias_m=0.03, mount_deg=1.0, lag_s=0.1),
        range_bias_m=0.1,
        range_share=0.012,
        correlated_share=0.5,
        correlation_s=5.0,
        gate_sigma=4.0,
        latency_slots=0,
        map_window_s=1e6,
        smoother=SmootherSettings(pair_bias_m=0.03),
    ),
}
SETTINGS["miluv"] = CooperativeSettings(
    ins=InsBelief(position_m=0.1, velocity_mps=0.05, velocity_s=30.0, baro_m=0.05, baro_s=100.0),
    derivatives="estimate",
    range_bias_m=0.05,
    range_bias_s=5.0,
    correlated_share=0.2,
    correlation_s=5.0,
    gate_sigma=3.0,  # one range in ten is too long by a path that is not the straight one
    latency_slots=0,
    map_window_s=1e6,
)
SETTINGS["murp"] = replace(
    SETTINGS["miluv"],
    range_bias_m=0.15,
    range_bias_s=20.0,
    correlated_share=0.5,
    gate_sigma=4.0,
    smoother=SmootherSettings(pair_bias_m=0.1),
)
_SIMULATED = (
    "dead reckoning is simulated, for the data hold none: truth with a start off by 0.1 m along each axis, "
    "Gauss-Markov errors of velocity (0.05 m/s, 30 s) and height (0.05 m, 100 s) and a constant heading error (1 deg), "
    "in several draws"
)
PROTOCOLS = {
    "utias": "UTIAS: every robot starts at its true pose (believed to 0.05 m, 2 deg); from then on truth only judges. "
    "Odometry averaged over 0.2 s. Camera and odometry scales are states.",
    "miluv": f"MILUV: {_SIMULATED}; ranges as recorded, two antennas a vehicle.",
    "murp": f"MURP: {_SIMULATED}; ranges as recorded, six antennas a vehicle, no point that stands still.",
}
COLUMNS = (
    *("set", "case", "algorithm", "rms_m", "nees", "worst_vehicle_m", "relative_m"),
    *("relative_nees", "common_m", "common_nees", "diverges", "gated_share", "bytes_per_s"),
)
DIGITS = {
    "rms_m": 3,
    "nees": 2,
    "worst_vehicle_m": 3,
    "relative_m": 3,
    "relative_nees": 2,
    "common_m": 4,
    "common_nees": 2,
    "gated_share": 4,
    "bytes_per_s": 0,
}


@dataclass(frozen=True)
class RecordedSet:
    """One set of recorded vehicles.

    Parameters
    ----------
    name, kind : str
        The kind is a key of :data:`SETTINGS`.
    sessions : tuple of Session
        One; where dead reckoning is simulated one for each draw of its errors.
    truth : mapping of vehicle to (time_s (n,), position_m (n, 3))
    findings : tuple of Finding
    """

    name: str
    kind: str
    sessions: tuple[Session, ...]
    truth: Truth
    findings: tuple[Finding, ...] = ()

    def cases(self) -> dict[str, tuple[Session, ...]]:
        """Return the sessions by name: as recorded, or with a full and a half-blind map.

        The second half of the vehicles is blind to the map, where there is one and three vehicles or more.
        """
        names = self.sessions[0].names
        blind = names[len(names) // 2 :]
        if not self.sessions[0].points or len(names) < 3:
            return {"as recorded": self.sessions}
        return {
            "full map": self.sessions,
            f"{', '.join(blind)} blind": tuple(blinded(session, blind) for session in self.sessions),
        }


@dataclass(frozen=True)
class Score:
    """One algorithm on one case, over all draws.

    Horizontal RMS error of the team and of its worst vehicle, of the places of two vehicles to one another, mean NEES
    (2 is honest), that of the place of one vehicle to another where the algorithm claims a covariance of it, RMS error
    and NEES over the time that all truths have in common, whether any run diverges, share of measurements gated, bytes
    that a vehicle sends in a second.
    """

    rms_m: float
    nees: float
    worst_m: float
    relative_m: float
    relative_nees: float
    common_m: float
    common_nees: float
    diverges: bool
    gated: float
    bytes_per_s: float


def score(
    runs: Sequence[AlgorithmRun], sessions: Sequence[Session], truth: Truth, claims: Sequence[Relative] = ()
) -> Score:
    """Judge the runs of one algorithm at every output of every vehicle with truth.

    ``claims`` of each run: covariances of the places of its vehicles to one another.
    """
    errors: dict[str, list[FloatArray]] = {}
    nees, relative, relative_nees, diverges = [], [], [], False
    common, common_nees = [], []
    common_s = min((float(time_s[-1]) for time_s, _ in truth.values()), default=np.inf)
    for run, session, claim in zip(runs, sessions, claims or [{}] * len(runs), strict=True):
        here: dict[int, tuple[FloatArray, FloatArray]] = {}
        for number, (track, vehicle) in enumerate(zip(run.tracks, session.vehicles, strict=True)):
            if track.name in truth and len(track.time_s):
                one = judge(track, vehicle, *truth[track.name])
                here[number] = track.time_s, one.error_m
                errors.setdefault(track.name, []).append((one.error_m**2).sum(axis=1))
                nees.append(one.nees)
                common.append((one.error_m**2).sum(axis=1)[track.time_s <= common_s])
                common_nees.append(one.nees[track.time_s <= common_s])
                diverges = diverges or one.diverges(track)
        for (i, (time_s, error)), (j, (other_s, other)) in combinations(here.items(), 2):
            both_s, at, to = np.intersect1d(time_s, other_s, return_indices=True)
            apart = error[at] - other[to]
            relative.append((apart**2).sum(axis=1))
            if (i, j) in claim:
                claimed_s, covariance = claim[i, j]
                _, at, to = np.intersect1d(both_s, claimed_s, return_indices=True)
                relative_nees.append(normalised(apart[at], covariance[to]))
    used, gated = (sum(run.counts.get(mark, 0) for run in runs) for mark in ("used", "gated"))
    sent = sum(size for run in runs for _, size in run.messages.values())
    vehicle_s = sum(float(track.time_s[-1]) for run in runs for track in run.tracks if len(track.time_s))
    each = [_mean(squares) for squares in errors.values()]
    return Score(
        np.sqrt(_mean([square for squares in errors.values() for square in squares])),
        _mean(nees),
        np.sqrt(max(each, default=np.nan)),
        np.sqrt(_mean(relative)),
        _mean(relative_nees),
        np.sqrt(_mean(common)),
        _mean(common_nees),
        diverges,
        gated / max(used + gated, 1),
        sent / max(vehicle_s, 1.0),
    )


def _mean(parts: Sequence[FloatArray]) -> float:
    """Return the mean of all that is a number; NaN without any."""
    whole = np.concatenate(parts) if parts else np.zeros(0)
    known = whole[np.isfinite(whole)]
    return float(known.mean()) if len(known) else float("nan")


def study_recorded(
    sets: Sequence[RecordedSet], progress: Progress | None = None, algorithms: Sequence[str] = tuple(ALGORITHMS)
) -> StudyResult:
    """Run every algorithm on every case of every set, and tabulate the results."""
    rows, remarks = [], list[str]()
    for one in sets:
        settings = SETTINGS[one.kind]
        remarks += [f"{one.name}: {finding.text}" for finding in one.findings]
        for case, sessions in one.cases().items():
            prepared = [prepare(session, settings) for session in sessions]
            remarks += [f"{one.name}, {case}: {finding.text}" for finding in prepared[0].findings]
            for name in algorithms:
                runs = [run_algorithm(each, settings, name) for each in prepared]
                claims = [relative_covariances(each, settings, run) for each, run in zip(prepared, runs, strict=True)]
                found = score(runs, [each.session for each in prepared], one.truth, claims)
                rows.append((one.name, case, name, *vars(found).values()))
                if progress is not None:
                    progress(f"{one.name}, {case}, {name}: {found.rms_m:.3f} m, NEES {found.nees:.2f}")
    values = zip(*rows, strict=True) if rows else ((),) * len(COLUMNS)
    columns = dict(zip(COLUMNS, map(np.array, values), strict=True))
    data = FigureData("cooperative_recorded", columns, DIGITS)
    return StudyResult("recorded", (data,), _page(sets, data, remarks))


def _page(sets: Sequence[RecordedSet], data: FigureData, remarks: Sequence[str]) -> tuple[Section, ...]:
    head = ["set", "vehicles", "points", "measurements", "seconds", "draws"]
    cells = []
    for one in sets:
        first = one.sessions[0]
        length_s = max(float(track.time_s[-1]) for track in first.vehicles)
        counts = (len(first.vehicles), len(first.points), len(first.ranges), round(length_s), len(one.sessions))
        cells.append([one.name, *map(str, counts)])
    sections = [
        section(
            "Navigation between vehicles: recorded sets",
            "Horizontal error of all vehicles together against motion capture, at every second of the whole set; that "
            "of their places to one another; NEES of the position (2 is honest), and of the place to one another "
            "where an algorithm keeps what two vehicles have in common. Nothing is calibrated with the truth: "
            "one group of settings for a kind of set. Bytes are those that a vehicle sends in a second.",
            *(PROTOCOLS[kind] for kind in dict.fromkeys(one.kind for one in sets)),
            table(data),
        ),
        section("Sets", grid(head, cells)),
    ]
    return (*sections, section("Findings", *remarks)) if remarks else tuple(sections)
