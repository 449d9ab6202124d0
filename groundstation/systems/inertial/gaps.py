"""Replayed gaps with GNSS on both sides: errors of a forecast and of a smoother.

The forecast starts from the near side, the smoother uses both.
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.systems.inertial.coarse import Coarse
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, Initial, run_filter, smooth
from groundstation.systems.inertial.forecast_answer import GapRow
from groundstation.systems.inertial.model import POSITION, FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import QUANTILES

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
    run: ChannelsRun, at: Int64Array, lengths_min: Sequence[float] = LENGTHS_MIN, *, settings: InertialSettings
) -> tuple[GapRow, ...]:
    """Take GNSS away from every start for each length, and compare the result with GNSS.

    Parameters
    ----------
    run : ChannelsRun
        Over the whole flight; what it knew at each start is used, nothing later but the data behind the gap.
    at : ndarray of int, shape (s,)
        Epochs at which the gaps begin.

    Notes
    -----
    ``forward`` is the filter's own forecast, ``rts`` the smoother with :data:`AFTER_S` of data behind the gap, over the
    coarse epochs of :class:`coarse.Coarse`; both are judged at every epoch.
    """
    rows, chosen, coarse = [], at[:: max(1, -(-len(at) // MOST_STARTS))], Coarse.of(run)
    for length in lengths_min:
        replayed = [
            part
            for part in (_replay(run, coarse, int(epoch), length * 60.0, settings) for epoch in chosen)
            if part is not None
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


def _replay(
    run: ChannelsRun, coarse: Coarse, epoch: int, length_s: float, settings: InertialSettings
) -> _Replayed | None:
    """Replay one gap; None where it does not fit the flight or GNSS cannot judge it."""
    time_s = run.epochs.time_s
    begin_s, end_s = float(time_s[epoch]), float(time_s[epoch]) + length_s
    behind = int(np.searchsorted(time_s, end_s + AFTER_S))
    inside = slice(epoch + 1, int(np.searchsorted(time_s, end_s)))
    if inside.stop >= behind or time_s[behind - 1] - end_s < LEAST_AFTER_S:
        return None
    measured = run.measured(0)[inside]
    if run.epochs.is_reset[epoch + 1 : behind].any() or not np.isfinite(measured).all(axis=1).any():
        return None
    cut = coarse.blinded(epoch, begin_s, end_s, end_s + AFTER_S)
    noise, gate = coarse.noise(run.noise), settings.gate_sigmas**2
    forward = run_filter(cut, run.model, noise, gate=gate, initial=Initial(run.x[epoch], run.P[:, epoch]))
    smoothed, channels = smooth(forward), range(measured.shape[1])
    lead_s = time_s[inside] - begin_s
    near_s = np.minimum(lead_s, np.maximum(end_s - time_s[inside], 0.0))
    calibration, gnss = run.noise.calibration, run.noise.gnss
    judge_m2 = gnss.position_white_m**2 + gnss.position_correlated_m**2
    own_m2 = np.stack([forward.covariance_beforehand(channel)[:, POSITION, POSITION] for channel in channels], axis=1)
    claims = {
        "forward": (forward.x[:, POSITION], own_m2, calibration.at(lead_s)),
        "rts": (smoothed.x[:, POSITION], smoothed.variance[:, POSITION], calibration.at(near_s)),
    }
    radial, covered = {}, {}
    for method, (estimates, variances, scale) in claims.items():
        estimate, variance = (_at(time_s[inside], cut, values) for values in (estimates, variances))
        error = estimate - measured
        band = QUANTILES[95] * np.sqrt(variance * np.square(scale)[:, None] + judge_m2)
        radial[method] = np.sqrt(np.sum(np.square(error), axis=1))
        covered[method] = (np.abs(error) <= band)[np.isfinite(error)]
    return _Replayed(radial, covered)


def _at(time_s: FloatArray, epochs: DifferenceEpochs, values: FloatArray) -> FloatArray:
    """Columns of values at the epochs, (n, c), between them."""
    return np.stack([np.interp(time_s, epochs.time_s, column) for column in values.T], axis=1)
