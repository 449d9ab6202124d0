"""Error of recorded positions along the course; the reference is the glide path.

A height above the threshold and the deviation from the glide path say how far before the threshold the aircraft is:
its height over the tangent of the angle at which it sees the aiming point. The distance by the positions less this one
is their error. Both are compared on the last part of the final, and the difference is continued to the threshold, with
a share of the distance left free: glide angle, scale of a barometric height in cold or warm air, and growth of the
error all make one. The height is that of any altimeter but a radio one, which sees the ground below; its zero is the
ground on which the aircraft rolls out. Source: ICAO Annex 10, volume I, 3.1.5.1.2 (angle) and 3.1.5.6 (width).
"""

import math

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import MEAN_RADIUS_M, SEMI_MAJOR_M
from groundstation.results.landing_categories import LINEAR_95
from groundstation.systems.landing.answer import GLIDE_SLOPE_DOT, AlongError, ErrorPart
from groundstation.systems.landing.finals import Final
from groundstation.systems.landing.geometry import RelativeToRunway, along_and_across
from groundstation.systems.landing.path import FlightPath
from groundstation.systems.landing.reference import Positions
from groundstation.systems.landing.runway_answer import RunwayUsed
from groundstation.systems.landing.settings import LandingSettings

HIGHEST_M = 300.0  # above the threshold, from which on distances are compared
FEWEST, SHORTEST_M = 15, 1_000.0  # samples, and way over which they lie
SAMPLES_ALIKE = 5.0  # so many neighbours say what one does
ON_GROUND_S = 10.0  # behind the touchdown, over which the height has its zero
MOST_DOTS = 1.9  # a needle at its stop says nothing
NO_HEIGHT, RADIO = "no height above the threshold", "a radio altitude counts from the ground below, not the threshold"


def along_error(
    positions: Positions,
    crossing_s: float,
    path: FlightPath,
    final: Final,
    runway: RunwayUsed,
    relative: RelativeToRunway,
    settings: LandingSettings,
) -> AlongError:
    """Fit the error of positions along the course at the threshold, forward positive.

    Parameters
    ----------
    positions : Positions
        Of one topic, times counted from ``crossing_s``.
    path, final, runway, relative
        Heights and deviations of the final, and its runway.
    settings : LandingSettings
    """

    def refused(reason: str, samples: int = 0) -> AlongError:
        return AlongError(positions.topic, "not measured", reason, samples)

    if not runway.is_surveyed:
        return refused("these positions placed the runway")
    if not np.isfinite(path.vertical_dots).any():
        return refused("no glide path in the log")
    if path.altitude_source.startswith("radio_altimeter"):
        return refused(RADIO)
    height_m, zero_sigma_m = _height_of_antenna(path, final, runway, relative, settings)
    time_s = path.time_s[relative.rows] - crossing_s
    dots = path.vertical_dots[relative.rows]
    used = np.isfinite(height_m) & np.isfinite(dots) & (np.abs(dots) < MOST_DOTS) & relative.is_final
    used &= (height_m < HIGHEST_M) & (height_m > settings.gate_floor_m)
    by_path_m = _distance_by_path(height_m, dots, runway)
    by_positions_m = np.interp(time_s, positions.time_s, _distance_of(positions, runway), left=np.nan, right=np.nan)
    used &= np.isfinite(by_positions_m)
    if not np.isfinite(height_m).any():
        return refused(NO_HEIGHT)
    distance_m, apart_m = by_path_m[used], by_path_m[used] - by_positions_m[used]
    if used.sum() < FEWEST or np.ptp(distance_m) < SHORTEST_M:
        return refused("too little of the final on the glide path", int(used.sum()))
    error_m, fit_sigma_m, share = _at_the_threshold(distance_m, apart_m, settings)
    slope = math.tan(math.radians(runway.glide_angle_deg))
    parts = (
        ErrorPart("place of the threshold", runway.along_sigma_m or settings.threshold_sigma_m),
        ErrorPart("zero of the height", zero_sigma_m / slope),
        ErrorPart("height of the path over the threshold", settings.crossing_height_sigma_m / slope),
        ErrorPart("height of the antenna", settings.reference_height_sigma_m / slope),
        ErrorPart("rounding of the positions", _rounding_along_m(positions, runway, settings)),
        ErrorPart("scatter, angle and scale of the height", fit_sigma_m),
    )
    sigma_m = math.hypot(*(part.sigma_m for part in parts))
    interval_m = (error_m - LINEAR_95 * sigma_m, error_m + LINEAR_95 * sigma_m)
    return AlongError(
        positions.topic,
        "measured",
        "",
        int(used.sum()),
        error_m,
        sigma_m,
        interval_m,
        error_from_end_m=error_m + runway.displaced_m if runway.displaced_m else None,
        scale=1.0 + share,
        parts=parts,
    )


def _height_of_antenna(
    path: FlightPath, final: Final, runway: RunwayUsed, relative: RelativeToRunway, settings: LandingSettings
) -> tuple[FloatArray, float]:
    """Return the height of the antenna above the threshold, and the sigma of its zero.

    The zero is the runway where the aircraft rolls out, corrected for its slope; without a landing that of the source.
    """
    height_m = relative.height_m + settings.reference_height_m
    if final.end.outcome != "landing":
        return height_m, settings.height_zero_sigma_m
    time_s = path.time_s[relative.rows]
    rolling = (time_s >= final.end.time_s) & (time_s <= final.end.time_s + ON_GROUND_S)
    rolling &= np.isfinite(relative.height_m)
    if not rolling.any():
        return height_m, settings.height_zero_sigma_m
    ground_m = float(np.median(relative.height_m[rolling]))
    behind_m = -float(np.median(relative.distance_m[rolling]))
    rise_m = (runway.slope or 0.0) * behind_m
    scatter_m = float(np.std(relative.height_m[rolling]))
    return height_m - ground_m + rise_m, math.hypot(0.5 * settings.runway_slope * abs(behind_m), scatter_m, 1.0)


def _distance_by_path(height_m: FloatArray, dots: FloatArray, runway: RunwayUsed) -> FloatArray:
    """Return the distance before the threshold that heights and deviations stand for."""
    angle_rad = math.radians(runway.glide_angle_deg)
    origin_m = runway.threshold_crossing_height_m / math.tan(angle_rad)
    seen_rad = angle_rad * (1.0 + GLIDE_SLOPE_DOT * dots)
    flat_m = height_m / np.tan(seen_rad)
    curved_m = flat_m**2 / (2.0 * SEMI_MAJOR_M)
    return np.asarray((height_m - curved_m) / np.tan(seen_rad) - origin_m)


def _distance_of(positions: Positions, runway: RunwayUsed) -> FloatArray:
    return along_and_across(positions.latitude_deg, positions.longitude_deg, runway)[0]


def _at_the_threshold(
    distance_m: FloatArray, apart_m: FloatArray, settings: LandingSettings
) -> tuple[float, float, float]:
    """Continue the difference to the threshold: value, sigma, and share of the distance.

    The share has a prior of mean zero.
    """
    design = np.stack([np.ones(len(distance_m)), distance_m], axis=1)
    prior = np.diag([0.0, 1.0 / settings.distance_scale_sigma**2])
    noise_m = 1.0
    for _ in range(3):  # the prior counts against a scatter that is not known before
        normal = np.linalg.inv(design.T @ design / noise_m**2 + prior)
        state = normal @ (design.T @ apart_m / noise_m**2)
        rest_m = apart_m - design @ state
        noise_m = max(math.sqrt(SAMPLES_ALIKE * float(rest_m @ rest_m) / (len(apart_m) - 2)), 1.0)
    return float(state[0]), float(np.sqrt(normal[0, 0])), float(state[1])


def _rounding_along_m(positions: Positions, runway: RunwayUsed, settings: LandingSettings) -> float:
    """Return the sigma along the course of a shift by truncation, where nobody tells of it."""
    if settings.positions_rounded != "unknown":
        return 0.0
    course_rad = math.radians(runway.true_course_deg)
    north_m = math.radians(positions.step_deg[0]) * MEAN_RADIUS_M
    east_m = math.radians(positions.step_deg[1]) * MEAN_RADIUS_M * math.cos(math.radians(runway.latitude_deg))
    whole_m = abs(north_m * math.cos(course_rad)) + abs(east_m * math.sin(course_rad))
    return 0.5 * whole_m / math.sqrt(2.0)
