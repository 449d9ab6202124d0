"""Arrays handed to the compiled loops of this folder, under names. No numba here."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Int64Array

FloatArray = NDArray[np.float64]

PEER, POINT, SATELLITE, HEIGHT = 0, 1, 2, 3
KINDS = ("peer", "point", "satellite", "height")
LOCAL, GLOBAL = 0, 1  # models of an aircraft's own navigation

# columns of Fleet.epochs
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


class Fleet(NamedTuple):
    """k aircraft, at most n states each; the tables of their epochs stand one below the other.

    Indices of states: clock offset of the link and of the satellite receiver, range bias, height, lever arm (forward,
    then right); -1 where an aircraft has no such state.
    """

    model: Int64Array  # (k,)
    size: Int64Array
    clock: Int64Array
    receiver_clock: Int64Array
    bias: Int64Array
    height: Int64Array
    lever: Int64Array
    first: Int64Array  # (k + 1,) epochs of vehicle i: first[i] to first[i + 1]
    time_s: FloatArray  # (t,) of the epochs
    epochs: FloatArray  # (t, EPOCH_COLUMNS)
    density: FloatArray  # (k, n) of the white noise on each state
    numbers: FloatArray  # (k, 5) ModelNumbers


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


class LoopRules(NamedTuple):
    """Settings of the filters as numbers; see ``CooperativeSettings``."""

    gate_sigma: float
    is_together: bool
    about_reckoning: bool
    uses_measurements: bool
    innovates: bool


class LinearisedEvent(NamedTuple):
    """One event linearised, a range or a height; row 0 holds it.

    innovation = receiver + place + clock + noise. ``line`` is a work array.
    """

    innovation: FloatArray  # (1,)
    receiver: FloatArray  # (1, n) derivative by the receiver's state
    place: FloatArray  # (1, 3) by the position of the source
    clock: FloatArray  # (1,) by its clock offset
    variance: FloatArray  # (1,)
    line: FloatArray  # (3, 3)


def rows_for(n: int) -> LinearisedEvent:
    """Make empty rows for one event."""
    return LinearisedEvent(np.zeros(1), np.zeros((1, n)), np.zeros((1, 3)), np.zeros(1), np.zeros(1), np.zeros((3, 3)))


class RunRecords(NamedTuple):
    """Records of a run: states at every output, every measurement as judged, and counts."""

    x: FloatArray  # (outputs, n)
    P: FloatArray  # (outputs, n, n)
    event: Int64Array  # (rows,) measurement
    innovation: FloatArray
    variance: FloatArray
    mark: Int64Array  # 1 used, -1 rejected
    counts: Int64Array  # COUNTS
    sent: Int64Array  # (k,) messages


OUTPUTS, JUDGED, LOST, UNUSED, CLOCK_LEAPS = 0, 1, 2, 3, 4  # of RunRecords.counts
COUNTS = 5
USED, GATED = 1, -1
