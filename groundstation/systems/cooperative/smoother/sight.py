"""Interface of vehicles of one kind to the smoother: motion between knots, and sights.

All is done for many vehicles and times at once. A state stands at a knot; a reading at another time sees it through the
motion from there.
"""

from typing import NamedTuple, Protocol

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array

Motion = tuple[FloatArray, FloatArray, FloatArray]  # moved states (..., n), transitions and noise (..., n, n)


@dataclass(frozen=True, slots=True)
class Sight:
    """Places of the sensors of m ends of measurements, with derivatives.

    Parameters
    ----------
    place_m : ndarray, shape (m, 3)
    by_state : ndarray, shape (m, 3, n)
    velocity_mps : ndarray, shape (m, 3)
        By which a place moves on with time.
    heading_rad : ndarray, shape (m,), optional
    by_heading : ndarray, shape (m, n), optional
    """

    place_m: FloatArray
    by_state: FloatArray
    velocity_mps: FloatArray
    heading_rad: FloatArray | None = None
    by_heading: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class RangeErrors:
    """Errors that receivers add to a range: bias + scale distance.

    ``by_state`` is the derivative of the bias, ``by_scale`` is the index of the state of the scale, -1 without one.
    """

    bias_m: FloatArray  # (m,)
    by_state: FloatArray  # (m, n)
    scale: FloatArray  # (m,)
    by_scale: int


class OutputStates(NamedTuple):
    """A vehicle at some times, from its states at the knots."""

    position_m: FloatArray  # (m, 3)
    state: FloatArray  # (m, n)
    covariance: FloatArray  # (m, n, n)
    by_knot: FloatArray  # (m, n, n) derivative of the state by that at the knot


class Ends(Protocol):
    """Ends of measurements at vehicles of one group, in the order of the measurements.

    ``clock`` and ``receiver_clock`` are rows (m, n) that give the clock offset from the state, None without clocks;
    ``height`` likewise that of the error of height, and ``level_m`` (m,) the height as it was read. ``lag`` is the
    index of the state by which stamps are late, -1 without one.
    """

    @property
    def clock(self) -> FloatArray | None:
        """Rows that give the clock offset of the link."""

    @property
    def receiver_clock(self) -> FloatArray | None:
        """Rows that give the clock offset of the satellite receiver."""

    @property
    def height(self) -> FloatArray | None:
        """Rows that give the error of height."""

    @property
    def level_m(self) -> FloatArray:
        """Heights as read."""

    @property
    def lag(self) -> int:
        """Index of the lag among the states."""

    def sight(self, x: FloatArray, rows: slice, late_s: FloatArray | None) -> Sight:
        """See from the states (m, n) of some of the ends, ``late_s`` before their stamps."""

    def errors(self, x: FloatArray, rows: slice, is_peer: FloatArray) -> RangeErrors:
        """Return what receivers add to ranges; ``is_peer`` is 1 for one to a vehicle."""


class Group(Protocol):
    """Vehicles of one kind, n states each."""

    @property
    def size(self) -> int:
        """Number of states of each vehicle."""

    @property
    def count(self) -> int:
        """Number of vehicles."""

    def start(self) -> tuple[FloatArray, FloatArray]:
        """Return states and their variances at the start, (v, n) each."""

    def set_knots(self, own_s: FloatArray) -> None:
        """Take the times of the knots (t, v), each vehicle's own."""

    def move(self, x: FloatArray, first: int, last: int) -> Motion:
        """Move states (l, v, n) from the knots first to last - 1 to those behind them."""

    def ends(self, who: Int64Array, time_s: FloatArray, knot: Int64Array) -> Ends:
        """Return ends at vehicles of this group at some times, each seen from a knot."""

    def states_at(self, who: int, time_s: FloatArray, knot: Int64Array, x: FloatArray, P: FloatArray) -> OutputStates:
        """Return positions, states and covariances of one vehicle at some times.

        ``x`` (m, n) and ``P`` (m, n, n) stand at the knots.
        """
