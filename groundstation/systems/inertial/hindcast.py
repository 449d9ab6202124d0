"""Forecast replayed from many moments of a flight, against what GNSS showed later."""

from collections.abc import Sequence
from dataclasses import field

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.systems.inertial.bank import NoiseBank, run_bank
from groundstation.systems.inertial.filter import ChannelsRun
from groundstation.systems.inertial.leads import Path, built_up
from groundstation.systems.inertial.model import FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.starts import start_states


@dataclass(frozen=True)
class Hindcast:
    """Forecasts of some methods from some starts at some leads.

    Parameters
    ----------
    at : ndarray of int, shape (s,)
        Epochs of the starts.
    start_s : ndarray, shape (s,)
    lead_s : ndarray, shape (l,)
    forecast_m : mapping of method to ndarray, shape (s, l, c)
        Position error forecast to build up since the start.
    actual_m : ndarray, shape (s, l, c)
        What GNSS showed to build up; NaN where it was absent at the start or at the lead.
    variance_m2 : mapping of method to ndarray, shape (s, l, c)
        Of methods that say themselves how far they may be off; that of GNSS, which judges them, is not in it.
    """

    at: Int64Array
    start_s: FloatArray
    lead_s: FloatArray
    forecast_m: dict[str, FloatArray]
    actual_m: FloatArray
    variance_m2: dict[str, FloatArray] = field(default_factory=dict)

    def of(self, rows: slice) -> "Hindcast":
        """The starts that ``rows`` selects."""
        forecasts, variances = (
            {method: values[rows] for method, values in part.items()} for part in (self.forecast_m, self.variance_m2)
        )
        return Hindcast(self.at[rows], self.start_s[rows], self.lead_s, forecasts, self.actual_m[rows], variances)

    def error_m(self, method: str) -> FloatArray:
        """Forecast minus actual per channel, shape (s, l, c)."""
        return self.forecast_m[method] - self.actual_m

    def radial_m(self, method: str) -> FloatArray:
        """Length of the error, shape (s, l)."""
        return np.asarray(np.sqrt(np.sum(np.square(self.error_m(method)), axis=2)))


def hindcast(
    run: ChannelsRun,
    at: Int64Array,
    lead_s: FloatArray,
    methods: Sequence[str],
    settings: InertialSettings,
    bank: NoiseBank | None = None,
) -> Hindcast:
    """Forecast from epochs ``at`` with every method.

    Parameters
    ----------
    run : ChannelsRun
    at : ndarray of int, shape (s,)
    lead_s : ndarray, shape (l,)
        Equal steps from the first: k times ``lead_s[0]``.
    bank : NoiseBank, optional
        Of the run, where it is at hand; made where ``noise_bank`` is asked for and it is not.
    """
    path = Path.of(run, at, lead_s, settings.forecast_step_s)
    forecasts, variances = {}, {}
    for method in methods:
        if method == "noise_bank":
            forecasts[method], variances[method] = (bank or run_bank(run, settings)).forecast(path)
        elif method == "raw_ins":
            forecasts[method] = np.zeros((len(at), len(lead_s), run.x.shape[2]))
        else:
            model = None if method == "hold_velocity" else run.model
            forecasts[method] = path.carried(model, start_states(method, run, at, settings))
    return Hindcast(at, path.start_s, path.lead_s, forecasts, built_up(run.epochs, at, lead_s), variances)
