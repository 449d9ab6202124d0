"""Settings of the relation between two clocks. Every limit of the method stands here."""

from dataclasses import dataclass

from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class TwoClocksSettings:
    """Limits of the relation between the clocks of two logs.

    ``arrival_sigma_s``: a recorder stamps a GNSS message when it arrives, up to 0.2 s after the epoch it tells of.
    """

    grid_s: float = number(0.2, 0.05, 1.0)  # of the first search
    high_pass_s: float = number(40.0, 5.0, 600.0)  # slower motion is left out of it
    overlap_min_s: float = number(30.0, 5.0, 3600.0)
    correlation_min: float = number(0.6, 0.0, 1.0)  # of two logs that show the same motion
    correlation_other: float = number(0.45, 0.0, 1.0)  # two logs that move and agree less are not of one flight
    rival_share_max: float = number(0.85, 0.0, 1.0)  # a second place that fits nearly as well makes the first doubtful
    moving_mps: float = number(3.0, 0.1, 100.0)  # range of the speed of a log that moves
    turning_deg: float = number(45.0, 1.0, 360.0)  # range of the heading of one that turns
    near_gnss_time_s: float = number(30.0, 1.0, 3600.0)  # looked at either side of what GNSS time says
    step_s: float = number(0.5, 0.1, 60.0)  # a smaller step of a clock is not looked for
    step_search_s: float = number(15.0, 1.0, 120.0)
    step_window_s: float = number(60.0, 10.0, 600.0)
    search_s: float = number(1.0, 0.2, 10.0)  # of the fine fit, either side of the first search
    window_s: float = number(30.0, 5.0, 600.0)
    windows_max: int = number(60, 2, 10_000)
    interval_max_s: float = number(1.5, 0.01, 10.0)  # slower sources do not show the motion
    half_width_max_s: float = number(1.0, 0.0, 10.0)  # a wider 95 % interval is no observation
    explained_min: float = number(0.5, 0.0, 1.0)
    drift_sigma_ppm: float = number(50.0, 0.0, 10_000.0)  # of two crystals, before anything is known
    arm_sigma_m: float = number(4.0, 0.0, 100.0)  # between two antennas, or an antenna and an INS, along each axis
    slow_reference_share: float = number(0.02, 0.0, 1.0)  # of the interval of a slow reference, for interpolation
    aided_sigma_s: float = number(0.01, 0.0, 1.0)  # what the filter of an INS that GNSS corrects may hide
    arrival_sigma_s: float = number(0.1, 0.0, 5.0)
    contradiction_sigmas: float = number(4.0, 1.0, 100.0)  # GNSS time that is farther from the motion is wrong
    apart_max_m: float = number(5_000.0, 1.0)  # two receivers of one flight are nearer
    apart_inertial_max_m: float = number(100_000.0, 1.0)  # the same where an INS is one of them

    def __post_init__(self) -> None:
        check_ranges(self)
