"""Constants of an INS fitted over a whole flight, under the model's random drift.

The error of an unaided INS is what its start, its constants and its resets make of it, plus what white noise and random
drift add. The first is linear in the constants: its columns are the coupled model's own responses along the flight.
The second is filtered: measurements and columns run through one Kalman filter of the noise alone, and its innovations
are independent, so the constants follow by least squares. Their covariance holds under the model's random drift.

Source: Rosenberg, Random coefficients models, Annals of Economic and Social Measurement 2, 1973; de Jong, The diffuse
Kalman filter, Annals of Statistics 19, 1991, equations 3.1 to 3.3 (here the constants have a prior).
"""

from dataclasses import fields

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Int64Array, frozen
from groundstation.methods.ins_noise import RADPS_PER_DPH, InsNoise
from groundstation.methods.kalman import filter as kalman
from groundstation.methods.kalman.arrays import USED
from groundstation.systems.inertial.cause_answer import CAUSES
from groundstation.systems.inertial.coarse import Coarse
from groundstation.systems.inertial.coupled import (
    AZIMUTH,
    AZIMUTH_DRIFT,
    CHANNELS,
    COLUMNS,
    FORWARD_BIAS,
    RIGHT_BIAS,
    ROWS,
    SIZE,
    Stretch,
    coupled_values,
    lines_of,
    noise_of,
)
from groundstation.systems.inertial.craft_motion import LATITUDE_MAX_DEG, CraftMotion
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs
from groundstation.systems.inertial.model import DRIFT, DRIFT_RATE, POSITION, RANDOM_DRIFT, TILT, VELOCITY

# Constants, in the order of a fit; resets follow, four each.
PLACE_N, PLACE_E, SPEED_N, SPEED_E, TILT_N, TILT_E, AZ, AZ_DRIFT = range(8)
GYRO_N, GYRO_E, BIAS_FORWARD, BIAS_RIGHT, DRIFT_N, DRIFT_E = range(8, 14)
OWN = 14
PER_RESET = 4
STATE_OF = np.array(
    [
        *CHANNELS[:, POSITION],
        *CHANNELS[:, VELOCITY],
        *CHANNELS[:, TILT],
        AZIMUTH,
        AZIMUTH_DRIFT,
        *CHANNELS[:, DRIFT],
        FORWARD_BIAS,
        RIGHT_BIAS,
    ]
)
MEASURED = CHANNELS[:, [POSITION, VELOCITY]].T.ravel()  # position north, east; velocity north, east
SLOW = CHANNELS[:, [DRIFT_RATE, RANDOM_DRIFT]].ravel()  # random at the start as later
MOST_RESETS = 8
# What an accelerometer is off its constant in a flight, by its random part, its scale and the bank of turns, as a share
# of the class's bias: so large that intervals hold on simulated flights that turn (docs/evidence/inertial.md).
IN_RUN = 0.2
LEAST_EPOCHS = 12  # two minutes of means over ten seconds
KEPT = kalman.KeptArrays(covariances=False, gains=False)
ONLY_INNOVATIONS = kalman.KeptArrays(states=False, covariances=False, gains=False)
TINY = 1e-300


@dataclass(frozen=True)
class CauseFit:
    """Constants of an INS over n epochs, p of them.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    measured : ndarray, shape (n, 4)
        Position north and east, velocity north and east; NaN where absent.
    response : ndarray, shape (n, 16, p)
        What a unit of each constant makes of each state.
    value : ndarray, shape (p,)
        SI units.
    covariance, prior : ndarrays, shape (p, p)
        After the flight, and before it.
    drift_rows, tilt_rows : ndarrays, shape (2, p)
        Mean constant drift of each channel, and tilt at the start less what accelerometer biases balance.
    end_offset : ndarray, shape (4,)
        (a, b) north and (a, b) east of the Schuler oscillation at the last epoch, a cos + b sin, without constants;
        ``end_rows`` (4, p) is what they add, ``end_covariance`` (4, 4) what noise leaves unknown, ``end_states``
        (4, 16) what they are of the states.
    gravity_mps2, radius_m, schuler_radps : float
    resets : int
    """

    time_s: FloatArray
    measured: FloatArray
    response: FloatArray
    value: FloatArray
    covariance: FloatArray
    prior: FloatArray
    drift_rows: FloatArray
    tilt_rows: FloatArray
    end_offset: FloatArray
    end_rows: FloatArray
    end_covariance: FloatArray
    end_states: FloatArray
    gravity_mps2: float
    radius_m: float
    schuler_radps: float
    resets: int

    def __post_init__(self) -> None:
        for item in fields(self):
            held = getattr(self, item.name)
            if isinstance(held, np.ndarray):
                object.__setattr__(self, item.name, frozen(held))

    @property
    def start_rows(self) -> FloatArray:
        """(a, b) of each channel at the start by velocity error and tilt alone, shape (4, p)."""
        rows = np.zeros((4, len(self.value)))
        rows[0, SPEED_N] = rows[2, SPEED_E] = 1.0
        rows[[1, 3]] = -self.gravity_mps2 / self.schuler_radps * self.tilt_rows
        return rows

    @property
    def schuler_rows(self) -> FloatArray:
        """(a, b) of each channel at the start with the constant drift, shape (4, p)."""
        rows = self.start_rows
        rows[[0, 2]] += self.radius_m * self.drift_rows
        return rows

    def parts(self) -> dict[str, FloatArray]:
        """Return velocity errors by a unit of each constant, by cause, shapes (n, 2, p).

        Constants that act alike before any turn are one cause: a bias is a tilt at the start and azimuth or a gyro a
        mean drift; only what differs from these is theirs.
        """
        speed = self.response[:, CHANNELS[:, VELOCITY]]
        by_tilt = np.einsum("nct,tp->ncp", speed[:, :, [TILT_N, TILT_E]], self.tilt_rows)
        by_drift = np.einsum("nct,tp->ncp", speed[:, :, [DRIFT_N, DRIFT_E]], self.drift_rows)
        whole: dict[str, FloatArray] = {name: np.zeros_like(speed) for name in CAUSES[:-1]}
        start = [PLACE_N, PLACE_E, SPEED_N, SPEED_E]
        whole["schuler"][:, :, start] = speed[:, :, start]
        whole["schuler"] += by_tilt
        whole["drift"] += by_drift
        turned = [AZ, AZ_DRIFT]
        whole["azimuth"][:, :, turned] = speed[:, :, turned] - by_drift[:, :, turned]
        body = [GYRO_N, GYRO_E, BIAS_FORWARD, BIAS_RIGHT]
        whole["body"][:, :, body] = speed[:, :, body] - by_drift[:, :, body] - by_tilt[:, :, body]
        whole["reset"][:, :, OWN:] = speed[:, :, OWN:]
        return whole


def fit_causes(differences: InsDifferences, run: ChannelsRun) -> CauseFit:
    """Fit the constants of an INS over a flight.

    Parameters
    ----------
    differences : InsDifferences
    run : ChannelsRun
        Of the separate channels: what it rejected is left out; its class gives noise and priors.

    Raises
    ------
    NotAssessableError
        Too few velocities, a flight across a pole, an INS that was reset again and again.
    """
    coarse = Coarse.of(run)
    noise, epochs = coarse.noise(run.noise), _compared(coarse.epochs)
    resets = np.flatnonzero(epochs.is_reset[1:]) + 1
    _check(differences, epochs, resets)
    interval = np.diff(epochs.time_s, prepend=epochs.time_s[:1])
    motion = CraftMotion.between(differences, epochs.time_s, is_strapdown=noise.is_strapdown)
    values = _with_start(coupled_values(motion, noise.beta_per_s))
    fixed = CraftMotion.between(differences, epochs.time_s, is_strapdown=False)
    of_north = _with_start(coupled_values(fixed, noise.beta_per_s))
    response = _responses(values, of_north, interval, resets, noise.is_strapdown)
    heading_rad = float(motion.heading_rad[0])
    covariance, densities = noise_of(noise, differences, epochs, heading_rad)
    root, prior_sigma = _prior(covariance, noise, epochs, len(resets))
    z = np.concatenate([epochs.position_m, epochs.velocity_mps], axis=1)
    seen = np.concatenate([z[:, :, None], response[:, MEASURED]], axis=2)
    random = np.zeros((SIZE, SIZE))
    random[SLOW, SLOW] = np.diag(covariance)[SLOW]
    stretch = Stretch.over(values, interval, densities, is_first=True)
    shown = kalman.Measurements(
        np.repeat(stretch.last, 4),
        seen.reshape(-1, seen.shape[2]),
        np.tile(np.arange(4), len(epochs)),
        lines_of(epochs, noise),
    )
    start = kalman.Start(np.zeros((SIZE, seen.shape[2])), random)
    flown = kalman.run_filter(stretch.transition, stretch.step, shown, start, kept=ONLY_INNOVATIONS)
    used = flown.record.mark == USED
    white = flown.record.y[used] / np.sqrt(flown.record.S[used])[:, None]
    value, known = _least_squares(white[:, 0], white[:, 1:], root)
    biases = [BIAS_FORWARD, BIAS_RIGHT]
    known[biases, biases] += np.square(IN_RUN * prior_sigma[biases])
    matrices = _matrices(values[1:])
    drift_rows, tilt_rows = _equivalents(matrices, interval[1:], epochs.time_s, prior_sigma, run.model.gravity_mps2)
    end = _end_functionals(matrices[-1], run.model.radius_m, run.model.gravity_mps2, run.model.schuler_rate_radps)
    end_rows = end @ (response[-1] - flown.end.x[:, 1:])
    end_rows[[0, 2], [DRIFT_N, DRIFT_E]] += run.model.radius_m * (prior_sigma[[DRIFT_N, DRIFT_E]] > 0.0)
    return CauseFit(
        time_s=epochs.time_s,
        measured=z,
        response=response,
        value=value,
        covariance=known,
        prior=root @ root.T,
        drift_rows=drift_rows,
        tilt_rows=tilt_rows,
        end_offset=end @ flown.end.x[:, 0],
        end_rows=end_rows,
        end_covariance=end @ flown.end.P @ end.T,
        end_states=end,
        gravity_mps2=run.model.gravity_mps2,
        radius_m=run.model.radius_m,
        schuler_radps=run.model.schuler_rate_radps,
        resets=len(resets),
    )


def _compared(epochs: DifferenceEpochs) -> DifferenceEpochs:
    """Return the epochs from the first to the last comparison."""
    known = np.flatnonzero(epochs.has_gnss)
    use = slice(int(known[0]), int(known[-1]) + 1) if len(known) else slice(0, 0)
    return DifferenceEpochs(*(getattr(epochs, item.name)[use] for item in fields(DifferenceEpochs)))


def _check(differences: InsDifferences, epochs: DifferenceEpochs, resets: Int64Array) -> None:
    compared = int(np.isfinite(epochs.velocity_mps).all(axis=1).sum())
    if compared < LEAST_EPOCHS:
        found = f"{compared} means of both INS and GNSS velocity"
        raise NotAssessableError("ins_causes", found, f"at least {LEAST_EPOCHS}")
    if np.nanmax(np.abs(differences.latitude_deg), initial=0.0) > LATITUDE_MAX_DEG:
        text = f"the flight comes within {90.0 - LATITUDE_MAX_DEG:.0f} deg of a pole, where north is no axis"
        raise NotAssessableError("ins_causes", text)
    if len(resets) > MOST_RESETS:
        raise NotAssessableError("ins_causes", f"the INS was reset {len(resets)} times", f"at most {MOST_RESETS}")


def _with_start(values: FloatArray) -> FloatArray:
    """Return the entries of A of each interval with a row for the first epoch, which has none."""
    return np.concatenate([np.zeros((1, values.shape[1])), values])


def _matrices(values: FloatArray) -> FloatArray:
    out = np.zeros((len(values), SIZE, SIZE))
    out[:, ROWS, COLUMNS] = values
    return out


def _carried(values: FloatArray, interval_s: FloatArray, columns: Int64Array) -> FloatArray:
    """Return what unit states (p,) become at each epoch, shape (n, 16, p)."""
    stretch = Stretch.over(values, interval_s, np.zeros(SIZE), is_first=True)
    start = np.zeros((SIZE, len(columns)))
    start[columns, np.arange(len(columns))] = 1.0
    nothing = kalman.Measurements.of(np.zeros(0, np.int64), np.zeros((0, len(columns))), [[0]], np.zeros((0, 1)), 1.0)
    run = kalman.run_filter(
        stretch.transition, stretch.step, nothing, kalman.Start(start, np.zeros((SIZE, SIZE))), kept=KEPT
    )
    return np.asarray(run.x[stretch.last])


def _responses(
    values: FloatArray, of_north: FloatArray, interval_s: FloatArray, resets: Int64Array, is_strapdown: bool
) -> FloatArray:
    """Return what a unit of each constant makes of the states, shape (n, 16, p)."""
    out = np.zeros((len(values), SIZE, OWN + PER_RESET * len(resets)))
    out[:, :, : len(STATE_OF)] = _carried(values, interval_s, STATE_OF)
    if is_strapdown:
        out[:, :, DRIFT_N : DRIFT_E + 1] = _carried(of_north, interval_s, CHANNELS[:, DRIFT])
        out[:, CHANNELS[:, DRIFT], DRIFT_N : DRIFT_E + 1] = 0.0  # no state of the body
    else:
        out[:, :, DRIFT_N : DRIFT_E + 1] = out[:, :, GYRO_N : GYRO_E + 1]
    for place, epoch in enumerate(resets):
        first = OWN + PER_RESET * place
        later = np.concatenate([[0.0], interval_s[epoch + 1 :]])
        out[epoch:, :, first : first + PER_RESET] = _carried(values[epoch:], later, MEASURED)
    return out


def _prior(
    covariance: FloatArray, noise: InsNoise, epochs: DifferenceEpochs, resets: int
) -> tuple[FloatArray, FloatArray]:
    """Return a root (p, p) of the covariance before the flight, and its sigmas (p,).

    Beside the coupled model's own: a drift that stays north and east, of the class's size, where gyros turn with the
    body; jumps of a reset, of which nothing is known.
    """
    count = OWN + PER_RESET * resets
    out = np.zeros((count, count))
    out[: len(STATE_OF), : len(STATE_OF)] = covariance[np.ix_(STATE_OF, STATE_OF)]
    if noise.is_strapdown:
        out[[DRIFT_N, DRIFT_E], [DRIFT_N, DRIFT_E]] = (noise.drift_dph * RADPS_PER_DPH) ** 2
    jumps = np.arange(OWN, count)
    out[jumps, jumps] = np.tile(np.diag(covariance)[MEASURED], resets)
    sigma = np.sqrt(np.diag(out))
    scale = np.where(sigma > 0.0, sigma, 1.0)
    eigenvalue, vector = np.linalg.eigh(out / np.outer(scale, scale))
    return scale[:, None] * vector * np.sqrt(np.maximum(eigenvalue, 0.0)), sigma


def _least_squares(z: FloatArray, columns: FloatArray, root: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return constants and covariance from whitened measurements (m,), columns (m, p)."""
    rows = columns @ root
    inverse = np.linalg.inv(rows.T @ rows + np.eye(root.shape[1]))
    covariance = root @ inverse @ root.T
    return root @ (inverse @ (rows.T @ z)), 0.5 * (covariance + covariance.T)


def _equivalents(
    matrices: FloatArray, seconds: FloatArray, time_s: FloatArray, prior_sigma: FloatArray, gravity_mps2: float
) -> tuple[FloatArray, FloatArray]:
    """Return the rows of mean constant drift, and of tilt at the start, shapes (2, p).

    ``matrices`` (n - 1, 16, 16) are those of the intervals.
    """
    drift, tilt = np.zeros((2, len(prior_sigma))), np.zeros((2, len(prior_sigma)))
    weight = seconds / max(float(seconds.sum()), TINY)
    since = 0.5 * (time_s[1:] + time_s[:-1]) - time_s[0]
    for channel, row in enumerate(CHANNELS[:, TILT]):
        mean = np.einsum("k,ks->s", weight, matrices[:, row])
        drift[channel, AZ] = mean[AZIMUTH]
        drift[channel, AZ_DRIFT] = float(np.sum(weight * since * matrices[:, row, AZIMUTH]))
        drift[channel, [GYRO_N, GYRO_E]] = mean[CHANNELS[:, DRIFT]]
        drift[channel, DRIFT_N + channel] = float(prior_sigma[DRIFT_N + channel] > 0.0)
        tilt[channel, TILT_N + channel] = 1.0
        force = matrices[0, CHANNELS[channel, VELOCITY]]
        tilt[channel, [BIAS_FORWARD, BIAS_RIGHT]] = -force[[FORWARD_BIAS, RIGHT_BIAS]] / gravity_mps2
    return drift, tilt


def _end_functionals(matrix: FloatArray, radius_m: float, gravity_mps2: float, schuler_radps: float) -> FloatArray:
    """Return (a, b) of the Schuler oscillation of each channel from the states, shape (4, 16)."""
    out = np.zeros((4, SIZE))
    drifts = [*CHANNELS[:, DRIFT], *CHANNELS[:, RANDOM_DRIFT], AZIMUTH]
    for channel in range(2):
        speed, tilt = CHANNELS[channel, [VELOCITY, TILT]]
        out[2 * channel, speed] = 1.0
        out[2 * channel, drifts] = radius_m * matrix[tilt, drifts]
        biases = [FORWARD_BIAS, RIGHT_BIAS]
        out[2 * channel + 1, tilt] = -gravity_mps2 / schuler_radps
        out[2 * channel + 1, biases] = matrix[speed, biases] / schuler_radps
    return out
