"""The coupled north-east model: both channels, azimuth, Earth and craft rate.

Sixteen states: the six of each channel (``model.STATES``; north, then east), the azimuth error and its drift, and two
accelerometer biases. Gyro drifts and biases are those of sensors fixed to the body, named by the channel they act on
when it heads north: where a strapdown turns, they act on the other one. On a platform slaved to north they stay.

Signs: error = INS - truth. With the phi-angle (computed attitude = (I - [phi x]) n_from_b) the north tilt is -phi_E,
the east tilt +phi_N - positive where the velocity error falls - and the heading error -phi_D.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.base.records import Int64Array, frozen
from groundstation.base.units import MPS2_PER_G
from groundstation.methods.ins_noise import InsNoise
from groundstation.methods.kalman import filter as kalman
from groundstation.methods.kalman.arrays import NO_STEP, REJECTED, MeasurementRows
from groundstation.methods.kalman.rates import Rates
from groundstation.methods.kalman.transition import Transition
from groundstation.systems.inertial.channel_group import RESET_POSITION_M, RESET_VELOCITY_MPS
from groundstation.systems.inertial.craft_motion import CraftMotion, latitude_rad, radii_m, rates_radps
from groundstation.systems.inertial.differences import InsDifferences, only_used
from groundstation.systems.inertial.filter import DifferenceEpochs, measurement_variances, patience_of
from groundstation.systems.inertial.model import POSITION, VELOCITY, FloatArray
from groundstation.systems.inertial.seams import Fixes, fixes_since, returns_of
from groundstation.systems.inertial.settings import InertialSettings

# The six states of each channel (model.STATES), the azimuth error and its constant drift, the accelerometer biases.
NORTH, EAST = 0, 6
AZIMUTH, AZIMUTH_DRIFT = 12, 13
FORWARD_BIAS, RIGHT_BIAS = 14, 15
SIZE = 16
CHANNELS = np.array([[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11]])
_PN, _VN, _TN, _DN, _SN, _RN, _PE, _VE, _TE, _DE, _SE, _RE = range(12)
MPS2_PER_UG = 1e-6 * MPS2_PER_G

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
KEPT = kalman.KeptArrays(gains=False, variances=True, judged=True)
EVERY = 10  # epochs from one covariance that is kept to the next


@dataclass(frozen=True)
class CoupledRun:
    """History of the coupled filter over n epochs.

    Parameters
    ----------
    x, sigma : ndarrays, shape (n, 16)
        States after each epoch (north channel, east channel, azimuth error rad, its drift rad/s, accelerometer biases
        forward and right m/s^2) and their sigmas.
    P : ndarray, shape (m, 16, 16)
        Covariances at every epoch, or every tenth (``every``), from the first.
    innovation, innovation_variance : ndarrays, shape (n, 2, 2)
        Measured minus predicted (position, velocity; north, east), NaN where absent.
    used : ndarray of int8, shape (n, 2, 2)
        Rejected -1, absent 0, used 1.
    reopened : int
        How often GNSS was rejected for so long that the filter took it to be right after all.
    """

    differences: InsDifferences
    noise: InsNoise
    x: FloatArray
    sigma: FloatArray
    innovation: FloatArray
    innovation_variance: FloatArray
    used: NDArray[np.int8]
    P: FloatArray
    reopened: int = 0
    every: int = EVERY

    def __post_init__(self) -> None:
        for name in ("x", "sigma", "P", "innovation", "innovation_variance", "used"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def epochs(self) -> DifferenceEpochs:
        """The epochs it ran over."""
        return self.differences.epochs


def coupled_values(motion: CraftMotion, beta_per_s: float) -> FloatArray:
    """Return the entries of A (x' = A x) over each interval, shape (m, 41).

    They are in the order of :data:`PATTERN`. Velocity error' = -phi x f - (2 Earth rate + craft rate) x velocity error
    - (2 error of the Earth rate + error of the craft rate) x velocity; phi' = -(Earth rate + craft rate) x phi + error
    of both - gyro error, where the errors of the rates come from the errors of latitude and velocity. Left out:
    vertical motion and its errors, the change of gravity with the position error.

    Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3; Groves,
    Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed. 2013, section 14.2.4 (attitude
    error of opposite sign).
    """
    meridian, normal = radii_m(motion)
    earth_north, earth_down, craft_north, craft_east, craft_down = rates_radps(motion)
    latitude = latitude_rad(motion)
    slope, cosine = np.tan(latitude) / normal, np.cos(latitude)
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
    """Return A of x' = A x over each interval, shape (m, 16, 16), SI units.

    See :func:`coupled_values`.
    """
    values = coupled_values(motion, beta_per_s)
    out = np.zeros((len(values), SIZE, SIZE))
    out[:, ROWS, COLUMNS] = values
    return out


def run_coupled(
    differences: InsDifferences, noise: InsNoise, settings: InertialSettings, *, every: int = EVERY
) -> CoupledRun:
    """Estimate the errors of both channels and the azimuth together.

    Where GNSS is absent they are forecast.

    The noise of a horizontal channel is the class's; the azimuth starts with ``azimuth_deg``, its gyro with the
    constant drift of the class, and walks like a tilt. An azimuth sigma of zero leaves two coupled channels of six.
    Position and velocity error may be anything at the start (a log may begin in flight) and after a reset of the INS;
    a filter that has rejected GNSS for :data:`seams.PATIENCE_S` is opened too, the position by the innovation, tilt and
    drift kept. Where GNSS comes back after an outage beyond the gate and agrees with itself, the covariance is widened.
    Covariances are kept at one epoch in ``every``.
    """
    epochs = only_used(differences.epochs, settings)
    n = len(epochs)
    interval = np.diff(epochs.time_s, prepend=epochs.time_s[:1])
    values = np.zeros((n, len(PATTERN)))
    motion = CraftMotion.between(differences, epochs.time_s, is_strapdown=noise.is_strapdown)
    values[1:] = coupled_values(motion, noise.beta_per_s)
    covariance, densities = noise_of(noise, differences, epochs, float(motion.heading_rad[0]) if n > 1 else 0.0)
    reset = np.zeros(SIZE)
    reset[CHANNELS[:, [POSITION, VELOCITY]]] = _opened_variances(noise, epochs)
    opened = np.where(np.isin(np.arange(SIZE), CHANNELS[:, POSITION]), 0.0, reset)
    gate = kalman.InnovationGate(settings.gate_sigmas, patience_of(epochs), opened, is_by_innovation=True)
    lines, z = lines_of(epochs, noise), np.stack([epochs.position_m, epochs.velocity_mps], axis=1).reshape(-1, 4)
    parts, start, odd = [], kalman.Start(np.zeros(SIZE), covariance), np.zeros(n, dtype=bool)
    returns = returns_of(epochs.time_s, epochs.has_gnss)
    begins = np.unique([*range(0, n, AT_ONCE), *returns, *(returns + 1)])
    begins = begins[begins < n]
    for begin, end in pairwise([*begins.tolist(), n]):
        use, factor = slice(begin, end), 1.0
        stretch = Stretch.over(values[use], interval[use], densities, is_first=begin == 0)
        if begin in returns:
            good, factor = _seam_at(begin, start, epochs, values, interval, densities, lines, settings.gate_sigmas**2)
            odd[begin:good] = True
        if factor > 1.0:
            start = kalman.Start(start.x, factor**2 * start.P, start.in_a_row)
            stretch = Stretch.over(values[use], interval[use], factor**2 * densities, is_first=False)
        jump = np.full(len(stretch.step), NO_STEP, dtype=np.int64)
        jump[stretch.last[epochs.is_reset[use]]] = 0
        shown = np.where(odd[use, None], np.nan, z[use]).ravel()
        seen = kalman.Measurements(np.repeat(stretch.last, 4), shown, np.tile(np.arange(4), end - begin), lines)
        run = kalman.run_filter(
            stretch.transition, stretch.step, seen, start, gate=gate, jump=jump, jumps=reset[None], kept=KEPT
        )
        parts.append((run, stretch.last))
        start = run.end
    x, variance = (np.concatenate(part) for part in zip(*((_at_epochs(*part)) for part in parts), strict=True))
    y, S, used = (
        np.concatenate([np.asarray(getattr(run.record, name)) for run, _ in parts]).reshape(n, 2, 2)
        for name in ("judged_innovation", "judged_variance", "mark")
    )
    used = np.where(odd[:, None, None] & np.isfinite(z).reshape(n, 2, 2), np.int8(REJECTED), used)
    reopened = sum(run.reopened for run, _ in parts)
    kept = [run.P[last[-first % every :: every]] for (run, last), first in zip(parts, begins.tolist(), strict=True)]
    P = np.concatenate(kept)
    return CoupledRun(differences, noise, x, np.sqrt(np.maximum(variance, 0.0)), y, S, used, P, reopened, every)


@dataclass(frozen=True)
class Stretch:
    """Transitions over neighbouring epochs, with their steps.

    ``step`` is the transition of each step, ``last`` the step that ends at each epoch.
    """

    transition: Transition
    step: Int64Array
    last: Int64Array

    @classmethod
    def over(cls, values: FloatArray, interval_s: FloatArray, densities: FloatArray, *, is_first: bool) -> "Stretch":
        count = np.maximum(1, np.ceil(interval_s / LONGEST_STEP_S - 1e-9)).astype(np.int64)
        step = np.repeat(np.arange(len(count)), count)
        if is_first:
            step[0] = NO_STEP  # the start belongs to the first epoch
        return cls(RATES.transition(values, interval_s / count, densities), step, np.cumsum(count) - 1)


def _seam_at(
    back: int,
    start: kalman.Start,
    epochs: DifferenceEpochs,
    values: FloatArray,
    interval_s: FloatArray,
    densities: FloatArray,
    lines: MeasurementRows,
    gate: float,
) -> tuple[int, float]:
    """Return the first agreeing fix after a return of GNSS, and the factor on the sigma.

    The fix is given by its epoch; factor 1: none.
    """
    fixes = fixes_since(epochs.time_s, epochs.position_m, epochs.velocity_mps, back)
    if not len(fixes) or epochs.is_reset[back : fixes[-1] + 1].any():
        return back, 1.0
    use, rows = slice(back, int(fixes[-1]) + 1), fixes - back
    stretch = Stretch.over(values[use], interval_s[use], densities, is_first=back == 0)
    unseen = kalman.Measurements(np.zeros(0, np.int64), np.zeros((0, 1)), np.zeros(0, np.int64), lines)
    ahead = kalman.run_filter(stretch.transition, stretch.step, unseen, start, kept=kalman.KeptArrays(gains=False))
    at, states = stretch.last[rows], CHANNELS[:, [POSITION, VELOCITY]].T.ravel()
    measured = np.stack([epochs.position_m[fixes], epochs.velocity_mps[fixes]], axis=1)
    predicted, covariance = ahead.x[at][:, states, 0].reshape(-1, 2, 2), ahead.P[at][:, states][:, :, states]
    seam = Fixes(epochs.time_s[fixes], measured, predicted, covariance, lines.believed[::2]).seam(gate)
    return (back, 1.0) if seam is None else (int(fixes[seam[0]]), seam[1])


def _at_epochs(run: kalman.FilterRun, last: Int64Array) -> tuple[FloatArray, FloatArray]:
    """Return states and variances at the epochs.

    Steps in between of a long interval are left out.
    """
    return run.x[last, :, 0], run.record.variance[last]


def lines_of(epochs: DifferenceEpochs, noise: InsNoise) -> MeasurementRows:
    """Position north and east, velocity north and east; the two of a kind are judged together."""
    weighted, believed = measurement_variances(epochs, noise)
    states = CHANNELS[:, [POSITION, VELOCITY]].T.ravel()
    return MeasurementRows(
        np.arange(5), states, np.ones(4), np.repeat(weighted, 2), np.repeat(believed, 2), np.array([0, 0, 1, 1])
    )


def noise_of(
    noise: InsNoise, differences: InsDifferences, epochs: DifferenceEpochs, heading_rad: float
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


def _opened_variances(noise: InsNoise, epochs: DifferenceEpochs) -> FloatArray:
    """Variances of a position and a velocity error of which nothing is known, shape (2,).

    The class's for the position where GNSS never measures it: it enters the Earth rate, and an unknown one of tens of
    kilometres would hide the drift for good.
    """
    is_measured = bool(np.isfinite(epochs.position_m).any())
    position = max(RESET_POSITION_M, noise.position_m) if is_measured else noise.position_m
    return np.square([position, max(RESET_VELOCITY_MPS, noise.velocity_mps)])
