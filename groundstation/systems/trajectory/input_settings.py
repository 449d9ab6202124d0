"""Settings of the input of the trajectory: which unit and receiver, and what is a gap."""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import number


@dataclass(frozen=True)
class InputSettings:
    """Limits of the input.

    Parameters
    ----------
    imu_topic : str
        Topic of the inertial unit; empty: chosen by the tool.
    gnss_topic : str
        Topic of the GNSS receiver; empty: chosen by the tool.
    """

    imu_topic: str = ""
    gnss_topic: str = ""
    # A longer step of the inertial unit is a gap: nothing is made up for it; chosen.
    gap_s: float = number(0.1, 0.01, 10.0)
    gap_steps: float = number(2.5, 1.5, 100.0)  # a step shorter than so many usual ones is no gap; chosen
    # Behind a longer step the times of the unit are put on a line anew; chosen.
    segment_s: float = number(1.0, 0.1, 60.0)
    # An axis of the unit that keeps one value for so long, while others move, is stuck; chosen.
    stuck_s: float = number(5.0, 0.5, 600.0)
    stuck_share_max: float = number(0.5, 0.0, 1.0)  # share of stuck samples above which the unit is refused; chosen
    # Increments that cover a smaller share of the time are taken as samples; chosen.
    covered_share_min: float = number(0.8, 0.0, 1.0)
    # Increments that cover a larger share of the time overlap, and are refused; chosen.
    covered_share_max: float = number(1.2, 1.0, 10.0)
