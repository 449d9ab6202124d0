"""Statistics over many flights.

They are moments, an aircraft's mean with its interval, trend, outliers and calibration.
"""
