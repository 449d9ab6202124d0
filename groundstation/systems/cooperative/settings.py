"""Settings of the cooperative filters: assumed errors of INS, odometry, clocks; updates."""

from dataclasses import field
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_settings import check_ranges, number

Update = Literal["sequential", "simultaneous"]
ALGORITHMS: dict[str, str] = {
    "dead_reckoning": "own INS alone",
    "centralised": "one filter of all vehicles",
    "neighbour_exact": "own states, neighbour's position taken as exact (DA)",
    "ranked": "own states, neighbours of a higher rank with their covariance (multilevel)",
    "modified": "ranked, correlated noise of the primaries",
    "split_intersection": "own states, split covariance intersection",
    "pairwise": "own states and stored pairwise cross-covariances (Luft et al.), for encounters without loops",
    "smoothed": "batch least squares over all vehicles and the whole session",
}


@dataclass(frozen=True)
class InsBelief:
    """Assumed sigmas of one aircraft with INS, baro and clocks, at start and as it goes on.

    Global frame: 13 states (15 with separate clocks): tilt, azimuth and gyro count, ``velocity_s`` does not. Local
    frame: 7 states, ``velocity_s`` counts.
    """

    position_m: float = number(300.0, 0.0)  # sigma of the dead-reckoned position at the start, north and east
    velocity_mps: float = number(0.2, 0.0)  # sigma of the velocity error, north and east
    velocity_s: float = number(1000.0, 1.0)  # correlation time of the velocity error; in the local frame alone
    # Sigma of either tilt of the platform at the start; in the global frame alone.
    tilt_arcsec: float = number(4.0, 0.0)
    azimuth_arcmin: float = number(5.0, 0.0)  # sigma of the azimuth error at the start; in the global frame alone
    gyro_dph: float = number(0.01, 0.0)  # sigma of the drift of each gyro; in the global frame alone
    gyro_s: float = number(3600.0, 1.0)  # correlation time of the drift of a gyro; in the global frame alone
    baro_m: float = number(10.0, 0.0)  # sigma of the error of barometric height
    baro_s: float = number(3600.0, 1.0)  # correlation time of the error of barometric height
    clock_m: float = number(30.0, 0.0)  # sigma of the clock error at the start, times the speed of light
    clock_mps: float = number(3.0, 0.0)  # sigma of the rate of the clock, times the speed of light
    clock_s: float = number(3600.0, 1.0)  # correlation time of the rate of the clock
    has_separate_clocks: bool = False  # true: the satellite receiver has a clock of its own beside that of the link

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class OdometryBelief:
    """Assumed sigmas of one wheeled vehicle: start, noise and scale of speed and turn rate.

    Speed and turn noise are densities: metres and degrees of a random walk over one second. ``slip_m_per_sqrt_m`` adds
    noise along and across in proportion to the way. Scale states exist where their sigma is above 0.
    """

    position_m: float = number(0.05, 0.0)  # sigma of the position at the start, along either axis
    heading_deg: float = number(2.0, 0.0)  # sigma of the heading at the start
    along_m_per_sqrt_s: float = number(0.02, 0.0)  # noise of the way by speed, as a random walk over one second
    turn_deg_per_sqrt_s: float = number(2.0, 0.0)  # noise of the heading by turn rate, as a random walk over one second
    # Noise of the position along and across, as a random walk over one metre of way.
    slip_m_per_sqrt_m: float = number(0.0, 0.0)
    speed_scale: float = number(0.0, 0.0, 1.0)  # sigma of the scale of the speed; 0: no such state
    turn_scale: float = number(0.0, 0.0, 1.0)  # sigma of the scale of the turn rate; 0: no such state
    scale_s: float = number(1e6, 1.0)  # correlation time of both scales

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class CameraBelief:
    """Assumed sigmas of the camera of a wheeled vehicle; a state each where above 0.

    They add to ranges and bearings.

    Parameters
    ----------
    range_scale : float
        Sigma of the scale of its ranges; 0: no such state.
    marker_bias_m : float
        Sigma of a bias of ranges to vehicles, beside the range bias of all; 0: no such state.
    mount_deg : float
        Sigma of the angle from the nose to the optical axis; 0: no such state.
    lag_s : float
        Sigma of how much later than it was taken a measurement is stamped; 0: no such state.
    """

    range_scale: float = number(0.0, 0.0, 1.0)
    marker_bias_m: float = number(0.0, 0.0)
    mount_deg: float = number(0.0, 0.0, 180.0)
    lag_s: float = number(0.0, 0.0, 10.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class SmootherSettings:
    """Settings of the smoother alone.

    Parameters
    ----------
    robust_sigmas : float
        Scale of Cauchy's weights, in sigmas of one reading; 0: all weigh alike.
    correlated_share : float
        Share of the variance of link ranges and bearings that stays while a pair measures again, where the residuals
        are too few to tell. ``CooperativeSettings.correlated_share`` above 0 is taken as it is, for the filters too.
    pair_bias_m : float
        Sigma of a constant bias of the ranges of each pair of vehicles; 0: no such states.
    most_passes : int
        Passes of the least squares at most; one that still moved the answer is told.
    """

    robust_sigmas: float = number(2.385, 0.0, 100.0)
    correlated_share: float = number(0.5, 0.0, 0.95)
    pair_bias_m: float = number(0.0, 0.0)
    most_passes: int = number(30, 1, 1000)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class CooperativeSettings:
    """Settings of the cooperative filters.

    Parameters
    ----------
    update : {'sequential', 'simultaneous'}
        Every measurement at its own time with its own linearisation, or all of one frame together.
    derivatives : {'auto', 'estimate', 'reckoning'}
        Where the centralised filter linearises a range between two aircraft: at its estimate, or at their dead
        reckoning for as long as the estimate lies within three sigmas of it (see ``centralised``). ``auto``: at the
        estimate in a session that has ranges to points or satellites, at dead reckoning in one that has none.
    frame_s : float
        Length of a frame, for simultaneous updates and for the modified algorithm.
    gate_sigma : float
        Innovations beyond are rejected and counted; 0 switches the gate off.
    latency_slots : int
        A message tells what its sender knew so many slots ago.
    range_bias_m, range_bias_s : float
        Sigma and correlation time of a range bias of each vehicle's receiver; 0: no such state.
    lever_arm_m : float
        Sigma of an unknown lever arm (forward, right) of each aircraft's antenna; 0: no such states.
    output_step_s : float
        Step in which every vehicle's states are given.
    map_window_s : float
        Length of the stretches whose joint error map is judged; 0: none is, which leaves out work that grows with the
        number of vehicles.
    extra_range_sigma_m : float
        Added to the stated sigma of peer ranges, in squares: what the stated one leaves out.
    range_share : float
        Added to the stated sigma of all ranges over the link, in squares, as a share of the range.
    correlated_share, correlation_s : float
        Share of the variance of ranges and bearings that stays while a pair measures again, and for how long. The gate
        knows the spread of one reading alone.
    pairwise_nees_limit : float
        ``pairwise`` is refused where geometry and stated sigmas let expect a larger NEES at some time; 2 is honest, 0
        switches the check off.
    judges_stations : bool
        True: ground stations are judged, and those in doubt not relied on; in sessions of aircraft alone.
    """

    update: Update = "sequential"
    derivatives: Literal["auto", "estimate", "reckoning"] = "auto"
    frame_s: float = number(1.0, 0.01)
    gate_sigma: float = number(6.0, 0.0)
    latency_slots: int = number(1, 0, 10)
    range_bias_m: float = number(0.0, 0.0)
    range_bias_s: float = number(1e6, 1.0)
    lever_arm_m: float = number(0.0, 0.0)
    output_step_s: float = number(1.0, 0.01)
    map_window_s: float = number(10.0, 0.0)
    extra_range_sigma_m: float = number(0.0, 0.0)
    range_share: float = number(0.0, 0.0, 1.0)
    correlated_share: float = number(0.0, 0.0, 1.0)
    correlation_s: float = number(5.0, 0.01)
    pairwise_nees_limit: float = number(2.5, 0.0)
    judges_stations: bool = True
    ins: InsBelief = field(default_factory=InsBelief)
    odometry: OdometryBelief = field(default_factory=OdometryBelief)
    camera: CameraBelief = field(default_factory=CameraBelief)
    smoother: SmootherSettings = field(default_factory=SmootherSettings)

    def __post_init__(self) -> None:
        check_ranges(self)
