"""Settings of the best trajectory: input, mounting, what is refused or doubtful."""

from dataclasses import field

from groundstation.base.dataclasses import dataclass
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
    moving_mps: float = number(0.5, 0.05, 10.0)  # the vehicle moves where GNSS shows a higher speed; chosen
    moving_min_s: float = number(60.0, 1.0, 3600.0)  # least time in motion; less is refused; chosen
    # Lowest rate of an inertial unit that logs point samples; less in motion is refused; chosen.
    sample_rate_min_hz: float = number(25.0, 1.0, 1000.0)
    # Point samples at a lower rate make the answer doubtful; chosen.
    sample_rate_doubt_hz: float = number(90.0, 1.0, 1000.0)
    # Mean squared innovation over what is expected, within; beyond this range the answer is doubtful; chosen.
    nis_doubt: tuple[float, float] = (0.5, 2.0)
    # Mean squared innovation over what is expected at most, after the noise was fitted; above it the answer is refused;
    # chosen.
    nis_max: float = number(3.0, 1.0, 100.0)
    # Share of the GNSS fixes that the gate let in at least; below it the answer is doubtful; chosen.
    used_share_min: float = number(0.8, 0.0, 1.0)
    # A second heading less likely by no more than so many log units makes the heading ambiguous; chosen.
    ambiguous_below: float = number(10.0, 0.0, 1000.0)
    # Median sigma of the heading in motion at most; above it the answer is refused; chosen.
    heading_sigma_max_deg: float = number(5.0, 0.1, 180.0)
    # Factor by which replayed outages raise the sigmas; above it the answer is doubtful; chosen.
    raised_doubt: float = number(3.0, 1.0, 100.0)
    # A GNSS latency beyond this, either way, makes the answer doubtful; chosen.
    latency_doubt_s: float = number(0.5, 0.01, 10.0)
    segment_min_s: float = number(60.0, 5.0, 3600.0)  # shorter segments of the inertial unit are left out; chosen

    def __post_init__(self) -> None:
        check_ranges(self)
