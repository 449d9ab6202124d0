"""Answer of the cooperative analysis (system 4): positions from ranges, by each algorithm.

The ranges are between vehicles.
"""

from dataclasses import dataclass, field
from typing import ClassVar

from groundstation.results.answer import SessionAnswer
from groundstation.results.figures import FigureData
from groundstation.systems.cooperative.stations_answer import StationsAnswer


@dataclass(frozen=True)
class AlgorithmRow:
    """One algorithm over the whole session and all vehicles.

    Parameters
    ----------
    algorithm : str
        ``dead_reckoning``, ``centralised``, ``neighbour_exact``, ``ranked``, ``modified``, ``split_intersection``,
        ``pairwise``, ``smoothed``.
    update : str
        ``sequential`` or ``simultaneous``; ``batch`` of the smoother.
    two_sigma_r_m : float
        Twice the computed sigma_r = sqrt(sx^2 + sy^2) at the end, worst vehicle.
    rms_m : float or None
        Root mean square of the horizontal error over vehicles and epochs, where truth is known.
    nees, nees_low, nees_high : float or None
        Mean normalised squared horizontal error (2 is honest) and its 95 % limits from the number of independent
        vehicles alone: errors of one vehicle at neighbouring epochs are not independent.
    bound_ratio : float or None
        RMS error over the Cramer-Rao bound of the same session: that of what was known until then, for ``smoothed``
        that of the whole session.
    spectral_radius : float or None
        Spectral radius of the joint error map of the decentralised filters, per window, worst window: above 1 errors
        feed themselves.
    diverges : bool or None
        Horizontal error above three computed sigma_r over the last tenth of the session, any vehicle.
    is_consistent : bool or None
        NEES inside its limits.
    accepted, gated, lost : int
        Measurements used, rejected by the gate, and not usable (nobody broadcast, unknown position).
    messages, bytes_per_slot : float
        Traffic that a data link would carry for this algorithm, mean over slots.
    expected_nees : float or None
        NEES to expect from geometry and stated sigmas alone, worst time, where it was worked out (``pairwise``).
    two_sigma_r_session_m : float or None
        Twice the root mean square of the computed sigma_r over the whole session, worst vehicle.
    refused : str
        Why this algorithm was not run; empty where it was. All figures of a refused one are None or 0.
    """

    algorithm: str
    update: str
    two_sigma_r_m: float | None
    rms_m: float | None
    nees: float | None
    nees_low: float | None
    nees_high: float | None
    bound_ratio: float | None
    spectral_radius: float | None
    diverges: bool | None
    is_consistent: bool | None
    accepted: int
    gated: int
    lost: int
    messages: int
    bytes_per_slot: float
    expected_nees: float | None = None
    two_sigma_r_session_m: float | None = None
    refused: str = ""


@dataclass(frozen=True)
class VehicleRow:
    """One vehicle under one algorithm: final sigma, errors against truth where known."""

    vehicle: str
    algorithm: str
    epochs: int
    sigma_north_m: float
    sigma_east_m: float
    two_sigma_r_m: float
    rms_m: float | None
    end_error_m: float | None
    nees: float | None
    clock_m: float | None
    range_bias_m: float | None


@dataclass(frozen=True)
class GeometryRow:
    """Geometry of one vehicle: medians over the session, worst determinant and eigenvalue.

    ``determinant`` is det(H'H) of the horizontal directions, sin^2 of the angle for two sources; ``gram_determinant``
    that of its mean over a sliding interval.
    """

    vehicle: str
    sources_median: float
    hdop_median: float | None
    gdop_median: float | None
    determinant_median: float
    determinant_least: float
    eigenvalue_least: float
    gram_determinant_median: float


@dataclass(frozen=True)
class LinkRow:
    """One direction of one link: measurements, residuals of ``links_algorithm``."""

    receiver: str
    source: str
    kind: str
    ranges: int
    used: int
    gated: int
    residual_mean_m: float | None
    residual_rms_m: float | None
    nis: float | None


@dataclass(frozen=True)
class CooperativeResult(SessionAnswer):
    """Navigation between the vehicles of one session.

    Parameters
    ----------
    frame : str
        ``ecef`` or ``local``.
    default_algorithm : str
        The one whose positions are to be used: ``smoothed``, which uses the whole session; the others tell what was
        knowable on board.
    algorithms, vehicles, geometry, links
        Tables; see the rows.
    links_algorithm : str
        Whose predictions the residuals of ``links`` are against: the centralised filter, which has not used a range
        before it predicts it.
    vehicle_names, point_names : tuple of str
    duration_s : float
    slots : int
    settings : dict
        Every parameter as used.
    stations : StationsAnswer or None
        Ground stations as the session judges them; None without any, or where they are not judged.
    figures : tuple of FigureData
        ``cooperative_tracks`` (time_s, vehicle, algorithm, x_m, y_m, z_m in the frame of the session, sigma_north_m,
        sigma_east_m, sigma_up_m, NaN where height is no state, correlation_north_east, two_sigma_r_m, error_m, nees),
        ``cooperative_geometry`` (time_s, vehicle, sources, hdop, gdop,
        determinant, eigenvalue, gram_determinant, bound_m), ``cooperative_map`` (time_s, algorithm, spectral_radius),
        ``cooperative_links`` (time_s, receiver, source, innovation, sigma, mark), ``cooperative_traffic`` (algorithm,
        vehicle, messages, bytes), ``cooperative_stations`` (the rows of ``stations``, where there are any).
    """

    analysis: ClassVar[str] = "cooperative"
    frame: str
    default_algorithm: str
    algorithms: tuple[AlgorithmRow, ...]
    vehicles: tuple[VehicleRow, ...]
    geometry: tuple[GeometryRow, ...] = ()
    links: tuple[LinkRow, ...] = ()
    links_algorithm: str = "centralised"
    vehicle_names: tuple[str, ...] = ()
    point_names: tuple[str, ...] = ()
    duration_s: float = 0.0
    slots: int = 0
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    stations: StationsAnswer | None = None
    figures: tuple[FigureData, ...] = ()
