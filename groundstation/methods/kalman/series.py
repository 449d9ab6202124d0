"""Compiled exponentials of a sparse matrix of rates, x' = A x.

One function gives them as transitions of the filter, another applies them to states. Both are good to the fourth order
of the step: the caller keeps |A| x seconds small ((|A| t)^5 / 120 of the state is left out).

Source: C. Moler, C. Van Loan, Nineteen dubious ways to compute the exponential of a matrix, SIAM Review 45, 2003,
method 1: good for small steps and nothing else.
"""

from groundstation.base.compile import in_place
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import FloatArray

ORDER = 4


@in_place
def exponentials(
    size: int,
    rows: Int64Array,
    columns: Int64Array,
    rates: FloatArray,
    seconds: FloatArray,
    at_rows: Int64Array,
    at_columns: Int64Array,
    scratch: FloatArray,
    out: FloatArray,
) -> None:
    """Fill ``out`` (k, e) with entries of exp(A t), for each of k matrices A.

    The entries are those at ``at_rows``, ``at_columns`` (e,).

    Parameters
    ----------
    rows, columns : ndarrays of int, shape (m,)
        Where A has entries.
    rates : ndarray, shape (k, m)
    seconds : ndarray, shape (k,)
    scratch : ndarray, shape (2, size, size)
        Overwritten.
    """
    E, B = scratch[0], scratch[1]
    for k in range(len(seconds)):
        for i in range(size):
            for j in range(size):
                E[i, j] = 0.0
            E[i, i] = 1.0
        for order in range(ORDER, 0, -1):  # Horner: E = I + A t / order E
            for i in range(size):
                for j in range(size):
                    B[i, j] = 0.0
            factor = seconds[k] / order
            for e in range(len(rows)):
                i, r, a = rows[e], columns[e], rates[k, e] * factor
                for j in range(size):
                    B[i, j] += a * E[r, j]
            for i in range(size):
                for j in range(size):
                    E[i, j] = B[i, j]
                E[i, i] += 1.0
        for e in range(len(at_rows)):
            out[k, e] = E[at_rows[e], at_columns[e]]


@in_place
def carry_by_rates(
    rows: Int64Array,
    columns: Int64Array,
    rates: FloatArray,
    step: Int64Array,
    step_s: float,
    every: int,
    x: FloatArray,
    scratch: FloatArray,
    out: FloatArray,
) -> None:
    """Carry the states of many starts forward in equal steps without forming a matrix.

    Parameters
    ----------
    rows, columns, rates
        Pattern (m,) and entries (d, m) of A over each distinct step.
    step : ndarray of int, shape (s, k)
        Number of the distinct step that each step of a start is.
    every : int
        Steps between two leads.
    x : ndarray, shape (s, n)
        Changed in place.
    scratch : ndarray, shape (2, n)
        Overwritten.
    out : ndarray, shape (s, leads, n)
        Filled: the state after every ``every`` steps.
    """
    n = x.shape[1]
    term, new = scratch[0], scratch[1]
    for s in range(len(x)):
        for lead in range(out.shape[1]):
            for part in range(every):
                k = step[s, lead * every + part]
                for i in range(n):
                    term[i] = x[s, i]
                for order in range(1, ORDER + 1):
                    for i in range(n):
                        new[i] = 0.0
                    for e in range(len(rows)):
                        new[rows[e]] += rates[k, e] * term[columns[e]]
                    for i in range(n):
                        term[i] = new[i] * step_s / order
                        x[s, i] += term[i]
            for i in range(n):
                out[s, lead, i] = x[s, i]
