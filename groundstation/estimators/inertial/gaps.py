"""Replayed gaps with GNSS on both sides: how far a forecast from the near side, and a smoother from both, go wrong."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.records import BoolArray, Int64Array
from groundstation.estimators.inertial.differences import only_used
from groundstation.estimators.inertial.filter import Epochs, FilterRun, Initial, run_filter, smooth
from groundstation.estimators.inertial.model import POSITION, FloatArray
from groundstation.estimators.inertial.settings import InertialSettings
from groundstation.estimators.inertial.skill import QUANTILES
from groundstation.results.forecast import GapRow

LENGTHS_MIN = (10.0, 30.0, 60.0, 90.0)
AFTER_S = 5400.0  # of data used behind a gap; more hardly changes what is inside it
LEAST_AFTER_S = 300.0
MOST_STARTS = 60


@dataclass(frozen=True)
class _Replayed:
    """One gap: radial errors and whether channel errors lay inside the 95 % band, by method."""

    radial_m: dict[str, FloatArray]
    inside: dict[str, BoolArray]


def gap_rows(
    run: FilterRun, at: Int64Array, lengths_min: Sequence[float] = LENGTHS_MIN, *, settings: InertialSettings
) -> tuple[GapRow, ...]:
    """Take GNSS away from every start for each length, and compare what was made of it with what GNSS showed.

    Parameters
    ----------
    run : FilterRun
        Over the whole flight; what it knew at each start is used, nothing later but the data behind the gap.
    at : ndarray of int, shape (s,)
        Epochs at which the gaps begin.

    Notes
    -----
    ``forward`` is the filter's own forecast, ``rts`` the smoother with :data:`AFTER_S` of data behind the gap.
    """
    rows, chosen = [], at[:: max(1, -(-len(at) // MOST_STARTS))]
    for length in lengths_min:
        replayed = [
            part for part in (_replay(run, int(epoch), length * 60.0, settings) for epoch in chosen) if part is not None
        ]
        for method in ("forward", "rts"):
            largest = [np.nanmax(part.radial_m[method]) for part in replayed]
            inside = np.concatenate([part.inside[method] for part in replayed]) if replayed else np.zeros(0)
            if largest:
                rows.append(
                    GapRow(
                        method,
                        float(length),
                        len(largest),
                        max_error_rms_m=float(np.sqrt(np.mean(np.square(largest)))),
                        coverage95=float(np.mean(inside)),
                    )
                )
    return tuple(rows)


def _replay(run: FilterRun, epoch: int, length_s: float, settings: InertialSettings) -> _Replayed | None:
    """None where the gap does not fit the flight or GNSS was not there to judge it."""
    time_s = run.epochs.time_s
    end_s = time_s[epoch] + length_s
    behind = int(np.searchsorted(time_s, end_s + AFTER_S))
    first_after = int(np.searchsorted(time_s, end_s))
    if first_after >= behind or time_s[behind - 1] - end_s < LEAST_AFTER_S:
        return None
    span, inside = slice(epoch, behind), slice(1, first_after - epoch)
    measured = run.measured(0)[span][inside]
    if run.epochs.is_reset[epoch + 1 : behind].any():
        return None
    if not np.isfinite(measured).all(axis=1).any():
        return None
    cut = only_used(_without(run.epochs, span, first_after - epoch), settings)
    gate = settings.gate_sigmas**2
    forward = run_filter(cut, run.model, run.noise, gate=gate, initial=_at(run, epoch))
    smoothed = smooth(forward)
    sigmas = np.stack([forward.sigma(channel)[inside, POSITION] for channel in range(measured.shape[1])], axis=1)
    lead_s = time_s[span][inside] - time_s[epoch]
    near_s = np.minimum(lead_s, np.maximum(end_s - time_s[span][inside], 0.0))
    calibration, gnss = run.noise.calibration, run.noise.gnss
    noise = gnss.position_white_m**2 + gnss.position_correlated_m**2
    claims = {
        "forward": (forward.x[inside, POSITION], sigmas, calibration.at(lead_s)),
        "rts": (smoothed.x[inside, POSITION], np.sqrt(smoothed.variance[inside, POSITION]), calibration.at(near_s)),
    }
    radial, covered = {}, {}
    for method, (estimate, sigma, scale) in claims.items():
        error = estimate - measured
        band = QUANTILES[95] * np.sqrt(np.square(sigma * scale[:, None]) + noise)
        radial[method] = np.sqrt(np.sum(np.square(error), axis=1))
        covered[method] = (np.abs(error) <= band)[np.isfinite(error)]
    return _Replayed(radial, covered)


def _at(run: FilterRun, epoch: int) -> Initial:
    return Initial(run.x[epoch], run.P[:, epoch])


def _without(epochs: Epochs, span: slice, gap: int) -> Epochs:
    """A stretch of epochs whose first ``gap`` have no GNSS."""
    position, velocity = np.array(epochs.position_m[span]), np.array(epochs.velocity_mps[span])
    position[:gap], velocity[:gap] = np.nan, np.nan
    cut = Epochs(epochs.time_s[span], position, velocity, epochs.drag_per_s[span], epochs.is_reset[span])
    is_reset = np.array(cut.is_reset)
    is_reset[:1] = False
    return replace(cut, is_reset=is_reset)
