"""The coupled north-east model: both channels, azimuth, Earth and craft rate; its gain over the two separate channels.

Sixteen states: the six of each channel (``model.STATES``; north, then east), the azimuth error and its drift, and two
accelerometer biases. Gyro drifts and biases are those of sensors fixed to the body, named by the channel they act on
when it heads north: where a strapdown turns, they act on the other one. On a platform slaved to north they stay.

Signs: error = INS - truth. With the phi-angle (computed attitude = (I - [phi x]) n_from_b) the north tilt is -phi_E,
the east tilt +phi_N - positive where the velocity error falls - and the heading error -phi_D.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from groundstation.base.geodesy import EARTH_RATE_RADPS, curvature_radii_m
from groundstation.base.records import Int64Array, frozen
from groundstation.base.units import MPS2_PER_G
from groundstation.estimators.inertial.differences import Differences, only_used
from groundstation.estimators.inertial.filter import (
    PATIENCE_S,
    RESET_POSITION_M,
    RESET_VELOCITY_MPS,
    Epochs,
    measurement_variances,
)
from groundstation.estimators.inertial.hindcast import Hindcast
from groundstation.estimators.inertial.model import POSITION, VELOCITY, FloatArray, normal_gravity_mps2
from groundstation.estimators.inertial.noise import InsNoise
from groundstation.estimators.inertial.settings import InertialSettings
from groundstation.estimators.kalman import filter as kalman
from groundstation.estimators.kalman.arrays import NO_STEP, REJECTED, Lines
from groundstation.estimators.kalman.rates import Rates
from groundstation.results.forecast import HORIZONS_MIN, CoupledRow

# The six states of each channel (model.STATES), the azimuth error and its constant drift, the accelerometer biases.
NORTH, EAST = 0, 6
AZIMUTH, AZIMUTH_DRIFT = 12, 13
FORWARD_BIAS, RIGHT_BIAS = 14, 15
SIZE = 16
CHANNELS = np.array([[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11]])
_PN, _VN, _TN, _DN, _SN, _RN, _PE, _VE, _TE, _DE, _SE, _RE = range(12)
LATITUDE_MAX_DEG = 88.0  # beyond, north is no axis for an error model
MPS2_PER_UG = 1e-6 * MPS2_PER_G
ACCELERATION_MAX_MPS2 = 50.0  # a faster change of the INS velocity is a reset of it

# Pattern of the matrix: (row, column) of every entry that is not always zero, in the order of _values.
PATTERN = (
    *((_PN, _VN), (_PE, _VE), (_PE, _PN), (_PE, _PE)),
    *((_VN, _TN), (_VN, AZIMUTH), (_VN, _VE), (_VN, _PN)),
    *((_VE, _TE), (_VE, AZIMUTH), (_VE, _VN), (_VE, _VE), (_VE, _PN)),
    *((_TN, _VN), (_TN, _TE), (_TN, AZIMUTH), (_TN, _DN), (_TN, _RN)),
    *((_TE, _VE), (_TE, _TN), (_TE, AZIMUTH), (_TE, _PN), (_TE, _DE), (_TE, _RE)),
    *((AZIMUTH, _TN), (AZIMUTH, _TE), (AZIMUTH, _PN), (AZIMUTH, _VE), (AZIMUTH, AZIMUTH_DRIFT)),
    *((_DN, _SN), (_DE, _SE), (_RN, _RN), (_RE, _RE)),
    *((_TN, _DE), (_TN, _RE), (_TE, _DN), (_TE, _RN)),
    *((_VN, FORWARD_BIAS), (_VN, RIGHT_BIAS), (_VE, FORWARD_BIAS), (_VE, RIGHT_BIAS)),
)
ROWS = np.array([row for row, _ in PATTERN], dtype=np.int64)
COLUMNS = np.array([column for _, column in PATTERN], dtype=np.int64)
RATES = Rates(SIZE, ROWS, COLUMNS)
LONGEST_STEP_S = 10.0  # (Earth and Schuler rate x step)^5 / 120: below 1e-10 of the state
AT_ONCE = 4096  # epochs whose transitions are held in memory, 3 MB
KEPT = kalman.Kept(gains=False, variances=True, judged=True)
EVERY = 10  # epochs from one covariance that is kept to the next
VARIANCE_STEP_S = 60.0  # of covariances carried forward: 0.07 of a Schuler radian


@dataclass(frozen=True)
class CraftMotion:
    """Motion of the craft over m intervals, as its INS knows it: the means of each interval.

    Parameters
    ----------
    latitude_deg, altitude_m : ndarrays, shape (m,)
    velocity_mps, acceleration_mps2 : ndarrays, shape (m, 2)
        Over the ground, north and east; the acceleration is change of velocity over the interval.
    heading_rad : ndarray, shape (m,)
        Of what the sensors are fixed to: the nose of a strapdown, north of a platform that is slaved to it.
    """

    latitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_mps: FloatArray
    acceleration_mps2: FloatArray
    heading_rad: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(np.asarray(getattr(self, item.name), dtype=np.float64)))

    @classmethod
    def between(cls, differences: Differences, time_s: FloatArray, *, is_strapdown: bool = True) -> "CraftMotion":
        """The motion between neighbouring times, m of them, from the INS alone; m - 1 intervals.

        Held where the INS is silent, at rest on the equator where it never spoke.
        """
        n = len(time_s)
        latitude, altitude, north, east = (
            _interpolated(differences.epochs.time_s, column, time_s)
            for column in (differences.latitude_deg, differences.altitude_m, *differences.velocity_mps.T)
        )
        velocity = np.stack([north, east], axis=1)
        seconds = np.diff(time_s)[:, None]
        acceleration = np.diff(velocity, axis=0) / np.where(seconds > 0.0, seconds, np.inf)
        is_step = (np.abs(acceleration) > ACCELERATION_MAX_MPS2).any(axis=1)
        acceleration[is_step] = 0.0
        mean = [0.5 * (part[1:] + part[:-1]) for part in (latitude, altitude, velocity)]
        heading = np.zeros(n)
        if is_strapdown:
            heading = np.interp(time_s, differences.epochs.time_s, differences.unwrapped_heading_rad)
        return cls(mean[0], mean[1], mean[2], acceleration, 0.5 * (heading[1:] + heading[:-1]))

    def specific_force_mps2(self) -> FloatArray:
        """Specific force north, east and down, shape (m, 3), m/s^2; vertical motion is left out.

        f = acceleration + (2 Earth rate + craft rate) x velocity - gravity.
        """
        earth_north, earth_down, craft_north, craft_east, craft_down = _rates_radps(self)
        north, east = self.velocity_mps.T
        down_rate = 2.0 * earth_down + craft_down
        gravity = normal_gravity_mps2(self.latitude_deg, self.altitude_m)
        return np.stack(
            [
                self.acceleration_mps2[:, 0] - down_rate * east,
                self.acceleration_mps2[:, 1] + down_rate * north,
                (2.0 * earth_north + craft_north) * east - craft_east * north - gravity,
            ],
            axis=1,
        )


@dataclass(frozen=True)
class CoupledRun:
    """History of the coupled filter over n epochs.

    Parameters
    ----------
    x, sigma : ndarrays, shape (n, 16)
        States after each epoch (north channel, east channel, azimuth error rad, its drift rad/s, accelerometer biases
        forward and right m/s^2) and their sigmas.
    P : ndarray, shape (m, 16, 16)
        Covariances at every tenth epoch from the first.
    innovation, innovation_variance : ndarrays, shape (n, 2, 2)
        Measured minus predicted (position, velocity; north, east), NaN where absent.
    used : ndarray of int8, shape (n, 2, 2)
        Rejected -1, absent 0, used 1.
    reopened : int
        How often GNSS was rejected for so long that the filter took it to be right after all.
    """

    differences: Differences
    noise: InsNoise
    x: FloatArray
    sigma: FloatArray
    innovation: FloatArray
    innovation_variance: FloatArray
    used: NDArray[np.int8]
    P: FloatArray
    reopened: int = 0

    def __post_init__(self) -> None:
        for name in ("x", "sigma", "P", "innovation", "innovation_variance", "used"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def epochs(self) -> Epochs:
        """The epochs it ran over."""
        return self.differences.epochs


def coupled_values(motion: CraftMotion, beta_per_s: float) -> FloatArray:
    """Entries of A (x' = A x) over each interval, in the order of :data:`PATTERN`, shape (m, 41).

    Velocity error' = -phi x f - (2 Earth rate + craft rate) x velocity error - (2 error of the Earth rate + error of
    the craft rate) x velocity; phi' = -(Earth rate + craft rate) x phi + error of both - gyro error, where the errors
    of the rates come from the errors of latitude and velocity. Left out: vertical motion and its errors, the change of
    gravity with the position error.

    Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3; Groves,
    Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed. 2013, section 14.2.4 (attitude
    error of opposite sign).
    """
    meridian, normal = _radii_m(motion)
    earth_north, earth_down, craft_north, craft_east, craft_down = _rates_radps(motion)
    latitude_rad = _latitude_rad(motion)
    slope, cosine = np.tan(latitude_rad) / normal, np.cos(latitude_rad)
    north, east = motion.velocity_mps.T
    force_north, force_east, force_down = motion.specific_force_mps2().T
    coriolis_down = 2.0 * earth_down + craft_down
    # what an error of latitude does to the down rates, with the sign turned
    convergence = east / (normal * cosine**2)
    one = np.ones_like(north)
    along, across = np.cos(motion.heading_rad), np.sin(motion.heading_rad)
    columns = (
        *(one, one, slope * east, -slope * north),
        *(force_down, -force_east, coriolis_down - slope * east),
        -east * (2.0 * earth_north + convergence) / meridian,
        *(force_down, force_north, -coriolis_down, slope * north),
        north * (2.0 * earth_north + convergence) / meridian,
        *(1.0 / meridian, earth_down + craft_down, earth_north + craft_north, along, along),
        *(1.0 / normal, -(earth_down + craft_down), craft_east, earth_down / meridian, along, along),
        *(-(earth_north + craft_north), -craft_east, (earth_north + convergence) / meridian, slope, one),
        *(one, one, -beta_per_s * one, -beta_per_s * one),
        *(-across, -across, across, across),
        *(along, -across, across, along),
    )
    return np.ascontiguousarray(np.stack(columns, axis=1))


def coupled_matrix(motion: CraftMotion, beta_per_s: float) -> FloatArray:
    """A of x' = A x over each interval, shape (m, 16, 16), SI units; see :func:`coupled_values`."""
    values = coupled_values(motion, beta_per_s)
    out = np.zeros((len(values), SIZE, SIZE))
    out[:, ROWS, COLUMNS] = values
    return out


def run_coupled(differences: Differences, noise: InsNoise, settings: InertialSettings) -> CoupledRun:
    """Estimate the errors of both channels and the azimuth together; where GNSS is absent they are forecast.

    The noise of a horizontal channel is the class's; the azimuth starts with ``azimuth_deg``, its gyro with the
    constant drift of the class, and walks like a tilt. An azimuth sigma of zero leaves two coupled channels of six.
    Position and velocity error may be anything at the start (a log may begin in flight) and after a reset of the INS;
    a filter that has rejected GNSS for :data:`filter.PATIENCE_S` is opened in the same way, tilt and drift kept.
    """
    epochs = only_used(differences.epochs, settings)
    n = len(epochs)
    interval = np.diff(epochs.time_s, prepend=epochs.time_s[:1])
    values = np.zeros((n, len(PATTERN)))
    motion = CraftMotion.between(differences, epochs.time_s, is_strapdown=noise.is_strapdown)
    values[1:] = coupled_values(motion, noise.beta_per_s)
    covariance, densities = _noise_of(noise, differences, epochs, float(motion.heading_rad[0]) if n > 1 else 0.0)
    opened = np.zeros(SIZE)
    opened[CHANNELS[:, [POSITION, VELOCITY]]] = _opened_variances(noise, epochs)
    patience = [max(1, round(PATIENCE_S / interval_s)) for interval_s in epochs.gnss_intervals_s]
    gate = kalman.Gate(settings.gate_sigmas, patience, opened)
    lines, z = _lines(epochs, noise), np.stack([epochs.position_m, epochs.velocity_mps], axis=1).reshape(-1, 4)
    parts, start = [], kalman.Start(np.zeros(SIZE), covariance)
    begins = range(0, n, AT_ONCE)
    for begin in begins:
        use = slice(begin, min(begin + AT_ONCE, n))
        count = np.maximum(1, np.ceil(interval[use] / LONGEST_STEP_S - 1e-9)).astype(np.int64)
        transition = RATES.transition(values[use], interval[use] / count, densities)
        step, last = np.repeat(np.arange(len(count)), count), np.cumsum(count) - 1
        if begin == 0:
            step[0] = NO_STEP  # the start belongs to the first epoch
        jump = np.full(len(step), NO_STEP, dtype=np.int64)
        jump[last[epochs.is_reset[use]]] = 0
        seen = kalman.Measurements(np.repeat(last, 4), z[use].ravel(), np.tile(np.arange(4), len(count)), lines)
        run = kalman.run_filter(transition, step, seen, start, gate=gate, jump=jump, jumps=opened[None], kept=KEPT)
        parts.append((run, last))
        start = run.end
    x, variance = (np.concatenate(part) for part in zip(*((_at_epochs(*part)) for part in parts), strict=True))
    y, S, used = (
        np.concatenate([np.asarray(getattr(run.record, name)) for run, _ in parts]).reshape(n, 2, 2)
        for name in ("judged_innovation", "judged_variance", "mark")
    )
    reopened = sum(run.reopened for run, _ in parts)
    P = np.concatenate([run.P[last[-first % EVERY :: EVERY]] for (run, last), first in zip(parts, begins, strict=True)])
    return CoupledRun(differences, noise, x, np.sqrt(np.maximum(variance, 0.0)), y, S, used, P, reopened)


def _at_epochs(run: kalman.FilterRun, last: Int64Array) -> tuple[FloatArray, FloatArray]:
    """States and variances at the epochs: steps of a long interval that lie between are left out."""
    return run.x[last, :, 0], run.record.variance[last]


def _lines(epochs: Epochs, noise: InsNoise) -> Lines:
    """Position north and east, velocity north and east; the two of a kind are judged together."""
    weighted, believed = measurement_variances(epochs, noise)
    states = CHANNELS[:, [POSITION, VELOCITY]].T.ravel()
    return Lines(
        np.arange(5), states, np.ones(4), np.repeat(weighted, 2), np.repeat(believed, 2), np.array([0, 0, 1, 1])
    )


def hindcast_coupled(run: CoupledRun, at: Int64Array, lead_s: FloatArray, settings: InertialSettings) -> FloatArray:
    """Forecast from the last estimate at epochs ``at``, along the INS's own motion.

    Parameters
    ----------
    run : CoupledRun
    at : ndarray of int, shape (s,)
    lead_s : ndarray, shape (l,)
        Equal steps from the first: k times ``lead_s[0]``.

    The position error at a start is what GNSS showed; where it showed none, or none that was believed, the estimate.

    Returns
    -------
    ndarray, shape (s, l, 2)
        Position error forecast to build up since the start, metres: as ``Hindcast.forecast_m``.
    """
    out = np.zeros((len(at), len(lead_s), 2))
    if not len(lead_s):
        return out
    every, step_s, elapsed = _steps(lead_s, min(settings.forecast_step_s, LONGEST_STEP_S))
    measured = run.epochs.position_m[at]
    is_known = np.isfinite(measured) & (run.used[at, POSITION] != REJECTED)
    known = np.where(is_known, measured, run.x[at][:, CHANNELS[:, POSITION]])
    for index, epoch in enumerate(at):
        values = _values_along(run, float(run.epochs.time_s[epoch]), elapsed)
        start = run.x[epoch].copy()
        start[CHANNELS[:, POSITION]] = known[index]
        out[index] = RATES.carried(values, step_s, every, start)[:, CHANNELS[:, POSITION]] - known[index]
    return out


def coupled_variance(run: CoupledRun, at: Int64Array, lead_s: FloatArray) -> FloatArray:
    """Variance of what :func:`hindcast_coupled` forecasts by the model, m^2, shape (s, l, 2).

    That of the states at the start (at most nine epochs before it), their position known, and of the noise since.
    """
    out = np.zeros((len(at), len(lead_s), 2))
    if not len(lead_s):
        return out
    every, step_s, elapsed = _steps(lead_s, VARIANCE_STEP_S)
    _, densities = _noise_of(run.noise, run.differences, run.epochs, 0.0)
    seconds, nothing = np.full(len(elapsed) - 1, step_s), _lines(run.epochs, run.noise)
    unseen = kalman.Measurements(np.zeros(0, np.int64), np.zeros((0, 0)), np.zeros(0, np.int64), nothing)
    kept = kalman.Kept(states=False, covariances=False, gains=False, variances=True)
    for index, epoch in enumerate(at):
        values = _values_along(run, float(run.epochs.time_s[epoch]), elapsed)
        start = np.array(run.P[epoch // EVERY])
        start[CHANNELS[:, POSITION]] = start[:, CHANNELS[:, POSITION]] = 0.0
        carried = kalman.run_filter(
            RATES.transition(values, seconds, densities),
            np.arange(len(seconds)),
            unseen,
            kalman.Start(np.zeros((SIZE, 0)), start),
            kept=kept,
        )
        out[index] = carried.record.variance[every - 1 :: every][:, CHANNELS[:, POSITION]]
    return out


def _steps(lead_s: FloatArray, longest_s: float) -> tuple[int, float, FloatArray]:
    """Steps from one lead to the next, their length, and the times since the start, from zero."""
    every = max(1, round(float(lead_s[0]) / longest_s))
    step_s = float(lead_s[0]) / every
    return every, step_s, step_s * np.arange(every * len(lead_s) + 1, dtype=np.float64)


def _values_along(run: CoupledRun, start_s: float, elapsed_s: FloatArray) -> FloatArray:
    """Entries of A over steps since a start, along the INS's own motion."""
    motion = CraftMotion.between(run.differences, start_s + elapsed_s, is_strapdown=run.noise.is_strapdown)
    return coupled_values(motion, run.noise.beta_per_s)


def coupled_rows(
    run: CoupledRun,
    separate: Hindcast,
    settings: InertialSettings,
    *,
    horizons_min: Sequence[float] = HORIZONS_MIN,
    method: str = "last_estimate",
) -> tuple[CoupledRow, ...]:
    """Gain of the coupled model over the separate channels: same starts, same horizons, last estimate of both.

    Parameters
    ----------
    separate : Hindcast
        With ``method``; horizons that are none of its leads are left out, and those without a start.

    Returns
    -------
    tuple of CoupledRow
        ``gain`` is 1 - RMS ratio of the radial error: positive where coupling helps.
    """
    forecast = hindcast_coupled(run, separate.at, separate.lead_s, settings)
    coupled = np.sqrt(np.sum(np.square(forecast - separate.actual_m), axis=2))
    apart = separate.radial_m(method)
    rows = []
    for horizon in horizons_min:
        lead = np.flatnonzero(np.abs(separate.lead_s - 60.0 * horizon) < 0.5)
        if not lead.size:
            continue
        errors = np.stack([part[:, lead[0]] for part in (coupled, apart)])
        known = np.isfinite(errors).all(axis=0)
        if known.any():
            ours, theirs = np.sqrt(np.mean(np.square(errors[:, known]), axis=1))
            rows.append(CoupledRow(float(horizon), float(ours), float(1.0 - ours / theirs) if theirs > 0.0 else 0.0))
    return tuple(rows)


def _noise_of(
    noise: InsNoise, differences: Differences, epochs: Epochs, heading_rad: float
) -> tuple[FloatArray, FloatArray]:
    """Covariance at the start, shape (16, 16), and densities (16,).

    Alignment on the ground turns the azimuth until the north channel feels no drift (gyrocompassing): it is the sum of
    north drift and azimuth x Earth rate that has the class's drift sigma, not the drift alone.

    Source: Titterton and Weston 2004, section 10.3.
    """
    initial, density = noise.initial_variances(), noise.densities()
    initial[: VELOCITY + 1] = _opened_variances(noise, epochs)
    azimuth = np.deg2rad(noise.azimuth_deg) ** 2
    drift, walk = (initial[3], density[2]) if azimuth > 0.0 else (0.0, 0.0)
    balance = np.eye(SIZE)
    latitude = differences.latitude_deg[np.isfinite(differences.latitude_deg)]
    if latitude.size:
        felt = EARTH_RATE_RADPS * np.cos(np.deg2rad(latitude[0]))
        balance[[_DN, _DE], AZIMUTH] = -felt * np.cos(heading_rad), felt * np.sin(heading_rad)
    bias = (noise.accelerometer_ug * MPS2_PER_UG) ** 2
    covariance = balance @ np.diag([*initial, *initial, azimuth, drift, bias, bias]) @ balance.T
    return covariance, np.array([*density, *density, walk, 0.0, 0.0, 0.0])


def _opened_variances(noise: InsNoise, epochs: Epochs) -> FloatArray:
    """Variances of a position and a velocity error of which nothing is known, shape (2,).

    The class's for the position where GNSS never measures it: it enters the Earth rate, and an unknown one of tens of
    kilometres would hide the drift for good.
    """
    is_measured = bool(np.isfinite(epochs.position_m).any())
    position = max(RESET_POSITION_M, noise.position_m) if is_measured else noise.position_m
    return np.square([position, max(RESET_VELOCITY_MPS, noise.velocity_mps)])


def _latitude_rad(motion: CraftMotion) -> FloatArray:
    return np.deg2rad(np.clip(motion.latitude_deg, -LATITUDE_MAX_DEG, LATITUDE_MAX_DEG))


def _radii_m(motion: CraftMotion) -> tuple[FloatArray, FloatArray]:
    meridian, prime_vertical = curvature_radii_m(motion.latitude_deg)
    return meridian + motion.altitude_m, prime_vertical + motion.altitude_m


def _rates_radps(motion: CraftMotion) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Earth rate north and down, craft rate (transport rate) north, east and down, each (m,)."""
    latitude_rad = _latitude_rad(motion)
    meridian, normal = _radii_m(motion)
    north, east = motion.velocity_mps.T
    earth = (EARTH_RATE_RADPS * np.cos(latitude_rad), -EARTH_RATE_RADPS * np.sin(latitude_rad))
    return *earth, east / normal, -north / meridian, -east * np.tan(latitude_rad) / normal


def _interpolated(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    known = np.isfinite(values)
    return np.interp(at_s, time_s[known], values[known]) if known.any() else np.zeros(len(at_s))
