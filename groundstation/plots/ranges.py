"""Rules that every painter shares: ranges of axes, spans of time, broken lines, thinning."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.plots.marks import Floats

LEAST_PAUSE_S, MOST_WINDOWS = 60.0, 6  # a longer pause breaks a time axis


def finite(*arrays: Any) -> Floats:
    """All finite values of some arrays, joined."""
    joined = np.concatenate([np.asarray(values, dtype=np.float64).ravel() for values in arrays] or [np.zeros(0)])
    return np.asarray(joined[np.isfinite(joined)])


def padded(low: float, high: float, share: float = 0.06, least: float = 1e-6) -> tuple[float, float]:
    """Ends of an axis around a range.

    Examples
    --------
    >>> padded(0.0, 10.0, 0.1)
    (-1.0, 11.0)
    """
    margin = max(share * (high - low), least)
    return low - margin, high + margin


def around(*arrays: Any, share: float = 0.06, least: float = 1e-6) -> tuple[float, float]:
    """Ends of an axis around all values; 0 to 1 where there is none."""
    known = finite(*arrays)
    return padded(float(known.min()), float(known.max()), share, least) if known.size else (0.0, 1.0)


def symmetric(values: Any, least: float, most: float = np.inf, share: float = 0.1) -> tuple[float, float]:
    """Ends of an axis about zero that hold all values up to ``most``, and at least ``least``.

    Examples
    --------
    >>> symmetric([0.5, -3.0], 1.0, share=0.0), symmetric([50.0], 1.0, 8.0, share=0.0)
    ((-3.0, 3.0), (-8.0, 8.0))
    """
    known = np.abs(finite(values))
    end = (1.0 + share) * min(max(float(known.max(initial=0.0)), least), most)
    return -end, end


def thin(count: int, most: int) -> NDArray[np.int64]:
    """Positions of at most ``most`` of ``count`` samples, evenly spread, the same every time.

    Examples
    --------
    >>> thin(10, 4).tolist(), thin(3, 4).tolist()
    ([0, 3, 6, 9], [0, 1, 2])
    """
    if count <= most:
        return np.arange(count)
    return np.round(np.linspace(0, count - 1, most)).astype(np.int64)


def windows(time: Any, least_gap_s: float = LEAST_PAUSE_S) -> tuple[tuple[float, float], ...]:
    """Return the spans of flight time that the samples fill, a little around each.

    A longer pause ends a span; there are at most six.

    Examples
    --------
    >>> windows([0.0, 1.0, 2.0, 500.0, 540.0])
    ((-2.0, 4.0), (498.0, 542.0))
    """
    known = np.sort(finite(time))
    if not known.size:
        return ((0.0, 1.0),)
    pauses = np.diff(known)
    longest = np.argsort(-pauses, kind="stable")[: MOST_WINDOWS - 1]
    cuts = np.sort(longest[pauses[longest] > least_gap_s]).tolist()
    ends = [*cuts, len(known) - 1]
    starts = [0, *(cut + 1 for cut in cuts)]
    spans = [(float(known[first]), float(known[last])) for first, last in zip(starts, ends, strict=True)]
    return tuple(padded(low, high, 0.05, 2.0) for low, high in spans)


def broken_at_wrap(time: Any, angle_deg: Any) -> tuple[Floats, Floats]:
    """Insert a NaN between two headings that jump through north, and a time for it.

    The line breaks instead of crossing the figure.

    Examples
    --------
    >>> [column.tolist() for column in broken_at_wrap([0.0, 1.0, 2.0], [359.0, 1.0, 2.0])]
    [[0.0, 0.5, 1.0, 2.0], [359.0, nan, 1.0, 2.0]]
    """
    time, angle = np.asarray(time, dtype=np.float64), np.asarray(angle_deg, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        after = np.flatnonzero(np.abs(np.diff(angle)) > 180.0) + 1
    return np.insert(time, after, 0.5 * (time[after - 1] + time[after])), np.insert(angle, after, np.nan)


def broken_at_gaps(time: Any, *values: Any) -> tuple[Floats, ...]:
    """Return time and values with a NaN at each leap in time: the line breaks at the gap.

    Examples
    --------
    >>> [column.tolist() for column in broken_at_gaps([0.0, 1.0, 9.0, 10.0], [1.0, 2.0, 3.0, 4.0])]
    [[0.0, 1.0, 9.0, 9.0, 10.0], [1.0, 2.0, nan, 3.0, 4.0]]
    """
    time = np.asarray(time, dtype=np.float64)
    steps = np.diff(time)
    known = steps[np.isfinite(steps)]
    leaps = np.flatnonzero(steps > 5.0 * np.median(known)) + 1 if known.size else np.zeros(0, dtype=np.int64)
    broken = [np.insert(np.asarray(column, dtype=np.float64), leaps, np.nan) for column in values]
    return np.insert(time, leaps, time[leaps]), *broken
