"""What the compiled loops of this room are handed: arrays under names. No numba here."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Int64Array

FloatArray = NDArray[np.float64]

PEER, POINT, SATELLITE, HEIGHT = 0, 1, 2, 3
KINDS = ("peer", "point", "satellite", "height")
LOCAL, GLOBAL, WHEELED = 0, 1, 2  # models of a vehicle's own navigation

# columns of Fleet.epochs; an aircraft's from PLACE on, a wheeled vehicle's SPEED and TURN
TIME, PLACE, RATE, AXES, HEADING, LATITUDE, MERIDIAN, NORMAL, VELOCITY, FORCE, EPOCH_COLUMNS = (
    *(0, 1, 4, 7, 16),
    *(17, 18, 19, 20, 23, 26),
)
SPEED, TURN = 1, 2


class Numbers(NamedTuple):
    """Constants of a vehicle's model: correlation times, and variances a second or a metre of its odometry."""

    velocity_s: float = 1.0
    gyro_s: float = 1.0
    baro_s: float = 1.0
    clock_s: float = 1.0
    bias_s: float = 1.0
    along_m2ps: float = 0.0
    slip_m2pm: float = 0.0
    turn_rad2ps: float = 0.0
    speed_scale_ps: float = 0.0
    turn_scale_ps: float = 0.0
    bias_m2ps: float = 0.0


class Fleet(NamedTuple):
    """k vehicles, at most n states each; the tables of their epochs stand one below the other.

    Places of states are -1 where a vehicle has no such state: clock offset of the link and of the satellite receiver,
    range bias, heading (rad), height, lever arm (forward, then right), scales of speed and turn.
    """

    model: Int64Array  # (k,)
    size: Int64Array
    clock: Int64Array
    receiver_clock: Int64Array
    bias: Int64Array
    heading: Int64Array
    height: Int64Array
    lever: Int64Array
    speed_scale: Int64Array
    turn_scale: Int64Array
    first: Int64Array  # (k + 1,) epochs of vehicle i: first[i] to first[i + 1]
    time_s: FloatArray  # (t,) of the epochs
    epochs: FloatArray  # (t, EPOCH_COLUMNS)
    density: FloatArray  # (k, n) of the white noise on each state
    numbers: FloatArray  # (k, 11) Numbers


class Events(NamedTuple):
    """Measurements in order of time; value NaN for a bearing alone, bearing NaN without.

    ``source`` is a vehicle or a point; -1 for a satellite or a height. ``place_m`` of a point or satellite.
    """

    time_s: FloatArray  # (m,)
    kind: Int64Array
    receiver: Int64Array
    source: Int64Array
    value_m: FloatArray
    variance_m2: FloatArray
    slot: Int64Array
    place_m: FloatArray  # (m, 3)
    bearing_rad: FloatArray
    bearing_variance_rad2: FloatArray
    is_two_way: NDArray[np.bool_]


class Points(NamedTuple):
    """Ground points: axes north and east, how wrong each is, and its place among the uncertain ones (-1: exact)."""

    axes: FloatArray  # (p, 3, 2)
    sigma_m: FloatArray  # (p,)
    uncertain: Int64Array  # (p,)


class Items(NamedTuple):
    """What happens, in order: output of a vehicle, or (vehicle -1) measurements first to last in one update."""

    time_s: FloatArray  # (i,)
    vehicle: Int64Array
    first: Int64Array
    last: Int64Array


class Rules(NamedTuple):
    """Settings of the filters as numbers; see ``CooperativeSettings``."""

    gate_sigma: float
    is_together: bool
    about_reckoning: bool
    uses_measurements: bool
    innovates: bool


class Rows(NamedTuple):
    """One event linearised: a range or height, then a bearing. innovation = receiver + place + clock + noise."""

    innovation: FloatArray  # (2,)
    receiver: FloatArray  # (2, n) derivative by the receiver's state
    place: FloatArray  # (2, 3) by the position of the source
    clock: FloatArray  # (2,) by its clock offset
    variance: FloatArray  # (2,)


class Log(NamedTuple):
    """What a run writes down: states at every output, every measurement as it was judged, and counts."""

    x: FloatArray  # (outputs, n)
    P: FloatArray  # (outputs, n, n)
    event: Int64Array  # (rows,) measurement
    innovation: FloatArray
    variance: FloatArray
    mark: Int64Array  # 1 used, -1 rejected
    counts: Int64Array  # COUNTS
    sent: Int64Array  # (k,) messages


OUTPUTS, JUDGED, LOST, UNUSED, CLOCK_LEAPS = 0, 1, 2, 3, 4  # of Log.counts
COUNTS = 5
USED, GATED = 1, -1
