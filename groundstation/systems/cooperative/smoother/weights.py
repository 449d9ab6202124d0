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
from groundstation.base.records import BoolArray
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
    (1.064, 1.0)
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
    """Readings of the same links one after the other."""

    def __init__(self, prepared: Prepared, rows: Rows) -> None:
        events = prepared.events
        self._time_s = events.time_s[rows.event]
        link = np.stack([events.receiver[rows.event], events.source[rows.event], rows.kind, rows.is_bearing])
        order = np.lexsort((self._time_s, *link))
        same = (link[:, order[1:]] == link[:, order[:-1]]).all(axis=0)
        same &= np.isin(rows.kind[order[1:]], (PEER, POINT))
        self._later, self._before = order[1:][same], order[:-1][same]
        since = self._time_s[self._later] - self._time_s[self._before]
        is_new = since > 0.0  # several antennas of a pair measure at one time
        self._since_s = np.full(len(rows.event), np.inf)
        latest = np.full(len(rows.event), np.inf)
        for row, before, gap_s in zip(self._later.tolist(), self._before.tolist(), since.tolist(), strict=True):
            latest[row] = gap_s if gap_s > 0.0 else latest[before]
        self._since_s[self._later] = latest[self._later]
        self._later, self._before, self._gap_s = self._later[is_new], self._before[is_new], since[is_new]
        is_link = np.isin(rows.kind, (PEER, POINT))
        self._classes = [
            mask
            for mask in (
                is_link & (rows.kind == PEER) & ~rows.is_bearing,
                is_link & (rows.kind == POINT) & ~rows.is_bearing,
                is_link & rows.is_bearing,
            )
            if mask.any()
        ]

    def factors(self, normal: FloatArray, settings: CooperativeSettings) -> FloatArray:
        """Return the factors of the rows' variances, from the residuals over their sigmas."""
        factor = np.ones(len(normal))
        if settings.correlated_share > 0.0:  # as stated, and in the variances already
            return factor
        for mine in self._classes:
            share = self.share(normal, mine, settings)
            since = np.clip(self._since_s[mine] / settings.correlation_s, 0.01, 100.0)
            factor[mine] = 1.0 - share + share / np.tanh(since / 2.0)
        return factor

    def share(self, normal: FloatArray, mine: BoolArray, settings: CooperativeSettings) -> float:
        """Return the share of the variance that stays between readings of a link."""
        time_s = settings.correlation_s
        pairs = mine[self._later] & (self._gap_s < LONGEST * time_s)
        pairs &= np.isfinite(normal[self._later]) & np.isfinite(normal[self._before])
        kept = np.exp(-self._gap_s[pairs] / time_s)
        worth = float((kept**2).sum())
        assumed = settings.smoother.correlated_share
        if worth <= 0.0:
            return assumed
        value = np.clip(normal, -FAR, FAR)
        square = float(np.nanmean(value[mine] ** 2))
        both = float((kept * value[self._later[pairs]] * value[self._before[pairs]]).sum())
        found = both / worth / max(square, 1e-12) - SURE_SIGMAS / np.sqrt(worth)
        return float((worth * np.clip(found, 0.0, 0.95) + FEW * assumed) / (worth + FEW))
