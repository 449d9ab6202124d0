"""Updates of a vehicle that estimates alone, by a batch of rows.

Two sources may share noise; covariances may be split.
"""

import numpy as np

from groundstation.base.compile import in_place
from groundstation.systems.cooperative.alone_types import (
    EXACT,
    MODIFIED,
    NOBODY,
    AloneWorkspace,
    HeardBroadcasts,
    NeighbourRules,
    OwnFilters,
    UpdateRows,
)
from groundstation.systems.cooperative.loop_types import (
    PEER,
    Events,
    Fleet,
    FloatArray,
)
from groundstation.systems.cooperative.motion import turn_covariance
from groundstation.systems.cooperative.plain.split_covariance import ROUNDING

JACOBI_SWEEPS = 8  # each doubles the digits once it has any


@in_place
def solve(count: int, width: int, A: FloatArray, B: FloatArray) -> None:
    """Solve B <- A^-1 B by elimination with the largest pivots.

    A (count, count) is overwritten, B is (count, width).
    """
    for c in range(count):
        best = c
        for r in range(c + 1, count):
            if abs(A[r, c]) > abs(A[best, c]):
                best = r
        if best != c:
            for j in range(count):
                A[c, j], A[best, j] = A[best, j], A[c, j]
            for j in range(width):
                B[c, j], B[best, j] = B[best, j], B[c, j]
        for r in range(c + 1, count):
            factor = A[r, c] / A[c, c]
            if factor != 0.0:
                for j in range(c, count):
                    A[r, j] -= factor * A[c, j]
                for j in range(width):
                    B[r, j] -= factor * B[c, j]
    for c in range(count - 1, -1, -1):
        for j in range(width):
            for r in range(c + 1, count):
                B[c, j] -= A[c, r] * B[r, j]
            B[c, j] /= A[c, c]


@in_place
def _mix(
    fleet: Fleet,
    who: int,
    count: int,
    own: OwnFilters,
    heard: HeardBroadcasts,
    batch: UpdateRows,
    first: int,
    mixed: FloatArray,
) -> None:
    """Fill the errors that each row of an update brings in.

    They are given by the errors of all at the beginning of the window.
    """
    width = own.map_rows.shape[2]
    for row in range(first, first + count):
        by = batch.heard[row]
        for c in range(width):
            mixed[row - first, c] = 0.0
        for i in range(fleet.size[who]):
            if batch.h[row, i] != 0.0:
                for c in range(width):
                    mixed[row - first, c] += batch.h[row, i] * own.map_rows[who, i, c]
        if by != NOBODY:
            for i in range(fleet.size[heard.owner[by]]):
                told = 0.0
                for a in range(4):
                    told += batch.told[row, a] * heard.told[by, a, i]
                if told != 0.0:
                    for c in range(width):
                        mixed[row - first, c] += told * heard.map_rows[by, i, c]


@in_place
def _correct_map(n: int, count: int, gain: FloatArray, mixed: FloatArray, map_rows: FloatArray) -> None:
    """Correct the rows of the error map after an update; gain (count, n)."""
    for row in range(count):
        for i in range(n):
            if gain[row, i] != 0.0:
                for c in range(map_rows.shape[1]):
                    map_rows[i, c] -= gain[row, i] * mixed[row, c]


@in_place
def update(
    fleet: Fleet,
    events: Events,
    who: int,
    count: int,
    method: NeighbourRules,
    own: OwnFilters,
    heard: HeardBroadcasts,
    batch: UpdateRows,
    room: AloneWorkspace,
) -> None:
    """Run the Kalman update with the noise of the algorithm.

    Shared errors are considered, not estimated. The gain solves S K' = H P + C', where C is the covariance of the
    states with the noise of the rows: errors of the points are in the states, in the rows themselves and in what
    neighbours tell. Without the last of these a filter comes to claim less than the errors that it shares, and its
    covariance can lose its positive eigenvalues.
    """
    n, P, S, right, is_modified = fleet.size[who], own.P[who], room.S, room.right, method.algorithm == MODIFIED
    q = len(method.point_variance) if is_modified else 0
    by_error = room.by_error
    for r in range(count):
        for c in range(q):
            by_error[r, c] = batch.by_shared[r, c] + _told_shared(r, c, heard, batch) / method.point_variance[c]
    for r in range(count):
        for i in range(n):
            right[r, i] = 0.0
            for j in range(n):
                right[r, i] += batch.h[r, j] * P[j, i]
            for c in range(q):
                right[r, i] += own.shared[who, i, c] * by_error[r, c]
    for r in range(count):
        for s in range(count):
            S[r, s] = batch.own[r] + batch.brought[r] if r == s else 0.0
            for i in range(n):
                S[r, s] += right[r, i] * batch.h[s, i]
                for c in range(q):  # H C, the part of C H' stands in right
                    S[r, s] += batch.h[r, i] * own.shared[who, i, c] * by_error[s, c]
            if r != s:
                S[r, s] += _common(events, r, s, method, heard, batch, room.cross)
    gain, kept = room.gain, room.kept
    for r in range(count):
        for s in range(count):
            kept[r, s] = S[r, s]
        for i in range(n):
            gain[r, i] = right[r, i]
    solve(count, n, S, gain)
    for r in range(count):
        for i in range(n):
            own.x[who, i] += gain[r, i] * batch.innovation[r]
    for i in range(n):
        for j in range(i, n):
            total = 0.0
            for r in range(count):
                for s in range(count):
                    total += gain[r, i] * kept[r, s] * gain[s, j]
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i]) - total
    if is_modified:
        _correct_shared(n, count, gain, method, own.shared[who], heard, batch, room.lines[0])
    _mix(fleet, who, count, own, heard, batch, 0, room.mixed)
    _correct_map(n, count, gain, room.mixed, own.map_rows[who])


@in_place
def _told_shared(row: int, c: int, heard: HeardBroadcasts, batch: UpdateRows) -> float:
    """Return the covariance of what a row's source told with the error c of the points."""
    total = 0.0
    if batch.heard[row] != NOBODY:
        for a in range(4):
            total += batch.told[row, a] * heard.shared[batch.heard[row], a, c]
    return total


@in_place
def _common(
    events: Events, r: int, s: int, method: NeighbourRules, heard: HeardBroadcasts, batch: UpdateRows, cross: FloatArray
) -> float:
    """Return the covariance of the noise of two rows.

    It is all of it for two rows of one neighbour, else (modified) that through the points.
    """
    one, two, total = batch.event[r], batch.event[s], 0.0
    if method.algorithm == EXACT:
        return 0.0
    if events.kind[one] == PEER and events.kind[two] == PEER and events.source[one] == events.source[two]:
        _between(heard, batch.heard[r], batch.heard[s], cross)
        for a in range(4):
            for b in range(4):
                total += batch.told[r, a] * cross[0, a, b] * batch.told[s, b]
        return total
    for c in range(len(method.point_variance) if method.algorithm == MODIFIED else 0):
        left = _told_shared(r, c, heard, batch) + batch.by_shared[r, c] * method.point_variance[c]
        other = _told_shared(s, c, heard, batch) + batch.by_shared[s, c] * method.point_variance[c]
        total += left * other / method.point_variance[c]
    return total


@in_place
def _between(heard: HeardBroadcasts, one: int, two: int, cross: FloatArray) -> None:
    """Fill ``cross[0]`` with the covariance of the errors in two messages of one sender.

    It is the product of their square roots. Errors of one sender are common to its messages. The symmetric roots make
    it a covariance whatever the two are.
    """
    if one == two:
        for a in range(4):
            for b in range(4):
                cross[0, a, b] = heard.covariance[one, a, b]
        return
    _root(heard.covariance[one], cross[1], cross[3], cross[4])
    _root(heard.covariance[two], cross[2], cross[3], cross[4])
    for a in range(4):
        for b in range(4):
            cross[0, a, b] = 0.0
            for c in range(4):
                cross[0, a, b] += cross[1, a, c] * cross[2, c, b]


@in_place
def _root(covariance: FloatArray, root: FloatArray, A: FloatArray, V: FloatArray) -> None:
    """Compute the symmetric square root of a 4 x 4 covariance by Jacobi rotations.

    An eigenvalue that rounding left below 0 is taken as 0.

    Source: Golub and Van Loan, Matrix Computations, 4th ed. 2013, section 8.5.
    """
    for i in range(4):
        for j in range(4):
            A[i, j], V[i, j] = covariance[i, j], 1.0 if i == j else 0.0
    for _ in range(JACOBI_SWEEPS):
        for p in range(3):
            for q in range(p + 1, 4):
                if A[p, q] == 0.0:
                    continue
                slope = (A[q, q] - A[p, p]) / (2.0 * A[p, q])
                t = (1.0 if slope >= 0.0 else -1.0) / (abs(slope) + np.sqrt(1.0 + slope * slope))
                c = 1.0 / np.sqrt(1.0 + t * t)
                for k in range(4):
                    A[k, p], A[k, q] = c * A[k, p] - c * t * A[k, q], c * t * A[k, p] + c * A[k, q]
                for k in range(4):
                    A[p, k], A[q, k] = c * A[p, k] - c * t * A[q, k], c * t * A[p, k] + c * A[q, k]
                    V[k, p], V[k, q] = c * V[k, p] - c * t * V[k, q], c * t * V[k, p] + c * V[k, q]
                A[p, q] = A[q, p] = 0.0
    for i in range(4):
        for j in range(4):
            root[i, j] = 0.0
            for k in range(4):
                root[i, j] += V[i, k] * np.sqrt(max(A[k, k], 0.0)) * V[j, k]


@in_place
def _correct_shared(
    n: int,
    count: int,
    gain: FloatArray,
    method: NeighbourRules,
    shared: FloatArray,
    heard: HeardBroadcasts,
    batch: UpdateRows,
    brought: FloatArray,
) -> None:
    """Correct the covariance with the errors of the points after an update."""
    for c in range(shared.shape[1]):
        for row in range(count):  # all of them before the first correction
            brought[row] = batch.by_shared[row, c] * method.point_variance[c] + _told_shared(row, c, heard, batch)
            for i in range(n):
                brought[row] += batch.h[row, i] * shared[i, c]
        for row in range(count):
            for i in range(n):
                shared[i, c] -= gain[row, i] * brought[row]


@in_place
def split_update(
    fleet: Fleet,
    who: int,
    row: int,
    method: NeighbourRules,
    own: OwnFilters,
    heard: HeardBroadcasts,
    batch: UpdateRows,
    room: AloneWorkspace,
) -> None:
    """Split covariance intersection with one row, see ``plain.split_covariance``.

    Li and Nashashibi 2013, equations 10 to 14. ``room.x`` is the state that the row was linearised about.
    """
    n, P, independent = fleet.size[who], own.P[who], own.independent[who]
    h, brought, sensor = batch.h[row], batch.brought[row], batch.own[row]
    weight = 1.0
    if brought > 0.0:
        weight = _best_weight(n, h, P, independent, brought, sensor, method.weights, room.lines)
    if weight == 0.0:
        return  # every weight leaves larger errors than none
    gain, S = room.right[0], sensor + (brought / (1.0 - weight) if brought > 0.0 else 0.0)
    innovation = batch.innovation[row]
    for i in range(n):
        innovation -= h[i] * (own.x[who, i] - room.x[i])
        gain[i] = 0.0
        for j in range(n):
            P[i, j] = (P[i, j] - independent[i, j]) / weight + independent[i, j]
            gain[i] += P[i, j] * h[j]
    for i in range(n):
        S += h[i] * gain[i]
    for i in range(n):
        gain[i] /= S
    for i in range(n):
        own.x[who, i] += gain[i] * innovation
        for j in range(n):
            P[i, j] -= gain[i] * gain[j] * S
    kept = room.phi
    for i in range(n):
        for j in range(n):
            kept[i, j] = (1.0 if i == j else 0.0) - gain[i] * h[j]
    turn_covariance(n, kept, independent, room.step[0])
    for i in range(n):
        for j in range(n):
            independent[i, j] += gain[i] * gain[j] * sensor
    _mix(fleet, who, 1, own, heard, batch, row, room.mixed)
    _correct_map(n, 1, room.right, room.mixed, own.map_rows[who])


@in_place
def _best_weight(
    n: int,
    h: FloatArray,
    P: FloatArray,
    independent: FloatArray,
    brought: float,
    sensor: float,
    weights: FloatArray,
    lines: FloatArray,
) -> float:
    """Return the weight of the dependent part with the least sum of relative variances.

    Each variance is over what it was before; 0: no weight is better.
    """
    by_dependent, by_independent = lines[0], lines[1]
    one, two, least, best = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        least += 1.0 if P[i, i] > 0.0 else 0.0
        by_dependent[i] = by_independent[i] = 0.0
        for j in range(n):
            by_dependent[i] += (P[i, j] - independent[i, j]) * h[j]
            by_independent[i] += independent[i, j] * h[j]
    for i in range(n):
        one += h[i] * by_dependent[i]
        two += h[i] * by_independent[i]
    least *= 1.0 - ROUNDING
    for weight in weights:
        S, left = one / weight + two + brought / (1.0 - weight) + sensor, 0.0
        for i in range(n):
            if P[i, i] > 0.0:
                grown = (P[i, i] - independent[i, i]) / weight + independent[i, i]
                left += (grown - (by_dependent[i] / weight + by_independent[i]) ** 2 / S) / P[i, i]
        if left < least:
            least, best = left, weight
    return best
