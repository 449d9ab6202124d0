"""Compiled motion of an aircraft's error states, and where its antenna is.

Two models, both linear: in a local frame (7 states) and in the global one (13 or 15). Source: Titterton and Weston,
Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3 (dynamics of the thirteen states).
"""

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.methods.link_dynamics import fill_step
from groundstation.systems.cooperative.loop_types import (
    AXES,
    FORCE,
    GLOBAL,
    HEADING,
    LATITUDE,
    LOCAL,
    MERIDIAN,
    NORMAL,
    PLACE,
    RATE,
    VELOCITY,
    Fleet,
    FloatArray,
)

SAME_TIME_S, SAME_STEP_S = 1e-9, 1e-12
KEPT_STEP, KEPT_PHI, KEPT_NOISE = 8, 9, 10  # all aircraft of a session have one model there


@in_place
def fill_dynamics(fleet: Fleet, who: int, epoch: int, F: FloatArray) -> None:
    """Dynamics of an aircraft's errors from one epoch of its dead reckoning to the next.

    Local: x, y, vx, vy, height, clock offset, clock frequency. Global: position error north, east (m), velocity error
    north, east (m/s), platform angles about north, east, down (rad), drifts about the same (rad/s), height, clock
    offset (m), clock frequency (m/s). The angles have the sign with which the computed attitude is (I - [angle x])
    times the true one; a positive drift makes its angle fall.
    """
    n, height = fleet.size[who], fleet.height[who]
    numbers = fleet.numbers[who]  # a row of Numbers
    velocity_s, gyro_s, baro_s, clock_s, bias_s = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4]
    for i in range(n):
        for j in range(n):
            F[i, j] = 0.0
    F[0, 2] = F[1, 3] = 1.0
    if fleet.model[who] == LOCAL:
        F[2, 2] = F[3, 3] = -1.0 / velocity_s
    else:
        _fill_platform(fleet.epochs[epoch], gyro_s, F)
    F[height, height] = -1.0 / baro_s
    for clock in (fleet.clock[who], fleet.receiver_clock[who]):
        F[clock, clock + 1] = 1.0
        F[clock + 1, clock + 1] = -1.0 / clock_s
    if fleet.bias[who] >= 0:
        F[fleet.bias[who], fleet.bias[who]] = -1.0 / bias_s


@in_place
def _fill_platform(flown: FloatArray, gyro_s: float, F: FloatArray) -> None:
    """Rows of position, velocity, platform angles and drifts in the global frame."""
    earth, meridian, normal = EARTH_RATE_RADPS, flown[MERIDIAN], flown[NORMAL]
    sine, cosine = np.sin(flown[LATITUDE]), np.cos(flown[LATITUDE])
    tangent = sine / cosine
    north, east, down = flown[VELOCITY], flown[VELOCITY + 1], flown[VELOCITY + 2]
    f_n, f_e, f_d = flown[FORCE], flown[FORCE + 1], flown[FORCE + 2]
    w_n = earth * cosine + east / normal
    w_e = -north / meridian
    w_d = -earth * sine - east * tangent / normal
    # error of Earth and transport rate per metre north and per metre a second
    ie_n, ie_d = -earth * sine / meridian, -earth * cosine / meridian
    en_d = -east / (normal * cosine * cosine) / meridian
    F[1, 0] = east * tangent / meridian
    F[1, 1] = -tangent * north / meridian
    coriolis_d = w_d - earth * sine
    F[2, 5], F[2, 6], F[2, 3] = -f_d, f_e, coriolis_d + (-tangent / normal) * east
    F[2, 2] = down / meridian
    F[2, 0] = (2.0 * ie_d + en_d) * east
    F[3, 4], F[3, 6] = f_d, -f_n
    F[3, 2] = -coriolis_d
    F[3, 3] = down / normal + tangent / normal * north
    F[3, 0] = -(2.0 * ie_d + en_d) * north + 2.0 * ie_n * down
    F[4, 6], F[4, 5] = -w_e, w_d
    F[4, 0], F[4, 3], F[4, 7] = ie_n, 1.0 / normal, -1.0
    F[5, 4], F[5, 6] = -w_d, w_n
    F[5, 2], F[5, 8] = -1.0 / meridian, -1.0
    F[6, 5], F[6, 4] = -w_n, w_e
    F[6, 0], F[6, 3], F[6, 9] = ie_d + en_d, -tangent / normal, -1.0
    F[7, 7] = F[8, 8] = F[9, 9] = -1.0 / gyro_s


@in_place
def first_not_before(fleet: Fleet, who: int, at_s: float) -> int:
    """Return the index of a vehicle's first epoch not before a time (their number: none)."""
    low, high = fleet.first[who], fleet.first[who + 1]
    while low < high:
        middle = (low + high) // 2
        if fleet.time_s[middle] < at_s:
            low = middle + 1
        else:
            high = middle
    return int(low - fleet.first[who])


@in_place
def compose(n: int, one: FloatArray, q: FloatArray, phi: FloatArray, noise: FloatArray, w: FloatArray) -> None:
    """phi <- one phi; noise <- one noise one' + q."""
    for i in range(n):
        for j in range(n):
            total = 0.0
            for m in range(n):
                total += one[i, m] * phi[m, j]
            w[i, j] = total
    for i in range(n):
        for j in range(n):
            phi[i, j] = w[i, j]
    turn_covariance(n, one, noise, w)
    for i in range(n):
        for j in range(n):
            noise[i, j] += q[i, j]


@in_place
def turn_covariance(n: int, phi: FloatArray, p: FloatArray, w: FloatArray) -> None:
    """p <- phi p phi'; entries of phi that are zero cost nothing but the look at them."""
    for i in range(n):
        for j in range(n):
            w[i, j] = 0.0
        for m in range(n):
            if phi[i, m] != 0.0:
                for j in range(n):
                    w[i, j] += phi[i, m] * p[m, j]
    for i in range(n):
        for j in range(n):
            p[i, j] = 0.0
    for j in range(n):
        for m in range(n):
            if phi[j, m] != 0.0:
                for i in range(n):
                    p[i, j] += w[i, m] * phi[j, m]


@in_place
def turn_rows(n: int, phi: FloatArray, rows: FloatArray, w: FloatArray) -> None:
    """rows <- phi rows, the first n of them."""
    width = rows.shape[1]
    for i in range(n):
        for c in range(width):
            w[i, c] = 0.0
        for m in range(n):
            if phi[i, m] != 0.0:
                for c in range(width):
                    w[i, c] += phi[i, m] * rows[m, c]
    for i in range(n):
        for c in range(width):
            rows[i, c] = w[i, c]


@in_place
def step(
    fleet: Fleet,
    who: int,
    x: FloatArray,
    from_s: float,
    to_s: float,
    phi: FloatArray,
    noise: FloatArray,
    room: FloatArray,
) -> None:
    """Move the state of a vehicle to another time; fill transition and noise covariance.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Changed in place.
    phi, noise : ndarrays, shape (n, n)
        Filled; back in time the noise means nothing.
    room : ndarray, shape (ROOMS, n, n)
        Zeros at first.
    """
    n = fleet.size[who]
    F = room[4]
    if fleet.model[who] == GLOBAL:
        _over_epochs(fleet, who, from_s, to_s, phi, noise, room)
    else:
        if abs(room[KEPT_STEP, 0, 0] - (to_s - from_s)) > SAME_STEP_S or abs(to_s - from_s) <= SAME_STEP_S:
            fill_dynamics(fleet, who, fleet.first[who], F)
            fill_step(n, F, fleet.density[who], to_s - from_s, room[KEPT_PHI], room[KEPT_NOISE], room)
            room[KEPT_STEP, 0, 0] = to_s - from_s
        for i in range(n):
            for j in range(n):
                phi[i, j], noise[i, j] = room[KEPT_PHI, i, j], room[KEPT_NOISE, i, j]
    for i in range(n):
        room[0, 0, i] = 0.0
        for j in range(n):
            room[0, 0, i] += phi[i, j] * x[j]
    for i in range(n):
        x[i] = room[0, 0, i]


@in_place
def _over_epochs(
    fleet: Fleet, who: int, from_s: float, to_s: float, phi: FloatArray, noise: FloatArray, room: FloatArray
) -> None:
    """Fill transition and noise in the global frame, piece by piece between epochs.

    The epochs are those of the dead reckoning.
    """
    n, F, one, q, w = fleet.size[who], room[4], room[5], room[6], room[7]
    first, count = fleet.first[who], fleet.first[who + 1] - fleet.first[who]
    cut = first_not_before(fleet, who, from_s + SAME_TIME_S)
    while cut < count and fleet.time_s[first + cut] <= from_s + SAME_TIME_S:
        cut += 1
    at_s, is_first = from_s, True
    while True:
        is_last = cut >= count or fleet.time_s[first + cut] >= to_s
        next_s = to_s if is_last else fleet.time_s[first + cut]
        epoch = min(max(first_not_before(fleet, who, 0.5 * (at_s + next_s)) - 1, 0), max(count - 2, 0))
        fill_dynamics(fleet, who, first + epoch, F)
        if is_first:
            fill_step(n, F, fleet.density[who], next_s - at_s, phi, noise, room)
        else:
            fill_step(n, F, fleet.density[who], next_s - at_s, one, q, room)
            compose(n, one, q, phi, noise, w)
        if is_last:
            return
        at_s, is_first = next_s, False
        cut += 1


@in_place
def place(fleet: Fleet, who: int, at_s: float, reading: FloatArray, derivative: FloatArray) -> None:
    """Fill reading (3,) and derivative (3, n): antenna position = reading + derivative x.

    The reading is that of the dead reckoning. Between two epochs the position is cubic through both positions and
    velocities.
    """
    for axis in range(3):
        reading[axis] = 0.0
        for j in range(fleet.size[who]):
            derivative[axis, j] = 0.0
    first, count = fleet.first[who], fleet.first[who + 1] - fleet.first[who]
    epochs, nearest = fleet.epochs, first
    if count == 1:
        for axis in range(3):
            reading[axis] = epochs[first, PLACE + axis]
    else:
        after = first + min(max(first_not_before(fleet, who, at_s), 1), count - 1)
        before = after - 1
        span = fleet.time_s[after] - fleet.time_s[before]
        part = (at_s - fleet.time_s[before]) / span
        nearest = before if part < 0.5 else after
        a, b = part * part * (3.0 - 2.0 * part), part * (1.0 - part)
        for axis in range(3):
            one, two = epochs[before, PLACE + axis], epochs[after, PLACE + axis]
            rate_one, rate_two = epochs[before, RATE + axis] * span, epochs[after, RATE + axis] * span
            reading[axis] = one + a * (two - one) + b * ((1.0 - part) * rate_one - part * rate_two)
    height, lever = fleet.height[who], fleet.lever[who]
    cosine, sine = np.cos(epochs[nearest, HEADING]), np.sin(epochs[nearest, HEADING])
    for axis in range(3):
        north, east = epochs[nearest, AXES + 3 * axis], epochs[nearest, AXES + 3 * axis + 1]
        derivative[axis, 0], derivative[axis, 1] = -north, -east
        derivative[axis, height] = epochs[nearest, AXES + 3 * axis + 2]
        if lever >= 0:
            derivative[axis, lever] = cosine * north + sine * east
            derivative[axis, lever + 1] = cosine * east - sine * north


@in_place
def position(n: int, reading: FloatArray, derivative: FloatArray, x: FloatArray, out: FloatArray) -> None:
    """Fill the position, (3,): reading + derivative x."""
    for axis in range(3):
        total = 0.0
        for j in range(n):
            total += derivative[axis, j] * x[j]
        out[axis] = reading[axis] + total


@in_place
def positions(
    fleet: Fleet, who: int, time_s: FloatArray, states: FloatArray, derivative: FloatArray, out: FloatArray
) -> None:
    """Fill the positions (m, 3) at some times from the states there (m, n).

    ``derivative`` (3, n) is a work array.
    """
    for row in range(len(time_s)):
        place(fleet, who, time_s[row], out[row], derivative)
        position(fleet.size[who], out[row], derivative, states[row], out[row])
