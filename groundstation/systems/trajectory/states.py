"""Error states of the trajectory estimator and the arrays that its compiled loops take.

The state is a correction, truth minus estimate, so that ``estimate + correction`` is better. Every state has a fixed
place; one that a log does not use has variance zero and costs little.

========  ======  =====================================================================================
place     states  what
========  ======  =====================================================================================
POS       3       position of the inertial unit, north, east, down, m
VEL       3       velocity over ground, north, east, down, m/s
ATT       3       attitude: rotation vector in north, east, down, ``C = exp(phi x) C_estimated``, rad
BG, BA    3, 3    biases of gyro (rad/s) and accelerometer (m/s2) along the axes of the unit
SG        3       scale factor of the gyro, no unit
MG        6       misalignment of the gyro, rad: (x, y), (x, z), (y, x), (y, z), (z, x), (z, y) of (reads, turned)
SA, MA    3, 3    scale factor of the accelerometer, and how far its axes are from square: (x, y), (x, z), (y, z)
LEV       3       antenna from the unit, along its axes, m
LAT       1       latency: GNSS valid so much earlier than stamped, beyond what the stamps are shifted by, s
LAG       1       velocity of GNSS valid so much earlier than its position, beyond what the stamps are shifted by, s
SLOW      3       slow error of GNSS position, north, east, down, m
FAST      3       fast error of GNSS position, north, east, down, m
MNT       2       direction of travel of what rolls in the axes of the unit: yaw and pitch, rad
BARO      1       offset of the barometric height, m
WHL       1       scale factor of the speed of the wheels, no unit
========  ======  =====================================================================================

The attitude is that of the accelerometer's axes, made square: a rotation of both triads against the case is seen by
nothing in the log. It is mounting, as the case is against the body.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import Pattern

FloatArray = NDArray[np.float64]
Marks = NDArray[np.int8]

POS, VEL, ATT, BG, BA, SG, MG, SA, MA = 0, 3, 6, 9, 12, 15, 18, 24, 27
LEV, LAT, LAG, SLOW, FAST, MNT, BARO, WHL = 30, 33, 34, 35, 38, 41, 43, 44
STATES = 45
NAVIGATION = 9  # the first states: position, velocity, attitude
KEPT_ROWS = 15  # rows of the covariance that the smoother needs: navigation and biases
MISALIGNED = ((0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1))  # axis that reads, axis that turned
NOT_SQUARE = ((0, 1), (0, 2), (1, 2))

# Kinds of measurements.
POSITION, VELOCITY, STILL, NO_RATE, NO_SLIP, HEIGHT, HEADING, WHEEL = range(8)
KINDS = 8
AIDS = HEIGHT  # this kind and those behind it open no state where they are rejected: it is they that are wrong
WIDTH = 10  # most states that one scalar measurement sees


def transition_pattern() -> Pattern:
    """Return the pattern of the transition of one epoch.

    Rows of navigation are a full block over the states before LEV; the Gauss-Markov states have their own factor.
    """
    rows, columns = [], []
    for row in range(NAVIGATION):
        rows.append(row)
        columns.append(list(range(LEV)))
    for row in (*range(SLOW, MNT), BARO):
        rows.append(row)
        columns.append([row])
    starts = np.concatenate([[0], np.cumsum([len(line) for line in columns])])
    joined = [column for line in columns for column in line]
    return Pattern(*(np.asarray(part, dtype=np.int64) for part in (rows, starts, joined)))


class Imu(NamedTuple):
    """Increments as the loops take them, and what a gap adds to the variances at their end."""

    interval_s: FloatArray  # (n,)
    angle: FloatArray  # (n, 3) rad
    velocity: FloatArray  # (n, 3) m/s
    angle_variance: FloatArray  # (n,) rad2, of each axis
    velocity_variance: FloatArray  # (n,) (m/s)2


class Schedule(NamedTuple):
    """Epochs: the samples that lead to each and the measurements at it."""

    first: Int64Array  # (e + 1,) samples of epoch i: first[i] to first[i + 1]
    seen: Int64Array  # (e + 1,) measurements of epoch i: seen[i] to seen[i + 1]
    slot: Int64Array  # (n,) row of ``Linear.nav`` that keeps the estimate after a sample, -1: not kept


class Seen(NamedTuple):
    """Measurements of up to three scalars, in the order of their epochs; NaN: absent."""

    kind: Int64Array  # (m,)
    back_s: FloatArray  # (m,) so much before the epoch they are valid
    value: FloatArray  # (m, 3): latitude and longitude in rad and height in m; m/s; rad/s; m; rad; m/s
    variance: FloatArray  # (m, 3)
    rate: FloatArray  # (m, 3) angular rate and specific force in the unit's axes, means about that time
    force: FloatArray  # (m, 3)


class Noise(NamedTuple):
    """Numbers of the model as the loops take them.

    Spectral densities of the unit's noise, and the Gauss-Markov processes.
    """

    density: FloatArray  # (5,) gyro rad2/s, accelerometer m2/s3, biases rad2/s3 and m2/s5, slip angle rad2/s
    time_s: FloatArray  # (3,) correlation times: slow, fast, barometer
    variance: FloatArray  # (7,) stationary variances: slow and fast north, east, down, m2; barometer


class Gate(NamedTuple):
    """Rules by which measurements are rejected and the filter is opened again."""

    largest: float  # of the innovation squared over its variance, for each scalar in the mean of its kind
    patience: int  # rejections of a kind in a row until the filter is opened
    opened: FloatArray  # (9,) variances that opening adds to navigation


class Now(NamedTuple):
    """Estimate and covariance; changed in place."""

    nav: FloatArray  # (10,) latitude rad, longitude rad, height m; velocity north, east, down; quaternion n from b wxyz
    value: FloatArray  # (STATES,) values of the states from BG on
    p: FloatArray  # (STATES, STATES)
    before: FloatArray  # (7,) angle and velocity increments before the next sample, and their interval
    in_a_row: Int64Array  # (KINDS,) rejections


class Room(NamedTuple):
    """Working arrays; contents mean nothing before and after."""

    states: Int64Array  # (STATES,) 0, 1, ...
    C: FloatArray  # (3, 3) n from b
    grown: FloatArray  # (9, LEV) transition of navigation over the epoch
    w: FloatArray  # (STATES, STATES)
    g: FloatArray  # (STATES,)
    K: FloatArray  # (STATES,)
    x: FloatArray  # (1, STATES) corrections of the epoch
    columns: Int64Array  # (3, WIDTH)
    h: FloatArray  # (3, WIDTH)
    y: FloatArray  # (3,)
    step: FloatArray  # (28,) increments of a sample, arm and rates of the antenna


class Line(NamedTuple):
    """Trajectory that a pass is linearised about, at the end of each epoch.

    Without rows it is the filter's own estimate.
    """

    nav: FloatArray  # (e or 0, 10)
    value: FloatArray  # (e or 0, STATES)


class Linear(NamedTuple):
    """Linearisation of a log about a trajectory: transitions and rows of the measurements."""

    nav: FloatArray  # (slots, 10) estimate after the samples that are kept, before the measurements of their epoch
    value: FloatArray  # (e or 0, STATES) values at the end of each epoch, before its measurements
    F: FloatArray  # (e, entries)
    spent: FloatArray  # (e, 3) time, variances of gaps: angle, velocity
    closed: FloatArray  # (e, STATES) by which the estimate was moved behind the measurements
    z: FloatArray  # (s,) measured minus predicted of each scalar
    columns: Int64Array  # (s, WIDTH)
    h: FloatArray  # (s, WIDTH)


class Solved(NamedTuple):
    """History of the filter; arrays without length are not kept."""

    p: FloatArray  # (rows, KEPT_ROWS, STATES) before the measurements of the epochs that are smoothed
    row: Int64Array  # (e,) row of ``p`` for each epoch, -1: not kept
    before: FloatArray  # (e, STATES) correction before the measurements of each epoch
    after: FloatArray  # (e, STATES) and after them
    variance: FloatArray  # (e, STATES) after the measurements
    tilt: FloatArray  # (e, 2) covariance of the attitude, north with east, before and after them
    K: FloatArray  # (s, STATES)
    y: FloatArray  # (s,) innovation of the correction
    S: FloatArray  # (s,)
    mark: Marks  # (s,) used 1, rejected -1, absent 0
