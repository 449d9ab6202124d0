"""Recorded approaches: found, measured against their path, and what the localizer says of the position."""
