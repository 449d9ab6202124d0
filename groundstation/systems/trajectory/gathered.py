"""Input of a trajectory with the facts about it: topics, clock, gaps, sigmas."""

from groundstation.base.dataclasses import dataclass
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements


@dataclass(frozen=True)
class InputNote:
    """Fact about the input that a reader of the answer must know.

    Parameters
    ----------
    code : str
        Stable: ``point_samples``, ``retimed``, ``gaps``, ``clipped``, ``stuck_axis``, ``blended`` ...
    text : str
        For people.
    count : int
        Samples, fixes or gaps.
    is_doubt : bool
        True where the answer must not be trusted as it would be without.
    """

    code: str
    text: str
    count: int = 0
    is_doubt: bool = False


@dataclass(frozen=True)
class ImuFacts:
    """Facts about the inertial unit of a flight.

    Parameters
    ----------
    topic : str
    is_integral : bool
        The unit integrated.
    rate_hz : float
        Median.
    jitter_s : float
        Standard deviation of the stamps from the line that they were put on, by the median; 0 where they were left.
    jitter_max_s : float
    bridged_s : float
        Seconds without samples in steps that are no gap.
    gaps : int
    longest_gap_s : float
    clipped, saturated : int
        Samples that the unit calls clipped, and those that stay at the end of the range.
    """

    topic: str
    is_integral: bool
    rate_hz: float
    jitter_s: float = 0.0
    jitter_max_s: float = 0.0
    bridged_s: float = 0.0
    gaps: int = 0
    longest_gap_s: float = 0.0
    clipped: int = 0
    saturated: int = 0


@dataclass(frozen=True)
class GnssFacts:
    """Facts about the receiver of a flight.

    Parameters
    ----------
    topic : str
    rate_hz : float
        Median.
    position_sigma_from, velocity_sigma_from : str
        Source of the standard deviations, of most fixes.
    height : {'ellipsoid', 'msl', ''}
        Datum of the heights; empty where there are none.
    precise_share : float
        Share of the fixes by carrier phase.
    """

    topic: str
    rate_hz: float
    position_sigma_from: str
    velocity_sigma_from: str
    height: str
    precise_share: float


@dataclass(frozen=True)
class Gathered:
    """Input of the estimator, and what is to be said of it."""

    imu: ImuIncrements
    gnss: GnssFixes
    imu_facts: ImuFacts
    gnss_facts: GnssFacts
    notes: tuple[InputNote, ...] = ()

    @property
    def topics(self) -> tuple[str, str]:
        """Topics of the unit and of the receiver."""
        return self.imu_facts.topic, self.gnss_facts.topic
