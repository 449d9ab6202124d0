"""Named arrays that the compiled loops of the filter take.

The letters are those of ``kernels``. Nothing here needs numba.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Int64Array

FloatArray = NDArray[np.float64]
States = tuple[int, ...] | Int64Array
Marks = NDArray[np.int8]

REJECTED, ABSENT, USED = -1, 0, 1
NO_STEP = -1


class Pattern(NamedTuple):
    """Entries of a transition: the rows that are not those of the identity.

    Row ``rows[t]`` has the columns ``columns[starts[t] : starts[t + 1]]``; ``rows`` (t,) increase, ``starts`` (t + 1,).
    """

    rows: Int64Array
    starts: Int64Array
    columns: Int64Array


class Dynamics(NamedTuple):
    """Transitions and noises of s distinct steps; sparse or dense (see ``kernels``).

    ``before`` is added to p before a transition and ``after`` after it; where one has no steps at all there is none.
    """

    pattern: Pattern
    F: FloatArray  # (s, m) or (s, n, n)
    noise_rows: Int64Array  # (q,)
    noise_columns: Int64Array  # (q,)
    before: FloatArray  # (s or 0, q) or (s or 0, n, n)
    after: FloatArray


class MeasurementRows(NamedTuple):
    """Rows of the measurement matrix, r of them, with the noise of each.

    ``variance`` as a measurement is weighted, ``believed`` as a single one is believed to err; measurements of one
    epoch that follow each other and whose rows are of one ``kind`` are judged together: all are used or none.
    """

    starts: Int64Array  # (r + 1,)
    columns: Int64Array
    values: FloatArray
    variance: FloatArray  # (r,)
    believed: FloatArray  # (r,)
    kind: Int64Array  # (r,)


class Schedule(NamedTuple):
    """Events at each of n epochs, in this order: the step, the jump, the measurements.

    The measurements come one after the other.
    """

    step: Int64Array  # (n,) which of the distinct steps leads there; NO_STEP: none
    jump: Int64Array  # (n,) which row of ``jumps`` is added to the variances; NO_STEP: none
    jumps: FloatArray  # (j, n states)
    first: Int64Array  # (n + 1,) measurements of epoch k: first[k] to first[k + 1]
    row: Int64Array  # (m,) what each measures: row of ``MeasurementRows``


class GateRules(NamedTuple):
    """Rules by which a measurement is rejected and the filter is opened again.

    The filter is opened when it is the filter that is wrong, and not the measurements. ``gate``: largest y^2 over (h p
    h' + believed variance). ``patience`` (kinds,): so many rejections in a row of one kind; then ``opened`` (kinds, n)
    is added to the variances, and where ``is_by_innovation`` the square of the innovations to those of the states
    measured.
    """

    gate: float
    patience: Int64Array
    opened: FloatArray
    is_by_innovation: bool


class Drive(NamedTuple):
    """Known motion of one state besides F.

    A share ``mix`` (n, c, c) of the state moves it in the other right-hand sides, and ``push`` (n, c) moves it. Where
    both are empty there is no such motion.
    """

    state: int
    mix: FloatArray
    push: FloatArray


class Now(NamedTuple):
    """Current state of the filter.

    It is changed in place, so that a run may go on where another ended.
    """

    x: FloatArray  # (c, n)
    p: FloatArray  # (n, n)
    in_a_row: Int64Array  # (kinds,) rejections


class FilterWorkspace(NamedTuple):
    """Working arrays of the filter; contents mean nothing before and after."""

    w: FloatArray  # (n, n)
    g: FloatArray  # (n,)
    K: FloatArray  # (n,)
    moved: FloatArray  # (c,)


class Back(NamedTuple):
    """Working arrays of a smoother, see ``smoother_runs``.

    Contents mean nothing before and after.
    """

    a: FloatArray  # (c, n)
    A: FloatArray  # (n, n)
    C: FloatArray  # (n, n)
    w: FloatArray  # (n, n)
    u: FloatArray  # (n,)


class FilterRecord(NamedTuple):
    """Arrays that a run fills; an array of no length is left out (but not y, S, mark).

    ``y``, ``S`` are those of the measurement when it is used, all before it used already; those called judged, when its
    group is judged.
    """

    x: FloatArray  # (n, states, c)
    P: FloatArray  # (n, states, states)
    variance: FloatArray  # (n, states)
    K: FloatArray  # (m, states)
    y: FloatArray  # (m, c)
    S: FloatArray  # (m,)
    mark: Marks  # (m,)
    judged_innovation: FloatArray
    judged_variance: FloatArray
