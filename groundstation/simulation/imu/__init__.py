"""Simulated logs of an inertial unit with GNSS: exact increments, errors, truth."""
