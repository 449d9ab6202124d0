"""The runway of a final, and where the aircraft was relative to it and to its glide path.

Distances are along the runway, positive before the threshold; across, right of the course is positive; errors and
deviations are aircraft minus glide path.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, direction_of
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import SEMI_MAJOR_M, latitude_longitude_deg, north_east_m
from groundstation.base.records import BoolArray
from groundstation.base.runways.table import RunwayDirection
from groundstation.base.units import DOTS_PER_FULL_SCALE
from groundstation.systems.landing.answer import GLIDE_SLOPE_DOT, RunwayUsed
from groundstation.systems.landing.arrays import LandingPath
from groundstation.systems.landing.finals import Final
from groundstation.systems.landing.path import FlightPath
from groundstation.systems.landing.runway_answer import RunwayChoice
from groundstation.systems.landing.runway_choice import named
from groundstation.systems.landing.settings import LandingSettings

LINE_M = 5_000.0  # of a final without guidance, the line goes through so much of its end
VELOCITY_ERROR_MPS = 0.5  # of positions that nothing corrects: turns the line they make
ROLL_OUT_S, ROLL_OUT_MIN_MPS = 40.0, 12.0
BEHIND_THE_END_M = 300.0  # the antenna of the localizer, where nothing says its place


@dataclass(frozen=True, eq=False)
class FittedLine:
    """A line through positions: a place on it, its direction, and the scatter about it."""

    latitude_deg: float
    longitude_deg: float
    course_deg: float
    scatter_m: float
    length_m: float


@dataclass(frozen=True, eq=False, kw_only=True)
class RelativeToRunway:
    """Samples of a final and its roll-out relative to runway and glide path.

    Arrays have shape (n,), NaN where not known.
    """

    rows: slice
    distance_m: FloatArray
    across_m: FloatArray
    height_m: FloatArray
    glide_path_height_m: FloatArray
    lateral_guidance_m: FloatArray
    vertical_guidance_m: FloatArray
    is_final: BoolArray
    lateral_dot_m: FloatArray
    vertical_dot_m: FloatArray


def line_through(path: FlightPath, rows: slice, shift_m: FloatArray | None = None) -> FittedLine:
    """Total least squares line through the positions of some rows, in the direction of flight.

    ``shift_m`` (n, 2) moves them north and east first.
    """
    latitude, longitude = float(np.mean(path.latitude_deg[rows])), float(path.longitude_deg[rows][0])
    place = path.position_m(latitude, longitude)[rows] + (0.0 if shift_m is None else shift_m)
    middle = place.mean(axis=0)
    _left, sizes, axes = np.linalg.svd(place - middle, full_matrices=False)
    direction = axes[0] * (1.0 if axes[0] @ (place[-1] - place[0]) >= 0.0 else -1.0)
    along = (place - middle) @ direction
    middle_latitude, middle_longitude = latitude_longitude_deg(middle[0], middle[1], latitude, longitude)
    course_deg = float(direction_of(direction[0], direction[1]))
    scatter_m = float(sizes[1] / np.sqrt(len(place)))
    return FittedLine(float(middle_latitude), float(middle_longitude), course_deg, scatter_m, float(np.ptp(along)))


def runway_of(path: FlightPath, final: Final, settings: LandingSettings) -> RunwayUsed:
    """The runway of the site file, else of the table, else one placed by the positions."""
    listed = final.runway
    width_m, distance_m = settings.localizer_width_m, settings.localizer_distance_m
    if listed is not None and listed.latitude_deg is not None and listed.longitude_deg is not None:
        behind_m = distance_m if listed.length_m is None else max(listed.length_m + BEHIND_THE_END_M, 500.0)
        return RunwayUsed(
            name=listed.name,
            placed_by="site file",
            latitude_deg=listed.latitude_deg,
            longitude_deg=listed.longitude_deg,
            true_course_deg=listed.true_bearing_deg,
            course_sigma_deg=listed.sigma_deg,
            elevation_m=listed.elevation_m,
            glide_angle_deg=listed.glide_angle_deg,
            threshold_crossing_height_m=listed.threshold_crossing_height_m,
            localizer_width_m=_given(listed.localizer_width_m, width_m),
            localizer_distance_m=_given(listed.localizer_distance_m, behind_m),
            length_m=listed.length_m,
            width_m=listed.width_m,
            landing_length_m=listed.length_m,
        )
    if final.chosen is not None and final.chosen.runway is not None:
        return _of_the_table(final.chosen.runway, final.chosen.choice, settings)
    line = _course_line(path, final, settings)
    latitude, longitude, reason = _threshold(path, final, line, settings)
    speed_mps = float(np.nanmedian(path.ground_speed_mps[final.first : final.last]))
    drift_deg = 0.0 if path.position_topic.startswith("gnss") else np.rad2deg(VELOCITY_ERROR_MPS / max(speed_mps, 1.0))
    sigma_deg = float(np.hypot(np.rad2deg(np.sqrt(2.0) * line.scatter_m / max(line.length_m, 1.0)), drift_deg))
    choice = None if final.chosen is None else final.chosen.choice
    return replace(
        _placed(line, latitude, longitude, settings),
        name="" if choice is None else named(choice),
        course_sigma_deg=sigma_deg,
        place_reason=reason,
        choice=choice,
    )


def _of_the_table(one: RunwayDirection, choice: RunwayChoice, settings: LandingSettings) -> RunwayUsed:
    """A runway of the table, with the aids of the settings."""
    return RunwayUsed(
        name=one.full_name,
        placed_by="runway table",
        latitude_deg=one.latitude_deg,
        longitude_deg=one.longitude_deg,
        true_course_deg=one.true_course_deg,
        course_sigma_deg=one.course_sigma_deg,
        elevation_m=one.elevation_m,
        glide_angle_deg=settings.glide_angle_deg,
        threshold_crossing_height_m=settings.threshold_crossing_height_m,
        localizer_width_m=settings.localizer_width_m,
        localizer_distance_m=max(one.landing_length_m + BEHIND_THE_END_M, 500.0),
        length_m=one.length_m,
        width_m=one.width_m,
        landing_length_m=one.landing_length_m,
        displaced_m=one.displaced_m,
        slope=one.slope,
        surface=one.surface,
        is_closed=one.is_closed,
        along_sigma_m=one.along_sigma_m,
        across_sigma_m=one.across_sigma_m,
        choice=choice,
    )


def _placed(line: FittedLine, latitude_deg: float, longitude_deg: float, settings: LandingSettings) -> RunwayUsed:
    """A runway on a line, with the aids of the settings."""
    return RunwayUsed(
        name="",
        placed_by="positions",
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        true_course_deg=line.course_deg,
        course_sigma_deg=0.0,
        elevation_m=None,
        glide_angle_deg=settings.glide_angle_deg,
        threshold_crossing_height_m=settings.threshold_crossing_height_m,
        localizer_width_m=settings.localizer_width_m,
        localizer_distance_m=settings.localizer_distance_m,
    )


def _course_line(path: FlightPath, final: Final, settings: LandingSettings) -> FittedLine:
    """Return the course line that positions show.

    The line is fitted to the positions less the deviations that the guidance shows.
    """
    rows = _line_rows(path, final)
    line = line_through(path, rows)
    dots = path.lateral_dots[rows]
    if final.guided is None or not np.isfinite(dots).any():
        return line
    latitude, longitude, _reason = _threshold(path, final, line, settings)
    runway = _placed(line, latitude, longitude, settings)
    distance_m, _across_m = along_and_across(path.latitude_deg[rows], path.longitude_deg[rows], runway)
    aside_m = np.nan_to_num(dots) * metres_per_dot(distance_m, runway)
    course_rad = np.deg2rad(line.course_deg)
    return line_through(path, rows, np.outer(-aside_m, [-np.sin(course_rad), np.cos(course_rad)]))


def _given(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value


def _line_rows(path: FlightPath, final: Final) -> slice:
    """Rows that the line goes through: on the guidance, else the last of the final."""
    if final.guided is not None:
        return final.guided
    end = final.last - 1
    distance_m = np.hypot(*path.position_m(path.latitude_deg[end], path.longitude_deg[end])[final.first : final.last].T)
    return slice(final.first + int(np.argmax(distance_m <= LINE_M)), final.last)


def _threshold(path: FlightPath, final: Final, line: FittedLine, settings: LandingSettings) -> tuple[float, float, str]:
    """Return latitude and longitude of the threshold of an unlisted runway, and their source."""
    end = final.last - 1
    course_rad = np.deg2rad(line.course_deg)
    direction = np.array([np.cos(course_rad), np.sin(course_rad)])
    place = path.position_m(line.latitude_deg, line.longitude_deg)
    along = place @ direction
    at = float(along[end]) - settings.aiming_point_m
    reason = f"{settings.aiming_point_m:.0f} m before the touchdown"
    if final.end.outcome == "go-around":
        rows = final.guided or slice(final.first, final.last)
        known = np.isfinite(path.altitude_m[rows])
        slope, height_m = np.polyfit(along[rows][known], path.altitude_m[rows][known], 1)
        at = float((settings.threshold_crossing_height_m - height_m) / slope) if slope < -0.01 else float(along[end])
        reason = "where the path flown meets the threshold crossing height"
    latitude, longitude = latitude_longitude_deg(
        at * direction[0], at * direction[1], line.latitude_deg, line.longitude_deg
    )
    return float(latitude), float(longitude), reason


def relative_to_runway(path: FlightPath, final: Final, runway: RunwayUsed) -> RelativeToRunway:
    """Compare a final and its roll-out with runway and glide path."""
    last = final.last
    if final.end.touches:
        rolls = (path.time_s <= min(final.end.time_s + ROLL_OUT_S, final.end.until_s)) & ~(
            path.ground_speed_mps < ROLL_OUT_MIN_MPS
        )
        behind = np.flatnonzero(~rolls[last:])
        last = last + int(behind[0]) if behind.size else len(path.time_s)
    rows = slice(final.first, last)
    distance_m, across_m = along_and_across(path.latitude_deg[rows], path.longitude_deg[rows], runway)
    height_m = _height(path, final, runway)[rows]
    slope = np.tan(np.deg2rad(runway.glide_angle_deg))
    curved_m = distance_m**2 / (2.0 * SEMI_MAJOR_M) * np.sign(distance_m)
    glide_path_height_m = runway.threshold_crossing_height_m + distance_m * slope + curved_m
    from_origin_m = np.clip(distance_m + runway.threshold_crossing_height_m / slope, 0.0, None)
    is_final = np.arange(rows.start, rows.stop) < final.last
    lateral_dot_m = metres_per_dot(distance_m, runway)
    vertical_dot_m = GLIDE_SLOPE_DOT * np.deg2rad(runway.glide_angle_deg) * from_origin_m
    return RelativeToRunway(
        rows=rows,
        distance_m=distance_m,
        across_m=across_m,
        height_m=height_m,
        glide_path_height_m=glide_path_height_m,
        lateral_guidance_m=path.lateral_dots[rows] * lateral_dot_m,
        vertical_guidance_m=np.where(is_final, path.vertical_dots[rows] * vertical_dot_m, np.nan),
        is_final=is_final,
        lateral_dot_m=lateral_dot_m,
        vertical_dot_m=vertical_dot_m,
    )


def metres_per_dot(distance_m: FloatArray, runway: RunwayUsed) -> FloatArray:
    """Return the width of a dot of the localizer.

    The course sector narrows towards the antenna behind the runway.
    """
    widening = np.clip(1.0 + distance_m / runway.localizer_distance_m, 0.05, None)
    return np.asarray(0.5 * runway.localizer_width_m / DOTS_PER_FULL_SCALE * widening)


def along_and_across(
    latitude_deg: FloatArray, longitude_deg: FloatArray, runway: RunwayUsed
) -> tuple[FloatArray, FloatArray]:
    """Distance before the threshold and displacement right of the course, metres.

    Examples
    --------
    >>> eastward = RunwayUsed(
    ...     name="09", placed_by="site file", latitude_deg=0.0, longitude_deg=10.0, true_course_deg=90.0,
    ...     course_sigma_deg=0.05, elevation_m=None, glide_angle_deg=3.0, threshold_crossing_height_m=15.0,
    ...     localizer_width_m=210.0, localizer_distance_m=3300.0,
    ... )
    >>> [round(float(one[0])) for one in along_and_across(np.array([-0.001]), np.array([9.99]), eastward)]
    [1113, 111]
    """
    north, east = north_east_m(latitude_deg, longitude_deg, runway.latitude_deg, runway.longitude_deg)
    course_rad = np.deg2rad(runway.true_course_deg)
    along = north * np.cos(course_rad) + east * np.sin(course_rad)
    return np.asarray(-along), np.asarray(east * np.cos(course_rad) - north * np.sin(course_rad))


def _height(path: FlightPath, final: Final, runway: RunwayUsed) -> FloatArray:
    """Height above the threshold, NaN where nothing ties the altitude to it."""
    if path.is_above_airfield:
        return path.altitude_m
    if path.altitude_source.endswith("altitude_msl_m") and runway.elevation_m is not None:
        return path.altitude_m - runway.elevation_m
    level_m = final.end.ground_m(path.altitude_source)
    if level_m is not None:
        return path.altitude_m - level_m
    if not final.end.touches:
        return np.full(len(path.time_s), np.nan)
    on_ground = (path.time_s >= final.end.time_s) & (path.time_s <= final.end.time_s + 10.0)
    ground_m = path.altitude_m[on_ground & np.isfinite(path.altitude_m)]
    return path.altitude_m - (float(np.median(ground_m)) if ground_m.size else np.nan)


def samples_of_final(number: int, path: FlightPath, relative: RelativeToRunway) -> LandingPath:
    """Every sample of a final and its roll-out."""
    rows = relative.rows
    return LandingPath(
        approach=np.full(rows.stop - rows.start, float(number)),
        time_s=path.time_s[rows],
        distance_m=relative.distance_m,
        across_m=relative.across_m,
        height_m=relative.height_m,
        path_height_m=relative.glide_path_height_m,
        lateral_guidance_m=relative.lateral_guidance_m,
        vertical_guidance_m=relative.vertical_guidance_m,
        lateral_dot_m=relative.lateral_dot_m,
        vertical_dot_m=relative.vertical_dot_m,
        lateral_dots=path.lateral_dots[rows],
        vertical_dots=path.vertical_dots[rows],
        latitude_deg=path.latitude_deg[rows],
        longitude_deg=path.longitude_deg[rows],
        ground_speed_mps=path.ground_speed_mps[rows],
        sink_rate_mps=path.sink_rate_mps[rows],
        bank_deg=path.bank_deg[rows],
    )
