"""Settings of the input of the trajectory: which unit and receiver, and what is a gap."""

from dataclasses import dataclass

from groundstation.base.toml_settings import number


@dataclass(frozen=True)
class InputSettings:
    """Limits of the input.

    Parameters
    ----------
    imu_topic, gnss_topic : str
        Named by the user; empty: chosen.
    """

    imu_topic: str = ""
    gnss_topic: str = ""
    gap_s: float = number(0.1, 0.01, 10.0)  # a longer step of the unit is a gap: nothing is made up for it
    gap_steps: float = number(2.5, 1.5, 100.0)  # nor is a step a gap that is shorter than so many usual ones
    segment_s: float = number(1.0, 0.1, 60.0)  # times are put on a line anew behind a longer one
    stuck_s: float = number(5.0, 0.5, 600.0)  # an axis that keeps one value for so long, while others move, is stuck
    stuck_share_max: float = number(0.5, 0.0, 1.0)  # of the samples: with more of them stuck a unit is none
    covered_share_min: float = number(0.8, 0.0, 1.0)  # increments of less of the time are taken as samples
    covered_share_max: float = number(1.2, 1.0, 10.0)  # increments of more of the time overlap
