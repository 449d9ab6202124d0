"""Study of the heading verdict on the family crew of docs/evidence/heading.md.

Acceptance, coverage, both numbers.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.results.figures import FigureData
from groundstation.simulation.processes import damped_oscillation
from groundstation.simulation.taxi import TaxiCase, TaxiRun, draw_case, simulate_taxi, taxi_flight
from groundstation.simulation.taxi_disturbance import Disturbance, metar_line
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.steady import FACTORS
from groundstation.systems.known import AircraftClass, AircraftData
from groundstation.systems.study import RunStore, StudyResult, section, table
from groundstation.tables.phases import flight_phases

FloatArray = NDArray[np.float64]
Kind = Literal[
    "one way, METAR",
    "one way, no wind",
    "one way, class alone",
    "back-taxi, no wind",
    "tall antenna",
    "held velocity",
    "skidding",
    "one engine",
    "spoofed",
    "1 Hz",
    "one engine, stated",
]
ALL_KINDS: tuple[Kind, ...] = get_args(Kind)
KINDS = ALL_KINDS[:10]  # in turn; the last is the one engine again, stated in the aircraft file
CLASSES: tuple[AircraftClass, ...] = ("light", "jet trainer", "business jet", "airliner")
ONE_ENGINE: tuple[Kind, ...] = ("one engine", "one engine, stated")
BACK: tuple[Kind, ...] = ("back-taxi, no wind", "held velocity", *ONE_ENGINE)
NOTHING_STATED: tuple[Kind, ...] = ("one way, no wind", "back-taxi, no wind")
LIMIT_ARCMIN, NARROW_ARCMIN = 20.0, 15.0
MOVING_MPS = 6.0


@dataclass(frozen=True)
class CrewOutcome:
    """One run of the crew: verdict and errors, estimate minus truth, in arcmin.

    ``is_inside``: the 95 % interval holds the truth.
    """

    kind: Kind
    verdict: str
    error_arcmin: float
    half_width_arcmin: float
    is_inside: bool
    is_platform_inside: bool
    passes_standstill: bool
    failed: tuple[str, ...]


def run_crew(seed: int, number: int, kind: Kind | None = None) -> CrewOutcome:
    """Draw run ``number`` of a seed, estimate, and compare both numbers with the truth.

    ``kind``: that of its turn where none is given.
    """
    rng, kind = np.random.default_rng((seed, number)), kind or KINDS[number % len(KINDS)]
    wind_mps = rng.normal(0.0, 3.6, 2)  # velocity of the air, north and east
    flown: AircraftClass = CLASSES[int(rng.integers(len(CLASSES)))]
    factor = FACTORS[flown][0] * float(rng.normal(1.0, 0.5))
    mounting_deg = float(rng.normal(0.0, HeadingSettings().mounting_sigma_deg))
    same_deg = float(rng.normal(0.0, 0.05))
    if kind in ONE_ENGINE:
        same_deg = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.15, 0.4))
    case = _case(rng, kind)
    first_rad = np.deg2rad(case.first_track_deg)
    crab_deg = -factor * float(wind_mps[1] * np.cos(first_rad) - wind_mps[0] * np.sin(first_rad))
    every_s = 1.0 if kind == "1 Hz" else 0.0
    crab = Disturbance(crab_deg=crab_deg, is_crab_of_wind=True, gnss_every_s=every_s)
    run = _changed(simulate_taxi(replace(case, disturbance=crab), rng), kind, rng, same_deg, mounting_deg)
    stated = AircraftData(antenna_arm_m=case.antenna_arm_m)
    lines: tuple[str, ...] = ()
    if kind not in NOTHING_STATED:
        stated = replace(stated, aircraft_class=flown, taxi_power="uneven" if kind == "one engine, stated" else "")
        lines = () if kind == "one way, class alone" else (metar_line(wind_mps + rng.normal(0.0, 1.5, 2)),)
    flight = taxi_flight(run)
    found = estimate_heading_error(flight, aircraft=stated, phases=flight_phases(flight), weather=lines)
    platform_deg = run.error_at(found.reference_time_s or 0.0)
    truth_deg = platform_deg + mounting_deg
    ends, platform_ends = found.confidence95_deg, found.platform_confidence95_deg or (np.nan, np.nan)
    standstill = next(gate for gate in found.gates if gate.name == "standstill_speed_of_mean")
    return CrewOutcome(
        kind,
        found.verdict,
        float(wrap_180(found.error_deg - truth_deg)) * ARCMIN_PER_DEG,
        0.5 * (ends[1] - ends[0]) * ARCMIN_PER_DEG,
        _holds(ends, truth_deg),
        _holds(platform_ends, platform_deg),
        standstill.state == "passed",
        tuple(gate.name for gate in found.gates if gate.required and gate.state != "passed"),
    )


def _holds(ends_deg: tuple[float, float], truth_deg: float) -> bool:
    middle = 0.5 * (ends_deg[0] + ends_deg[1])
    return abs(float(wrap_180(truth_deg - middle))) <= 0.5 * (ends_deg[1] - ends_deg[0])


def _case(rng: np.random.Generator, kind: Kind) -> TaxiCase:
    case = draw_case(rng, "continuous")
    seconds = float(rng.uniform(60.0, 130.0 if kind == "1 Hz" else 120.0))
    is_back = kind in BACK
    return replace(
        case,
        segments_s=(0.5 * seconds, 0.5 * seconds) if is_back else (seconds,),
        turns_deg=(180.0 * float(rng.choice([-1.0, 1.0])),) if is_back else (),
        curve_dps=0.0,
        correlated_mps=float(rng.uniform(0.003, 0.015)),
        white_mps=float(rng.uniform(0.01, 0.04)),
        is_arm_known=True,
    )


def _changed(run: TaxiRun, kind: Kind, rng: np.random.Generator, same_deg: float, mounting_deg: float) -> TaxiRun:
    """Return the run with the disturbances of its kind.

    Sideslip, mounting, antenna height, a receiver that holds or is led astray.
    """
    time_s, gnss_s = run.ins_time_s, run.gnss_time_s
    north, east = run.velocity_north_mps.copy(), run.velocity_east_mps.copy()
    speed = np.hypot(north, east)
    fast_s = gnss_s[speed > MOVING_MPS]
    moving = np.clip(np.interp(time_s, gnss_s, speed) / 3.0, 0.0, 1.0)
    added = same_deg * moving
    if kind == "skidding":
        start_s = float(rng.uniform(fast_s[0], max(fast_s[-1] - 20.0, fast_s[0] + 1.0)))
        skid = (time_s > start_s) & (time_s < start_s + rng.uniform(10.0, 20.0))
        added = added + float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2.0)) * skid
    if kind == "tall antenna":
        step_s = float(gnss_s[1] - gnss_s[0])
        roll = damped_oscillation(rng, (len(gnss_s),), step_s, float(rng.uniform(0.2, 0.6)), run.case.sway_hz, 0.1)
        swing = float(rng.uniform(3.0, 6.0)) * np.gradient(np.deg2rad(roll), step_s) * np.clip(speed / 3.0, 0.0, 1.0)
        track = np.arctan2(east, north)
        north, east = north - swing * np.sin(track), east + swing * np.cos(track)
    if kind == "spoofed":
        at_s = fast_s[0] + float(rng.uniform(0.3, 0.6)) * (fast_s[-1] - fast_s[0])
        turned = np.deg2rad(float(rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 3.0)))
        angle = turned * np.clip((gnss_s - at_s) / 10.0, 0.0, 1.0)
        north, east = north * np.cos(angle) - east * np.sin(angle), north * np.sin(angle) + east * np.cos(angle)
    if kind == "held velocity":
        start = int(np.flatnonzero((gnss_s > fast_s[0]) & (speed < MOVING_MPS))[0])
        held = (gnss_s >= gnss_s[start]) & (gnss_s < gnss_s[start] + 30.0 + rng.uniform(20.0, 40.0))
        noise = 0.002 * rng.standard_normal((2, len(gnss_s)))
        north = np.where(held, 1.1 * north[start] + noise[0], north)
        east = np.where(held, 1.1 * east[start] + noise[1], east)
    heading = run.heading_deg + added
    return replace(
        run,
        heading_deg=heading % 360.0,
        ins_heading_deg=(run.ins_heading_deg + added + mounting_deg) % 360.0,
        velocity_north_mps=north,
        velocity_east_mps=east,
    )


def study_crew(
    runs: int = 200,
    seed: int = 71,
    progress: Callable[[str], None] | None = None,
    *,
    kept: RunStore[CrewOutcome] | None = None,
    minutes: float | None = None,
) -> StudyResult:
    """Run the estimator over the third family of docs/evidence/heading.md.

    So many runs of each kind, by turns.

    Parameters
    ----------
    runs : int
        Runs of each kind; 400 give a coverage to 1.1 %.
    seed : int
    progress : callable, optional
        Called with one line for each run.
    kept : RunStore, optional
        Runs of an earlier call: these are not made again.
    minutes : float, optional
        Time after which no further run is begun; the page is then that of the runs made so far.
    """
    end_s = np.inf if minutes is None else time.monotonic() + 60.0 * minutes
    outcomes: list[CrewOutcome] = []
    for turn in range(runs):
        if turn > 0 and time.monotonic() > end_s:
            break
        for place, kind in enumerate(ALL_KINDS):
            number = turn * len(KINDS) + (place if kind in KINDS else KINDS.index("one engine"))
            name = f"crew-{kind}-{seed}"
            outcome = kept.get(name, number) if kept else None
            if outcome is None:
                outcome = run_crew(seed, number, kind)
                if kept:
                    kept.put(name, number, outcome)
                if progress:
                    progress(f"{kind}, run {number}: error {outcome.error_arcmin:+.1f} arcmin, {outcome.verdict}")
            outcomes.append(outcome)
    found = crew_table(outcomes), gates_table(outcomes)
    text = (
        f"{len(outcomes)} runs of family crew of docs/evidence/heading.md (seed {seed}), each through tables and "
        "estimator. Coverage is the share of runs whose 95 % interval holds the truth: of all, of those that are "
        "accepted or advised (told), and of those whose half width is 15 arcmin or more (wide)."
    )
    page = (
        section("Study: a heading verdict a crew can use", text),
        section("Verdicts, coverage and errors by kind", table(found[0])),
        section("Share of runs that fail each required gate", table(found[1])),
    )
    return StudyResult("crew", found, page)


def gates_table(outcomes: Sequence[CrewOutcome]) -> FigureData:
    """Tabulate the share of runs that fail each required gate, by kind.

    Only runs that pass the standstill and gates that any run fails count.
    """
    still = [one for one in outcomes if one.passes_standstill]
    names = sorted({name for one in still for name in one.failed})
    kinds = [kind for kind in ALL_KINDS if any(one.kind == kind for one in still)]
    columns: dict[str, NDArray[np.generic]] = {"kind": np.array(kinds)}
    for name in names:
        mine = ([name in one.failed for one in still if one.kind == kind] for kind in kinds)
        columns[name] = np.array([float(np.mean(failed)) for failed in mine])
    return FigureData("heading_crew_gates", columns, dict.fromkeys(names, 3))


def crew_table(outcomes: Sequence[CrewOutcome]) -> FigureData:
    """Tabulate one row per kind of run.

    Verdicts, share that passes the standstill, coverage of both numbers, errors accepted.
    """
    rows = []
    for kind in ALL_KINDS:
        mine = [one for one in outcomes if one.kind == kind]
        if not mine:
            continue
        still = [one for one in mine if one.passes_standstill]
        accepted = [one for one in mine if one.verdict == "accept"]
        told = [one for one in mine if one.verdict in ("accept", "advisory")]
        rows.append(
            (
                *(kind, len(mine), _share(mine, "passes_standstill"), len(accepted) / len(mine)),
                sum(one.verdict == "accept" for one in still) / max(len(still), 1),
                sum(one.verdict == "advisory" for one in mine) / len(mine),
                sum(one.verdict == "reject" for one in mine) / len(mine),
                *(_share(mine, "is_inside"), _share(told, "is_inside"), _share(mine, "is_platform_inside")),
                _share([one for one in mine if one.half_width_arcmin >= NARROW_ARCMIN], "is_inside"),
                float(np.median([one.half_width_arcmin for one in mine])),
                float(np.mean([abs(one.error_arcmin) > LIMIT_ARCMIN for one in accepted])) if accepted else 0.0,
                max((abs(one.error_arcmin) for one in accepted), default=0.0),
            )
        )
    names: tuple[str, ...] = (
        "kind",
        "runs",
        "standstill_passes",
        "accepted",
        "accepted_of_those",
        "advisory",
        "rejected",
        "coverage",
    )
    names += ("coverage_told", "platform_coverage", "coverage_wide")  # wide: 15 arcmin and more
    names += ("half_width_arcmin", "accepted_beyond_limit", "accepted_max_arcmin")
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData("heading_crew", columns, dict.fromkeys(names[2:], 3))


def _share(outcomes: Sequence[CrewOutcome], name: str) -> float:
    return float(np.mean([getattr(one, name) for one in outcomes])) if outcomes else float("nan")
