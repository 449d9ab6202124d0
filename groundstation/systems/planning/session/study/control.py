"""Study of optimal control of a session and of placement.

Every published figure with ours beside it.
"""

from collections.abc import Callable, Sequence

import numpy as np

from groundstation.chapters.parts import Section
from groundstation.methods.intervals import nees_limits
from groundstation.results.figures import FigureData
from groundstation.systems.planning.session.answer import UNCONTROLLED, ControlPlan
from groundstation.systems.planning.session.laws import PlannedSession, integral_law, local_law
from groundstation.systems.planning.session.placement import plan_placement
from groundstation.systems.planning.session.placement_answer import PlacementPlan
from groundstation.systems.planning.session.plan import plan_session
from groundstation.systems.planning.session.scenario import LOCAL_CRITERIA, SessionPlan
from groundstation.systems.planning.session.study.cases import (
    CASES,
    FACTOR,
    FIRST_SEED,
    PUBLISHED_M,
    SPEED,
    SPEED_PUBLISHED_M,
    placements,
    scenario,
)
from groundstation.systems.planning.session.study.flown import fly
from groundstation.systems.planning.session.study.random_geometry import DRAWS, random_section, random_table
from groundstation.systems.study import StudyResult, section, table

Progress = Callable[[str], object]


def study_control(runs: int = 100, seed: int = 0, progress: Progress | None = None) -> StudyResult:
    """Make every plan and fly the worked example.

    Parameters
    ----------
    runs : int
        Simulated flights of each law of the worked example; plans themselves draw nothing but the starts they state.
    seed : int
        The seed of the flights is ``FIRST_SEED + seed``.
    progress : callable, optional
        Called with one line for each plan.
    """
    tell = progress or (lambda _text: None)
    tables = (
        published_table(tell),
        laws_table(scenario(SPEED), runs, FIRST_SEED + seed, tell),
        placement_table(placements(), tell),
        random_table(scenario(SPEED), SPEED_PUBLISHED_M, FACTOR, DRAWS, FIRST_SEED + seed),
    )
    return StudyResult("control", tables, page(tables, runs, FIRST_SEED + seed))


def published_table(tell: Progress) -> FigureData:
    """Tabulate our figures beside the published ones."""
    answers: dict[str, ControlPlan] = {}
    for name in dict.fromkeys(case.plan for case in CASES):
        tell(f"plan {name}")
        answer = plan_session(scenario(name)).answers["control"]
        assert isinstance(answer, ControlPlan)
        answers[name] = answer
    ours = [case.read(answers[case.plan]) for case in CASES]
    near = [_near(case.value, value) for case, value in zip(CASES, ours, strict=True)]
    columns = {
        "plan": np.array([case.plan for case in CASES]),
        "published": np.array([case.published for case in CASES]),
        "ours": np.array(ours),
        "within_factor_two": np.array(near),
        "remark": np.array([case.why for case in CASES]),
    }
    return FigureData("control_published", columns, {"ours": 2})


def _near(published: float, ours: float) -> str:
    if np.isnan(published):
        return ""
    return "yes" if published / FACTOR <= ours <= published * FACTOR else "no"


def laws_table(plan: SessionPlan, runs: int, seed: int, tell: Progress) -> FigureData:
    """Tabulate every law of a session of exact neighbours.

    Computed sigma, errors of simulated flights, NEES with its limits.
    """
    session = PlannedSession(plan)
    laws = {UNCONTROLLED: session.motion.uncontrolled}
    laws |= {name: local_law(session, name).controls for name in LOCAL_CRITERIA}
    laws["covariance"] = integral_law(session, list(laws.values())).controls
    low, high = nees_limits(2, runs)
    rows = []
    for name, controls in laws.items():
        tell(f"law {name}")
        paths = session.motion.paths(controls)
        P = session.model.accuracy(paths.position_m).covariance[-1]
        found = fly(session, paths, runs, np.random.default_rng(seed))
        computed = [2.0 * float(np.sqrt(P[axis, axis])) for axis in (0, 1)]
        measured = [2.0 * found.rms_north_m, 2.0 * found.rms_east_m]
        honest = "yes" if low <= found.nees <= high else "no"
        rows.append((name, *computed, *measured, found.nees, low, high, honest, runs))
    names = (
        *("law", "computed_two_sigma_north_m", "computed_two_sigma_east_m", "twice_rms_north_m", "twice_rms_east_m"),
        *("nees", "nees_low", "nees_high", "consistent", "runs"),
    )
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData("control_laws", columns, {name: 1 for name in names if name.endswith("_m")} | {"nees": 2})


def placement_table(plans: dict[str, SessionPlan], tell: Progress) -> FigureData:
    """Tabulate the best third point by analysis, by the determinant, by the covariance.

    One row per fixed point.
    """
    rows = []
    for name, plan in plans.items():
        tell(f"fixed point {name}")
        answer, _ = plan_placement(plan)
        before_m, height_m = -answer.fixed_north_m, answer.fixed_height_m
        analysis = before_m + height_m**2 / before_m if before_m > 0.0 else np.inf
        found = [_third(answer, design) for design in ("determinant_fixed", "covariance_fixed")]
        sigmas = [answer.design(design).two_sigma_up_m for design in ("determinant_fixed", "covariance_fixed")]
        rows.append((name, height_m, analysis, *found, *sigmas, "yes" if _is_published(found[0]) else "no"))
    names = (
        *("fixed_point", "height_m", "analysis_before_m", "determinant_before_m", "covariance_before_m"),
        *("determinant_two_sigma_up_m", "covariance_two_sigma_up_m", "is_440_m"),
    )
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData("control_placement", columns, {name: 1 for name in names if name.endswith("_m")})


def _third(answer: PlacementPlan, design: str) -> float:
    """Return the distance of a design's third point before the threshold, m."""
    return -next(row.north_m for row in answer.places_of(design) if row.is_placed)


def _is_published(before_m: float) -> bool:
    return abs(before_m - PUBLISHED_M) <= 0.05 * PUBLISHED_M


def page(tables: Sequence[FigureData], runs: int, seed: int) -> tuple[Section, ...]:
    """Return the study in sections."""
    published, laws, placed, random = tables
    return (
        section(
            "Study: control of a session, and placement of ground points",
            "Plans are the TOML files of plans/session; the covariance is that of the centralised filter along each "
            "law.",
        ),
        section("Published figures", table(published)),
        section(
            "The worked example, flown",
            f"{runs} simulated flights a law, seed {seed}: errors drawn as the plan believes them, ranges of the true "
            "places, an iterated extended filter that takes directions at its own estimate. Twice the RMS error beside "
            "the computed 2 sigma; NEES (2 is honest) with its 95 % limits.",
            table(laws),
        ),
        random_section(random),
        section(
            "The third point of an approach",
            "Two points stand 1000 m abeam the threshold; distances are those before the threshold. Analysis: "
            "s + h^2 / s for a fixed point s before the threshold at height h. The rectangle ends 4000 m before the "
            "threshold. The published 440 m is the best place for a fixed point 437 m before the threshold and for no "
            "other: it is a property of the fixed point. For the threshold itself the determinant grows to the end of "
            "the rectangle.",
            table(placed),
        ),
    )
