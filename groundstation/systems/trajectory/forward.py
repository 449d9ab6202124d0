"""Compiled filter of a pass: strapdown between epochs, measurements at them, estimate closed after each.

Letters as in ``methods.kalman.kernels``. The loop keeps what the smoother goes back over.

Source: P. D. Groves, 2013, chapter 14 (closed-loop integration of inertial data and GNSS); the rows of the transition
are summed over the samples of an epoch.
"""

import math

from groundstation.base.compile import in_place
from groundstation.base.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_M
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import Pattern
from groundstation.methods.kalman.kernels import correct_states, predict_covariance, predicted, update_covariance
from groundstation.systems.trajectory.observe import NO_ROW, observe
from groundstation.systems.trajectory.states import (
    BA,
    BARO,
    BG,
    KEPT_ROWS,
    LEV,
    NAVIGATION,
    SLOW,
    STATES,
    WIDTH,
    Gate,
    Imu,
    Kept,
    Noise,
    Now,
    Room,
    Schedule,
    Seen,
)
from groundstation.systems.trajectory.strapdown import (
    begin_transition,
    finish_transition,
    grow_transition,
    mechanise,
    rotation_of,
    turn_before,
)

BLOCK = 9 * LEV  # entries of the navigation rows of the transition


@in_place
def carry(first: int, last: int, imu: Imu, noise: Noise, pattern: Pattern, now: Now, room: Room, kept: Kept) -> float:
    """Carry estimate and covariance over samples ``first`` to ``last`` (not included); return the time.

    The covariance gets the noise of the unit and of the Gauss-Markov states.
    """
    value, nav, p, F = now.value, now.nav, now.p, room.F
    begin_transition(room.grown)
    total, angle, velocity, fast_angle = 0.0, 0.0, 0.0, 0.0
    turn = room.y
    turn[0], turn[1], turn[2] = 0.0, 0.0, 0.0
    for k in range(first, last):
        mechanise(imu.interval_s[k], imu.angle, imu.velocity, k, value, nav, now.before, room.C, room.step)
        grow_transition(room.C, room.step, room.grown)
        for i in range(3):
            turn[i] += room.step[12 + i]
        a, b, c = room.step[3], room.step[4], room.step[5]
        fast_angle += (a * a + b * b + c * c) / imu.interval_s[k]
        total += imu.interval_s[k]
        angle += imu.angle_variance[k]
        velocity += imu.velocity_variance[k]
        if kept.nav.shape[0] > 0:
            for i in range(10):
                kept.nav[k, i] = nav[i]
    finish_transition(nav, total, turn, room.grown, F)
    for i in range(7):
        at = 2 if i == 6 else i // 3
        decay = math.exp(-total / noise.time_s[at])
        F[0, BLOCK + i] = decay
    for i in range(SLOW, SLOW + 6):
        value[i] *= F[0, BLOCK + i - SLOW]
    value[BARO] *= F[0, BLOCK + 6]
    predict_covariance(room.states, pattern, F, 0, p, room.w)
    density = noise.density
    for i in range(3):
        q = density[1] * total + velocity
        p[i, i] += q * total * total / 3.0
        p[i, 3 + i] += 0.5 * q * total
        p[3 + i, i] = p[i, 3 + i]
        p[3 + i, 3 + i] += q
        p[6 + i, 6 + i] += density[0] * total + density[4] * fast_angle + angle
        p[BG + i, BG + i] += density[2] * total
        p[BA + i, BA + i] += density[3] * total
    for i in range(6):
        at = SLOW + i
        decay = F[0, BLOCK + i]
        p[at, at] += noise.variance[i] * (1.0 - decay * decay)
    p[BARO, BARO] += noise.variance[6] * (1.0 - F[0, BLOCK + 6] * F[0, BLOCK + 6])
    return total


@in_place
def update(m: int, scalar: int, seen: Seen, gate: Gate, held: Int64Array, now: Now, room: Room, kept: Kept) -> float:
    """Use measurement m; return the logarithm of its likelihood.

    ``scalar`` is its first scalar's place in the history. The scalars of a measurement are judged together against
    the gate.
    """
    p, x, y = now.p, room.x, room.y
    rotation_of(now.nav, room.C)
    observe(m, seen, now, room)
    keeps = kept.y.shape[0] > 0
    kind = seen.kind[m]
    count, squared = 0, 0.0
    for i in range(3):
        if keeps:
            kept.mark[scalar + i] = 0
        if y[i] == NO_ROW or y[i] != y[i] or seen.variance[m, i] != seen.variance[m, i]:
            continue
        y[i] -= predicted(room.columns[i], room.h[i], 0, WIDTH, x, 0)
        s = seen.variance[m, i]
        for e in range(WIDTH):
            for f in range(WIDTH):
                s += room.h[i, e] * room.h[i, f] * p[room.columns[i, e], room.columns[i, f]]
        squared += y[i] * y[i] / s
        y[i] += predicted(room.columns[i], room.h[i], 0, WIDTH, x, 0)
        count += 1
    if count == 0:
        return 0.0
    if squared > gate.largest * count:
        now.in_a_row[kind] += 1
        if now.in_a_row[kind] < gate.patience:
            if keeps:
                for i in range(3):
                    kept.mark[scalar + i] = -1
            return -0.5 * gate.largest * count
        for i in range(NAVIGATION):
            p[i, i] += gate.opened[i]
    now.in_a_row[kind] = 0
    likelihood = 0.0
    for i in range(3):
        if y[i] == NO_ROW or y[i] != y[i] or seen.variance[m, i] != seen.variance[m, i]:
            continue
        innovation = y[i] - predicted(room.columns[i], room.h[i], 0, WIDTH, x, 0)
        s = update_covariance(
            room.states, room.columns[i], room.h[i], 0, WIDTH, seen.variance[m, i], held, p, room.g, room.K
        )
        correct_states(room.states, room.K, innovation, x, 0)
        likelihood -= 0.5 * (innovation * innovation / s + math.log(s))
        if keeps:
            at = scalar + i
            kept.mark[at] = 1
            kept.y[at], kept.S[at] = innovation, s
            for j in range(STATES):
                kept.K[at, j] = room.K[j]
            for e in range(WIDTH):
                kept.columns[at, e] = room.columns[i, e]
                kept.h[at, e] = room.h[i, e]
    return likelihood


@in_place
def close(now: Now, room: Room) -> None:
    """Put the corrections of an epoch into the estimate."""
    nav, value, x = now.nav, now.value, room.x
    sine = math.sin(nav[0])
    root = 1.0 - ECCENTRICITY_SQUARED * sine * sine
    east = SEMI_MAJOR_M / math.sqrt(root)
    north = east * (1.0 - ECCENTRICITY_SQUARED) / root
    nav[0] += x[0, 0] / (north + nav[2])
    nav[1] += x[0, 1] / ((east + nav[2]) * math.cos(nav[0]))
    nav[2] -= x[0, 2]
    nav[3] += x[0, 3]
    nav[4] += x[0, 4]
    nav[5] += x[0, 5]
    turn_before(nav, x[0, 6], x[0, 7], x[0, 8])
    for i in range(NAVIGATION, STATES):
        value[i] += x[0, i]
    for i in range(STATES):
        x[0, i] = 0.0


@in_place
def run_forward(
    imu: Imu,
    schedule: Schedule,
    seen: Seen,
    noise: Noise,
    gate: Gate,
    pattern: Pattern,
    held: Int64Array,
    begin: int,
    end: int,
    now: Now,
    room: Room,
    kept: Kept,
) -> float:
    """Filter epochs ``begin`` to ``end`` (not included); return the logarithm of the likelihood.

    ``held``: states that are considered and not estimated.
    """
    likelihood = 0.0
    for e in range(begin, end):
        carry(schedule.first[e], schedule.first[e + 1], imu, noise, pattern, now, room, kept)
        if kept.F.shape[0] > 0:
            for i in range(room.F.shape[1]):
                kept.F[e, i] = room.F[0, i]
            for i in range(KEPT_ROWS):
                for j in range(STATES):
                    kept.p[e, i, j] = now.p[i, j]
        if kept.value.shape[0] > 0:
            for j in range(STATES):
                kept.value[e, j] = now.value[j]
        for i in range(STATES):
            room.x[0, i] = 0.0
        for m in range(schedule.seen[e], schedule.seen[e + 1]):
            likelihood += update(m, 3 * m, seen, gate, held, now, room, kept)
        if kept.after.shape[0] > 0:
            for j in range(STATES):
                kept.after[e, j] = room.x[0, j]
                kept.variance[e, j] = now.p[j, j]
        close(now, room)
    return likelihood
