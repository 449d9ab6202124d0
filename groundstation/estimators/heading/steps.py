"""Steps of the INS heading: jumps between two samples that no aircraft can turn."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import unwrap
from groundstation.estimators.heading.settings import HeadingSettings
from groundstation.results.heading import HeadingStep

FloatArray = NDArray[np.float64]
NEIGHBOURS = 2  # samples either side whose rate the aircraft is taken to keep
LONGEST_INTERVAL_S = 0.11  # slower logs show a turn as a step
ROBUST_SIGMAS, RESOLUTIONS = 8.0, 2.5
SIGMA_OF_MEDIAN = 1.4826


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
    A step is an increment less the median rate of the two increments either side, larger than ``step_min_deg``, than
    eight robust sigmas of all such figures and than 2.5 times the resolution.
    """
    known = np.isfinite(heading_deg)
    time_s, heading = time_s[known], unwrap(heading_deg[known])
    interval_s = np.diff(time_s)
    if len(time_s) < 4 * NEIGHBOURS or float(np.median(interval_s)) > LONGEST_INTERVAL_S:
        return ()
    change = np.diff(heading)
    rate = change / np.maximum(interval_s, 1e-6)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(rate, NEIGHBOURS, mode="edge"), 2 * NEIGHBOURS + 1)
    jump = change - np.median(np.delete(windows, NEIGHBOURS, axis=1), axis=1) * interval_s
    seen = np.abs(change[change != 0.0])
    resolution = float(np.min(seen)) if len(seen) else 0.0
    limit = max(
        settings.step_min_deg,
        ROBUST_SIGMAS * SIGMA_OF_MEDIAN * float(np.median(np.abs(jump))),
        RESOLUTIONS * resolution,
    )
    steady = interval_s <= 2.0 * LONGEST_INTERVAL_S
    return tuple(
        HeadingStep(float(time_s[place + 1]), float(jump[place]))
        for place in np.flatnonzero((np.abs(jump) > limit) & steady)
    )
