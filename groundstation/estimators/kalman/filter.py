"""Kalman filter and smoother of any linear system with scalar measurements, at the cost of its entries.

The frozen types hold arrays; the loops over them are compiled (``runs``, ``smoother_runs``). A compiled loop of another
room may call their parts (``kernels``) itself.
"""

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.records import Int64Array, frozen
from groundstation.estimators.kalman.arrays import (
    NO_STEP,
    REJECTED,
    USED,
    Drive,
    Dynamics,
    FloatArray,
    Lines,
    Marks,
    Now,
    Pattern,
    Record,
    Rules,
    Schedule,
    States,
)

NONE = frozen(np.zeros(0, dtype=np.int64))

# The loops are compiled once for each type of their arguments, and a read-only array is a type of its own: what goes in
# is read-only throughout, what comes out is writable while a loop fills it.


@dataclass(frozen=True)
class Transition:
    """F and Q of s distinct steps: x next = F x + noise of covariance Q.

    Parameters
    ----------
    size : int
        Number n of states.
    dynamics : Dynamics
        Made by :meth:`sparse`, :meth:`blocks` or :meth:`dense`.
    is_unrolled : bool
        The loops are compiled for just this number of states, which pays for small systems that run long: a compilation
        of some seconds for each number, kept in the cache.
    """

    size: int
    dynamics: Dynamics
    is_unrolled: bool = False

    def __post_init__(self) -> None:
        pattern, *arrays = self.dynamics
        object.__setattr__(self, "dynamics", Dynamics(Pattern(*map(frozen, pattern)), *map(frozen, arrays)))

    @classmethod
    def sparse(
        cls,
        size: int,
        rows: ArrayLike,
        columns: ArrayLike,
        values: ArrayLike,
        noise_rows: ArrayLike = NONE,
        noise_columns: ArrayLike = NONE,
        noise: ArrayLike | None = None,
        noise_before: ArrayLike | None = None,
    ) -> Self:
        """Transition with m entries in one pattern for all steps; a row without an entry is that of the identity.

        Parameters
        ----------
        rows, columns : ndarrays of int, shape (m,)
            In any order; a row that has an entry has all of its entries here, that on the diagonal among them.
        values : ndarray, shape (s, m)
        noise_rows, noise_columns : ndarrays of int, shape (q,)
            Entries of Q on the diagonal or above it.
        noise, noise_before : ndarrays, shape (s, q)
            Q as it is added after the transition, and (trapezoidal rule of a white noise over the step) before it.

        Raises
        ------
        ValueError
            For an entry outside the matrix, two at one place, or noise below the diagonal.
        """
        place = [np.asarray(part, dtype=np.int64) for part in (rows, columns, noise_rows, noise_columns)]
        entries = np.atleast_2d(np.asarray(values, dtype=np.float64))
        added = [_table(part, len(entries), len(place[2])) for part in (noise_before, noise)]
        if (place[2] > place[3]).any():
            raise ValueError("process noise below the diagonal: give its upper half alone")
        for which, (row, column) in zip(("transition", "noise"), (place[:2], place[2:]), strict=True):
            _check_places(which, row, column, size)
        order = np.lexsort((place[1], place[0]))
        changed, starts = np.unique(place[0][order], return_index=True)
        pattern = Pattern(changed, np.append(starts, len(order)).astype(np.int64), place[1][order])
        ordered = np.ascontiguousarray(entries[:, order])
        return cls(size, Dynamics(pattern, ordered, place[2], place[3], *added))

    @classmethod
    def blocks(cls, F: FloatArray, Q: FloatArray, count: int) -> Self:
        """``count`` equal systems side by side without ties: blocks F and Q of each step, shape (s, b, b)."""
        size, (_, _, each) = F.shape[1] * count, F.shape
        place = [np.nonzero(np.any(part != 0.0, axis=0)) for part in (F, np.triu(Q))]
        # a row that is zero in all steps is kept by its diagonal
        empty = np.setdiff1d(np.arange(each), place[0][0])
        place[0] = (np.append(place[0][0], empty), np.append(place[0][1], empty))
        offset = each * np.arange(count)[:, None]
        rows, columns, noise_rows, noise_columns = ((offset + part).ravel() for pair in place for part in pair)
        values, noise = (np.tile(part[:, pair[0], pair[1]], count) for part, pair in zip((F, Q), place, strict=True))
        return cls.sparse(size, rows, columns, values, noise_rows, noise_columns, noise)

    @classmethod
    def dense(cls, F: FloatArray, Q: FloatArray) -> Self:
        """Full matrices of each step, shape (s, n, n); all loops unrolled: for a handful of states."""
        nothing = np.zeros(0, dtype=np.int64)
        pattern = Pattern(nothing, np.zeros(1, dtype=np.int64), nothing)
        full = np.ascontiguousarray(F, dtype=np.float64), np.ascontiguousarray(Q, dtype=np.float64)
        none = np.zeros((0, *full[0].shape[1:]))
        return cls(full[0].shape[1], Dynamics(pattern, full[0], nothing, nothing, none, full[1]), is_unrolled=True)

    @property
    def states(self) -> States:
        """Numbers of the states as the compiled loops want them."""
        return tuple(range(self.size)) if self.is_unrolled else frozen(np.arange(self.size))


def _table(values: ArrayLike | None, steps: int, width: int) -> FloatArray:
    if values is None:
        return np.zeros((0, width))
    table = np.ascontiguousarray(np.atleast_2d(np.asarray(values, dtype=np.float64)))
    if table.shape != (steps, width):
        raise ValueError(f"noise has shape {table.shape}, expected {(steps, width)}: a row for each step")
    return table


def _check_places(which: str, rows: Int64Array, columns: Int64Array, size: int) -> None:
    places = np.concatenate([rows, columns])
    if len(rows) != len(columns) or (places < 0).any() or (places >= size).any():
        raise ValueError(f"{which}: rows and columns must pair up and lie within 0 to {size - 1}")
    if len(np.unique(rows * size + columns)) != len(rows):
        raise ValueError(f"{which}: two entries at one place: add them up")


@dataclass(frozen=True)
class Measurements:
    """Scalar measurements z = h x + noise, in the order in which they are used.

    Parameters
    ----------
    epoch : ndarray of int, shape (m,)
        Never decreasing.
    value : ndarray, shape (m, c) or (m,)
        One column for each right-hand side; NaN in any of them: absent.
    row : ndarray of int, shape (m,)
        Which row of ``lines`` each measures.
    lines : Lines
    """

    epoch: Int64Array
    value: FloatArray
    row: Int64Array
    lines: Lines

    def __post_init__(self) -> None:
        value = np.asarray(self.value, dtype=np.float64)
        table = np.ascontiguousarray(value[:, None] if value.ndim == 1 else value)
        for name, array in (("epoch", self.epoch), ("row", self.row), ("value", table)):
            object.__setattr__(self, name, frozen(array))
        object.__setattr__(self, "lines", Lines(*map(frozen, self.lines)))
        if len(self.epoch) != len(self.value) or (np.diff(self.epoch) < 0).any():
            raise ValueError(
                "epochs of the measurements: one for each, never decreasing; sort the measurements by time"
            )
        if (np.asarray(self.lines.variance) <= 0.0).any():
            raise ValueError("variances of measurements must be positive")

    def __len__(self) -> int:
        return len(self.epoch)

    @classmethod
    def of(
        cls,
        epoch: ArrayLike,
        value: ArrayLike,
        columns: ArrayLike,
        coefficients: ArrayLike,
        variance: ArrayLike,
        *,
        kind: ArrayLike | None = None,
        believed: ArrayLike | None = None,
    ) -> Self:
        """Every measurement with a row of its own.

        Parameters
        ----------
        epoch, value
            As of the class.
        columns, coefficients : ndarrays, shape (m, w)
            The entries of each row h; where it has less than w, coefficients are 0 and the columns anything.
        variance : ndarray, shape (m,) or ()
        kind : ndarray of int, shape (m,) or ()
            Rejections in a row are counted for each kind; neighbours of one epoch and one kind are judged together.
            Default: all of one kind where no two are of one epoch, else numbered within the epoch.
        believed : ndarray, shape (m,) or ()
            Variance for the gate; default: ``variance``.
        """
        at = np.asarray(epoch, dtype=np.int64)
        weights = np.asarray(coefficients, dtype=np.float64)
        where = np.broadcast_to(np.asarray(columns, dtype=np.int64), weights.shape)
        kept = weights != 0.0
        starts = np.concatenate([[0], np.cumsum(kept.sum(axis=1))]).astype(np.int64)
        weighted = np.broadcast_to(np.asarray(variance, dtype=np.float64), at.shape)
        given = weighted if believed is None else np.broadcast_to(np.asarray(believed, dtype=np.float64), at.shape)
        kinds = _place_within(at) if kind is None else np.broadcast_to(np.asarray(kind, dtype=np.int64), at.shape)
        lines = Lines(starts, where[kept], weights[kept], np.array(weighted), np.array(given), np.array(kinds))
        return cls(at, np.asarray(value), np.arange(len(at)), lines)


def _place_within(epoch: Int64Array) -> Int64Array:
    """Number of each measurement within its epoch: 0, 1, ..."""
    return np.arange(len(epoch)) - np.searchsorted(epoch, epoch)


@dataclass(frozen=True)
class Gate:
    """When measurements are rejected and when the filter is opened again.

    Parameters
    ----------
    sigmas : float
        Largest ratio of an innovation to its sigma; infinite: nothing is rejected.
    patience : ndarray of int, shape (kinds,) or ()
        So many rejections of a kind in a row, and it is the filter that is wrong: it is opened and goes on.
    opened : ndarray, shape (kinds, n) or (n,)
        Variances that opening adds.
    is_by_innovation : bool
        Opening adds the square of the innovation to the variance of the states measured as well.
    """

    sigmas: float = np.inf
    patience: ArrayLike = np.iinfo(np.int64).max
    opened: ArrayLike = 0.0
    is_by_innovation: bool = False

    def rules(self, kinds: int, size: int) -> Rules:
        """As the compiled loops want it."""
        patience = np.array(np.broadcast_to(np.asarray(self.patience, dtype=np.int64), kinds))
        opened = np.array(np.broadcast_to(np.asarray(self.opened, dtype=np.float64), (kinds, size)))
        return Rules(float(self.sigmas) ** 2, frozen(patience), frozen(opened), self.is_by_innovation)


@dataclass(frozen=True)
class Start:
    """State before the first epoch: ``x`` (n,) or (n, c), ``P`` (n, n), and rejections in a row of an earlier run."""

    x: FloatArray
    P: FloatArray
    in_a_row: Int64Array | None = None

    def now(self, kinds: int) -> Now:
        """A copy that a run may change."""
        x = np.asarray(self.x, dtype=np.float64)
        counted = np.zeros(kinds, dtype=np.int64) if self.in_a_row is None else np.array(self.in_a_row, dtype=np.int64)
        return Now(
            np.array((x[:, None] if x.ndim == 1 else x).T, order="C"), np.array(self.P, dtype=np.float64), counted
        )


@dataclass(frozen=True)
class Kept:
    """What a run writes down; smoothing needs all of the first three."""

    states: bool = True
    covariances: bool = True
    gains: bool = True
    variances: bool = False
    judged: bool = False


@dataclass(frozen=True)
class FilterRun:
    """History of a filter over n epochs and m measurements; arrays that were not kept have no length.

    Parameters
    ----------
    record : Record
        x (n, states, c), P (n, states, states), variance (n, states) after each epoch; gain K (m, states), innovation
        y (m, c), its variance S (m,), mark (m,): rejected -1, absent 0, used 1. y, S are given all before: white.
    end : Start
        Where it stands after the last epoch: another run may go on from it.
    reopened : int
        How often it was opened again.
    """

    transition: Transition
    schedule: Schedule
    measurements: Measurements
    record: Record
    end: Start
    reopened: int
    is_optimal: bool = field(default=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "record", Record(*(frozen(part) for part in self.record)))

    @property
    def x(self) -> FloatArray:
        """States after each epoch, shape (n, states, c)."""
        return self.record.x

    @property
    def P(self) -> FloatArray:  # noqa: N802
        """Covariances after each epoch, shape (n, states, states)."""
        return self.record.P

    @property
    def mark(self) -> Marks:
        """Rejected -1, absent 0, used 1, shape (m,)."""
        return self.record.mark

    @cached_property
    def rejected(self) -> int:
        """How many measurements the gate kept out."""
        return int((self.mark == REJECTED).sum())

    @cached_property
    def rejected_by_kind(self) -> Int64Array:
        """The same for each kind, shape (kinds,)."""
        lines = self.measurements.lines
        kind = lines.kind[self.measurements.row[self.mark == REJECTED]]
        return np.bincount(kind, minlength=_kinds(lines)).astype(np.int64)

    @cached_property
    def nis(self) -> FloatArray:
        """Squared innovation over its variance of every measurement used, shape (used, c): chi-square of 1 each."""
        used = self.mark == USED
        return np.asarray(self.record.y[used] ** 2 / self.record.S[used, None])


def _kinds(lines: Lines) -> int:
    return int(lines.kind.max()) + 1 if len(lines.kind) else 0


def run_filter(
    transition: Transition,
    step: ArrayLike,
    measurements: Measurements,
    start: Start,
    *,
    gate: Gate | None = None,
    held: ArrayLike = NONE,
    jump: ArrayLike | None = None,
    jumps: ArrayLike | None = None,
    drive: Drive | None = None,
    kept: Kept | None = None,
) -> FilterRun:
    """Filter measurements over epochs; where none is used the states are forecast.

    Parameters
    ----------
    transition : Transition
    step : ndarray of int, shape (n,)
        Which of the transition's steps leads to each epoch, -1 none: usually the first, which the start belongs to.
    measurements : Measurements
        Used one after the other (sequential scalar updates, Joseph's form). Without right-hand sides (value of shape
        (m, 0), start x of shape (n, 0)) the run is one of the covariance alone.
    start : Start
    gate : Gate, optional
    held : ndarray of int
        States that are considered, not estimated (Schmidt): they keep value and variance, their correlation counts.
    jump, jumps : ndarrays, shapes (n,), (j, states)
        Variances added before the measurements of epoch k: row ``jump[k]``, -1 none.
    drive : Drive, optional
        What moves a state besides F.
    kept : Kept, optional
        What is written down.

    Raises
    ------
    ValueError
        Where shapes do not agree.

    Examples
    --------
    >>> walk = Transition.sparse(1, [0], [0], [[1.0]], [0], [0], [[0.5]])
    >>> seen = Measurements.of([0, 1, 2], [1.0, 2.0, 30.0], [[0]], np.ones((3, 1)), 1.0)
    >>> run = run_filter(walk, [-1, 0, 0], seen, Start(np.zeros(1), np.eye(1)), gate=Gate(5.0))
    >>> run.x[:, 0, 0].round(3).tolist(), run.mark.tolist(), run.rejected
    ([0.5, 1.25, 1.25], [1, 1, -1], 1)
    """
    from groundstation.estimators.kalman import runs

    size, n = transition.size, len(np.asarray(step))
    lines, kept = measurements.lines, kept or Kept()
    steps = np.ascontiguousarray(step, dtype=np.int64)
    now = start.now(_kinds(lines))
    channels = measurements.value.shape[1]
    _check_run(transition, steps, measurements, now)
    first = np.zeros(n + 1, dtype=np.int64)
    np.cumsum(np.bincount(measurements.epoch, minlength=n), out=first[1:])
    jumped = np.full(n, NO_STEP, dtype=np.int64) if jump is None else np.ascontiguousarray(jump, dtype=np.int64)
    added = np.zeros((0, size)) if jumps is None else np.ascontiguousarray(jumps, dtype=np.float64)
    schedule = Schedule(*map(frozen, (steps, jumped, added, first, measurements.row)))
    record = _room(n, len(measurements), size, channels, kept)
    considered = frozen(np.array(held, dtype=np.int64))
    driven = drive or Drive(0, np.zeros((0, channels, channels)), np.zeros((0, channels)))
    reopened = runs.run_filter(
        transition.states,
        transition.dynamics,
        schedule,
        lines,
        (gate or Gate()).rules(_kinds(lines), size),
        Drive(driven.state, frozen(driven.mix), frozen(driven.push)),
        measurements.value,
        considered,
        now,
        record,
    )
    end = Start(frozen(now.x.T), frozen(now.p), frozen(now.in_a_row))
    return FilterRun(transition, schedule, measurements, record, end, int(reopened), not len(considered))


def _check_run(transition: Transition, step: Int64Array, measurements: Measurements, now: Now) -> None:
    size, channels = transition.size, measurements.value.shape[1]
    if now.x.shape != (channels, size) or now.p.shape != (size, size):
        found = f"x of shape {now.x.T.shape}, P of shape {now.p.shape}"
        raise ValueError(f"start: {found}, expected {(size, channels)} and {(size, size)}")
    if len(step) and step.max() >= len(transition.dynamics.F):
        raise ValueError(f"step {step.max()}: the transition has {len(transition.dynamics.F)} distinct ones")
    if len(measurements) and not 0 <= measurements.epoch[0] <= measurements.epoch[-1] < len(step):
        raise ValueError(f"measurements at epochs outside 0 to {len(step) - 1}")
    columns = measurements.lines.columns
    if len(columns) and not 0 <= columns.min() <= columns.max() < size:
        raise ValueError(f"measurements of states outside 0 to {size - 1}")


def _room(n: int, m: int, size: int, channels: int, kept: Kept) -> Record:
    """Arrays of a record, those that are not kept without length."""
    return Record(
        x=np.empty((n if kept.states else 0, size, channels)),
        P=np.empty((n if kept.covariances else 0, size, size)),
        variance=np.empty((n if kept.variances else 0, size)),
        K=np.empty((m if kept.gains else 0, size)),
        y=np.empty((m, channels)),
        S=np.empty(m),
        mark=np.zeros(m, dtype=np.int8),
        judged_innovation=np.empty((m if kept.judged else 0, channels)),
        judged_variance=np.empty(m if kept.judged else 0),
    )


@dataclass(frozen=True)
class Smoothed:
    """Smoothed states (n, states, c) and their variances (n, states), NaN outside the interval asked for."""

    x: FloatArray
    variance: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))


def smooth(run: FilterRun, begin: int = 0, end: int | None = None) -> Smoothed:
    """Smooth epochs ``begin`` to ``end`` (both included) with the data up to ``end``.

    Raises
    ------
    ValueError
        Where the run kept too little, or held states: a smoother goes back over optimal gains alone.

    Source: Rauch, Tung, Striebel, 1965, in the form of Bryson and Frazier (Bierman, 1973).
    """
    from groundstation.estimators.kalman import smoother_runs

    last = len(run.schedule.step) - 1 if end is None else end
    x, variance = np.full(run.x.shape, np.nan), np.full(run.x.shape[:2], np.nan)
    smoother_runs.run_smoother(*_history(run), begin, last, x, variance)
    return Smoothed(x, variance)


def smooth_lags(run: FilterRun, begin: Int64Array, end: Int64Array) -> FloatArray:
    """Smooth epoch ``begin[i]`` with the data up to ``end[i]``, for each i: states alone, shape (s, states, c)."""
    from groundstation.estimators.kalman import smoother_runs

    past = np.empty((len(begin), *run.x.shape[1:]))
    smoother_runs.run_fixed_lag(*_history(run), _index(begin), _index(end), past)
    return past


def lag_covariances(run: FilterRun, begin: Int64Array, end: Int64Array) -> tuple[FloatArray, FloatArray]:
    """Covariance of epoch ``begin[i]`` given the data up to ``end[i]``, and how errors travel between, for each i.

    Returns
    -------
    smoothed : ndarray, shape (s, states, states)
    closed : ndarray, shape (s, states, states)
        Product of (I - K h) F from begin to end: error at end that an error at begin leaves.
    """
    from groundstation.estimators.kalman import smoother_runs

    smoothed, closed = (np.empty((len(begin), *run.P.shape[1:])) for _ in range(2))
    smoother_runs.run_lag_covariance(*_history(run), _index(begin), _index(end), smoothed, closed)
    return smoothed, closed


def _history(run: FilterRun) -> tuple[States, Dynamics, Schedule, Lines, Record]:
    """What the smoothers go back over.

    Raises
    ------
    ValueError
        Where the run kept too little, or held states: a smoother goes back over optimal gains alone.
    """
    n = len(run.schedule.step)
    if not run.is_optimal:
        raise ValueError("a run with held states cannot be smoothed: estimate them")
    if not len(run.x) == len(run.P) == n or len(run.record.K) != len(run.measurements):
        raise ValueError("smoothing needs states, covariances and gains: run the filter with them kept")
    return run.transition.states, run.transition.dynamics, run.schedule, run.measurements.lines, run.record


def _index(values: Int64Array) -> Int64Array:
    return frozen(np.ascontiguousarray(values, dtype=np.int64))


def forecast(
    transition: Transition, step: Int64Array, start: FloatArray, known: FloatArray, every: int, drive: Drive
) -> FloatArray:
    """Carry many starts forward together: what one state of each builds up.

    Parameters
    ----------
    transition : Transition
        Sparse.
    step : ndarray of int, shape (k,)
        Which of the transition's steps follow each other.
    start : ndarray, shape (states, c, s)
    known : ndarray, shape (c, s)
        What the driven state had built up before the start: it is dragged as well.
    every : int
        Steps between two leads.
    drive : Drive
        ``mix`` of shape (k, c, c, s) or without length; ``push`` is not used.

    Returns
    -------
    ndarray, shape (k // every, c, s)
    """
    from groundstation.estimators.kalman import runs

    x = np.array(start, order="C")
    built_up = np.zeros((len(step) // every, *x.shape[1:]))
    moved = Drive(drive.state, frozen(drive.mix), frozen(drive.push))
    inputs = frozen(np.ascontiguousarray(known))
    runs.run_forecast(transition.dynamics, _index(step), moved, inputs, every, x, np.empty_like(x), built_up)
    return built_up


def distinct_steps(interval_s: FloatArray, resolution_s: float, most: int) -> tuple[FloatArray, Int64Array]:
    """Distinct intervals and which of them each is: equal ones share one transition.

    Parameters
    ----------
    interval_s : ndarray, shape (n,)
    resolution_s : float
        Intervals that agree to this are one; ten times as coarse until there are no more than ``most``.

    Examples
    --------
    >>> seconds, index = distinct_steps(np.array([0.0, 1.0, 1.00001, 2.0]), 1e-4, 100)
    >>> seconds.tolist(), index.tolist()
    ([0.0, 1.0, 2.0], [0, 1, 1, 2])
    """
    rounded = np.round(interval_s / resolution_s).astype(np.int64)
    while len(np.unique(rounded)) > most:
        resolution_s *= 10.0
        rounded = np.round(interval_s / resolution_s).astype(np.int64)
    distinct, index = np.unique(rounded, return_inverse=True)
    return np.asarray(distinct * resolution_s, dtype=np.float64), index.astype(np.int64)
