"""Typed tables of one flight on one clock: validity, gaps, resampling, flight phases."""
