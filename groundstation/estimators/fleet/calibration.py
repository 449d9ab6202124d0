"""How honest stated sigmas are: residuals of independent checks over the sigmas claimed for them."""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.base.quantiles import share_quantile
from groundstation.estimators.fleet.moments import moments_of
from groundstation.results.fleet import FleetCalibration

FloatArray = NDArray[np.float64]
PIT_BINS = 10


def share_interval(inside: float, checks: float, confidence: float = 0.95) -> tuple[float, float]:
    """Exact interval of a share; of correlated checks both numbers are effective ones.

    Source: Clopper, Pearson, Biometrika 26 (1934), 404-413.

    Examples
    --------
    >>> [round(bound, 4) for bound in share_interval(19, 20)]
    [0.7513, 0.9987]
    >>> share_interval(0, 0)
    (0.0, 1.0)
    """
    tail = 0.5 * (1.0 - confidence)
    low = share_quantile(tail, inside, checks - inside + 1) if inside > 0.0 else 0.0
    high = share_quantile(1.0 - tail, inside + 1, checks - inside) if inside < checks else 1.0
    return low, high


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
