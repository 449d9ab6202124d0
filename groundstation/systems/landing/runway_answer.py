"""Runway that an approach is measured against, and how it was chosen from the table."""

from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.frames import Brief

PlacedBy = Literal["site file", "runway table", "positions"]
ChoiceState = Literal["decided", "not decided", "none"]


@dataclass(frozen=True, kw_only=True)
class RunwayCandidate:
    """A runway of the table that an approach may have led to.

    Parameters
    ----------
    probability : float
        Against the other candidates and a runway that is not in the table.
    across_m, past_threshold_m : float
        Where the approach ended beside its centre line, right positive, and behind its threshold, by the positions.
    course_difference_deg : float
        Course flown minus that of the runway.
    """

    name: str  #: Airport and runway as the table has them.
    probability: float
    across_m: float  #: Where the approach ended beside its centre line, right positive.
    past_threshold_m: float  #: Where the approach ended behind its threshold.
    course_difference_deg: float
    is_closed: bool  #: Closed by the table.


@dataclass(frozen=True, kw_only=True)
class RunwayChoice(Brief):
    """Search of the runway table.

    Parameters
    ----------
    table : str
        Version of the table.
    state : {'decided', 'not decided', 'none'}
        One runway is the likeliest by far; several fit, or one that may as well be another that is not in the table;
        none fits.
    reason : str
        Why none was decided on.
    candidates : tuple of RunwayCandidate
        The likeliest first.
    """

    table: str
    state: ChoiceState
    reason: str = ""
    candidates: tuple[RunwayCandidate, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RunwayUsed(Brief):
    """The runway an approach is measured against.

    Parameters
    ----------
    name : str
        As in the site file or the table; several, joined by "or", where the table does not decide; empty where nothing
        fits.
    placed_by : {'site file', 'runway table', 'positions'}
        Source of threshold and course. By positions: the line through the positions of the final, the threshold where
        ``place_reason`` says.
    true_course_deg, course_sigma_deg : float
    localizer_width_m, localizer_distance_m : float
        Full width of the course sector at the threshold, distance from there to the antenna.
    length_m, landing_length_m, displaced_m : float or None
        From end to end; from the threshold to the far end; from the end to the threshold.
    slope : float or None
        Rise per metre along the landing, by the elevations of both ends.
    along_sigma_m, across_sigma_m : float or None
        Of the threshold, by the table; None where it is not the table's.
    choice : RunwayChoice or None
        What the table says; None where the site file says it, or no table was asked.
    """

    name: str
    placed_by: PlacedBy
    latitude_deg: float  #: Latitude of the threshold.
    longitude_deg: float  #: Longitude of the threshold.
    true_course_deg: float  #: True course of the landing.
    course_sigma_deg: float  #: Standard deviation of the course.
    elevation_m: float | None  #: Height of the threshold above sea level.
    glide_angle_deg: float  #: Angle of the glide path.
    threshold_crossing_height_m: float  #: Height of the glide path above the threshold.
    localizer_width_m: float  #: Full width of the course sector at the threshold.
    localizer_distance_m: float  #: From the threshold to the localizer's antenna.
    length_m: float | None = None  #: From end to end.
    width_m: float | None = None  #: Width of the pavement.
    place_reason: str = ""  #: What the place of the threshold rests on.
    landing_length_m: float | None = None  #: From the threshold to the far end.
    displaced_m: float | None = None  #: From the end of the pavement to the threshold.
    slope: float | None = None
    surface: str = ""  #: Surface as the table names it.
    is_closed: bool = False  #: Closed by the table.
    along_sigma_m: float | None = None  #: Standard deviation of the threshold along the course, by the table.
    across_sigma_m: float | None = None  #: Standard deviation of the threshold across the course, by the table.
    choice: RunwayChoice | None = None

    @property
    def is_surveyed(self) -> bool:
        """Tell whether the runway stands apart from the positions of the flight."""
        return self.placed_by != "positions"
