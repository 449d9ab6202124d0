"""Settings of the magnetic estimator. Every limit of the method stands here."""

from dataclasses import dataclass

from groundstation.base.toml_settings import check_ranges, number

LIMITS = frozenset(  # settings that bound a gate and choose no data: a change of them needs no log
    {
        *("alignment_sigma_max_deg", "heading_sigmas_max", "held_out_rms_max_deg", "dip_sigmas_max"),
        *("altitude_min_m", "repeat_rms_max_deg"),
    }
)


@dataclass(frozen=True)
class MagneticSettings:
    """Limits of the magnetic estimator, each with what it bounds."""

    # Readings.
    rate_max_hz: float = number(10.0, 0.5, 1000.0)  # faster magnetometers are thinned
    gap_max_s: float = number(0.5, 0.0, 10.0)  # attitude is interpolated over no longer gap

    # Alignment of the INS heading: taxi, by the heading analysis; where that cannot, the run to lift-off.
    alignment_sigma_deg: float = number(1.0, 0.0, 180.0)  # of a heading that nothing aligned: stored or magnetic
    take_off_sideslip_deg: float = number(0.3, 0.0, 180.0)  # sigma of a run under power: one recorded run, by so much
    mounting_sigma_deg: float = number(0.1, 0.0, 180.0)  # of the INS case, where the aircraft file states none
    drift_sigma_deg_per_h: float = number(0.1, 0.0, 1000.0)  # of the INS heading, as known beforehand
    track_error_max_deg: float = number(0.3, 0.001, 45.0)  # that a velocity error makes: bounds the speed; patent
    gnss_velocity_error_mps: float = number(0.15, 0.001, 100.0)  # or what the receiver states, if larger; patent
    uses_slower_taxi: bool = True  # False: the run to lift-off comes before taxi
    lift_off_margin_s: float = number(3.0, 0.0, 60.0)  # left out before lift-off: the nose is raised
    ground_run_min_s: float = number(5.0, 0.0, 1000.0)  # of a run that aligns
    alignment_event: str = ""  # the alignment looks from this event on; empty: not used
    release_event: str = ""  # and until this one; empty: not used

    # Known beforehand.
    declination_deg: float | None = number(None, -180.0, 180.0)  # in place of the model's: a log without date or place
    declination_sigma_deg: float = number(0.5, 0.0, 180.0)  # of the stated one
    attitude_wander_deg: float = number(0.04, 0.0, 10.0)  # of roll and pitch over minutes; level flight tells more
    # Of the heading of a best trajectory in place of that of the INS; None: where it is surer than the INS; 0: never.
    states_sigma_max_deg: float | None = number(None, 0.0, 180.0)
    trusts_aided_heading: bool = False  # True: an INS that GNSS corrects does not take its heading from a magnetometer

    # Turns and figures.
    bank_min_deg: float = number(8.0, 1.0, 80.0)  # of a turn
    bank_max_deg: float = number(50.0, 2.0, 85.0)
    bank_band_deg: float = number(4.0, 0.1, 45.0)  # about the median bank: beyond it the turn begins or ends
    bank_sd_max_deg: float = number(2.0, 0.01, 45.0)  # standard deviation in a turn
    bank_difference_max_deg: float = number(3.0, 0.01, 45.0)  # of opposite banks
    turned_min_deg: float = number(60.0, 1.0, 360.0)  # in one turn
    turn_samples_min: int = number(40, 2, 1_000_000)
    altitude_min_m: float = number(1000.0, -1000.0, 20_000.0)  # of a turn
    altitude_range_max_m: float = number(100.0, 0.1, 10_000.0)  # in a turn
    pair_gap_max_s: float = number(900.0, 1.0, 100_000.0)  # between opposite turns
    bin_gap_max_deg: float = number(5.0, 1.0, 90.0)  # a wider gap of a branch is not covered
    coverage_usable: float = number(0.75, 0.1, 1.0)  # share of the circle below which there is no figure
    coverage_min: float = number(0.98, 0.1, 1.0)  # share of the circle that the gate wants

    # Fits of the iron.
    robust_sigmas: float = number(3.0, 1.0, 100.0)  # beyond them a reading counts less
    current_spread_min_a: float = number(1.0, 0.0, 1e6)  # below it no effect of the current is fitted
    attitude_condition_max: float = number(200.0, 1.0, 1e12)  # condition number of the fit with the attitude
    modulus_condition_max: float = number(100.0, 1.0, 1e12)  # of the fit of the modulus
    modulus_sigma_max_deg: float = number(2.0, 0.0, 180.0)  # of the heading error by the modulus
    iterations_max: int = number(50, 1, 10_000)

    # Level flight that judges, and gates.
    held_out_bank_max_deg: float = number(10.0, 0.1, 90.0)  # level flight is judged
    held_out_margin_s: float = number(2.0, 0.0, 1000.0)  # about a figure, left out
    held_out_samples_min: int = number(50, 2, 1_000_000)
    held_out_rms_max_deg: float = number(1.0, 0.0, 180.0)  # after the correction
    alignment_sigma_max_deg: float = number(0.5, 0.0, 180.0)  # of the INS heading at the figure
    heading_sigmas_max: float = number(3.0, 0.0, 1000.0)  # of the alignment against the heading analysis
    bank_bias_max_deg: float = number(0.3, 0.0, 180.0)  # RMS, forecast for the average of branches
    dip_sigmas_max: float = number(3.0, 0.0, 1000.0)  # of the dip of the readings against the model's
    repeat_rms_max_deg: float = number(0.5, 0.0, 180.0)  # of repeated figures
    card_step_deg: int = number(30, 1, 180)  # of the steer card

    def __post_init__(self) -> None:
        check_ranges(self)
