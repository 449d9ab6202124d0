"""Settings of the INS error estimator and of the forecast, with every limit of the method."""

from dataclasses import dataclass
from typing import Literal

from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import number
from groundstation.results.forecast_methods import FORECAST_METHODS


@dataclass(frozen=True)
class InertialSettings:
    """Limits and choices of system 2; the windows are the paper's.

    Source: Neusypin, Smolkin, Kharin, Kopelovich, Staroverov, Herald of BMSTU, 2003.
    """

    # What is compared
    ins_class: str = "auto"  # name of a shipped class, or a file; auto: the aircraft file's, else navigation
    transition: Literal["exact", "first_order"] = "exact"
    model: Literal["separate", "coupled"] = "coupled"  # whose last estimate is forecast
    epoch_interval_s: float = number(1.0, 0.01, 60.0)  # differences are averaged over such intervals
    ins_gap_max_s: float = number(1.5, 0.0)  # INS is interpolated over no longer gap
    use_position: bool = True
    use_velocity: bool = True
    gate_sigmas: float = number(5.0, 1.0, 1000.0)
    least_gnss_s: float = number(300.0, 0.0)  # less than this and nothing is estimated
    # What is believed of the log
    jump_m: float = number(30.0, 1.0, 1e5)  # a step of position that neither velocity nor noise explains
    frozen_s: float = number(5.0, 0.0)  # a position that repeats for so long while moving
    frozen_speed_mps: float = number(20.0, 0.0)
    aided_radial_m: float = number(30.0, 0.0)  # an INS whose minute means stay so near GNSS has never drifted
    # Forecast
    default_method: str = "last_estimate"
    tilt_window_s: float = number(700.0, 1.0, 36_000.0)
    drift_window_s: float = number(2000.0, 1.0, 36_000.0)
    drift_rate_window_s: float = number(2500.0, 1.0, 36_000.0)
    hold_s: float = number(60.0, 1.0, 3600.0)
    schuler_fit_s: float = number(5064.0, 60.0, 36_000.0)  # 84.4 min
    smoothing_lag_s: float = number(1800.0, 10.0, 36_000.0)
    outage_s: float = number(10.0, 0.1)  # so long without GNSS is an outage that is listed
    # Replay
    first_start_s: float = number(5400.0, 0.0)
    start_step_s: float = number(300.0, 1.0, 36_000.0)
    map_step_s: float = number(60.0, 1.0, 36_000.0)
    forecast_step_s: float = number(10.0, 1.0, 60.0)
    azimuth_sigma_max_deg: float = number(0.1, 0.0)

    def __post_init__(self) -> None:
        if self.default_method not in FORECAST_METHODS:
            raise SettingsError("default_method", repr(self.default_method), f"one of {', '.join(FORECAST_METHODS)}")
        if not self.use_position and not self.use_velocity:
            raise SettingsError("use_position", "false, and use_velocity too", "at least one of them")
