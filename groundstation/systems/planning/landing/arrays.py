"""Arrays of a landing by ranges: the path, the space of points, and the errors of trials."""

from groundstation.results.arrays.typed import Arrays, Counts, Floats, Texts, column

_THREE = {"*_s": 3, "*_m": 3, "*_mps": 3, "*_deg": 3}


class RangesPath(Arrays, figure="landing_ranges_path", digits=_THREE):
    """Accuracy of a landing by ranges along the approach."""

    time_s: Floats
    before_threshold_m: Floats
    height_m: Floats
    sigma_along_m: Floats
    sigma_right_m: Floats
    sigma_up_m: Floats
    lateral_95_m: Floats
    horizontal_95_m: Floats
    vertical_95_m: Floats
    determinant: Floats


class RangesSpace(Arrays, figure="landing_ranges_space", digits=_THREE):
    """Positions of the aircraft and of the points in a landing by ranges."""

    time_s: Floats
    label: Texts = column("name")
    along_m: Floats
    right_m: Floats
    up_m: Floats
    speed_mps: Floats


class RangesErrors(Arrays, figure="landing_ranges_errors", digits=_THREE):
    """Errors of the trials of a landing by ranges, with the sigmas of their filter."""

    time_s: Floats
    filter: Texts
    trial: Counts
    before_threshold_m: Floats
    error_along_m: Floats
    sigma_along_m: Floats
    error_right_m: Floats
    sigma_right_m: Floats
    error_up_m: Floats
    sigma_up_m: Floats
