"""Family of sessions for the pairwise filter: its check without truth beside the truth.

Sessions differ in density and form of the net. Aircraft stand at random in a square of 80 km and fly north for 500 s;
errors are those of the local sessions. The family was written down before it was flown. Its last rows break what the
check rests on, the stated sigmas.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from typing import Literal

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.chapters.parts import Section
from groundstation.methods.intervals import nees_limits
from groundstation.results.figures import FigureData
from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import SessionAircraft, SessionScenario, load_session
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.consistency import normalised
from groundstation.systems.cooperative.events import prepare
from groundstation.systems.cooperative.expected_honesty import expected_nees
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.study.cases import CASES, settings_of
from groundstation.systems.study import section, table

BASE = "local-three-two-points"
SIDE_M = 80_000.0
HONEST_SHARE = 0.99  # of honest rows inside the limits: some thirty are judged at once
MOST_RUNS = 40
GIVE_UP = 1e3  # NEES above which nothing more is learned


@dataclass(frozen=True)
class Net:
    """One session of the family.

    Parameters
    ----------
    aircraft, points : int
    frame_s : float
        Each pair exchanges a range each way once in it.
    form : {'all', 'chain'}
        Every aircraft hears all others, or the two beside it alone.
    broken : str
        What the filter is not told: ``velocity`` of the INS thrice its sigma, ``bias`` of 30 m in each receiver,
        ``outliers`` in 5 % of the ranges.
    """

    aircraft: int
    points: int
    frame_s: float
    form: Literal["all", "chain"] = "all"
    broken: str = ""


FAMILY: tuple[Net, ...] = (
    *(Net(k, points, frame_s) for k in (3, 5) for points in (0, 1, 2) for frame_s in (10.0, 60.0, 250.0)),
    *(Net(10, points, frame_s) for points in (0, 2) for frame_s in (60.0, 250.0)),
    *(Net(3, 2, 1.0), Net(10, 2, 10.0)),
    *(Net(k, points, frame_s, "chain") for k in (3, 5) for points in (0, 2) for frame_s in (10.0, 60.0)),
    *(Net(3, 0, 60.0, broken=broken) for broken in ("velocity", "bias", "outliers")),
)


def scenario_of(net: Net) -> SessionScenario:
    """Return the session of a net, as the filter believes it."""
    base = load_session(BASE)
    rng = np.random.default_rng(net.aircraft)
    places = rng.uniform(-0.5 * SIDE_M, 0.5 * SIDE_M, (net.aircraft, 2)).tolist()
    names = [chr(ord("A") + number) for number in range(net.aircraft)]
    points = base.points[: net.points]
    aircraft = []
    for number, (name, (north_m, east_m)) in enumerate(zip(names, places, strict=True)):
        beside = names[max(number - 1, 0) : number] + names[number + 1 : number + 2]
        hears = (*beside, *(point.name for point in points)) if net.form == "chain" else ()
        aircraft.append(SessionAircraft(name, north_m, east_m, hears=hears))
    link = replace(base.link, frame_s=net.frame_s, slot_s=0.05)
    return replace(base, aircraft=tuple(aircraft), points=points, link=link)


def _as_flown(scenario: SessionScenario, broken: str) -> SessionScenario:
    if broken == "velocity":
        return replace(scenario, errors=replace(scenario.errors, velocity_mps=3.0 * scenario.errors.velocity_mps))
    if broken == "bias":
        return replace(scenario, link=replace(scenario.link, bias_m=30.0))
    if broken == "outliers":
        return replace(scenario, link=replace(scenario.link, outlier_share=0.05))
    return scenario


def _settings(scenario: SessionScenario) -> CooperativeSettings:
    return replace(settings_of(scenario, CASES[0]), map_window_s=0.0)


def fly(net: Net, seed: int, run: int) -> tuple[float, float, float]:
    """Return NEES to expect, mean and worst over time, and that of one run.

    All are means over the aircraft. The first two are worked out for the first run alone, NaN in the others.
    """
    scenario = scenario_of(net)
    settings = _settings(scenario)
    simulated = simulate_session(_as_flown(scenario, net.broken), seed, run)
    prepared = prepare(simulated.session, settings)
    mean = worst = float("nan")
    if run == 0:
        expected = expected_nees(prepared, settings, (), GIVE_UP)
        mean, worst = float(expected.nees.mean()), expected.worst
    done = run_algorithm(prepared, settings, "pairwise")
    found = []
    for track, truth in zip(done.tracks, simulated.truth, strict=True):
        at = np.searchsorted(truth.time_s, track.time_s - 1e-6)
        found.append(normalised(track.state[:, :2] - truth.states[at, :2], track.horizontal_m2).mean())
    return mean, worst, float(np.mean(found))


def pairwise_table(nets: Sequence[Net], runs: int, seed: int, workers: int) -> FigureData:
    """Fly every net and tabulate what was to be expected beside what came."""
    runs = min(runs, MOST_RUNS)
    jobs = [(net, seed, run) for net in nets for run in range(runs)]
    if workers <= 1 or len(jobs) < 8:
        flown = [fly(*job) for job in jobs]
    else:
        with ProcessPoolExecutor(min(workers, os.cpu_count() or 1), mp_context=get_context("spawn")) as pool:
            flown = list(pool.map(fly, *zip(*jobs, strict=True), chunksize=max(1, runs // 4)))
    limit, (low, high) = CooperativeSettings().pairwise_nees_limit, nees_limits(2, runs, HONEST_SHARE)
    rows = []
    for at, net in enumerate(nets):
        own = flown[at * runs : (at + 1) * runs]
        mean, worst, real = own[0][0], own[0][1], float(np.mean([one[2] for one in own]))
        is_refused, is_honest = worst > limit, low <= real <= high
        rows.append(
            (
                *(net.aircraft, net.points, 60.0 / net.frame_s, net.form, net.broken, mean, worst),
                *("refused" if is_refused else "runs", real, low, high, "yes" if is_honest else "no"),
                "yes" if is_refused or is_honest else "no",
            )
        )
    names = (
        *("aircraft", "points", "ranges_per_minute_each_way", "net", "not_told", "expected_nees", "expected_worst"),
        *("verdict", "measured_nees", "nees_low", "nees_high", "consistent", "refused_or_consistent"),
    )
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData("cooperative_pairwise", columns, {"ranges_per_minute_each_way": 2})


def pairwise_section(data: FigureData, runs: int) -> Section:
    """Return the table on a page, with what it shows."""
    told = data["not_told"] == ""
    held = int((data["refused_or_consistent"][told] == "yes").sum())
    return section(
        "Stored pairwise covariances: encounters without loops",
        f"{min(runs, MOST_RUNS)} sessions a row. Expected: NEES worked out before any truth is looked at, by geometry "
        "and stated sigmas (mean over the session, and its worst time, by which the algorithm is refused). Measured: "
        f"mean over aircraft, session and runs, with 99 % limits of that many runs. {held} of {int(told.sum())} rows "
        "with the stated sigmas are refused or consistent. The last rows break the sigmas that the check rests on, "
        "which no check of geometry can see.",
        table(data),
    )
