"""Sign of a vertical velocity, by the rate of the height beside it."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
STEP_S, LONGEST_STEP_S = 5.0, 10.0  # between heights
FEWEST = 15  # steps
LEAST_MPS = 0.05  # spread of both that shows a sign
OPPOSITE = -0.7  # correlation below which the sign is the other one


def climb_agreement(time_s: FloatArray, height_m: FloatArray, down_mps: FloatArray) -> float | None:
    """Return the correlation of a downward velocity with the rate of sinking.

    Parameters
    ----------
    time_s, height_m, down_mps : ndarrays, shape (n,)
        NaN: absent.

    Returns
    -------
    Correlation over steps of 5 s: 1 where both say the same, -1 where the velocity is upward. None where too little
    climbing shows it.

    Examples
    --------
    >>> time_s = np.arange(0.0, 600.0)
    >>> height_m, up_mps = 100.0 * np.sin(0.02 * time_s), 2.0 * np.cos(0.02 * time_s)
    >>> round(climb_agreement(time_s, height_m, -up_mps), 2), round(climb_agreement(time_s, height_m, up_mps), 2)
    (1.0, -1.0)
    """
    known = np.isfinite(height_m) & np.isfinite(down_mps) & np.isfinite(time_s)
    known &= np.concatenate([[True], np.diff(time_s) > 0.0]) if len(time_s) else known
    time_s, height_m, down_mps = time_s[known], height_m[known], down_mps[known]
    if len(time_s) < FEWEST:
        return None
    ends = np.unique(np.searchsorted(time_s, time_s[0] + STEP_S * np.unique(np.floor((time_s - time_s[0]) / STEP_S))))
    if len(ends) <= FEWEST:
        return None
    length_s = np.diff(time_s[ends])
    sunk = -np.diff(height_m[ends]) / length_s
    told = np.add.reduceat(down_mps, ends)[:-1] / np.diff(ends)
    fits = length_s <= LONGEST_STEP_S
    sunk, told = sunk[fits], told[fits]
    if len(sunk) < FEWEST or min(float(np.std(sunk)), float(np.std(told))) < LEAST_MPS:
        return None
    return float(np.corrcoef(sunk, told)[0, 1])


def is_upward(time_s: FloatArray, height_m: FloatArray, down_mps: FloatArray) -> bool:
    """Tell whether what is named a downward velocity goes up with the height."""
    found = climb_agreement(time_s, height_m, down_mps)
    return found is not None and found < OPPOSITE
