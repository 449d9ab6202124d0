"""A pass over a log: filter forward, smoother back, states at the times of the samples."""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import BoolArray
from groundstation.systems.trajectory.backward import run_backward
from groundstation.systems.trajectory.forward import BLOCK, run_forward
from groundstation.systems.trajectory.layout import Plan, Samples
from groundstation.systems.trajectory.states import (
    BARO,
    KEPT_ROWS,
    KINDS,
    LAT,
    LEV,
    MNT,
    NAVIGATION,
    STATES,
    WHL,
    WIDTH,
    FloatArray,
    Gate,
    Line,
    Linear,
    Noise,
    Now,
    Room,
    Solved,
    transition_pattern,
)

ENTRIES = BLOCK + 7
SELDOM = 5  # epochs between two variances of the biases


@dataclass(frozen=True)
class Start:
    """Start of a pass: estimate, its covariance, and where the prior lies from it.

    ``prior`` (STATES,) is the prior mean minus the estimate.
    """

    nav: FloatArray
    value: FloatArray
    p: FloatArray
    prior: FloatArray

    def now(self) -> Now:
        """A copy that a pass may change."""
        return Now(self.nav.copy(), self.value.copy(), self.p.copy(), np.zeros(7), np.zeros(KINDS, dtype=np.int64))


def make_room(prior: FloatArray | None = None) -> Room:
    """Return working arrays; ``prior`` is where the prior lies from the start."""
    x = np.zeros((1, STATES))
    if prior is not None:
        x[0] = prior
    return Room(
        np.arange(STATES),
        np.zeros((3, 3)),
        np.zeros((9, LEV)),
        np.zeros((STATES, STATES)),
        np.zeros(STATES),
        np.zeros(STATES),
        x,
        np.zeros((3, WIDTH), dtype=np.int64),
        np.zeros((3, WIDTH)),
        np.zeros(3),
        np.zeros(28),
    )


def nothing_kept() -> Solved:
    """Return a history of no length."""
    wide = np.zeros((0, STATES))
    none = np.zeros(0)
    return Solved(
        np.zeros((0, KEPT_ROWS, STATES)),
        np.zeros(0, dtype=np.int64),
        wide,
        wide,
        wide,
        np.zeros((0, 2)),
        wide,
        none,
        none,
        np.zeros(0, dtype=np.int8),
    )


def history_of(plan: Plan, is_smoothed: BoolArray) -> Solved:
    """Return room for the history of a pass whose epochs are smoothed, or some of them."""
    epochs, scalars = len(plan.epoch_s), 3 * len(plan.seen.kind)
    return Solved(
        np.empty((int(is_smoothed.sum()), KEPT_ROWS, STATES)),
        np.where(is_smoothed, np.cumsum(is_smoothed) - 1, -1),
        np.empty((epochs, STATES)),
        np.empty((epochs, STATES)),
        np.empty((epochs, STATES)),
        np.empty((epochs, 2)),
        np.empty((scalars, STATES)),
        np.empty(scalars),
        np.ones(scalars),
        np.zeros(scalars, dtype=np.int8),
    )


def linear_room(plan: Plan) -> Linear:
    """Return room for the linearisation of a plan."""
    epochs, scalars = len(plan.epoch_s), 3 * len(plan.seen.kind)
    return Linear(
        np.empty((int(plan.schedule.slot.max()) + 1, 10)),
        np.empty((epochs, STATES)),
        np.empty((epochs, ENTRIES)),
        np.empty((epochs, 3)),
        np.empty((epochs, STATES)),
        np.empty(scalars),
        np.zeros((scalars, WIDTH), dtype=np.int64),
        np.zeros((scalars, WIDTH)),
    )


OWN_ESTIMATE = Line(np.zeros((0, 10)), np.zeros((0, STATES)))
NOTHING_HELD = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class Pass:
    """A pass forward and back.

    Parameters
    ----------
    linear, solved
        Linearisation and history of the filter.
    x, variance : ndarrays, shape (e, KEPT_ROWS)
        Smoothed correction to the estimate before the measurements of each epoch, and its variance; NaN where it was
        not wanted.
    plane : ndarray, shape (e, 2)
        Covariances of north with east: of the smoothed position, and of the smoothed attitude.
    before_variance : ndarray, shape (e, NAVIGATION)
        Variance of the filter before the measurements of each epoch.
    constants, constants_variance : ndarrays, shape (STATES,)
        Values of the constants at the end; smoothed they are the same at all times.
    begun, start : Start
        Start of the pass, and the one that the data say: estimate smoothed, covariance and prior those of the pass.
    """

    plan: Plan
    linear: Linear
    solved: Solved
    likelihood: float
    x: FloatArray
    variance: FloatArray
    plane: FloatArray
    before_variance: FloatArray
    constants: FloatArray
    constants_variance: FloatArray
    begun: Start
    start: Start


PATTERN = transition_pattern()


def filter_epochs(
    samples: Samples,
    plan: Plan,
    noise: Noise,
    gate: Gate,
    line: Line,
    span: tuple[int, int],
    now: Now,
    room: Room,
    linear: Linear,
    solved: Solved,
    carries: bool = True,
) -> float:
    """Filter the epochs of a span and return the log-likelihood; no state is held.

    ``now``, ``room``, ``linear`` and ``solved`` are filled. Without carrying, ``linear`` is known.
    """
    return run_forward(
        samples.imu,
        plan.schedule,
        plan.seen,
        noise,
        gate,
        PATTERN,
        NOTHING_HELD,
        line,
        carries,
        True,
        *span,
        now,
        room,
        linear,
        solved,
    )


def run_pass(
    samples: Samples,
    plan: Plan,
    noise: Noise,
    gate: Gate,
    start: Start,
    line: Line = OWN_ESTIMATE,
    known: Linear | None = None,
    *,
    wanted: BoolArray | None = None,
    has_sigmas: bool = True,
    keeps_all: bool = False,
) -> Pass:
    """Filter forward over all epochs and smooth back.

    Parameters
    ----------
    line : Line
        Trajectory that it is linearised about; its own estimate where there is none.
    known : Linear, optional
        Linearisation about ``line`` from an earlier pass with the same epochs: only the solving is left.
    wanted : ndarray of bool, shape (e,), optional
        Epochs that are smoothed, all by default; NaN at others. The start and the constants are always smoothed.
    has_sigmas : bool
        False: no variance is smoothed, which is most of the work of the way back.
    keeps_all : bool
        Covariances and gains of the filter stay in ``solved``; they are most of the memory.
    """
    epochs, seldom = len(plan.epoch_s), 1 if keeps_all else SELDOM
    linear = linear_room(plan) if known is None else known
    smoothed = np.ones(epochs, dtype=bool) if wanted is None else _with_groups(wanted, seldom)
    solved = history_of(plan, smoothed)
    now, room = start.now(), make_room(start.prior)
    likelihood = filter_epochs(samples, plan, noise, gate, line, (0, epochs), now, room, linear, solved, known is None)
    x, variance, before_variance = (np.full((epochs, width), np.nan) for width in (KEPT_ROWS, KEPT_ROWS, NAVIGATION))
    plane = np.full((epochs, 2), np.nan)
    first, square = np.zeros(STATES), [np.zeros((STATES, STATES)) for _ in range(2)]
    run_backward(
        plan.schedule,
        PATTERN,
        linear,
        solved,
        epochs,
        int(np.argmax(smoothed)) if has_sigmas and smoothed.any() else epochs,
        seldom,
        np.zeros(STATES),
        square[0],
        square[1],
        np.zeros(STATES),
        x,
        variance,
        plane,
        first,
        start.p,
    )
    x += solved.before[:, :KEPT_ROWS]
    before_variance[smoothed] = np.diagonal(solved.p[:, :NAVIGATION, :NAVIGATION], axis1=1, axis2=2)
    if not keeps_all:
        solved = solved._replace(p=solved.p[:0].copy(), K=solved.K[:0].copy())
    constants = linear.value[-1] + solved.after[-1]
    begun = first + start.prior
    return Pass(
        plan,
        linear,
        solved,
        likelihood,
        x,
        variance,
        plane,
        before_variance,
        constants,
        solved.variance[-1],
        start,
        moved(start, begun),
    )


def _with_groups(wanted: BoolArray, seldom: int) -> BoolArray:
    """Return the epochs that are wanted, and those behind them up to variances of biases."""
    group = -(-np.arange(len(wanted)) // seldom)
    return np.asarray(np.isin(group, group[wanted]))


def moved(start: Start, correction: FloatArray) -> Start:
    """Return a start with its estimate corrected; the prior stays where it is."""
    nav = start.nav.copy()
    north, east = (float(one) for one in curvature_radii_m(np.degrees(nav[0])))
    nav[0] += correction[0] / (north + nav[2])
    nav[1] += correction[1] / ((east + nav[2]) * np.cos(nav[0]))
    nav[2] -= correction[2]
    nav[3:6] += correction[3:6]
    nav[6:] = turned(nav[None, 6:], correction[None, 6:9])[0]
    value, prior = start.value.copy(), start.prior.copy()
    value[NAVIGATION:] += correction[NAVIGATION:]
    prior[NAVIGATION:] -= correction[NAVIGATION:]
    prior[:NAVIGATION] = 0.0
    return Start(nav, value, start.p, prior)


def line_of(one: Pass) -> Line:
    """Return the smoothed trajectory of a pass, for the next to be linearised about.

    Errors of GNSS and its latency are seen in straight lines: they stay at zero.
    """
    last = one.plan.schedule.first[1:] - 1
    begin = one.start
    nav = np.array(one.linear.nav[one.plan.schedule.slot[np.maximum(last, 0)]])
    nav[0] = begin.nav
    correction = np.array(one.x[:, :NAVIGATION])
    correction[0] = 0.0
    north, east = curvature_radii_m(np.degrees(nav[:, 0]))
    nav[:, 0] += correction[:, 0] / (north + nav[:, 2])
    nav[:, 1] += correction[:, 1] / ((east + nav[:, 2]) * np.cos(nav[:, 0]))
    nav[:, 2] -= correction[:, 2]
    nav[:, 3:6] += correction[:, 3:6]
    nav[:, 6:] = turned(nav[:, 6:], correction[:, 6:9])
    value = np.tile(one.constants, (len(nav), 1))
    value[:, NAVIGATION:KEPT_ROWS] = one.linear.value[:, NAVIGATION:KEPT_ROWS] + one.x[:, NAVIGATION:]
    for first, end in ((LAT, MNT), (BARO, WHL)):
        value[:, first:end] = 0.0
    return Line(np.ascontiguousarray(nav), np.ascontiguousarray(value))


def at_line(start: Start, line: Line) -> Start:
    """Return a start on a line.

    The prior of the constants stays where it was, that of navigation comes along.
    """
    prior = start.value + start.prior - line.value[0]
    prior[:NAVIGATION] = 0.0
    return Start(line.nav[0].copy(), line.value[0].copy(), start.p, prior)


def turned(quaternion: FloatArray, vector: FloatArray) -> FloatArray:
    """Turn quaternions n from b (wxyz), shape (n, 4), by rotation vectors in n.

    The vectors have shape (n, 3), rad.
    """
    angle = np.linalg.norm(vector, axis=1)
    s = 0.5 * np.sinc(0.5 * angle / np.pi)
    c, (x, y, z) = np.cos(0.5 * angle), (vector * s[:, None]).T
    a, b, d, e = quaternion.T
    return np.stack(
        [
            c * a - x * b - y * d - z * e,
            c * b + x * a + y * e - z * d,
            c * d - x * e + y * a + z * b,
            c * e + x * d - y * b + z * a,
        ],
        axis=1,
    )
