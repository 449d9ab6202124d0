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
    """Limits of the magnetic estimator.

    ``alignment_sigma_deg`` is that of an INS heading that nothing aligned, ``drift_sigma_deg_per_h`` what is known
    of its drift beforehand. System 1's answer from taxi aligns it; where that cannot, the run to lift-off does, at
    speeds at which ``gnss_velocity_error_mps`` (or what the receiver states, where that is larger) turns the track by
    no more than ``track_error_max_deg``. Without ``uses_slower_taxi`` that run comes first; the sigma of a sideslip
    under power, ``take_off_sideslip_deg``, is added to it. ``alignment_event`` and ``release_event`` name events
    between which the alignment looks; empty: not used. ``declination_deg`` with its sigma replaces the model's, for a
    log without date or place. ``attitude_wander_deg`` is how far roll and pitch of the INS wander over minutes, as
    known beforehand: level flight beside the figure tells more. ``trusts_aided_heading`` states that an INS corrected
    by GNSS does not take its heading from a magnetometer.
    """

    rate_max_hz: float = number(10.0, 0.5, 1000.0)  # faster magnetometers are thinned
    gap_max_s: float = number(0.5, 0.0, 10.0)  # attitude is interpolated over no longer gap
    alignment_sigma_deg: float = number(1.0, 0.0, 180.0)  # a stored heading or a magnetic sensor: the INS of this use
    take_off_sideslip_deg: float = number(0.3, 0.0, 180.0)  # power crabs the aircraft: one recorded run, by so much
    mounting_sigma_deg: float = number(0.1, 0.0, 180.0)  # of the INS case, where the aircraft file states none
    drift_sigma_deg_per_h: float = number(0.1, 0.0, 1000.0)
    track_error_max_deg: float = number(0.3, 0.001, 45.0)  # patent
    gnss_velocity_error_mps: float = number(0.15, 0.001, 100.0)  # patent
    uses_slower_taxi: bool = True
    lift_off_margin_s: float = number(3.0, 0.0, 60.0)  # the nose is raised
    ground_run_min_s: float = number(5.0, 0.0, 1000.0)
    alignment_event: str = ""
    release_event: str = ""
    declination_deg: float | None = number(None, -180.0, 180.0)
    declination_sigma_deg: float = number(0.5, 0.0, 180.0)
    attitude_wander_deg: float = number(0.04, 0.0, 10.0)
    trusts_aided_heading: bool = False

    bank_min_deg: float = number(8.0, 1.0, 80.0)
    bank_max_deg: float = number(50.0, 2.0, 85.0)
    bank_band_deg: float = number(4.0, 0.1, 45.0)  # about the median bank: beyond it the turn begins or ends
    bank_sd_max_deg: float = number(2.0, 0.01, 45.0)
    bank_difference_max_deg: float = number(3.0, 0.01, 45.0)
    turned_min_deg: float = number(60.0, 1.0, 360.0)
    turn_samples_min: int = number(40, 2, 1_000_000)
    altitude_min_m: float = number(1000.0, -1000.0, 20_000.0)
    altitude_range_max_m: float = number(100.0, 0.1, 10_000.0)
    pair_gap_max_s: float = number(900.0, 1.0, 100_000.0)
    bin_gap_max_deg: float = number(5.0, 1.0, 90.0)  # a wider gap of a branch is not covered
    coverage_usable: float = number(0.75, 0.1, 1.0)
    coverage_min: float = number(0.98, 0.1, 1.0)

    robust_sigmas: float = number(3.0, 1.0, 100.0)
    current_spread_min_a: float = number(1.0, 0.0, 1e6)
    attitude_condition_max: float = number(200.0, 1.0, 1e12)
    modulus_condition_max: float = number(100.0, 1.0, 1e12)
    modulus_sigma_max_deg: float = number(2.0, 0.0, 180.0)
    iterations_max: int = number(50, 1, 10_000)

    held_out_bank_max_deg: float = number(10.0, 0.1, 90.0)  # level flight is judged
    held_out_margin_s: float = number(2.0, 0.0, 1000.0)
    held_out_samples_min: int = number(50, 2, 1_000_000)
    held_out_rms_max_deg: float = number(1.0, 0.0, 180.0)
    alignment_sigma_max_deg: float = number(0.5, 0.0, 180.0)
    heading_sigmas_max: float = number(3.0, 0.0, 1000.0)
    bank_bias_max_deg: float = number(0.3, 0.0, 180.0)
    dip_sigmas_max: float = number(3.0, 0.0, 1000.0)
    repeat_rms_max_deg: float = number(0.5, 0.0, 180.0)
    card_step_deg: int = number(30, 1, 180)

    def __post_init__(self) -> None:
        check_ranges(self)
