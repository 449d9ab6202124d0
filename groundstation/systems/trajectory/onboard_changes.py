"""Parts of a log in which the constant of an on-board filter is another one.

A filter whose error is constant before a moment and has another constant behind it was wrong in one of both parts. The
difference alone does not tell in which, for a constant may be mounting, antenna or datum.
"""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import BoolArray
from groundstation.systems.trajectory.onboard_answer import ChangeOfConstant, WrongSpan
from groundstation.systems.trajectory.onboard_spans import JOINED_S, wrong_spans
from groundstation.systems.trajectory.solution import FloatArray

EDGE_S = 30.0  # a span that begins or ends so near to the end of the log reaches it
LEVEL_S = 60.0  # of the parts either side of a change whose medians are compared
WIDTH = 0.4  # of the error: values in so narrow a band are one level
LEVEL_SHARE, LEVELS_SHARE = 0.4, 0.8  # of the span at one level, and at three
MOST_LEVELS = 3


def open_spans(time_s: FloatArray, error: FloatArray, spans: tuple[WrongSpan, ...]) -> tuple[WrongSpan, ...]:
    """Return the spans that may as well be the part in which the filter was right.

    They reach an end of the log at one level or few, or adjoin such a one. A span with the same constant on both of its
    sides, and an error that grows or fades, are not among them.
    """
    size = error if error.ndim == 1 else error[:, 0]
    known = time_s[np.isfinite(size)]
    if not len(known):
        return ()
    first_s, last_s = float(known[0]), float(known[-1])
    found = [
        one
        for one in spans
        if (one.start_s - first_s < EDGE_S or last_s - one.end_s < EDGE_S) and _is_level(time_s, error, one)
    ]
    left = [one for one in spans if one not in found]
    while near := [one for one in left if any(_adjoin(one, other) for other in found)]:
        found += near
        left = [one for one in left if one not in near]
    return tuple(found)


def _adjoin(one: WrongSpan, other: WrongSpan) -> bool:
    return min(abs(one.start_s - other.end_s), abs(other.start_s - one.end_s)) <= JOINED_S


def _is_level(time_s: FloatArray, error: FloatArray, span: WrongSpan) -> bool:
    """Tell whether an error stays at one level, or goes in steps between few."""
    inside = (time_s >= span.start_s) & (time_s <= span.end_s)
    values = error[inside] if error.ndim == 1 else np.hypot(*error[inside].T)
    values = np.sort(values[np.isfinite(values)])
    whole, taken, width = len(values), [], WIDTH * abs(span.value)
    for _ in range(MOST_LEVELS):
        if not len(values):
            break
        counts = np.searchsorted(values, values + width, side="right") - np.arange(len(values))
        start = int(np.argmax(counts))
        taken.append(int(counts[start]))
        values = np.delete(values, slice(start, start + taken[-1]))
    return taken[0] >= LEVEL_SHARE * whole or sum(taken) >= LEVELS_SHARE * whole


def changes_of(
    time_s: FloatArray, error: FloatArray, spans: tuple[WrongSpan, ...], least: float
) -> tuple[ChangeOfConstant, ...]:
    """Return the changes at the inner ends of open spans, the largest first."""
    known = time_s[np.isfinite(error.reshape(len(time_s), -1)).all(axis=1)]
    found: list[ChangeOfConstant] = []
    for span in spans:
        for at_s in (span.start_s, span.end_s):
            before = _level(time_s, error, at_s - LEVEL_S, at_s - 1.0)
            after = _level(time_s, error, at_s + 1.0, at_s + LEVEL_S)
            is_known = any(abs(at_s - one.at_s) <= JOINED_S for one in found)
            if is_known or at_s in (known[0], known[-1]) or before is None or after is None:
                continue
            step = after - before
            by = float(step[0]) if error.ndim == 1 else float(np.hypot(*step))
            if abs(by) > max(span.half95, least):
                found.append(ChangeOfConstant(at_s, by, span.half95))
    return tuple(sorted(found, key=lambda one: -abs(one.by)))


def _level(time_s: FloatArray, error: FloatArray, start_s: float, end_s: float) -> FloatArray | None:
    inside = (time_s >= start_s) & (time_s <= end_s)
    values = error.reshape(len(error), -1)[inside]
    values = values[np.isfinite(values).all(axis=1)]
    return np.median(values, axis=0) if len(values) else None


@dataclass(frozen=True)
class Absolute:
    """Error with nothing taken off, and the sigma of what it rests on.

    That is the axes of the filter, or the place of its point.
    """

    error: FloatArray
    sigma: float


@dataclass(frozen=True)
class Judged:
    """Spans of the filter, changes of its constant, and the constant that is right instead."""

    spans: tuple[WrongSpan, ...]
    changes: tuple[ChangeOfConstant, ...] = ()
    shift: float = 0.0


def judged(
    time_s: FloatArray,
    error: FloatArray,
    sigma: FloatArray,
    offset_sigma: float,
    least: float,
    absolute: Absolute | None,
) -> Judged:
    """Judge an error whose constant was taken off.

    Parameters
    ----------
    time_s, error, sigma, offset_sigma, least
        See :func:`wrong_spans`.
    absolute : Absolute or None
        Shape (n,), a vector by its length. It decides in which part of the log the filter was right, where it agrees
        with one part alone. None: no constant was taken off.
    """
    spans = wrong_spans(time_s, error, sigma, offset_sigma, least)
    found = open_spans(time_s, error, spans) if absolute is not None else ()
    if absolute is None or not found:
        return Judged(spans)
    rest, part = _agreement(time_s, absolute, found, sigma)
    if rest and not part:
        return Judged(spans)
    if part and not rest and error.ndim == 1:
        shift = float(np.nanmedian(error[_inside(time_s, found)]))
        return Judged(wrong_spans(time_s, error - shift, sigma, offset_sigma, least), (), shift)
    return Judged(tuple(one for one in spans if one not in found), changes_of(time_s, error, found, least))


def _agreement(
    time_s: FloatArray, absolute: Absolute, spans: tuple[WrongSpan, ...], sigma: FloatArray
) -> tuple[bool, bool]:
    """Tell whether the rest of the log, and the spans, agree with the constant as known."""
    inside, known = _inside(time_s, spans), np.isfinite(absolute.error)
    bound = NORMAL_95 * float(np.hypot(absolute.sigma, np.sqrt(np.nanmedian(sigma**2))))
    rest, part = absolute.error[known & ~inside], absolute.error[known & inside]
    return (
        bool(len(rest)) and abs(float(np.median(rest))) <= bound,
        bool(len(part)) and abs(float(np.median(part))) <= bound,
    )


def _inside(time_s: FloatArray, spans: tuple[WrongSpan, ...]) -> BoolArray:
    inside = np.zeros(len(time_s), dtype=bool)
    for one in spans:
        inside |= (time_s >= one.start_s) & (time_s <= one.end_s)
    return inside
