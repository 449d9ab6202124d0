"""Score of a model: derivatives of the log-likelihood by its numbers.

The adjoint ``a`` and ``A`` of the smoother are that of the covariance too: what is added to it at any place changes the
log-likelihood by the trace of (a a' - A) / 2 times it. One filter and one way back give every derivative.

Source: S. J. Koopman, N. Shephard, Exact score for time series models in state space form, Biometrika 79, 1992.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.dataclasses import dataclass
from groundstation.base.halves import both
from groundstation.methods.kalman.arrays import Pattern
from groundstation.systems.trajectory.backward import (
    adjoint_over_scalar,
    adjoint_over_step,
    spread_over_scalar,
    spread_over_step,
)
from groundstation.systems.trajectory.forward import BLOCK
from groundstation.systems.trajectory.layout import Plan, Samples
from groundstation.systems.trajectory.passes import (
    OWN_ESTIMATE,
    PATTERN,
    Start,
    filter_epochs,
    make_room,
    nothing_kept,
)
from groundstation.systems.trajectory.states import (
    BA,
    BARO,
    BG,
    MNT,
    SLOW,
    STATES,
    FloatArray,
    Gate,
    Linear,
    Noise,
    Schedule,
    Solved,
)

DENSITIES = 5
VARIANCES = 7
STEP = 1e-3  # of a logarithm, for derivatives of the variances of a model


@in_place
def run_score(
    schedule: Schedule,
    pattern: Pattern,
    linear: Linear,
    solved: Solved,
    end: int,
    a: FloatArray,
    A: FloatArray,
    w: FloatArray,
    u: FloatArray,
    by_scalar: FloatArray,
    by_noise: FloatArray,
) -> None:
    """Go back over the epochs before ``end`` and fill the adjoints of all noise.

    Parameters
    ----------
    a, A : ndarrays, shapes (n,), (n, n)
        Zero at the end of the data; changed in place: the adjoint of the start.
    w, u : ndarrays, shapes (n, n), (n,)
        Room.
    by_scalar : ndarray, shape (2, s)
        Zeros; filled for the variances of the scalars used: squares of the adjoint, and its covariance.
    by_noise : ndarray, shape (2, DENSITIES + VARIANCES)
        Zeros; the same, summed over the epochs, for densities and stationary variances of ``Noise``.
    """
    for e in range(end - 1, -1, -1):
        for m in range(schedule.seen[e + 1] - 1, schedule.seen[e] - 1, -1):
            for i in range(2, -1, -1):
                at = 3 * m + i
                if solved.mark[at] == 1:
                    by_scalar[1, at] = spread_over_scalar(at, linear, solved, A, u)
                    own = adjoint_over_scalar(at, linear, solved, a)
                    by_scalar[0, at] = own * own
        time_s = linear.spent[e, 0]
        for side in range(2):
            into = by_noise[side]
            for j in range(STATES):
                u[j] = a[j] * a[j] if side == 0 else A[j, j]
            for i in range(3):
                moved = a[i] * a[3 + i] if side == 0 else A[i, 3 + i]
                into[0] += u[6 + i] * time_s
                into[1] += time_s * (u[3 + i] + time_s * (moved + time_s * u[i] / 3.0))
                into[2] += u[BG + i] * time_s
                into[3] += u[BA + i] * time_s
            for i in range(2):
                into[4] += u[MNT + i] * time_s
            for i in range(VARIANCES):
                decay = linear.F[e, BLOCK + i]
                into[DENSITIES + i] += u[BARO if i == 6 else SLOW + i] * (1.0 - decay * decay)
        spread_over_step(e, pattern, linear, A, w)
        adjoint_over_step(e, pattern, linear, a, u)


@dataclass(frozen=True)
class Variances:
    """All that a model says, as a filter takes it.

    ``seen`` (m, 3) are the variances of the measurements.
    """

    seen: FloatArray
    noise: Noise
    start: Start


@dataclass(frozen=True)
class Scored:
    """Log-likelihood and its derivatives by some logarithms, each shape (n,).

    A derivative is what the data say less what the model expects of them; ``expected`` is the latter, and twice of it
    is a bound for the information: for so many degrees of freedom the number stands.
    """

    value: float
    gradient: FloatArray
    expected: FloatArray


def score_of(
    samples: Samples,
    plan: Plan,
    gate: Gate,
    known: Linear,
    end: int,
    variances: Callable[[FloatArray], Variances],
    at: FloatArray,
) -> Scored:
    """Return the log-likelihood of the epochs before ``end`` and its derivatives.

    Parameters
    ----------
    known : Linear
        Linearisation of the log.
    variances : callable
        What the model says where its numbers have these logarithms, shape (n,).
    at : ndarray, shape (n,)
    """
    of = variances(at)
    a, A, w, u = (np.zeros(shape) for shape in (STATES, (STATES, STATES), (STATES, STATES), STATES))
    by_scalar, by_noise = np.zeros((2, of.seen.size)), np.zeros((2, DENSITIES + VARIANCES))
    by_number: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def go() -> float:
        value, solved = solved_with(samples, plan, gate, known, end, of)
        run_score(plan.schedule, PATTERN, known, solved, end, a, A, w, u, by_scalar, by_noise)
        return value

    def differ() -> None:
        by_number.extend(_differences(variances, at, one) for one in range(len(at)))

    value = both(go, differ)
    by_start = np.stack([a * a, np.diagonal(A)])
    sides = np.array(
        [(by_noise @ noise + by_scalar @ seen + by_start @ start) / (4.0 * STEP) for noise, seen, start in by_number]
    ).reshape(-1, 2)
    return Scored(value, sides[:, 0] - sides[:, 1], sides[:, 1])


def _differences(
    variances: Callable[[FloatArray], Variances], at: FloatArray, number: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return by how much the variances change over two steps of one number.

    Those of noise, of measurements, of the start.
    """
    step = np.zeros(len(at))
    step[number] = STEP
    up, down = variances(at + step), variances(at - step)
    noise = np.concatenate([up.noise.density - down.noise.density, up.noise.variance - down.noise.variance])
    return noise, np.nan_to_num(up.seen - down.seen).ravel(), np.diagonal(up.start.p - down.start.p)


def solved_with(
    samples: Samples, plan: Plan, gate: Gate, known: Linear, end: int, of: Variances
) -> tuple[float, Solved]:
    """Return the log-likelihood of the epochs before ``end``, with gains and innovations."""
    count = of.seen.size
    plan = replace(plan, seen=plan.seen._replace(variance=of.seen))
    solved = nothing_kept()._replace(
        K=np.empty((count, STATES)), y=np.empty(count), S=np.ones(count), mark=np.zeros(count, dtype=np.int8)
    )
    now, room = of.start.now(), make_room(of.start.prior)
    value = filter_epochs(
        samples, plan, of.noise, gate, OWN_ESTIMATE, (0, end), now, room, known, solved, carries=False
    )
    return value, solved
