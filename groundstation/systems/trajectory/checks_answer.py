"""Checks of the trajectory on its own log, as the answer tells them."""

from dataclasses import dataclass
from typing import Literal

from groundstation.systems.trajectory.quantity_answer import Quantity

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

OutageTruth = Literal["undisturbed solution", "RTK"]


@dataclass(frozen=True)
class RaisedSigma:
    """Factor by which sigmas were raised, 1 where they held, and what asked for it."""

    name: Literal["position", "height", "velocity", "tilt", "heading"]
    factor: float
    reason: str = ""


@dataclass(frozen=True)
class InnovationRow:
    """Mean squared innovation of one sensor over what its covariance expects."""

    sensor: str
    ratio: float
    count: int
    low: float = 0.5
    high: float = 2.0

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

    quantity: Quantity
    unit: str
    count: int
    error_rms: float
    sigma_rms: float
    inside95_share: float
    used_rms: float | None = None
    used_count: int = 0


@dataclass(frozen=True)
class AgainstOwnTrack:
    """Heading minus own track on straights of what rolls.

    ``mad_deg`` is the median absolute deviation, ``scatter_100_s_deg`` the scatter of medians over 100 s.
    """

    samples: int
    mad_deg: float
    scatter_100_s_deg: float | None = None


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

    length_s: float
    count: int
    smoothed_rms_m: float
    forward_end_rms_m: float | None
    inside95_share: float
    rms_over_sigma: float
    seconds: float
    vertical_rms_m: float | None = None
    vertical_inside95_share: float | None = None
    smoothed_worst_m: float | None = None
    forward_end_worst_m: float | None = None
    standing_count: int = 0
    without_gnss_count: int = 0


@dataclass(frozen=True)
class HeadingHypothesis:
    """Heading at start and end under one hypothesis.

    ``below_best`` is its log-likelihood below that of the best.
    """

    start_heading_deg: float
    end_heading_deg: float
    below_best: float


@dataclass(frozen=True)
class SeparationRow:
    """Difference of the forward filter from the smoothed solution in one quantity."""

    quantity: Quantity
    unit: str
    rms: float
    worst: float
    worst_s: float
