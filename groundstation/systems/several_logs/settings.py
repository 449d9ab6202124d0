"""Settings of the relation between two clocks. Every limit of the method stands here."""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class TwoClocksSettings:
    """Limits of the relation between the clocks of two logs.

    ``arrival_sigma_s``: a recorder stamps a GNSS message when it arrives, up to 0.2 s after the epoch it tells of.
    """

    grid_s: float = number(0.2, 0.05, 1.0)  # step of the grid of the first search; chosen
    high_pass_s: float = number(40.0, 5.0, 600.0)  # motion slower than this is left out of the first search; chosen
    # Least time that two logs have in common; half of the shorter one where that is less; chosen.
    overlap_min_s: float = number(30.0, 5.0, 3600.0)
    correlation_min: float = number(0.6, 0.0, 1.0)  # least correlation of two logs that show the same motion; chosen
    # Two logs that move and have a smaller correlation are not of one flight; chosen.
    correlation_other: float = number(0.45, 0.0, 1.0)
    # A second place that fits better than this share of the best one makes the best doubtful; chosen.
    rival_share_max: float = number(0.85, 0.0, 1.0)
    moving_mps: float = number(3.0, 0.1, 100.0)  # a log moves where its speed ranges over more; chosen
    turning_deg: float = number(45.0, 1.0, 360.0)  # a log turns where its heading ranges over more; chosen
    # Motion is looked for so far either side of what GNSS time says; chosen.
    near_gnss_time_s: float = number(30.0, 1.0, 3600.0)
    step_s: float = number(0.5, 0.1, 60.0)  # a smaller step of a clock is not looked for; chosen
    step_search_s: float = number(15.0, 1.0, 120.0)  # lags tried either way in the search for steps of a clock; chosen
    step_window_s: float = number(60.0, 10.0, 600.0)  # length of the windows of the search for steps of a clock; chosen
    # Reach of the fine fit, either side of the place of the first search; chosen.
    search_s: float = number(1.0, 0.2, 10.0)
    window_s: float = number(30.0, 5.0, 600.0)  # length of the windows of the fine fit; chosen
    # So many windows of the fine fit are used, those with the most motion; chosen.
    windows_max: int = number(60, 2, 10_000)
    interval_max_s: float = number(1.5, 0.01, 10.0)  # sources with a longer interval do not show the motion; chosen
    # A relation whose 95 % interval is wider, either way, is no observation; chosen.
    half_width_max_s: float = number(1.0, 0.0, 10.0)
    # Share of the motion of one log that the other explains at least, for a relation that is observed; chosen.
    explained_min: float = number(0.5, 0.0, 1.0)
    drift_sigma_ppm: float = number(50.0, 0.0, 10_000.0)  # prior sigma of the drift between two crystals; chosen
    # Prior sigma of the arm between two antennas, or an antenna and an INS, along each axis; chosen.
    arm_sigma_m: float = number(4.0, 0.0, 100.0)
    # Sigma that interpolation of a slow reference adds, as a share of its interval; chosen.
    slow_reference_share: float = number(0.02, 0.0, 1.0)
    # Sigma of the delay that the filter of an INS that GNSS corrects may hide; chosen.
    aided_sigma_s: float = number(0.01, 0.0, 1.0)
    # Sigma of the stamp of a GNSS message, which a recorder sets when it arrives, up to 0.2 s late.
    arrival_sigma_s: float = number(0.1, 0.0, 5.0)
    # GNSS time farther from the motion than so many sigmas is wrong; chosen.
    contradiction_sigmas: float = number(4.0, 1.0, 100.0)
    apart_max_m: float = number(5_000.0, 1.0)  # two receivers of one flight are nearer to each other; chosen
    # Two sources of one flight are nearer to each other where one is an INS; chosen.
    apart_inertial_max_m: float = number(100_000.0, 1.0)

    def __post_init__(self) -> None:
        check_ranges(self)
