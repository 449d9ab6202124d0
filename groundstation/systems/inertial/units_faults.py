"""Faults that a unit shows in its own output: swapped axes, stuck or frozen values, steps."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import BoolArray
from groundstation.systems.inertial.units_answer import Measured
from groundstation.systems.inertial.units_grid import OnGrid, moved_m
from groundstation.systems.inertial.units_track import UnitTrack
from groundstation.tables.motion import runs

LEAST_STUCK_S = 10.0
LEAST_MOVED_MPS, RESOLUTIONS = 0.3, 5.0  # what others must show while a velocity stands still
QUICK_S, MOST_CHANGES = 10.0, 0.6
LEAST_FLOWN_MPS = 3.0
NEIGHBOURS, OFTEN, IMPOSSIBLE = 60, 0.3, -6.0  # rows; share of repeated values; decimal logarithm of the chance
LEAST_FROZEN_M = 100.0
CLEARLY_OFF_MPS, CLEARLY_BETTER = 10.0, 0.3  # for axes to be swapped
LEAST_STEP_M, LEAST_STEP_MPS = 15.0, 0.3
TIMES_USUAL = 3.0  # the largest half per cent of the usual steps
USUAL = 0.995
NEAR = 12  # rows before and after a step that are compared
ASIDE = 2  # rows at the step that are not
STAYS = 0.6  # share of a step that must last
SAME_TIME_S = 3.0
CLEARER = 3.0  # times the other unit's, for a step to be one's own
ROUNDING = 1e-6  # of a number in the log
AXES = ("north", "east")
IDENTITY = ((1.0, 0.0), (0.0, 1.0))

Matrix = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Held:
    """Span in which outputs of a unit stand still while the aircraft goes on.

    ``axes`` are those of the velocity; ``is_frozen`` when the position stands still too.
    """

    start_s: float
    end_s: float
    axes: tuple[int, ...]
    is_frozen: bool


@dataclass(frozen=True)
class Jump:
    """Step of a track: vector north and east, size, unit ``m`` or ``m/s``."""

    time_s: float
    vector: tuple[float, float]
    size: Measured
    unit: str


def held_spans(track: UnitTrack, others: Sequence[OnGrid]) -> tuple[Held, ...]:
    """Find the spans in which velocities or all outputs of a unit stand still and others move.

    A velocity sticks when it keeps one value for ten seconds or longer while the other tracks change quickly, or where
    they change at all and the unit's own noise makes so long a run next to impossible. A unit is frozen when its
    position stands still, too.
    """
    found: list[Held] = []
    for axis in range(2):
        values = track.velocity_mps[:, axis]
        same = np.concatenate([[False], np.diff(values) == 0.0])
        steps = np.abs(np.diff(values[np.isfinite(values)]))
        finest = float(np.min(steps[steps > ROUNDING], initial=np.inf))
        finest = finest if np.isfinite(finest) else 0.0
        least = max(LEAST_MOVED_MPS, RESOLUTIONS * finest)
        for start, end in runs(same):
            span = float(track.time_s[start - 1]), float(track.time_s[end - 1])
            if span[1] - span[0] < LEAST_STUCK_S or _distance_m(others, span) < LEAST_FLOWN_MPS * (span[1] - span[0]):
                continue
            moves = _moves(others, span, axis)
            if moves > least or (moves > finest and _is_impossible(same, start, end)):
                found.append(Held(*span, (axis,), False))
    places = np.concatenate([[False], (np.diff(track.latitude_deg) == 0.0) & (np.diff(track.longitude_deg) == 0.0)])
    for start, end in runs(places):
        span = float(track.time_s[start - 1]), float(track.time_s[end - 1])
        if span[1] - span[0] >= LEAST_STUCK_S and _distance_m(others, span) > LEAST_FROZEN_M:
            found.append(Held(*span, (0, 1), True))
    return _joined(found)


def _is_impossible(same: BoolArray, start: int, end: int) -> bool:
    """Tell whether a unit that repeats values so often would not make so long a run."""
    reach = max(end - start, NEIGHBOURS)
    near = np.concatenate([same[max(start - reach, 1) : start - 1], same[end + 1 : end + reach]])
    elsewhere = np.concatenate([same[1 : start - 1], same[end + 1 :]])
    if not (len(near) and len(elsewhere)):
        return False
    share = max(float(near.mean()), float(elsewhere.mean()), 1.0 / len(same))
    return share < OFTEN and np.log10(len(same)) + (end - start) * np.log10(share) < IMPOSSIBLE


def _distance_m(others: Sequence[OnGrid], span: tuple[float, float]) -> float:
    """Return how far the others flew in a span, the least of them; 0 where none is known."""
    found = []
    for one in others:
        velocity = one.velocity_mps[(one.time_s >= span[0]) & (one.time_s <= span[1])]
        speed = np.hypot(*velocity.T)
        if np.isfinite(speed).any():
            found.append(float(np.nanmean(speed)) * (span[1] - span[0]))
    return min(found, default=0.0)


def _moves(others: Sequence[OnGrid], span: tuple[float, float], axis: int) -> float:
    """Return by how much the others' velocity changes within ten seconds, the least of them.

    0 where none is known. Slow errors of the others change less in that time.
    """
    found = []
    for one in others:
        values = one.velocity_mps[(one.time_s >= span[0]) & (one.time_s <= span[1]), axis]
        reach = min(int(QUICK_S / (one.time_s[1] - one.time_s[0])), len(values) - 2)
        changes = np.abs(values[reach:] - values[:-reach]) if reach > 0 else np.zeros(0)
        if np.isfinite(changes).any():
            found.append(float(np.nanquantile(changes, MOST_CHANGES)))
    return min(found, default=0.0)


def _joined(found: list[Held]) -> tuple[Held, ...]:
    """Return the spans in order, those of both axes at one time as one."""
    out: list[Held] = []
    for one in sorted(found, key=lambda held: (held.start_s, held.axes)):
        last = out[-1] if out else None
        if last is not None and one.start_s < last.end_s:
            axes = tuple(sorted({*last.axes, *one.axes}))
            ends = min(one.start_s, last.start_s), max(one.end_s, last.end_s)
            out[-1] = Held(*ends, axes, last.is_frozen or one.is_frozen)
        else:
            out.append(one)
    return tuple(out)


def without_held(one: OnGrid, spans: Sequence[Held]) -> OnGrid:
    """Return a track without the velocities, and of frozen spans the places, that stood still."""
    for held in spans:
        rows = (one.time_s >= held.start_s - 1.0) & (one.time_s <= held.end_s + 1.0)
        one = one.hidden(np.asarray(rows), axes=held.axes, place=held.is_frozen)
    return one


def axes_of(velocity_mps: FloatArray, true_mps: FloatArray) -> Matrix | None:
    """Return how the axes of a velocity are exchanged, by one that is believed.

    None where they are right, or the motion does not tell.

    Examples
    --------
    >>> true = np.array([[100.0, 0.0], [0.0, 100.0], [80.0, 60.0]] * 20)
    >>> axes_of(true[:, ::-1], true), axes_of(true, true)
    (((0.0, 1.0), (1.0, 0.0)), None)
    """
    known = np.isfinite(velocity_mps).all(axis=1) & np.isfinite(true_mps).all(axis=1)
    if known.sum() < NEAR:
        return None
    velocity, true = velocity_mps[known], true_mps[known]

    def left(matrix: Matrix) -> float:
        return float(np.sqrt(np.mean(np.sum((velocity @ np.array(matrix).T - true) ** 2, axis=1))))

    as_it_is = left(IDENTITY)
    best = min(_ORDERS, key=left)
    return best if as_it_is > CLEARLY_OFF_MPS and left(best) < CLEARLY_BETTER * as_it_is else None


_ORDERS: tuple[Matrix, ...] = tuple(
    matrix
    for one, other in product((1.0, -1.0), repeat=2)
    for matrix in (((one, 0.0), (0.0, other)), ((0.0, one), (other, 0.0)))
)


def own_axes(one: OnGrid, step_rows: int = 10) -> Matrix | None:
    """Return how the axes of a velocity are exchanged by the unit's own position."""
    step_s = float(one.time_s[1] - one.time_s[0])
    moved = moved_m(one) / step_s
    count = len(moved) // step_rows * step_rows
    if not count:
        return None
    mean = 0.5 * (one.velocity_mps[1:] + one.velocity_mps[:-1])
    by_place, told = (part[:count].reshape(-1, step_rows, 2).mean(axis=1) for part in (moved, mean))
    return axes_of(told, by_place)


def axes_in_words(matrix: Matrix) -> str:
    """Return the exchange of axes in words.

    Examples
    --------
    >>> axes_in_words(((0.0, 1.0), (1.0, 0.0))), axes_in_words(((1.0, 0.0), (0.0, -1.0)))
    ('velocity north and east are exchanged', 'velocity east has the wrong sign')
    """
    if matrix[0][0] == 0.0:
        signs = "" if min(matrix[0][1], matrix[1][0]) > 0.0 else ", and signs are wrong"
        return f"velocity north and east are exchanged{signs}"
    wrong = [name for name, row, place in zip(AXES, matrix, (0, 1), strict=True) if row[place] < 0.0]
    return f"velocity {' and '.join(wrong)} {'has' if len(wrong) == 1 else 'have'} the wrong sign"


def position_jumps(one: OnGrid) -> tuple[Jump, ...]:
    """Find steps of a position that its own velocity does not explain.

    Larger than 15 m, three times the largest half per cent of the usual steps, and four steps of its resolution.
    """
    step_s = float(one.time_s[1] - one.time_s[0])
    left = moved_m(one) - 0.5 * (one.velocity_mps[1:] + one.velocity_mps[:-1]) * step_s
    moved = np.abs(moved_m(one))
    resolution = float(np.min(moved[moved > 1e-6], initial=0.0 if not (moved > 1e-6).any() else np.inf))
    return _jumps(one.time_s, left, max(LEAST_STEP_M, 4.0 * min(resolution, 100.0)), "m", sums=True)


def velocity_jumps(one: OnGrid, other: OnGrid) -> tuple[Jump, ...]:
    """Find lasting steps of the velocity of one track less another's."""
    apart = one.velocity_mps - other.velocity_mps
    left = np.diff(apart, axis=0)
    steps = [np.abs(np.diff(part.velocity_mps, axis=0)) for part in (one, other)]
    fine = [float(np.min(part[part > ROUNDING], initial=np.inf)) for part in steps]
    resolution = max((part for part in fine if np.isfinite(part)), default=0.0)
    return _jumps(one.time_s, left, max(LEAST_STEP_MPS, 4.0 * min(resolution, 1.0)), "m/s", sums=False)


def _jumps(time_s: FloatArray, left: FloatArray, least: float, unit: str, *, sums: bool) -> tuple[Jump, ...]:
    """Return the lasting steps of a series by its differences from row to row."""
    size = np.hypot(*left.T)
    known = size[np.isfinite(size)]
    if len(known) < 2 * NEAR:
        return ()
    limit = max(least, TIMES_USUAL * float(np.quantile(known, USUAL)))
    level = np.cumsum(np.nan_to_num(left), axis=0)
    large = np.nan_to_num(size) > limit
    usual = NORMAL_95 * _usual_change(level, left, large, sums=sums)
    found: list[Jump] = []
    last = -NEAR
    for row in np.flatnonzero(large).tolist():
        if row - last <= NEAR:
            continue
        if not (row > ASIDE and len(level) > row + ASIDE):
            continue
        before, after = _sides(row)
        seen = np.isfinite(size)
        if not (seen[before].any() and seen[after].any()):
            continue
        vector = _change(level, left, row, sums=sums)
        if np.hypot(*vector) < STAYS * size[row] or float(vector @ left[row]) <= 0.0:
            continue
        last = row
        jump = Measured(float(np.hypot(*vector)), usual)
        found.append(Jump(float(time_s[row + 1]), (float(vector[0]), float(vector[1])), jump, unit))
    return tuple(found)


def _sides(row: int) -> tuple[slice, slice]:
    """Return the rows before and after a step whose means are compared."""
    return slice(max(row - NEAR, 0), max(row - ASIDE, 0)), slice(row + ASIDE, row + NEAR)


def _change(level: FloatArray, left: FloatArray, row: int, *, sums: bool) -> FloatArray:
    """Return by how much the level changes across a row, shape (2,)."""
    before, after = _sides(row)
    vector = level[after].mean(axis=0) - level[before].mean(axis=0)
    if not sums:
        vector = vector - _slope(left, row) * (0.5 * (after.start + after.stop) - 0.5 * (before.start + before.stop))
    return np.asarray(vector)


def _usual_change(level: FloatArray, left: FloatArray, large: BoolArray, *, sums: bool) -> float:
    """Return one sigma, per axis, of the change of the level where there is no step.

    It is what the noise of both tracks, their rounding and their slow errors make of the size of a step.
    """
    known = np.isfinite(left).all(axis=1) & ~large
    rows = [row for row in range(NEAR, len(left) - NEAR, NEAR // 2) if known[row - NEAR : row + NEAR].all()]
    if not rows:  # gaps everywhere: as of a random walk
        return float(np.sqrt(NEAR * np.nanmean(np.square(left[~large]))))
    sides = np.arange(-NEAR, -ASIDE), np.arange(ASIDE, NEAR)
    before, after = (np.array(rows)[:, None] + side for side in sides)
    changes = level[after].mean(axis=1) - level[before].mean(axis=1)
    if not sums:
        usual = np.median(left[np.concatenate([before, after], axis=1)], axis=1)
        changes -= usual * (sides[1].mean() - sides[0].mean())
    return float(np.sqrt(np.mean(np.square(changes))))


def _slope(left: FloatArray, row: int) -> FloatArray:
    """Return the usual difference from row to row about a step: the median on either side."""
    around = np.concatenate([left[max(row - NEAR, 0) : max(row - ASIDE, 0)], left[row + ASIDE : row + NEAR]])
    return np.asarray(np.nanmedian(around, axis=0))


def own_spike(one: OnGrid, time_s: float) -> float:
    """Return how much a unit's velocity changes at a time against the seconds beside it, m/s."""
    row = int(np.searchsorted(one.time_s, time_s))
    change = np.diff(one.velocity_mps, axis=0)
    near = change[max(row - 3, 0) : row + 2]
    around = change[max(row - NEAR, 0) : row + NEAR]
    if not (np.isfinite(near).any() and np.isfinite(around).any()):
        return 0.0
    return float(np.nanmax(np.hypot(*(near - np.nanmedian(around, axis=0)).T)))


def is_near(time_s: float, others_s: Sequence[float], within_s: float = SAME_TIME_S) -> bool:
    """Tell whether a time is near one of others."""
    return any(abs(time_s - other) <= within_s for other in others_s)


def without_steps(one: OnGrid, jumps: Sequence[Jump]) -> tuple[FloatArray, BoolArray]:
    """Return the sum of the steps of position, and the rows before a step of velocity."""
    total = np.zeros((len(one.time_s), 2))
    before = np.ones(len(one.time_s), dtype=bool)
    for jump in jumps:
        later = one.time_s >= jump.time_s
        if jump.unit == "m":
            total[later] += jump.vector
        else:
            before &= ~later
    return total, before
