"""Monte Carlo study of the glide path as a reference along the course.

Does the 95 % interval of the error along the course hold the truth, with a runway of the table? The family was written
down before it was run: approaches of the plain family of ``study approach``, with a runway of the table whose threshold
lies off as its sigmas say; the antenna 3 +- 2 m above the wheels; the path 15 +- 1.5 m over the threshold and 3 +- 0.05
deg steep; heights scaled by 1 +- 0.03; a runway that rises by 0 +- 0.25 %, as the table has it to 0.1 %. The other
families each break one assumption.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.runways.table import END_SIGMA_M, SHIFT_SIGMA_M, THRESHOLD_SIGMA_M, RunwayTable
from groundstation.results.landing_categories import LINEAR_95
from groundstation.simulation.approach import ApproachScenario, simulate_approach
from groundstation.systems.known import Known
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import AlongError, Approach
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.landing.study import drawn
from groundstation.systems.study import StudyResult, judged_families, section, share_inside, table, table_of
from groundstation.tables.phases import flight_phases

Progress = Callable[[str], None]
ASSUMED = LandingSettings()
WIDTH_M = 45.0


@dataclass(frozen=True, kw_only=True)
class AlongFamily:
    """Family of approaches, by the amounts added to the plain one.

    Parameters
    ----------
    threshold_m : float
        The true threshold lies so far before that of the table.
    antenna_m, glide_deg, scale, rise : float
        Added to height of the antenna, angle of the path, scale of the height, rise of the runway.
    """

    name: str
    what: str
    threshold_m: float = 0.0
    antenna_m: float = 0.0
    glide_deg: float = 0.0
    scale: float = 0.0
    rise: float = 0.0


ALONG_FAMILIES: tuple[AlongFamily, ...] = (
    AlongFamily(name="plain", what="as assumed"),
    AlongFamily(name="moved", what="threshold moved by 300 m since the table was made", threshold_m=300.0),
    AlongFamily(name="antenna", what="antenna of the glide slope 5 m higher", antenna_m=5.0),
    AlongFamily(name="steep", what="path of 3.5 deg, taken for 3", glide_deg=0.5),
    AlongFamily(name="cold", what="heights shown 12 % too large, as in cold air", scale=0.12),
    AlongFamily(name="rising", what="runway that rises by 1 %, level in the table", rise=0.01),
)
DIGITS = {
    "measured": 0,
    "coverage": 3,
    "coverage_sigma": 3,
    "rms_of_error_over_sigma": 2,
    "median_half_width_m": 0,
    "median_abs_error_m": 0,
    "across_coverage": 3,
}


def study_along(
    runs: int = 100,
    seed: int = 0,
    progress: Progress | None = None,
    *,
    families: tuple[AlongFamily, ...] = ALONG_FAMILIES,
) -> StudyResult:
    """Fly every family with a runway of the table, and judge the errors along the course.

    Parameters
    ----------
    runs : int
        Approaches of each family.
    seed : int
        Run k of every family has the seed (seed, k).
    progress : callable, optional
        Called with one line for each family.
    families : tuple of AlongFamily
    """
    rows = judged_families(
        families,
        lambda one: _judged(one, runs, seed),
        progress,
        lambda row: f"{row['measured']:.0f} of {runs} measured",
    )
    data = table_of("along_coverage", rows, DIGITS)
    head = section(
        "Study: the glide path as a reference along the course",
        f"{runs} approaches of each family (seed {seed}), each through phases and analysis, with a runway of the "
        "table. Coverage: share of runs whose 95 % interval holds the truth.",
        table(data),
        *(f"{family.name}: {family.what}" for family in families),
    )
    return StudyResult("along", (data,), (head,))


def flown(family: AlongFamily, rng: np.random.Generator) -> tuple[ApproachScenario, RunwayTable]:
    """Return an approach of a family, and the table in which its runway stands."""
    plain = drawn(rng)
    rise = float(rng.normal(0.0, 0.0025))
    runway = replace(
        plain.runway,
        threshold_crossing_height_m=float(np.clip(rng.normal(15.0, 1.5), 10.0, 20.0)),
        glide_angle_deg=float(rng.normal(3.0, 0.05)) + family.glide_deg,
    )
    recorded = replace(
        plain.recorded,
        antenna_m=float(rng.normal(3.0, 2.0)) + family.antenna_m,
        height_scale=float(rng.normal(1.0, 0.03)) + family.scale,
        runway_rise=rise + family.rise,
    )
    along_m = float(rng.normal(0.0, np.hypot(THRESHOLD_SIGMA_M, np.hypot(SHIFT_SIGMA_M, END_SIGMA_M))))
    across_m = float(rng.normal(0.0, np.hypot(SHIFT_SIGMA_M, END_SIGMA_M)))
    listed = _table(plain, along_m + family.threshold_m, across_m, rise + float(rng.normal(0.0, 0.001)))
    return replace(plain, runway=runway, recorded=recorded), listed


def _table(scenario: ApproachScenario, along_m: float, across_m: float, rise: float) -> RunwayTable:
    """Return a table of one runway, off by so much along and across."""
    runway = scenario.runway
    course = np.deg2rad(runway.true_course_deg)
    ends = [
        latitude_longitude_deg(
            along * np.cos(course) - across_m * np.sin(course),
            along * np.sin(course) + across_m * np.cos(course),
            runway.latitude_deg,
            runway.longitude_deg,
        )
        for along in (along_m, along_m + runway.length_m)
    ]
    places = np.array(ends, dtype=np.float64)
    return RunwayTable(
        source="simulated",
        licence="",
        dated="2026-01-01",
        digest="0" * 64,
        rows=1,
        left_out={},
        airport=np.array(["SIM"]),
        surface=np.array(["ASP"]),
        name=np.array([["01"], ["19"]]),
        latitude_deg=places[:, :1],
        longitude_deg=places[:, 1:],
        elevation_m=np.array([[runway.elevation_m], [runway.elevation_m + rise * runway.length_m]]),
        displaced_m=np.zeros((2, 1)),
        length_m=np.array([runway.length_m]),
        width_m=np.array([WIDTH_M]),
        is_closed=np.array([False]),
    )


def measured_along(scenario: ApproachScenario, listed: RunwayTable) -> tuple[Approach, AlongError] | None:
    """Return an approach and the error along its course; None where it is not measured."""
    flight = simulate_approach(scenario).flight
    try:
        answer = LANDING.run(flight, Known(flight_phases(flight), find_runways=lambda: (listed, "")), ASSUMED).answer
    except NotAssessableError:
        return None
    found = [(one, error) for one in answer.approaches for error in one.along_errors if error.state == "measured"]
    return found[-1] if found else None


def _judged(family: AlongFamily, runs: int, seed: int) -> dict[str, object]:
    errors, halves, scaled, across = (list[float]() for _ in range(4))
    for run in range(runs):
        scenario, listed = flown(family, np.random.default_rng((seed, run)))
        found = measured_along(scenario, listed)
        if found is None or found[1].error_m is None or found[1].sigma_m is None:
            continue
        one, sigma_m = found[0], found[1].sigma_m
        errors.append(found[1].error_m - scenario.recorded.along_m)
        halves.append(LINEAR_95 * sigma_m)
        scaled.append(errors[-1] / sigma_m)
        beside = one.position_errors[-1]
        if beside.error_m is not None and beside.sigma_m is not None:
            across.append((beside.error_m - scenario.recorded.across_m) / beside.sigma_m)
    share = share_inside(scaled, LINEAR_95)
    return {
        "family": family.name,
        "measured": float(len(errors)),
        "coverage": share,
        "coverage_sigma": float(np.sqrt(share * (1.0 - share) / max(len(errors), 1))),
        "rms_of_error_over_sigma": float(np.sqrt(np.mean(np.square(scaled)))) if scaled else np.nan,
        "median_half_width_m": float(np.median(halves)) if halves else np.nan,
        "median_abs_error_m": float(np.median(np.abs(errors))) if errors else np.nan,
        "across_coverage": share_inside(across, LINEAR_95),
    }
