"""Compiled rows of the measurements: innovation and the states that each scalar sees.

A measurement has up to three scalars; row ``h[i, :]`` at ``columns[i, :]``, entries that are not used are zero at
place 0.
"""

import math

from groundstation.base.compile import inlined
from groundstation.base.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_M
from groundstation.systems.trajectory.states import (
    ATT,
    BA,
    BARO,
    BG,
    FAST,
    HEADING,
    HEIGHT,
    LAG,
    LAT,
    LEV,
    MG,
    MNT,
    NO_RATE,
    NO_SLIP,
    POS,
    POSITION,
    SG,
    SLOW,
    STILL,
    VEL,
    VELOCITY,
    WHEEL,
    WHL,
    WIDTH,
    Now,
    Room,
    Seen,
)
from groundstation.systems.trajectory.strapdown import normal_gravity, shorter_way

NO_ROW = 1e9  # innovation of a scalar that a measurement does not have


@inlined
def _arm(m: int, seen: Seen, now: Now, room: Room) -> None:
    """Fill ``room.step`` with the motion of the antenna beside the unit.

    Arm in n, velocity beside the unit's, acceleration, rate in b.

    They stand at 16, 19, 22 and 25, three each; gravity at 15.
    """
    C, step, value = room.C, room.step, now.value
    x, y, z = value[LEV], value[LEV + 1], value[LEV + 2]
    wx, wy, wz = (
        seen.rate[m, 0] - value[BG],
        seen.rate[m, 1] - value[BG + 1],
        seen.rate[m, 2] - value[BG + 2],
    )
    fx, fy, fz = (
        seen.force[m, 0] - value[BA],
        seen.force[m, 1] - value[BA + 1],
        seen.force[m, 2] - value[BA + 2],
    )
    ux, uy, uz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
    for i in range(3):
        step[16 + i] = C[i, 0] * x + C[i, 1] * y + C[i, 2] * z
        step[19 + i] = C[i, 0] * ux + C[i, 1] * uy + C[i, 2] * uz
        step[22 + i] = C[i, 0] * fx + C[i, 1] * fy + C[i, 2] * fz
    step[15] = normal_gravity(math.sin(now.nav[0]), now.nav[2])
    step[24] += step[15]
    step[25], step[26], step[27] = wx, wy, wz


@inlined
def _put(room: Room, i: int, e: int, column: int, value: float) -> None:
    room.columns[i, e] = column
    room.h[i, e] = value


@inlined
def _cross_row(room: Room, i: int, first: int, n: float, e: float, d: float) -> None:
    """Put row i of the matrix that turns phi into phi x (n, e, d)."""
    if i == 0:
        _put(room, 0, first, ATT + 1, d)
        _put(room, 0, first + 1, ATT + 2, -e)
    elif i == 1:
        _put(room, 1, first, ATT, -d)
        _put(room, 1, first + 1, ATT + 2, n)
    else:
        _put(room, 2, first, ATT, e)
        _put(room, 2, first + 1, ATT + 1, -n)


@inlined
def observe(m: int, seen: Seen, now: Now, room: Room) -> None:
    """Fill ``columns``, ``h`` and ``y`` (innovation of the estimate) of measurement m.

    ``room.C`` holds the attitude now.
    """
    kind, nav, value, step, C, y = seen.kind[m], now.nav, now.value, room.step, room.C, room.y
    for i in range(3):
        y[i] = NO_ROW
        for e in range(WIDTH):
            room.columns[i, e] = 0
            room.h[i, e] = 0.0
    if kind <= VELOCITY:  # or position
        _arm(m, seen, now, room)
        since = seen.back_s[m] + value[LAT]  # so much before the epoch
        if kind == VELOCITY:
            since += value[LAG]
        wx, wy, wz = step[25], step[26], step[27]
        fn, fe, fd = step[22], step[23], step[24] - step[15]
        for i in range(3):
            change = step[22 + i]
            speed = nav[3 + i] + step[19 + i]
            # what the velocity beside the unit's changes by with the arm
            lx, ly, lz = C[i, 1] * wz - C[i, 2] * wy, C[i, 2] * wx - C[i, 0] * wz, C[i, 0] * wy - C[i, 1] * wx
            if kind == POSITION:
                y[i] = speed * since - step[16 + i] - 0.5 * change * since * since - value[SLOW + i] - value[FAST + i]
                half = 0.5 * since * since
                _cross_row(
                    room,
                    i,
                    1,
                    step[16] - since * step[19] + half * fn,
                    step[17] - since * step[20] + half * fe,
                    step[18] - since * step[21] + half * fd,
                )
                _put(room, i, 0, POS + i, 1.0)
                _put(room, i, 3, LEV, C[i, 0] - since * lx)
                _put(room, i, 4, LEV + 1, C[i, 1] - since * ly)
                _put(room, i, 5, LEV + 2, C[i, 2] - since * lz)
                _put(room, i, 6, LAT, change * since - speed)
                _put(room, i, 7, SLOW + i, 1.0)
                _put(room, i, 8, FAST + i, 1.0)
                _put(room, i, 9, VEL + i, -since)
            else:
                y[i] = seen.value[m, i] - (speed - change * since)
                _cross_row(room, i, 1, step[19] - since * fn, step[20] - since * fe, step[21] - since * fd)
                _put(room, i, 0, VEL + i, 1.0)
                _put(room, i, 3, LEV, lx)
                _put(room, i, 4, LEV + 1, ly)
                _put(room, i, 5, LEV + 2, lz)
                _put(room, i, 6, LAT, -change)
                _put(room, i, 7, LAG, -change)
        if kind == POSITION:
            sine = math.sin(nav[0])
            root = 1.0 - ECCENTRICITY_SQUARED * sine * sine
            east = SEMI_MAJOR_M / math.sqrt(root)
            north = east * (1.0 - ECCENTRICITY_SQUARED) / root
            y[0] += (seen.value[m, 0] - nav[0]) * (north + nav[2])
            y[1] += shorter_way(seen.value[m, 1] - nav[1]) * (east + nav[2]) * math.cos(nav[0])
            y[2] += nav[2] - seen.value[m, 2]
    elif kind == STILL:
        for i in range(3):
            y[i] = seen.value[m, i] - nav[3 + i]
            _put(room, i, 0, VEL + i, 1.0)
    elif kind == NO_RATE:
        for i in range(3):
            _put(room, i, 0, BG + i, 1.0)
            y[i] = seen.value[m, i] - value[BG + i]
            for j in range(3):  # scale and misalignment act on what is read, as in the strapdown
                at = SG + i if j == i else MG + 2 * i + j - (1 if j > i else 0)
                y[i] -= value[at] * seen.value[m, j]
                _put(room, i, 1 + j, at, seen.value[m, j])
    elif kind == NO_SLIP:
        vx = C[0, 0] * nav[3] + C[1, 0] * nav[4] + C[2, 0] * nav[5]
        vy = C[0, 1] * nav[3] + C[1, 1] * nav[4] + C[2, 1] * nav[5]
        vz = C[0, 2] * nav[3] + C[1, 2] * nav[4] + C[2, 2] * nav[5]
        sy, cy = math.sin(value[MNT]), math.cos(value[MNT])
        sp, cp = math.sin(value[MNT + 1]), math.cos(value[MNT + 1])
        for i in range(2):
            a, b, c = -sy, cy, 0.0
            if i == 1:
                a, b, c = sp * cy, sp * sy, cp
            n = C[0, 0] * a + C[0, 1] * b + C[0, 2] * c
            e = C[1, 0] * a + C[1, 1] * b + C[1, 2] * c
            d = C[2, 0] * a + C[2, 1] * b + C[2, 2] * c
            y[i] = seen.value[m, i] - (n * nav[3] + e * nav[4] + d * nav[5])
            _put(room, i, 0, VEL, n)
            _put(room, i, 1, VEL + 1, e)
            _put(room, i, 2, VEL + 2, d)
            # the axis turns with the attitude: (phi x axis) . v = phi . (axis x v)
            _put(room, i, 3, ATT, e * nav[5] - d * nav[4])
            _put(room, i, 4, ATT + 1, d * nav[3] - n * nav[5])
            _put(room, i, 5, ATT + 2, n * nav[4] - e * nav[3])
            if i == 0:
                _put(room, i, 6, MNT, -cy * vx - sy * vy)
            else:
                _put(room, i, 6, MNT, sp * (cy * vy - sy * vx))
                _put(room, i, 7, MNT + 1, cp * (cy * vx + sy * vy) - sp * vz)
    elif kind == WHEEL:
        vx = C[0, 0] * nav[3] + C[1, 0] * nav[4] + C[2, 0] * nav[5]
        vy = C[0, 1] * nav[3] + C[1, 1] * nav[4] + C[2, 1] * nav[5]
        vz = C[0, 2] * nav[3] + C[1, 2] * nav[4] + C[2, 2] * nav[5]
        sy, cy = math.sin(value[MNT]), math.cos(value[MNT])
        sp, cp = math.sin(value[MNT + 1]), math.cos(value[MNT + 1])
        scale = 1.0 + value[WHL]
        n = scale * (cp * (C[0, 0] * cy + C[0, 1] * sy) - C[0, 2] * sp)
        e = scale * (cp * (C[1, 0] * cy + C[1, 1] * sy) - C[1, 2] * sp)
        d = scale * (cp * (C[2, 0] * cy + C[2, 1] * sy) - C[2, 2] * sp)
        ahead = n * nav[3] + e * nav[4] + d * nav[5]
        y[0] = seen.value[m, 0] - ahead
        _put(room, 0, 0, VEL, n)
        _put(room, 0, 1, VEL + 1, e)
        _put(room, 0, 2, VEL + 2, d)
        _put(room, 0, 3, ATT, e * nav[5] - d * nav[4])
        _put(room, 0, 4, ATT + 1, d * nav[3] - n * nav[5])
        _put(room, 0, 5, ATT + 2, n * nav[4] - e * nav[3])
        _put(room, 0, 6, MNT, scale * cp * (cy * vy - sy * vx))
        _put(room, 0, 7, MNT + 1, -scale * (sp * (cy * vx + sy * vy) + cp * vz))
        _put(room, 0, 8, WHL, ahead / scale)
    elif kind == HEIGHT:
        y[0] = seen.value[m, 0] - (nav[2] + value[BARO])
        _put(room, 0, 0, POS + 2, -1.0)
        _put(room, 0, 1, BARO, 1.0)
    elif kind == HEADING:
        y[0] = shorter_way(seen.value[m, 0] - math.atan2(C[1, 0], C[0, 0]))
        level = C[0, 0] * C[0, 0] + C[1, 0] * C[1, 0]
        if level < 0.03:  # the nose points up or down: there is no heading
            y[0] = NO_ROW
        else:
            _put(room, 0, 0, ATT, -C[2, 0] * C[0, 0] / level)
            _put(room, 0, 1, ATT + 1, -C[2, 0] * C[1, 0] / level)
            _put(room, 0, 2, ATT + 2, 1.0)
