"""Settings of the GNSS reception. Every limit of the method stands here."""

from dataclasses import dataclass

from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class GnssSettings:
    """Limits of the GNSS reception.

    Satellites and HDOP are judged by the share of time beyond a limit. Source of their limits: ArduPilot, commit
    0080bec (read on 2026-11-26), Tools/LogAnalyzer/tests/TestGPSGlitch.py: the least number of satellites below 6
    warns and below 5 fails, the largest HDOP above 3 warns and above 10 fails.
    """

    gap_steps: float = number(3.0, 1.5, 100.0)  # a step longer than so many usual ones is a gap
    gap_min_s: float = number(0.5, 0.0, 60.0)  # a shorter step never is one
    lost_share_warn: float = number(0.02, 0.0, 1.0)  # share of time without a fix after the first one
    lost_share_bad: float = number(0.2, 0.0, 1.0)
    first_fix_warn_s: float = number(120.0, 0.0, 3600.0)
    rtk_lost_share_warn: float = number(0.2, 0.0, 1.0)  # share of time short of a fixed solution that was had
    satellites_warn: float = number(6.0, 0.0, 100.0)
    satellites_bad: float = number(5.0, 0.0, 100.0)
    hdop_warn: float = number(3.0, 0.0, 100.0)
    hdop_bad: float = number(10.0, 0.0, 100.0)
    geometry_share_warn: float = number(0.05, 0.0, 1.0)  # share of time beyond a limit that counts
    geometry_share_bad: float = number(0.2, 0.0, 1.0)  # share of time beyond ``*_bad``
    age_warn_s: float = number(30.0, 0.0, 3600.0)  # corrections older than so
    still_mps: float = number(0.15, 0.01, 5.0)  # mean speed over ``still_window_s`` of what stands
    still_window_s: float = number(5.0, 1.0, 60.0)
    standstill_min_s: float = number(10.0, 2.0, 3600.0)
    standstill_guard_s: float = number(2.0, 0.0, 60.0)  # left out at either end
    standstill_samples_min: int = number(10, 3, 100_000)
    too_sure: float = number(2.0, 1.0, 100.0)  # times the claimed sigma: more scatter than that is a warning
    jump_min_m: float = number(2.0, 0.0, 1000.0)  # a smaller step of the position is none
    jump_min_rtk_m: float = number(0.3, 0.0, 1000.0)  # the same between solutions by carrier phase
    jump_sigmas: float = number(8.0, 3.0, 100.0)  # of the usual difference between position and velocity
    stamp_jitter_s: float = number(0.05, 0.0, 10.0)  # of time stamps: less along the motion is no jump
    velocity_apart_mps: float = number(3.0, 0.1, 1000.0)  # RMS: velocity and position tell different motions
    moving_mps: float = number(2.0, 0.1, 100.0)  # from here on a track tells where the vehicle points
    lag_sigma_max_s: float = number(0.05, 0.001, 10.0)  # a delay known less well is not told
    pair_seconds_min: float = number(5.0, 0.0, 3600.0)  # two receivers must be there together for so long

    def __post_init__(self) -> None:
        check_ranges(self)
