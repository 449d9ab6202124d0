"""Settings of the deviation from ground runs. Every limit of the method stands here."""

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class MagneticGroundSettings:
    """Limits of the deviation of an installed heading sensor from straight ground runs.

    ``declination_deg`` with its sigma replaces the model's, for a log without date or place. The last six are what is
    taken for known before a log is looked at; a coefficient is given where the runs leave no more than
    ``known_share`` of it (A: of ``semicircular_sigma_deg``).
    """

    speed_min_mps: float = number(3.0, 0.5, 100.0)  # slower epochs are not used: their track is too rough; chosen
    speed_max_mps: float = number(80.0, 1.0, 300.0)  # faster epochs are not used; chosen
    turn_rate_max_dps: float = number(1.0, 0.01, 90.0)  # heading turns no faster on a straight run; chosen
    # Length of the window whose slope of heading is the rate of turn; chosen.
    turn_rate_window_s: float = number(4.0, 0.0, 60.0)
    # So much is left out after a turn: a heading that lags has caught up; chosen.
    settle_s: float = number(3.0, 0.0, 600.0)
    # Largest change of heading, and of track, along a run; chosen.
    heading_change_max_deg: float = number(10.0, 0.1, 360.0)
    run_min_s: float = number(5.0, 0.0, 3600.0)  # shortest straight run that is used; chosen
    samples_min: int = number(5, 2, 100_000)  # fewest GNSS epochs of a run that is used; chosen
    # Runs whose headings are so near each other repeat each other; chosen.
    repeat_within_deg: float = number(10.0, 0.1, 90.0)
    error_max_deg: float = number(5.0, 0.0, 180.0)  # a run whose error is surely larger is worth a warning; chosen
    posterior_draws: int = number(200, 100, 100_000)  # draws of the posterior of the error of each run; chosen
    # Declination in place of the model's, for a log without date or place; empty: the model's.
    declination_deg: float | None = number(None, -180.0, 180.0)
    declination_sigma_deg: float = number(0.5, 0.0, 180.0)  # sigma of the stated declination; chosen

    # Sigma of the GNSS velocity error that lasts for a run: its track is off by it over the speed; chosen.
    velocity_sigma_mps: float = number(0.03, 0.0, 10.0)
    # Sigma of nose against track on the wheels, in wind and on a camber; chosen.
    slip_sigma_deg: float = number(0.2, 0.0, 10.0)
    # Scale of the prior of the error that a run has of its own: iron in the ground, loads; chosen.
    place_sigma_deg: float = number(0.5, 0.001, 45.0)
    semicircular_sigma_deg: float = number(5.0, 0.01, 180.0)  # prior sigma of the coefficients B and C; chosen
    quadrantal_sigma_deg: float = number(1.0, 0.01, 180.0)  # prior sigma of the coefficients D and E; chosen
    # A coefficient is given where the runs leave at most this share of its prior sigma (A: of that of B and C); chosen.
    known_share: float = number(0.35, 0.01, 1.0)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.speed_min_mps > self.speed_max_mps:
            expected = f"at most speed_max_mps = {self.speed_max_mps:g}"
            raise SettingsError("speed_min_mps", f"{self.speed_min_mps:g}", expected)
