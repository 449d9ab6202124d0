"""Weights of the rows: robust, and no more for repetitions than what they tell.

Cauchy's weight of a reading that misses by u of its own sigmas is 1 / (1 + (u / c)^2). For Gaussian errors its answer
has a known efficiency; the weights that make up the covariance are scaled to it, for they are below 1 for right
readings too. Errors of one link are correlated in time: how much, its residuals tell, and where they are too few, the
setting does.

Source: Holland and Welsch, Robust regression using iteratively reweighted least-squares, 1977 (c = 2.385: 95 %);
Huber, Robust Statistics, 1981, section 6.3 (covariance of an M-estimate).
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray, Int64Array
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import PEER, POINT
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.rows import Rows

FAR = 3.0  # sigmas, beyond which a residual does not say more about the correlation
LONGEST = 3.0  # times the correlation time, over which readings tell of it
SURE_SIGMAS = 2.0  # of the measured share, which are taken off it
FEW = 5.0  # readings that the assumed share is worth


def cauchy(normal: FloatArray, scale: float) -> FloatArray:
    """Return weights of residuals over their sigmas; a scale of 0 weighs all alike."""
    if scale <= 0.0:
        return np.ones(len(normal))
    return np.asarray(1.0 / (1.0 + (normal / scale) ** 2))


def loss(normal: FloatArray, scale: float) -> FloatArray:
    """Return the loss that Cauchy's weights make least, half the square where the scale is 0."""
    if scale <= 0.0:
        return np.asarray(0.5 * normal**2)
    return np.asarray(0.5 * scale**2 * np.log1p((normal / scale) ** 2))


def honest_factor(scale: float) -> float:
    """Return the factor by which Cauchy's weights add up to what Gaussian readings tell.

    Examples
    --------
    >>> round(honest_factor(2.385), 3), honest_factor(0.0)
    (1.083, 1.0)
    """
    if scale <= 0.0:
        return 1.0
    u = np.linspace(-12.0, 12.0, 4801)
    density = np.exp(-0.5 * u**2)
    density /= density.sum()
    weight = cauchy(u, scale)
    slope = float((density * (2.0 * weight**2 - weight)).sum())
    square = float((density * (u * weight) ** 2).sum())
    return slope**2 / square / float((density * weight).sum())


class Repetitions:
    """Readings of the same links one after the other.

    Where several antennas measure at one time, each follows by its place among them.
    """

    def __init__(self, prepared: Prepared, rows: Rows) -> None:
        events, many = prepared.events, len(rows.event)
        time_s = events.time_s[rows.event]
        link = np.stack([events.receiver[rows.event], events.source[rows.event], rows.kind, rows.is_bearing])
        link = np.concatenate([link, _rank_of(link, time_s)[None]])
        order = np.lexsort((time_s, *link))
        same = (link[:, order[1:]] == link[:, order[:-1]]).all(axis=0)
        self._later, self._before = order[1:][same], order[:-1][same]
        self._gap_s = time_s[self._later] - time_s[self._before]
        self._since_s = np.full(many, np.inf)
        self._since_s[self._later] = self._gap_s
        classes = [(rows.kind == kind) & (rows.is_bearing == bearing) for kind in (PEER, POINT) for bearing in (0, 1)]
        self._classes = [mask for mask in classes if mask.any()]

    def factors(self, normal: FloatArray, settings: CooperativeSettings) -> FloatArray:
        """Return the factors of the rows' variances, from the residuals over their sigmas.

        A stated share is in the variances already; then the factor is what the residuals show beyond it.
        """
        factor, stated = np.ones(len(normal)), settings.correlated_share
        for mine in self._classes:
            measured = self.share(normal, mine, settings)
            since = np.clip(self._since_s[mine] / settings.correlation_s, 0.01, 100.0)
            factor[mine] = np.maximum(_as_white(measured, since) / _as_white(stated, since), 1.0)
        return factor

    def share(self, normal: FloatArray, mine: BoolArray, settings: CooperativeSettings) -> float:
        """Return the share of the variance that stays between readings of a link."""
        time_s, assumed = settings.correlation_s, settings.smoother.correlated_share
        pairs = mine[self._later] & (self._gap_s < LONGEST * time_s)
        pairs &= np.isfinite(normal[self._later]) & np.isfinite(normal[self._before])
        kept = np.exp(-self._gap_s[pairs] / time_s)
        worth = float((kept**2).sum())
        if worth <= 0.0:
            return assumed
        value = np.clip(normal, -FAR, FAR)
        square = float(np.nanmean(value[mine] ** 2))
        both = float((kept * value[self._later[pairs]] * value[self._before[pairs]]).sum())
        found = both / worth / max(square, 1e-12) - SURE_SIGMAS / np.sqrt(worth)
        return float((worth * np.clip(found, 0.0, 0.95) + FEW * assumed) / (worth + FEW))


def _as_white(share: float, since: FloatArray) -> FloatArray:
    """Return the factor of the variance that makes readings white ones; see ``events``."""
    return np.asarray(1.0 - share + share / np.tanh(since / 2.0))


def _rank_of(link: Int64Array, time_s: FloatArray) -> Int64Array:
    """Return the place of each row among those of its link at its time: 0, 1, ..."""
    order = np.lexsort((time_s, *link))
    is_new = (link[:, order[1:]] != link[:, order[:-1]]).any(axis=0) | (np.diff(time_s[order]) != 0.0)
    starts = np.flatnonzero(np.concatenate([[True], is_new])) if len(order) else np.zeros(0, dtype=np.int64)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.repeat(starts, np.diff(np.append(starts, len(order))))
    return rank
