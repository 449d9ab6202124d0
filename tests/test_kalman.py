"""The Kalman core against dense textbook matrices, batch least squares and chi-square bands."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.linalg import block_diag, expm
from scipy.stats import chi2

from groundstation.base.angles import FloatArray
from groundstation.base.compile import Loop
from groundstation.methods.kalman.arrays import ABSENT, REJECTED, USED
from groundstation.methods.kalman.filter import (
    FilterRun,
    InnovationGate,
    KeptArrays,
    Measurements,
    Start,
    run_filter,
)
from groundstation.methods.kalman.smoother import smooth
from groundstation.methods.kalman.transition import Transition

ROUNDING = 1e-9  # of sigmas: double precision over some hundred products
BATCH_ROUNDING = 1e-7  # of sigmas: the normal equations of 40 epochs
TAIL = 0.0005  # either side of a chi-square band
SEED_MODEL, SEED_TRUTH = 11, range(100, 140)
SIZE = 6  # as the channels of the INS have: full matrices of so many states are compiled once


@dataclass(frozen=True)
class Case:
    """A random stable system with sparse matrices, two steps, irregular measurements, some absent."""

    F: FloatArray  # (s, n, n)
    Q: FloatArray
    step: FloatArray
    epoch: FloatArray
    H: FloatArray  # (m, n)
    R: FloatArray  # (m,)
    P0: FloatArray

    @property
    def transition(self) -> Transition:
        return sparse_of(self.F, self.Q)

    def measurements(self, z: FloatArray, **extra: object) -> Measurements:
        columns = np.tile(np.arange(self.H.shape[1]), (len(self.H), 1))
        return Measurements.of(self.epoch, z, columns, self.H, self.R, **extra)  # type: ignore[arg-type]


def sparse_of(F: FloatArray, Q: FloatArray) -> Transition:
    """Only the entries that are not zero; rows of the identity left out."""
    size = F.shape[1]
    is_identity = np.isclose(F, np.eye(size), rtol=0.0, atol=0.0).all(axis=(0, 2))
    rows, columns = np.nonzero((F != 0.0).any(axis=0) & ~is_identity[:, None])
    above, right = np.nonzero(np.triu((Q != 0.0).any(axis=0)))
    return Transition.sparse(size, rows, columns, F[:, rows, columns], above, right, Q[:, above, right])


def case(seed: int = SEED_MODEL, n: int = 40) -> Case:
    rng = np.random.default_rng(seed)
    A = np.zeros((SIZE, SIZE))
    A[0, 1], A[1, 2], A[2, 1], A[3, 3], A[5, 5] = 1.0, -1.0, 0.4, -0.2, -0.1
    F = np.stack([expm(A * seconds) for seconds in (1.0, 2.5)])
    F[:, 4] = np.eye(SIZE)[4]  # a constant
    F[np.abs(F) < 1e-12] = 0.0
    Q = np.zeros((2, SIZE, SIZE))
    root = 0.2 * rng.normal(size=(3, 3))
    Q[0, 1:4, 1:4], Q[1, 1:4, 1:4] = root @ root.T, 2.5 * root @ root.T
    step = rng.integers(0, 2, n)
    step[0] = -1
    each = rng.integers(0, 4, n)
    epoch = np.repeat(np.arange(n), each)
    H = rng.normal(size=(len(epoch), SIZE)) * (rng.random((len(epoch), SIZE)) < 0.5)
    single = rng.random(len(epoch)) < 0.4
    H[single] = np.eye(SIZE)[rng.integers(0, SIZE, single.sum())] * 2.0
    H[~H.any(axis=1), 0] = 1.0
    return Case(F, Q, step, epoch, H, rng.uniform(0.05, 2.0, len(epoch)), np.diag([4.0, 1.0, 0.5, 2.0, 3.0, 1.5]))


def draw(model: Case, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """True states (n, 6) and measurements (m,)."""
    x = np.linalg.cholesky(model.P0) @ rng.standard_normal(SIZE)
    truth = np.empty((len(model.step), SIZE))
    for k, step in enumerate(model.step):
        if step >= 0:
            values, vectors = np.linalg.eigh(model.Q[step])
            noise = vectors @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(SIZE))
            x = model.F[step] @ x + noise
        truth[k] = x
    z = np.einsum("mi,mi->m", model.H, truth[model.epoch]) + np.sqrt(model.R) * rng.standard_normal(len(model.R))
    return truth, z


@dataclass(frozen=True)
class Textbook:
    x: FloatArray
    P: FloatArray


def textbook(model: Case, z: FloatArray, x0: FloatArray) -> Textbook:
    """Full matrices, all measurements of an epoch at once. Source: Grewal and Andrews, 4th ed. 2015, table 4.3."""
    x, P, out = (
        x0.copy(),
        model.P0.copy(),
        Textbook(*(np.empty((len(model.step), SIZE, *rest)) for rest in ((), (SIZE,)))),
    )
    for k, step in enumerate(model.step):
        if step >= 0:
            x, P = model.F[step] @ x, model.F[step] @ P @ model.F[step].T + model.Q[step]
        use = (model.epoch == k) & np.isfinite(z)
        H, R = model.H[use], np.diag(model.R[use])
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R) if use.any() else np.zeros((SIZE, 0))
        x, left = x + K @ (z[use] - H @ x), np.eye(SIZE) - K @ H
        P = left @ P @ left.T + K @ R @ K.T
        out.x[k], out.P[k] = x, P
    return out


def batch(model: Case, z: FloatArray) -> Textbook:
    """Least squares for all epochs at once: smoothed states and covariances. P0 is the prior of the first epoch."""
    n = len(model.step)
    S, F_all = model.P0, np.eye(SIZE)
    prior = np.zeros((n * SIZE, n * SIZE))  # covariance of all states
    carried = [np.eye(SIZE)]
    for k in range(n):
        if model.step[k] >= 0:
            F = model.F[model.step[k]]
            S = F @ S @ F.T + model.Q[model.step[k]]
            prior[: k * SIZE, k * SIZE : (k + 1) * SIZE] = prior[: k * SIZE, (k - 1) * SIZE : k * SIZE] @ F.T
            prior[k * SIZE : (k + 1) * SIZE, : k * SIZE] = prior[: k * SIZE, k * SIZE : (k + 1) * SIZE].T
        prior[k * SIZE : (k + 1) * SIZE, k * SIZE : (k + 1) * SIZE] = S
        carried.append(F_all)
    use = np.isfinite(z)
    H = np.zeros((use.sum(), n * SIZE))
    for line, (epoch, row) in enumerate(zip(model.epoch[use], model.H[use], strict=True)):
        H[line, epoch * SIZE : (epoch + 1) * SIZE] = row
    gain = prior @ H.T @ np.linalg.inv(H @ prior @ H.T + np.diag(model.R[use]))
    P = prior - gain @ H @ prior
    blocks = np.stack([P[k * SIZE : (k + 1) * SIZE, k * SIZE : (k + 1) * SIZE] for k in range(n)])
    return Textbook((gain @ z[use]).reshape(n, SIZE), blocks)


def start_of(model: Case) -> Start:
    return Start(np.zeros(SIZE), model.P0)


def holed(z: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.where(rng.random(len(z)) < 0.2, np.nan, z)


def apart(run: FilterRun, other: Textbook) -> float:
    """Largest difference of states and covariances, in sigmas."""
    sigma = np.sqrt(np.einsum("nii->ni", other.P))
    states = np.abs(run.x[:, :, 0] - other.x) / sigma
    covariances = np.abs(run.P - other.P) / (sigma[:, :, None] * sigma[:, None, :])
    return float(max(states.max(), covariances.max()))


def test_filter_is_the_textbooks() -> None:
    model, rng = case(), np.random.default_rng(1)
    z = holed(draw(model, rng)[1], rng)
    run = run_filter(model.transition, model.step, model.measurements(z), start_of(model))
    assert apart(run, textbook(model, z, np.zeros(SIZE))) < ROUNDING
    assert np.array_equal(run.mark == ABSENT, np.isnan(z))


def test_what_is_handed_over_read_only_runs_by_kept_code(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(loop: Loop, _arguments: object) -> None:
        raise AssertionError(f"{loop.py_func.__qualname__} would load numba in every process")

    model = case()
    z = draw(model, np.random.default_rng(3))[1]
    monkeypatch.setattr(Loop, "_run_ordinary", refused)
    transition = Transition.dense(model.F, model.Q)
    assert not transition.dynamics.F.flags.writeable
    smooth(run_filter(transition, model.step, model.measurements(z), start_of(model)))


def test_sparse_equals_dense() -> None:
    model = case()
    z = draw(model, np.random.default_rng(2))[1]
    sparse = run_filter(model.transition, model.step, model.measurements(z), start_of(model))
    dense = run_filter(Transition.dense(model.F, model.Q), model.step, model.measurements(z), start_of(model))
    assert apart(sparse, Textbook(dense.x[:, :, 0], dense.P)) < ROUNDING
    smoothed, again = smooth(sparse), smooth(dense)
    sigma = np.sqrt(again.variance)
    assert np.max(np.abs(smoothed.x - again.x)[:, :, 0] / sigma) < ROUNDING
    assert np.sqrt(smoothed.variance) == pytest.approx(sigma, rel=ROUNDING)


def test_blocks_equal_a_block_diagonal_matrix() -> None:
    model, count = case(), 3
    blocks = Transition.blocks(model.F, model.Q, count)
    full = sparse_of(*(np.stack([block_diag(*[part] * count) for part in whole]) for whole in (model.F, model.Q)))
    rng = np.random.default_rng(3)
    root = rng.normal(size=(3 * SIZE, 3 * SIZE))
    nothing = Measurements.of([], np.zeros(0), np.zeros((0, 1)), np.zeros((0, 1)), 1.0)
    start = Start(rng.normal(size=3 * SIZE), root @ root.T)
    runs = [run_filter(which, [0, 1, 1], nothing, start) for which in (blocks, full)]
    assert runs[0].x == pytest.approx(runs[1].x, rel=1e-12, abs=1e-12)
    assert np.allclose(runs[0].P, runs[1].P, rtol=1e-12, atol=1e-12)
    assert len(blocks.dynamics.F[0]) < 3 * SIZE * SIZE


def test_rows_of_zeros_are_zero_and_not_the_identitys() -> None:
    F = np.array([[[1.0, 1.0], [0.0, 0.0]]])
    nothing = Measurements.of([], np.zeros(0), np.zeros((0, 1)), np.zeros((0, 1)), 1.0)
    run = run_filter(Transition.blocks(F, np.zeros_like(F), 1), [0], nothing, Start(np.array([1.0, 2.0]), np.eye(2)))
    assert run.x[0, :, 0].tolist() == [3.0, 0.0]
    assert run.P[0].tolist() == [[2.0, 0.0], [0.0, 0.0]]


def test_noiseless_truth_is_found_to_rounding() -> None:
    model, rng = case(), np.random.default_rng(4)
    quiet = replace(model, Q=np.zeros_like(model.Q), R=np.full(len(model.R), 1e-12))
    truth, _ = draw(quiet, rng)
    z = np.einsum("mi,mi->m", model.H, truth[model.epoch])
    run = run_filter(quiet.transition, model.step, quiet.measurements(z), start_of(model))
    smoothed = smooth(run)
    assert np.abs(run.x[-1, :, 0] - truth[-1]).max() < 1e-5
    assert np.abs(smoothed.x[:, :, 0] - truth).max() < 1e-4


def test_covariance_stays_symmetric_to_the_last_bit_and_positive() -> None:
    """Variances of 1e8 against measurements of 1e-4, single states and nearly parallel rows, 400 of them."""
    rng = np.random.default_rng(5)
    n, m = 6, 400
    H = np.ones((m, n)) + 1e-2 * rng.normal(size=(m, n))
    H[::5] = np.eye(n)[rng.integers(0, n, m // 5)]
    at = np.arange(m)
    walk = Transition.sparse(n, [0], [0], [[1.0]], range(n), range(n), [np.full(n, 1e-9)])
    seen = Measurements.of(at, rng.normal(size=m), np.tile(np.arange(n), (m, 1)), H, 1e-4)
    run = run_filter(walk, np.where(at == 0, -1, 0), seen, Start(np.zeros(n), 1e8 * np.eye(n)))
    assert np.array_equal(run.P, np.swapaxes(run.P, 1, 2))
    assert (np.einsum("nii->ni", run.P) > 0.0).all()
    scaled = run.P[-1] / np.sqrt(np.outer(np.diag(run.P[-1]), np.diag(run.P[-1])))
    assert np.linalg.eigvalsh(scaled).min() > 0.0


def test_errors_are_as_large_as_the_filter_says() -> None:
    """NEES and NIS over 40 flights inside their 99.9 % chi-square bands, filtered and smoothed."""
    model = case()
    squares, smoothed_squares, whitened, used = 0.0, np.zeros(SIZE), 0.0, 0
    for seed in SEED_TRUTH:
        truth, z = draw(model, np.random.default_rng(seed))
        run = run_filter(model.transition, model.step, model.measurements(z), start_of(model))
        error = run.x[-1, :, 0] - truth[-1]
        squares += float(error @ np.linalg.solve(run.P[-1], error))
        back = smooth(run)
        smoothed_squares += (back.x[20, :, 0] - truth[20]) ** 2 / back.variance[20]
        whitened, used = whitened + float(run.nis.sum()), used + len(run.nis)
    count = len(SEED_TRUTH)
    for found, freedom in ((squares, count * SIZE), (whitened, used), *((part, count) for part in smoothed_squares)):
        assert chi2.ppf(TAIL, freedom) < found < chi2.ppf(1.0 - TAIL, freedom)


def test_smoother_is_batch_least_squares() -> None:
    model, rng = case(), np.random.default_rng(6)
    z = holed(draw(model, rng)[1], rng)
    smoothed = smooth(run_filter(model.transition, model.step, model.measurements(z), start_of(model)))
    expected = batch(model, z)
    sigma = np.sqrt(np.einsum("nii->ni", expected.P))
    assert np.max(np.abs(smoothed.x[:, :, 0] - expected.x) / sigma) < BATCH_ROUNDING
    assert np.sqrt(smoothed.variance) == pytest.approx(sigma, rel=BATCH_ROUNDING)


def test_gate_counts_what_it_rejects_and_the_rest_is_as_if_it_were_absent() -> None:
    model = case()
    z = draw(model, np.random.default_rng(7))[1]
    z[[5, 20, 21]] += 1e4
    kinds = np.arange(len(z)) % 3
    run = run_filter(
        model.transition, model.step, model.measurements(z, kind=kinds), start_of(model), gate=InnovationGate(20.0)
    )
    assert np.flatnonzero(run.mark == REJECTED).tolist() == [5, 20, 21]
    assert run.rejected == 3
    assert run.rejected_by_kind.tolist() == [1, 0, 2]
    z[[5, 20, 21]] = np.nan
    without = run_filter(model.transition, model.step, model.measurements(z, kind=kinds), start_of(model))
    assert np.array_equal(run.x, without.x)
    assert np.array_equal(run.record.K[run.mark == REJECTED], np.zeros((3, SIZE)))


def test_neighbours_of_one_kind_are_judged_together() -> None:
    still = Transition.sparse(2, [0], [0], [[1.0]])
    z = np.array([0.1, 50.0, 0.2, 0.3, np.nan, 0.1])
    seen = Measurements.of([0, 0, 1, 1, 2, 2], z, np.array([[0], [1]] * 3), np.ones((6, 1)), 1.0, kind=0)
    run = run_filter(
        still, [-1, 0, 0], seen, Start(np.zeros(2), np.eye(2)), gate=InnovationGate(5.0), kept=KeptArrays(judged=True)
    )
    assert run.mark.tolist() == [REJECTED, REJECTED, USED, USED, ABSENT, USED]
    assert run.record.judged_variance[2:4].tolist() == [2.0, 2.0]
    assert np.isnan(run.record.judged_variance[4])


@pytest.mark.parametrize("is_by_innovation", [False, True])
def test_filter_that_rejects_for_too_long_is_opened_again(is_by_innovation: bool) -> None:
    still = Transition.sparse(2, [0], [0], [[1.0]])
    z = np.where(np.arange(20) < 10, 0.0, 100.0)
    seen = Measurements.of(np.arange(20), z, np.zeros((20, 1), dtype=int), np.full((20, 1), 2.0), 1.0)
    gate = InnovationGate(
        5.0, patience=3, opened=0.0 if is_by_innovation else [1e4, 0.0], is_by_innovation=is_by_innovation
    )
    run = run_filter(still, [-1] + [0] * 19, seen, Start(np.zeros(2), np.eye(2)), gate=gate)
    assert run.reopened == 1
    assert (run.mark == REJECTED).nonzero()[0].tolist() == [10, 11, 12]
    assert run.x[-1, 0, 0] == pytest.approx(50.0, abs=1.0)
    assert run.P[-1, 1, 1] == 1.0


def test_held_states_keep_their_value_and_count_in_the_gain() -> None:
    """Schmidt's filter: gain of the estimated states from the whole covariance, P by Joseph for that gain."""
    model, held = case(), [2, 4]
    z = draw(model, np.random.default_rng(8))[1]
    run = run_filter(model.transition, model.step, model.measurements(z), start_of(model), held=held)
    x, P = np.zeros(SIZE), model.P0.copy()
    for k, step in enumerate(model.step):
        if step >= 0:
            x, P = model.F[step] @ x, model.F[step] @ P @ model.F[step].T + model.Q[step]
        for m in np.flatnonzero(model.epoch == k):
            h, R = model.H[m], model.R[m]
            K = P @ h / (h @ P @ h + R)
            K[held] = 0.0
            x, left = x + K * (z[m] - h @ x), np.eye(SIZE) - np.outer(K, h)
            P = left @ P @ left.T + R * np.outer(K, K)
        assert run.x[k, :, 0] == pytest.approx(x, rel=1e-9, abs=1e-9)
        assert run.P[k] == pytest.approx(P, rel=1e-9, abs=1e-9)
    with pytest.raises(ValueError, match="held"):
        smooth(run)


def test_states_without_tie_to_a_measurement_are_not_touched() -> None:
    still = Transition.sparse(4, [0], [0], [[1.0]])
    P = np.diag([1.0, 2.0, 3.0, 4.0])
    P[0, 1] = P[1, 0] = 0.5
    seen = Measurements.of([0], [1.0], [[0]], [[1.0]], 1.0)
    run = run_filter(still, [-1], seen, Start(np.zeros(4), P))
    assert run.x[0, :, 0].tolist() == [0.5, 0.25, 0.0, 0.0]
    assert np.array_equal(run.P[0, 2:], P[2:])


def test_right_hand_sides_share_a_covariance_and_none_is_covariance_alone() -> None:
    model = case()
    z = np.stack([draw(model, np.random.default_rng(seed))[1] for seed in (9, 10)], axis=1)
    both = run_filter(model.transition, model.step, model.measurements(z), Start(np.zeros((SIZE, 2)), model.P0))
    for side in range(2):
        alone = run_filter(model.transition, model.step, model.measurements(z[:, side]), start_of(model))
        assert np.array_equal(both.x[:, :, side], alone.x[:, :, 0])
        assert np.array_equal(smooth(both).x[:, :, side], smooth(alone).x[:, :, 0])
    blind = run_filter(model.transition, model.step, model.measurements(z[:, :0]), Start(np.zeros((SIZE, 0)), model.P0))
    assert np.array_equal(blind.P, both.P)


def test_run_goes_on_where_another_ended() -> None:
    model = case()
    z = draw(model, np.random.default_rng(12))[1]
    whole = run_filter(model.transition, model.step, model.measurements(z), start_of(model))
    cut = 17
    early = model.epoch < cut
    parts = [
        replace(model, epoch=model.epoch[use] - offset, H=model.H[use], R=model.R[use], step=step).measurements(z[use])
        for use, offset, step in ((early, 0, model.step[:cut]), (~early, cut, model.step[cut:]))
    ]
    first = run_filter(model.transition, model.step[:cut], parts[0], start_of(model))
    second = run_filter(model.transition, model.step[cut:], parts[1], first.end)
    assert np.array_equal(np.concatenate([first.P, second.P]), whole.P)
    assert np.array_equal(np.concatenate([first.x, second.x]), whole.x)


def test_jump_opens_variances_and_noise_before_is_half_of_the_trapezoid() -> None:
    nothing = Measurements.of([], np.zeros(0), np.zeros((0, 1)), np.zeros((0, 1)), 1.0)
    moving = Transition.sparse(2, [0, 0], [0, 1], [[1.0, 2.0]], [1], [1], [[0.5]], [[0.5]])
    start = Start(np.zeros(2), np.zeros((2, 2)))
    run = run_filter(moving, [0, -1], nothing, start, jump=[-1, 0], jumps=[[7.0, 0.0]])
    assert run.P[0].tolist() == [[2.0, 1.0], [1.0, 1.0]]
    assert run.P[1].tolist() == [[9.0, 1.0], [1.0, 1.0]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rows": [9]}, "within 0 to 1"),
        ({"rows": [0, 0], "columns": [1, 1], "values": [[1.0, 2.0]]}, "two entries"),
        ({"noise_rows": [1], "noise_columns": [0], "noise": [[1.0]]}, "below the diagonal"),
        ({"noise_rows": [0], "noise_columns": [0], "noise": [[1.0, 2.0]]}, "shape"),
    ],
)
def test_transition_that_is_none_says_why(change: dict[str, object], message: str) -> None:
    given: dict[str, object] = {"rows": [0], "columns": [0], "values": [[1.0]]} | change
    with pytest.raises(ValueError, match=message):
        Transition.sparse(2, **given)  # type: ignore[arg-type]


def test_measurements_out_of_order_or_of_no_state_are_refused() -> None:
    still = Transition.sparse(1, [0], [0], [[1.0]])
    start = Start(np.zeros(1), np.eye(1))
    with pytest.raises(ValueError, match="never decreasing"):
        Measurements.of([1, 0], [0.0, 0.0], [[0]], np.ones((2, 1)), 1.0)
    with pytest.raises(ValueError, match="positive"):
        Measurements.of([0], [0.0], [[0]], [[1.0]], 0.0)
    with pytest.raises(ValueError, match="states outside"):
        run_filter(still, [-1], Measurements.of([0], [0.0], [[3]], [[1.0]], 1.0), start)
    with pytest.raises(ValueError, match="epochs outside"):
        run_filter(still, [-1], Measurements.of([2], [0.0], [[0]], [[1.0]], 1.0), start)
    with pytest.raises(ValueError, match="start"):
        run_filter(still, [-1], Measurements.of([0], [0.0], [[0]], [[1.0]], 1.0), Start(np.zeros(2), np.eye(2)))


def test_the_arrays_of_a_record_are_parts_of_one_memory_and_do_not_meet() -> None:
    n, kept = 40, KeptArrays()
    walk = Transition.sparse(2, [0], [1], [[0.1]], [0, 1], [0, 1], [[0.5, 0.1]])
    seen = Measurements.of(np.arange(n), np.sin(np.arange(n)), [[0]] * n, np.ones((n, 1)), 1.0)
    run = run_filter(walk, [-1, *[0] * (n - 1)], seen, Start(np.zeros(2), np.eye(2)), kept=kept)
    arrays = [one for one in run.record if one.dtype == np.float64]
    whole = arrays[0]
    while whole.base is not None:
        whole = whole.base
    places = sorted((one.ctypes.data, one.nbytes) for one in arrays if one.size)
    assert sum(size for _, size in places) == whole.nbytes
    assert [at for at, _ in places[1:]] == [at + size for at, size in places[:-1]]
