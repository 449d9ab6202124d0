"""Rhythm of a topic: its usual step in time, whether that is a period, and its gaps."""

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cached_property, lru_cache

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.gaps import Gaps, Pause, logged_ns
from groundstation.base.records import Int64Array
from groundstation.base.signals import is_canonical
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock_steps import quantiles
from groundstation.integrity.limits import GapLimits, RhythmLimits, Thresholds

AT_ONCE = 1 << 18  # steps of which some are taken
MOST_STEPS = 10_000  # steps from which a typical step is taken
WHOLE = 0.2  # periods that a step may be off a whole number of them
MOST_SKIPPED = 10.0  # periods: a longer step that is no gap explains nothing


@dataclass(frozen=True)
class Rhythm:
    """Steps between the times of a topic.

    Parameters
    ----------
    steps_ns : ndarray of int64
        All steps, none below zero; a pause of the log counts in none.
    ahead : int
        Number of steps ahead in time.
    period_ns : float
        Usual step; of a topic whose usual step is no period, the mean one.
    has_rate : bool
        The usual step is a period: there is a nominal rate and a coverage.
    has_gaps : bool
        A long step is a gap.
    pauses : tuple of Pause
        Those of the log; ``paused`` are the steps that they cut short.
    """

    steps_ns: Int64Array
    ahead: int
    period_ns: float
    has_rate: bool
    has_gaps: bool
    limits: GapLimits
    pauses: tuple[Pause, ...] = ()
    paused: tuple[int, ...] = ()

    @cached_property
    def span_ns(self) -> int:
        """Time of all steps together."""
        return int(self.steps_ns.sum())

    @cached_property
    def most_ns(self) -> int:
        """Longest of all steps; 0 without any."""
        return int(self.steps_ns.max(initial=0))

    @property
    def coverage(self) -> float:
        """Share of the samples expected at the usual step that are there, at most 1."""
        expected = self.span_ns / self.period_ns + 1.0
        return min(1.0, (self.ahead + 1) / expected)

    @property
    def jitter_s(self) -> float:
        """Root mean square of the steps less the period, without gaps."""
        inside = np.delete(self.steps_ns, self.paused) if self.paused else self.steps_ns
        inside = inside[inside <= self.longest_ns] if self.most_ns > self.longest_ns else inside
        return float(np.sqrt(np.mean(np.square(inside - self.period_ns)))) / NS_PER_S if len(inside) else 0.0

    @property
    def longest_ns(self) -> float:
        """Longest step that is no gap."""
        return _longest_ns(self.period_ns, self.limits)

    def gaps(self, topic: str, time_ns: Int64Array) -> Gaps:
        """Return the steps that are too long, for the times that the steps are of.

        A step with a pause in it is judged by its parts before and behind.
        """
        if not self.has_gaps:
            return Gaps(topic, np.zeros(0, dtype=np.int64), np.zeros(0))
        start_ns, end_ns = self.steps_beyond(time_ns, self.longest_ns)
        return Gaps(topic, start_ns, (end_ns - start_ns) / NS_PER_S)

    def steps_beyond(self, time_ns: Int64Array, least_ns: float) -> tuple[Int64Array, Int64Array]:
        """Return from and to of the steps longer than the least, pauses cut out."""
        steps_ns = self.steps_ns
        ends = [end for pause in self.pauses for end in pause if time_ns[0] < end < time_ns[-1]]
        if ends:
            time_ns = np.sort(np.concatenate((time_ns, np.array(ends, dtype=np.int64))), kind="stable")
            steps_ns = np.diff(logged_ns(time_ns, self.pauses))
        elif self.most_ns <= least_ns:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)  # a view would hold all times
        before = np.flatnonzero(steps_ns > least_ns)
        return time_ns[before], time_ns[before + 1]


def rhythm_of(topic: str, time_ns: Int64Array, thresholds: Thresholds, pauses: Sequence[Pause] = ()) -> Rhythm:
    """The rhythm of a topic, from its corrected times in order, shape (n,).

    A topic that is written when something happens has none: by its name, by too few or too uneven steps, or by bursts:
    all at one moment (definitions, units, lists) or with pauses between. A topic whose usual step leaves a good part of
    the time without an explanation (records that come in pairs, a wavering timer) has gaps, if it is canonical, by its
    mean step, but no nominal rate. Time within ``pauses`` of the log is no time of the topic.
    """
    limits, steps = thresholds.rhythm, _steps_ns(time_ns, pauses)
    ahead = len(steps) if steps.min(initial=1) > 0 else int(np.count_nonzero(steps > 0))
    if not ahead:
        return Rhythm(steps, 0, 0.0, False, False, thresholds.gaps)
    usual_ns, long_ns = quantiles(_some_ahead(steps, ahead), (0.5, 0.8))
    rows = (int(np.searchsorted(time_ns, one.start_ns, "right")) - 1 for one in pauses)
    paused = tuple(row for row in rows if 0 <= row < len(steps))
    found = Rhythm(steps, ahead, usual_ns, True, True, thresholds.gaps, tuple(pauses), paused)
    if _is_sporadic(topic, found, long_ns, limits):
        return replace(found, has_rate=False, has_gaps=False)
    if _is_unexplained(found, limits):
        mean_ns = found.span_ns / ahead
        return replace(found, period_ns=mean_ns, has_rate=False, has_gaps=is_canonical(topic))
    return found


def _some_ahead(steps_ns: Int64Array, ahead: int) -> Int64Array:
    """Return some of the steps ahead, evenly spread; ``ahead`` is the number of all.

    Those of a long log are gone through in parts.

    Examples
    --------
    >>> _some_ahead(np.array([3, 0, 4, 5]), 3).tolist()
    [3, 4, 5]
    """
    every = ahead // MOST_STEPS | 1  # odd: two steps in turn are both met
    if ahead == len(steps_ns):
        return steps_ns[::every]
    parts, seen = [], 0
    for start in range(0, len(steps_ns), AT_ONCE):
        part = steps_ns[start : start + AT_ONCE]
        part = part[part > 0]
        parts.append(part[-seen % every :: every].copy())  # a view would hold the whole part
        seen += len(part)
    return np.concatenate(parts)


def _steps_ns(time_ns: Int64Array, pauses: Sequence[Pause]) -> Int64Array:
    """Return the steps of logged time; one over a pause stays a step ahead."""
    steps_ns = np.diff(time_ns)
    return np.maximum(np.diff(logged_ns(time_ns, pauses)), np.minimum(steps_ns, 1)) if pauses else steps_ns


def _longest_ns(period_ns: float, limits: GapLimits) -> float:
    return max(limits.periods * period_ns, limits.min_s * NS_PER_S)


def _is_sporadic(topic: str, rhythm: Rhythm, long_ns: float, limits: RhythmLimits) -> bool:
    """Tell whether a topic is written only when something happens."""
    if _is_among(topic, limits.sporadic_topics):
        return True
    if is_canonical(topic):
        return False
    if rhythm.ahead < limits.fewest_steps or long_ns > limits.uneven * rhythm.period_ns:
        return True
    long = rhythm.steps_ns[rhythm.steps_ns > rhythm.longest_ns]
    gaps = len(long)
    if rhythm.span_ns - int(long.sum()) < limits.burst_s * NS_PER_S * (gaps + 1):
        return True  # lists and definitions, written at one moment: the step in a burst is no period
    is_thin = rhythm.coverage < limits.burst_coverage
    return is_thin and gaps > 0 and (rhythm.ahead + 1) / (gaps + 1) < limits.burst_rows


@lru_cache(maxsize=1_024)  # the flights of a folder have the same topics
def _is_among(topic: str, patterns: tuple[str, ...]) -> bool:
    return any(fnmatchcase(topic, pattern) for pattern in patterns)


def _is_unexplained(rhythm: Rhythm, limits: RhythmLimits) -> bool:
    """Tell whether more is missing than gaps explain: then the usual step is not the period."""
    coverage = rhythm.coverage
    if 1.0 - coverage <= limits.unexplained:
        return False
    ratio = rhythm.steps_ns / rhythm.period_ns
    is_gap = rhythm.steps_ns > _longest_ns(rhythm.period_ns, rhythm.limits)
    skips = (ratio > 1.5) & (ratio < MOST_SKIPPED) & (np.abs(ratio - np.rint(ratio)) < WHOLE)  # missing one by one
    missing = float(ratio.sum()) - rhythm.ahead
    explained = float((ratio[is_gap | skips] - 1.0).sum())
    return missing - explained > limits.unexplained * (rhythm.ahead + missing)
