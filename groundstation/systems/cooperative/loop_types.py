"""Arrays of a session under names, as the filters take them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Int64Array

FloatArray = NDArray[np.float64]

PEER, POINT, SATELLITE, HEIGHT = 0, 1, 2, 3
KINDS = ("peer", "point", "satellite", "height")
LOCAL, GLOBAL = 0, 1  # models of an aircraft's own navigation
USED, GATED = 1, -1  # marks of a judged measurement

# columns of an aircraft's epochs
TIME, PLACE, RATE, AXES, HEADING, LATITUDE, MERIDIAN, NORMAL, VELOCITY, FORCE, EPOCH_COLUMNS = (
    *(0, 1, 4, 7, 16),
    *(17, 18, 19, 20, 23, 26),
)


class ModelNumbers(NamedTuple):
    """Constants of an aircraft's model: correlation times."""

    velocity_s: float = 1.0
    gyro_s: float = 1.0
    baro_s: float = 1.0
    clock_s: float = 1.0
    bias_s: float = 1.0


class Events(NamedTuple):
    """Measurements in order of time; value NaN for a bearing alone, bearing NaN without.

    ``source`` is a vehicle or a point; -1 for a satellite or a height. ``place_m`` of a point or satellite. ``arm_m``
    leads from the source's antenna to its place, and from the receiver's place to its antenna. ``spread`` is the share
    of the variances that is the spread of one reading, for the gate; the rest is for its repeating itself.
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
    arm_m: FloatArray  # (m, 3)
    spread: FloatArray


class PointNumbers(NamedTuple):
    """Ground points: axes north and east, sigma, index among the uncertain ones (-1: exact)."""

    axes: FloatArray  # (p, 3, 2)
    sigma_m: FloatArray  # (p,)
    uncertain: Int64Array  # (p,)


class Items(NamedTuple):
    """Events in order: an output of a vehicle, or (vehicle -1) measurements in one update.

    The measurements are those from first to last.
    """

    time_s: FloatArray  # (i,)
    vehicle: Int64Array
    first: Int64Array
    last: Int64Array
