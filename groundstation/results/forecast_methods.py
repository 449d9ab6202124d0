"""Methods of the forecast of an INS error in words, and the horizons judged."""

FORECAST_METHODS: dict[str, str] = {
    "raw_ins": "raw INS, no correction",
    "hold_velocity": "last velocity error held",
    "schuler_fit": "bias and Schuler sine fitted",
    "last_estimate": "last estimate of the filter",
    "windows": "long-period windows (paper)",
    "drift_windows": "windows of the drift alone",
    "consistent_windows": "consistent windows",
    "smoothed_start": "smoothed start",
    "noise_bank": "bank of noise sets",
}
FORECAST_HORIZONS_MIN = (1, 5, 10, 30, 60, 90, 120)
