"""Arrays of the approaches, by guidance and by beacons."""

from groundstation.results.arrays.typed import Arrays, Counts, Floats

_THREE = {"*_s": 3, "*_m": 3, "*_mps": 3, "*_deg": 3}


class LandingPath(
    Arrays,
    figure="landing_path",
    digits={
        "approach": 0,
        "time_s": 3,
        "distance_m": 1,
        "across_m": 1,
        "height_m": 1,
        "path_height_m": 1,
        "lateral_guidance_m": 1,
        "vertical_guidance_m": 1,
        "lateral_dot_m": 2,
        "vertical_dot_m": 2,
        "lateral_dots": 3,
        "vertical_dots": 3,
        "latitude_deg": 7,
        "longitude_deg": 7,
        "ground_speed_mps": 2,
        "sink_rate_mps": 2,
        "bank_deg": 2,
    },
):
    """Every sample of the finals and roll-outs of all approaches."""

    approach: Floats
    time_s: Floats
    distance_m: Floats
    across_m: Floats
    height_m: Floats
    path_height_m: Floats
    lateral_guidance_m: Floats
    vertical_guidance_m: Floats
    lateral_dot_m: Floats
    vertical_dot_m: Floats
    lateral_dots: Floats
    vertical_dots: Floats
    latitude_deg: Floats
    longitude_deg: Floats
    ground_speed_mps: Floats
    sink_rate_mps: Floats
    bank_deg: Floats


class LandingProtection(Arrays, figure="landing_protection", digits={"*_m": 1, "time_s": 3, "approach": 0}):
    """Protection levels and alarm limits along the approaches that have any."""

    time_s: Floats
    horizontal_protection_m: Floats
    horizontal_alarm_limit_m: Floats
    vertical_protection_m: Floats
    vertical_alarm_limit_m: Floats
    approach: Floats


class BeaconsPath(Arrays, figure="landing_beacons_path", digits=_THREE):
    """Position by beacons along every approach, with its sigmas."""

    time_s: Floats
    approach: Counts
    straight_before_threshold_m: Floats
    before_threshold_m: Floats
    distance_sigma_m: Floats
    lateral_m: Floats
    lateral_sigma_m: Floats
    glide_path_m: Floats
    glide_path_sigma_m: Floats
    height_m: Floats
    off_course_deg: Floats
