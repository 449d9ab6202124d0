"""Rows of the least-squares problem: readings linearised about given states.

The predictions are those of ``observation.py`` and of the wheeled vehicles' sensors, for many readings at once.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.base.records import BoolArray, Int64Array
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.observation import LIGHT_MPS, NEAREST_M
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER, POINT, SATELLITE, Events
from groundstation.systems.cooperative.smoother.knots import Knots
from groundstation.systems.cooperative.smoother.layout import Layout, pair_of
from groundstation.systems.cooperative.smoother.sight import Ends, RangeErrors

AT_ONCE = 20_000  # readings linearised together


@dataclass(frozen=True, slots=True)
class _Side:
    """Ends at vehicles of one group, of all receivers or of all sources.

    ``event`` (e,) are the places of their measurements, ``columns`` (e, n) those of their states.
    """

    event: Int64Array
    columns: Int64Array
    ends: Ends


@dataclass(frozen=True, slots=True)
class Linearised:
    """Rows about some states: residuals, and derivatives of the predictions.

    Parameters
    ----------
    residual : ndarray, shape (r,)
        Measured minus predicted; NaN where a source is on top of the receiver.
    values : ndarray, shape (r, w)
        By the states in ``Rows.columns``.
    """

    residual: FloatArray
    values: FloatArray


class Rows:
    """All rows of a session, in the order of the knots.

    Parameters
    ----------
    event, knot : ndarrays of int, shape (r,)
        Measurement (of the prepared events) and knot of each row.
    is_bearing : ndarray of bool
    columns : ndarray of int, shape (r, w)
        States of each row; that behind the last state means none.
    variance, spread : ndarrays, shape (r,)
        As stated, and the share of it that one reading is spread by.
    first : ndarray of int, shape (t + 1,)
        Rows of knot k: first[k] to first[k + 1].
    """

    def __init__(self, prepared: Prepared, layout: Layout, knots: Knots) -> None:
        self._prepared, self._layout = prepared, layout
        chosen, all_events = knots.event, prepared.events
        self._events = Events._make(column[chosen] for column in all_events)
        self._knot = knots.knot
        has_range = np.isfinite(self._events.value_m)
        has_bearing = np.isfinite(self._events.bearing_rad)
        self._has_bearings = bool(has_bearing.any())
        number = np.arange(len(chosen))
        place = np.concatenate([number[has_range], number[has_bearing]])
        second = np.repeat([False, True], [has_range.sum(), has_bearing.sum()])
        order = np.lexsort((second, place))
        self._place, self.is_bearing = place[order], second[order]
        self.event, self.knot = chosen[self._place], knots.knot[self._place]
        self.variance = np.where(
            self.is_bearing, all_events.bearing_variance_rad2[self.event], all_events.variance_m2[self.event]
        )
        self.spread = np.where(self.kind >= SATELLITE, 1.0, all_events.spread[self.event])
        self.first = np.searchsorted(self.knot, np.arange(len(knots.time_s) + 1))
        self._first_event = np.searchsorted(self._knot, np.arange(len(knots.time_s) + 1))
        self._wide = max(group.size for group in layout.groups)
        self._receivers = self._sides(self._events.receiver, np.ones(len(chosen), dtype=bool))
        self._sources = self._sides(self._events.source, self._events.kind == PEER)
        self._all_columns = self._columns()
        self.columns = self._all_columns[self._place]

    @property
    def kind(self) -> Int64Array:
        """Kind of the measurement of each row."""
        return np.asarray(self._prepared.events.kind[self.event])

    def _sides(self, vehicle: Int64Array, mask: BoolArray) -> list[_Side]:
        sides, layout = [], self._layout
        for number, group in enumerate(layout.groups):
            mine = np.flatnonzero(mask & (layout.of_vehicle[np.where(mask, vehicle, 0), 0] == number))
            who = vehicle[mine]
            columns = layout.of_vehicle[who, 2][:, None] + np.arange(group.size)
            index = layout.of_vehicle[who, 1]
            sides.append(_Side(mine, columns, group.ends(index, self._events.time_s[mine], self._knot[mine])))
        return sides

    def _columns(self) -> Int64Array:
        events, layout, n = self._events, self._layout, self._wide
        columns = np.full((len(events.time_s), 2 * n + 3), layout.size, dtype=np.int64)
        for at, sides in ((0, self._receivers), (n, self._sources)):
            for side in sides:
                columns[side.event, at : at + side.columns.shape[1]] = side.columns
        point = np.where(events.kind == POINT, events.source, -1)
        if len(layout.points):
            at_point = np.where(point >= 0, layout.points[point], -1)
            known = at_point >= 0
            columns[known, 2 * n], columns[known, 2 * n + 1] = at_point[known], at_point[known] + 1
        if layout.pairs:
            ends = np.stack([events.receiver, events.source, events.kind])
            unique, inverse = np.unique(ends, axis=1, return_inverse=True)
            found = [layout.pairs.get(pair_of(*one), layout.size) for one in unique.T.tolist()]
            columns[:, 2 * n + 2] = np.array(found, dtype=np.int64)[inverse.ravel()]
        return columns

    def linearise(self, x: FloatArray, first: int, last: int) -> Linearised:
        """Linearise the rows of the knots first to last - 1 about their states (l, n)."""
        if self._first_event[last] - self._first_event[first] <= AT_ONCE or last - first < 2:
            return self._linearised(x, first, last)
        residual = np.empty(int(self.first[last] - self.first[first]))
        values = np.empty((len(residual), self.columns.shape[1]))
        one = first
        while one < last:
            two = int(np.searchsorted(self._first_event, self._first_event[one] + AT_ONCE, side="right")) - 1
            two = min(max(two, one + 1), last)
            part = self._linearised(x[one - first : two - first], one, two)
            rows = slice(int(self.first[one] - self.first[first]), int(self.first[two] - self.first[first]))
            residual[rows], values[rows] = part.residual, part.values
            one = two
        return Linearised(residual, values)

    def _linearised(self, x: FloatArray, first: int, last: int) -> Linearised:
        part = slice(int(self._first_event[first]), int(self._first_event[last]))
        whole = np.concatenate([x, np.zeros((len(x), 1))], axis=1)  # the state behind the last is 0
        states = whole[(self._knot[part] - first)[:, None], self._all_columns[part]]
        events = Events._make(column[part] for column in self._events)
        seen = _Seen(self, events, states, part)
        rows = slice(int(self.first[first]), int(self.first[last]))
        place, is_bearing = self._place[rows] - part.start, self.is_bearing[rows]
        residual, values = seen.ranges()
        if not self._has_bearings:
            return Linearised(residual[place], values[place])
        angle, by_angle = seen.bearings()
        return Linearised(
            np.where(is_bearing, angle[place], residual[place]),
            np.where(is_bearing[:, None], by_angle[place], values[place]),
        )


class _Seen:
    """Readings of some knots with both their ends."""

    def __init__(self, rows: Rows, events: Events, states: FloatArray, part: slice) -> None:
        self._rows, self._events, self._states, self._part = rows, events, states, part
        n, m = rows._wide, len(states)
        self.line, self.values = np.zeros((m, 3)), np.zeros_like(states)
        self.by_receiver, self.by_source = np.zeros((m, 3, n)), np.zeros((m, 3, n))
        self.late, self.lag = np.zeros(m), np.full(m, -1)
        self.heading, self.by_heading = np.full(m, np.nan), np.zeros((m, n))
        self.velocity = np.zeros((m, 3))
        place = np.zeros((m, 3))
        receivers = [(at, side, cut) for side, at, cut in self._cuts(rows._receivers)]
        for at, side, cut in receivers:
            size, lag = side.columns.shape[1], side.ends.lag
            x = states[at, :size]
            late = x[:, lag] if lag >= 0 else None
            sight = side.ends.sight(x, cut, late)
            place[at], self.by_receiver[at, :, :size] = sight.place_m, sight.by_state
            self.velocity[at] = sight.velocity_mps
            if lag >= 0:
                self.late[at], self.lag[at] = x[:, lag], lag
            if sight.heading_rad is not None and sight.by_heading is not None:
                self.heading[at], self.by_heading[at, :size] = sight.heading_rad, sight.by_heading
        source = events.place_m.copy()
        if len(rows._layout.points) and (rows._layout.points >= 0).any():
            axes = rows._prepared.points.axes
            moved = np.flatnonzero(rows._all_columns[part][:, 2 * n] < rows._layout.size)
            source[moved] -= (axes[events.source[moved]] @ states[moved, 2 * n : 2 * n + 2, None])[..., 0]
        self.has_lag = bool((self.lag >= 0).any())
        for side, at, cut in self._cuts(rows._sources):
            size = side.columns.shape[1]
            sight = side.ends.sight(states[at, n : n + size], cut, self.late[at] if self.has_lag else None)
            source[at], self.by_source[at, :, :size] = sight.place_m, sight.by_state
            self.velocity[at] -= sight.velocity_mps
        self.source = source
        self.line = place - source + events.arm_m
        self.receivers = receivers
        self.distance = np.sqrt((self.line**2).sum(axis=1))
        self.is_lost = (self.distance < NEAREST_M) & (events.kind != HEIGHT)

    def _cuts(self, sides: list[_Side]) -> list[tuple[_Side, Int64Array, slice]]:
        """Cut the sides to the readings at hand; places among these, and rows of the ends."""
        found = []
        for side in sides:
            first, last = np.searchsorted(side.event, [self._part.start, self._part.stop])
            if last > first:
                found.append((side, side.event[first:last] - self._part.start, slice(int(first), int(last))))
        return found

    def _row(self, by_line: FloatArray) -> FloatArray:
        """Return derivatives of what depends on the line from the source to the receiver (m, 3)."""
        rows, n = self._rows, self._rows._wide
        values = np.zeros_like(self._states)
        values[:, :n] = (by_line[:, None, :] @ self.by_receiver)[:, 0]
        values[:, n : 2 * n] = -(by_line[:, None, :] @ self.by_source)[:, 0]
        if self.has_lag:
            at = np.flatnonzero(self.lag >= 0)
            values[at, self.lag[at]] -= (by_line[at] * self.velocity[at]).sum(axis=1)
        if len(rows._layout.points) and (rows._layout.points >= 0).any():
            at = np.flatnonzero(rows._all_columns[self._part][:, 2 * n] < rows._layout.size)
            axes = rows._prepared.points.axes[self._events.source[at]]
            values[at, 2 * n : 2 * n + 2] = (by_line[at, None, :] @ axes)[:, 0]
        return values

    def ranges(self) -> tuple[FloatArray, FloatArray]:
        """Return residuals of ranges and heights, and their derivatives."""
        events, rows, n = self._events, self._rows, self._rows._wide
        distance, line = self.distance.copy(), self.line
        is_satellite = events.kind == SATELLITE
        if is_satellite.any():
            line = line.copy()
            line[is_satellite], distance[is_satellite] = _while_the_earth_turns(
                self.line[is_satellite], self.source[is_satellite]
            )
        direction = line / np.maximum(distance, NEAREST_M)[:, None]
        values, predicted = self._row(direction), distance.copy()
        is_height = events.kind == HEIGHT
        takes_error = ~is_satellite & ~is_height
        one_way = ~events.is_two_way & ~is_height
        for at, side, cut in self.receivers:
            size = side.columns.shape[1]
            x = self._states[at, :size]
            errors = side.ends.errors(x, cut, (events.kind[at] == PEER).astype(np.float64))
            _add_errors(errors, takes_error[at], at, distance, predicted, values, n)
            if side.ends.clock is not None and side.ends.receiver_clock is not None:
                clock = np.where(is_satellite[at, None], side.ends.receiver_clock[cut], side.ends.clock[cut])
                clock = clock * one_way[at, None]
                predicted[at] += (clock * x).sum(axis=1)
                values[at, :size] += clock
            if side.ends.height is not None and is_height[at].any():
                high = at[is_height[at]]
                row = side.ends.height[cut][is_height[at]]
                values[high] = 0.0
                values[high, :size] = -row
                predicted[high] = side.ends.level_m[cut][is_height[at]] - (row * x[is_height[at]]).sum(axis=1)
        for side, at, cut in self._cuts(rows._sources):
            if side.ends.clock is not None:
                size = side.columns.shape[1]
                clock = side.ends.clock[cut] * one_way[at, None]
                predicted[at] -= (clock * self._states[at, n : n + size]).sum(axis=1)
                values[at, n : n + size] -= clock
        if rows._layout.pairs:
            predicted += self._states[:, 2 * n + 2]
            values[:, 2 * n + 2] = rows._all_columns[self._part][:, 2 * n + 2] < rows._layout.size
        residual = np.where(self.is_lost, np.nan, events.value_m - predicted)
        return residual, values

    def bearings(self) -> tuple[FloatArray, FloatArray]:
        """Return residuals of bearings, and their derivatives."""
        events, n = self._events, self._rows._wide
        north, east = -self.line[:, 0], -self.line[:, 1]
        square = np.maximum(north**2 + east**2, NEAREST_M**2)
        values = self._row(np.stack([east, -north, np.zeros(len(east))], axis=1) / square[:, None])
        values[:, :n] -= self.by_heading
        off = events.bearing_rad - (np.arctan2(east, north) - self.heading)
        residual = (off + np.pi) % (2.0 * np.pi) - np.pi
        return np.where(self.is_lost, np.nan, residual), values


def _add_errors(
    errors: RangeErrors,
    takes: BoolArray,
    at: Int64Array,
    distance: FloatArray,
    predicted: FloatArray,
    values: FloatArray,
    wide: int,
) -> None:
    """Add what the receivers of one group add to their ranges, in place."""
    size = errors.by_state.shape[1]
    scale = np.where(takes, errors.scale, 0.0)
    predicted[at] += np.where(takes, errors.bias_m, 0.0) + scale * distance[at]
    values[at, : 2 * wide + 2] *= (1.0 + scale)[:, None]
    values[at, :size] += errors.by_state * takes[:, None]
    if errors.by_scale >= 0:
        values[at, errors.by_scale] += np.where(takes, distance[at], 0.0)


def _while_the_earth_turns(line: FloatArray, source_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lines and distances from the satellites' places at emission, (m, 3) and (m,).

    They are in the ECEF axes of the instant of reception.
    """
    seen, distance = line, np.sqrt((line**2).sum(axis=1))
    here = line + source_m
    for _ in range(3):  # each gains six digits
        turn = EARTH_RATE_RADPS * distance / LIGHT_MPS
        cosine, sine = np.cos(turn), np.sin(turn)
        x, y = source_m[:, 0], source_m[:, 1]
        seen = here - np.stack([cosine * x + sine * y, cosine * y - sine * x, source_m[:, 2]], axis=1)
        distance = np.sqrt((seen**2).sum(axis=1))
    return seen, distance
