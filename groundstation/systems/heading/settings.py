"""Every limit of the heading correction a user may set.

Constants of the method stand beside their use.
"""

from dataclasses import dataclass, field
from typing import Literal

from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number
from groundstation.methods.taxi.settings import RateKind
from groundstation.results.chosen import Interval

Runs = Literal["auto", "before_take_off", "all_ground"]
UseLatency = Literal["when_observed", "never"]
LEAST_DRAWS = 100  # of a posterior of eleven parameters


@dataclass(frozen=True)
class HeadingSettings:
    """Thresholds and gates of the heading estimator.

    The defaults are the paper's where it gives a figure.

    Source: Markelov, Kostishin, Shukalov, Heading correction of an INS before take-off by satellite navigation, 2015.
    """

    # Throughout
    geometry_max: float = number(2.0, 0.0)  # geometric factor (paper)
    velocity_sigma_max_mps: float = number(
        0.1, 1e-6
    )  # stated by the receiver, where no factor is logged: the paper's noise
    geometry_share_min: float = number(0.9, 0.0, 1.0)  # of the epochs that would otherwise be used
    integrity_share_min: float = number(0.9, 0.0, 1.0)
    heading_gap_max_s: float = number(1.5, 0.0)  # INS heading is interpolated over no longer gap
    gnss_gap_max_s: float = number(0.5, 0.0)  # a longer one closes the segment; at least 2.5 usual intervals

    # Stage A: standstill
    standstill_speed_max_mps: float = number(0.2, 0.0)  # of the 1-s mean velocity (paper)
    standstill_mean_s: float = number(1.0, 0.0)
    standstill_rate_max_dps: float = number(0.2, 0.0)  # INS heading steady
    standstill_guard_s: float = number(2.0, 0.0)  # cut from both ends: the aircraft starts to move below the limit
    standstill_min_s: float = number(10.0, 0.0)  # paper: 10 to 30 s
    standstill_max_s: float = number(30.0, 0.0)
    # Stands on its wheels with the heading still, while GNSS shows up to this speed: a standstill that fails its gate.
    standstill_doubt_mps: float = number(1.0, 0.0)
    standstill_still_deg: float = number(0.1, 0.0)  # most that the heading then changes
    speed_of_mean_max_mps: float = number(0.01, 0.0)  # paper
    spectrum_max_s: float = number(300.0, 0.0)  # standstill used for the spectrum of the GNSS error

    # Stage B: taxi
    runs: Runs = "auto"  # ground runs used; auto: those before take-off, all of the flight's where those are too short
    taxi_speed_min_mps: float = number(6.0, 0.0)  # paper
    taxi_speed_max_mps: float = number(20.0, 0.0)  # faster is a take-off run or a landing roll
    lift_off_speed_mps: float = number(40.0, 0.0)  # bounds the taxi phase where nothing tells ground from air
    turn_rate_max_dps: float = number(1.0, 0.0)  # paper: |rate of INS heading|
    turn_rate_window_s: float = number(2.0, 0.0)
    turn_rate_kind: RateKind = "slope"
    segment_break_s: float = number(5.0, 0.0)  # unused stretch that ends a segment
    segment_turn_deg: float = number(20.0, 0.0)  # change of heading over an unused stretch that ends a segment
    outlier_sigmas: float = number(6.0, 0.0)  # against the running median of 5 s
    outlier_floor_deg: float = number(1.0, 0.0)
    outlier_share_max: float = number(0.02, 0.0, 1.0)

    # Acceptance
    taxi_min_s: float = number(20.0, 0.0)  # paper
    taxi_least_s: float = number(5.0, 0.0)  # less before take-off is not assessable: no verdict at all
    precision_max_deg: float = number(0.05, 0.0)  # paper: e
    quality_max_deg: float = number(0.3, 0.0)  # paper
    half_width_max_deg: float = number(0.2, 0.0)  # of what this taxi shows: 20 arcmin is then more than three sigma
    whole_half_width_max_deg: float = number(1.0 / 3.0, 0.0)  # taxi, wind and installation: 20 arcmin
    # Which of the three are required (docs/decisions/011): the last holds what the others measure.
    precision_decides: bool = False
    half_width_decides: bool = False
    whole_decides: bool = True
    skewness_max: float = number(0.5, 0.0)
    excess_kurtosis_range: tuple[float, float] = (-1.2, 2.0)
    normal_distance_max: float = number(0.08, 0.0)
    variance_ratio_range: tuple[float, float] = (0.5, 2.0)
    sway_line_s: float = number(5.0, 0.0)
    drift_sigmas_max: float = number(3.0, 0.0)
    disagreement_probability: float = number(0.01, 0.0, 1.0)  # that parts of a taxi disagree as much by chance
    part_max_s: float = number(60.0, 5.0)  # a longer segment is judged in parts
    step_min_deg: float = number(0.15, 0.0)  # of the INS heading between two samples, a turn allowed for

    # Lever arm and time offset
    use_latency: UseLatency = "when_observed"  # shift GNSS by its latency behind the INS, estimated from motion
    arm_speed_min_mps: float = number(3.0, 0.0)  # turns slower than this are not used to find the arm
    arm_rate_window_s: float = number(0.2, 0.0)
    arm_interval_max_s: float = number(0.5, 0.0)  # slower logs do not show the rate of a turn at the GNSS time
    arm_prior_m: float = number(3.0, 0.0)  # an arm that is neither known nor observable: 3 +- 3 m ahead
    arm_prior_sigma_m: float = number(3.0, 0.0)
    arm_observable_sigma_m: float = number(1.0, 0.0)
    offset_prior_sigma_s: float = number(0.1, 0.0)
    offset_prior_intervals: float = number(0.3, 0.0)  # of the GNSS interval, where that is more
    offset_observable_sigma_s: float = number(0.05, 0.0)

    # Steady sideslip and mounting, where the aircraft file does not state them
    sideslip_sigma_deg: float | None = number(None, 0.0)  # of a crosswind; None: by class of aircraft and wind
    ordinary_wind_mps: float = number(3.6, 0.0)  # rms of either component, where no wind is known
    wind_sigma_mps: float = number(1.5, 0.0)  # of either component, where it is known
    weather_max_min: float = number(60.0, 0.0)  # a METAR line is no nearer to the taxi than that: not used
    steady_sideslip_sigma_deg: float = number(0.05, 0.0)  # the same in every direction
    uneven_power_sigma_deg: float = number(0.3, 0.0)  # the same, where the aircraft file says that power is uneven
    mounting_sigma_deg: float = number(0.1, 0.0)  # of the platform's number alone

    # Honest interval
    posterior_draws: int = number(4000, LEAST_DRAWS)  # the half width then hardly hangs on the seed: docs/heading.md
    posterior_seed: int = number(2015, 0)
    growth_steps: int = number(120, 2)

    def __post_init__(self) -> None:
        check_ranges(self)
        for name in ("excess_kurtosis_range", "variance_ratio_range"):
            low, high = getattr(self, name)
            if low > high:
                raise SettingsError(name, f"{low:g} to {high:g}", "the low end first")
        for least, most in (("taxi_speed_min_mps", "taxi_speed_max_mps"), ("standstill_min_s", "standstill_max_s")):
            low, high = getattr(self, least), getattr(self, most)
            if low > high:
                raise SettingsError(least, f"{low:g}", f"at most {most} = {high:g}")


@dataclass(frozen=True)
class HeadingRequest:
    """Choices for one flight: topics and intervals.

    Empty ones are the first suitable pair, and all of the taxi.
    """

    ins_topic: str = ""
    gnss_topic: str = ""
    intervals: tuple[Interval, ...] = field(default=())
