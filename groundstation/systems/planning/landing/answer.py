"""Answer of landing by ranges: accuracy along the approach against categories.

It also tells how honest that accuracy is.
"""

from dataclasses import dataclass, field
from typing import ClassVar

from groundstation.results.answer import PlanAnswer
from groundstation.results.figures import FigureData

TOUCHDOWN = "touchdown"  # place of the last row
ALL_AXES = "horizontal and vertical"  # axis of a span
HONEST, WHITE = "models_correlation", "takes_it_for_white"  # filters of the trials


@dataclass(frozen=True)
class ReferencePointRow:
    """One reference point; a moving one at the start of the approach."""

    name: str
    is_moving: bool
    before_threshold_m: float
    right_m: float
    up_m: float


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

    place: str
    before_threshold_m: float
    height_m: float
    sigma_along_m: float
    sigma_right_m: float
    sigma_up_m: float
    lateral_95_m: float
    horizontal_95_m: float
    vertical_95_m: float
    category: str
    lateral_category: str
    vertical_category: str


@dataclass(frozen=True)
class CategorySpan:
    """Stretch of the path on which a category's accuracy is met.

    It is met in all, or along one axis alone.
    """

    category: str
    axis: str
    from_before_threshold_m: float
    to_before_threshold_m: float


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
    before_threshold_m: float
    nees: float
    nees_low: float
    nees_high: float
    rms_along_m: float
    rms_right_m: float
    rms_up_m: float
    overconfidence_right: float
    overconfidence_up: float
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

    title: str
    points: tuple[ReferencePointRow, ...]
    rows: tuple[AccuracyRow, ...]
    spans: tuple[CategorySpan, ...]
    least_along_m: float
    least_right_m: float
    least_up_m: float
    trials: tuple[TrialRow, ...] = ()
    trial_count: int = 0
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    def at(self, place: str) -> AccuracyRow:
        """The row of a place."""
        return next(row for row in self.rows if row.place == place)
