"""Settings of the INS error estimator and of the forecast, with every limit of the method."""

from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import number
from groundstation.results.forecast_methods import FORECAST_METHODS


@dataclass(frozen=True)
class InertialSettings:
    """Limits and choices of system 2; the windows are the paper's.

    Source: Neusypin, Smolkin, Kharin, Kopelovich, Staroverov, Herald of BMSTU, 2003.
    """

    # What is compared

    # Class of the INS, by which noise and priors are set: a shipped name, or a file; auto: the aircraft file's, else
    # navigation.
    ins_class: str = "auto"
    # exact: the model is carried by its matrix exponential; first_order: by short steps of I + A dt.
    transition: Literal["exact", "first_order"] = "exact"
    # Model whose last estimate is forecast: separate has north and east channels apart, coupled has them together.
    model: Literal["separate", "coupled"] = "coupled"
    # Differences of INS and GNSS are averaged over intervals of this length; chosen.
    epoch_interval_s: float = number(1.0, 0.01, 60.0)
    ins_gap_max_s: float = number(1.5, 0.0)  # INS is interpolated over no longer gap; chosen
    use_position: bool = True  # false: differences of position do not go into the filter
    use_velocity: bool = True  # false: differences of velocity do not go into the filter
    gate_sigmas: float = number(5.0, 1.0, 1000.0)  # innovations beyond so many sigmas are not used; chosen
    least_gnss_s: float = number(300.0, 0.0)  # with less time of INS and GNSS together nothing is estimated; chosen
    # What is believed of the log

    # A larger step of position that neither velocity nor noise explains is a jump of GNSS or a reset of the INS;
    # chosen.
    jump_m: float = number(30.0, 1.0, 1e5)
    frozen_s: float = number(5.0, 0.0)  # a GNSS position that repeats for so long in motion is frozen; chosen
    # Speed of the INS above which a repeated GNSS position is frozen; chosen.
    frozen_speed_mps: float = number(20.0, 0.0)
    # An INS whose minute means stay nearer to GNSS is corrected by it; chosen.
    aided_radial_m: float = number(30.0, 0.0)
    # Forecast
    default_method: str = "last_estimate"  # method of the forecast that is shown first (docs/decisions/012)
    # Mean of the tilt over so long is carried into the forecast, by the methods with windows; paper.
    tilt_window_s: float = number(700.0, 1.0, 36_000.0)
    # Mean of the gyro drift over so long is carried into the forecast, by the methods with windows; paper.
    drift_window_s: float = number(2000.0, 1.0, 36_000.0)
    # Mean of the rate of the gyro drift over so long is carried into the forecast, by the methods with windows; paper.
    drift_rate_window_s: float = number(2500.0, 1.0, 36_000.0)
    # The mean velocity error over so long is held, by the method hold_velocity; chosen.
    hold_s: float = number(60.0, 1.0, 3600.0)
    # A bias and a Schuler sine are fitted over so long, by the method schuler_fit: one period, 84.4 min.
    schuler_fit_s: float = number(5064.0, 60.0, 36_000.0)
    # So long before the start is the state that the method smoothed_start smooths and carries on; chosen.
    smoothing_lag_s: float = number(1800.0, 10.0, 36_000.0)
    outage_s: float = number(10.0, 0.1)  # a longer time without GNSS is an outage that is listed; chosen
    # Replay

    # Flight time of the first replayed outage that is judged, earlier in a short flight; chosen.
    first_start_s: float = number(5400.0, 0.0)
    start_step_s: float = number(300.0, 1.0, 36_000.0)  # time between the starts of replayed outages; chosen
    # Time between the starts on the map of forecast errors, longer in a long flight; chosen.
    map_step_s: float = number(60.0, 1.0, 36_000.0)
    forecast_step_s: float = number(10.0, 1.0, 60.0)  # step in which a forecast is carried on; chosen
    # Sigma of the azimuth error by turns in flight at most, for one that is told; chosen.
    azimuth_sigma_max_deg: float = number(0.1, 0.0)

    def __post_init__(self) -> None:
        if self.default_method not in FORECAST_METHODS:
            raise SettingsError("default_method", repr(self.default_method), f"one of {', '.join(FORECAST_METHODS)}")
        if not self.use_position and not self.use_velocity:
            raise SettingsError("use_position", "false, and use_velocity too", "at least one of them")
