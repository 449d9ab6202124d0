"""Units of one flight made comparable.

Copies are found, clocks brought together, axes put right, held outputs and steps taken out.
"""

from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.systems.inertial.units_answer import Measured
from groundstation.systems.inertial.units_clocks import ClockFit, clock_fit, repeats
from groundstation.systems.inertial.units_faults import (
    CLEARER,
    SAME_TIME_S,
    Held,
    Jump,
    Matrix,
    axes_of,
    held_spans,
    is_near,
    own_axes,
    own_spike,
    position_jumps,
    velocity_jumps,
    without_held,
    without_steps,
)
from groundstation.systems.inertial.units_grid import OnGrid, apart_m, grid_of, in_time, on_grid
from groundstation.systems.inertial.units_track import ReferenceTrack, UnitTrack
from groundstation.tables.sources import AIDED

BY_POSITION, BY_VELOCITY = "against its own position", "against its own velocity"


@dataclass(frozen=True)
class Swapped:
    """Axes of a velocity that are exchanged, what shows it, and the topics that it may be."""

    matrix: Matrix
    by: str
    topics: tuple[str, ...]


@dataclass(frozen=True)
class Stepped:
    """Step of one of some topics, and what shows it."""

    jump: Jump
    by: str
    topics: tuple[str, ...]


@dataclass(frozen=True)
class Prepared:
    """One unit on the grid: as logged (``raw``), and with its faults taken out (``clean``).

    Parameters
    ----------
    track : UnitTrack
    raw, clean : OnGrid
        On the common clock.
    same_as : str
        Topic of the unit that it repeats; ``same_later_s`` by how much later, ``same_rows`` in how many rows.
    late_s : Measured or None
        How late its stamps are behind the unit by which clocks are set; ``more_s`` at the end more than in the middle.
    swapped : Swapped or None
    held : tuple of Held
    removed_m : ndarray, shape (n, 2)
        What its steps of position have added up to.
    unbroken : ndarray, shape (n,)
        Rows before its first step of velocity.
    """

    track: UnitTrack
    raw: OnGrid
    clean: OnGrid
    same_as: str = ""
    same_later_s: float = 0.0
    same_rows: int = 0
    late_s: Measured | None = None
    more_s: Measured | None = None
    swapped: Swapped | None = None
    held: tuple[Held, ...] = ()
    removed_m: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    unbroken: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))

    @property
    def topic(self) -> str:
        """Topic of the unit."""
        return self.track.topic

    @property
    def is_witness(self) -> bool:
        """Tell whether it stands for itself: no copy of another, and not corrected by GNSS."""
        return not self.same_as and self.track.kind != AIDED

    def apart_m(self, other: "Prepared | OnGrid") -> FloatArray:
        """Position less another's, steps taken out, shape (n, 2)."""
        if isinstance(other, OnGrid):
            return apart_m(self.clean, other) - self.removed_m
        return apart_m(self.clean, other.clean) - self.removed_m + other.removed_m


@dataclass(frozen=True)
class Comparable:
    """Units and reference on one grid, with the steps that were found."""

    time_s: FloatArray
    units: tuple[Prepared, ...]
    reference: OnGrid | None
    steps: tuple[Stepped, ...]

    @property
    def witnesses(self) -> tuple[Prepared, ...]:
        """Units that stand for themselves."""
        return tuple(one for one in self.units if one.is_witness)


def prepare(tracks: Sequence[UnitTrack], reference: ReferenceTrack | None) -> Comparable:
    """Bring units and reference to one grid and one clock, and take out own faults."""
    grid_s = grid_of(tracks)
    against = None if reference is None else on_grid(reference, grid_s)
    units = [Prepared(track, grid, grid) for track in tracks for grid in (on_grid(track, grid_s),)]
    units = _without_copies(units)
    units = _upright(units, against)
    units = _on_one_clock(units, against, grid_s)
    units = [_unstuck(one, units, against) for one in units]
    steps = _steps_of(units, against)
    units = [_unstepped(one, steps) for one in units]
    return Comparable(grid_s, tuple(units), against, steps)


def _without_copies(units: list[Prepared]) -> list[Prepared]:
    out: list[Prepared] = []
    for one in units:
        for first in out:
            found = None if first.same_as else repeats(first.track, one.track)
            if found is not None:
                one = replace(one, same_as=first.topic, same_later_s=found[0], same_rows=found[1])
                break
        out.append(one)
    return out


def _upright(units: list[Prepared], against: OnGrid | None) -> list[Prepared]:
    """Put exchanged axes right: by own position, by the reference, or by the others."""
    witnesses = [one for one in units if not one.same_as]
    found: dict[str, Swapped] = {}
    for one in witnesses:
        by_itself = own_axes(one.raw)
        by_reference = None if against is None else axes_of(one.raw.velocity_mps, against.velocity_mps)
        if by_itself is not None:
            found[one.topic] = Swapped(by_itself, BY_POSITION, (one.topic,))
        elif by_reference is not None:
            found[one.topic] = Swapped(by_reference, "against the reference", (one.topic,))
    left = [one for one in witnesses if one.topic not in found]
    if against is None and len(left) > 1:
        found |= _by_the_others(left)
    return [_turned(one, found[one.topic]) if one.topic in found else one for one in units]


def _by_the_others(units: list[Prepared]) -> dict[str, Swapped]:
    """Exchanged axes of the unit that differs so from all the others; of two it may be either."""
    for one in units:
        others = [other for other in units if other is not one]
        told = [axes_of(one.raw.velocity_mps, other.raw.velocity_mps) for other in others]
        seen = [matrix for matrix in told if matrix is not None]
        if len(seen) == len(others):
            topics = (one.topic,) if len(others) > 1 else tuple(unit.topic for unit in units)
            return {one.topic: Swapped(seen[0], "against the others", topics)}
    return {}


def _turned(one: Prepared, swapped: Swapped) -> Prepared:
    velocity = one.raw.velocity_mps @ np.array(swapped.matrix).T
    return replace(one, clean=replace(one.raw, velocity_mps=velocity), swapped=swapped)


def _on_one_clock(units: list[Prepared], against: OnGrid | None, grid_s: FloatArray) -> list[Prepared]:
    """Take off by how much stamps are late.

    The clock in the middle of three or more is the right one.

    Of two it is the one that is nearer to the reference.
    """
    step_s = float(grid_s[1] - grid_s[0]) if len(grid_s) > 1 else 1.0
    own = [one for one in units if not one.same_as]
    if len(own) < 2:
        return units
    first = own[0]
    fits = {one.topic: clock_fit(first.clean.velocity_mps, one.clean.velocity_mps, step_s) for one in own[1:]}
    base = first
    sure = {topic: fit.taken_off[0] for topic, fit in fits.items() if fit is not None}
    if any(sure.values()):
        base = _right_clock(own, {first.topic: 0.0, **sure}, against, step_s)
    if base is not first:
        fits = {
            one.topic: clock_fit(base.clean.velocity_mps, one.clean.velocity_mps, step_s)
            for one in own
            if one is not base
        }
    return [_timed(one, fits.get(one.topic), grid_s) for one in units]


def _right_clock(own: list[Prepared], late_s: dict[str, float], against: OnGrid | None, step_s: float) -> Prepared:
    if len(own) > 2:
        middle = float(np.median(list(late_s.values())))
        return min(own, key=lambda one: abs(late_s.get(one.topic, np.inf) - middle))
    if against is None:
        return own[0]
    fits = [clock_fit(against.velocity_mps, one.clean.velocity_mps, step_s) for one in own]
    away = [np.inf if fit is None else abs(fit.late_s.value) for fit in fits]
    return own[int(np.argmin(away))]


def _timed(one: Prepared, fit: ClockFit | None, grid_s: FloatArray) -> Prepared:
    if fit is None:
        return one
    late, more = fit.taken_off
    one = replace(one, late_s=fit.late_s, more_s=fit.more_s)
    if not (late or more):
        return one
    track = replace(one.track, time_s=in_time(one.track.time_s, grid_s, late, more))
    one = replace(one, track=track, raw=on_grid(track, grid_s))
    return replace(one, clean=one.raw) if one.swapped is None else _turned(one, one.swapped)


def _unstuck(one: Prepared, units: list[Prepared], against: OnGrid | None) -> Prepared:
    others = [other.clean for other in units if other.topic != one.topic and not other.same_as]
    held = held_spans(one.track, [*others, *(part for part in (against,) if part is not None)])
    return replace(one, held=held, clean=without_held(one.clean, held)) if held else one


def _steps_of(units: list[Prepared], against: OnGrid | None) -> tuple[Stepped, ...]:
    """Find steps of position by a unit's own velocity, of velocity by the other tracks."""
    own = [one for one in units if one.is_witness]
    found = [
        Stepped(jump, BY_VELOCITY, (one.topic,))
        for one in own
        for jump in position_jumps(one.clean)
        if not is_near(jump.time_s, [end for held in one.held for end in (held.start_s, held.end_s)])
    ]
    tracks: list[tuple[str, OnGrid]] = [(one.topic, one.clean) for one in own]
    if against is not None:
        tracks.append(("", against))
    seen: list[tuple[Jump, str, str]] = []
    for place, (topic, one) in enumerate(tracks):
        for other_topic, other in tracks[place + 1 :]:
            seen += [(jump, topic, other_topic) for jump in velocity_jumps(one, other)]
    return (*found, *_whose(seen, dict(tracks)))


def _whose(seen: list[tuple[Jump, str, str]], tracks: dict[str, OnGrid]) -> list[Stepped]:
    """Name the unit of each step of velocity: the one that is in all the pairs that show it."""
    found: list[Stepped] = []
    left = sorted(seen, key=lambda one: one[0].time_s)
    while left:
        at_s = left[0][0].time_s
        group = [one for one in left if one[0].time_s - at_s <= SAME_TIME_S]
        left = left[len(group) :]
        common = set.intersection(*({first, second} for _, first, second in group))
        if common == {""}:  # all units against the reference: it jumps, not they
            continue
        common -= {""}
        jump, first, second = max(group, key=lambda one: one[0].size.value)
        told = sorted(common) or sorted({first, second} - {""})
        by = "against the others" if len(group) > 1 else "against the reference" if "" in (first, second) else ""
        if len(told) > 1:
            spikes = sorted(told, key=lambda topic: own_spike(tracks[topic], jump.time_s))
            if own_spike(tracks[spikes[-1]], jump.time_s) > CLEARER * own_spike(tracks[spikes[0]], jump.time_s):
                told, by = [spikes[-1]], BY_VELOCITY
        sign = -1.0 if told[0] == second else 1.0
        vector = sign * jump.vector[0], sign * jump.vector[1]
        found.append(Stepped(replace(jump, vector=vector), by or "in the difference of two units", tuple(told)))
    return found


def _unstepped(one: Prepared, steps: Sequence[Stepped]) -> Prepared:
    own = [step.jump for step in steps if one.topic in step.topics]
    removed, unbroken = without_steps(one.clean, own)
    return replace(one, removed_m=removed, unbroken=unbroken)
