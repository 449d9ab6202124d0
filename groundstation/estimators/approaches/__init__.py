"""Recorded approaches: found, measured against their path, and checked by the localizer.

The localizer gives the error of the recorded position.
"""
