"""Arrays of the forecast through GNSS outages.

Where methods are compared, each has a column.
"""

from groundstation.results.arrays.typed import Arrays, ByName, Counts, Floats, Part, column, family

_DIGITS = {"time_s": 2, "start_s": 1, "lead_s": 1, "horizon_min": 2, "*_m": 1}


class ForecastMap(Arrays, figure="forecast_map", digits=_DIGITS):
    """Radial error by start and horizon, of each method."""

    start_s: Floats
    horizon_min: Floats
    radial_m: ByName = family("{}_m")


class ForecastGrowth(Arrays, figure="forecast_growth", digits=_DIGITS):
    """RMS over the starts by horizon, of each method, and what the default method claims."""

    horizon_min: Floats
    starts: Counts
    rms_m: ByName = family("{}_rms_m")
    sigma_m: Floats | None = None


class FanOfChannel(Part):
    """Forecast error of one channel, its sigma, and what GNSS showed."""

    forecast_m: Floats = column("{}_m")
    sigma_m: Floats
    actual_m: Floats = column("actual_{}_m")


class ForecastFan(Arrays, figure="forecast_fan", digits=_DIGITS):
    """Forecasts of the default method from some starts."""

    start_s: Floats
    lead_s: Floats
    north: FanOfChannel
    east: FanOfChannel


class ForecastClassic(Arrays, figure="forecast_classic", digits=_DIGITS):
    """Error east of the rest of the flight from four starts, measured and forecast.

    It is the paper's figure 2.
    """

    start_s: Floats
    time_s: Floats
    measured_east_m: Floats
    last_estimate_east_m: Floats
    windows_east_m: Floats
    default_east_m: Floats
