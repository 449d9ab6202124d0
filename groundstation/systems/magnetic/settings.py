"""Settings of the magnetic estimator. Every limit of the method stands here."""

from groundstation.base.dataclasses import dataclass
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
    rate_max_hz: float = number(10.0, 0.5, 1000.0)  # faster magnetometers are thinned to this rate; chosen
    # Roll, pitch and heading of the INS are interpolated over no longer gap; chosen.
    gap_max_s: float = number(0.5, 0.0, 10.0)

    # Alignment of the INS heading: taxi, by the heading analysis; where that cannot, the run to lift-off.

    # Sigma of an INS heading that nothing aligned, stored or magnetic (docs/magnetic.md); chosen.
    alignment_sigma_deg: float = number(1.0, 0.0, 180.0)
    # Sigma that a run under power adds to its heading error: one recorded run was off by so much.
    take_off_sideslip_deg: float = number(0.3, 0.0, 180.0)
    # Sigma of the mounting of the INS case, where the aircraft file states none; chosen.
    mounting_sigma_deg: float = number(0.1, 0.0, 180.0)
    # Prior sigma of the drift of the INS heading, around zero; chosen.
    drift_sigma_deg_per_h: float = number(0.1, 0.0, 1000.0)
    # Largest error of the track that a velocity error may make: bounds the speed of the run to lift-off; patent.
    track_error_max_deg: float = number(0.3, 0.001, 45.0)
    # Velocity error of GNSS in the run to lift-off, or what the receiver states if it is larger; patent.
    gnss_velocity_error_mps: float = number(0.15, 0.001, 100.0)
    # true: taxi aligns the INS heading before the run to lift-off does; false: that run first, as in the patent.
    uses_slower_taxi: bool = True
    # So much of the run is left out before lift-off: the nose is raised; chosen.
    lift_off_margin_s: float = number(3.0, 0.0, 60.0)
    ground_run_min_s: float = number(5.0, 0.0, 1000.0)  # shortest straight run to lift-off that aligns; chosen
    alignment_event: str = ""  # name of an event of the log from which on data align; empty: not used
    release_event: str = ""  # name of an event of the log up to which data align; empty: not used

    # Known beforehand.

    # Declination in place of the model's, for a log without date or place; empty: the model's.
    declination_deg: float | None = number(None, -180.0, 180.0)
    declination_sigma_deg: float = number(0.5, 0.0, 180.0)  # sigma of the stated declination; chosen
    # Error of roll and pitch of the INS over minutes, as a sigma; level flight may tell more; chosen.
    attitude_wander_deg: float = number(0.04, 0.0, 10.0)
    # Of the heading of a best trajectory in place of that of the INS; None: where it is surer than the INS; 0: never.

    # Largest sigma of the heading of a best trajectory that replaces that of the INS; empty: where it is surer than the
    # INS; 0: never.
    states_sigma_max_deg: float | None = number(None, 0.0, 180.0)
    # true: the heading of an INS that GNSS corrects is taken to be free of any magnetometer.
    trusts_aided_heading: bool = False

    # Turns and figures.
    bank_min_deg: float = number(8.0, 1.0, 80.0)  # least bank of a turn; chosen
    bank_max_deg: float = number(50.0, 2.0, 85.0)  # largest bank of a turn that is used; chosen
    # A turn begins and ends where the bank leaves this band about its median; chosen.
    bank_band_deg: float = number(4.0, 0.1, 45.0)
    bank_sd_max_deg: float = number(2.0, 0.01, 45.0)  # standard deviation of the bank in a turn at most; chosen
    bank_difference_max_deg: float = number(3.0, 0.01, 45.0)  # banks of opposite turns differ by this at most; chosen
    turned_min_deg: float = number(60.0, 1.0, 360.0)  # least change of heading of a turn that is used; chosen
    turn_samples_min: int = number(40, 2, 1_000_000)  # fewest readings of a turn that is used; chosen
    # Mean altitude of a turn at least; the gate only informs; chosen.
    altitude_min_m: float = number(1000.0, -1000.0, 20_000.0)
    altitude_range_max_m: float = number(100.0, 0.1, 10_000.0)  # range of altitude in a turn at most; chosen
    # Longest time between turns that are taken as opposite; chosen.
    pair_gap_max_s: float = number(900.0, 1.0, 100_000.0)
    # A wider gap of headings in turns of one sense is not covered; chosen.
    bin_gap_max_deg: float = number(5.0, 1.0, 90.0)
    # Share of the circle of headings covered both ways, below which there is no figure; chosen.
    coverage_usable: float = number(0.75, 0.1, 1.0)
    # Share of the circle of headings covered both ways at least, for accept; chosen.
    coverage_min: float = number(0.98, 0.1, 1.0)

    # Fits of the iron.

    # Readings farther than so many sigmas from the fitted iron count less; chosen.
    robust_sigmas: float = number(3.0, 1.0, 100.0)
    # Least standard deviation of a logged current whose effect on the field is fitted; chosen.
    current_spread_min_a: float = number(1.0, 0.0, 1e6)
    # Condition number of the fit of the iron with the attitude at most; chosen.
    attitude_condition_max: float = number(200.0, 1.0, 1e12)
    # Condition number of the fit of the iron by the length of the field at most; chosen.
    modulus_condition_max: float = number(100.0, 1.0, 1e12)
    # Sigma of the heading error by the length of the field at most, RMS; chosen.
    modulus_sigma_max_deg: float = number(2.0, 0.0, 180.0)
    iterations_max: int = number(50, 1, 10_000)  # most rounds of the fit by the length of the field; chosen

    # Level flight that judges, and gates.

    # Largest bank of the level flight beside the figure, which judges the correction; chosen.
    held_out_bank_max_deg: float = number(10.0, 0.1, 90.0)
    # So much beside a figure is left out of the level flight that judges; chosen.
    held_out_margin_s: float = number(2.0, 0.0, 1000.0)
    held_out_samples_min: int = number(50, 2, 1_000_000)  # fewest readings of level flight that judge; chosen
    # RMS error after the correction on the level flight that judges at most, for accept; chosen.
    held_out_rms_max_deg: float = number(1.0, 0.0, 180.0)
    # Sigma of the INS heading at the figure at most, for accept; chosen.
    alignment_sigma_max_deg: float = number(0.5, 0.0, 180.0)
    # Alignment against the heading analysis of the same log at most, in sigmas, for accept; chosen.
    heading_sigmas_max: float = number(3.0, 0.0, 1000.0)
    # RMS bank bias of the average of branches at most, as the fitted iron forecasts it; chosen.
    bank_bias_max_deg: float = number(0.3, 0.0, 180.0)
    # Dip of the readings against the model's at most, in sigmas, for accept; chosen.
    dip_sigmas_max: float = number(3.0, 0.0, 1000.0)
    # RMS difference of repeated figures at most, for accept; chosen.
    repeat_rms_max_deg: float = number(0.5, 0.0, 180.0)
    card_step_deg: int = number(30, 1, 180)  # step of the headings on the steer card; chosen

    def __post_init__(self) -> None:
        check_ranges(self)
