"""Checks of the differences: how large beside what GNSS and sway explain, how steady."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import unwrap
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95, chi_square_quantile
from groundstation.base.units import DEG_PER_RAD
from groundstation.methods.intervals import effective_samples
from groundstation.methods.moving_lines import fitted_lines, window_bounds
from groundstation.methods.taxi.samples import TaxiSamples
from groundstation.systems.heading.answer import Standstill, TaxiSegment

FloatArray = NDArray[np.float64]
LEAST_SAMPLES = 20
SWING_MPS = 0.25  # of an antenna 6 m above the roll axis: 0.6 deg of roll, rms, at 0.6 Hz
TURNED_DEG, TURN_S, FOLLOWED, TURNING_MPS = 20.0, 5.0, 0.3, 3.0  # a turn that a receiver which holds does not show
LEAST_IN_LINE = 4
LEAST_SPREAD_DEG = 1e-6  # below it there is nothing to compare


@dataclass(frozen=True)
class VarianceRatio:
    """Variance of the differences over what is expected of it, with a 95 % interval.

    expected = standstill velocity variance / V^2 over the used samples (track) + variance of the INS heading about its
    running line (sway).
    """

    ratio: float
    low: float
    high: float
    track_sigma_deg: float
    sway_sigma_deg: float


def about_running_line(
    time_s: FloatArray, heading_deg: FloatArray, segment: NDArray[np.int64], line_s: float
) -> FloatArray:
    """Return the INS heading less a straight line fitted around each sample, degrees, (n,).

    The line is fitted over ``line_s`` centred at the sample. Windows stay inside the segment. NaN where a window has
    fewer than four samples.
    """
    residual = np.full(len(time_s), np.nan)
    for number in np.unique(segment[segment > 0]):
        index = np.flatnonzero(segment == number)
        t, y = time_s[index], unwrap(heading_deg[index])
        low, high = window_bounds(t, t, line_s)
        _slope, line = fitted_lines(t, t, y, low, high)
        residual[index] = np.where(high - low >= LEAST_IN_LINE, y - line, np.nan)
    return residual


def _variance_log_sigma(values: FloatArray) -> float:
    """Return the standard deviation of the logarithm of the sample variance.

    It comes from the effective number of squares.
    """
    squares = (values - np.mean(values)) ** 2
    mean = float(np.mean(squares))
    if mean <= 0.0:
        return 0.0
    return float(np.std(squares)) / mean / float(np.sqrt(effective_samples(squares)))


def variance_ratio(
    used: TaxiSamples, difference_deg: FloatArray, standstill: Standstill | None, line_s: float
) -> VarianceRatio | None:
    """Compare the variance of the differences with that of track plus heading.

    The heading's is that about its running line.

    Parameters
    ----------
    used : TaxiSamples
        The used samples alone, arm taken out.
    difference_deg : ndarray, shape (n,)
        Their differences, what the wind makes in each direction taken off.
    standstill : Standstill or None
        Without it the track's part is not known and neither is the ratio.

    Returns
    -------
    VarianceRatio or None
        The interval takes both variances as independent, which they are not quite (both contain the sway): it is wide.

    Notes
    -----
    An antenna high above the roll axis swings with the airframe: its velocity scatters within seconds and leaves no
    error in a mean. So what the differences have in common with their neighbours, about their running line and beyond
    the sway, is expected too, up to the swing of an antenna 6 m up. White noise has nothing in common.
    """
    if standstill is None or len(used) < LEAST_SAMPLES:
        return None
    residual = about_running_line(used.time_s, used.heading_deg, used.segment, line_s)
    residual = residual[np.isfinite(residual)]
    if len(residual) < LEAST_SAMPLES:
        return None
    velocity2 = 0.5 * (standstill.sigma_north_mps**2 + standstill.sigma_east_mps**2)
    track2 = velocity2 * float(np.mean(1.0 / used.speed_mps**2)) * DEG_PER_RAD**2
    sway2 = float(np.mean(residual**2))
    difference = unwrap(difference_deg)
    about = about_running_line(used.time_s, used.heading_deg - used.track_deg, used.segment, line_s)
    swing2 = max(float(np.nanmean(about[1:] * about[:-1])) - sway2, 0.0)
    most2 = SWING_MPS**2 * float(np.mean(1.0 / used.speed_mps**2)) * DEG_PER_RAD**2
    expected = track2 + sway2 + min(swing2, most2)
    if expected <= LEAST_SPREAD_DEG**2:
        return None
    ratio = float(np.var(difference)) / expected
    spread = np.hypot(_variance_log_sigma(difference), sway2 / expected * _variance_log_sigma(residual))
    low, high = ratio * np.exp(-NORMAL_95 * spread), ratio * np.exp(NORMAL_95 * spread)
    return VarianceRatio(ratio, float(low), float(high), float(np.sqrt(track2)), float(np.sqrt(sway2)))


@dataclass(frozen=True)
class Disagreement:
    """Chi-square per degree of freedom of the errors of parts, its limit, and the worst part.

    ``told`` says in words which part is farthest off.
    """

    chi2: float
    limit: float
    told: str


def disagreement(parts: tuple[TaxiSegment, ...], probability: float, wind_deg: FloatArray) -> Disagreement | None:
    """Test whether the parts of a taxi agree with each other; None for fewer than two.

    The limit is what chance exceeds with the probability given, were the sigmas of the parts all there is beside
    ``wind_deg``, shape (parts, terms): what the sideslip of the wind, one sigma of it, makes of each part. A taxi there
    and back in a crosswind differs by that.
    """
    if len(parts) < 2:
        return None
    errors = np.array([part.error_deg for part in parts])
    variances = np.maximum(np.array([part.sigma_deg for part in parts]), 1e-9) ** 2
    inverse = np.linalg.inv(np.diag(variances) + wind_deg @ wind_deg.T)
    off = errors - float(np.sum(inverse @ errors) / np.sum(inverse))
    freedom = len(parts) - 1
    worst = int(np.argmax(off**2 / variances))
    told = f"farthest off: {parts[worst].start_s:.0f} to {parts[worst].end_s:.0f} s, by {off[worst]:+.2f} deg"
    limit = float(chi_square_quantile(1.0 - probability, freedom)) / freedom
    return Disagreement(float(off @ inverse @ off) / freedom, limit, told)


def held_seconds(samples: TaxiSamples) -> float | None:
    """Return the time the INS turns while the receiver's track does not.

    None where the taxi has no turn. A receiver that holds its velocity goes on straight: what follows the turn is off
    by all of it.
    """
    moving = np.flatnonzero((samples.speed_mps > TURNING_MPS) & np.isfinite(samples.heading_deg))
    if len(moving) < LEAST_SAMPLES or samples.interval_s <= 0.0:
        return None
    time_s = samples.time_s[moving]
    heading_deg, track_deg = unwrap(samples.heading_deg[moving]), unwrap(samples.track_deg[moving])
    before = np.searchsorted(time_s, time_s - TURN_S)
    is_near = time_s - time_s[before] > 0.5 * TURN_S
    is_near &= moving - moving[before] <= 1.5 * TURN_S / samples.interval_s
    turned, followed = heading_deg - heading_deg[before], track_deg - track_deg[before]
    turns = is_near & (np.abs(turned) > TURNED_DEG)
    if not turns.any():
        return None
    return float(np.sum(turns & (followed * np.sign(turned) < FOLLOWED * np.abs(turned)))) * samples.interval_s
