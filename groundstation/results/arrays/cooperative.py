"""Arrays of navigation between vehicles: session, plans, steering.

Positions are in metres of the session.
"""

from groundstation.results.arrays.typed import Arrays, Counts, Flags, Floats, Texts, column

_TIME = {"time_s": 3}


class CooperativeTracks(Arrays, figure="cooperative_tracks", digits={"*_m": 3, "correlation_north_east": 4}):
    """Positions, sigmas and errors of every vehicle under every algorithm."""

    time_s: Floats
    vehicle: Texts
    algorithm: Texts
    x_m: Floats
    y_m: Floats
    z_m: Floats
    sigma_north_m: Floats
    sigma_east_m: Floats
    sigma_up_m: Floats
    correlation_north_east: Floats
    two_sigma_r_m: Floats
    error_m: Floats
    nees: Floats


class CooperativeGeometry(Arrays, figure="cooperative_geometry", digits={**_TIME, "bound_m": 3}):
    """Geometry of every vehicle over time, and the bound of its position."""

    time_s: Floats
    sources: Floats
    hdop: Floats
    gdop: Floats
    determinant: Floats
    eigenvalue: Floats
    gram_determinant: Floats
    vehicle: Texts
    bound_m: Floats


class CooperativeMap(Arrays, figure="cooperative_map", digits=_TIME):
    """Spectral radius of the joint error map of every decentralised run."""

    time_s: Floats
    algorithm: Texts
    spectral_radius: Floats


class CooperativeLinks(Arrays, figure="cooperative_links", digits=_TIME):
    """Innovations of every range of one algorithm; mark 1 used, -1 gated."""

    time_s: Floats
    receiver: Texts
    source: Texts
    innovation: Floats
    sigma: Floats
    mark: Counts


class CooperativeTraffic(Arrays, figure="cooperative_traffic"):
    """Messages and bytes of every vehicle under every algorithm."""

    algorithm: Texts
    vehicle: Texts
    messages: Counts
    bytes: Counts


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


class SessionErrors(Arrays, figure="session_errors"):
    """Worst computed 2 sigma_r and RMS error of all aircraft over time, default algorithm."""

    time_s: Floats
    two_sigma_r_m: Floats
    rms_error_m: Floats


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


class PlacementPoints(Arrays, figure="placement_points"):
    """Places of the points in each design."""

    design: Texts
    label: Texts = column("name")
    north_m: Floats
    east_m: Floats
    up_m: Floats
    is_placed: Flags


class PlacementAccuracy(Arrays, figure="placement_accuracy"):
    """Accuracy along the user's way under each design."""

    time_s: Floats
    design: Texts
    north_m: Floats
    east_m: Floats
    up_m: Floats
    dop: Floats
    two_sigma_north_m: Floats
    two_sigma_east_m: Floats
    two_sigma_up_m: Floats


class PlacementKeepOut(Arrays, figure="placement_keep_out"):
    """Corners of the areas in which no point may stand."""

    label: Texts = column("name")
    north_m: Floats
    east_m: Floats


class PlacementMap(Arrays, figure="placement_map"):
    """Accuracy by where the last point stands."""

    north_m: Floats
    east_m: Floats
    sigma_m: Floats
    determinant: Floats
