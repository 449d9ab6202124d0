"""Growth of each unit and each pair beside the limits of honest units."""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.systems.inertial.units_answer import Measured
from groundstation.systems.inertial.units_grid import OnGrid, apart_m, heading_apart_deg
from groundstation.systems.inertial.units_growth import Growth, Noise, growth_of
from groundstation.systems.inertial.units_limits import GrowthLimits, limits_of, pair_limits_of
from groundstation.systems.inertial.units_noise import heading_apart, pair_noise
from groundstation.systems.inertial.units_prepare import Comparable, Prepared

STAND_MPS, STAND_S = 3.0, 5.0  # a log that begins at a standstill
FRESH_M = 60.0  # apart there: both began to navigate just before
SAME_START_S = 120.0  # between the starts of two units


@dataclass(frozen=True)
class Judged:
    """Growth of a difference beside the limits that it is held against.

    ``shown`` is the growth of what was logged, ``growth`` with steps and held outputs taken out; ``over`` how many
    times the limit it is at most, 0 where it is not judged. ``heading`` is the difference of the headings of a pair,
    ``against_deg`` that of a unit less the reference.
    """

    topics: tuple[str, ...]
    shown: Growth | None
    growth: Growth | None
    limits: GrowthLimits | None
    is_start_known: bool
    heading: Measured | None = None
    against_deg: float | None = None

    @property
    def over(self) -> float:
        """Largest ratio of rate and velocity to their limits."""
        return max(self.ratios, default=0.0)

    @property
    def ratios(self) -> tuple[float, ...]:
        """Ratios of rate and velocity to their limits, of those that are known."""
        if self.growth is None or self.limits is None:
            return ()
        pairs = (
            (self.growth.rate_nmiph, self.limits.rate_nmiph),
            (self.growth.velocity_mps, self.limits.velocity_mps),
        )
        return tuple(found.value / limit for found, limit in pairs if found is not None)

    @property
    def heading_over(self) -> float | None:
        """Ratio of the heading difference of a pair to its limit, None where it is not judged."""
        if self.heading is None or self.limits is None:
            return None
        return abs(self.heading.value) / self.limits.heading_deg

    @property
    def is_beyond(self) -> bool:
        """Tell whether a limit of growth is exceeded."""
        return self.over > 1.0


def against_reference(found: Comparable, noise: Noise, classes: Mapping[str, str]) -> dict[str, Judged]:
    """Return each unit against the reference, by topic; ``classes`` are those of their limits."""
    if found.reference is None:
        return {}
    return {one.topic: _against(found, one, found.reference, noise, classes[one.topic]) for one in found.units}


def _against(found: Comparable, one: Prepared, reference: OnGrid, noise: Noise, ins_class: str) -> Judged:
    start_s = one.track.start_s
    apart = apart_m(one.raw, reference)
    velocity = one.raw.velocity_mps - reference.velocity_mps
    begun_s = _first_s(found.time_s, apart, velocity) if start_s is None else start_s
    if begun_s is None:
        return Judged((one.topic,), None, None, None, start_s is not None)
    elapsed = found.time_s - begun_s
    set_s = tuple(
        float(step.jump.time_s - begun_s)
        for step in found.steps
        if step.topics == (one.topic,) and step.jump.unit == "m"
    )
    is_known = start_s is not None
    shown = growth_of(elapsed, apart, velocity, noise, from_first=not is_known, reset_s=set_s)
    place, speed = _unbroken(one.apart_m(reference), one.clean.velocity_mps - reference.velocity_mps, one.unbroken)
    growth = growth_of(elapsed, place, speed, noise, from_first=not is_known)
    found_limits = None if growth is None else limits_of(ins_class, growth.hours, is_start_known=is_known)
    limits = found_limits.single if found_limits is not None and one.is_witness else None
    return Judged((one.topic,), shown, growth, limits, is_known, against_deg=heading_apart_deg(one.raw, reference))


def in_pairs(found: Comparable, classes: Mapping[str, str]) -> tuple[Judged, ...]:
    """Return every two units, the second less the first."""
    return tuple(_pair(found, first, second, classes) for first, second in combinations(found.units, 2))


def _pair(found: Comparable, first: Prepared, second: Prepared, classes: Mapping[str, str]) -> Judged:
    topics = (first.topic, second.topic)
    apart = apart_m(second.raw, first.raw)
    velocity = second.raw.velocity_mps - first.raw.velocity_mps
    begun_s = _first_s(found.time_s, apart, velocity)
    if begun_s is None:
        return Judged(topics, None, None, None, is_start_known=False)
    start_s = pair_start_s(found.time_s, first, second, apart, begun_s)
    is_known = start_s is not None
    elapsed = found.time_s - (begun_s if start_s is None else start_s)
    grids = first.raw, second.raw
    noise = pair_noise(first.track, second.track, grids)
    shown = growth_of(elapsed, apart, velocity, noise, from_first=not is_known)
    unbroken = first.unbroken & second.unbroken
    place, speed = _unbroken(second.apart_m(first), second.clean.velocity_mps - first.clean.velocity_mps, unbroken)
    growth = growth_of(elapsed, place, speed, noise, from_first=not is_known)
    limits = None
    if growth is not None and first.is_witness and second.is_witness:
        both = classes[first.topic], classes[second.topic]
        limits = pair_limits_of(both, growth.hours, is_start_known=is_known)
    heading = heading_apart(first.track, second.track, grids)
    return Judged(topics, shown, growth, limits, is_known, heading)


def _first_s(time_s: FloatArray, apart: FloatArray, velocity: FloatArray) -> float | None:
    known = np.isfinite(apart).all(axis=1) | np.isfinite(velocity).all(axis=1)
    return float(time_s[np.argmax(known)]) if known.any() else None


def _unbroken(apart: FloatArray, velocity: FloatArray, rows: BoolArray) -> tuple[FloatArray, FloatArray]:
    keep = rows[:, None]
    return np.where(keep, apart, np.nan), np.where(keep, velocity, np.nan)


def pair_start_s(
    time_s: FloatArray, first: Prepared, second: Prepared, apart: FloatArray, begun_s: float
) -> float | None:
    """Return when both of two units began to navigate; None where nothing shows it.

    It is stated or proven for both, or their log begins at a standstill with them at one place.
    """
    starts = [one.track.start_s for one in (first, second)]
    known = [start for start in starts if start is not None]
    if len(known) == 2 and max(known) - min(known) < SAME_START_S:
        return max(known)
    rows = (time_s >= begun_s) & (time_s <= begun_s + STAND_S)
    for one in (first, second):
        speed = np.hypot(*one.raw.velocity_mps[rows].T)
        if not (np.isfinite(speed).any() and float(np.nanmax(speed)) < STAND_MPS):
            return None
    near = np.hypot(*apart[rows].T)
    has_place = bool(np.isfinite(near).any())
    return begun_s if not has_place or float(np.nanmedian(near)) < FRESH_M else None


def beyond(pairs: Sequence[Judged], without: Sequence[str] = ()) -> list[Judged]:
    """Return the pairs beyond their limits, but for those with one of some units."""
    return [one for one in pairs if one.is_beyond and not set(one.topics) & set(without)]
