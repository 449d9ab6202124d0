"""Batch smoother of a session: all readings of all vehicles in one least-squares problem."""
