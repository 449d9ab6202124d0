"""Answer of landing by locators: deviations from course and glide path.

The deviations come from relative bearings and radio altitude.
"""

from dataclasses import field
from typing import ClassVar

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData


@dataclass(frozen=True)
class BeaconRow:
    """Beacon: its place, and how many bearings of it were used."""

    name: str  #: Beacon as the site file names it.
    before_threshold_m: float  #: Place before the threshold.
    right_m: float  #: Place right of the course.
    bearings: int  #: Bearings used.


@dataclass(frozen=True)
class BeaconApproachRow:
    """One approach.

    Parameters
    ----------
    approach : int
        From 1.
    start_s, end_s : float
        Flight seconds.
    first_before_threshold_m, last_before_threshold_m : float
        Found at its start and end.
    fixes, blind : int
        Places found; epochs without one (a beacon overhead, or geometry without a solution).
    speed_mps : float
        At which the distance shrinks.
    ground_speed_mps, heading_difference_deg : float or None
        Ground speed of the INS, and heading by the bearings minus its heading: both show whether bearings and beacons
        belong.
    terrain_m : float or None
        Rise and fall of the ground under the approach, by radio altitude against altitude, less the profile of the site
        file.
    """

    approach: int  #: Number of the approach, from 1.
    start_s: float  #: Flight second of its beginning.
    end_s: float  #: Flight second of its end.
    first_before_threshold_m: float  #: Distance before the threshold found at its start.
    last_before_threshold_m: float  #: Distance before the threshold found at its end.
    fixes: int  #: Places found.
    blind: int  #: Epochs without a place.
    speed_mps: float
    ground_speed_mps: float | None  #: Ground speed of the INS.
    heading_difference_deg: float | None  #: Heading by the bearings minus that of the INS.
    terrain_m: float | None


@dataclass(frozen=True)
class DeviationRow:
    """Deviations at one distance: means over a second.

    The 95 % figures are those of a single deviation.

    Parameters
    ----------
    lateral_m, glide_path_m : float
        Right of the course, above the glide path; the latter None over ground that is not known.
    lateral_95_m, glide_path_95_m, distance_95_m : float
        1.96 sigma of one axis, from the errors of bearings and radio altitude.
    lateral_category, vertical_category : str
        The most demanding one whose accuracy that meets; empty: none.
    """

    approach: int  #: Number of the approach, from 1.
    before_threshold_m: float  #: Distance before the threshold.
    distance_95_m: float  #: 95 % of the error of the distance.
    lateral_m: float  #: Right of the course.
    lateral_95_m: float  #: 95 % of the error of lateral_m.
    glide_path_m: float | None  #: Above the glide path; null over ground that is not known.
    glide_path_95_m: float | None  #: 95 % of the error of glide_path_m.
    lateral_category: str  #: Most demanding category whose lateral accuracy is met; empty: none.
    vertical_category: str  #: Most demanding category whose vertical accuracy is met; empty: none.


@dataclass(frozen=True)
class BeaconLanding(Answer):
    """Approaches by two locators and an additional beacon.

    Parameters
    ----------
    runway : str
    bearing_sigma_deg, height_sigma_m : float
        Errors that the figures assume.
    beacons, approaches, rows : tuples
        Tables; see the rows.
    remarks : tuple of str
    settings : dict
    figures : tuple of FigureData
        ``landing_beacons_path`` (time_s, approach, straight_before_threshold_m of a straight flight through all places,
        before_threshold_m, distance_sigma_m, lateral_m, lateral_sigma_m, glide_path_m, glide_path_sigma_m, height_m,
        off_course_deg).
    """

    analysis: ClassVar[str] = "landing_beacons"

    runway: str  #: Runway that the distances are of.
    bearing_sigma_deg: float  #: Error of a bearing that the figures assume.
    height_sigma_m: float  #: Error of the radio altitude that the figures assume.
    beacons: tuple[BeaconRow, ...]  #: Every beacon, and what was used of it.
    approaches: tuple[BeaconApproachRow, ...]  #: Every approach.
    rows: tuple[DeviationRow, ...]  #: Deviations by distance.
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()
