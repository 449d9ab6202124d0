"""Answer of a planned session: best places of ground points."""

from dataclasses import field
from typing import ClassVar

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import PlanAnswer
from groundstation.results.figures import FigureData

GIVEN = "given"


@dataclass(frozen=True)
class DesignRow:
    """One set of places, and the accuracy it gives.

    Parameters
    ----------
    design : str
        ``given``, or criterion and what it is best for: ``determinant_fixed``, ``covariance_way``, ``covariance_lost``.
    determinant, eigenvalue, dop : float
        Figures of H'H at the fixed point, in the axes asked for.
    two_sigma_north_m, two_sigma_east_m, two_sigma_up_m : float
        At the fixed point, as the filter computes them on its way there.
    worst_two_sigma_north_m, worst_two_sigma_east_m, worst_two_sigma_up_m : float
        Each the largest over the part of the way that counts.
    lost : str
        The ground point whose loss costs most at the fixed point; empty where none may be lost.
    lost_two_sigma_north_m, lost_two_sigma_east_m, lost_two_sigma_up_m : float or None
        At the fixed point without it.
    gap : float
        First-order gain left within a hundredth of the rectangle, over the loss.
    has_converged : bool
    iterations, evaluations, starts : int
    start_spread : float
        Largest loss over the least one among the starts, less 1.
    """

    design: str
    determinant: float  #: det(H'H) at the fixed point.
    eigenvalue: float  #: Least eigenvalue of H'H at the fixed point.
    dop: float  #: Dilution of precision at the fixed point.
    two_sigma_north_m: float  #: Twice the sigma north at the fixed point.
    two_sigma_east_m: float  #: Twice the sigma east at the fixed point.
    two_sigma_up_m: float  #: Twice the sigma of height at the fixed point.
    worst_two_sigma_north_m: float  #: Largest on the way that counts, north.
    worst_two_sigma_east_m: float  #: Largest on the way that counts, east.
    worst_two_sigma_up_m: float  #: Largest on the way that counts, height.
    lost: str
    lost_two_sigma_north_m: float | None  #: At the fixed point without the point whose loss costs most, north.
    lost_two_sigma_east_m: float | None  #: At the fixed point without the point whose loss costs most, east.
    lost_two_sigma_up_m: float | None  #: At the fixed point without the point whose loss costs most, height.
    gap: float
    has_converged: bool  #: Whether the optimiser came to an end.
    iterations: int  #: Steps of the optimiser.
    evaluations: int  #: Sets of places that the optimiser tried.
    starts: int  #: First guesses that it began from.
    start_spread: float


@dataclass(frozen=True)
class PlaceRow:
    """Place of one point in one design.

    ``keep_out_distance_m`` is that to the nearest edge of what is kept out; ``below_way_m`` how far below the way it
    stands, None where the way does not lead over it.
    """

    design: str  #: Name of the design.
    point: str  #: Name of the ground point.
    north_m: float  #: Place, north.
    east_m: float  #: Place, east.
    height_m: float  #: Place, height.
    is_placed: bool  #: Whether the plan may place it.
    keep_out_distance_m: float | None  #: To the nearest edge of what is kept out.
    below_way_m: float | None  #: How far below the way it stands; null where the way does not lead over it.


@dataclass(frozen=True)
class PlacementPlan(PlanAnswer):
    """Best places of ground points for the accuracy of an aircraft on a given way.

    Parameters
    ----------
    judged : str
        The aircraft whose accuracy counts.
    recommended : str
        The design asked for.
    fixed_at_s, fixed_north_m, fixed_east_m, fixed_height_m : float
        The fixed point.
    from_s, to_s : float
        Part of the way whose worst point counts.
    designs : tuple of DesignRow
    places : tuple of PlaceRow
    moved : str
        The point that moves in the map.
    settings : dict
    figures : tuple of FigureData
        ``placement_points`` (design, name, north_m, east_m, up_m, is_placed), ``placement_accuracy`` (time_s, design,
        north_m, east_m, up_m, dop, two_sigma_north_m, two_sigma_east_m, two_sigma_up_m), ``placement_map`` (north_m,
        east_m, sigma_m, determinant; NaN where a point may not stand), ``placement_keep_out`` (name, north_m, east_m).
    """

    analysis: ClassVar[str] = "placement"
    judged: str
    recommended: str
    fixed_at_s: float  #: Second of the plan at the fixed point.
    fixed_north_m: float  #: Fixed point, north.
    fixed_east_m: float  #: Fixed point, east.
    fixed_height_m: float  #: Fixed point, height.
    from_s: float  #: Second at which the part of the way that counts begins.
    to_s: float  #: Second at which it ends.
    designs: tuple[DesignRow, ...]  #: Every set of places, and its accuracy.
    places: tuple[PlaceRow, ...] = ()  #: Every point in every design.
    moved: str = ""
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    def design(self, name: str) -> DesignRow:
        """The row of a design."""
        return next(row for row in self.designs if row.design == name)

    def places_of(self, design: str) -> tuple[PlaceRow, ...]:
        """The places of a design."""
        return tuple(row for row in self.places if row.design == design)
