"""Published figures of control and placement, each with the plan for it.

Source: O. N. Skrypnik, thesis on navigation between aircraft, 2010, chapters 5 (control) and 6.2 (placement).
"""

from collections.abc import Callable
from dataclasses import replace

from groundstation.base.dataclasses import dataclass
from groundstation.results.arrays.typed import found_in
from groundstation.systems.planning.session.analysis import SESSION_PLAN
from groundstation.systems.planning.session.answer import UNCONTROLLED, ControlPlan
from groundstation.systems.planning.session.arrays import ControlMeasures
from groundstation.systems.planning.session.scenario import Placement, SessionPlan
from groundstation.systems.shipped_plans import load_plan

FIRST_SEED = 95_000  # no smaller seed belongs to this study
FACTOR = 2.0  # a figure of ours within so many times of the published one counts as the same
SPEED, MOVING, THIRD = "speed-three-points", "landing-moving-point", "landing-third-point"
LAW = "covariance"
SPEED_PUBLISHED_M = 7.8, 7.2  # 2 sigma north and east at the end, under speed control
PUBLISHED_M = 440.0  # distance of the third point before the threshold
FIXED_BEFORE_M = (0.0, 100.0, 200.0, 430.0, 1000.0, 2000.0)  # places of the fixed point
CORRELATED_S = (0.0, 1.0, 10.0)


@dataclass(frozen=True)
class PublishedFigure:
    """One published figure: its plan, its value, and the function that reads ours.

    A value of NaN: only a direction is published.
    """

    name: str
    plan: str
    published: str
    value: float
    read: Callable[[ControlPlan], float]
    why: str = ""


def scenario(name: str) -> SessionPlan:
    """Return a shipped plan of a session."""
    return load_plan(SESSION_PLAN, name).scenario


def measures(answer: ControlPlan) -> ControlMeasures:
    """Return accuracy and geometry with time."""
    found = found_in(answer.figures, ControlMeasures)
    assert found is not None
    return found


def least_sigma_m(answer: ControlPlan, axis: str) -> float:
    """Return the least sigma along the way under the recommended law."""
    data = measures(answer)
    two_sigma_m = {
        "north": data.two_sigma_north_m,
        "east": data.two_sigma_east_m,
        "up": data.two_sigma_up_m,
        "r": data.two_sigma_r_m,
    }[axis]
    return float(two_sigma_m[data.law == answer.recommended].min() / 2.0)


def _ratio(answer: ControlPlan, name: str) -> float:
    """Return a measure of geometry at the end, under control over that without control.

    The law is that of the source's local criterion, the determinant.
    """
    laws = answer.law("determinant"), answer.law(UNCONTROLLED)
    return float(getattr(laws[0], name) / getattr(laws[1], name))


NONE = float("nan")
INDEPENDENT = (
    "All of it rests on 3 m of independent noise 100 times a second; the study of landing has a table of correlated "
    "errors."
)
CASES: tuple[PublishedFigure, ...] = (
    PublishedFigure(
        "speed-x",
        SPEED,
        "2 sigma_x 7.8 m at the end",
        SPEED_PUBLISHED_M[0],
        lambda answer: answer.law(LAW).two_sigma_north_m,
        "Proves little: the geometry is ours, and many geometries are as near without control (see below).",
    ),
    PublishedFigure(
        "speed-y",
        SPEED,
        "2 sigma_y 7.2 m at the end",
        SPEED_PUBLISHED_M[1],
        lambda answer: answer.law(LAW).two_sigma_east_m,
        "As above.",
    ),
    PublishedFigure(
        "speed-measure",
        SPEED,
        "the measure of observability rises",
        NONE,
        lambda answer: _ratio(answer, "determinant"),
        "Over that without control, at the end, local criterion.",
    ),
    PublishedFigure(
        "speed-dop", SPEED, "the geometric factor falls", NONE, lambda answer: _ratio(answer, "dop"), "As above."
    ),
    PublishedFigure(
        "moving-x", MOVING, "sigma_x 0.29 m, least", 0.29, lambda answer: least_sigma_m(answer, "north"), INDEPENDENT
    ),
    PublishedFigure(
        "moving-y", MOVING, "sigma_y 0.23 m, least", 0.23, lambda answer: least_sigma_m(answer, "east"), "As above."
    ),
    PublishedFigure(
        "moving-z", MOVING, "sigma_z 0.6 m, least", 0.6, lambda answer: least_sigma_m(answer, "up"), "As above."
    ),
    PublishedFigure(
        "moving-touchdown",
        MOVING,
        "sigma_z 1.6-1.8 m at touchdown",
        1.7,
        lambda answer: 0.5 * answer.law(LAW).two_sigma_up_m,
        "Here the moving aircraft ranges to all points itself, in one filter with the other. Where its errors are no "
        "more than a part of the state, as in the source, the study of landing finds 1.7 m.",
    ),
)


def placements() -> dict[str, SessionPlan]:
    """Return plans of an approach that place its third point, by name.

    They vary the fixed point along the path, and the correlation of range errors.
    """
    base = scenario(THIRD)
    found = {}
    for before_m in FIXED_BEFORE_M:
        found[f"{before_m:g} m before the threshold"] = with_fixed_point(base, before_m)
    for correlation_s in CORRELATED_S[1:]:
        ranging = replace(base.ranging, correlation_s=correlation_s)
        found[f"430 m, errors over {correlation_s:g} s"] = replace(base, ranging=ranging)
    return found


def with_fixed_point(base: SessionPlan, before_m: float) -> SessionPlan:
    """Return an approach that begins so that an epoch of it falls on a point of the path.

    The way is moved along itself by less than a step.
    """
    aircraft = base.user
    way_m = aircraft.speed_mps * base.step_s
    steps = int((-aircraft.north_m - before_m) // way_m)
    begin_m = -(before_m + steps * way_m)
    climb = (begin_m - aircraft.north_m) * aircraft.climb_mps / aircraft.speed_mps
    moved = replace(aircraft, north_m=begin_m, height_m=aircraft.height_m + climb)
    asked: Placement = replace(base.placement, fixed_at_s=steps * base.step_s, map_side=2)
    duration_s = max(base.duration_s, steps * base.step_s)
    return replace(base, aircraft=(moved,), placement=asked, duration_s=duration_s)
