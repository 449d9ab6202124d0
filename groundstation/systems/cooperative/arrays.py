"""Arrays of navigation between vehicles; positions are in metres of the session."""

from groundstation.results.arrays.typed import Arrays, Counts, Floats, Texts

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


class CooperativeLinks(Arrays, figure="cooperative_links", digits={**_TIME, "*_m": 3}):
    """Innovations of every range of one algorithm; mark 1 used, -1 gated.

    ``range_m`` is the range as measured less clocks and biases as the default answer has them, ``range_sigma_m`` the
    sigma of the measurement; NaN where it is none.
    """

    time_s: Floats
    receiver: Texts
    source: Texts
    innovation: Floats
    sigma: Floats
    mark: Counts
    range_m: Floats | None = None
    range_sigma_m: Floats | None = None


class CooperativeTraffic(Arrays, figure="cooperative_traffic"):
    """Messages and bytes of every vehicle under every algorithm."""

    algorithm: Texts
    vehicle: Texts
    messages: Counts
    bytes: Counts


class CooperativeStations(Arrays, figure="cooperative_stations"):
    """Ground stations as the session judges them; NaN where there is no such number."""

    station: Texts
    verdict: Texts
    ranges: Counts
    chance: Floats
    shift_m: Floats
    shift_sigma_m: Floats
    shift_direction_deg: Floats
    delay_m: Floats
    delay_sigma_m: Floats
    detectable_best_m: Floats
    detectable_worst_m: Floats
    metres_per_metre: Floats
    moves_most: Texts
    stated_sigma_m: Floats
    used_sigma_m: Floats
    survey_north_m: Floats
    survey_east_m: Floats
    survey_sigma_north_m: Floats
    survey_sigma_east_m: Floats


class SessionErrors(Arrays, figure="session_errors"):
    """Worst computed 2 sigma_r and RMS error of all aircraft over time, default algorithm."""

    time_s: Floats
    two_sigma_r_m: Floats
    rms_error_m: Floats
