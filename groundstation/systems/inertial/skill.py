"""Tables of a replayed forecast: its error and its sigma's honesty by method and horizon.

They are over starts.
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import chi_square_quantile
from groundstation.base.records import BoolArray
from groundstation.methods.ins_noise import ScaleName
from groundstation.systems.inertial.filter import ChannelsRun
from groundstation.systems.inertial.forecast_answer import CalibrationRow, SkillRow
from groundstation.systems.inertial.hindcast import Hindcast
from groundstation.systems.inertial.leads import MEMORY_S, past_mean
from groundstation.systems.inertial.model import FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.start_covariance import WITH_COVARIANCE, lead_growth, start_covariance

QUANTILES = {50: 0.6744897501960817, 68: 0.9944578832097532, 95: 1.959963984540054}  # of the normal, two-sided
# Chosen by the logarithmic score on simulated flights, straight, manoeuvring and Norilsk to Moscow
INHERITED = 0.7  # share of what is seen at one horizon that is expected at the next longer one
BOUND = 0.95
WITH_SIGMA = (*WITH_COVARIANCE, "noise_bank")


@dataclass(frozen=True)
class Claimed:
    """Sigma that a method claims per start, lead and channel, by the model and as scaled.

    Parameters
    ----------
    model_m, scaled_m : ndarrays, shape (s, l, c)
        What GNSS errs at both ends is in both: it is against GNSS that a forecast is judged.
    scale : ndarray, shape (s, l)
        What the INS part of ``model_m`` was multiplied by: the class's scale and the flight's own past before the start
        (which multiplies the part of GNSS too).
    """

    model_m: FloatArray
    scaled_m: FloatArray
    scale: FloatArray

    def of(self, rows: slice) -> "Claimed":
        """The starts that ``rows`` selects."""
        return Claimed(self.model_m[rows], self.scaled_m[rows], self.scale[rows])


def claimed_sigma(method: str, run: ChannelsRun, replay: Hindcast, settings: InertialSettings) -> Claimed | None:
    """Sigma of a method's forecast, None for a method that has none.

    Where ``replay`` itself holds one, that is taken: for the bank, and for the last estimate of the coupled model.

    The scale of a start comes from the class (so many flights' worth) and from those replayed outages that were over
    before the start: nothing later is used.
    """
    if method not in WITH_SIGMA:
        return None
    channels = replay.actual_m.shape[2]
    growth, is_own = lead_growth(run, replay.lead_s), method in replay.variance_m2
    of_class = run.noise.calibration.at(replay.lead_s, scale_of(method, is_own=is_own))
    if is_own:
        ins = replay.variance_m2[method]
    else:
        parts = [
            growth.variance(start_covariance(method, run, replay.at, channel, settings))
            for channel in range(len(run.P))
        ]
        ins = np.stack([parts[min(channel, len(parts) - 1)] for channel in range(channels)], axis=2)
    judge = growth.judge_m2[None, :, None]
    expected = np.sqrt(ins * np.square(of_class)[None, :, None] + judge)
    own = _own_scale(np.square(replay.error_m(method) / expected), replay, run)
    return Claimed(np.sqrt(ins + judge), expected * own[:, :, None], own * of_class[None, :])


def scale_of(method: str, *, is_own: bool) -> ScaleName:
    """Name the scale of its class by which a sigma is multiplied.

    ``is_own``: it is none of the two separate channels.
    """
    if method == "noise_bank":
        return "bank"
    return "coupled" if is_own else "separate"


def _own_scale(ratio: FloatArray, replay: Hindcast, run: ChannelsRun) -> FloatArray:
    """Return what the past of the flight adds to the class's scale, (s, l).

    It is the root of the mean squared ratio of error to sigma. Found at the class's horizons, from the shortest on:
    what the past of a flight shows of short outages is expected, in part, of longer ones, for which it has seen fewer
    or none. Between them it is interpolated.
    """
    calibration = run.noise.calibration
    nodes = [(lead, 60.0 * horizon) for lead, horizon in _leads(replay, calibration.horizon_min)]
    if not nodes:
        return np.ones(ratio.shape[:2])
    factor, squares = np.ones(len(ratio)), []
    for lead, seconds in nodes:
        past, weight = past_mean(ratio[:, lead].mean(axis=1)[:, None], replay.start_s, seconds, replay.start_s)
        expected = 1.0 + INHERITED * (factor - 1.0)
        factor = (calibration.weight * expected + weight * past[:, 0]) / (calibration.weight + weight)
        squares.append(factor)
    at = np.log([seconds for _, seconds in nodes])
    scales, leads = np.sqrt(np.stack(squares, axis=1)), np.log(replay.lead_s)
    return np.stack([np.interp(leads, at, row) for row in scales])


def skill_rows(
    replay: Hindcast, claimed: dict[str, Claimed | None], horizons_min: Sequence[float], first_start_s: float = 0.0
) -> tuple[SkillRow, ...]:
    """Tabulate the radial error built up, per method and horizon.

    It is over the starts from ``first_start_s`` whose horizon fits.
    """
    rows, judged = [], replay.start_s >= first_start_s - 1e-6
    for method in replay.forecast_m:
        radial, error, sigma = replay.radial_m(method), replay.error_m(method), claimed.get(method)
        for lead, horizon in _leads(replay, horizons_min):
            known = judged & np.isfinite(radial[:, lead])
            errors = radial[known, lead]
            if errors.size:
                rows.append(
                    SkillRow(
                        method,
                        float(horizon),
                        int(errors.size),
                        rms_m=float(np.sqrt(np.mean(errors**2))),
                        median_m=float(np.median(errors)),
                        p95_m=float(np.quantile(errors, BOUND)),
                        coverage95=_coverage(error[known, lead], sigma.scaled_m[known, lead], 95) if sigma else None,
                        coverage95_model=_coverage(error[known, lead], sigma.model_m[known, lead], 95)
                        if sigma
                        else None,
                    )
                )
    return tuple(rows)


def calibration_rows(
    replay: Hindcast, claimed: dict[str, Claimed | None], horizons_min: Sequence[float], first_start_s: float = 0.0
) -> tuple[CalibrationRow, ...]:
    """Tabulate coverage of the bands and NEES.

    The chi-square limits come from the number of independent starts.
    """
    rows = []
    for method, sigma in claimed.items():
        if sigma is None:
            continue
        error = replay.error_m(method)
        for lead, horizon in _leads(replay, horizons_min):
            known = (replay.start_s >= first_start_s - 1e-6) & np.isfinite(error[:, lead]).all(axis=1)
            if not known.any():
                continue
            starts_s = replay.start_s[known]
            independent = 1 + int((starts_s[-1] - starts_s[0]) / max(horizon * 60.0, MEMORY_S))
            channels = error.shape[2]
            freedom = channels * independent
            inside = {level: _coverage(error[known, lead], sigma.scaled_m[known, lead], level) for level in QUANTILES}
            rows.append(
                CalibrationRow(
                    method,
                    float(horizon),
                    int(known.sum()),
                    independent,
                    inside50=inside[50],
                    inside68=inside[68],
                    inside95=inside[95],
                    nees=float(np.mean(np.square(error[known, lead] / sigma.scaled_m[known, lead]))),
                    nees_low=float(chi_square_quantile(0.5 - 0.5 * BOUND, freedom)) / freedom,
                    nees_high=float(chi_square_quantile(0.5 + 0.5 * BOUND, freedom)) / freedom,
                    scale=float(np.mean(sigma.scale[known, lead])),
                )
            )
    return tuple(rows)


def _coverage(error: FloatArray, sigma: FloatArray, level: int) -> float:
    known: BoolArray = np.isfinite(error)
    return float(np.mean(np.abs(error[known]) <= QUANTILES[level] * sigma[known])) if known.any() else float("nan")


def _leads(replay: Hindcast, horizons_min: Sequence[float]) -> list[tuple[int, float]]:
    """Index of the lead of each horizon that was replayed."""
    minutes = replay.lead_s / 60.0
    found = [(int(np.argmin(np.abs(minutes - horizon))), float(horizon)) for horizon in horizons_min if len(minutes)]
    return [(lead, horizon) for lead, horizon in found if abs(minutes[lead] - horizon) < 1e-6]
