"""Runs of the study of stations: simulated, judged, answered."""

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.datums import DATUMS
from groundstation.base.geodesy import curvature_radii_m
from groundstation.simulation.session import SimulatedSession, simulate_session
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.consistency import normalised
from groundstation.systems.cooperative.events import prepare
from groundstation.systems.cooperative.loop_types import POINT
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.smoothed import run_smoothed
from groundstation.systems.cooperative.stations.judge import StationJudgement, judge_stations
from groundstation.systems.cooperative.study.runs import WORKERS, Progress
from groundstation.systems.cooperative.study.station_cases import StationCase
from groundstation.tables.session import Session

GOLDEN_DEG = 137.50776  # the direction of a run: even over the circle for any number of them
AFTER_S, MEANS = 60.0, 3.0  # of the plain test: |mean| sqrt(n) above, of the innovations after the first minute
ORIGIN_DEG = 56.0, 38.0  # of the local sessions


@dataclass(frozen=True)
class StationRun:
    """One run of one case.

    Parameters
    ----------
    found, in_doubt, named, left_out, datum_told : bool
        Any station is in doubt; one that is wrong is; it alone is; it is left out; the right datum is told.
    plain_found : bool
        The plain test of the innovations finds any.
    inside_95 : float
        Whether the true shift is inside the ellipse of its estimate; NaN without a single wrong station in doubt.
    before_m, after_m : float
        RMS error of the smoothed answer that takes the stations as they are, and of the one given.
    nees : float
        Of the latter at the end, mean of the aircraft; 2 is honest.
    protected : float
        Share of aircraft and outputs inside the protection level; NaN where a station is in doubt.
    detectable_m, metres_per_metre : float
        Of the last station: worst direction.
    survey_nees : float
        Of the stations that surveyed themselves, mean; NaN without any.
    """

    found: bool
    in_doubt: bool
    named: bool
    left_out: bool
    datum_told: bool
    plain_found: bool
    inside_95: float
    before_m: float
    after_m: float
    nees: float
    protected: float
    detectable_m: float
    metres_per_metre: float
    survey_nees: float


def run_station_cases(
    cases: Sequence[StationCase], runs: int, seed: int, progress: Progress | None = None, workers: int = WORKERS
) -> dict[str, tuple[StationRun, ...]]:
    """Fly every case ``runs`` times, whatever the number of workers."""
    if workers <= 1 or runs * len(cases) < 8:
        return {case.name: tuple(fly_stations(case, seed, run) for run in range(runs)) for case in cases}
    found: dict[str, tuple[StationRun, ...]] = {}
    with ProcessPoolExecutor(min(workers, os.cpu_count() or 1), mp_context=get_context("spawn")) as pool:
        for case in cases:
            jobs = [case] * runs, [seed] * runs, range(runs)
            found[case.name] = tuple(pool.map(fly_stations, *jobs, chunksize=max(1, runs // (4 * workers))))
            if progress:
                progress(f"{case.name}: {runs} runs")
    return found


def drawn(case: StationCase, seed: int, run: int) -> tuple[SimulatedSession, Session, dict[int, FloatArray]]:
    """Simulate a run: its truth, the session as the file has it, errors of stations."""
    simulated = simulate_session(case.true_scenario(), seed, run)
    session, own = simulated.session, len(simulated.session.points) - len(case.points)
    points, wrong = list(session.points), dict[int, FloatArray]()
    for station, off_m, turn_deg in ((own - 1, case.off_m, 0.0), (0, case.second_off_m, 77.0)):
        if off_m:
            angle = np.deg2rad(GOLDEN_DEG * run + turn_deg)
            wrong[station] = off_m * np.array([np.cos(angle), np.sin(angle)])
    places = [_place_deg(point.position_m) for point in points]
    if case.datum:
        datum = next(one for one in DATUMS if one.name == case.datum)
        wrong = {station: datum.error_m(*place) for station, place in enumerate(places)}
    for station, (point, place) in enumerate(zip(points, places, strict=True)):
        x, y, z = point.position_m
        north, east = wrong.get(station, np.zeros(2)).tolist()
        points[station] = replace(point, position_m=(x + north, y + east, z), place_deg=place)
    ranges = session.ranges
    value, sigma = ranges.pseudorange_m.copy(), ranges.sigma_m
    if case.delay_m:
        wrong[own - 1] = np.zeros(2)
        value += np.where(ranges.source == points[own - 1].name, case.delay_m, 0.0)
    if case.lasting_s:
        sigma = np.full(len(value), case.scenario().link.range_sigma_m)
        value += _lasting(case, session, np.random.default_rng((seed, run, 7)))
    session = replace(session, points=tuple(points), ranges=replace(ranges, pseudorange_m=value, sigma_m=sigma))
    return simulated, session, wrong


def _lasting(case: StationCase, session: Session, rng: np.random.Generator) -> FloatArray:
    """Draw the lasting half of the range errors: a Gauss-Markov process of each link."""
    from scipy.signal import lfilter

    scenario, ranges = case.scenario(), session.ranges
    keep = float(np.exp(-scenario.link.frame_s / case.lasting_s))
    out = np.zeros(len(ranges))
    links = np.char.add(np.char.add(ranges.receiver, "<"), ranges.source)
    for link in np.unique(links).tolist():
        mine = np.flatnonzero(links == link)
        white = rng.standard_normal(len(mine))
        white[1:] *= np.sqrt(1.0 - keep**2)
        out[mine] = np.sqrt(0.5) * scenario.link.range_sigma_m * lfilter([1.0], [1.0, -keep], white)
    return out


def _place_deg(position_m: tuple[float, float, float]) -> tuple[float, float]:
    meridian, _ = curvature_radii_m(ORIGIN_DEG[0])
    latitude = ORIGIN_DEG[0] + float(np.rad2deg(position_m[0] / meridian))
    _, normal = curvature_radii_m(latitude)
    return latitude, ORIGIN_DEG[1] + float(np.rad2deg(position_m[1] / (normal * np.cos(np.deg2rad(latitude)))))


def fly_stations(case: StationCase, seed: int, run: int) -> StationRun:
    """Simulate, judge and answer one run of a case."""
    simulated, session, wrong = drawn(case, seed, run)
    settings = case.settings()
    judgement = judge_stations(session, settings)
    doubted = {doubt.station: doubt for doubt in judgement.doubts}
    before, nees, sizes = _errors(simulated, session, settings)
    after = before
    if judgement.session is not session:
        after, nees, sizes = _errors(simulated, judgement.session, settings)
    levels = [judgement.protection_m(vehicle)[0] for vehicle in range(len(sizes))]
    last = len(session.points) - len(case.points) - 1
    return StationRun(
        found=bool(doubted),
        in_doubt=bool(wrong) and set(wrong) <= set(doubted),
        named=bool(wrong) and set(judgement.named()) == set(wrong) == set(doubted),
        left_out=any(doubted[station].left_out for station in set(wrong) & set(doubted)),
        datum_told=[one.name for one in judgement.datums if one.is_told][:1] == [case.datum],
        plain_found=case.asks_plainly and _plain_found(session, settings),
        inside_95=_inside(judgement, wrong),
        before_m=before,
        after_m=after,
        nees=nees,
        protected=float("nan") if doubted else float(np.mean([s <= p for s, p in zip(sizes, levels, strict=True)])),
        detectable_m=judgement.detectable_m(last)[1],
        metres_per_metre=judgement.metres_per_metre(last)[0],
        survey_nees=_survey_nees(judgement, simulated, wrong),
    )


def _errors(
    simulated: SimulatedSession, session: Session, settings: CooperativeSettings
) -> tuple[float, float, list[float]]:
    """Return RMS error, NEES at the end, and each aircraft's largest error, all smoothed."""
    run = run_smoothed(prepare(session, settings), settings)
    squares, nees, sizes = [], [], []
    for track, truth in zip(run.tracks, simulated.truth, strict=True):
        at = np.searchsorted(truth.time_s, track.time_s - 1e-6)
        error = (track.position_m - truth.position_m[at])[:, :2]
        squares.append((error**2).sum(axis=1))
        nees.append(float(normalised(error[-1:], track.horizontal_m2[-1:])[0]))
        sizes.append(float(np.sqrt(squares[-1].max())))
    return float(np.sqrt(np.mean(squares))), float(np.mean(nees)), sizes


def _inside(judgement: StationJudgement, wrong: dict[int, FloatArray]) -> float:
    """Tell whether the true shift of the wrong station lies inside its 95 % ellipse."""
    tests = [doubt.place for doubt in judgement.doubts if doubt.place is not None and doubt.station in wrong]
    if len(wrong) != 1 or len(tests) != 1 or not wrong[tests[0].station].any():
        return float("nan")
    miss = tests[0].error_m - wrong[tests[0].station]
    return float(miss @ np.linalg.solve(tests[0].covariance_m2, miss) <= 5.991)


def _survey_nees(judgement: StationJudgement, simulated: SimulatedSession, wrong: dict[int, FloatArray]) -> float:
    found = []
    for one in judgement.surveyed:
        name = judgement.session.points[one.point].name
        true = np.array(simulated.point_errors_m[name][:2]) + wrong.get(one.point, np.zeros(2))
        miss = one.error_m - true
        found.append(float(miss @ np.linalg.solve(one.covariance_m2, miss)))
    return float(np.mean(found)) if found else float("nan")


def _plain_found(session: Session, settings: CooperativeSettings) -> bool:
    """Ask the plain test: mean innovations of each link of a station."""
    prepared = prepare(session, settings)
    judged, events = run_algorithm(prepared, settings, "centralised").judged, prepared.events
    late = (events.time_s[judged.event] > AFTER_S) & (events.kind[judged.event] == POINT)
    link = events.receiver[judged.event] * len(session.points) + events.source[judged.event]
    for one in np.unique(link[late]).tolist():
        normal = (judged.innovation / judged.sigma)[late & (link == one)]
        if abs(float(normal.mean())) * np.sqrt(len(normal)) > MEANS:
            return True
    return False
