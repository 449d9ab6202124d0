"""One run of the study: a simulated log, its estimate, and squared errors over variances."""

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import curvature_radii_m
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu
from groundstation.simulation.imu.motion import true_states
from groundstation.systems.trajectory.estimate import Estimate, estimate
from groundstation.systems.trajectory.inputs import FloatArray, GnssFixes, ImuIncrements
from groundstation.systems.trajectory.layout import output_samples
from groundstation.systems.trajectory.onboard_offsets import euler_deg
from groundstation.systems.trajectory.retime import on_a_line
from groundstation.systems.trajectory.solution import TrackOfStates
from groundstation.systems.trajectory.states import LAT
from groundstation.systems.trajectory.study.family import StudyFamily, known_model, known_sigmas
from groundstation.systems.trajectory.track import forward_track, smoothed_track

EVERY_S = 5.0
HEADING_KNOWN_DEG = 5.0  # the filter counts from here on
AMBIGUOUS = 10.0  # logarithm of the likelihood
QUANTITIES = ("position", "velocity", "attitude")


@dataclass(frozen=True)
class Run:
    """Squared errors over variances of a run.

    Parameters
    ----------
    smoothed, filtered : ndarrays, shape (k, 3, 3)
        By time, quantity (position, velocity, attitude) and axis.
    heading_error_deg : ndarray, shape (k,)
        Of the smoothed heading.
    latency_error_s : float
        Found minus true, and over its sigma.
    latency_ratio : float
    is_ambiguous : bool
        Another heading is within ``AMBIGUOUS``.
    """

    smoothed: FloatArray
    filtered: FloatArray
    heading_error_deg: FloatArray
    latency_error_s: float
    latency_ratio: float
    is_ambiguous: bool


def log_of(flight: ImuFlight) -> tuple[ImuIncrements, GnssFixes]:
    """Return what an estimator takes of a simulated log, its stamps put on a line."""
    gnss = flight.gnss
    imu = ImuIncrements(
        on_a_line(flight.time_s, flight.interval_s).time_s,
        flight.interval_s,
        flight.delta_angle_rad,
        flight.delta_velocity_mps,
        flight.is_integral,
    )
    fixes = GnssFixes(
        gnss.time_s,
        gnss.latitude_deg,
        gnss.longitude_deg,
        gnss.height_m,
        gnss.velocity_mps,
        gnss.position_sigma_m,
        gnss.velocity_sigma_mps,
        gnss.is_precise,
    )
    return imu, fixes


def estimated(flight: ImuFlight) -> Estimate:
    """Estimate a simulated log with its noise known."""
    imu, fixes = log_of(flight)
    settings = flight.settings
    return estimate(
        imu,
        fixes,
        may_stop=flight.family == "drive",
        prior=known_model(settings),
        sigmas=known_sigmas(settings),
        fit=False,
    )


def accelerometers_from_body(flight: ImuFlight) -> FloatArray:
    """Return the rotation of the accelerometers, made square, against the body.

    The attitude is theirs. I + errors = symmetric times rotation (polar decomposition).
    """
    left, _size, right = np.linalg.svd(np.eye(3) + flight.accelerometer_matrix)
    return np.asarray(left @ right)


def squared_errors(flight: ImuFlight, track: TrackOfStates) -> tuple[FloatArray, FloatArray]:
    """Return squared errors over variances, shape (k, 3, 3), and heading errors in deg."""
    truth = true_states(flight.motion, track.time_s)
    north, east = curvature_radii_m(truth.latitude_deg)
    errors = np.empty((len(track), 3, 3))
    errors[:, 0, 0] = np.radians(track.latitude_deg - truth.latitude_deg) * (north + truth.height_m)
    parallel = (east + truth.height_m) * np.cos(np.radians(truth.latitude_deg))
    errors[:, 0, 1] = np.radians(wrap_180(track.longitude_deg - truth.longitude_deg)) * parallel
    errors[:, 0, 2] = truth.height_m - track.height_m
    errors[:, 1] = track.velocity_mps - truth.velocity_mps
    found = np.stack([track.roll_deg, track.pitch_deg, track.heading_deg], axis=1)
    errors[:, 2] = wrap_180(found - euler_deg(truth.n_from_b @ accelerometers_from_body(flight).T))
    sigmas = np.stack([track.position_sigma_m, track.velocity_sigma_mps, track.attitude_sigma_deg], axis=1)
    return (errors / sigmas) ** 2, errors[:, 2, 2]


def run_of(family: StudyFamily, seed: tuple[int, int]) -> Run | None:
    """Simulate and estimate a log; None where the estimator refuses."""
    flight = simulate_imu(family.motion, np.random.default_rng(seed), settings=family.unit)
    try:
        found = estimated(flight)
    except NotAssessableError:
        return None
    samples, done = found.problem.samples, found.result
    given = output_samples(samples, int(done.plan.schedule.first[0]))
    times = samples.time_s[given]
    at = given[np.diff(np.floor(times / EVERY_S), prepend=np.floor(times[0] / EVERY_S)) > 0]
    smoothed, heading = squared_errors(flight, smoothed_track(samples, done, at))
    forward = forward_track(samples, done, at)
    known = forward.attitude_sigma_deg[:, 2] < HEADING_KNOWN_DEG
    filtered = squared_errors(flight, forward)[0][known]
    late_s = found.latency_s - flight.latency_s
    runner_up = found.hypotheses[1].likelihood if len(found.hypotheses) > 1 else -np.inf
    return Run(
        smoothed,
        filtered,
        heading,
        late_s,
        late_s / float(np.sqrt(done.constants_variance[LAT])),
        bool(found.hypotheses[0].likelihood - runner_up < AMBIGUOUS),
    )
