"""Arrays of the best trajectory; of a long log not every state.

Differences are what is shown minus the smoothed solution: forward filter, on-board filter, GNSS.
"""

from groundstation.results.arrays.typed import Arrays, Counts, Flags, Floats

_TIME = {"time_s": 3}


class TrajectoryTrack(
    Arrays, figure="trajectory_track", digits={**_TIME, "*tude_deg": 8, "*_m": 3, "*_mps": 4, "*_deg": 3}
):
    """Smoothed states and their sigmas.

    ``other_heading_deg`` is the heading of a second hypothesis.
    """

    time_s: Floats
    segment: Counts
    latitude_deg: Floats
    longitude_deg: Floats
    height_m: Floats
    velocity_north_mps: Floats
    velocity_east_mps: Floats
    velocity_down_mps: Floats
    roll_deg: Floats
    pitch_deg: Floats
    heading_deg: Floats
    position_north_sigma_m: Floats
    position_east_sigma_m: Floats
    position_down_sigma_m: Floats
    velocity_north_sigma_mps: Floats
    velocity_east_sigma_mps: Floats
    velocity_down_sigma_mps: Floats
    roll_sigma_deg: Floats
    pitch_sigma_deg: Floats
    heading_sigma_deg: Floats
    other_heading_deg: Floats | None = None


class TrajectorySeparation(Arrays, figure="trajectory_separation", digits={**_TIME, "*_m": 3, "*_mps": 4, "*_deg": 4}):
    """Forward filter minus smoothed solution."""

    time_s: Floats
    position_north_m: Floats
    position_east_m: Floats
    position_down_m: Floats
    velocity_north_mps: Floats
    velocity_east_mps: Floats
    velocity_down_mps: Floats
    roll_deg: Floats
    pitch_deg: Floats
    heading_deg: Floats


class TrajectoryOnboard(
    Arrays, figure="trajectory_onboard", digits={**_TIME, "*tude_deg": 8, "*_m": 3, "*_mps": 4, "*_deg": 4}
):
    """Errors of the on-board filter, constant offsets taken off.

    They are its output minus the smoothed solution, whose sigmas stand beside them. NaN throughout: the filter does not
    log it. Places are those that the filter logged.
    """

    time_s: Floats
    heading_deg: Floats
    heading_sigma_deg: Floats
    roll_deg: Floats
    roll_sigma_deg: Floats
    pitch_deg: Floats
    pitch_sigma_deg: Floats
    velocity_north_mps: Floats
    velocity_east_mps: Floats
    horizontal_velocity_sigma_mps: Floats
    velocity_down_mps: Floats
    vertical_velocity_sigma_mps: Floats
    position_north_m: Floats
    position_east_m: Floats
    horizontal_position_sigma_m: Floats
    height_m: Floats
    vertical_position_sigma_m: Floats
    latitude_deg: Floats
    longitude_deg: Floats


class TrajectoryResiduals(Arrays, figure="trajectory_residuals", digits={**_TIME, "*_m": 3, "*_mps": 4}):
    """GNSS minus smoothed solution at the antenna.

    A fix that was not used was rejected or held out.
    """

    time_s: Floats
    position_north_m: Floats
    position_east_m: Floats
    position_down_m: Floats
    velocity_north_mps: Floats
    velocity_east_mps: Floats
    velocity_down_mps: Floats
    is_used: Flags
    is_held_out: Flags


class TrajectoryBiases(Arrays, figure="trajectory_biases", digits={**_TIME, "*_dps": 5, "*_mg": 3}):
    """Biases of the inertial unit over time, in the axes of the body, and their sigmas."""

    time_s: Floats
    gyro_x_dps: Floats
    gyro_y_dps: Floats
    gyro_z_dps: Floats
    gyro_x_sigma_dps: Floats
    gyro_y_sigma_dps: Floats
    gyro_z_sigma_dps: Floats
    accel_x_mg: Floats
    accel_y_mg: Floats
    accel_z_mg: Floats
    accel_x_sigma_mg: Floats
    accel_y_sigma_mg: Floats
    accel_z_sigma_mg: Floats


class TrajectoryOutages(Arrays, figure="trajectory_outages", digits={"start_s": 3, "length_s": 1, "*_m": 3}):
    """Replayed outages, a row each.

    ``smoothed_error_m`` is the largest horizontal error inside, ``smoothed_sigma_m`` its sigma there.
    """

    start_s: Floats
    length_s: Floats
    smoothed_error_m: Floats
    smoothed_sigma_m: Floats
    forward_end_error_m: Floats
    is_inside95: Flags
