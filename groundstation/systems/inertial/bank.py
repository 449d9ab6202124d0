"""Bank of noise sets: filters with different noise, weighted by their past forecasts.

No one set of noise serves every INS of a class and every way of flying. Each set of the bank has a filter of its own.
Outages that were over before a start tell how likely each set is; the forecast is the mixture of the sets' forecasts,
its variance the mixture's.

Source: D. T. Magill, Optimal adaptive estimation of sampled stochastic processes, IEEE Trans. Automatic Control 10,
1965 (a bank of filters); weights here come from forecasts at the horizons that matter, not from one step ahead: a set
that predicts the next second best is not the one that forecasts the next hour best.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.systems.inertial.coarse import Coarse
from groundstation.systems.inertial.filter import ChannelsRun, Initial, initial_of, run_filter
from groundstation.systems.inertial.leads import PAST_FROM_S, Path, built_up, leads_of, past_mean, start_epochs
from groundstation.systems.inertial.model import POSITION, FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.start_covariance import lead_growth

# Horizons at which finished outages tell the sets apart: multiples of the first
JUDGED_S = (600.0, 1800.0, 3600.0)
# Share of the logarithmic likelihood that counts: the horizons tell partly the same. Chosen on simulated flights
TRUST = 0.6


@dataclass(frozen=True)
class NoiseBank:
    """The filters of a bank over one flight.

    Parameters
    ----------
    flown : ChannelsRun
        The flight's own filter, over its own epochs.
    runs : tuple of ChannelsRun
        One for each set, over coarse epochs.
    end_s : ndarray, shape (n,)
        Time of the last sample that is in each coarse epoch.
    settings : InertialSettings
    """

    flown: ChannelsRun
    runs: tuple[ChannelsRun, ...]
    end_s: FloatArray
    settings: InertialSettings

    def __post_init__(self) -> None:
        object.__setattr__(self, "end_s", frozen(self.end_s))

    def forecast(self, path: Path) -> tuple[FloatArray, FloatArray]:
        """Forecast mean and variance of the mixture from every start at every lead.

        Metres and m^2, shapes (s, l, c).
        """
        weight = self.weights(path.start_s)[:, :, None, None]
        means, variances = self._each(path)
        mean = np.sum(weight * means, axis=0)
        return mean, np.sum(weight * (variances + np.square(means - mean)), axis=0)

    def weights(self, start_s: FloatArray) -> FloatArray:
        """Return the weight of each set at each start, shape (k, s); equal before any outage.

        Only outages that were over by then count.
        """
        evidence = np.zeros((len(start_s), len(self.runs)))
        for lead_s, (begun_s, likelihood) in self._evidence.items():
            mean, independent = past_mean(likelihood, begun_s, lead_s, start_s)
            evidence += TRUST * independent[:, None] * mean
        weight = np.exp(evidence - evidence.max(axis=1, keepdims=True)).T
        return np.asarray(weight / weight.sum(axis=0))

    @cached_property
    def _evidence(self) -> dict[float, tuple[FloatArray, FloatArray]]:
        """Return starts (s,) and log likelihood (s, k) of what GNSS showed by each set.

        Keyed by horizon.
        """
        epochs = self.flown.epochs
        found: dict[float, tuple[FloatArray, FloatArray]] = {}
        at = start_epochs(epochs, float(epochs.time_s[0]) + PAST_FROM_S, self.settings.start_step_s)
        if not len(at):  # a short flight has no past to judge by
            return found
        path = Path.of(self.flown, at, leads_of(JUDGED_S[0], JUDGED_S[-1]), self.settings.forecast_step_s)
        starts = self.starts(path.start_s)
        means = self._means(path, starts)
        for lead_s in JUDGED_S:
            leads = np.array([lead_s])
            variances = self._variances(leads, starts) + lead_growth(self.flown, leads).judge_m2[None, None, :, None]
            error = means[:, :, [round(lead_s / JUDGED_S[0]) - 1]] - built_up(epochs, at, leads)
            likelihood = -0.5 * np.sum(np.square(error) / variances + np.log(variances), axis=(2, 3))
            found[lead_s] = (path.start_s, likelihood.T)
        return found

    def _each(self, path: Path) -> tuple[FloatArray, FloatArray]:
        """Mean and variance of every set, shapes (k, s, l, c)."""
        starts = self.starts(path.start_s)
        return self._means(path, starts), self._variances(path.lead_s, starts)

    def _means(self, path: Path, starts: list[Initial]) -> FloatArray:
        pairs = zip(self.runs, starts, strict=True)
        return np.stack([path.carried(run.model, start.x) for run, start in pairs])

    def _variances(self, lead_s: FloatArray, starts: list[Initial]) -> FloatArray:
        variances = []
        for run, start in zip(self.runs, starts, strict=True):
            growth = lead_growth(run, lead_s)
            parts = [growth.variance(start.P[:, group]) for group in range(start.P.shape[1])]
            channels = range(start.x.shape[2])
            variances.append(np.stack([parts[min(channel, len(parts) - 1)] for channel in channels], axis=2))
        return np.stack(variances)

    def starts(self, start_s: FloatArray) -> list[Initial]:
        """Return the state of each set at some times, from nothing later, its position known.

        x (s, 6, c), P (s, g, 6, 6).
        """
        time_s = self.runs[0].epochs.time_s
        last = np.maximum(np.searchsorted(self.end_s, start_s + 1e-6, side="right") - 1, 0)
        seconds = np.round(np.maximum(start_s - time_s[last], 0.0), 3)
        distinct, which = np.unique(seconds, return_inverse=True)
        found = []
        for run in self.runs:
            density = run.noise.densities()
            phi = np.stack([run.model.transition_over(float(part)) for part in distinct])[which]
            added = np.stack([run.model.process_noise_over(float(part), density) for part in distinct])[which]
            x, P = phi @ run.x[last], phi @ run.P[:, last] @ phi.transpose(0, 2, 1) + added
            P = P.transpose(1, 0, 2, 3)
            x[:, POSITION] = P[:, :, POSITION] = P[..., POSITION] = 0.0
            found.append(Initial(x, P))
        return found


def run_bank(run: ChannelsRun, settings: InertialSettings) -> NoiseBank:
    """Filter a flight with every set of its class's bank.

    None of them uses what the flight's own filter rejected.
    """
    coarse, runs = Coarse.of(run), []
    for noise in run.noise.bank.sets(run.noise):
        model = replace(run.model, beta_per_s=noise.beta_per_s)
        initial = initial_of(coarse.epochs, noise)
        runs.append(run_filter(coarse.epochs, model, coarse.noise(noise), initial=initial))
    return NoiseBank(run, tuple(runs), coarse.end_s, settings)
