"""One approach by bearings: places along it, deviations with sigmas, plausibility checks."""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, mean_heading, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, frozen
from groundstation.methods.bearings import BearingFix, solve_bearings
from groundstation.systems.known import Runway
from groundstation.systems.landing.beacons.settings import LandingBeaconsSettings

WELL_KNOWN_M = 300.0  # sigma of a distance that may say something about the speed
LEAST_FIXES = 10
GRADIENT_M = 1.0
END_S = 2.0  # of an approach, over which the ground counts as that of the threshold


@dataclass(frozen=True)
class Sampled:
    """Signals at the times of one direction finder, shape (n,); bearings (n, k).

    NaN where there is nothing.
    """

    time_s: FloatArray
    bearings_deg: FloatArray
    height_m: FloatArray
    is_airborne: BoolArray
    altitude_m: FloatArray
    ground_speed_mps: FloatArray
    heading_deg: FloatArray

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def part(self, index: slice) -> "Sampled":
        """The epochs of a slice."""
        return Sampled(**{name: getattr(self, name)[index] for name in self.__dataclass_fields__})


@dataclass(frozen=True)
class Deviations:
    """Deviations along one approach, shape (n,), NaN where there is no place.

    ``glide_path_sigma_m`` holds the errors of radio altitude and of the distance alone, not the terrain.
    """

    fix: BearingFix
    glide_path_m: FloatArray
    lateral_sigma_m: FloatArray
    distance_sigma_m: FloatArray
    glide_path_sigma_m: FloatArray

    def __post_init__(self) -> None:
        for name in ("glide_path_m", "lateral_sigma_m", "distance_sigma_m", "glide_path_sigma_m"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def before_m(self) -> FloatArray:
        """Distance before the threshold."""
        return np.asarray(-self.fix.along_m)

    @property
    def found(self) -> BoolArray:
        """Samples that have a place."""
        return np.asarray(np.isfinite(self.fix.along_m))


def approaches_in(sampled: Sampled, settings: LandingBeaconsSettings) -> list[slice]:
    """Stretches of low flight with all bearings, long enough."""
    low = sampled.is_airborne & (sampled.height_m <= settings.highest_m)
    rows = np.flatnonzero(low & np.isfinite(sampled.bearings_deg).all(axis=1))
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(sampled.time_s[rows]) > 5.0 * settings.largest_gap_s)
    firsts, lasts = np.append(rows[0], rows[breaks + 1]), np.append(rows[breaks], rows[-1])
    spans = [slice(int(first), int(last) + 1) for first, last in zip(firsts, lasts, strict=True)]
    return [one for one in spans if np.ptp(sampled.time_s[one]) >= settings.shortest_s]


def deviations(sampled: Sampled, beacons_m: FloatArray, runway: Runway, settings: LandingBeaconsSettings) -> Deviations:
    """Deviations of one approach.

    Parameters
    ----------
    sampled : Sampled
    beacons_m : ndarray, shape (k, 2)
        Along and right of the beacons.
    runway : Runway
    settings : LandingBeaconsSettings

    Notes
    -----
    Above the glide path = radio altitude + ground - (threshold crossing height + distance tan(glide angle)). Bearings
    of a beacon overhead are left out, and with fewer than three there is no place.
    """
    fix = solve_bearings(sampled.bearings_deg, beacons_m, settings.bearing_sigma_deg)
    place = np.column_stack([fix.along_m, fix.right_m])
    reach = np.linalg.norm(place[:, None, :] - beacons_m, axis=2)
    overhead = reach < settings.silence_ratio * sampled.height_m[:, None]
    fix = solve_bearings(
        np.where(overhead, np.nan, sampled.bearings_deg), beacons_m, settings.bearing_sigma_deg
    )  # where a beacon is overhead nothing is found
    slope = float(np.tan(np.deg2rad(runway.glide_angle_deg)))
    ground = ground_m(-fix.along_m, runway)
    glide = sampled.height_m + ground - (runway.threshold_crossing_height_m - fix.along_m * slope)
    along_sigma, right_sigma = (np.sqrt(fix.covariance[:, axis, axis]) for axis in (0, 1))
    rise = (ground_m(GRADIENT_M - fix.along_m, runway) - ground) / GRADIENT_M
    by_distance = np.abs(slope - np.nan_to_num(rise)) * along_sigma
    return Deviations(fix, glide, right_sigma, along_sigma, np.hypot(settings.height_sigma_m, by_distance))


def ground_m(before_m: FloatArray, runway: Runway) -> FloatArray:
    """Return the height of the ground above the threshold by the profile of the site file.

    Level without a profile, NaN beyond its ends.

    Examples
    --------
    >>> from groundstation.systems.known import Ground
    >>> hill = Runway("09", 90.0, ground=(Ground(0.0, 0.0), Ground(2000.0, 40.0)))
    >>> ground_m(np.array([500.0, 3000.0]), hill).tolist()
    [10.0, nan]
    """
    if not runway.ground:
        return np.zeros(len(before_m))
    places, heights = zip(*((one.before_threshold_m, one.height_m) for one in runway.ground), strict=True)
    return np.asarray(np.interp(before_m, places, heights, left=np.nan, right=np.nan))


def unknown_rise_m(sampled: Sampled, told: "PlaceEvidence", runway: Runway) -> FloatArray:
    """Return the rise of the ground above that under the approach's end, less the profile.

    NaN where no altitude tells it. Altitude less radio altitude is the ground; what altitude errs by for the whole
    approach drops out. The distance is that of a straight flight: single ones err too much.
    """
    ground = sampled.altitude_m - sampled.height_m
    if runway.ground and np.isfinite(told.threshold_s):
        ground = ground - ground_m(told.speed_mps * (told.threshold_s - sampled.time_s), runway)
    known = np.isfinite(ground)
    if not known.any():
        return np.asarray(ground)
    end = known & (sampled.time_s >= sampled.time_s[known][-1] - END_S)
    return np.asarray(ground - np.median(ground[end]))


def over_known_ground(found: Deviations, rise_m: FloatArray, most_m: float) -> Deviations:
    """Drop the glide path deviations over ground that rises or falls by more than ``most_m``.

    Deviations over ground whose rise is unknown, beyond the ends of the profile, go too, where an altitude tells the
    rise of the rest.

    """
    is_kept = (np.abs(rise_m) <= most_m) | ~np.isfinite(rise_m).any()
    return replace(found, glide_path_m=np.where(is_kept, found.glide_path_m, np.nan))


@dataclass(frozen=True)
class PlaceEvidence:
    """Evidence for or against the places of one approach; NaN where the log does not say.

    ``threshold_s`` is when the straight flight that ``speed_mps`` belongs to crosses the threshold.
    """

    speed_mps: float
    threshold_s: float
    ground_speed_mps: float
    heading_difference_deg: float
    terrain_m: float


def belief(sampled: Sampled, found: Deviations, runway: Runway) -> PlaceEvidence:
    """Return the speed at which the distance shrinks, and what else speaks for the places.

    The heading speaks by that of the INS, and the ground under the approach.
    """
    good = found.found & (found.distance_sigma_m < WELL_KNOWN_M)
    speed = threshold_s = float("nan")
    if good.sum() >= LEAST_FIXES:
        weight = 1.0 / found.distance_sigma_m[good]
        speed, offset_m = (
            float(part) for part in np.polyfit(sampled.time_s[good], found.fix.along_m[good], 1, w=weight)
        )
        threshold_s = -offset_m / speed if speed else float("nan")
    heading = wrap_360(runway.true_bearing_deg + found.fix.off_course_deg)
    difference = wrap_180(heading - sampled.heading_deg)
    known = np.isfinite(difference)
    middle = float(wrap_180(mean_heading(difference[known]))) if known.any() else float("nan")
    known_speed = sampled.ground_speed_mps[np.isfinite(sampled.ground_speed_mps)]
    median_mps = float(np.median(known_speed)) if len(known_speed) else float("nan")
    told = PlaceEvidence(speed, threshold_s, median_mps, middle, float("nan"))
    rise = unknown_rise_m(sampled, told, runway)
    rise = rise[np.isfinite(rise)]
    return replace(told, terrain_m=float(np.ptp(np.quantile(rise, [0.02, 0.98]))) if len(rise) else float("nan"))
