"""Kalman filter and smoother of any linear system with scalar measurements.

It costs as much as the matrices have entries. The frozen types hold arrays; the loops over them are compiled (``runs``,
``smoother_runs``). A compiled loop of another folder may call their parts (``kernels``) itself.
"""

from dataclasses import field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.dataclasses import dataclass
from groundstation.base.one_memory import arrays_at_once
from groundstation.base.records import Int64Array, frozen
from groundstation.methods.kalman.arrays import (
    NO_STEP,
    REJECTED,
    USED,
    Drive,
    FilterRecord,
    FilterWorkspace,
    FloatArray,
    GateRules,
    Marks,
    MeasurementRows,
    Now,
    Schedule,
)
from groundstation.methods.kalman.transition import NONE, Transition


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
        Row of ``lines`` that each measures.
    lines : MeasurementRows
    """

    epoch: Int64Array
    value: FloatArray
    row: Int64Array
    lines: MeasurementRows

    def __post_init__(self) -> None:
        value = np.asarray(self.value, dtype=np.float64)
        table = np.ascontiguousarray(value[:, None] if value.ndim == 1 else value)
        for name, array in (("epoch", self.epoch), ("row", self.row), ("value", table)):
            object.__setattr__(self, name, frozen(array))
        object.__setattr__(self, "lines", MeasurementRows(*map(frozen, self.lines)))
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
        lines = MeasurementRows(
            starts, where[kept], weights[kept], np.array(weighted), np.array(given), np.array(kinds)
        )
        return cls(at, np.asarray(value), np.arange(len(at)), lines)


def _place_within(epoch: Int64Array) -> Int64Array:
    """Number of each measurement within its epoch: 0, 1, ..."""
    return np.arange(len(epoch)) - np.searchsorted(epoch, epoch)


@dataclass(frozen=True)
class InnovationGate:
    """Rules by which measurements are rejected and the filter is opened again.

    Parameters
    ----------
    sigmas : float
        Largest ratio of an innovation to its sigma; infinite: nothing is rejected.
    patience : ndarray of int, shape (kinds,) or ()
        Number of rejections of a kind in a row after which the filter itself is taken to be wrong: it is opened and
        goes on.
    opened : ndarray, shape (kinds, n) or (n,)
        Variances that opening adds.
    is_by_innovation : bool
        Opening adds the square of the innovation to the variance of the states measured as well.
    """

    sigmas: float = np.inf
    patience: ArrayLike = np.iinfo(np.int64).max
    opened: ArrayLike = 0.0
    is_by_innovation: bool = False

    def rules(self, kinds: int, size: int) -> GateRules:
        """Return the rules as the compiled loops want them."""
        patience = np.array(np.broadcast_to(np.asarray(self.patience, dtype=np.int64), kinds))
        opened = np.array(np.broadcast_to(np.asarray(self.opened, dtype=np.float64), (kinds, size)), order="C")
        return GateRules(float(self.sigmas) ** 2, frozen(patience), frozen(opened), self.is_by_innovation)


@dataclass(frozen=True)
class Start:
    """State before the first epoch: ``x`` (n,) or (n, c), ``P`` (n, n).

    It also has the rejections in a row of an earlier run.
    """

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
class KeptArrays:
    """Choice of the arrays that a run keeps; smoothing needs all of the first three."""

    states: bool = True
    covariances: bool = True
    gains: bool = True
    variances: bool = False
    judged: bool = False


@dataclass(frozen=True)
class FilterRun:
    """History of a filter over n epochs and m measurements.

    Arrays that were not kept have no length.

    Parameters
    ----------
    record : FilterRecord
        x (n, states, c), P (n, states, states), variance (n, states) after each epoch; gain K (m, states), innovation
        y (m, c), its variance S (m,), mark (m,): rejected -1, absent 0, used 1. y, S are given all before: white.
    end : Start
        Where it stands after the last epoch: another run may go on from it.
    reopened : int
        Number of times it was opened again.
    """

    transition: Transition
    schedule: Schedule
    measurements: Measurements
    record: FilterRecord
    end: Start
    reopened: int
    is_optimal: bool = field(default=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "record", FilterRecord(*(frozen(part) for part in self.record)))

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
        """Number of measurements that the gate kept out."""
        return int((self.mark == REJECTED).sum())

    @cached_property
    def rejected_by_kind(self) -> Int64Array:
        """Number of rejected measurements of each kind, shape (kinds,)."""
        lines = self.measurements.lines
        kind = lines.kind[self.measurements.row[self.mark == REJECTED]]
        return np.bincount(kind, minlength=_kinds(lines)).astype(np.int64)

    @cached_property
    def nis(self) -> FloatArray:
        """Squared innovation over its variance of every measurement used, shape (used, c).

        Each has a chi-square distribution with one degree of freedom.
        """
        used = self.mark == USED
        return np.asarray(self.record.y[used] ** 2 / self.record.S[used, None])


def _kinds(lines: MeasurementRows) -> int:
    return int(lines.kind.max()) + 1 if len(lines.kind) else 0


def run_filter(
    transition: Transition,
    step: ArrayLike,
    measurements: Measurements,
    start: Start,
    *,
    gate: InnovationGate | None = None,
    held: ArrayLike = NONE,
    jump: ArrayLike | None = None,
    jumps: ArrayLike | None = None,
    drive: Drive | None = None,
    kept: KeptArrays | None = None,
) -> FilterRun:
    """Filter measurements over epochs; without any the states are forecast.

    Parameters
    ----------
    transition : Transition
    step : ndarray of int, shape (n,)
        Number of the transition's step that leads to each epoch, -1 none: usually the first, which the start belongs
        to.
    measurements : Measurements
        Used one after the other (sequential scalar updates, Joseph's form). Without right-hand sides (value of shape
        (m, 0), start x of shape (n, 0)) the run is one of the covariance alone.
    start : Start
    gate : InnovationGate, optional
    held : ndarray of int
        States that are considered, not estimated (Schmidt): they keep value and variance, their correlation counts.
    jump, jumps : ndarrays, shapes (n,), (j, states)
        Variances added before the measurements of epoch k: row ``jump[k]``, -1 none.
    drive : Drive, optional
        Known motion of a state besides F.
    kept : KeptArrays, optional
        Arrays to keep.

    Raises
    ------
    ValueError
        Where shapes do not agree.

    Examples
    --------
    >>> walk = Transition.sparse(1, [0], [0], [[1.0]], [0], [0], [[0.5]])
    >>> seen = Measurements.of([0, 1, 2], [1.0, 2.0, 30.0], [[0]], np.ones((3, 1)), 1.0)
    >>> run = run_filter(walk, [-1, 0, 0], seen, Start(np.zeros(1), np.eye(1)), gate=InnovationGate(5.0))
    >>> run.x[:, 0, 0].round(3).tolist(), run.mark.tolist(), run.rejected
    ([0.5, 1.25, 1.25], [1, 1, -1], 1)
    """
    from groundstation.methods.kalman import runs

    size, n = transition.size, len(np.asarray(step))
    lines, kept = measurements.lines, kept or KeptArrays()
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
        (gate or InnovationGate()).rules(_kinds(lines), size),
        Drive(driven.state, frozen(driven.mix), frozen(driven.push)),
        measurements.value,
        considered,
        now,
        FilterWorkspace(np.zeros((size, size)), np.zeros(size), np.zeros(size), np.zeros(channels)),
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


def _room(n: int, m: int, size: int, channels: int, kept: KeptArrays) -> FilterRecord:
    """Return arrays of a record, those that are not kept without length.

    They are parts of one memory, for which the system gives larger pages: in a new process a run takes a quarter less.
    """
    judged = m if kept.judged else 0
    shapes: dict[str, tuple[int, ...]] = {
        "x": (n if kept.states else 0, size, channels),
        "P": (n if kept.covariances else 0, size, size),
        "variance": (n if kept.variances else 0, size),
        "K": (m if kept.gains else 0, size),
        "y": (m, channels),
        "S": (m,),
        "judged_innovation": (judged, channels),
        "judged_variance": (judged,),
    }
    arrays = arrays_at_once([(shape, np.float64) for shape in shapes.values()])
    return FilterRecord(mark=np.zeros(m, dtype=np.int8), **dict(zip(shapes, arrays, strict=True)))


def forecast_driven(
    growth: FloatArray, mix: FloatArray, known: FloatArray, every: int, start: FloatArray
) -> FloatArray:
    """Carry one state of many starts forward that acts on no other one but drags itself.

    Parameters
    ----------
    growth : ndarray, shape (k, c, s)
        Growth of the state over each step by the other ones.
    mix : ndarray, shape (k, c, c, s)
        Share of the state, and of what it had built up before, that moves it in each right-hand side.
    known : ndarray, shape (c, s)
        Error that the state had built up before the start.
    every : int
        Steps between two leads.
    start : ndarray, shape (c, s)

    Returns
    -------
    ndarray, shape (k // every, c, s)
    """
    from groundstation.methods.kalman import runs

    built_up = np.zeros((len(growth) // every, *start.shape))
    grown, mixed, before = (frozen(np.ascontiguousarray(part)) for part in (growth, mix, known))
    x = np.array([start, start], order="C")  # in one piece, or the kept machine code does not take it
    runs.run_driven(grown, mixed, before, every, x, built_up)
    return built_up
