"""Densities of many flights on one grid, merged from histograms on a fine lattice."""

from collections.abc import Iterable, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.methods.fleet.moments import Moments
from groundstation.results.fleet import Densities

FloatArray = NDArray[np.float64]
LATTICE_DEG = 0.01
BINS_PER_SIGMA = 5.0
MOST_BINS = 400
REACH_SIGMAS = 4.0
AT_ONCE = 1000  # flights


@dataclass(frozen=True)
class SampleHistogram:
    """Counts of samples in cells of the lattice; empty ones are left out.

    Cell k holds [k, k + 1) * ``LATTICE_DEG``.
    """

    cell: NDArray[np.int32]
    count: NDArray[np.int32]


def histogram_of(value_deg: FloatArray) -> SampleHistogram:
    """Count samples, degrees, in the cells of the lattice; non-finite ones are left out."""
    known = value_deg[np.isfinite(value_deg)]
    cell, count = np.unique(np.floor(known / LATTICE_DEG).astype(np.int32), return_counts=True)
    return SampleHistogram(cell, count.astype(np.int32))


def densities_of(
    flight_id: Sequence[str], aircraft: Sequence[str], moments: Sequence[Moments], histograms: Iterable[SampleHistogram]
) -> Densities:
    """Put the samples of flights on one grid.

    Bins are a fifth of the usual spread within a flight wide (a whole number of cells), and reach from the lowest to
    the highest flight, four sigmas beyond its mean. Where these are more than four hundred bins, the grid is laid
    around the median of the flights' means, and a flight far from all others is outside it.

    Parameters
    ----------
    flight_id, aircraft, moments : sequences
        One entry per flight with samples.
    histograms : iterable
        The same; they need not be there at once.
    """
    ids, names = np.array(flight_id, dtype=np.str_), np.array(aircraft, dtype=np.str_)
    samples = np.array([part.count for part in moments], dtype=np.int64)
    first, cells, bins = _grid(moments)
    density = np.zeros((len(ids), bins), dtype=np.float32)
    pooled = np.zeros(bins)
    width_deg = cells * LATTICE_DEG
    row, left = 0, iter(histograms)
    while some := list(islice(left, AT_ONCE)):
        counts = _counted(some, first, cells, bins)
        total = samples[row : row + len(some), None] * width_deg
        density[row : row + len(some)] = counts / total
        pooled += counts.sum(axis=0)
        row += len(some)
    edges = np.asarray((first + cells * np.arange(bins + 1)) * LATTICE_DEG, dtype=np.float64)
    return Densities(edges, ids, names, samples, density, pooled / (max(int(samples.sum()), 1) * width_deg))


def _counted(histograms: Sequence[SampleHistogram], first: int, cells: int, bins: int) -> FloatArray:
    """Samples of each histogram in the bins of the grid, shape (k, bins)."""
    sizes = [len(one.cell) for one in histograms]
    row = np.repeat(np.arange(len(sizes)), sizes)
    place = (np.concatenate([one.cell for one in histograms]).astype(np.int64) - first) // cells
    inside = (place >= 0) & (place < bins)
    count = np.concatenate([one.count for one in histograms])[inside]
    flat = np.bincount(row[inside] * bins + place[inside], count, minlength=len(sizes) * bins)
    return np.asarray(flat.reshape(len(sizes), bins), dtype=np.float64)


def _grid(moments: Sequence[Moments]) -> tuple[int, int, int]:
    """First cell, cells per bin, number of bins."""
    if not moments:
        return 0, 1, 1
    mean = np.array([part.mean for part in moments])
    sigma = np.nan_to_num([part.sigma for part in moments], nan=0.0)
    usual = float(np.median(sigma))
    cells = max(1, round(usual / BINS_PER_SIGMA / LATTICE_DEG))
    width = cells * LATTICE_DEG
    low = int(np.floor(np.min(mean - REACH_SIGMAS * sigma) / width))
    high = int(np.floor(np.max(mean + REACH_SIGMAS * sigma) / width)) + 1
    if high - low > MOST_BINS:
        middle = int(np.floor(np.median(mean) / width))
        low = min(max(low, middle - MOST_BINS // 2), high - MOST_BINS)
        high = low + MOST_BINS
    return low * cells, cells, high - low
