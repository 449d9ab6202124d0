"""Arrays behind the figures of the heading tab and the report.

Names and columns are fixed, times are flight seconds.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.methods.taxi.samples import TaxiSamples
from groundstation.results.arrays.typed import joined
from groundstation.results.figures import FigureData
from groundstation.systems.heading.arrays import (
    HeadingDistribution,
    HeadingGrowth,
    HeadingLanes,
    HeadingNormal,
    HeadingRunning,
    HeadingSamples,
    HeadingSpectrum,
    StandstillMeanSpeed,
    StandstillVelocity,
)
from groundstation.systems.heading.recursion import Running
from groundstation.systems.heading.standstill import StandstillData

FloatArray = NDArray[np.float64]
NORMAL_POINTS = 600
FIRST_MOTION_MPS = 1.0
LEAST_HALF_WIDTH_DEG = 0.05  # of the histogram
PAUSE_S = 30.0  # a longer one between epochs (a flight between ground runs) breaks the lines
IN_PAUSE = "no ground run"


def _moving_part(samples: TaxiSamples) -> slice:
    moving = np.flatnonzero((samples.speed_mps > FIRST_MOTION_MPS) | samples.is_used)
    return slice(int(moving[0]), len(samples)) if len(moving) else slice(0, len(samples))


def _pauses(time_s: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Epochs before each pause, and the times of the rows behind them that break lines."""
    before = np.flatnonzero(np.diff(time_s) > PAUSE_S)
    return before, time_s[before] + (float(np.median(np.diff(time_s))) if len(before) else 0.0)


def samples_figure(samples: TaxiSamples, error_deg: float, weight: FloatArray) -> HeadingSamples:
    """Return every epoch from first motion to lift-off, used or not and why.

    ``weight`` has mean 1 over the used samples.
    """
    part = _moving_part(samples)
    difference = samples.difference_deg
    # Below walking pace the direction of a velocity is noise.
    difference = np.where(samples.speed_mps > FIRST_MOTION_MPS, difference, np.nan)
    found = HeadingSamples(
        time_s=samples.time_s,
        segment=samples.segment,
        heading_deg=samples.heading_deg,
        track_deg=np.where(samples.speed_mps > FIRST_MOTION_MPS, samples.track_deg, np.nan),
        ground_speed_mps=samples.speed_mps,
        difference_deg=difference,
        residual_deg=wrap_180(difference - error_deg),
        is_used=samples.is_used,
        gate=samples.gate,
        weight=weight,
    ).where(part)
    before, break_s = _pauses(found.time_s)
    return found.with_breaks(before, time_s=break_s, gate=IN_PAUSE)


def lanes_figure(samples: TaxiSamples) -> HeadingLanes:
    """Runs of equal gate, from first motion on."""
    part = _moving_part(samples)
    before, break_s = _pauses(samples.time_s[part])
    time_s = np.insert(samples.time_s[part], before + 1, break_s)
    gate = np.insert(samples.gate[part], before + 1, IN_PAUSE)
    edges = np.flatnonzero(gate[1:] != gate[:-1]) + 1
    starts = np.concatenate([[0], edges]) if len(gate) else np.zeros(0, dtype=np.int64)
    ends = np.concatenate([edges, [len(gate) - 1]]) if len(gate) else np.zeros(0, dtype=np.int64)
    return HeadingLanes(start_s=time_s[starts], end_s=time_s[ends], state=gate[starts])


def running_figure(
    time_s: FloatArray, running: Running, growth_samples: NDArray[np.int64], growth_half_width_deg: FloatArray
) -> HeadingRunning:
    """Return the paper's running figures and the half width of the honest interval.

    The half width is held between the steps it was computed at.
    """
    count = np.arange(1, len(time_s) + 1)
    held = np.searchsorted(growth_samples, count, side="right") - 1
    half_width = np.where(held >= 0, growth_half_width_deg[np.maximum(held, 0)], np.nan)
    found = HeadingRunning(
        time_s=time_s,
        cycles=count,
        mean_deg=running.mean_deg,
        sigma_deg=running.sigma_deg,
        precision_deg=running.precision_deg,
        quality_deg=running.quality_deg,
        honest_half_width_deg=half_width,
    )
    before, break_s = _pauses(time_s)
    return found.with_breaks(before, time_s=break_s, cycles=count[before])


def _bin_edges(difference_deg: FloatArray) -> FloatArray:
    """Bins over all differences: a fifth of their spread wide, 20 to 80 of them."""
    spread = max(float(np.std(difference_deg)), LEAST_HALF_WIDTH_DEG / 4.0)
    centre = float(np.mean(difference_deg))
    half = max(float(np.max(np.abs(difference_deg - centre))), 4.0 * spread) * 1.001
    count = int(np.clip(np.ceil(2.0 * half / (0.25 * spread)), 20, 80))
    return np.linspace(centre - half, centre + half, count + 1)


def distribution_figures(time_s: FloatArray, difference_deg: FloatArray, steps: int) -> tuple[FigureData, ...]:
    """Return the final histogram, the fitted normal, and the histogram as it grows.

    The growing one is a density over the same bins.
    """
    edges = _bin_edges(difference_deg)
    width = float(edges[1] - edges[0])
    count = len(difference_deg)
    density = np.histogram(difference_deg, edges)[0] / (count * width)
    mean, sigma = float(np.mean(difference_deg)), max(float(np.std(difference_deg)), 1e-6)
    points = np.linspace(edges[0], edges[-1], NORMAL_POINTS)
    normal = np.exp(-0.5 * ((points - mean) / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))

    ends = np.unique(np.linspace(min(10, count), count, min(steps, count)).astype(np.int64))
    place = np.clip(np.searchsorted(edges, difference_deg, side="right") - 1, 0, len(edges) - 2)
    growth = np.empty((len(ends), len(edges) - 1))
    for step, end in enumerate(ends):
        growth[step] = np.bincount(place[:end], minlength=len(edges) - 1) / (end * width)
    centers = 0.5 * (edges[1:] + edges[:-1])
    return (
        HeadingDistribution(bin_low_deg=edges[:-1], bin_high_deg=edges[1:], density_per_deg=density),
        HeadingNormal(difference_deg=points, density_per_deg=normal),
        HeadingGrowth(
            step=np.repeat(np.arange(len(ends)), len(centers)),
            time_s=np.repeat(time_s[ends - 1], len(centers)),
            bin_center_deg=np.tile(centers, len(ends)),
            density_per_deg=growth.ravel(),
        ),
    )


def standstill_figures(samples: TaxiSamples, standstill: StandstillData) -> tuple[FigureData, ...]:
    """Return the velocity at standstill, and the density of the speed of its mean.

    The mean is over 10 s and 30 s.
    """
    still = standstill.is_still
    if not still.any():
        return ()
    velocity = StandstillVelocity(
        time_s=samples.time_s[still],
        velocity_north_mps=samples.north_mps[still],
        velocity_east_mps=samples.east_mps[still],
        is_in_interval=standstill.in_interval[still],
    )
    return velocity, joined([_mean_speed_density(samples, standstill, window_s) for window_s in (10.0, 30.0)])


def _mean_speed_density(samples: TaxiSamples, standstill: StandstillData, window_s: float) -> StandstillMeanSpeed:
    """Return the histogram of the length of the mean velocity over windows.

    Windows overlap by three quarters.
    """
    lengths: list[float] = []
    for first, end in standstill.stretches:
        time_s = samples.time_s[first:end]
        sums = [np.concatenate([[0.0], np.cumsum(part[first:end])]) for part in (samples.north_mps, samples.east_mps)]
        for start in np.arange(time_s[0], time_s[-1] - window_s + 1e-6, window_s / 4.0):
            low, high = np.searchsorted(time_s, [start - 1e-6, start + window_s + 1e-6])
            if high - low > 1:
                lengths.append(float(np.hypot(*(part[high] - part[low] for part in sums)) / (high - low)))
    if not lengths:
        empty = np.zeros(0)
        return StandstillMeanSpeed(window_s=empty, speed_of_mean_mps=empty, density_per_mps=empty)
    top = max(max(lengths) * 1.05, 0.02)
    edges = np.linspace(0.0, top, 21)
    density = np.histogram(lengths, edges)[0] / (len(lengths) * (edges[1] - edges[0]))
    centers = 0.5 * (edges[1:] + edges[:-1])
    return StandstillMeanSpeed(window_s=np.full(20, window_s), speed_of_mean_mps=centers, density_per_mps=density)


def spectrum_figure(
    time_s: FloatArray, residual_deg: FloatArray, speed_mps: FloatArray, parameters: FloatArray
) -> HeadingSpectrum | None:
    """Return the spectral density of the residuals and of the fitted noise model.

    Both are one-sided, deg^2/Hz. The periodogram is that of unevenly kept samples, smoothed over neighbouring
    frequencies; the model is given at the root-mean-square inverse speed.
    """
    count = len(time_s)
    span = float(time_s[-1] - time_s[0]) if count > 1 else 0.0
    if count < 40 or span < 5.0:
        return None
    step = float(np.median(np.diff(time_s)))
    frequency = np.geomspace(1.0 / span, 0.45 / step, 60)
    phase = 2.0 * np.pi * frequency[:, None] * (time_s - time_s[0])[None, :]
    taper = np.sin(np.pi * (np.arange(count) + 0.5) / count)
    values = (residual_deg - np.mean(residual_deg)) * taper
    transform = np.abs((np.cos(phase) @ values) ** 2 + (np.sin(phase) @ values) ** 2)
    measured = 2.0 * step * transform / float(np.sum(taper**2))
    smooth = np.convolve(np.pad(measured, 2, mode="edge"), np.full(5, 0.2), mode="valid")
    model = model_density(frequency, parameters, float(np.sqrt(np.mean(1.0 / speed_mps**2))), step)
    return HeadingSpectrum(frequency_hz=frequency, density_deg2_per_hz=smooth, model_deg2_per_hz=model)


def model_density(frequency_hz: FloatArray, parameters: FloatArray, inverse_speed: float, step_s: float) -> FloatArray:
    """Return the one-sided spectral density of the noise model, deg^2/Hz.

    Parameters are as in ``noise.PARAMETER_NAMES``.
    """
    white, correlated, tau, sway, natural, damping, heading_white, motion, _segment, wander, wander_s = np.exp(
        parameters
    )
    scale2 = np.rad2deg(inverse_speed) ** 2
    omega, peak = 2.0 * np.pi * frequency_hz, 2.0 * np.pi * natural
    markov = 4.0 * correlated**2 * tau / (1.0 + (omega * tau) ** 2)
    resonance = 8.0 * damping * peak**3 * sway**2 / ((peak**2 - omega**2) ** 2 + (2.0 * damping * peak * omega) ** 2)
    slow = 4.0 * wander**2 * wander_s / (1.0 + (omega * wander_s) ** 2)
    whites = 2.0 * step_s * (scale2 * white**2 + heading_white**2)
    return np.asarray(scale2 * motion**2 * markov + slow + resonance + whites)
