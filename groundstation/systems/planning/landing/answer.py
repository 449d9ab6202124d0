"""Answer of landing by ranges: accuracy along the approach against categories.

It also tells how honest that accuracy is.
"""

from dataclasses import field
from typing import ClassVar

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import PlanAnswer
from groundstation.results.figures import FigureData

TOUCHDOWN = "touchdown"  # place of the last row
ALL_AXES = "horizontal and vertical"  # axis of a span
HONEST, WHITE = "models_correlation", "takes_it_for_white"  # filters of the trials


@dataclass(frozen=True)
class ReferencePointRow:
    """One reference point; a moving one at the start of the approach."""

    name: str  #: Point as the scenario names it.
    is_moving: bool  #: Whether it moves.
    before_threshold_m: float  #: Place before the threshold.
    right_m: float  #: Place right of the course.
    up_m: float  #: Place above the threshold.


@dataclass(frozen=True)
class AccuracyRow:
    """Accuracy at one place of the path.

    Parameters
    ----------
    place : str
    before_threshold_m, height_m : float
        Distance before the threshold, negative beyond it, and height above it.
    sigma_along_m, sigma_right_m, sigma_up_m : float
        One sigma.
    lateral_95_m, vertical_95_m : float
        1.96 sigma of one axis.
    horizontal_95_m : float
        Radius that holds 95 %.
    category : str
        The most demanding one whose horizontal and vertical accuracy are met; empty: none.
    lateral_category, vertical_category : str
        The same of one axis alone.
    """

    place: str  #: Name of the place.
    before_threshold_m: float  #: Distance before the threshold, negative behind it.
    height_m: float  #: Height above the threshold.
    sigma_along_m: float  #: One sigma along the course.
    sigma_right_m: float  #: One sigma across the course.
    sigma_up_m: float  #: One sigma of height.
    lateral_95_m: float  #: 1.96 sigma across the course.
    horizontal_95_m: float
    vertical_95_m: float  #: 1.96 sigma of height.
    category: str
    lateral_category: str  #: Most demanding category whose lateral accuracy is met; empty: none.
    vertical_category: str  #: Most demanding category whose vertical accuracy is met; empty: none.


@dataclass(frozen=True)
class CategorySpan:
    """Stretch of the path on which a category's accuracy is met.

    It is met in all, or along one axis alone.
    """

    category: str  #: Name of the category.
    axis: str  #: lateral or vertical where one axis alone is meant.
    from_before_threshold_m: float  #: Distance before the threshold where it begins.
    to_before_threshold_m: float  #: Distance before the threshold where it ends.


@dataclass(frozen=True)
class TrialRow:
    """Errors of simulated approaches at one place against what the filter computes.

    Parameters
    ----------
    filter : str
        ``models_correlation`` or ``takes_it_for_white``.
    nees, nees_low, nees_high : float
        Mean normalised squared error of the place (3 is honest) and the 95 % limits of that many independent trials.
    rms_along_m, rms_right_m, rms_up_m : float
        Over the trials.
    overconfidence_right, overconfidence_up : float
        RMS error over the computed sigma; 1 is honest.
    is_consistent : bool
        NEES inside its limits.
    """

    filter: str
    before_threshold_m: float  #: Distance before the threshold.
    nees: float  #: Mean normalised squared error of the place; 3 is honest.
    nees_low: float  #: Lower 95 % limit of NEES by the trials.
    nees_high: float  #: Upper 95 % limit of NEES by the trials.
    rms_along_m: float  #: RMS error along the course.
    rms_right_m: float  #: RMS error across the course.
    rms_up_m: float  #: RMS error of height.
    overconfidence_right: float  #: RMS error over computed sigma across the course; 1 is honest.
    overconfidence_up: float  #: RMS error over computed sigma of height; 1 is honest.
    is_consistent: bool


@dataclass(frozen=True)
class RangeLanding(PlanAnswer):
    """Landing by ranges to reference points.

    Parameters
    ----------
    points, rows, spans, trials : tuples
        Tables; see the rows. ``rows`` are places that matter, ``spans`` the stretches where a category is met.
    least_along_m, least_right_m, least_up_m : float
        Smallest sigmas anywhere on the path.
    trial_count : int
    remarks : tuple of str
    settings : dict
    figures : tuple of FigureData
        ``landing_ranges_path`` (time_s, before_threshold_m, height_m, sigmas, 95 % figures, measure),
        ``landing_ranges_space`` (time_s, name, along_m, right_m, up_m, speed_mps of the moving point),
        ``landing_ranges_errors`` (time_s, trial, errors and sigmas of each trial).
    """

    analysis: ClassVar[str] = "landing_ranges"

    title: str  #: Name of the scenario.
    points: tuple[ReferencePointRow, ...]  #: Reference points.
    rows: tuple[AccuracyRow, ...]  #: Accuracy at places that matter.
    spans: tuple[CategorySpan, ...]  #: Stretches where a category's accuracy is met.
    least_along_m: float  #: Least sigma along the course anywhere on the path.
    least_right_m: float  #: Least sigma across the course anywhere on the path.
    least_up_m: float  #: Least sigma of height anywhere on the path.
    trials: tuple[TrialRow, ...] = ()  #: Simulated approaches against the computed sigmas.
    trial_count: int = 0  #: Number of simulated approaches.
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    def at(self, place: str) -> AccuracyRow:
        """The row of a place."""
        return next(row for row in self.rows if row.place == place)
