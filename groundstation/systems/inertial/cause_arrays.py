"""Arrays of the errors by cause: velocity error and its parts, errors along the track."""

from groundstation.results.arrays.typed import Arrays, Floats, Part


class PartsOfChannel(Part):
    """Velocity error of one channel, means over some seconds, and what each cause has of it."""

    measured_mps: Floats
    schuler_mps: Floats
    drift_mps: Floats
    azimuth_mps: Floats
    body_mps: Floats
    reset_mps: Floats
    unexplained_mps: Floats


class CausesOverTime(Arrays, figure="causes_over_time", digits={"time_s": 1, "*_mps": 4}):
    """Velocity error over time and its parts, north and east."""

    time_s: Floats
    north: PartsOfChannel
    east: PartsOfChannel


class CausesAlong(Arrays, figure="causes_along", digits={"time_s": 1, "*_mps": 4, "*_m": 1}):
    """Errors along the track and to its right; NaN where the aircraft hardly moves."""

    time_s: Floats
    along_mps: Floats
    across_mps: Floats
    along_m: Floats
    across_m: Floats
