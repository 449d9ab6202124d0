"""Settings of the deviation from ground runs. Every limit of the method stands here."""

from dataclasses import dataclass

from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number


@dataclass(frozen=True)
class MagneticGroundSettings:
    """Limits of the deviation of an installed heading sensor from straight ground runs.

    ``declination_deg`` with its sigma replaces the model's, for a log without date or place. The last six are what is
    taken for known before a log is looked at; a coefficient is given where the runs leave no more than
    ``known_share`` of it (A: of ``semicircular_sigma_deg``).
    """

    speed_min_mps: float = number(3.0, 0.5, 100.0)  # the track of a slower aircraft is too rough
    speed_max_mps: float = number(80.0, 1.0, 300.0)
    turn_rate_max_dps: float = number(1.0, 0.01, 90.0)
    turn_rate_window_s: float = number(4.0, 0.0, 60.0)
    settle_s: float = number(3.0, 0.0, 600.0)  # left out after a turn: a heading that lags has caught up
    heading_change_max_deg: float = number(10.0, 0.1, 360.0)  # along a run
    run_min_s: float = number(5.0, 0.0, 3600.0)
    samples_min: int = number(5, 2, 100_000)
    repeat_within_deg: float = number(10.0, 0.1, 90.0)  # runs so near in heading repeat each other
    error_max_deg: float = number(5.0, 0.0, 180.0)  # a run that is surely worse is a warning
    posterior_draws: int = number(200, 100, 100_000)
    declination_deg: float | None = number(None, -180.0, 180.0)
    declination_sigma_deg: float = number(0.5, 0.0, 180.0)

    velocity_sigma_mps: float = number(0.03, 0.0, 10.0)  # GNSS error that lasts for a run: its track is off by it / V
    slip_sigma_deg: float = number(0.2, 0.0, 10.0)  # nose against track on the wheels, in wind and on a camber
    place_sigma_deg: float = number(0.5, 0.001, 45.0)  # iron in the ground, loads: scale of what a run has of its own
    semicircular_sigma_deg: float = number(5.0, 0.01, 180.0)  # B and C
    quadrantal_sigma_deg: float = number(1.0, 0.01, 180.0)  # D and E
    known_share: float = number(0.35, 0.01, 1.0)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.speed_min_mps > self.speed_max_mps:
            expected = f"at most speed_max_mps = {self.speed_max_mps:g}"
            raise SettingsError("speed_min_mps", f"{self.speed_min_mps:g}", expected)
