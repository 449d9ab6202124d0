"""Split covariance intersection: fusing what may be correlated in an unknown way.

A covariance has an independent part and one that may be correlated with anything. The latter of the state is divided
by a weight w, that of the measurement by 1 - w, and the two are fused as if they were independent: consistent whatever
the correlation. The weight is that with the least sum of the states' variances, each over what it was before: states
have different units, and one that were left out would grow by 1 / w with every update.

Source: Julier and Uhlmann, General decentralized data fusion with covariance intersection, 2001 (split form); Li and
Nashashibi, Cooperative multi-vehicle localization using split covariance intersection filter, 2013, equations 10 to 14.
"""

from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray

WEIGHTS = np.array([0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 0.995, 0.999])
ROUNDING = 1e-9  # a smaller gain is none


class Fused(NamedTuple):
    """Gain (n, m), covariance (n, n) and its independent part after the update."""

    gain: FloatArray
    P: FloatArray
    independent: FloatArray


def fuse(
    P: FloatArray, independent: FloatArray, H: FloatArray, R_independent: FloatArray, R_dependent: FloatArray
) -> Fused | None:
    """Fuse measurements of one source with an estimate.

    Parameters
    ----------
    P, independent : ndarrays, shape (n, n)
        Covariance, and the part of it that is correlated with nothing.
    H : ndarray, shape (m, n)
    R_independent, R_dependent : ndarrays, shape (m, m)
        Noise of the sensor, and what the source brings.

    Returns
    -------
    Fused, or None where every weight leaves larger errors than no update.

    Examples
    --------
    >>> fused = fuse(np.eye(2), np.zeros((2, 2)), np.eye(2), np.zeros((2, 2)), np.eye(2))
    >>> fused is None  # the same information again
    True
    """
    dependent = P - independent
    if not R_dependent.any():
        weights = np.ones(1)
        noise = R_independent[None]
    else:
        weights = WEIGHTS
        noise = R_independent + R_dependent / (1.0 - weights[:, None, None])
    grown = dependent / weights[:, None, None] + independent
    shared = grown @ H.T
    gain = np.linalg.solve(H @ shared + noise, shared.transpose(0, 2, 1)).transpose(0, 2, 1)
    after = grown - gain @ shared.transpose(0, 2, 1)
    before = np.diag(P)
    known = np.flatnonzero(before > 0.0)
    left = (np.diagonal(after, axis1=1, axis2=2)[:, known] / before[known]).sum(axis=1)
    best = int(np.argmin(left))
    if len(weights) > 1 and not left[best] < len(known) * (1.0 - ROUNDING):
        return None
    kept = np.eye(len(P)) - gain[best] @ H
    alone = kept @ independent @ kept.T + gain[best] @ R_independent @ gain[best].T
    return Fused(gain[best], 0.5 * (after[best] + after[best].T), alone)
