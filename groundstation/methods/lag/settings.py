"""Settings of the latency estimator. Every limit of the method stands here."""

from dataclasses import dataclass

from groundstation.base.toml_settings import check_ranges, number

SLOW_MPS = 3.0  # the track of a slower aircraft does not show where the nose points


@dataclass(frozen=True)
class LatencySettings:
    """Limits of the latency estimator.

    A latency is observed where its 95 % interval is at most ``half_width_max_s`` either way, rests on as many effective
    windows as ``freedom_min`` says, and the reference explains ``explained_min`` of the other's variance.
    ``*_sigma`` are what may be wrong of the model, as prior sigmas: azimuth error of the reference, scale, antenna arm.
    """

    search_s: float = number(2.0, 0.1, 10.0)  # latencies looked at, either way
    search_step_s: float = number(0.1, 0.01, 1.0)
    window_s: float = number(30.0, 5.0, 600.0)
    degree: int = number(2, 0, 5)  # degree of the polynomial in time that each window takes away
    windows_max: int = number(40, 2, 10_000)  # those with the most motion are used
    reference_step_s: float = number(0.1, 0.0, 1.0)  # faster data are averaged over so long
    other_step_s: float = number(0.4, 0.0, 2.0)
    reference_interval_max_s: float = number(0.5, 0.01, 10.0)  # a slower reference does not show the motion
    other_interval_max_s: float = number(2.0, 0.01, 60.0)
    gap_max_s: float = number(0.6, 0.0, 10.0)  # the reference is interpolated over no longer gap
    repeated_share_max: float = number(0.2, 0.0, 1.0)  # share of samples with the time stamp of the one before
    robust_sigmas: float = number(3.0, 1.0, 100.0)
    sigma_floor_s: float = number(0.001, 0.0, 1.0)  # interpolation, and rounding of time stamps
    half_width_max_s: float = number(0.1, 0.0, 10.0)
    freedom_min: float = number(1.5, 1.0, 1000.0)
    explained_min: float = number(0.5, 0.0, 1.0)
    aided_sigma_s: float = number(0.03, 0.0, 1.0)  # delay that the filter of a GNSS-aided INS may hide
    azimuth_sigma_deg: float = number(3.0, 0.0, 180.0)
    scale_sigma: float = number(0.03, 0.0, 1.0)
    arm_sigma_m: float = number(5.0, 0.0, 100.0)
    iron_sigma: float = number(0.3, 0.0, 10.0)  # soft iron and mounting of a magnetometer, share of the field

    def __post_init__(self) -> None:
        check_ranges(self)
