"""Compiled filter of a pass: strapdown between epochs, measurements at them.

It has two parts, which one loop runs epoch by epoch: *carrying* the estimate over the samples and linearising the
measurements about it, and *solving* for the correction with its covariance. Where all is linearised about a known
trajectory the first is done once, and the second again for each noise and each outage.

Letters as in ``methods.kalman.kernels``.

Source: P. D. Groves, 2013, chapter 14 (integration of inertial data and GNSS); the rows of the transition are summed
over the samples of an epoch.
"""

import math

from groundstation.base.compile import in_place, inlined
from groundstation.base.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_M
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import Pattern
from groundstation.methods.kalman.kernels import (
    correct_states,
    predict_states,
    predicted,
    update_covariance,
)
from groundstation.systems.trajectory.observe import NO_ROW, observe
from groundstation.systems.trajectory.states import (
    AIDS,
    ATT,
    BA,
    BARO,
    BG,
    KEPT_ROWS,
    LEV,
    MNT,
    NAVIGATION,
    SLOW,
    STATES,
    WIDTH,
    FloatArray,
    Gate,
    Imu,
    Line,
    Linear,
    Noise,
    Now,
    Room,
    Schedule,
    Seen,
    Solved,
)
from groundstation.systems.trajectory.strapdown import (
    begin_transition,
    finish_transition,
    grow_transition,
    mechanise,
    rotation_of,
    shorter_way,
    turn_before,
)

BLOCK = 9 * LEV  # entries of the navigation rows of the transition


@in_place
def carry(e: int, schedule: Schedule, imu: Imu, noise: Noise, now: Now, room: Room, linear: Linear) -> None:
    """Carry the estimate over the samples of epoch e and fill its transition."""
    value, nav, step, spent = now.value, now.nav, room.step, linear.spent
    begin_transition(room.grown)
    turn = room.y
    for i in range(3):
        turn[i] = 0.0
        spent[e, i] = 0.0
    for k in range(schedule.first[e], schedule.first[e + 1]):
        mechanise(imu.interval_s, imu.angle, imu.velocity, k, value, nav, now.before, room.C, step)
        grow_transition(room.C, step, room.grown)
        for i in range(3):
            turn[i] += step[12 + i]
        spent[e, 0] += imu.interval_s[k]
        spent[e, 1] += imu.angle_variance[k]
        spent[e, 2] += imu.velocity_variance[k]
        slot = schedule.slot[k]
        if slot >= 0:
            for i in range(10):
                linear.nav[slot, i] = nav[i]
    total = spent[e, 0]
    finish_transition(nav, total, turn, room.grown, linear.F[e])
    for i in range(7):
        linear.F[e, BLOCK + i] = math.exp(-total / noise.time_s[2 if i == 6 else i // 3])
    for i in range(6):
        value[SLOW + i] *= linear.F[e, BLOCK + i]
    value[BARO] *= linear.F[e, BLOCK + 6]
    rotation_of(nav, room.C)


@in_place
def linearise(e: int, schedule: Schedule, seen: Seen, now: Now, room: Room, linear: Linear) -> None:
    """Fill the rows of the measurements of epoch e, about the estimate."""
    for m in range(schedule.seen[e], schedule.seen[e + 1]):
        observe(m, seen, now, room)
        for i in range(3):
            at = 3 * m + i
            linear.z[at] = room.y[i]
            for j in range(WIDTH):
                linear.columns[at, j] = room.columns[i, j]
                linear.h[at, j] = room.h[i, j]


@inlined
def _rows_of_navigation(F: FloatArray, p: FloatArray, w: FloatArray) -> None:
    """Fill the first rows of w with F p.

    Six columns of F at once, in the order of one after the other.
    """
    for t in range(NAVIGATION):
        for j in range(STATES):
            w[t, j] = 0.0
        for c in range(0, LEV, 6):
            at = t * LEV + c
            for j in range(STATES):
                total = w[t, j] + F[at] * p[c, j] + F[at + 1] * p[c + 1, j] + F[at + 2] * p[c + 2, j]
                w[t, j] = total + F[at + 3] * p[c + 3, j] + F[at + 4] * p[c + 4, j] + F[at + 5] * p[c + 5, j]


@inlined
def _square_of_navigation(F: FloatArray, p: FloatArray, w: FloatArray) -> None:
    """Fill the first square of p with w F'.

    Three columns at once: a sum waits for its last term.
    """
    for t in range(NAVIGATION):
        for u in range(t - t % 3, NAVIGATION, 3):
            x, y, z = 0.0, 0.0, 0.0
            for c in range(LEV):
                x += F[u * LEV + c] * w[t, c]
                y += F[u * LEV + LEV + c] * w[t, c]
                z += F[u * LEV + LEV + LEV + c] * w[t, c]
            p[t, u], p[t, u + 1], p[t, u + 2] = x, y, z
    for t in range(NAVIGATION):
        for u in range(t):
            p[t, u] = p[u, t]


@in_place
def predict_covariance(pattern: Pattern, F: FloatArray, p: FloatArray, w: FloatArray) -> None:
    """Predict the covariance: p <- F p F'.

    It is what the kernel of this name does, to the last bit, in half the time, by the shape of the pattern
    (``states.transition_pattern``).
    """
    rows, starts, _columns = pattern
    _rows_of_navigation(F, p, w)
    for t in range(NAVIGATION, len(rows)):
        for j in range(STATES):
            w[t, j] = F[starts[t]] * p[rows[t], j]
    for t in range(len(rows)):
        r = rows[t]
        for j in range(STATES):
            p[r, j] = w[t, j]
            p[j, r] = w[t, j]
    _square_of_navigation(F, p, w)
    for t in range(len(rows)):
        for u in range(max(t, NAVIGATION), len(rows)):
            i, j = rows[t], rows[u]
            p[i, j] = F[starts[u]] * w[t, j]
            p[j, i] = p[i, j]


@in_place
def predict(e: int, noise: Noise, pattern: Pattern, now: Now, room: Room, linear: Linear) -> None:
    """Carry the correction and its covariance to epoch e."""
    p, F, spent, density = now.p, linear.F, linear.spent, noise.density
    predict_covariance(pattern, F[e], p, room.w)
    predict_states(room.states, pattern, F, e, room.x, room.w)
    total = spent[e, 0]
    for i in range(3):
        q = density[1] * total + spent[e, 2]
        p[i, i] += q * total * total / 3.0
        p[i, 3 + i] += 0.5 * q * total
        p[3 + i, i] = p[i, 3 + i]
        p[3 + i, 3 + i] += q
        p[6 + i, 6 + i] += density[0] * total + spent[e, 1]
        p[BG + i, BG + i] += density[2] * total
        p[BA + i, BA + i] += density[3] * total
    for i in range(2):
        if p[MNT + i, MNT + i] > 0.0:
            p[MNT + i, MNT + i] += density[4] * total
    for i in range(6):
        at, decay = SLOW + i, F[e, BLOCK + i]
        p[at, at] += noise.variance[i] * (1.0 - decay * decay)
    p[BARO, BARO] += noise.variance[6] * (1.0 - F[e, BLOCK + 6] * F[e, BLOCK + 6])


@inlined
def _is_absent(at: int, m: int, i: int, seen: Seen, linear: Linear) -> bool:
    z, variance = linear.z[at], seen.variance[m, i]
    return bool(z == NO_ROW or z != z or variance != variance)


@in_place
def update(
    m: int, seen: Seen, gate: Gate, held: Int64Array, now: Now, room: Room, linear: Linear, solved: Solved
) -> float:
    """Use measurement m; return the logarithm of its likelihood.

    The scalars of a measurement are judged together against the gate.
    """
    p, x = now.p, room.x
    keeps = solved.y.shape[0] > 0
    kind = seen.kind[m]
    count, squared = 0, 0.0
    for i in range(3):
        at = 3 * m + i
        if keeps:
            solved.mark[at] = 0
        if _is_absent(at, m, i, seen, linear):
            continue
        columns, h = linear.columns[at], linear.h[at]
        s = seen.variance[m, i]
        for j in range(WIDTH):
            a = h[j]
            if a != 0.0:
                for k in range(WIDTH):
                    s += a * h[k] * p[columns[j], columns[k]]
        innovation = linear.z[at] - predicted(columns, h, 0, WIDTH, x, 0)
        squared += innovation * innovation / s
        count += 1
    if count == 0:
        return 0.0
    if squared > gate.largest * count:
        now.in_a_row[kind] += 1
        if now.in_a_row[kind] < gate.patience or kind >= AIDS:
            if keeps:
                for i in range(3):
                    solved.mark[3 * m + i] = -1
            return -0.5 * gate.largest * count
        for i in range(NAVIGATION):
            p[i, i] += gate.opened[i]
    now.in_a_row[kind] = 0
    likelihood = 0.0
    for i in range(3):
        at = 3 * m + i
        if _is_absent(at, m, i, seen, linear):
            continue
        columns, h = linear.columns[at], linear.h[at]
        innovation = linear.z[at] - predicted(columns, h, 0, WIDTH, x, 0)
        s = update_covariance(room.states, columns, h, 0, WIDTH, seen.variance[m, i], held, p, room.g, room.K)
        correct_states(room.states, room.K, innovation, x, 0)
        likelihood -= 0.5 * (innovation * innovation / s + math.log(s))
        if keeps:
            solved.mark[at] = 1
            solved.y[at], solved.S[at] = innovation, s
            for j in range(STATES):
                solved.K[at, j] = room.K[j]
    return likelihood


@in_place
def close(e: int, line: Line, now: Now, room: Room, linear: Linear) -> None:
    """Put the corrections of an epoch into the estimate, or bring it back to the line.

    What the estimate is moved by goes to ``linear.closed``.
    """
    nav, value, x, by = now.nav, now.value, room.x, linear.closed[e]
    sine = math.sin(nav[0])
    root = 1.0 - ECCENTRICITY_SQUARED * sine * sine
    east = SEMI_MAJOR_M / math.sqrt(root)
    north = east * (1.0 - ECCENTRICITY_SQUARED) / root
    if line.nav.shape[0] == 0:
        for i in range(STATES):
            by[i] = x[0, i]
        nav[0] += by[0] / (north + nav[2])
        nav[1] += by[1] / ((east + nav[2]) * math.cos(nav[0]))
        nav[2] -= by[2]
        nav[3] += by[3]
        nav[4] += by[4]
        nav[5] += by[5]
        turn_before(nav, by[6], by[7], by[8])
        for i in range(NAVIGATION, STATES):
            value[i] += by[i]
    else:
        wanted = line.nav[e]
        by[0] = (wanted[0] - nav[0]) * (north + nav[2])
        by[1] = shorter_way(wanted[1] - nav[1]) * (east + nav[2]) * math.cos(nav[0])
        by[2] = nav[2] - wanted[2]
        by[3] = wanted[3] - nav[3]
        by[4] = wanted[4] - nav[4]
        by[5] = wanted[5] - nav[5]
        # the turn from the estimate to the line: quaternion of the line times the inverse of the estimate's
        a, b, c, d = wanted[6], wanted[7], wanted[8], wanted[9]
        p, q, r, s = nav[6], -nav[7], -nav[8], -nav[9]
        sign = 2.0 if a * p - b * q - c * r - d * s >= 0.0 else -2.0
        by[6] = sign * (a * q + b * p + c * s - d * r)
        by[7] = sign * (a * r - b * s + c * p + d * q)
        by[8] = sign * (a * s + b * r - c * q + d * p)
        for i in range(10):
            nav[i] = wanted[i]
        for i in range(NAVIGATION, STATES):
            by[i] = line.value[e, i] - value[i]
            value[i] = line.value[e, i]


@in_place
def run_forward(
    imu: Imu,
    schedule: Schedule,
    seen: Seen,
    noise: Noise,
    gate: Gate,
    pattern: Pattern,
    held: Int64Array,
    line: Line,
    carries: bool,
    solves: bool,
    begin: int,
    end: int,
    now: Now,
    room: Room,
    linear: Linear,
    solved: Solved,
) -> float:
    """Filter epochs from ``begin`` to before ``end``; return the log-likelihood.

    Parameters
    ----------
    held : ndarray of int
        States that are considered and not estimated.
    line : Line
        Trajectory to linearise about; without rows: the estimate itself, which needs both parts.
    carries, solves : bool
        Parts to run. Without carrying, ``linear`` holds what an earlier run filled in.
    room.x : ndarray
        Where the prior lies from the estimate at the first epoch; behind each epoch it is zero, or where the filter
        lies from the line.
    """
    likelihood = 0.0
    for e in range(begin, end):
        if carries:
            carry(e, schedule, imu, noise, now, room, linear)
            linearise(e, schedule, seen, now, room, linear)
            if linear.value.shape[0] > 0:
                for j in range(STATES):
                    linear.value[e, j] = now.value[j]
        if solves:
            predict(e, noise, pattern, now, room, linear)
            keeps = solved.before.shape[0] > 0
            if keeps:
                row = solved.row[e]
                for i in range(KEPT_ROWS if row >= 0 else 0):
                    for j in range(STATES):
                        solved.p[row, i, j] = now.p[i, j]
                solved.tilt[e, 0] = now.p[ATT, ATT + 1]
                for j in range(STATES):
                    solved.before[e, j] = room.x[0, j]
            for m in range(schedule.seen[e], schedule.seen[e + 1]):
                likelihood += update(m, seen, gate, held, now, room, linear, solved)
            if keeps:
                solved.tilt[e, 1] = now.p[ATT, ATT + 1]
                for j in range(STATES):
                    solved.after[e, j] = room.x[0, j]
                    solved.variance[e, j] = now.p[j, j]
        if carries:
            close(e, line, now, room, linear)
        for j in range(STATES):
            room.x[0, j] -= linear.closed[e, j]
    return likelihood
