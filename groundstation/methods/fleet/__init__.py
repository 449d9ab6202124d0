"""What many flights say together: moments, an aircraft's mean with its interval, trend, outliers, calibration."""
