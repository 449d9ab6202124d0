"""Laws of control: best geometry at each step, or least variance at the end.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapter 5.2: local criterion, equation
(29); integral criterion, least tr(Theta P) at the last epoch.
"""

from collections.abc import Sequence
from functools import partial
from itertools import combinations

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.systems.planning.session.accuracy import PLACE, AccuracyModel
from groundstation.systems.planning.session.descent import Minimum, minimise, nearest_law
from groundstation.systems.planning.session.measures import InformationModes, geometry_of, loss, loss_by_direction
from groundstation.systems.planning.session.motion import SessionMotion
from groundstation.systems.planning.session.scenario import NEAREST_M, LocalCriterion, SessionPlan

LOCAL_ITERATIONS, LOCAL_TOLERANCE = 60, 1e-9
FIRST_WEIGHT, LAST_WEIGHT = 1e2, 1e4  # of crowding: the last leaves about a ten-thousandth of the separation
KNOT_S = 10.0  # of the random starts


@dataclass(frozen=True)
class Law:
    """One law of control.

    Parameters
    ----------
    controls : ndarray, shape (controls, steps)
        In m/s, see :mod:`motion`.
    gap : float
        Largest first-order gain left, over the loss; of a local law that of its worst step.
    iterations, evaluations : int
    has_converged : bool
    losses : tuple of float
        Where each start ended, in the order of the starts; a local law has one.
    """

    controls: FloatArray
    gap: float = 0.0
    iterations: int = 0
    evaluations: int = 0
    has_converged: bool = True
    losses: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "controls", frozen(self.controls))


class PlannedSession:
    """Session with the motion and accuracy that the criteria ask for."""

    def __init__(self, plan: SessionPlan) -> None:
        self.plan, self.motion, self.model = plan, SessionMotion(plan), AccuracyModel(plan)
        size = self.model.size
        self.theta = np.zeros((size, size))
        steered = {bound.aircraft for bound in self.motion.bounds}
        pairs = combinations(range(len(plan.aircraft)), 2)
        self._pairs = [(one, other) for one, other in pairs if one in steered or other in steered]
        own = self.model.first_of(self.model.user) + PLACE
        self.theta[own, own] = [plan.control.weight_north, plan.control.weight_east, plan.control.weight_up]

    def project(self, controls: FloatArray) -> FloatArray:
        """Nearest controls within all bounds."""
        laws = [
            nearest_law(values, bound.start, bound.low, bound.high, bound.change)
            for bound, values in zip(self.motion.bounds, controls, strict=True)
        ]
        return np.array(laws).reshape(self.motion.shape)

    @property
    def width(self) -> float:
        """About how far controls may go from the start."""
        reach = [min(one.high - one.low, one.change * self.plan.steps) for one in self.motion.bounds]
        return max([*reach, 1e-9])

    def geometry(self, position_m: FloatArray) -> InformationModes:
        """Geometry of the judged aircraft at every epoch but the first."""
        links = self.model.links(position_m)
        mine = links.receiver == self.model.user
        return geometry_of(links.direction[:, mine], self.plan.control.axes)

    def crowding(self, position_m: FloatArray) -> tuple[float, FloatArray]:
        """Return how much aircraft violate the separation, and its derivative by the positions.

        Sum of max(0, 1 - distance^2 / separation^2)^2 over all epochs but the first and all pairs of which one is
        controlled: 0 where the separation is kept.
        """
        found, limit_m2 = np.zeros(position_m.shape), self.plan.separation_m**2
        total = 0.0
        for one, other in self._pairs if limit_m2 > 0.0 else ():
            line = position_m[1:, one] - position_m[1:, other]
            lack = np.maximum(0.0, 1.0 - (line**2).sum(axis=1) / limit_m2)
            total += float((lack**2).sum())
            by_line = -4.0 * lack[:, None] * line / limit_m2
            found[1:, one] += by_line
            found[1:, other] -= by_line
        return total, found

    def variance(self, controls: FloatArray, weight: float = 0.0) -> tuple[float, FloatArray]:
        """Return the weighted variance tr(Theta P) at the end, and its derivative by the controls.

        It is multiplied by 1 + ``weight`` crowding. Infinite where anybody comes so near to a source that the geometry
        has no meaning: no descent steps there.
        """
        paths = self.motion.paths(controls)
        if self.model.links(paths.position_m).range_m.min() < NEAREST_M:
            return np.inf, np.zeros(self.motion.shape)
        found = self.model.accuracy(paths.position_m)
        by_covariance = np.zeros(found.covariance.shape)
        by_covariance[-1] = self.theta
        by_position = self.model.by_position(found, by_covariance)
        value = float((self.theta * found.covariance[-1]).sum())
        if weight > 0.0:
            crowding, by_place = self.crowding(paths.position_m)
            by_position = (1.0 + weight * crowding) * by_position + weight * value * by_place
            value *= 1.0 + weight * crowding
        return value, self.motion.by_controls(paths, by_position)


class StepMeasure:
    """Loss at the end of one step as a function of its controls, those before it being given."""

    def __init__(self, session: PlannedSession, criterion: LocalCriterion, controls: FloatArray, step: int) -> None:
        self._session, self._criterion, self._controls, self._step = session, criterion, controls, step

    def __call__(self, values: FloatArray) -> tuple[float, FloatArray]:
        """Loss and its derivative, shape (controls,)."""
        session, step, axes = self._session, self._step, self._session.plan.control.axes
        controls = self._controls.copy()
        controls[:, step] = values
        paths = session.motion.paths(controls)
        links = session.model.links(paths.position_m[step : step + 2])
        if links.range_m.min() < NEAREST_M:
            return np.inf, np.zeros(len(values))
        mine = links.receiver == session.model.user
        geometry = geometry_of(links.direction[:, mine], axes)
        by_direction = np.zeros(links.line_m.shape)
        by_direction[:, mine] = loss_by_direction(geometry, self._criterion, axes)
        by_position = np.zeros(paths.position_m.shape)
        crowding, by_place = session.crowding(paths.position_m[step : step + 2])
        by_position[step + 1] = links.by_position(by_direction, session.model.sources)[0] + LAST_WEIGHT * by_place[1]
        by_controls = session.motion.by_controls(paths, by_position)[:, step]
        return float(loss(geometry, self._criterion)[0]) + LAST_WEIGHT * crowding, by_controls


def local_law(session: PlannedSession, criterion: LocalCriterion) -> Law:
    """The law that makes a measure of geometry best at each step in its turn.

    Each step is searched from the control before it and from both ends of what may be reached; the least loss is taken.
    """
    bounds, controls = session.motion.bounds, session.motion.uncontrolled.copy()
    gap, iterations, evaluations, converged, last = 0.0, 0, 0, True, np.inf
    for step in range(session.plan.steps):
        before = controls[:, step - 1] if step else np.array([bound.start for bound in bounds])
        low = np.array([max(one.low, value - one.change) for one, value in zip(bounds, before, strict=True)])
        high = np.array([min(one.high, value + one.change) for one, value in zip(bounds, before, strict=True)])
        found = _best_step(session, criterion, controls, step, (before, low, high))
        controls[:, step:] = found.x[:, None]
        gap, converged = max(gap, found.gap), converged and found.has_converged
        iterations, evaluations = iterations + found.iterations, evaluations + found.evaluations
        last = found.loss
    return Law(controls, gap, iterations, evaluations, converged, (last,))


def _best_step(
    session: PlannedSession,
    criterion: LocalCriterion,
    controls: FloatArray,
    step: int,
    reach: tuple[FloatArray, FloatArray, FloatArray],
) -> Minimum:
    before, low, high = reach
    one_step = StepMeasure(session, criterion, controls, step)
    width = max(float((high - low).max()), 1e-12)
    found = [
        minimise(
            one_step,
            lambda values: np.clip(values, low, high),
            start,
            width,
            iterations=LOCAL_ITERATIONS,
            tolerance=LOCAL_TOLERANCE,
        )
        for start in (before, low, high)
    ]
    return min(found, key=lambda one: one.loss)


def integral_law(session: PlannedSession, starts: Sequence[FloatArray]) -> Law:
    """The law with the least tr(Theta P) at the end, the best of descents from several starts.

    Where it brings aircraft nearer to each other than the separation, descents with a weight on that follow from all
    starts, and from the best of these one with the last weight.
    """
    found = _descents(session, starts, 0.0)
    work = found
    best = min(found, key=lambda one: one.loss)
    if session.crowding(session.motion.paths(best.x).position_m)[0] > 0.0:
        found = _descents(session, starts, FIRST_WEIGHT)
        best = min(found, key=lambda one: one.loss)
        last = _descents(session, [best.x], LAST_WEIGHT)
        work, best = [*work, *found, *last], last[0]
    return Law(
        best.x,
        best.gap,
        sum(one.iterations for one in work),
        sum(one.evaluations for one in work),
        best.has_converged,
        tuple(one.loss for one in found),
    )


def _descents(session: PlannedSession, starts: Sequence[FloatArray], weight: float) -> list[Minimum]:
    settings = session.plan.control
    return [
        minimise(
            partial(session.variance, weight=weight),
            session.project,
            start,
            session.width,
            iterations=settings.iterations,
            tolerance=settings.tolerance,
        )
        for start in starts
    ]


def random_starts(session: PlannedSession, count: int, seed: int) -> list[FloatArray]:
    """Draw controls that wander within the bounds.

    They are straight lines between random knots.
    """
    rng = np.random.default_rng(seed)
    plan, found = session.plan, []
    time_s = plan.step_s * np.arange(1, plan.steps + 1)
    knots_s = np.linspace(0.0, plan.duration_s, max(int(plan.duration_s / KNOT_S), 1) + 1)
    for _ in range(count):
        laws = [
            np.interp(time_s, knots_s, rng.uniform(bound.low, bound.high, len(knots_s)))
            for bound in session.motion.bounds
        ]
        found.append(session.project(np.array(laws).reshape(session.motion.shape)))
    return found
