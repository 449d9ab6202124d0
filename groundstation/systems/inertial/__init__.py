"""Errors of the INS by a Kalman filter, and the forecast through outages of GNSS."""
