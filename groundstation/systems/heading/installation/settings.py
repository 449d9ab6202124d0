"""Prior of an installation before its first flight, and how often it changes unsaid."""

from collections.abc import Mapping

from groundstation.base.dataclasses import dataclass
from groundstation.results.installations import NAMED_PROBABILITY

ALIGNMENTS: Mapping[str, float] = {"gyrocompass": 0.1, "stored": 1.0}  # sigma of the heading error, deg, by kind
UNKNOWN_ALIGNMENT_DEG = 3.0  # wide enough to teach nothing and to move nothing
# Twice HeadingSettings.mounting_sigma_deg, which no flight corrects: 0.1 does not hold the 0.45 deg between two units
# in one aircraft (docs/heading.md), and flights narrow this one (docs/installation.md).
MOUNTING_DEG = 0.2
STEADY_DEG = 0.05
GROSS_DEG = 60.0  # of a unit turned round, or one of which nothing is known
ORDINARY_WIND_MPS = 3.6
POOLED_SIGMA: Mapping[str, float] = {"compass_a_deg": 5.0, "antenna_arm_m": 5.0, "gnss_latency_s": 1.0}  # beforehand


@dataclass(frozen=True)
class InstallationSettings:
    """Settings of how far the model doubts what it is told.

    Parameters
    ----------
    hazard : float
        Chance a flight that the unit was changed or moved though its serial is the same.
    odd_rates, odd_weights : tuple of float
        Chances a flight that it has a mounting of its own (serial mistyped, two units under one), and what is believed
        of each beforehand: the flights tell which it is.
    gross_share : float
        Of such changes, those that turn the unit round: nothing is known of the mounting then.
    hypotheses : int
        Most histories (which flights changed, which are odd) that are kept, the likeliest.
    nodes : int
        Values of the crosswind factor.
    factor_sigmas : float
        How far they reach, in sigmas of the logarithm.
    named_probability : float
        A change, or an odd flight, is named when it is likelier than that.
    """

    hazard: float = 0.01
    odd_rates: tuple[float, ...] = (0.01, 0.1, 0.4)
    odd_weights: tuple[float, ...] = (0.9, 0.08, 0.02)
    gross_share: float = 0.05
    hypotheses: int = 48
    nodes: int = 15
    factor_sigmas: float = 3.5
    named_probability: float = NAMED_PROBABILITY


def alignment_sigma_deg(kind: str) -> float:
    """Sigma of the heading error that a kind of alignment leaves, deg.

    Examples
    --------
    >>> [alignment_sigma_deg(kind) for kind in ("Gyrocompass, 8 min", "stored heading", "")]
    [0.1, 1.0, 3.0]
    """
    told = kind.lower().replace("-", "").replace(" ", "")
    return next((sigma for name, sigma in ALIGNMENTS.items() if name in told), UNKNOWN_ALIGNMENT_DEG)
