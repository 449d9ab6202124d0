"""Answer of the cooperative analysis (system 4): positions from ranges, by each algorithm.

The ranges are between vehicles.
"""

from dataclasses import field
from typing import ClassVar

from groundstation.base.dataclasses import dataclass
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
    nees: float | None  #: Mean normalised squared horizontal error; 2 is honest, null without a truth.
    nees_low: float | None  #: Lower 95 % limit of NEES by independent vehicles.
    nees_high: float | None  #: Upper 95 % limit of NEES by independent vehicles.
    bound_ratio: float | None
    spectral_radius: float | None
    diverges: bool | None
    is_consistent: bool | None
    accepted: int  #: Ranges used.
    gated: int  #: Ranges that the gate refused.
    lost: int  #: Ranges that could not be used.
    messages: int  #: Broadcasts of the session that the algorithm needs.
    bytes_per_slot: float  #: Bytes that the algorithm broadcasts, mean over the slots.
    expected_nees: float | None = None
    two_sigma_r_session_m: float | None = None
    refused: str = ""


@dataclass(frozen=True)
class VehicleRow:
    """One vehicle under one algorithm: final sigma, errors against truth where known."""

    vehicle: str  #: Name of the aircraft.
    algorithm: str  #: Name of the algorithm.
    epochs: int  #: Epochs of its answer.
    sigma_north_m: float  #: Computed sigma north at the end.
    sigma_east_m: float  #: Computed sigma east at the end.
    two_sigma_r_m: float  #: Twice the root of the summed variances north and east at the end.
    rms_m: float | None  #: RMS of the horizontal error; null without a truth.
    end_error_m: float | None  #: Horizontal error at the end; null without a truth.
    nees: float | None  #: Mean normalised squared horizontal error; 2 is honest.
    clock_m: float | None  #: Clock error at the end, as a length; null where it is no state.
    range_bias_m: float | None  #: Bias of its ranges at the end; null where it is no state.


@dataclass(frozen=True)
class GeometryRow:
    """Geometry of one vehicle: medians over the session, worst determinant and eigenvalue.

    ``determinant`` is det(H'H) of the horizontal directions, sin^2 of the angle for two sources; ``gram_determinant``
    that of its mean over a sliding interval.
    """

    vehicle: str  #: Name of the aircraft.
    sources_median: float  #: Sources ranged to, median.
    hdop_median: float | None  #: Median of the horizontal dilution of precision.
    gdop_median: float | None  #: Median of the geometric dilution of precision.
    determinant_median: float  #: Median of det(H'H): sin squared of the angle for two sources.
    determinant_least: float  #: Least det(H'H) of the session.
    eigenvalue_least: float  #: Least eigenvalue of H'H of the session.
    gram_determinant_median: float  #: Median determinant of H'H averaged over a sliding interval.


@dataclass(frozen=True)
class LinkRow:
    """One direction of one link: measurements, residuals of ``links_algorithm``."""

    receiver: str  #: Who measured.
    source: str  #: Whom it ranged to.
    kind: str  #: Aircraft, station or satellite.
    ranges: int  #: Ranges logged.
    used: int  #: Ranges that links_algorithm used.
    gated: int  #: Ranges that its gate refused.
    residual_mean_m: float | None  #: Mean of measured minus predicted.
    residual_rms_m: float | None  #: RMS of measured minus predicted.
    nis: float | None  #: Mean normalised innovation squared; 1 is honest.


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
    algorithms: tuple[AlgorithmRow, ...]  #: Every algorithm over the whole session.
    vehicles: tuple[VehicleRow, ...]  #: Every vehicle under every algorithm.
    geometry: tuple[GeometryRow, ...] = ()  #: Directions to what each vehicle ranges to.
    links: tuple[LinkRow, ...] = ()  #: Ranges and residuals of each link.
    links_algorithm: str = "centralised"
    vehicle_names: tuple[str, ...] = ()  #: Aircraft of the session.
    point_names: tuple[str, ...] = ()  #: Ground stations of the session.
    duration_s: float = 0.0  #: Length of the session.
    slots: int = 0  #: Time slots of the data link.
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    stations: StationsAnswer | None = None
    figures: tuple[FigureData, ...] = ()
