"""Steps of the INS heading: jumps between two samples that no aircraft can turn."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import unwrap
from groundstation.systems.heading.answer import HeadingStep
from groundstation.systems.heading.settings import HeadingSettings

FloatArray = NDArray[np.float64]
FITTED, DEGREE = 8, 5  # samples either side, and the polynomial through them that a step breaks
NEAR = 1  # intervals either side in which there is one step, the largest
LONGEST_STEPS = 2.5  # usual intervals between two samples of a fit
LONGEST_INTERVAL_S = 0.11  # slower logs show a turn as a step
ROBUST_SIGMAS, RESOLUTIONS = 5.5, 2.5  # of what the fit finds everywhere else
BETTER = 0.9  # a step must leave less than so much of the squares that a sudden change of the rate of turn leaves
CANCELS_S, CANCELS_SHARE = 0.2, 0.5  # a jump back within so long, by more than so much of it: a spike, no step
SIGMA_OF_MEDIAN = 1.4826
_PLACE = np.arange(-FITTED + 0.5, FITTED)  # of the samples about the interval, in intervals
_SMOOTH = np.column_stack([_PLACE**power for power in range(DEGREE + 1)])


def heading_steps(time_s: FloatArray, heading_deg: FloatArray, settings: HeadingSettings) -> tuple[HeadingStep, ...]:
    """Find steps of ``step_min_deg`` or more.

    Parameters
    ----------
    time_s, heading_deg : ndarray, shape (n,)
        INS heading as logged, in order of time; NaN where missing.

    Returns
    -------
    tuple of HeadingStep
        In order of time, signed: heading after minus heading before. Empty for logs slower than 10 Hz.

    Notes
    -----
    A quintic with a step in the middle is fitted to eight samples either side of an interval. The step counts if it is
    larger than ``step_min_deg``, than 5.5 robust sigmas of all such figures and than 2.5 times the resolution. An
    aircraft may change its rate of turn at once: where a quintic with a bend fits nearly as well, it is turning, and no
    step. Two steps that cancel within 0.2 s are a spike.
    """
    known = np.isfinite(heading_deg)
    time_s, heading = time_s[known], unwrap(heading_deg[known])
    interval_s = np.diff(time_s)
    if len(time_s) < 2 * FITTED + 1 or float(np.median(interval_s)) > LONGEST_INTERVAL_S:
        return ()
    change = np.diff(heading)
    fitted = _fitted_steps(heading)
    seen = np.abs(change[change != 0.0])
    resolution = float(np.min(seen)) if len(seen) else 0.0
    limit = max(settings.step_min_deg, ROBUST_SIGMAS * _sigma(fitted), RESOLUTIONS * resolution)
    longest = np.lib.stride_tricks.sliding_window_view(np.pad(interval_s, FITTED - 1, mode="edge"), 2 * FITTED - 1)
    is_step = (np.abs(fitted) > limit) & (longest.max(axis=1) <= LONGEST_STEPS * np.median(interval_s))
    nearby = np.lib.stride_tricks.sliding_window_view(np.pad(np.abs(fitted), NEAR), 2 * NEAR + 1)
    is_step &= np.abs(fitted) >= nearby.max(axis=1)  # beside a step the fit finds smaller ones
    found = [place for place in np.flatnonzero(is_step).tolist() if _breaks(heading, place)]
    return tuple(
        HeadingStep(float(time_s[place + 1]), float(fitted[place]))
        for place in _without_spikes(found, time_s[1:], fitted)
    )


def _sigma(values: FloatArray) -> float:
    """Robust standard deviation about zero."""
    return SIGMA_OF_MEDIAN * float(np.median(np.abs(values)))


def _fitted_steps(heading: FloatArray) -> FloatArray:
    """Fit a step in each interval beside a quintic of time, degrees, shape (n - 1,).

    By least squares; 0 near the ends.
    """
    weight = np.linalg.pinv(np.column_stack([_SMOOTH, 0.5 * np.sign(_PLACE)]))[-1]
    out = np.zeros(len(heading) - 1)
    out[FITTED - 1 : len(heading) - FITTED] = np.lib.stride_tricks.sliding_window_view(heading, 2 * FITTED) @ weight
    return out


def _breaks(heading: FloatArray, place: int) -> bool:
    """Tell whether the heading breaks in an interval and does not bend in or near it."""
    window = heading[place - FITTED + 1 : place + FITTED + 1] - heading[place]
    bends = np.arange(-FITTED + 1.0, FITTED, 0.25)
    bent = min(_left_over(np.maximum(_PLACE - at, 0.0), window) for at in bends)
    return _left_over(np.sign(_PLACE), window) < BETTER * bent


def _left_over(shape: FloatArray, window: FloatArray) -> float:
    """Sum of squares that a quintic and a shape leave of the samples of a window."""
    matrix = np.column_stack([_SMOOTH, shape])
    return float(np.sum((window - matrix @ np.linalg.lstsq(matrix, window, rcond=None)[0]) ** 2))


def _without_spikes(found: list[int], time_s: FloatArray, jump: FloatArray) -> list[int]:
    """Places of the jumps (``time_s`` and ``jump`` by increment) that no later one cancels."""
    kept: list[int] = []
    for place in found:
        last = kept[-1] if kept else None
        is_soon = last is not None and time_s[place] - time_s[last] <= CANCELS_S + 1e-6
        if is_soon and abs(jump[place] + jump[last]) < CANCELS_SHARE * abs(jump[last]):
            kept.pop()
        else:
            kept.append(place)
    return kept
