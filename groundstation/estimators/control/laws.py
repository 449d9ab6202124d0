"""Laws of control: the best measure of geometry at each step, or the least variance at the end of the interval.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapter 5.2: local criterion, equation
(29); integral criterion, least tr(Theta P) at the last epoch.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import frozen
from groundstation.estimators.control.accuracy import PLACE, AccuracyModel
from groundstation.estimators.control.descent import Minimum, minimise, nearest_law
from groundstation.estimators.control.measures import Geometry, geometry_of, loss, loss_by_direction
from groundstation.estimators.control.motion import Motion
from groundstation.estimators.control.scenario import NEAREST_M, LocalCriterion, SessionPlan

LOCAL_ITERATIONS, LOCAL_TOLERANCE = 60, 1e-9
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


class Session:
    """A session with its motion and its accuracy: what the criteria ask."""

    def __init__(self, plan: SessionPlan) -> None:
        self.plan, self.motion, self.model = plan, Motion(plan), AccuracyModel(plan)
        size = self.model.size
        self.theta = np.zeros((size, size))
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

    def geometry(self, position_m: FloatArray) -> Geometry:
        """Geometry of the judged aircraft at every epoch but the first."""
        links = self.model.links(position_m)
        mine = links.receiver == self.model.user
        return geometry_of(links.direction[:, mine], self.plan.control.axes)

    def variance(self, controls: FloatArray) -> tuple[float, FloatArray]:
        """Weighted variance tr(Theta P) at the end, and its derivative by the controls.

        Infinite where anybody comes so near to a source that the geometry has no meaning: no descent steps there.
        """
        paths = self.motion.paths(controls)
        if self.model.links(paths.position_m).range_m.min() < NEAREST_M:
            return np.inf, np.zeros(self.motion.shape)
        found = self.model.accuracy(paths.position_m)
        by_covariance = np.zeros(found.covariance.shape)
        by_covariance[-1] = self.theta
        by_position = self.model.by_position(found, by_covariance)
        return float((self.theta * found.covariance[-1]).sum()), self.motion.by_controls(paths, by_position)


class StepMeasure:
    """Loss at the end of one step as function of the controls of that step, those before it being given."""

    def __init__(self, session: Session, criterion: LocalCriterion, controls: FloatArray, step: int) -> None:
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
        by_position[step + 1] = links.by_position(by_direction, session.model.sources)[0]
        by_controls = session.motion.by_controls(paths, by_position)[:, step]
        return float(loss(geometry, self._criterion)[0]), by_controls


def local_law(session: Session, criterion: LocalCriterion) -> Law:
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
    session: Session,
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


def integral_law(session: Session, starts: Sequence[FloatArray]) -> Law:
    """The law with the least tr(Theta P) at the end, the best of descents from several starts."""
    settings, width = session.plan.control, session.width
    found = [
        minimise(
            session.variance,
            session.project,
            start,
            width,
            iterations=settings.iterations,
            tolerance=settings.tolerance,
        )
        for start in starts
    ]
    best = min(found, key=lambda one: one.loss)
    work = sum(one.iterations for one in found), sum(one.evaluations for one in found)
    return Law(best.x, best.gap, *work, best.has_converged, tuple(one.loss for one in found))


def random_starts(session: Session, count: int, seed: int) -> list[FloatArray]:
    """Controls that wander within the bounds: knots drawn at random, straight lines between them."""
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
