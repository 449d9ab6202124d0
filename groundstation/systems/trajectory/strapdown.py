"""Compiled strapdown mechanisation in the local-level frame, and the transition of its errors.

Letters: C rotation n from b; a sample has angle and velocity increments; n is north, east, down.

Source: P. G. Savage, Strapdown Inertial Navigation Integration Algorithm Design, J. Guidance 21, 1998, parts 1 and 2
(coning and sculling from the increments before and now); P. D. Groves, Principles of GNSS, Inertial, and Multisensor
Integrated Navigation Systems, 2nd edition, 2013, sections 5.4 and 14.2 (local-level mechanisation, error transition);
normal gravity: Somigliana's formula with the height terms of WGS 84 (NIMA TR8350.2, 2000, equations 4-1 and 4-3).
"""

import math

from groundstation.base.compile import inlined
from groundstation.base.geodesy import EARTH_RATE_RADPS, ECCENTRICITY_SQUARED, FLATTENING, SEMI_MAJOR_M
from groundstation.base.gravity import GEODETIC_RATIO, GRAVITY_EQUATOR_MPS2, SOMIGLIANA
from groundstation.systems.trajectory.states import ATT, BA, BG, LEV, MA, MG, SA, SG, FloatArray


@inlined
def normal_gravity(sine: float, height_m: float) -> float:
    """Return normal gravity on WGS 84, m/s2, from the sine of the latitude and the height."""
    squared = sine * sine
    surface = GRAVITY_EQUATOR_MPS2 * (1.0 + SOMIGLIANA * squared) / math.sqrt(1.0 - ECCENTRICITY_SQUARED * squared)
    ratio = height_m / SEMI_MAJOR_M
    return surface * (
        1.0 - 2.0 * (1.0 + FLATTENING + GEODETIC_RATIO - 2.0 * FLATTENING * squared) * ratio + 3.0 * ratio * ratio
    )


@inlined
def shorter_way(angle: float) -> float:
    """Return an angle between two directions, or two longitudes, by the shorter way, rad."""
    turns = angle / (2.0 * math.pi)
    return (turns - math.floor(turns + 0.5)) * 2.0 * math.pi


@inlined
def rotation_of(nav: FloatArray, C: FloatArray) -> None:
    """Fill C from the quaternion of the estimate."""
    w, x, y, z = nav[6], nav[7], nav[8], nav[9]
    C[0, 0] = w * w + x * x - y * y - z * z
    C[0, 1] = 2.0 * (x * y - w * z)
    C[0, 2] = 2.0 * (x * z + w * y)
    C[1, 0] = 2.0 * (x * y + w * z)
    C[1, 1] = w * w - x * x + y * y - z * z
    C[1, 2] = 2.0 * (y * z - w * x)
    C[2, 0] = 2.0 * (x * z - w * y)
    C[2, 1] = 2.0 * (y * z + w * x)
    C[2, 2] = w * w - x * x - y * y + z * z


@inlined
def turn_before(nav: FloatArray, x: float, y: float, z: float) -> None:
    """Turn the attitude by a rotation vector in n: C becomes exp([x, y, z]) C."""
    angle = math.sqrt(x * x + y * y + z * z)
    s = 0.5 - angle * angle / 48.0
    if angle > 1e-3:
        s = math.sin(0.5 * angle) / angle
    c, x, y, z = math.cos(0.5 * angle), s * x, s * y, s * z
    a, b, d, e = nav[6], nav[7], nav[8], nav[9]
    nav[6] = c * a - x * b - y * d - z * e
    nav[7] = c * b + x * a + y * e - z * d
    nav[8] = c * d - x * e + y * a + z * b
    nav[9] = c * e + x * d - y * b + z * a


@inlined
def turn_after(nav: FloatArray, x: float, y: float, z: float) -> None:
    """Turn the attitude by a rotation vector in b: C becomes C exp([x, y, z]); its length is set to one."""
    angle = math.sqrt(x * x + y * y + z * z)
    s = 0.5 - angle * angle / 48.0
    if angle > 1e-3:
        s = math.sin(0.5 * angle) / angle
    c, x, y, z = math.cos(0.5 * angle), s * x, s * y, s * z
    a, b, d, e = nav[6], nav[7], nav[8], nav[9]
    p = a * c - b * x - d * y - e * z
    q = a * x + b * c + d * z - e * y
    r = a * y - b * z + d * c + e * x
    t = a * z + b * y - d * x + e * c
    unit = 1.0 / math.sqrt(p * p + q * q + r * r + t * t)
    nav[6], nav[7], nav[8], nav[9] = p * unit, q * unit, r * unit, t * unit


@inlined
def mechanise(
    interval_s: FloatArray,
    angle: FloatArray,
    velocity: FloatArray,
    k: int,
    value: FloatArray,
    nav: FloatArray,
    before: FloatArray,
    C: FloatArray,
    step: FloatArray,
) -> None:
    """Carry the estimate over one sample, with biases, scale and misalignment taken off it.

    Fills ``C`` with the attitude at its start, and ``step``: 0-2 angle increments as read, 3-5 corrected, 6-8 velocity
    increments in n, 9-11 velocity before, 12-14 turn of n, 15 interval, 16-18 velocity increments as read.
    """
    dt = interval_s[k]
    x, y, z = angle[k, 0], angle[k, 1], angle[k, 2]
    ax = x - value[BG] * dt - value[SG] * x - value[MG] * y - value[MG + 1] * z
    ay = y - value[BG + 1] * dt - value[SG + 1] * y - value[MG + 2] * x - value[MG + 3] * z
    az = z - value[BG + 2] * dt - value[SG + 2] * z - value[MG + 4] * x - value[MG + 5] * y
    u, v, w = velocity[k, 0], velocity[k, 1], velocity[k, 2]
    ux = u - value[BA] * dt - value[SA] * u - value[MA] * v - value[MA + 1] * w
    uy = v - value[BA + 1] * dt - value[SA + 1] * v - value[MA] * u - value[MA + 2] * w
    uz = w - value[BA + 2] * dt - value[SA + 2] * w - value[MA + 1] * u - value[MA + 2] * v
    # the increments before, brought to this interval's length
    ratio = 0.0
    if before[6] > 0.5 * dt and before[6] < 2.0 * dt:
        ratio = dt / before[6] / 12.0
    bx, by, bz = ratio * before[0], ratio * before[1], ratio * before[2]
    cx, cy, cz = ratio * before[3], ratio * before[4], ratio * before[5]
    if ratio > 0.0 and k + 1 < len(interval_s) and 0.5 * dt < interval_s[k + 1] < 2.0 * dt:
        # of the increments before and behind: the error is of the fifth order, and biases cancel
        one = 0.5 * dt / interval_s[k + 1] / 12.0
        bx = 0.5 * bx - one * (angle[k + 1, 0] + ax - x)
        by = 0.5 * by - one * (angle[k + 1, 1] + ay - y)
        bz = 0.5 * bz - one * (angle[k + 1, 2] + az - z)
        cx = 0.5 * cx - one * (velocity[k + 1, 0] + ux - u)
        cy = 0.5 * cy - one * (velocity[k + 1, 1] + uy - v)
        cz = 0.5 * cz - one * (velocity[k + 1, 2] + uz - w)
    # rotation vector with coning; velocity with rotation and sculling
    rx = ax + (by * az - bz * ay)
    ry = ay + (bz * ax - bx * az)
    rz = az + (bx * ay - by * ax)
    sx = ux + 0.5 * (ay * uz - az * uy) + (by * uz - bz * uy) + (cy * az - cz * ay)
    sy = uy + 0.5 * (az * ux - ax * uz) + (bz * ux - bx * uz) + (cz * ax - cx * az)
    sz = uz + 0.5 * (ax * uy - ay * ux) + (bx * uy - by * ux) + (cx * ay - cy * ax)
    # third order of the rotation: a x (a x u) / 6
    qx, qy, qz = ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux
    sx += (ay * qz - az * qy) / 6.0
    sy += (az * qx - ax * qz) / 6.0
    sz += (ax * qy - ay * qx) / 6.0
    before[0], before[1], before[2], before[3], before[4], before[5], before[6] = ax, ay, az, ux, uy, uz, dt
    rotation_of(nav, C)
    fn = C[0, 0] * sx + C[0, 1] * sy + C[0, 2] * sz
    fe = C[1, 0] * sx + C[1, 1] * sy + C[1, 2] * sz
    fd = C[2, 0] * sx + C[2, 1] * sy + C[2, 2] * sz
    vn, ve, vd = nav[3], nav[4], nav[5]
    sine, cosine = math.sin(nav[0]), math.cos(nav[0])
    gravity = normal_gravity(sine, nav[2] - 0.5 * vd * dt)
    root = 1.0 - ECCENTRICITY_SQUARED * sine * sine
    east = SEMI_MAJOR_M / math.sqrt(root)
    north = east * (1.0 - ECCENTRICITY_SQUARED) / root
    # velocity, height and latitude in the middle of the interval
    mn, me, md = vn + 0.5 * fn, ve + 0.5 * fe, vd + 0.5 * (fd + gravity * dt)
    height = nav[2] - 0.5 * md * dt
    latitude = nav[0] + 0.5 * dt * mn / (north + height)
    sine, cosine = math.sin(latitude), math.cos(latitude)
    tn, te = me / (east + height), -mn / (north + height)
    td = -tn * sine / cosine
    en, ed = EARTH_RATE_RADPS * cosine, -EARTH_RATE_RADPS * sine
    wn, we, wd = (en + tn) * dt, te * dt, (ed + td) * dt
    an, ae, ad = wn + en * dt, we, wd + ed * dt
    dn = fn - 0.5 * (we * fd - wd * fe) - (ae * md - ad * me)
    de = fe - 0.5 * (wd * fn - wn * fd) - (ad * mn - an * md)
    dd = fd - 0.5 * (wn * fe - we * fn) - (an * me - ae * mn) + gravity * dt
    nav[3], nav[4], nav[5] = vn + dn, ve + de, vd + dd
    mn, me, md = vn + 0.5 * dn, ve + 0.5 * de, vd + 0.5 * dd
    nav[0] += dt * mn / (north + height)
    nav[1] += dt * me / ((east + height) * cosine)
    nav[2] -= dt * md
    turn_after(nav, rx, ry, rz)
    turn_before(nav, -wn, -we, -wd)
    step[0], step[1], step[2], step[3], step[4], step[5] = x, y, z, ax, ay, az
    step[6], step[7], step[8], step[9], step[10], step[11] = fn, fe, fd, vn, ve, vd
    step[12], step[13], step[14], step[15] = wn, we, wd, dt
    step[16], step[17], step[18] = u, v, w


@inlined
def begin_transition(grown: FloatArray) -> None:
    """Set the transition of navigation over an epoch to that of no time."""
    for i in range(9):
        for j in range(LEV):
            grown[i, j] = 0.0
        grown[i, i] = 1.0


@inlined
def _grow_column(grown: FloatArray, j: int, an: float, ae: float, ad: float, step: FloatArray) -> None:
    """Let one error of the gyro act over a sample: it turns the attitude by (an, ae, ad)."""
    dt = step[15]
    pn, pe, pd = grown[6, j] + 0.5 * an, grown[7, j] + 0.5 * ae, grown[8, j] + 0.5 * ad
    vn = pe * step[8] - pd * step[7]
    ve = pd * step[6] - pn * step[8]
    vd = pn * step[7] - pe * step[6]
    grown[0, j] += (grown[3, j] + 0.5 * vn) * dt
    grown[1, j] += (grown[4, j] + 0.5 * ve) * dt
    grown[2, j] += (grown[5, j] + 0.5 * vd) * dt
    grown[3, j] += vn
    grown[4, j] += ve
    grown[5, j] += vd
    grown[6, j] += an
    grown[7, j] += ae
    grown[8, j] += ad


@inlined
def _push_column(grown: FloatArray, j: int, n: float, e: float, d: float, dt: float) -> None:
    """Let one error of the accelerometer, or of the attitude, act over a sample: it pushes by (n, e, d)."""
    grown[0, j] += (grown[3, j] + 0.5 * n) * dt
    grown[1, j] += (grown[4, j] + 0.5 * e) * dt
    grown[2, j] += (grown[5, j] + 0.5 * d) * dt
    grown[3, j] += n
    grown[4, j] += e
    grown[5, j] += d


@inlined
def grow_transition(C: FloatArray, step: FloatArray, grown: FloatArray) -> None:
    """Let the transition of navigation grow by one sample.

    Velocity errors turn with the frame over the epoch (``finish_transition``).
    """
    dt = step[15]
    for i in range(3):  # the unit's axes: i reads, j turns
        x, y, z = C[0, i], C[1, i], C[2, i]
        for j in range(4):
            turn, a = BG + i, dt
            if j < 3:
                a = step[j]
                turn = SG + i if j == i else MG + 2 * i + j - (1 if j > i else 0)
            _grow_column(grown, turn, -x * a, -y * a, -z * a, step)
        for j in range(i, 4):
            if j == 3:
                _push_column(grown, BA + i, -x * dt, -y * dt, -z * dt, dt)
            elif j == i:
                a = step[16 + i]
                _push_column(grown, SA + i, -x * a, -y * a, -z * a, dt)
            else:  # each of two axes reads a share of what the other feels
                a, b = step[16 + j], step[16 + i]
                n = -x * a - C[0, j] * b
                e = -y * a - C[1, j] * b
                d = -z * a - C[2, j] * b
                _push_column(grown, MA + i + j - 1, n, e, d, dt)
    # attitude: the specific force, once for velocity and twice for position
    for i in range(3):
        n, e, d = 0.0, 0.0, 0.0
        if i == 0:
            e, d = -step[8], step[7]
        elif i == 1:
            n, d = step[8], -step[6]
        else:
            n, e = -step[7], step[6]
        _push_column(grown, ATT + i, n, e, d, dt)


@inlined
def finish_transition(nav: FloatArray, time_s: float, turn: FloatArray, grown: FloatArray, F: FloatArray) -> None:
    """Put the Earth's terms to the transition and lay it out as the filter wants it.

    ``turn``: rotation of n over the epoch (Earth and transport rate), rad, shape (3,) at its start.
    """
    sine, cosine = math.sin(nav[0]), math.cos(nav[0])
    radius = SEMI_MAJOR_M + nav[2]
    wn, we, wd = turn[0], turn[1], turn[2]
    an = wn + EARTH_RATE_RADPS * cosine * time_s
    ad = wd - EARTH_RATE_RADPS * sine * time_s
    for i in range(3):
        grown[i, 3 + i] = time_s
    # velocity: Coriolis, gravity with height
    grown[3, 4] += ad
    grown[3, 5] -= we
    grown[4, 3] -= ad
    grown[4, 5] += an
    grown[5, 3] += we
    grown[5, 4] -= an
    grown[5, 2] += 2.0 * GRAVITY_EQUATOR_MPS2 / radius * time_s
    # attitude: the frame turns, and turns wrongly with a wrong velocity
    grown[6, 7] += wd
    grown[6, 8] -= we
    grown[7, 6] -= wd
    grown[7, 8] += wn
    grown[8, 6] += we
    grown[8, 7] -= wn
    grown[6, 4] -= time_s / radius
    grown[7, 3] += time_s / radius
    grown[8, 4] += time_s / radius * sine / cosine
    e = 0
    for i in range(9):
        for j in range(LEV):
            F[e] = grown[i, j]
            e += 1
