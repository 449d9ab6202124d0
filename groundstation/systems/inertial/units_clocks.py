"""Clocks of several units against each other, and units that repeat another."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import student_quantile
from groundstation.base.records import BoolArray
from groundstation.systems.inertial.units_answer import Measured
from groundstation.systems.inertial.units_track import UnitTrack
from groundstation.tables.motion import window_sum

HALF_WINDOW = 30  # rows of the running mean that is taken off: slow errors of the units
MOST_LATE_S = 600.0
LEAST_MOTION_MPS = 0.5  # RMS about the running mean, for a clock to show
LEAST_CORRELATION = 0.5
LEAST_LATE_S = 0.05  # 10 m at 200 m/s; less is not taken off
LEAST_HALF_S = 0.002  # interpolation between the rows
TIMES_HALF = 1.5  # of its interval, for a delay to be taken off
STEPS = 4
ROBUST = 5.0
BLOCK = 60  # rows that are taken as one when the interval is found
FEWEST_SAME, SAME_SHARE, SAME_S = 100, 0.95, 1.0


@dataclass(frozen=True)
class ClockFit:
    """Delay of a second unit's stamps in the middle, and how much more at the end."""

    late_s: Measured
    more_s: Measured

    @property
    def taken_off(self) -> tuple[float, float]:
        """The parts of it that are sure and large enough to be taken off."""
        return _sure(self.late_s), _sure(self.more_s)


def _sure(one: Measured) -> float:
    return one.value if abs(one.value) > max(LEAST_LATE_S, TIMES_HALF * one.half95) else 0.0


def clock_fit(first_mps: FloatArray, second_mps: FloatArray, step_s: float) -> ClockFit | None:
    """Fit how late the velocity of a second unit is behind that of a first one.

    None where the motion does not show it.

    Parameters
    ----------
    first_mps, second_mps : ndarray, shape (n, 2)
        North and east on one grid, NaN where unknown.
    step_s : float
        Of the grid.

    Notes
    -----
    second(t) = first(t - late) + scale first + azimuth (first turned by 90 deg), all less their running means, so that
    slow errors count for nothing. Coarsely by the peak of the correlation, then least squares in steps; the interval is
    the sandwich over blocks of a minute.
    """
    known = np.asarray(np.isfinite(first_mps).all(axis=1) & np.isfinite(second_mps).all(axis=1))
    if known.sum() < 4 * HALF_WINDOW:
        return None
    first, second = _quick(first_mps), _quick(second_mps)
    if min(_rms(first), _rms(second)) < LEAST_MOTION_MPS:
        return None
    coarse = _by_correlation(first, second, int(MOST_LATE_S / step_s))
    if coarse is None:
        return None
    return _refined(first_mps, second, known, coarse * step_s, step_s)


def _filled(values: FloatArray) -> FloatArray:
    rows = np.arange(len(values))
    out = np.empty_like(values)
    for axis in range(values.shape[1]):
        known = np.isfinite(values[:, axis])
        out[:, axis] = np.interp(rows, rows[known], values[known, axis]) if known.any() else 0.0
    return out


def _quick(values: FloatArray) -> FloatArray:
    """Return values less their running mean; 0 where they are unknown."""
    filled = _filled(values)
    number = window_sum(np.ones(len(filled)), HALF_WINDOW)
    mean = np.column_stack([window_sum(np.ascontiguousarray(axis), HALF_WINDOW) / number for axis in filled.T])
    return np.where(np.isfinite(values), filled - mean, 0.0)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))


def _by_correlation(first: FloatArray, second: FloatArray, most: int) -> int | None:
    size = 2 ** int(np.ceil(np.log2(2 * len(first))))
    total = np.zeros(size)
    for one, other in zip(first.T, second.T, strict=True):
        total += np.fft.irfft(np.fft.rfft(other, size) * np.conj(np.fft.rfft(one, size)), size)
    most = min(most, len(first) // 2)
    lags = np.concatenate([np.arange(0, most + 1), np.arange(-most, 0)])
    best = int(lags[int(np.argmax(total[lags]))])
    whole = np.sqrt(np.sum(first**2) * np.sum(second**2))
    return best if total[best] > LEAST_CORRELATION * whole else None


def _refined(
    first_mps: FloatArray, second: FloatArray, known: BoolArray, late_s: float, step_s: float
) -> ClockFit | None:
    rows = np.arange(len(second)) * step_s
    share = np.linspace(-1.0, 1.0, len(rows))
    filled, more_s = _filled(first_mps), 0.0
    for _ in range(STEPS):
        at = rows - late_s - more_s * share
        shown = _quick(np.column_stack([np.interp(at, rows, axis) for axis in filled.T]))
        rate = np.gradient(shown, step_s, axis=0)
        turned = np.column_stack([-shown[:, 1], shown[:, 0]])
        design = np.stack([-rate, -rate * share[:, None], shown, turned], axis=-1)
        left = second - shown
        size = np.hypot(*left.T)
        usual = float(np.median(size[known])) / 0.6745 + 1e-6
        weight = known & (size < ROBUST * usual) & (at >= rows[0]) & (at <= rows[-1])
        found = _least_squares(design * weight[:, None, None], left * weight[:, None])
        if found is None:
            return None
        solved, half = found
        late_s, more_s = late_s + float(solved[0]), more_s + float(solved[1])
    late_half, more_half = (float(np.hypot(one, LEAST_HALF_S)) for one in half[:2])
    return ClockFit(Measured(late_s, late_half), Measured(more_s, more_half))


def _least_squares(design: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return the solution of design (n, 2, p) for target (n, 2), and half the 95 % intervals."""
    flat = design.reshape(-1, design.shape[-1])
    normal = flat.T @ flat
    if np.linalg.cond(normal) > 1e12:
        return None
    solved = np.linalg.solve(normal, flat.T @ target.reshape(-1))
    scores = np.einsum("nap,na->np", design, target - design @ solved)
    cuts = np.arange(0, len(scores), BLOCK)
    blocks = np.add.reduceat(scores, cuts, axis=0)
    inverse = np.linalg.inv(normal)
    variance = np.diag(inverse @ (blocks.T @ blocks) @ inverse)
    weight = np.add.reduceat(np.sum(design[..., 0] ** 2, axis=1), cuts)
    freedom = max(float(weight.sum() ** 2 / max(np.sum(weight**2), 1e-300)) - 1.0, 1.0)
    return np.asarray(solved), student_quantile(0.975, freedom) * np.sqrt(np.maximum(variance, 0.0))


def repeats(first: UnitTrack, second: UnitTrack) -> tuple[float, int] | None:
    """Tell how much later, and in how many rows, a second unit repeats the first.

    None where it has its own, or too few numbers that differ from each other, as at rest.
    """
    names = [np.isfinite(one.latitude_deg).any() for one in (first, second)]
    columns = [
        np.column_stack([*((one.latitude_deg, one.longitude_deg) if all(names) else ()), one.velocity_mps])
        for one in (first, second)
    ]
    seen: list[tuple[dict[bytes, float], int]] = []
    for one, values in zip((first, second), columns, strict=True):
        rows = np.isfinite(values).all(axis=1)
        texts = np.ascontiguousarray(values[rows])
        seen.append(({row.tobytes(): at for row, at in zip(texts, one.time_s[rows], strict=True)}, int(rows.sum())))
    fewer = min(len(seen[0][0]), len(seen[1][0]))
    both = [key for key in seen[1][0] if key in seen[0][0]]
    if len(both) < max(FEWEST_SAME, SAME_SHARE * fewer):
        return None
    later = np.array([seen[1][0][key] - seen[0][0][key] for key in both])
    middle = float(np.median(later))
    if np.mean(np.abs(later - middle) < SAME_S) < SAME_SHARE:
        return None
    return middle, len(both)
