"""Settings of the best trajectory: input, mounting, what is refused or doubtful."""

from dataclasses import dataclass, field

from groundstation.base.toml_settings import check_ranges, number
from groundstation.systems.trajectory.aid_settings import AidSettings
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.systems.trajectory.mounting_settings import MountingSettings


@dataclass(frozen=True)
class TrajectorySettings:
    """Limits of the answer.

    Refused is what no sigma can describe; doubtful is what passed but shows that the model does not fit.
    """

    input: InputSettings = field(default_factory=InputSettings)
    mounting: MountingSettings = field(default_factory=MountingSettings)
    aids: AidSettings = field(default_factory=AidSettings)
    moving_mps: float = number(0.5, 0.05, 10.0)  # GNSS shows more where it moves
    moving_min_s: float = number(60.0, 1.0, 3600.0)  # of motion: less is refused
    sample_rate_min_hz: float = number(25.0, 1.0, 1000.0)  # point samples below it in motion are refused
    sample_rate_doubt_hz: float = number(90.0, 1.0, 1000.0)  # and below it doubtful
    nis_doubt: tuple[float, float] = (0.5, 2.0)  # mean squared innovation over what is expected
    nis_max: float = number(3.0, 1.0, 100.0)  # above it, fitted, refused
    used_share_min: float = number(0.8, 0.0, 1.0)  # of the fixes; the gate kept the others out
    ambiguous_below: float = number(10.0, 0.0, 1000.0)  # log units between two headings
    heading_sigma_max_deg: float = number(5.0, 0.1, 180.0)  # median in motion: above it, refused
    raised_doubt: float = number(3.0, 1.0, 100.0)  # factor on sigmas above which they are doubtful
    latency_doubt_s: float = number(0.5, 0.01, 10.0)
    segment_min_s: float = number(60.0, 5.0, 3600.0)  # shorter segments are left out

    def __post_init__(self) -> None:
        check_ranges(self)
