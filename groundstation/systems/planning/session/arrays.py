"""Arrays of a session's plan: paths, geometry and accuracy under each law of steering."""

from groundstation.results.arrays.typed import Arrays, Floats, Texts, column


class ControlPaths(Arrays, figure="control_paths"):
    """Paths flown under each law of steering."""

    time_s: Floats
    law: Texts
    aircraft: Texts
    north_m: Floats
    east_m: Floats
    up_m: Floats
    speed_mps: Floats
    track_deg: Floats


class ControlMeasures(Arrays, figure="control_measures"):
    """Geometry and accuracy under each law of steering."""

    time_s: Floats
    law: Texts
    determinant: Floats
    eigenvalue: Floats
    dop: Floats
    two_sigma_north_m: Floats
    two_sigma_east_m: Floats
    two_sigma_up_m: Floats
    two_sigma_r_m: Floats


class ControlPoints(Arrays, figure="control_points"):
    """Ground points of a plan."""

    label: Texts = column("name")
    north_m: Floats
    east_m: Floats
    up_m: Floats
