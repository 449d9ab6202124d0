"""Checks of the trajectory on its own log, as the answer tells them."""

from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.systems.trajectory.quantity_answer import Quantity

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

OutageTruth = Literal["undisturbed solution", "RTK"]


@dataclass(frozen=True)
class RaisedSigma:
    """Factor by which sigmas were raised, 1 where they held, and what asked for it."""

    name: Literal["position", "height", "velocity", "tilt", "heading"]  #: Group of states.
    factor: float  #: 1 where the sigmas held.
    reason: str = ""  #: Check that asked for it.


@dataclass(frozen=True)
class InnovationRow:
    """Mean squared innovation of one sensor over what its covariance expects."""

    sensor: str  #: Sensor whose measurements are judged.
    ratio: float  #: Mean squared innovation over what the covariance expects; 1 is honest.
    count: int  #: Number of innovations.
    low: float = 0.5  #: Lower limit of an honest ratio.
    high: float = 2.0  #: Upper limit of an honest ratio.

    @property
    def is_inside(self) -> bool:
        """Tell whether the ratio is within its limits."""
        return self.low <= self.ratio <= self.high


@dataclass(frozen=True)
class HeldOutRow:
    """GNSS that was held out of the solution against it.

    ``error_rms`` is GNSS minus solution, ``sigma_rms`` what both sigmas expect of it. ``used_rms`` is that of the
    ``used_count`` values that were used.
    """

    quantity: Quantity  #: Quantity compared.
    unit: str
    count: int  #: Values held out.
    error_rms: float  #: RMS of GNSS minus solution.
    sigma_rms: float  #: What both sigmas expect of it.
    inside95_share: float  #: Share of the errors inside 95 % of both sigmas.
    used_rms: float | None = None  #: The same RMS of values that were used.
    used_count: int = 0  #: Values that were used.


@dataclass(frozen=True)
class AgainstOwnTrack:
    """Heading minus own track on straights of what rolls.

    ``mad_deg`` is the median absolute deviation, ``scatter_100_s_deg`` the scatter of medians over 100 s.
    """

    samples: int
    mad_deg: float  #: Median absolute deviation of heading minus track.
    scatter_100_s_deg: float | None = None  #: Scatter of the medians over 100 s.


@dataclass(frozen=True)
class OutageRow:
    """Replayed outages of one length.

    Parameters
    ----------
    length_s : float
    count : int
    smoothed_rms_m : float
        Largest horizontal error inside each outage, smoothed solution; RMS over the outages.
    forward_end_rms_m : float or None
        Horizontal error of the forward filter at the end of each outage, RMS.
    inside95_share : float
        Share of the outages whose largest error is inside 95 % of its sigma.
    rms_over_sigma : float
        RMS error over RMS sigma.
    seconds : float
        Replayed altogether.
    vertical_rms_m, vertical_inside95_share : float or None
        Likewise of the height.
    smoothed_worst_m, forward_end_worst_m : float or None
        Largest of the outages.
    standing_count, without_gnss_count : int
        Outages of this length that were tried and left out: the vehicle mostly stood, or GNSS is not there.
    """

    length_s: float  #: Length of each outage.
    count: int  #: Outages replayed.
    smoothed_rms_m: float
    forward_end_rms_m: float | None
    inside95_share: float
    rms_over_sigma: float
    seconds: float
    vertical_rms_m: float | None = None  #: RMS of the height error; null without one.
    vertical_inside95_share: float | None = None  #: Share of the height errors inside 95 % of their sigma.
    smoothed_worst_m: float | None = None  #: Largest horizontal error of the smoothed solution.
    forward_end_worst_m: float | None = None  #: Largest horizontal error of the forward filter at the end of an outage.
    standing_count: int = 0  #: Outages tried and left out, as the vehicle mostly stood.
    without_gnss_count: int = 0  #: Outages tried and left out, as GNSS is not there.


@dataclass(frozen=True)
class HeadingHypothesis:
    """Heading at start and end under one hypothesis.

    ``below_best`` is its log-likelihood below that of the best.
    """

    start_heading_deg: float  #: True heading at the start under it.
    end_heading_deg: float  #: True heading at the end under it.
    below_best: float  #: Log-likelihood below that of the best hypothesis.


@dataclass(frozen=True)
class SeparationRow:
    """Difference of the forward filter from the smoothed solution in one quantity."""

    quantity: Quantity  #: Quantity compared.
    unit: str
    rms: float  #: RMS of the difference.
    worst: float  #: Largest difference.
    worst_s: float  #: Flight second of the largest.
