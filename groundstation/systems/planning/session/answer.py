"""Answer of a planned session: best motion of aircraft, and the accuracy that follows."""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import PlanAnswer
from groundstation.results.figures import FigureData

Horizon = Literal["none", "each step", "end"]
UNCONTROLLED = "uncontrolled"


@dataclass(frozen=True)
class LawRow:
    """One law of control, and its result.

    Parameters
    ----------
    law : str
        ``uncontrolled``, ``determinant``, ``eigenvalue``, ``dop`` or ``covariance``.
    horizon : {'none', 'each step', 'end'}
        Part of the flight that its criterion looks at.
    two_sigma_north_m, two_sigma_east_m, two_sigma_up_m, two_sigma_r_m : float
        At the end, as the centralised filter computes them; r: root of the summed variances north and east.
    determinant, eigenvalue, dop : float
        Figures of H'H at the end, in the axes asked for; dop is NaN where the sources do not tell them apart.
    gram_determinant : float
        Determinant of the mean of H'H over the interval.
    dop_worst : float
        Over the interval.
    least_range_m, least_separation_m : float
        To any source, and between any two aircraft.
    bounded_share : float
        Share of all control values that stand at a bound or change by as much as they may.
    gap : float
        Largest first-order gain that any control within the bounds still has, over the loss; of a local law in its
        worst step.
    has_converged : bool
        Gap below the tolerance.
    iterations, evaluations : int
    starts : int
    start_spread : float
        Largest loss over the least one among the starts, less 1: how much a single start could have missed.
    """

    law: str
    horizon: Horizon
    two_sigma_north_m: float  #: Twice the sigma north at the end.
    two_sigma_east_m: float  #: Twice the sigma east at the end.
    two_sigma_up_m: float  #: Twice the sigma of height at the end.
    two_sigma_r_m: float  #: Twice the root of the summed variances north and east at the end.
    determinant: float  #: det(H'H) at the end.
    eigenvalue: float  #: Least eigenvalue of H'H at the end.
    dop: float  #: Dilution of precision at the end; null where the sources do not tell.
    gram_determinant: float
    dop_worst: float  #: Greatest dilution of precision of the interval.
    least_range_m: float  #: Least distance to any source.
    least_separation_m: float | None  #: Least distance between any two aircraft.
    bounded_share: float
    gap: float
    has_converged: bool
    iterations: int  #: Steps of the optimiser.
    evaluations: int  #: Flights that the optimiser computed.
    starts: int  #: First guesses that it began from.
    start_spread: float


@dataclass(frozen=True)
class ControlRow:
    """One control of one aircraft: bounds, and value at the end under the recommended law."""

    aircraft: str  #: Name of the aircraft.
    control: str  #: What is controlled.
    unit: str  #: Unit of the values.
    start: float  #: Value at the start.
    low: float  #: Least value allowed.
    high: float  #: Greatest value allowed.
    most_change_per_s: float  #: Greatest change a second.
    end: float  #: Value at the end under the recommended law.


@dataclass(frozen=True)
class ControlPlan(PlanAnswer):
    """Plan of the motion of aircraft for the accuracy of one of them.

    Parameters
    ----------
    judged : str
        The aircraft whose accuracy counts.
    recommended : str
        The law asked for; ``uncontrolled`` where nothing may be controlled.
    gain : float
        Weighted variance at the end without control over that under the recommended law, as a ratio of sigmas.
    laws : tuple of LawRow
    controls : tuple of ControlRow
    aircraft, points : tuple of str
    exact : tuple of str
        The aircraft whose position is known without error.
    duration_s : float
    settings : dict
        Scenario and method as used.
    figures : tuple of FigureData
        ``control_paths`` (time_s, law, aircraft, north_m, east_m, up_m, speed_mps, track_deg), ``control_measures``
        (time_s, law, determinant, eigenvalue, dop, two_sigma_north_m, two_sigma_east_m, two_sigma_up_m,
        two_sigma_r_m), ``control_points`` (name, north_m, east_m, up_m).
    """

    analysis: ClassVar[str] = "control"
    judged: str
    recommended: str
    gain: float
    laws: tuple[LawRow, ...]  #: Every law of control, and its result.
    controls: tuple[ControlRow, ...] = ()  #: Controls under the recommended law.
    aircraft: tuple[str, ...] = ()  #: Names of the aircraft.
    points: tuple[str, ...] = ()  #: Names of the ground points.
    exact: tuple[str, ...] = ()
    duration_s: float = 0.0  #: Length of the plan.
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    def law(self, name: str) -> LawRow:
        """The row of a law."""
        return next(row for row in self.laws if row.law == name)
