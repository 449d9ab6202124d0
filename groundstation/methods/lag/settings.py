"""Settings of the latency estimator. Every limit of the method stands here."""

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number

SLOW_MPS = 3.0  # the track of a slower aircraft does not show where the nose points


@dataclass(frozen=True)
class LatencySettings:
    """Limits of the latency estimator.

    A latency is observed where its 95 % interval is at most ``half_width_max_s`` either way, rests on as many effective
    windows as ``freedom_min`` says, and the reference explains ``explained_min`` of the other's variance.
    ``*_sigma`` are what may be wrong of the model, as prior sigmas: azimuth error of the reference, scale, antenna arm.
    """

    search_s: float = number(2.0, 0.1, 10.0)  # latencies looked at, either way; chosen
    # Step of the first search over latencies, before the fine fit; chosen.
    search_step_s: float = number(0.1, 0.01, 1.0)
    window_s: float = number(30.0, 5.0, 600.0)  # length of the windows that motion is compared in; chosen
    degree: int = number(2, 0, 5)  # degree of the polynomial in time that each window takes away; chosen
    windows_max: int = number(40, 2, 10_000)  # so many windows are used, those with the most motion; chosen
    # A reference that is logged faster is averaged over so long; chosen.
    reference_step_s: float = number(0.1, 0.0, 1.0)
    other_step_s: float = number(0.4, 0.0, 2.0)  # another sensor that is logged faster is averaged over so long; chosen
    # A reference with a longer interval does not show the motion; chosen.
    reference_interval_max_s: float = number(0.5, 0.01, 10.0)
    # Another sensor with a longer interval does not show the motion; chosen.
    other_interval_max_s: float = number(2.0, 0.01, 60.0)
    gap_max_s: float = number(0.6, 0.0, 10.0)  # the reference is interpolated over no longer gap; chosen
    # Share of samples with the time stamp of the one before, at most; chosen.
    repeated_share_max: float = number(0.2, 0.0, 1.0)
    robust_sigmas: float = number(3.0, 1.0, 100.0)  # residuals beyond so many sigmas count less in the fit; chosen
    # Least sigma of a latency: interpolation, and rounding of time stamps; chosen.
    sigma_floor_s: float = number(0.001, 0.0, 1.0)
    # A latency is observed where its 95 % interval is at most this either way; chosen.
    half_width_max_s: float = number(0.1, 0.0, 10.0)
    # A latency is observed where it rests on at least so many effective windows; chosen.
    freedom_min: float = number(1.5, 1.0, 1000.0)
    # Share of the other's variance that the reference explains at least, for a latency that is observed; chosen.
    explained_min: float = number(0.5, 0.0, 1.0)
    # Delay that the filter of a GNSS-aided INS may hide, as a sigma; chosen.
    aided_sigma_s: float = number(0.03, 0.0, 1.0)
    azimuth_sigma_deg: float = number(3.0, 0.0, 180.0)  # prior sigma of the azimuth error of the reference; chosen
    # Prior sigma of the scale between reference and other; three times it for barometric height; chosen.
    scale_sigma: float = number(0.03, 0.0, 1.0)
    # Prior sigma of the arm from the reference to the GNSS antenna, along each axis; chosen.
    arm_sigma_m: float = number(5.0, 0.0, 100.0)
    # Prior sigma of soft iron and mounting of a magnetometer, share of the field; chosen.
    iron_sigma: float = number(0.3, 0.0, 10.0)

    def __post_init__(self) -> None:
        check_ranges(self)
