"""Every limit of the heading correction a user may set.

Constants of the method stand beside their use.
"""

from dataclasses import field
from typing import Literal

from groundstation.base.dataclasses import dataclass
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

    # Largest dilution of precision (geometric factor) of a GNSS epoch that is used; paper.
    geometry_max: float = number(2.0, 0.0)
    # Largest velocity sigma stated by the receiver of an epoch that is used, where no dilution is logged; the paper's
    # noise.
    velocity_sigma_max_mps: float = number(0.1, 1e-6)
    # Share of the straight taxi with good satellite geometry at least, for a verdict; chosen.
    geometry_share_min: float = number(0.9, 0.0, 1.0)
    # Share of the straight taxi with GNSS integrity good at least, where it is logged; chosen.
    integrity_share_min: float = number(0.9, 0.0, 1.0)
    heading_gap_max_s: float = number(1.5, 0.0)  # INS heading is interpolated over no longer gap; chosen
    # A longer GNSS gap closes the segment; at least 2.5 usual intervals; chosen.
    gnss_gap_max_s: float = number(0.5, 0.0)

    # Stage A: standstill

    # The aircraft stands while its mean GNSS velocity (over standstill_mean_s) is at most this; paper.
    standstill_speed_max_mps: float = number(0.2, 0.0)
    # Time over which GNSS velocity is averaged before it is compared with the limit of a standstill; paper.
    standstill_mean_s: float = number(1.0, 0.0)
    standstill_rate_max_dps: float = number(0.2, 0.0)  # INS heading turns no faster at a standstill; chosen
    # Cut from both ends of a standstill: the aircraft starts to move below the limit of speed; chosen.
    standstill_guard_s: float = number(2.0, 0.0)
    standstill_min_s: float = number(10.0, 0.0)  # shortest standstill that is assessed; paper: 10 to 30 s
    # So much of the end of a longer standstill is assessed; paper: 10 to 30 s.
    standstill_max_s: float = number(30.0, 0.0)
    # Stands on its wheels with the heading still, while GNSS shows up to this speed: a standstill that fails its gate;
    # chosen.
    standstill_doubt_mps: float = number(1.0, 0.0)
    # Most that the INS heading changes at a standstill while GNSS shows motion (standstill_doubt_mps); chosen.
    standstill_still_deg: float = number(0.1, 0.0)
    # Length of the mean GNSS velocity of the standstill at most, for a verdict; paper.
    speed_of_mean_max_mps: float = number(0.01, 0.0)
    # Most standstill used for the spectrum of the GNSS velocity error; chosen.
    spectrum_max_s: float = number(300.0, 0.0)

    # Stage B: taxi
    runs: Runs = "auto"  # ground runs used; auto: those before take-off, all of the flight's where those are too short
    taxi_speed_min_mps: float = number(6.0, 0.0)  # slower epochs are no taxi: their track is too rough; paper
    taxi_speed_max_mps: float = number(20.0, 0.0)  # faster epochs are a take-off run or a landing roll; chosen
    # Speed that ends the taxi phase where nothing tells ground from air; chosen.
    lift_off_speed_mps: float = number(40.0, 0.0)
    turn_rate_max_dps: float = number(1.0, 0.0)  # INS heading turns no faster on a straight epoch; paper
    # Length of the window whose slope of INS heading is the rate of turn; chosen.
    turn_rate_window_s: float = number(2.0, 0.0)
    # How the rate of turn is made: slope of a line over turn_rate_window_s, or raw, without a window.
    turn_rate_kind: RateKind = "slope"
    segment_break_s: float = number(5.0, 0.0)  # unused stretch that ends a straight segment; chosen
    # Change of heading over an unused stretch that ends a straight segment; chosen.
    segment_turn_deg: float = number(20.0, 0.0)
    # A heading difference farther from the running median of 5 s is an outlier, in robust sigmas; chosen.
    outlier_sigmas: float = number(6.0, 0.0)
    # A heading difference nearer than this to the running median never is an outlier; chosen.
    outlier_floor_deg: float = number(1.0, 0.0)
    # Share of outliers among straight samples at most, for a verdict; chosen.
    outlier_share_max: float = number(0.02, 0.0, 1.0)

    # Acceptance
    taxi_min_s: float = number(20.0, 0.0)  # straight taxi needed for a verdict; paper
    # Less straight taxi is not assessable: no estimate and no verdict at all; chosen.
    taxi_least_s: float = number(5.0, 0.0)
    # Precision e of the mean at most, at 10 Hz; grows with the root of a longer GNSS interval; required by
    # precision_decides alone; paper.
    precision_max_deg: float = number(0.05, 0.0)
    quality_max_deg: float = number(0.3, 0.0)  # spread of the running mean at most, for a verdict; paper
    # Half width of the 95 % interval from this taxi alone at most: 20 arcmin is then more than three sigma; chosen.
    half_width_max_deg: float = number(0.2, 0.0)
    # Half width of the 95 % interval from taxi, wind and installation at most: 20 arcmin, the largest error published.
    whole_half_width_max_deg: float = number(1.0 / 3.0, 0.0)
    precision_decides: bool = False  # whether precision_max_deg is required for a verdict (docs/decisions/011)
    half_width_decides: bool = False  # whether half_width_max_deg is required for a verdict (docs/decisions/011)
    # Whether whole_half_width_max_deg is required for a verdict; it holds what the other two measure
    # (docs/decisions/011).
    whole_decides: bool = True
    # Absolute skewness of the heading differences at most, for 400 samples; fewer may have more; chosen.
    skewness_max: float = number(0.5, 0.0)
    # Excess kurtosis of the heading differences within, for 400 samples; wider for fewer; chosen.
    excess_kurtosis_range: tuple[float, float] = (-1.2, 2.0)
    # Distance of the heading differences to the fitted normal distribution (Kolmogorov) at most, for 400 samples;
    # chosen.
    normal_distance_max: float = number(0.08, 0.0)
    # Variance of the heading differences over what track noise and sway explain, within; chosen.
    variance_ratio_range: tuple[float, float] = (0.5, 2.0)
    # Time of the running line of the INS heading about which its sway is measured; chosen.
    sway_line_s: float = number(5.0, 0.0)
    # Azimuth drift during the taxi over its standard deviation at most, for a verdict; chosen.
    drift_sigmas_max: float = number(3.0, 0.0)
    # Parts of a taxi disagree where chance alone makes as much with a smaller probability; chosen.
    disagreement_probability: float = number(0.01, 0.0, 1.0)
    part_max_s: float = number(60.0, 5.0)  # a longer straight segment is judged in parts of about this length; chosen
    # Smallest step of the INS heading between two samples that counts, a turn allowed for; chosen.
    step_min_deg: float = number(0.15, 0.0)

    # Lever arm and time offset

    # when_observed: GNSS is shifted by its latency behind the INS, estimated from motion; never: it is not.
    use_latency: UseLatency = "when_observed"
    # Turns slower than this are not used to find the lever arm of the antenna; chosen.
    arm_speed_min_mps: float = number(3.0, 0.0)
    # Time over which the rate of the INS heading is taken in turns, for the lever arm; chosen.
    arm_rate_window_s: float = number(0.2, 0.0)
    # Logs with a longer GNSS interval do not show the rate of a turn at the GNSS time: no arm is estimated; chosen.
    arm_interval_max_s: float = number(0.5, 0.0)
    # Lever arm ahead that is assumed where it is neither known nor observable: 3 +- 3 m; chosen.
    arm_prior_m: float = number(3.0, 0.0)
    arm_prior_sigma_m: float = number(3.0, 0.0)  # sigma of the lever arm that is assumed; chosen
    # A lever arm known to this sigma or better counts as observed and is taken out; chosen.
    arm_observable_sigma_m: float = number(1.0, 0.0)
    # Sigma of the time offset between GNSS and INS, before anything is known; chosen.
    offset_prior_sigma_s: float = number(0.1, 0.0)
    # Sigma of the time offset in GNSS intervals, where that is more: a slow receiver is later; chosen.
    offset_prior_intervals: float = number(0.3, 0.0)
    # A time offset known to this sigma or better counts as observed; chosen.
    offset_observable_sigma_s: float = number(0.05, 0.0)

    # Steady sideslip and mounting, where the aircraft file does not state them

    # Sigma of the sideslip on taxi by a crosswind of 10 m/s, or by an unknown wind; empty: by class of aircraft and
    # wind.
    sideslip_sigma_deg: float | None = number(None, 0.0)
    ordinary_wind_mps: float = number(3.6, 0.0)  # RMS of either component of the wind where none is known; chosen
    wind_sigma_mps: float = number(1.5, 0.0)  # sigma of either component of a wind that log or METAR tells; chosen
    weather_max_min: float = number(60.0, 0.0)  # a METAR line farther in time from the taxi is not used; chosen
    # Sigma of the sideslip that is the same in every direction (docs/decisions/011).
    steady_sideslip_sigma_deg: float = number(0.05, 0.0)
    # Sigma of the sideslip that is the same in every direction, where the aircraft file says that power is uneven
    # (docs/decisions/011).
    uneven_power_sigma_deg: float = number(0.3, 0.0)
    # Sigma of the mounting of the INS case; it widens the interval of the platform's number alone; chosen.
    mounting_sigma_deg: float = number(0.1, 0.0)

    # Honest interval

    # Draws of the posterior: the half width then hardly hangs on the seed (docs/heading.md).
    posterior_draws: int = number(4000, LEAST_DRAWS)
    posterior_seed: int = number(2015, 0)  # seed of the random draws: the same log gives the same answer
    growth_steps: int = number(120, 2)  # steps of the plot of the histogram as it grows with the taxi

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
