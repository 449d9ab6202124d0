"""Interface of a vehicle to the filters, with two kinds.

An aircraft's state is the error of its INS, barometer and clocks, counted off its dead reckoning: corrected = reading -
estimated error (aircraft.py). A wheeled vehicle's state is its place and heading themselves (wheeled_vehicle.py).
"""

from collections.abc import Mapping
from typing import Protocol

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass

SAME_TIME_S = 1e-9
PATIENCE = 30  # rejections of a vehicle in a row: then its clock has leapt, or it is not where it thinks
LEAP_M = 1e5  # sigma of a clock that has leapt
Step = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, slots=True)
class View:
    """Position and direction of a vehicle's sensor when it took a measurement.

    Parameters
    ----------
    place_m : ndarray, shape (3,)
        Frame of the session.
    derivative : ndarray, shape (3, n)
        By the state.
    heading_rad : float
        Of the sensor; NaN for one that takes no bearings.
    by_heading : ndarray, shape (n,)
        Derivative of the heading by the state.
    """

    place_m: FloatArray
    derivative: FloatArray
    heading_rad: float
    by_heading: FloatArray


class Vehicle(Protocol):
    """One vehicle as the filters see it; the index of a state it does not have is -1."""

    @property
    def name(self) -> str:
        """Name of the vehicle."""

    @property
    def states(self) -> tuple[str, ...]:
        """Names with units."""

    @property
    def clock(self) -> int:
        """Index of the clock offset of the link."""

    @property
    def receiver_clock(self) -> int:
        """Index of the clock offset of the satellite receiver."""

    @property
    def bias(self) -> int:
        """Index of the range bias."""

    @property
    def heading(self) -> int:
        """Index of the heading (rad)."""

    @property
    def height(self) -> int:
        """Index of the error of height."""

    @property
    def has_range_errors(self) -> bool:
        """Tell whether a range has an error that is a state."""

    @property
    def doubts(self) -> Mapping[int, float]:
        """Doubtful states: reopened when nothing fits, each with the variance then added."""

    @property
    def first_s(self) -> float:
        """First epoch of its own navigation."""

    @property
    def last_s(self) -> float:
        """Last epoch."""

    @property
    def size(self) -> int:
        """Number of states."""

    def start(self) -> tuple[FloatArray, FloatArray]:
        """State and covariance at ``first_s``."""

    def step(self, x: FloatArray, from_s: float, to_s: float) -> Step:
        """State after a step, its transition matrix and the covariance of the noise."""

    def place(self, x: FloatArray, at_s: float) -> tuple[FloatArray, FloatArray]:
        """Return the antenna's position and its derivative by the state, shape (3, n).

        The position is in the frame of the session.
        """

    def view(self, x: FloatArray, at_s: float) -> View:
        """Place and heading of the sensor of a measurement stamped ``at_s``."""

    def range_error(self, x: FloatArray, distance_m: float, *, is_peer: bool) -> tuple[float, FloatArray, float]:
        """Return the error of a range to a peer or point, and its derivatives.

        They are by the state, shape (n,), and by the distance.
        """

    def height_m(self, at_s: float) -> float:
        """Height as dead reckoning has it."""
