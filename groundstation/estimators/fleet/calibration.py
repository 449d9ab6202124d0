"""Calibration of stated sigmas by the residuals of independent checks.

The residuals are over the sigmas claimed for them.
"""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.estimators.fleet.moments import moments_of
from groundstation.methods.intervals import share_interval
from groundstation.results.fleet import FleetCalibration

FloatArray = NDArray[np.float64]
PIT_BINS = 10


def calibrate(quantity: str, title: str, z: FloatArray, is_inside: NDArray[np.bool_]) -> FleetCalibration | None:
    """Judge the sigmas of one kind of check.

    Parameters
    ----------
    quantity, title : str
    z : ndarray, shape (n,)
        Residual / sigma of each check, finite.
    is_inside : ndarray of bool, shape (n,)
        Whether the residual was inside the stated 95 % interval.

    Returns
    -------
    FleetCalibration or None
        None without checks.
    """
    from scipy.special import ndtr

    if not len(z):
        return None
    found = moments_of(z)
    place = np.minimum((ndtr(z) * PIT_BINS).astype(np.int64), PIT_BINS - 1)
    inside = int(np.sum(is_inside))
    return FleetCalibration(
        quantity,
        title,
        checks=len(z),
        inside=inside,
        share_inside=inside / len(z),
        confidence95=share_interval(inside, len(z)),
        z_mean=found.mean,
        z_sigma=None if math.isnan(found.sigma) else found.sigma,
        pit=tuple(np.bincount(place, minlength=PIT_BINS).tolist()),
    )
