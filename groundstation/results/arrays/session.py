"""Arrays of any session of several vehicles: clocks of its logs, ground points."""

from groundstation.results.arrays.typed import Arrays, Counts, Flags, Floats, Texts, column


class SessionClocks(Arrays, figure="session_clocks", digits={"offset_s": 6}):
    """Clock of each log of a session."""

    aircraft: Texts
    log: Texts
    has_utc: Flags
    ranges: Counts
    offset_s: Floats
    leaps: Counts
    is_corrected: Flags


class SessionPoints(Arrays, figure="session_points"):
    """Ground points of a session."""

    label: Texts = column("name")
    x_m: Floats
    y_m: Floats
    z_m: Floats
    position_sigma_m: Floats
