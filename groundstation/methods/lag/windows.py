"""Windows of samples where the reference moves, without slow errors, whitened.

A noise model whitens them.
"""

from collections.abc import Callable
from dataclasses import field, replace
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.methods.lag.settings import LatencySettings

FloatArray = NDArray[np.float64]
SIGMA_OF_MEDIAN = 1.4826  # sigma over the median size of normal errors
CORRELATED_SHARES = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0)  # variance of the correlated over the white noise
CORRELATION_TIMES_S = (0.5, 1.0, 2.0, 5.0, 10.0, 30.0)
WINDOWS_FOR_NOISE = 8


@dataclass(frozen=True)
class ReferenceSignals:
    """Signals of a reference: times (m,) increasing, values (m, b).

    A function makes c components of them. ``build`` turns values (..., b) into (..., c, 1 + q), linearly: of the last
    axis the first is the signal, the others are what a unit of each nuisance adds to it. A step longer than
    ``gap_max_s`` is not interpolated over.
    """

    time_s: FloatArray
    values: FloatArray
    build: Callable[[FloatArray], FloatArray]
    gap_max_s: float
    slopes: FloatArray = field(init=False, repr=False)  # rates at the samples

    def __post_init__(self) -> None:
        object.__setattr__(self, "slopes", np.gradient(self.values, self.time_s, axis=0))

    def covers(self, time_s: FloatArray, reach_s: float) -> BoolArray:
        """Tell where there is no gap from ``reach_s`` before to ``reach_s`` after.

        The mask has the shape of ``time_s``.
        """
        start = self.time_s[:-1][np.diff(self.time_s) > self.gap_max_s]
        end = self.time_s[1:][np.diff(self.time_s) > self.gap_max_s]
        early, late = time_s - reach_s, time_s + reach_s
        whole = np.searchsorted(end, early, side="right") == np.searchsorted(start, late, side="left")
        return np.asarray(whole & (early >= self.time_s[0]) & (late <= self.time_s[-1]))

    def smoothed(self, nodes: int) -> "ReferenceSignals":
        """Return running means over an odd number of samples.

        Their ends and the samples near gaps are not to be used. Without smoothing the noise of single samples shows:
        interpolation is quieter between samples than at them, and pulls the delay there.
        """
        if nodes < 2 or len(self.time_s) <= nodes:
            return self
        sums = np.cumsum(np.concatenate([np.zeros((1, self.values.shape[1])), self.values]), axis=0)
        half = nodes // 2
        values = self.values.copy()
        values[half : len(values) - half] = (sums[nodes:] - sums[:-nodes]) / nodes
        return replace(self, values=values)

    def at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the built signals and their rates at times (...).

        They are cubic between samples (Catmull-Rom).
        """
        between = self._between(time_s)
        return self.build(between.value), self.build(between.rate)

    def signal_at(self, time_s: FloatArray) -> FloatArray:
        """Return the built signals of :meth:`at` alone."""
        return self.build(self._between(time_s).value)

    def _between(self, time_s: FloatArray) -> "_Cubic":
        after = np.clip(np.searchsorted(self.time_s, time_s), 1, len(self.time_s) - 1)
        step = (self.time_s[after] - self.time_s[after - 1])[..., None]
        u = (time_s - self.time_s[after - 1])[..., None] / step
        left, right = self.values[after - 1], self.values[after]
        rise, fall = self.slopes[after - 1] * step, self.slopes[after] * step
        return _Cubic(u, step, left, rise, 3.0 * (right - left) - 2.0 * rise - fall, rise + fall - 2.0 * (right - left))


class _Cubic(NamedTuple):
    """Cubics by the share ``u`` of the ``step`` that a time lies in.

    ``left`` is the value at its begin, ``rise`` the slope there over the step, ``over`` and ``bent`` what bends it.
    """

    u: FloatArray
    step: FloatArray
    left: FloatArray
    rise: FloatArray
    over: FloatArray
    bent: FloatArray

    @property
    def value(self) -> FloatArray:
        """Values at the times."""
        return self.left + self.u * (self.rise + self.u * (self.over + self.u * self.bent))

    @property
    def rate(self) -> FloatArray:
        """Rates at the times, per second."""
        return (self.rise + self.u * (2.0 * self.over + self.u * (3.0 * self.bent))) / self.step


@dataclass(frozen=True)
class Noise:
    """White noise of ``sigma``, and noise correlated over ``time_s``.

    The latter has ``share`` times the variance of the former.
    """

    sigma: float = 1.0
    share: float = 0.0
    time_s: float = 1.0

    @property
    def total(self) -> float:
        """Sigma of both together."""
        return self.sigma * float(np.sqrt(1.0 + self.share))


@dataclass(frozen=True)
class Windows:
    """Samples of the other sensor in w windows of at most n.

    Their shapes are (w, n) for times and weights, (w, n, c) for values. Weight 0 fills windows up; one below 1 is that
    of an outlier.
    """

    time_s: FloatArray
    values: FloatArray
    weight: FloatArray

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def known(self) -> BoolArray:
        """Mask of the samples that exist, shape (w, n)."""
        return np.asarray(self.weight > 0.0)

    def take(self, index: NDArray[np.intp] | slice) -> "Windows":
        """Some of the windows."""
        return Windows(self.time_s[index], self.values[index], self.weight[index])

    def some(self, most: int) -> "Windows":
        """Return at most so many of the windows, evenly taken."""
        return self.take(_even(len(self), most))

    def whitener(self, noise: Noise) -> FloatArray:
        """Factors W with W K W' = 1, K the covariance of the noise in a window, shape (w, n, n)."""
        known = self.known
        white = np.where(known, 1.0 / np.where(known, self.weight, 1.0), 1.0)
        apart = np.abs(self.time_s[:, :, None] - self.time_s[:, None, :])
        correlated = noise.share * np.exp(-apart / noise.time_s) * (known[:, :, None] & known[:, None, :])
        covariance = correlated + white[:, :, None] * np.eye(white.shape[1])
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)) / noise.sigma)

    def polynomials(self, degree: int) -> FloatArray:
        """Powers of time in each window, shape (w, n, degree + 1), zero where there is no sample."""
        middle = 0.5 * (self.time_s.min(axis=1) + self.time_s.max(axis=1))
        half = np.maximum(0.5 * np.ptp(self.time_s, axis=1), 1e-9)
        u = (self.time_s - middle[:, None]) / half[:, None]
        return np.asarray(u[..., None] ** np.arange(degree + 1) * self.known[..., None])


@dataclass(frozen=True)
class Whitened:
    """Windows made ready for least squares: a whitener (None: 1) and a basis.

    The basis is an orthonormal one of the polynomials in them.
    """

    factor: FloatArray | None
    basis: FloatArray
    known: BoolArray

    @classmethod
    def of(cls, windows: Windows, noise: Noise, degree: int) -> "Whitened":
        """Make it from windows and a noise model."""
        factor = windows.whitener(noise)
        return cls(factor, np.linalg.qr(factor @ windows.polynomials(degree))[0], windows.known)

    @classmethod
    def plain(cls, windows: Windows, degree: int) -> "Whitened":
        """Make it from windows without any weights."""
        return cls(None, np.linalg.qr(windows.polynomials(degree))[0], windows.known)

    def rows(self, values: FloatArray) -> FloatArray:
        """Return values (w, n, c, k) whitened and freed of the polynomials: rows (w, n c, k)."""
        w, n, c, k = values.shape
        flat = (values * self.known[..., None, None]).reshape(w, n, c * k)
        flat = flat if self.factor is None else self.factor @ flat
        rest = flat - self.basis @ (np.swapaxes(self.basis, 1, 2) @ flat)
        return np.asarray(rest.reshape(w, n * c, k))


def too_few_windows(settings: LatencySettings) -> str:
    """Return the reason why :func:`cut_windows` gives none."""
    return f"fewer than two stretches of {settings.window_s:g} s in which both are logged without a gap"


def cut_windows(
    reference: ReferenceSignals, time_s: FloatArray, values: FloatArray, settings: LatencySettings
) -> Windows | None:
    """Cut windows of the other sensor where the reference moves most; None if there are none.

    Samples have times (n,) and values (n, c). A sample counts where the reference is known ``search_s`` before and
    after it, and does not lie farther from the reference than that ranges over the flight (a wild value).
    """
    known = reference.covers(time_s, settings.search_s) & np.isfinite(values).all(axis=1)
    time_s, values = time_s[known], values[known]
    if not len(time_s):
        return None
    signal, rate = (part[..., 0] for part in reference.at(time_s))
    off = np.abs(values - signal - np.median(values - signal, axis=0))
    near = (off <= np.ptp(signal, axis=0) + np.median(off, axis=0)).all(axis=1)
    time_s, values, rate = time_s[near], values[near], rate[near]
    number = np.floor((time_s - time_s[0]) / settings.window_s).astype(np.int64)
    _, first, which, count = np.unique(number, return_index=True, return_inverse=True, return_counts=True)
    place = np.arange(len(time_s)) - first[which]
    shape = (len(first), int(count.max()))
    weight, times = np.zeros(shape), np.repeat(time_s[first][:, None], shape[1], axis=1)
    others, rates = np.zeros((*shape, values.shape[1])), np.zeros((*shape, values.shape[1]))
    weight[which, place], times[which, place] = 1.0, time_s
    others[which, place], rates[which, place] = values, rate
    enough = count >= max(settings.degree + 4, 0.5 * float(np.median(count)))
    windows = Windows(times, others, weight).take(np.flatnonzero(enough))
    if len(windows) < 2:
        return None
    moving = Whitened.plain(windows, settings.degree).rows(rates[enough][..., None])
    best = np.argsort(-np.sum(moving**2, axis=(1, 2)), kind="stable")[: settings.windows_max]
    return windows.take(np.sort(best))


def reweighted(windows: Windows, left: FloatArray, sigma: float, robust_sigmas: float) -> Windows:
    """Return windows with Huber's weights by the residual of each sample, shape (w, n, c)."""
    sizes = np.sqrt(np.mean(np.square(left), axis=2))
    weight = np.minimum(1.0, robust_sigmas * sigma / np.maximum(sizes, 1e-300))
    return replace(windows, weight=np.where(windows.known, weight, 0.0))


def spread_of(left: FloatArray) -> float:
    """Return the sigma of residuals by their median size, never zero.

    Exact zeros, which fill windows up, are left out.
    """
    sizes = np.abs(left[left != 0.0])
    return max(SIGMA_OF_MEDIAN * float(np.median(sizes)), 1e-9) if sizes.size else 1e-9


def noise_of(windows: Windows, left: FloatArray, degree: int) -> Noise:
    """Estimate the most likely noise of the residuals (w, n, c), from some of the windows.

    The residuals also hold polynomials of unknown size. The method is restricted likelihood on a grid: share of
    correlated noise, its time, and the share again.
    """
    windows, left = windows.some(WINDOWS_FOR_NOISE), left[_even(len(left), WINDOWS_FOR_NOISE)]
    powers = windows.polynomials(degree)
    count = (int(np.sum(windows.known)) - len(windows) * (degree + 1)) * left.shape[2]

    @cache  # the best so far is met again in each of the three searches
    def tried(share: float, time_s: float) -> tuple[float, Noise]:
        factor = windows.whitener(Noise(1.0, share, time_s))
        basis, triangle = np.linalg.qr(factor @ powers)
        rest = Whitened(factor, basis, windows.known).rows(left[..., None])
        sigma = max(float(np.sqrt(np.sum(rest**2) / max(count, 1))), 1e-9)
        logs = np.sum(np.log(np.abs(np.diagonal(factor, axis1=1, axis2=2))))
        logs -= np.sum(np.log(np.abs(np.diagonal(triangle, axis1=1, axis2=2))))
        return count * np.log(sigma) - left.shape[2] * float(logs), Noise(sigma, share, time_s)

    best = min((tried(share, 3.0) for share in CORRELATED_SHARES), key=lambda found: found[0])
    for time_s in CORRELATION_TIMES_S:
        best = min(best, tried(best[1].share or CORRELATED_SHARES[1], time_s), key=lambda found: found[0])
    for share in CORRELATED_SHARES[1:]:
        best = min(best, tried(share, best[1].time_s), key=lambda found: found[0])
    return best[1]


def _even(count: int, most: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, count - 1, most).astype(np.intp))
