"""Settings of the GNSS reception. Every limit of the method stands here."""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class GnssSettings:
    """Limits of the GNSS reception.

    Satellites and HDOP are judged by the share of time beyond a limit. Source of their limits: ArduPilot, commit
    0080bec (read on 2026-11-26), Tools/LogAnalyzer/tests/TestGPSGlitch.py: the least number of satellites below 6
    warns and below 5 fails, the largest HDOP above 3 warns and above 10 fails.
    """

    gap_steps: float = number(3.0, 1.5, 100.0)  # a step of time longer than so many usual ones is a gap; chosen
    gap_min_s: float = number(0.2, 0.0, 60.0)  # a shorter step of time never is a gap; as the ledger's
    loss_min_s: float = number(0.5, 0.0, 60.0)  # a shorter time without a fix is no loss; chosen
    # Share of the time without a fix after the first one that is worth a warning; chosen.
    lost_share_warn: float = number(0.02, 0.0, 1.0)
    # Share of the time without a fix after the first one that is bad; chosen.
    lost_share_bad: float = number(0.2, 0.0, 1.0)
    # A later first fix, from the start of the log, is worth a warning; chosen.
    first_fix_warn_s: float = number(120.0, 0.0, 3600.0)
    # Share of the time without a fixed RTK solution, where one was had, that is worth a warning; chosen.
    rtk_lost_share_warn: float = number(0.2, 0.0, 1.0)
    # Fewer satellites are worth a warning, where they are so for geometry_share_warn of the time; ArduPilot
    # LogAnalyzer.
    satellites_warn: float = number(6.0, 0.0, 100.0)
    # Fewer satellites are bad, where they are so for geometry_share_bad of the time; ArduPilot LogAnalyzer.
    satellites_bad: float = number(5.0, 0.0, 100.0)
    # A larger HDOP is worth a warning, where it is so for geometry_share_warn of the time; ArduPilot LogAnalyzer.
    hdop_warn: float = number(3.0, 0.0, 100.0)
    # A larger HDOP is bad, where it is so for geometry_share_bad of the time; ArduPilot LogAnalyzer.
    hdop_bad: float = number(10.0, 0.0, 100.0)
    # Share of the time beyond a limit of satellites or HDOP, in 2D or without integrity that is worth a warning;
    # chosen.
    geometry_share_warn: float = number(0.05, 0.0, 1.0)
    # Share of the time beyond a limit of satellites or HDOP that is bad; chosen.
    geometry_share_bad: float = number(0.2, 0.0, 1.0)
    age_warn_s: float = number(30.0, 0.0, 3600.0)  # older corrections are worth a warning; chosen
    # The receiver stands while its mean speed over still_window_s is lower; chosen.
    still_mps: float = number(0.15, 0.01, 5.0)
    still_window_s: float = number(5.0, 1.0, 60.0)  # time over which velocity is averaged to tell a standstill; chosen
    # Shortest standstill by which claimed accuracy is judged; chosen.
    standstill_min_s: float = number(10.0, 2.0, 3600.0)
    standstill_guard_s: float = number(2.0, 0.0, 60.0)  # left out at either end of a standstill; chosen
    # Fewest samples of a standstill by which claimed accuracy is judged; chosen.
    standstill_samples_min: int = number(10, 3, 100_000)
    # Scatter at standstill over the claimed sigma that is worth a warning; chosen.
    too_sure: float = number(2.0, 1.0, 100.0)
    jump_min_m: float = number(2.0, 0.0, 1000.0)  # a smaller step of the position is no jump; chosen
    # A smaller step of the position between solutions by carrier phase is no jump; chosen.
    jump_min_rtk_m: float = number(0.3, 0.0, 1000.0)
    # A jump is more than so many usual differences between position and velocity; chosen.
    jump_sigmas: float = number(8.0, 3.0, 100.0)
    # Jitter of time stamps: what it makes of the speed along the motion is no jump; chosen.
    stamp_jitter_s: float = number(0.05, 0.0, 10.0)
    # RMS difference of velocity and change of position that is worth a warning; chosen.
    velocity_apart_mps: float = number(3.0, 0.1, 1000.0)
    moving_mps: float = number(2.0, 0.1, 100.0)  # at a higher speed the track tells where the vehicle points; chosen
    lag_sigma_max_s: float = number(0.05, 0.001, 10.0)  # a delay whose sigma is larger is not told; chosen
    # Two receivers are compared where both are there for so long; chosen.
    pair_seconds_min: float = number(5.0, 0.0, 3600.0)

    def __post_init__(self) -> None:
        check_ranges(self)
