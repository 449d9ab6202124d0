"""Plan of a session: every law of control side by side, with findings."""

from dataclasses import asdict

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.findings import Finding
from groundstation.results.answer import by_analysis
from groundstation.results.figures import FigureData
from groundstation.systems.plan import Planned
from groundstation.systems.planning.session.accuracy import PLACE, Accuracy
from groundstation.systems.planning.session.answer import UNCONTROLLED, ControlPlan, ControlRow, Horizon, LawRow
from groundstation.systems.planning.session.arrays import ControlMeasures, ControlPaths, ControlPoints
from groundstation.systems.planning.session.laws import Law, PlannedSession, integral_law, local_law, random_starts
from groundstation.systems.planning.session.measures import InformationModes
from groundstation.systems.planning.session.motion import Paths, points_at_starts
from groundstation.systems.planning.session.placement import plan_placement
from groundstation.systems.planning.session.scenario import LOCAL_CRITERIA, NEAREST_M, SessionPlan

INTEGRAL = "covariance"
AT_BOUND = 1e-6  # of the room a control has
POOR_DOP = 20.0
LEAST_GAIN = 1.01
KEPT = 0.99  # of the separation: the descent leaves a little
SPREAD = 0.01  # of the losses of several starts: more is worth a remark


@dataclass(frozen=True)
class LawResult:
    """One law and what follows from it."""

    name: str
    law: Law
    paths: Paths
    accuracy: Accuracy
    geometry: InformationModes

    @property
    def horizon(self) -> Horizon:
        """Horizon of the criterion."""
        return "none" if self.name == UNCONTROLLED else "end" if self.name == INTEGRAL else "each step"


def plan_session(plan: SessionPlan) -> Planned:
    """Find laws of control and places of points for a session, where the scenario asks them.

    Raises
    ------
    GroundstationError
        When an aircraft meets a source on its way without control: there the geometry has no meaning. When a point has
        no allowed place.
    """
    is_placed = any(point.is_placed for point in plan.points)
    placement, remarks = plan_placement(plan) if is_placed else (None, ())
    control, findings = (None, ()) if is_placed and not any(one.control for one in plan.aircraft) else _control(plan)
    return Planned(by_analysis(control, placement), plan.duration_s, (*findings, *remarks))


def _control(plan: SessionPlan) -> tuple[ControlPlan, tuple[Finding, ...]]:
    session = PlannedSession(plan)
    _require_distance(session)
    flown = {UNCONTROLLED: _flown(session, UNCONTROLLED, Law(session.motion.uncontrolled))}
    if session.motion.bounds:
        for criterion in LOCAL_CRITERIA:
            flown[criterion] = _flown(session, criterion, local_law(session, criterion))
        settings = plan.control
        starts = [one.law.controls for one in flown.values()]
        starts += random_starts(session, settings.starts, settings.seed)
        flown[INTEGRAL] = _flown(session, INTEGRAL, integral_law(session, starts))
    recommended = plan.control.criterion if session.motion.bounds else UNCONTROLLED
    answer = _answer(session, flown, recommended)
    return answer, _findings(session, flown, answer)


def _flown(session: PlannedSession, name: str, law: Law) -> LawResult:
    paths = session.motion.paths(law.controls)
    accuracy = session.model.accuracy(paths.position_m)
    return LawResult(name, law, paths, accuracy, session.geometry(paths.position_m))


def _require_distance(session: PlannedSession) -> None:
    """Refuse a session in which an aircraft without control meets a source."""
    plan, links = session.plan, session.model.links(session.motion.paths(session.motion.uncontrolled).position_m)
    epoch, link = (int(place) for place in np.unravel_index(np.argmin(links.range_m), links.range_m.shape))
    if links.range_m[epoch, link] < NEAREST_M:
        names = [*(aircraft.name for aircraft in plan.aircraft), *(point.name for point in plan.points)]
        one, other = names[int(links.receiver[link])], names[int(links.source[link])]
        raise GroundstationError(
            plan.title,
            f"{one} {links.range_m[epoch, link]:.2g} m from {other} at {(epoch + 1) * plan.step_s:g} s",
            f"a path that stays {NEAREST_M:g} m away from every source",
            "move the start, the track or the source",
        )


def _answer(session: PlannedSession, flown: dict[str, LawResult], recommended: str) -> ControlPlan:
    plan, nominal, best = session.plan, flown[UNCONTROLLED], flown[recommended]
    variances = [float((session.theta * one.accuracy.covariance[-1]).sum()) for one in (nominal, best)]
    return ControlPlan(
        plan.user.name,
        recommended,
        float(np.sqrt(variances[0] / variances[1])),
        tuple(_row(session, one) for one in flown.values()),
        _controls(session, best),
        tuple(one.name for one in plan.aircraft),
        tuple(point.name for point in plan.points),
        tuple(one.name for one in plan.aircraft if one.is_exact),
        plan.duration_s,
        _settings(plan),
        _figures(session, flown),
    )


def _two_sigma(session: PlannedSession, accuracy: Accuracy) -> FloatArray:
    """Twice the sigmas of the judged aircraft: north, east, up, r; shape (epochs, 4)."""
    own = session.model.first_of(session.model.user) + PLACE
    variance = accuracy.covariance[:, own, own]
    return np.asarray(2.0 * np.sqrt(np.column_stack([variance, variance[:, :2].sum(axis=1)])))


def _row(session: PlannedSession, one: LawResult) -> LawRow:
    links, law, geometry = one.accuracy.links, one.law, one.geometry
    north, east, up, both = _two_sigma(session, one.accuracy)[-1].tolist()
    dop = geometry.dilution()
    gram = np.linalg.det(np.mean(np.swapaxes(geometry.H, 1, 2) @ geometry.H, axis=0))
    best, worst = min(law.losses, default=1.0), max(law.losses, default=1.0)
    return LawRow(
        law=one.name,
        horizon=one.horizon,
        two_sigma_north_m=north,
        two_sigma_east_m=east,
        two_sigma_up_m=up,
        two_sigma_r_m=both,
        determinant=float(geometry.determinant[-1]),
        eigenvalue=float(geometry.least_eigenvalue[-1]),
        dop=float(dop[-1]),
        gram_determinant=max(float(gram), 0.0),
        dop_worst=float(np.max(dop)),
        least_range_m=float(links.range_m.min()),
        least_separation_m=_separation_m(session, one.paths),
        bounded_share=_bounded_share(session, law),
        gap=law.gap,
        has_converged=law.has_converged,
        iterations=law.iterations,
        evaluations=law.evaluations,
        starts=len(law.losses),
        start_spread=abs(worst / best - 1.0) if best else 0.0,
    )


def _separation_m(session: PlannedSession, paths: Paths) -> float | None:
    """Least distance between any two aircraft; None for a single one."""
    places = paths.position_m[:, : len(session.plan.aircraft)]
    pairs = [
        np.linalg.norm(places[:, one] - places[:, other], axis=1).min()
        for one in range(places.shape[1])
        for other in range(one)
    ]
    return float(min(pairs)) if pairs else None


def _bounded_share(session: PlannedSession, law: Law) -> float:
    at = []
    for bound, values in zip(session.motion.bounds, law.controls, strict=True):
        room = AT_BOUND * max(bound.high - bound.low, bound.change)
        change = np.abs(np.diff(values, prepend=bound.start))
        at.append((values <= bound.low + room) | (values >= bound.high - room) | (change >= bound.change - room))
    return float(np.mean(at)) if at else 0.0


def _controls(session: PlannedSession, best: LawResult) -> tuple[ControlRow, ...]:
    rows = []
    for bound, values in zip(session.motion.bounds, best.law.controls, strict=True):
        speed = bound.kind == "speed"
        factor = 1.0 if speed else float(np.rad2deg(1.0 / bound.scale))
        start, low, high, change, end = (
            factor * value for value in (bound.start, bound.low, bound.high, bound.change, float(values[-1]))
        )
        name, unit = session.plan.aircraft[bound.aircraft].name, "m/s" if speed else "deg"
        rows.append(ControlRow(name, bound.kind, unit, start, low, high, change / session.plan.step_s, end))
    return tuple(rows)


def _settings(plan: SessionPlan) -> dict[str, float | str | bool]:
    flat: dict[str, float | str | bool] = {"step_s": plan.step_s}
    for name, part in (("ranging", plan.ranging), ("control", plan.control), ("errors", plan.user.errors)):
        for key, value in asdict(part).items():
            flat[f"{name}_{key}"] = ", ".join(value) if isinstance(value, tuple) else value
    return flat


def _figures(session: PlannedSession, flown: dict[str, LawResult]) -> tuple[FigureData, ...]:
    plan, time_s = session.plan, session.plan.step_s * np.arange(session.plan.steps + 1)
    names, count = [one.name for one in plan.aircraft], len(plan.aircraft)
    laws, places = list(flown), np.stack([one.paths.position_m[:, :count] for one in flown.values()])
    speed, heading = (
        np.stack([getattr(one.paths, name) for one in flown.values()]) for name in ("speed_mps", "heading_rad")
    )
    whole = (len(laws), len(time_s), count)
    north_m, east_m, up_m = (places[..., axis].ravel() for axis in range(3))
    paths = ControlPaths(
        time_s=np.broadcast_to(time_s[None, :, None], whole).ravel(),
        law=np.repeat(laws, len(time_s) * count),
        aircraft=np.tile(names, len(laws) * len(time_s)),
        north_m=north_m,
        east_m=east_m,
        up_m=up_m,
        speed_mps=speed.ravel(),
        track_deg=wrap_360(np.rad2deg(heading)).ravel(),
    )
    sigma = np.concatenate([_two_sigma(session, one.accuracy) for one in flown.values()])
    unknown = np.full(1, np.nan)  # of the geometry before the first range

    def one_behind_another(values: list[FloatArray]) -> FloatArray:
        return np.concatenate([part for one in values for part in (unknown, one)])

    geometries = [one.geometry for one in flown.values()]
    measures = ControlMeasures(
        time_s=np.tile(time_s, len(laws)),
        law=np.repeat(laws, len(time_s)),
        determinant=one_behind_another([one.determinant for one in geometries]),
        eigenvalue=one_behind_another([one.least_eigenvalue for one in geometries]),
        dop=one_behind_another([one.dilution() for one in geometries]),
        two_sigma_north_m=sigma[:, 0],
        two_sigma_east_m=sigma[:, 1],
        two_sigma_up_m=sigma[:, 2],
        two_sigma_r_m=sigma[:, 3],
    )
    found: list[FigureData] = [paths, measures]
    if plan.points:
        found.append(
            ControlPoints(
                label=np.array([point.name for point in plan.points]),
                north_m=np.array([point.north_m for point in plan.points]),
                east_m=np.array([point.east_m for point in plan.points]),
                up_m=np.array([point.height_m for point in plan.points]),
            )
        )
    return tuple(found)


def _findings(session: PlannedSession, flown: dict[str, LawResult], answer: ControlPlan) -> tuple[Finding, ...]:
    best, row = flown[answer.recommended], answer.law(answer.recommended)
    found = points_at_starts(session.plan, best.paths.position_m[0])
    if not session.motion.bounds:
        found.append(
            Finding("info", "control.nothing_controlled", "no aircraft may be controlled: accuracy without control")
        )
    if not row.has_converged:
        text = f"the law has not converged: a first-order gain of {row.gap:.2g} of its loss is left"
        found.append(Finding("warn", "control.not_converged", text))
    elif row.start_spread > SPREAD:
        text = f"starts end up to {100.0 * row.start_spread:.0f} % apart: the best of {row.starts} is taken"
        found.append(Finding("info", "control.several_minima", text))
    if best.geometry.is_singular[-1]:
        text = f"the sources do not separate {' and '.join(session.plan.control.axes)} at the end"
        found.append(Finding("warn", "control.singular", text))
    elif row.dop > POOR_DOP:
        text = f"dilution of precision {row.dop:.0f} at the end: the sources are nearly on one line"
        found.append(Finding("warn", "control.poor_geometry", text))
    if row.least_separation_m is not None and row.least_separation_m < KEPT * session.plan.separation_m:
        why = (
            "start, bounds or the one-step law allow no more" if session.motion.bounds else "no aircraft is controlled"
        )
        text = f"aircraft come within {row.least_separation_m:.0f} m of each other: {why}"
        found.append(Finding("warn", "control.separation", text))
    if session.motion.bounds and answer.gain < LEAST_GAIN:
        text = f"control gains {100.0 * (answer.gain - 1.0):.1f} % of accuracy: the bounds or the time allow no more"
        found.append(Finding("info", "control.no_gain", text))
    return tuple(found)
