"""Monte Carlo study of the localizer as a reference for position errors.

Does the 95 % interval of the error of positions hold the truth? The family is that of docs/evidence/approaches.md,
written down before it was run: finals on any course anywhere, INS errors of some hundred metres, positions in steps of
153 m, an ILS of category I within its tolerances. The other families each break one assumption.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import METRES_PER_DEG
from groundstation.chapters.parts import Section
from groundstation.methods.intervals import share_interval
from groundstation.results.figures import FigureData
from groundstation.results.landing_categories import LINEAR_95
from groundstation.simulation.approach import (
    ApproachScenario,
    FinalMotion,
    Recorded,
    SimulatedApproach,
    TrueRunway,
    simulate_approach,
)
from groundstation.systems.known import Known, Runway, SiteData
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import PositionError
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.study import StudyResult, judged_families, section, share_inside, table, table_of
from groundstation.tables.phases import flight_phases

Progress = Callable[[str], None]
ASSUMED = LandingSettings()


@dataclass(frozen=True)
class ApproachFamily:
    """Family of approaches: its change to those of the plain family, and its settings."""

    name: str
    what: str
    change: Callable[[ApproachScenario, np.random.Generator], ApproachScenario]
    settings: LandingSettings = ASSUMED


def _recorded(scenario: ApproachScenario, **changes: object) -> ApproachScenario:
    return replace(scenario, recorded=replace(scenario.recorded, **changes))  # type: ignore[arg-type]


def _flown(scenario: ApproachScenario, **changes: object) -> ApproachScenario:
    return replace(scenario, flown=replace(scenario.flown, **changes))  # type: ignore[arg-type]


FAMILIES: tuple[ApproachFamily, ...] = (
    ApproachFamily("plain", "as assumed; positions rounded or cut off, nobody says which", lambda one, rng: one),
    ApproachFamily(
        "rounded",
        "as assumed; positions rounded, and the settings say so",
        lambda one, rng: _recorded(one, rounding="nearest"),
        replace(ASSUMED, positions_rounded="nearest"),
    ),
    ApproachFamily(
        "bends",
        "rounded; bends of the course line three times category I, each 3 km long",
        lambda one, rng: _recorded(one, rounding="nearest", bend_ddm=0.045, bend_length_m=3_000.0),
        replace(ASSUMED, positions_rounded="nearest"),
    ),
    ApproachFamily(
        "line",
        "rounded; course line 30 m off at the threshold",
        lambda one, rng: _recorded(one, rounding="nearest", course_line_m=30.0),
        replace(ASSUMED, positions_rounded="nearest"),
    ),
    ApproachFamily(
        "width",
        "rounded; course sector two thirds as wide as the site file says",
        lambda one, rng: _recorded(one, rounding="nearest", width_error=0.5),
        replace(ASSUMED, positions_rounded="nearest"),
    ),
    ApproachFamily(
        "crab",
        "rounded; nose 10 deg off the track",
        lambda one, rng: _flown(_recorded(one, rounding="nearest"), crab_deg=10.0),
        replace(ASSUMED, positions_rounded="nearest"),
    ),
    ApproachFamily(
        "beside",
        "rounded; touchdown and roll-out 15 m beside the centre line",
        lambda one, rng: _flown(_recorded(one, rounding="nearest"), rollout_across_m=15.0),
        replace(ASSUMED, positions_rounded="nearest"),
    ),
)


def study_approach(
    runs: int = 100, seed: int = 0, progress: Progress | None = None, *, families: tuple[ApproachFamily, ...] = FAMILIES
) -> StudyResult:
    """Fly every family and judge intervals against the truth.

    Parameters
    ----------
    runs : int
        Approaches of each family; 1000 give the coverage to 0.7 %.
    seed : int
        Run k of every family has the seed (seed, k): families differ by what they change alone.
    progress : callable, optional
        Called with one line for each family.
    families : tuple of ApproachFamily
    """
    rows = judged_families(
        families,
        lambda one: _judged(one, runs, seed),
        progress,
        lambda row: f"{row['measured']:.0f} of {runs} measured",
    )
    table = table_of("approach_coverage", rows, DIGITS)
    return StudyResult("approach", (table,), _page(table, families, runs, seed))


DIGITS = {
    "measured": 0,
    "coverage": 3,
    "coverage_low": 3,
    "coverage_high": 3,
    "rms_of_error_over_sigma": 2,
    "median_half_width_m": 1,
    "median_abs_error_m": 1,
    "rate_coverage": 3,
    "roll_out_coverage": 3,
    "change_coverage": 3,
}


def drawn(rng: np.random.Generator) -> ApproachScenario:
    """Return a member of the plain family."""
    runway = TrueRunway(float(rng.uniform(-60, 60)), float(rng.uniform(-179, 179)), float(rng.uniform(0, 360)))
    flown = FinalMotion(
        start_distance_m=float(rng.uniform(12_000.0, 26_000.0)),
        start_across_m=float(rng.normal(0.0, 1_000.0)),
        speed_mps=float(rng.uniform(60.0, 80.0)),
        rollout_across_m=float(rng.normal(0.0, 3.0)),
    )
    recorded = Recorded(
        across_m=float(rng.normal(0.0, 500.0)),
        along_m=float(rng.normal(0.0, 500.0)),
        across_rate_mps=float(rng.normal(0.0, 0.5)),
        across_curvature_mps2=float(rng.normal(0.0, 5e-4)),
        rounding="nearest" if rng.random() < 0.5 else "down",
        course_line_m=float(rng.normal(0.0, ASSUMED.course_line_m / LINEAR_95)),
        bend_ddm=ASSUMED.bend_ddm,
        width_error=float(rng.normal(0.0, ASSUMED.width_share / LINEAR_95)),
    )
    return ApproachScenario(runway, seed=int(rng.integers(1 << 30)), flown=flown, recorded=recorded)


def site_of(scenario: ApproachScenario, rng: np.random.Generator) -> SiteData:
    """Return the runway as a site file states it.

    Bearing to 0.05 deg, threshold to 1 m, the nominal width.
    """
    runway = scenario.runway
    north_m, east_m = rng.normal(0.0, 1.0, 2)
    told = Runway(
        "X",
        float((runway.true_course_deg + rng.normal(0.0, 0.05)) % 360.0),
        0.05,
        runway.latitude_deg + north_m / METRES_PER_DEG,
        runway.longitude_deg + east_m / (METRES_PER_DEG * np.cos(np.deg2rad(runway.latitude_deg))),
        length_m=runway.length_m,
        localizer_width_m=runway.localizer_width_m,
    )
    return SiteData(runways=(told,))


def measured(scenario: ApproachScenario, site: SiteData, settings: LandingSettings) -> PositionError | None:
    """Return the error of the positions of an approach, None where it is not measured."""
    simulated: SimulatedApproach = simulate_approach(scenario)
    known = Known(flight_phases(simulated.flight), site=site)
    try:
        answer = LANDING.run(simulated.flight, known, settings).answer
    except NotAssessableError:
        return None
    found = [error for one in answer.approaches for error in one.position_errors if error.state == "measured"]
    return found[-1] if found else None


def _judged(family: ApproachFamily, runs: int, seed: int) -> dict[str, object]:
    errors, halves, scaled, rates, rolled, changes = (list[float]() for _ in range(6))
    for run in range(runs):
        rng = np.random.default_rng((seed, run))
        plain = drawn(rng)
        scenario, site = family.change(plain, rng), site_of(plain, rng)
        found = measured(scenario, site, family.settings)
        if found is None or found.error_m is None or found.sigma_m is None:
            continue
        truth = scenario.recorded
        errors.append(found.error_m - truth.across_m)
        halves.append(LINEAR_95 * found.sigma_m)
        scaled.append(errors[-1] / found.sigma_m)
        rates.append(((found.rate_mps or 0.0) - truth.across_rate_mps) / (found.rate_sigma_mps or np.nan))
        if found.rollout_error_m is not None and found.rollout_sigma_m is not None:
            since_s = ROLL_OUT_AFTER_S
            there = truth.across_m + truth.across_rate_mps * since_s + 0.5 * truth.across_curvature_mps2 * since_s**2
            rolled.append((found.rollout_error_m - there) / found.rollout_sigma_m)
        if found.change_m is not None and found.change_sigma_m is not None:
            changes.append(found.change_m / found.change_sigma_m)
    share = share_inside(scaled, LINEAR_95)
    held = int(np.sum(np.abs(scaled) <= LINEAR_95)) if scaled else 0
    low, high = share_interval(held, len(scaled)) if scaled else (np.nan, np.nan)
    return {
        "family": family.name,
        "measured": float(len(errors)),
        "coverage": share,
        "coverage_low": low,
        "coverage_high": high,
        "rms_of_error_over_sigma": float(np.sqrt(np.mean(np.square(scaled)))) if scaled else np.nan,
        "median_half_width_m": float(np.median(halves)) if halves else np.nan,
        "median_abs_error_m": float(np.median(np.abs(errors))) if errors else np.nan,
        "rate_coverage": share_inside(rates, LINEAR_95),
        "roll_out_coverage": share_inside(rolled, LINEAR_95),
        "change_coverage": share_inside(changes, LINEAR_95),
    }


ROLL_OUT_AFTER_S = 25.0  # the middle of the roll-out after the threshold: what it differs by is below its sigma


def _page(data: FigureData, families: tuple[ApproachFamily, ...], runs: int, seed: int) -> tuple[Section, ...]:
    head = section(
        "Study: the localizer as a reference for recorded positions",
        f"{runs} approaches of each family of docs/evidence/approaches.md (seed {seed}), each through phases and "
        "analysis, with the runway in a site file. Coverage: share of runs whose 95 % interval holds the truth.",
        table(data),
        *(f"{family.name}: {family.what}" for family in families),
    )
    return (head,)
