"""Settings of the deviation of a flux valve in flight: every limit of the method."""

from groundstation.base.dataclasses import dataclass
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
    speed_min_mps: float = number(20.0, 1.0, 300.0)  # slower is not taken as flight; chosen
    leg_bank_max_deg: float = number(5.0, 0.1, 30.0)  # largest bank of a straight leg; chosen
    leg_rate_max_dps: float = number(0.5, 0.01, 10.0)  # largest rate of turn of a straight leg; chosen
    # Length of the window whose slope of heading is the rate of turn; chosen.
    rate_window_s: float = number(10.0, 1.0, 60.0)
    # Largest change of speed of a straight leg: a hung valve leans by it; chosen.
    acceleration_max_mps2: float = number(0.1, 0.001, 10.0)
    # Length of the window whose slope of speed is the acceleration; chosen.
    acceleration_window_s: float = number(20.0, 1.0, 120.0)
    settle_s: float = number(30.0, 0.0, 1200.0)  # so much is left out after a turn; chosen
    leg_min_s: float = number(20.0, 1.0, 3600.0)  # shortest straight leg that is used; chosen
    leg_max_s: float = number(120.0, 10.0, 3600.0)  # longer legs are cut into parts; chosen
    leg_change_max_deg: float = number(10.0, 0.1, 90.0)  # largest range of heading along a straight leg; chosen
    # Legs whose headings are so near each other are of one direction; chosen.
    repeat_within_deg: float = number(15.0, 0.1, 90.0)

    # Known beforehand.

    # Declination in place of the model's, for a log without date or place; empty: the model's.
    declination_deg: float | None = number(None, -180.0, 180.0)
    declination_sigma_deg: float = number(0.5, 0.0, 180.0)  # sigma of the stated declination; chosen
    # Sigma of a sideslip that lasts for the flight, where the wind is solved: goes into A; chosen.
    sideslip_sigma_deg: float = number(0.3, 0.0, 10.0)
    # Sigma of the sideslip that a leg has of its own, where the wind is solved; chosen.
    leg_slip_sigma_deg: float = number(0.2, 0.0, 10.0)
    # Prior sigma of either component of the mean wind, where it is solved; chosen.
    wind_sigma_mps: float = number(15.0, 0.1, 100.0)
    wind_time_s: float = number(1800.0, 10.0, 100_000.0)  # time over which the slow part of the wind changes; chosen
    wind_height_m: float = number(600.0, 1.0, 100_000.0)  # height over which the slow part of the wind changes; chosen
    # Prior sigma of the scale of the logged airspeed, where the wind is solved; chosen.
    airspeed_scale_sigma: float = number(0.05, 0.0, 0.5)
    # Scale of the prior of the error that a leg has of its own: loads, trim; chosen.
    place_sigma_deg: float = number(0.5, 0.001, 45.0)
    semicircular_sigma_deg: float = number(5.0, 0.01, 180.0)  # prior sigma of the coefficients B and C; chosen
    quadrantal_sigma_deg: float = number(1.0, 0.01, 180.0)  # prior sigma of the coefficients D and E; chosen
    # A coefficient is given where the legs leave at most this share of its prior sigma (A: of that of B and C); chosen.
    known_share: float = number(0.35, 0.01, 1.0)

    # Bank error and opposite turns.
    turn_bank_min_deg: float = number(3.0, 1.0, 80.0)  # least bank of a turn that shows the bank error; chosen
    fit_bank_max_deg: float = number(35.0, 2.0, 60.0)  # largest bank that the fit of the bank error uses; chosen
    turn_samples_min: int = number(20, 5, 100_000)  # fewest samples in turns for a fit of the bank error; chosen
    # false: the reading is stated to be the valve's own, not that of a gyro it corrects: no turns are required.
    may_be_slaved: bool = True
    # Largest error of a heading in use: bounds the bank, and the time after a turn, that are told for use; chosen.
    use_error_max_deg: float = number(2.0, 0.1, 45.0)
    # RMS that bank and lag leave in the mean of opposite turns at most, else these turns are not used; chosen.
    turns_bias_max_deg: float = number(0.3, 0.0, 45.0)

    # Gates.

    # Widest part of the circle without a leg or a turn at most, for accept; chosen.
    gap_max_deg: float = number(100.0, 1.0, 360.0)
    # Sigma of the deviation curve without A at most, RMS over the circle, for accept; chosen.
    curve_sigma_max_deg: float = number(1.0, 0.0, 180.0)
    # Sigma of A at most, for accept; declination and reference are in it; chosen.
    a_sigma_max_deg: float = number(1.5, 0.0, 180.0)
    # RMS error left on legs that the fit did not have at most, for accept; chosen.
    left_rms_max_deg: float = number(1.5, 0.0, 180.0)
    dip_max_deg: float = number(80.0, 0.0, 90.0)  # dip of the earth's field at most, up or down, for accept; chosen
    card_step_deg: int = number(30, 1, 180)  # step of the headings on the deviation card; chosen

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.leg_min_s > self.leg_max_s:
            raise SettingsError("leg_min_s", f"{self.leg_min_s:g}", f"at most leg_max_s = {self.leg_max_s:g}")
