"""Settings of the deviation of a flux valve in flight: every limit of the method."""

from dataclasses import dataclass

from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number

FLUX_LIMITS = frozenset(  # settings that bound a gate and choose no data
    {"gap_max_deg", "curve_sigma_max_deg", "a_sigma_max_deg", "left_rms_max_deg", "dip_max_deg"}
)


@dataclass(frozen=True)
class MagneticFluxSettings:
    """Limits of the deviation of a compass that gives heading alone, in flight.

    ``declination_deg`` with its sigma replaces the model's, for a log without date or place.
    """

    # Legs.
    speed_min_mps: float = number(20.0, 1.0, 300.0)
    leg_bank_max_deg: float = number(5.0, 0.1, 30.0)
    leg_rate_max_dps: float = number(0.5, 0.01, 10.0)
    rate_window_s: float = number(10.0, 1.0, 60.0)
    acceleration_max_mps2: float = number(0.1, 0.001, 10.0)  # a hung valve leans by it
    acceleration_window_s: float = number(20.0, 1.0, 120.0)
    settle_s: float = number(30.0, 0.0, 1200.0)  # left out after a turn, more where the gyro is seen to be slaved
    settle_max_s: float = number(180.0, 0.0, 3600.0)
    leg_min_s: float = number(20.0, 1.0, 3600.0)
    leg_max_s: float = number(120.0, 10.0, 3600.0)  # longer ones are cut
    leg_change_max_deg: float = number(10.0, 0.1, 90.0)
    repeat_within_deg: float = number(15.0, 0.1, 90.0)  # legs so near in heading are of one direction

    # Known beforehand.
    declination_deg: float | None = number(None, -180.0, 180.0)
    declination_sigma_deg: float = number(0.5, 0.0, 180.0)
    sideslip_sigma_deg: float = number(0.3, 0.0, 10.0)  # all through, where the wind is solved: goes into A
    leg_slip_sigma_deg: float = number(0.2, 0.0, 10.0)  # of a leg, where the wind is solved
    wind_sigma_mps: float = number(15.0, 0.1, 100.0)
    wind_time_s: float = number(1800.0, 10.0, 100_000.0)  # over which the slow part of the wind changes
    wind_height_m: float = number(600.0, 1.0, 100_000.0)
    airspeed_scale_sigma: float = number(0.05, 0.0, 0.5)
    place_sigma_deg: float = number(0.5, 0.001, 45.0)  # loads, trim: scale of what a leg has of its own
    semicircular_sigma_deg: float = number(5.0, 0.01, 180.0)  # B and C
    quadrantal_sigma_deg: float = number(1.0, 0.01, 180.0)  # D and E
    known_share: float = number(0.35, 0.01, 1.0)

    # Bank error and opposite turns.
    turn_bank_min_deg: float = number(3.0, 1.0, 80.0)
    fit_bank_max_deg: float = number(35.0, 2.0, 60.0)
    turn_samples_min: int = number(20, 5, 100_000)
    may_be_slaved: bool = True  # false: the reading is stated to be the valve's own, not that of a gyro it corrects
    use_error_max_deg: float = number(2.0, 0.1, 45.0)  # of the heading in use: bounds bank and time after a turn
    turns_bias_max_deg: float = number(0.3, 0.0, 45.0)  # that bank and lag leave in the mean of opposite turns

    # Gates.
    gap_max_deg: float = number(100.0, 1.0, 360.0)  # widest part of the circle without a leg
    curve_sigma_max_deg: float = number(1.0, 0.0, 180.0)  # without A, RMS over the circle
    a_sigma_max_deg: float = number(1.5, 0.0, 180.0)
    left_rms_max_deg: float = number(1.5, 0.0, 180.0)  # on legs that the fit had not
    dip_max_deg: float = number(80.0, 0.0, 90.0)
    card_step_deg: int = number(30, 1, 180)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.leg_min_s > self.leg_max_s:
            raise SettingsError("leg_min_s", f"{self.leg_min_s:g}", f"at most leg_max_s = {self.leg_max_s:g}")
