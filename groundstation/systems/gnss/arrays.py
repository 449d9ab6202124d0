"""Arrays of the GNSS reception: states, quality over time, scatter, two receivers."""

from groundstation.results.arrays.typed import Arrays, Floats, Texts


class GnssStates(Arrays, figure="gnss_states", digits={"start_s": 3, "end_s": 3}):
    """States of the fix of every receiver, one row a spell."""

    topic: Texts
    start_s: Floats
    end_s: Floats
    state: Texts


class GnssMissing(Arrays, figure="gnss_missing", digits={"after_s": 3, "next_s": 3, "epochs": 0}):
    """Epochs that the rate of a receiver expects and the log lacks, one row a place."""

    topic: Texts
    after_s: Floats
    next_s: Floats
    epochs: Floats


class GnssQuality(
    Arrays,
    figure="gnss_quality",
    digits={"time_s": 3, "satellites_*": 0, "*dop": 2, "cn0_dbhz": 1, "*_m": 4, "*_mps": 4, "*_corrections_s": 1},
):
    """Quality that every receiver states, and the step of its position beyond its velocity.

    Of a long log not every row.
    """

    topic: Texts
    time_s: Floats
    satellites_used: Floats
    satellites_tracked: Floats
    cn0_dbhz: Floats
    hdop: Floats
    pdop: Floats
    age_of_corrections_s: Floats
    horizontal_sigma_m: Floats
    vertical_sigma_m: Floats
    velocity_sigma_mps: Floats
    position_step_m: Floats


class GnssStandstill(Arrays, figure="gnss_standstill", digits={"time_s": 3, "*_m": 4}):
    """Positions of the standstill that is judged, from their mean."""

    topic: Texts
    time_s: Floats
    north_m: Floats
    east_m: Floats
    up_m: Floats


class GnssAveraging(Arrays, figure="gnss_averaging", digits={"averaged_s": 3, "*_m": 5}):
    """Scatter of means over longer and longer times, and that of errors without memory."""

    topic: Texts
    averaged_s: Floats
    scatter_m: Floats
    without_memory_m: Floats


class GnssPairs(Arrays, figure="gnss_pairs", digits={"time_s": 3, "*_m": 4, "*_mps": 4}):
    """Second receiver minus the first at the times of the first; of a long log not every row."""

    pair: Texts
    time_s: Floats
    north_m: Floats
    east_m: Floats
    up_m: Floats
    distance_m: Floats
    north_mps: Floats
    east_mps: Floats
