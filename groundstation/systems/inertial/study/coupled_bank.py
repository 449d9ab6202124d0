"""Bank of noise sets on the coupled model, to decide on the default forecast.

See docs/decisions/012.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.results.figures import FigureData
from groundstation.simulation.inertial_family import simulate_family
from groundstation.systems.inertial.bank import JUDGED_S, TRUST
from groundstation.systems.inertial.coarse import Coarse
from groundstation.systems.inertial.coupled import (
    CHANNELS,
    RATES,
    SIZE,
    coupled_matrix,
    noise_of,
    run_coupled,
)
from groundstation.systems.inertial.coupled_forecast import StepsAhead, coupled_variance, hindcast_coupled, steps_ahead
from groundstation.systems.inertial.craft_motion import CraftMotion
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, run_filter
from groundstation.systems.inertial.hindcast import Hindcast
from groundstation.systems.inertial.leads import PAST_FROM_S, built_up, past_mean, start_epochs
from groundstation.systems.inertial.model import POSITION
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import QUANTILES, claimed_sigma
from groundstation.systems.inertial.start_covariance import lead_growth
from groundstation.systems.inertial.study.cases import FilterCase, differences_of, epochs_of, model_of

LEAD_STEP_S, LEADS = 600.0, 12
STEP_S, VARIANCE_STEP_S = 10.0, 60.0
HORIZONS_MIN = (10.0, 30.0, 60.0, 90.0, 120.0)
PRIOR_OF_CLASS = 0.5  # of the class's own filter, where it is one of the sets
ALONE, WITH_CLASS = "bank", "bank and class"
PLACES = CHANNELS[:, POSITION]


@dataclass(frozen=True)
class SetForecasts:
    """Forecasts of k sets from s starts at l leads, shapes (k, s, l, 2).

    Means in metres and variances in m^2.
    """

    mean_m: FloatArray
    variance_m2: FloatArray

    def mixed(self, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the mean and variance of the mixture with weights (k, s), shapes (s, l, 2)."""
        share = weight[:, :, None, None]
        mean = np.sum(share * self.mean_m, axis=0)
        return mean, np.sum(share * (self.variance_m2 + np.square(self.mean_m - mean)), axis=0)

    def weights(self, replay: Hindcast, judge_m2: FloatArray, prior: FloatArray) -> FloatArray:
        """Return the weight of each set at each start, (k, s), from outages over by then.

        The weights are formed like those of ``bank``.
        """
        evidence = np.tile(np.log(prior), (len(replay.start_s), 1))
        for lead_s in JUDGED_S:
            lead = round(lead_s / LEAD_STEP_S) - 1
            variance = self.variance_m2[:, :, lead] + judge_m2[lead]
            error = self.mean_m[:, :, lead] - replay.actual_m[None, :, lead]
            likelihood = -0.5 * np.sum(np.square(error) / variance + np.log(variance), axis=2).T
            mean, independent = past_mean(likelihood, replay.start_s, lead_s, replay.start_s)
            evidence += TRUST * independent[:, None] * mean
        weight = np.exp(evidence - evidence.max(axis=1, keepdims=True)).T
        return np.asarray(weight / weight.sum(axis=0))


def coarse_differences(differences: InsDifferences, coarse: Coarse) -> InsDifferences:
    """Return the differences over coarse epochs, with the motion of the INS there."""
    time_s, own_s = coarse.epochs.time_s, differences.epochs.time_s
    latitude, altitude, north, east = (np.interp(time_s, own_s, part) for part in differences.motion_known)
    return replace(
        differences,
        epochs=coarse.epochs,
        latitude_deg=latitude,
        longitude_deg=np.interp(time_s, own_s, differences.longitude_deg),
        altitude_m=altitude,
        velocity_mps=np.stack([north, east], axis=1),
        heading_deg=np.rad2deg(np.interp(time_s, own_s, differences.unwrapped_heading_rad)) % 360.0,
    )


def set_forecasts(
    differences: InsDifferences, flown: ChannelsRun, replay: Hindcast, settings: InertialSettings
) -> SetForecasts:
    """Forecast with the coupled model and every noise set from the starts of a replay.

    The noise sets are those of the bank of the INS class.
    """
    coarse, known = Coarse.of(flown), flown.epochs.position_m[replay.at]
    short = coarse_differences(differences, coarse)
    runs = [run_coupled(short, coarse.noise(noise), settings, every=1) for noise in flown.noise.bank.sets(flown.noise)]
    last = np.maximum(np.searchsorted(coarse.end_s, replay.start_s + 1e-6, side="right") - 1, 0)
    seconds = replay.start_s - coarse.epochs.time_s[last]
    since = CraftMotion.over(differences, replay.start_s - seconds, seconds, is_strapdown=flown.noise.is_strapdown)
    lead_s = LEAD_STEP_S * np.arange(1.0, LEADS + 1.0)
    shape = (len(runs), len(replay.start_s), LEADS, 2)
    mean, variance = np.zeros(shape), np.zeros(shape)
    for beta in {run.noise.beta_per_s for run in runs}:  # by the decay of the random drift, which several sets share
        sets = [place for place, run in enumerate(runs) if run.noise.beta_per_s == beta]
        noise, phi = runs[sets[0]].noise, _short_transitions(since, seconds, beta)
        densities = np.array([noise_of(runs[place].noise, short, coarse.epochs, 0.0)[1] for place in sets])
        x = np.stack([(phi @ runs[place].x[last, :, None])[..., 0] for place in sets])
        P = np.stack([phi @ runs[place].P[last] @ phi.transpose(0, 2, 1) for place in sets])
        P += densities[:, None, :, None] * np.eye(SIZE) * seconds[:, None, None]
        x[:, :, PLACES], P[:, :, PLACES], P[:, :, :, PLACES] = known, 0.0, 0.0
        for ahead in steps_ahead(differences, noise, replay.start_s, lead_s, STEP_S):
            starts = x[:, ahead.starts]
            steps = np.tile(ahead.step, (len(sets), 1))
            carried = RATES.carried(ahead.values, steps, STEP_S, ahead.every, starts.reshape(-1, SIZE))
            built = carried[:, :, PLACES].reshape(*starts.shape[:2], LEADS, 2)
            mean[sets, ahead.starts] = built - known[ahead.starts, None]
        for ahead in steps_ahead(differences, noise, replay.start_s, lead_s, VARIANCE_STEP_S):
            variance[sets, ahead.starts] = grown_variances(ahead, P[:, ahead.starts], densities)
    return SetForecasts(mean, variance)


def _short_transitions(motion: CraftMotion, seconds: FloatArray, beta_per_s: float) -> FloatArray:
    """Transitions over less than a coarse epoch, to the second order, shape (s, 16, 16)."""
    A = coupled_matrix(motion, beta_per_s) * seconds[:, None, None]
    return np.eye(SIZE) + A + 0.5 * A @ A


def grown_variances(ahead: StepsAhead, P: FloatArray, densities: FloatArray) -> FloatArray:
    """Return the variance of the position at the leads for k sets, shape (k, s, l, 2).

    The rows of the transition that lead to the positions are carried back from each lead to the start. They are the
    same for all sets, and so is what they make of the noise of each state on the way.

    Parameters
    ----------
    P : ndarray, shape (k, s, 16, 16)
        Covariances at the starts.
    densities : ndarray, shape (k, 16)
    """
    count, steps = ahead.step.shape
    F = RATES.matrices(ahead.values, np.full(len(ahead.values), ahead.step_s))
    rows = np.zeros((count, LEADS, 2, SIZE))
    rows[:, :, [0, 1], PLACES] = 1.0
    entered = np.zeros_like(rows)
    for k in range(steps - 1, -1, -1):
        use = slice(k // ahead.every, None)  # leads that end behind the step
        flat = rows[:, use].reshape(count, -1, SIZE)
        back = flat @ F[ahead.step[:, k]]
        entered[:, use] += 0.5 * ahead.step_s * (np.square(flat) + np.square(back)).reshape(rows[:, use].shape)
        rows[:, use] = back.reshape(rows[:, use].shape)
    flat = rows.reshape(count, -1, SIZE)
    of_start = np.sum((flat @ P) * flat, axis=3).reshape(len(P), *rows.shape[:3])
    return np.asarray(of_start + np.moveaxis(entered @ densities.T, 3, 0))


@dataclass(frozen=True)
class BankOutcome:
    """Errors of one flight by method and horizon, shapes (m, h).

    Mean square of the radial error, m^2, and share inside the 95 % band. The coupled model with the class's noise, the
    bank on it, and the bank with the class's own filter among its sets.
    """

    mean_square_m2: FloatArray
    inside: FloatArray


METHODS = ("coupled", ALONE, WITH_CLASS)


def judge_bank(
    differences: InsDifferences, flown: ChannelsRun, truth: DifferenceEpochs, settings: InertialSettings
) -> BankOutcome:
    """Replay outages of a flight by the three methods.

    Errors are judged against ``truth``, bands against GNSS.
    """
    epochs, lead_s = flown.epochs, LEAD_STEP_S * np.arange(1.0, LEADS + 1.0)
    at = start_epochs(epochs, float(epochs.time_s[0]) + PAST_FROM_S, settings.start_step_s)
    plain = Hindcast(at, epochs.time_s[at], lead_s, {}, built_up(epochs, at, lead_s))
    coupled = run_coupled(differences, flown.noise, settings)
    of_class = hindcast_coupled(coupled, at, lead_s, settings), coupled_variance(coupled, at, lead_s)
    sets, judge_m2 = set_forecasts(differences, flown, plain, settings), lead_growth(flown, lead_s).judge_m2
    scale = np.square(flown.noise.calibration.at(lead_s, "coupled"))[None, :, None]
    more = SetForecasts(
        np.concatenate([sets.mean_m, of_class[0][None]]),
        np.concatenate([sets.variance_m2, (scale * of_class[1])[None]]),
    )
    count = len(sets.mean_m)
    equal = np.full(count, 1.0 / count)
    prior = np.append((1.0 - PRIOR_OF_CLASS) * equal, PRIOR_OF_CLASS)
    found = (
        ("last_estimate", *of_class),
        ("noise_bank", *sets.mixed(sets.weights(plain, judge_m2, equal))),
        ("noise_bank", *more.mixed(more.weights(plain, judge_m2, prior))),
    )
    leads = [round(60.0 * minutes / LEAD_STEP_S) - 1 for minutes in HORIZONS_MIN]
    judged, actual = plain.start_s >= settings.first_start_s - 1e-6, built_up(truth, at, lead_s)
    unscaled = replace(flown, noise=replace(flown.noise, calibration=replace(flown.noise.calibration, bank_scale=())))
    squares, inside = [], []
    for method, mean, variance in found:
        replay = replace(plain, forecast_m={method: mean}, variance_m2={method: variance})
        claimed = claimed_sigma(method, unscaled, replay, settings)
        assert claimed is not None
        known = np.isfinite(plain.actual_m[judged][:, leads])
        error = np.where(known, (mean - plain.actual_m)[judged][:, leads], 0.0)
        is_inside = (np.abs(error) <= QUANTILES[95] * claimed.scaled_m[judged][:, leads]) & known
        inside.append(is_inside.sum(axis=(0, 2)) / known.sum(axis=(0, 2)))
        true_error = np.where(known, (mean - actual)[judged][:, leads], 0.0)
        squares.append(np.square(true_error).sum(axis=(0, 2)) / known[:, :, 0].sum(axis=0))
    return BankOutcome(np.array(squares), np.array(inside))


def fly_bank(case: FilterCase, run: int, settings: InertialSettings) -> BankOutcome:
    """Fly one flight of a case and judge the bank on it."""
    batch = simulate_family(case.family, 1, case.seed, first_run=run)
    epochs = epochs_of(case, batch, 0)
    flown = run_filter(epochs, model_of(case, batch, 0), case.noise, gate=case.gate)
    truth = DifferenceEpochs.plain(epochs.time_s, batch.position_error_m[0], batch.velocity_error_mps[0])
    return judge_bank(differences_of(batch, 0, epochs), flown, truth, settings)


def bank_table(outcomes: Mapping[str, Sequence[BankOutcome]]) -> FigureData:
    """Tabulate RMS ratio and coverage by case, method and horizon.

    The ratio is over the RMS of the coupled model with the class's noise.
    """
    rows = []
    for case, several in outcomes.items():
        rms = np.sqrt(np.mean([one.mean_square_m2 for one in several], axis=0))
        inside = np.mean([one.inside for one in several], axis=0)
        for place, method in enumerate(METHODS):
            for at, horizon in enumerate(HORIZONS_MIN):
                figures = (float(rms[place, at]), float(rms[place, at] / rms[0, at]), float(inside[place, at]))
                rows.append((case, method, horizon, len(several), *figures))
    names = ("case", "method", "horizon_min", "flights", "rms_m", "over_coupled", "coverage95")
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData(
        "forecast_coupled_bank", columns, {"horizon_min": 0, "rms_m": 1, "over_coupled": 3, "coverage95": 3}
    )
