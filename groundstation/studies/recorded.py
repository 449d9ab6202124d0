"""Recorded robots: every algorithm on every set, judged against motion capture. Nothing is calibrated with the truth.

What differs from robot to robot (scales of odometry, range, angle and lag of the camera) are states of the filters. The
settings below hold for all sets of a kind; docs/cooperative.md says where each comes from.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.findings import Finding
from groundstation.estimators.cooperative.consistency import judge
from groundstation.estimators.cooperative.estimate import run_algorithm
from groundstation.estimators.cooperative.events import prepare
from groundstation.estimators.cooperative.settings import (
    ALGORITHMS,
    CameraBelief,
    CooperativeSettings,
    OdometryBelief,
)
from groundstation.estimators.cooperative.tracks import AlgorithmRun
from groundstation.results.figures import FigureData
from groundstation.studies.page import StudyResult, markdown_rows, markdown_table
from groundstation.tables.session import Session
from groundstation.tables.session_robots import blinded

Truth = Mapping[str, tuple[FloatArray, FloatArray]]
Progress = Callable[[str], None]
FIRST_BLIND = 2  # the first two robots keep their landmarks
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
        gate_sigma=5.0,
        latency_slots=0,
        map_window_s=1e6,
    ),
}
PROTOCOLS = {
    "utias": "UTIAS: every robot starts at its true pose (believed to 0.05 m, 2 deg); from then on truth only judges. "
    "Odometry averaged over 0.2 s. Camera and odometry scales are states.",
}


@dataclass(frozen=True)
class RecordedSet:
    """One set of recorded robots: session, and truth as vehicle to (time_s (n,), position_m (n, 3))."""

    name: str
    kind: str
    session: Session
    truth: Truth
    findings: tuple[Finding, ...] = ()

    def cases(self) -> dict[str, Session]:
        """Sessions by name: as recorded, and for robots with a map with some of them blind to it."""
        names = self.session.names
        if self.kind != "utias" or len(names) <= FIRST_BLIND:
            return {"as recorded": self.session}
        blind = names[FIRST_BLIND:]
        return {"full map": self.session, f"{', '.join(blind)} blind": blinded(self.session, blind)}


@dataclass(frozen=True)
class Score:
    """One algorithm on one case: horizontal RMS error of the team and of its worst vehicle, mean NEES (2 is honest)."""

    rms_m: float
    nees: float
    worst_m: float
    diverges: bool
    gated: float
    bytes_per_s: float


def score(run: AlgorithmRun, session: Session, truth: Truth) -> Score:
    """Judge one run at every output of every vehicle with truth."""
    squares, nees, diverges = [], [], False
    for track, vehicle in zip(run.tracks, session.vehicles, strict=True):
        if track.name not in truth or not len(track.time_s):
            continue
        one = judge(track, vehicle, *truth[track.name])
        squares.append((one.error_m**2).sum(axis=1))
        nees.append(one.nees)
        diverges = diverges or one.diverges(track)
    used, gated = run.counts.get("used", 0), run.counts.get("gated", 0)
    length_s = max((float(track.time_s[-1]) for track in run.tracks if len(track.time_s)), default=0.0)
    sent = sum(size for _, size in run.messages.values())
    if not any(np.isfinite(square).any() for square in squares):
        return Score(np.nan, np.nan, np.nan, diverges, np.nan, np.nan)
    return Score(
        float(np.sqrt(np.nanmean(np.concatenate(squares)))),
        float(np.nanmean(np.concatenate(nees))),
        max(float(np.sqrt(np.nanmean(square))) for square in squares if np.isfinite(square).any()),
        diverges,
        gated / max(used + gated, 1),
        sent / max(length_s * len(run.tracks), 1.0),
    )


def study_recorded(
    sets: Sequence[RecordedSet], progress: Progress | None = None, algorithms: Sequence[str] = tuple(ALGORITHMS)
) -> StudyResult:
    """Run every algorithm on every case of every set, and lay them out in one table."""
    rows, remarks = [], list[str]()
    for one in sets:
        settings = SETTINGS[one.kind]
        remarks += [f"{one.name}: {finding.text}" for finding in one.findings]
        for case, session in one.cases().items():
            prepared = prepare(session, settings)
            remarks += [f"{one.name}, {case}: {finding.text}" for finding in prepared.findings]
            for name in algorithms:
                found = score(run_algorithm(prepared, settings, name), prepared.session, one.truth)
                rows.append((one.name, case, name, *vars(found).values()))
                if progress is not None:
                    progress(f"{one.name}, {case}, {name}: {found.rms_m:.3f} m, NEES {found.nees:.2f}")
    columns = ("set", "case", "algorithm", "rms_m", "nees", "worst_vehicle_m", "diverges", "gated_share", "bytes_per_s")
    digits = {"rms_m": 3, "nees": 2, "worst_vehicle_m": 3, "gated_share": 4, "bytes_per_s": 0}
    values = zip(*rows, strict=True) if rows else ((),) * len(columns)
    table = FigureData("cooperative_recorded", dict(zip(columns, map(np.array, values), strict=True)), digits)
    return StudyResult("cooperative", (table,), _page(sets, table, remarks))


def _page(sets: Sequence[RecordedSet], table: FigureData, remarks: Sequence[str]) -> str:
    lines = ["# Navigation between robots: recorded sets", ""]
    lines += [
        "Horizontal error of all vehicles together against motion capture, at every second of the whole set. NEES of "
        "the position: 2 is honest. Nothing is calibrated with the truth; one group of settings a kind of set. Bytes "
        "are those that a vehicle sends in a second.",
        "",
        *(f"{PROTOCOLS[kind]}\n" for kind in dict.fromkeys(one.kind for one in sets)),
        *markdown_table(table),
        "",
    ]
    lines += ["## Sets", ""]
    head = ["set", "vehicles", "points", "measurements", "seconds"]
    cells = []
    for one in sets:
        length_s = max(float(track.time_s[-1]) for track in one.session.vehicles)
        counts = [len(one.session.vehicles), len(one.session.points), len(one.session.ranges), round(length_s)]
        cells.append([one.name, *map(str, counts)])
    lines += [*markdown_rows(head, cells), ""]
    if remarks:
        lines += ["## Findings", "", *(f"- {text}" for text in remarks), ""]
    return "\n".join(lines)
