"""Search for the finals of a flight: straight to a touchdown, or down and up on guidance."""

from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import METRES_PER_DEG, north_east_m
from groundstation.base.runways.table import RunwayTable
from groundstation.systems.known import Runway, SiteData
from groundstation.systems.landing.answer import LeftOutApproach, Outcome
from groundstation.systems.landing.evidence import SLOWEST_MPS, Evidence
from groundstation.systems.landing.path import FlightPath, on_guidance, step_of
from groundstation.systems.landing.runway_choice import ChosenRunway, choose_runway, end_of_approach
from groundstation.systems.landing.settings import LandingSettings

if TYPE_CHECKING:
    from groundstation.tables.phases import Phases

CHORD_S, LONGEST_CHORD_S = 12.0, 40.0  # over which a direction is taken
STEPS_OF_A_CHORD = 12.0  # of the positions, where they are written in coarse ones
GROUND_M, FLOWN_M = 1.0, 100.0  # of a height that counts from the airfield: on the ground below, in flight above
PHASES_SIGMA_S = 3.0  # of a touchdown that phases alone show: 5.3 s early on a rising runway, 1.9 s late by a switch
ON_LANDING = ("landing roll", "take-off run", "taxi", "on the ground", "standstill")  # phases right behind a flight
LONGEST_ROLL_S = 60.0  # of a touch-and-go
AFTER_S = 60.0  # a landing so soon after the lowest point of a descent belongs to it
CLIMB_S = 240.0
NEAR_M = 2_000.0  # from the end, within which the course is taken


@dataclass(frozen=True)
class End:
    """End of an approach: a touchdown or the lowest point before a climb.

    ``until_s`` is when the aircraft flies again, ``evidence`` what shows the touchdown.
    """

    time_s: float
    outcome: Outcome
    found_by: str
    sigma_s: float
    until_s: float = np.inf
    evidence: Evidence | None = None

    @property
    def touches(self) -> bool:
        """Tell whether the wheels meet the ground."""
        return self.outcome != "go-around"

    def ground_m(self, altitude_source: str) -> float | None:
        """Ground at the touchdown as an altitude shows it, by the line through its roll-out.

        None where it has none.
        """
        for heights, ground in () if self.evidence is None else self.evidence.heights:
            if ground is not None and f"{heights.topic}.{heights.kind.field}" == altitude_source:
                along_m = np.interp([self.time_s], heights.time_s, heights.along_m)
                return float(ground.height_m(along_m)[0])
        return None


@dataclass(frozen=True, eq=False)
class Final:
    """Samples [first, last) of a straight final.

    ``guided`` are the rows of it on the guidance, ``course_deg`` is its course so far. ``runway`` is that of the site
    file, ``chosen`` what the table of runways says where the site file has none.
    """

    end: End
    first: int
    last: int
    guided: slice | None
    course_deg: float
    runway: Runway | None
    chosen: ChosenRunway | None = None


def ends_of(path: FlightPath, phases: "Phases", settings: LandingSettings) -> tuple[End, ...]:
    """Touchdowns and go-arounds in order of time."""
    landings = _landings(path, phases)
    found = list(landings)
    for first, last in on_guidance(path.time_s, path.lateral_dots, path.vertical_dots, settings):
        low = _lowest(path, first, last, settings)
        if low is not None and all(abs(one.time_s - path.time_s[low]) > AFTER_S for one in landings):
            found.append(End(float(path.time_s[low]), "go-around", "lowest height before the climb", 1.0))
    return tuple(sorted(found, key=lambda one: one.time_s))


def _landings(path: FlightPath, phases: "Phases") -> tuple[End, ...]:
    method = phases.method.partition(":")[0]
    found = []
    for row, before in enumerate(phases.intervals[:-1]):
        after = phases.intervals[row + 1 :]
        if before.phase == "airborne" and after[0].phase in ON_LANDING:
            again = next((one.start_s for one in after if one.phase == "airborne"), np.inf)
            outcome: Outcome = "touch-and-go" if _rolls_on(path, before.end_s, again) else "landing"
            found.append(End(before.end_s, outcome, method, PHASES_SIGMA_S, again))
    if found or not path.is_above_airfield or any(one.phase == "airborne" for one in phases.intervals):
        return tuple(found)
    height = np.where(np.isfinite(path.altitude_m), path.altitude_m, np.inf)
    is_high = False
    for row in range(1, len(height)):
        is_high |= bool(np.isfinite(height[row]) and height[row] > FLOWN_M)
        if is_high and height[row] < GROUND_M:
            found.append(End(float(path.time_s[row]), "landing", f"{path.altitude_source} below {GROUND_M:g} m", 2.0))
            is_high = False
    return tuple(found)


def _rolls_on(path: FlightPath, down_s: float, again_s: float) -> bool:
    """Tell whether the aircraft flies again without having become slow."""
    rows = (path.time_s >= down_s) & (path.time_s <= again_s)
    speed = path.ground_speed_mps[rows]
    speed = speed[np.isfinite(speed)]
    return bool(again_s - down_s <= LONGEST_ROLL_S and speed.size and np.min(speed) > 2.0 * SLOWEST_MPS)


def _lowest(path: FlightPath, first: int, last: int, settings: LandingSettings) -> int | None:
    """Row of the lowest point that a climb follows, None where there is none low enough."""
    behind = int(np.searchsorted(path.time_s, path.time_s[last - 1] + AFTER_S))
    height = path.altitude_m[first:behind]
    if not np.isfinite(height).any():
        return None
    low = first + int(np.nanargmin(height))
    until = int(np.searchsorted(path.time_s, path.time_s[low] + CLIMB_S))
    after = path.altitude_m[low:until]
    climbs = np.isfinite(after).any() and np.nanmax(after) - path.altitude_m[low] >= settings.go_around_climb_min_m
    is_low = path.is_above_airfield and path.altitude_m[low] <= settings.go_around_height_max_m
    flies = path.ground_speed_mps[low] >= settings.speed_min_mps
    return low if climbs and is_low and flies else None


def final_of(
    path: FlightPath, end: End, site: SiteData, settings: LandingSettings, table: RunwayTable | None = None
) -> Final | LeftOutApproach:
    """The straight final that leads to an end, or why it is none."""
    last = int(np.searchsorted(path.time_s, end.time_s, side="right"))
    if last < 3 or end.time_s - path.time_s[last - 1] > AFTER_S:
        return LeftOutApproach(end.time_s, "no positions before its end")
    from_end_m = np.hypot(*path.position_m(path.latitude_deg[last - 1], path.longitude_deg[last - 1])[:last].T)
    far = np.flatnonzero(from_end_m > settings.final_max_m)
    earliest = int(far[-1]) + 1 if far.size else 0
    track_deg = _track(path, earliest, last)
    beyond = np.flatnonzero(from_end_m[earliest:] >= max(settings.final_min_m, NEAR_M))
    near = (np.arange(len(track_deg)) > (beyond[-1] if beyond.size else -1)) & np.isfinite(track_deg)
    if not near.any():
        return LeftOutApproach(end.time_s, "no direction of flight before its end")
    rough_deg = _median_direction(track_deg[near][-max(int(near.sum() // 2), 1) :])
    runway = _runway(path, last - 1, rough_deg, site, settings)
    chosen = None
    if runway is None and table is not None:
        is_guided = _longest_on_guidance(path, earliest, last, settings) is not None
        lands = end.touches
        ended = end_of_approach(path, last - 1, rough_deg, settings, lands=lands, is_guided=is_guided)
        chosen = choose_runway(ended, table, settings)
    found = None if chosen is None or chosen.runway is None else chosen.runway.true_course_deg
    course_deg = runway.true_bearing_deg if runway is not None else rough_deg if found is None else found
    away = np.abs(wrap_180(track_deg - course_deg)) > settings.course_tolerance_deg
    turned = np.flatnonzero(away | ~np.isfinite(track_deg))
    turned = turned[from_end_m[earliest + turned] > 0.3 * settings.final_min_m]  # the last metres may turn off
    first = earliest + (int(turned[-1]) + 1 if turned.size else 0)
    reason = _too_short(path, first, last, from_end_m, end, settings)
    if reason:
        return LeftOutApproach(end.time_s, reason)
    guided = _longest_on_guidance(path, first, last, settings)
    return Final(end, first, last, guided, course_deg, runway, chosen)


def _track(path: FlightPath, first: int, last: int) -> FloatArray:
    """Direction of motion by chords, degrees, shape (last - first,), NaN where slow."""
    time_s = path.time_s[first:last]
    place = path.position_m(path.latitude_deg[last - 1], path.longitude_deg[last - 1])[first:last]
    half_s = 0.5 * _chord_s(path)
    after, before = np.minimum(time_s + half_s, time_s[-1]), np.maximum(time_s - half_s, time_s[0])
    north, east = (np.interp(after, time_s, one) - np.interp(before, time_s, one) for one in place.T)
    is_moving = np.hypot(north, east) > 3.0 * (after - before)
    return np.where(is_moving, direction_of(north, east), np.nan)


def _chord_s(path: FlightPath) -> float:
    """Return the length of a chord (s) whose direction is known to some degrees."""
    step_m = METRES_PER_DEG * step_of(path.latitude_deg)
    fast = path.ground_speed_mps[path.ground_speed_mps > 1.0]
    return float(np.clip(STEPS_OF_A_CHORD * step_m / (np.median(fast) if fast.size else 1.0), CHORD_S, LONGEST_CHORD_S))


def _median_direction(track_deg: FloatArray) -> float:
    some = track_deg[len(track_deg) // 2]
    return float((some + np.median(wrap_180(track_deg - some))) % 360.0)


def _runway(path: FlightPath, row: int, track_deg: float, site: SiteData, settings: LandingSettings) -> Runway | None:
    """Return the runway of the site file that the final leads to.

    Of several it is the runway whose threshold the line of the final passes nearest.
    """
    best: tuple[float, Runway] | None = None
    for runway in site.runways:
        if abs(float(wrap_180(track_deg - runway.true_bearing_deg))) > settings.course_tolerance_deg:
            continue
        if runway.latitude_deg is None or runway.longitude_deg is None:
            continue
        north, east = north_east_m(
            path.latitude_deg[row], path.longitude_deg[row], runway.latitude_deg, runway.longitude_deg
        )
        course_rad = np.deg2rad(runway.true_bearing_deg)
        aside = abs(float(east * np.cos(course_rad) - north * np.sin(course_rad)))
        if aside <= settings.runway_reach_m and np.hypot(north, east) <= 2.0 * settings.final_max_m:
            best = (aside, runway) if best is None or aside < best[0] else best
    return None if best is None else best[1]


def _too_short(
    path: FlightPath, first: int, last: int, from_end_m: FloatArray, end: End, settings: LandingSettings
) -> str:
    """Return why a straight part before an end is no final; empty where it is one."""
    if last - first < 3:
        return "no straight flight before its end"
    length_m = float(from_end_m[first])
    if length_m < settings.final_min_m:
        return f"straight for {length_m:.0f} m before its end, less than {settings.final_min_m:.0f} m"
    fast = np.nanmax(path.ground_speed_mps[first:last]) if np.isfinite(path.ground_speed_mps[first:last]).any() else 0.0
    if fast < settings.speed_min_mps:
        return f"flown at {fast:.0f} m/s at most, less than {settings.speed_min_mps:.0f}"
    height = path.altitude_m[first:last]
    if np.isfinite(height).any() and np.nanmax(height) - np.nanmin(height) < settings.final_height_min_m:
        return f"a descent of only {np.nanmax(height) - np.nanmin(height):.0f} m"
    return ""


def _longest_on_guidance(path: FlightPath, first: int, last: int, settings: LandingSettings) -> slice | None:
    """Rows of the longest stretch of a final that was on the guidance."""
    rows = slice(first, last)
    found = on_guidance(path.time_s[rows], path.lateral_dots[rows], path.vertical_dots[rows], settings)
    fast = [
        (first + low, first + high)
        for low, high in found
        if np.isfinite(speed := path.ground_speed_mps[first + low : first + high]).any()
        and np.nanmedian(speed) >= settings.speed_min_mps
    ]
    longest = max(fast, key=lambda one: path.time_s[one[1] - 1] - path.time_s[one[0]], default=None)
    return None if longest is None else slice(*longest)
