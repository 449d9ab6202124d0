"""Choice of the runway of a final from the table of runways.

Each direction on the course flown is judged by where the approach ended: across, it lies off the centre line by the
error of the positions and of the table; along, behind the threshold by where aircraft touch down. The errors have long
tails (a Cauchy law in the plane): an INS may be off by a kilometre. Against all of them stands a runway that the table
does not have, which lies anywhere near.
"""

import math

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import METRES_PER_DEG, north_east_m
from groundstation.base.runways.table import RunwayDirection, RunwayTable
from groundstation.systems.landing.path import FlightPath, step_of
from groundstation.systems.landing.runway_answer import RunwayCandidate, RunwayChoice
from groundstation.systems.landing.settings import LandingSettings

SURE = 0.95  # probability from which on a runway is decided
UNLIKELY = 0.05  # probability below which a candidate is not named
# Share of the runways landed on that the table has: of published ones in the UK 258 of 334
# (benchmarks/runways_against_published.py); with an approach aid nearly all, a guess.
LISTED_SHARE, LISTED_SHARE_GUIDED = 0.75, 0.97
CLOSED_ODDS = 0.05  # of a runway that the table has as closed, or of a lane on water, against one in use
TOUCHDOWN_M, TOUCHDOWN_SIGMA_M = 400.0, 300.0  # behind the threshold
TOUCHDOWN_SHARE = 0.25  # of a short runway
HEIGHT_SHARE = 0.3  # sigma of the distance that a height on the glide path stands for
COURSE_SIGMA_DEG = 1.5  # of the course flown near the end
NEAREST_M = 20_000.0  # within which the nearest runway is named where none fits
MOST_NAMED = 4


@dataclass(frozen=True, eq=False)
class ChosenRunway:
    """Outcome of the search: the runway that was decided on, and what is told of it."""

    runway: RunwayDirection | None
    choice: RunwayChoice


@dataclass(frozen=True)
class EndOfApproach:
    """Place, course and height in which an approach ended, and the scale of its errors.

    ``height_m`` is None on the ground.
    """

    latitude_deg: float
    longitude_deg: float
    course_deg: float
    height_m: float | None
    error_scale_m: float
    is_guided: bool = False


def end_of_approach(
    path: FlightPath, row: int, course_deg: float, settings: LandingSettings, *, lands: bool, is_guided: bool
) -> EndOfApproach:
    """Return the end of an approach at a row of the path."""
    is_receiver = path.position_topic.startswith("gnss")
    scale_m = settings.gnss_position_scale_m if is_receiver else settings.ins_position_scale_m
    step_m = METRES_PER_DEG * step_of(path.latitude_deg)
    height_m = float(path.altitude_m[row]) if not lands and path.is_above_airfield else None
    return EndOfApproach(
        float(path.latitude_deg[row]),
        float(path.longitude_deg[row]),
        course_deg,
        height_m if height_m is None or math.isfinite(height_m) else None,
        math.hypot(scale_m, step_m),
        is_guided,
    )


def choose_runway(end: EndOfApproach, table: RunwayTable, settings: LandingSettings) -> ChosenRunway:
    """Choose the runway that an approach led to.

    Parameters
    ----------
    end : EndOfApproach
    table : RunwayTable
    settings : LandingSettings
        ``runway_reach_m`` and ``course_tolerance_deg`` bound the search.
    """
    before_m = _before_threshold_m(end, settings)
    within_m = settings.runway_reach_m + before_m
    near = table.near(end.latitude_deg, end.longitude_deg, within_m, end.course_deg, settings.course_tolerance_deg)
    weighed = [found for one in near if (found := _weighed(end, one, before_m, settings)) is not None]
    listed = LISTED_SHARE_GUIDED if end.is_guided else LISTED_SHARE
    unlisted = (1.0 / listed - 1.0) / (math.pi * settings.runway_reach_m**2)
    total = unlisted + sum(weight for weight, _one, _place in weighed)
    ranked = sorted(weighed, key=lambda item: (-item[0], item[1].full_name))
    candidates = tuple(
        RunwayCandidate(
            name=one.full_name,
            probability=weight / total,
            across_m=across_m,
            past_threshold_m=past_m,
            course_difference_deg=float(wrap_180(end.course_deg - one.true_course_deg)),
            is_closed=one.is_closed,
        )
        for weight, one, (past_m, across_m) in ranked[:MOST_NAMED]
        if weight / total >= UNLIKELY
    )
    if candidates and candidates[0].probability >= SURE:
        return ChosenRunway(ranked[0][1], RunwayChoice(table=table.version, state="decided", candidates=candidates))
    if not candidates or sum(one.probability for one in candidates) < 0.5:
        reason = _none_told(end, table, within_m, settings)
        return ChosenRunway(None, RunwayChoice(table=table.version, state="none", reason=reason))
    reason = "the positions do not tell them apart" if len(candidates) > 1 else "it may be one that the table lacks"
    choice = RunwayChoice(table=table.version, state="not decided", reason=reason, candidates=candidates)
    return ChosenRunway(None, choice)


def named(choice: RunwayChoice) -> str:
    """Return the runways that an approach may have led to, joined by "or"."""
    names = [one.name for one in choice.candidates]
    airports = {name.split(" ")[0] for name in names}
    if len(airports) == 1:
        names = [names[0], *(name.partition(" ")[2] for name in names[1:])]
    return " or ".join(names)


def _before_threshold_m(end: EndOfApproach, settings: LandingSettings) -> float:
    """Return how far before the threshold an approach ended that did not touch down."""
    if end.height_m is None:
        return 0.0
    above_m = max(end.height_m - settings.threshold_crossing_height_m, 0.0)
    return above_m / math.tan(math.radians(settings.glide_angle_deg))


def _weighed(
    end: EndOfApproach, one: RunwayDirection, before_m: float, settings: LandingSettings
) -> tuple[float, RunwayDirection, tuple[float, float]] | None:
    """Return the density of an end for a runway, and its place there: behind, right.

    None where it lies too far aside.
    """
    north, east = north_east_m(end.latitude_deg, end.longitude_deg, one.latitude_deg, one.longitude_deg)
    course_rad = np.deg2rad(one.true_course_deg)
    past_m = float(north * np.cos(course_rad) + east * np.sin(course_rad))
    across_m = float(east * np.cos(course_rad) - north * np.sin(course_rad))
    if abs(across_m) > settings.runway_reach_m:
        return None
    expected_m, spread_m = min(TOUCHDOWN_M, TOUCHDOWN_SHARE * one.landing_length_m), TOUCHDOWN_SIGMA_M
    if end.height_m is not None:
        expected_m, spread_m = -before_m, math.hypot(TOUCHDOWN_SIGMA_M, HEIGHT_SHARE * before_m)
    along_sigma_m = math.hypot(end.error_scale_m, one.along_sigma_m, spread_m)
    across_sigma_m = math.hypot(end.error_scale_m, one.across_sigma_m)
    course_sigma_deg = math.hypot(one.course_sigma_deg, COURSE_SIGMA_DEG)
    turned = float(wrap_180(end.course_deg - one.true_course_deg)) / course_sigma_deg
    far = (across_m / across_sigma_m) ** 2 + ((past_m - expected_m) / along_sigma_m) ** 2
    density = (1.0 + far) ** -1.5 / (2.0 * math.pi * along_sigma_m * across_sigma_m) / (1.0 + turned**2)
    odds = CLOSED_ODDS if one.is_closed or one.is_water else 1.0
    return odds * density, one, (past_m, across_m)


def _none_told(end: EndOfApproach, table: RunwayTable, within_m: float, settings: LandingSettings) -> str:
    """Return why no runway fits, with the nearest one."""
    reason = f"none within {within_m / 1000.0:.1f} km on a course of {end.course_deg:.0f} deg"
    near = table.near(end.latitude_deg, end.longitude_deg, NEAREST_M)
    if not near:
        return f"{reason}, and none of any course within {NEAREST_M / 1000.0:.0f} km"
    nearest = min(near, key=lambda one: abs(float(wrap_180(end.course_deg - one.true_course_deg))))
    if abs(float(wrap_180(end.course_deg - nearest.true_course_deg))) > settings.course_tolerance_deg:
        nearest = near[0]
    away_m = nearest.distance_m(end.latitude_deg, end.longitude_deg)
    return f"{reason}; {nearest.full_name}, on {nearest.true_course_deg:.0f} deg, is {away_m / 1000.0:.1f} km off"
