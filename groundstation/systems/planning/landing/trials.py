"""Simulated approaches: drawn errors are filtered and compared with the filter's sigmas."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.methods.intervals import nees_limits
from groundstation.systems.planning.landing.filter import filter_ranges, nominal_readings, with_errors
from groundstation.systems.planning.landing.model import PLACE, ErrorModel, error_model
from groundstation.systems.planning.landing.scenario import RangeApproach

FREEDOM = 3


@dataclass(frozen=True)
class Trials:
    """Errors of t approaches at m places under one filter.

    Parameters
    ----------
    time_s, before_threshold_m : ndarrays, shape (m,)
    error_m, sigma_m : ndarrays, shape (t, m, 3)
        Estimate minus truth along, right and up; what the filter computes.
    nees : ndarray, shape (t, m)
        Three degrees of freedom.
    innovation_square : ndarray, shape (t,)
        Mean squared innovation over its variance.
    """

    time_s: FloatArray
    before_threshold_m: FloatArray
    error_m: FloatArray
    sigma_m: FloatArray
    nees: FloatArray
    innovation_square: FloatArray

    def __post_init__(self) -> None:
        for name in ("time_s", "before_threshold_m", "error_m", "sigma_m", "nees", "innovation_square"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def limits(self) -> tuple[float, float]:
        """Limits (95 %) of the mean NEES of so many trials."""
        return nees_limits(FREEDOM, len(self.error_m))

    @property
    def overconfidence(self) -> FloatArray:
        """RMS error over the computed sigma, shape (m, 3)."""
        return np.asarray(np.sqrt(np.mean((self.error_m / self.sigma_m) ** 2, axis=0)))


def fly_trials(scenario: RangeApproach, *, models_correlation: bool = True) -> Trials:
    """Draw and filter the trials of a scenario; every filter sees the same ones.

    Parameters
    ----------
    scenario : RangeApproach
        Its correlated errors are drawn, whether the filter models them or not.
    models_correlation : bool
    """
    truth, nominal = error_model(scenario, has_slow_errors=True), nominal_readings(scenario)
    found = []
    for trial in range(scenario.trials):
        rng = np.random.default_rng([scenario.seed, trial])
        errors = draw_errors(rng, truth, len(nominal.place_m))
        white_m = scenario.noise.white_m * rng.standard_normal(nominal.range_m.shape)
        track = filter_ranges(
            scenario, with_errors(nominal, truth, errors, white_m), models_correlation=models_correlation
        )
        kept = np.searchsorted(scenario.time_s, track.time_s - 1e-9)
        error_m = track.correction_m - errors[kept][:, PLACE]
        solved = np.linalg.solve(track.covariance_m2, error_m[..., None])[..., 0]
        found.append((error_m, track.sigma_m, (error_m * solved).sum(axis=1), float(np.mean(track.innovation**2))))
    error, sigma, nees, innovation = (np.array(part) for part in zip(*found, strict=True))
    return Trials(track.time_s, -track.true_m[:, 0], error, sigma, nees, innovation)


def draw_errors(rng: np.random.Generator, model: ErrorModel, steps: int) -> FloatArray:
    """Draw one history of the errors of a model, shape (steps, n).

    Source: Gelb, Applied Optimal Estimation, 1974, section 3.7.
    """
    noise = rng.standard_normal((steps, model.size)) @ _root(model.Q).T
    x = np.empty((steps, model.size))
    x[0] = _root(model.P0) @ rng.standard_normal(model.size)
    for k in range(1, steps):
        x[k] = model.F @ x[k - 1] + noise[k]
    return x


def _root(covariance: FloatArray) -> FloatArray:
    """A matrix whose product with its transpose is a covariance that may lack rank."""
    variances, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.sqrt(np.clip(variances, 0.0, None)))
