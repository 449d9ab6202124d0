"""Compiled loop of the filters in which every vehicle estimates its own states alone. See ``decentralised``."""

from typing import NamedTuple

import numpy as np

from groundstation.base.compile import compiled, part
from groundstation.base.records import Int64Array
from groundstation.estimators.cooperative.arrays import (
    CLOCK_LEAPS,
    GATED,
    HEIGHT,
    JUDGED,
    LOST,
    OUTPUTS,
    PEER,
    POINT,
    UNUSED,
    USED,
    Events,
    Fleet,
    FloatArray,
    Items,
    Log,
    Points,
    Rows,
)
from groundstation.estimators.cooperative.joint import LEAP_M, PATIENCE, SAME_TIME_S
from groundstation.estimators.cooperative.motion import place, position, step, turn_covariance, turn_rows
from groundstation.estimators.cooperative.observation import observe
from groundstation.estimators.cooperative.plain.split_covariance import ROUNDING
from groundstation.tables.session import NO_SLOT

EXACT, RANKED, MODIFIED, SPLIT = 0, 1, 2, 3
NOBODY = -1
JACOBI_SWEEPS = 8  # each doubles the digits once it has any


class Own(NamedTuple):
    """Filters of k vehicles, at most n states each, q errors of uncertain points; N states in all."""

    time_s: FloatArray  # (k,)
    x: FloatArray  # (k, n)
    P: FloatArray  # (k, n, n)
    independent: FloatArray  # (k, n, n) part of P that nobody else can know (split)
    shared: FloatArray  # (k, n, q) covariance with the points (modified)
    map_rows: FloatArray  # (k, n, N) rows of the error map


class Past(NamedTuple):
    """What all filters were at the beginning of the last slots, oldest first."""

    slot: Int64Array  # (slots,)
    begun: Int64Array  # (1,) how many slots have begun
    time_s: FloatArray  # (slots, k)
    x: FloatArray
    P: FloatArray
    shared: FloatArray
    map_rows: FloatArray


class Heard(NamedTuple):
    """Broadcasts of the measurements of a group; the last of each sender is kept for those who hear it next."""

    place_m: FloatArray  # (h, 3)
    clock_m: FloatArray  # (h,)
    covariance: FloatArray  # (h, 4, 4) of place and clock, as 4-byte numbers
    shared: FloatArray  # (h, 4, q) the same
    told: FloatArray  # (h, 4, n) derivative of place and clock by the sender's state, for the error map alone
    map_rows: FloatArray  # (h, n, N) the same
    owner: Int64Array  # (h,) sender
    newest: Int64Array  # (1,) entry
    of: Int64Array  # (k,) entry of each sender's last broadcast
    slot: Int64Array  # (k,) slot of that broadcast; NO_SLOT: none


class Method(NamedTuple):
    """What a filter makes of its neighbours."""

    algorithm: int
    gate_sigma: float
    ranks: Int64Array  # (k,)
    point_variance: FloatArray  # (q,)
    weights: FloatArray  # of covariance intersection


class Batch(NamedTuple):
    """Rows of one update of one vehicle, at most r."""

    event: Int64Array
    heard: Int64Array  # entry of Heard, NOBODY for a point or satellite
    h: FloatArray  # (r, n) by its state now
    by_shared: FloatArray  # (r, q)
    told: FloatArray  # (r, 4) by place and clock of the source
    innovation: FloatArray
    own: FloatArray  # variance of the sensor
    brought: FloatArray  # variance that the source brings


class Room(NamedTuple):
    """Room of the loop."""

    phi: FloatArray  # (n, n)
    noise: FloatArray
    step: FloatArray  # (ROOMS, n, n)
    x: FloatArray  # (n,)
    reading: FloatArray  # (3,)
    derivative: FloatArray  # (3, n)
    source: FloatArray  # (3,)
    held: FloatArray  # (n, q)
    P: FloatArray  # (n, n)
    wide: FloatArray  # (n, N) or wider than q
    S: FloatArray  # (r, r)
    kept: FloatArray  # (r, r)
    right: FloatArray  # (r, n)
    gain: FloatArray  # (r, n)
    mixed: FloatArray  # (r, N)
    cross: FloatArray  # (5, 4, 4)


@compiled
def run_alone(
    fleet: Fleet,
    points: Points,
    events: Events,
    items: Items,
    begin: int,
    end: int,
    method: Method,
    own: Own,
    past: Past,
    heard: Heard,
    rejected: Int64Array,
    batch: Batch,
    room: Room,
    rows: Rows,
    log: Log,
) -> None:
    """Work through the items ``begin`` to ``end``: one window of the error map."""
    entry = np.empty(len(batch.event), dtype=np.int64)  # of Heard, for each measurement of a group
    for item in range(begin, end):
        who = items.vehicle[item]
        if who >= 0:
            _move(fleet, own, who, items.time_s[item], room)
            _keep(fleet, own, who, log)
            continue
        first, last = items.first[item], items.last[item]
        for event in range(first, last):
            if events.kind[event] == PEER:
                entry[event - first] = _listen(fleet, events, event, method, own, past, heard, room, log)
        for start in range(first, last):
            who, is_new = events.receiver[start], True
            for event in range(first, start):
                is_new = is_new and events.receiver[event] != who
            if is_new:
                _use(
                    fleet,
                    points,
                    events,
                    start,
                    last,
                    first,
                    items.time_s[item],
                    method,
                    own,
                    heard,
                    entry,
                    rejected,
                    batch,
                    room,
                    rows,
                    log,
                )


@part
def _keep(fleet: Fleet, own: Own, who: int, log: Log) -> None:
    at = log.counts[OUTPUTS]
    for i in range(fleet.size[who]):
        log.x[at, i] = own.x[who, i]
        for j in range(fleet.size[who]):
            log.P[at, i, j] = own.P[who, i, j]
    log.counts[OUTPUTS] += 1


@part
def _move(fleet: Fleet, own: Own, who: int, to_s: float, room: Room) -> None:
    """A vehicle's filter at another time."""
    if abs(to_s - own.time_s[who]) < SAME_TIME_S:
        return
    n, w = fleet.size[who], room.step[0]
    step(fleet, who, own.x[who], own.time_s[who], to_s, room.phi, room.noise, room.step)
    turn_covariance(n, room.phi, own.P[who], w)
    turn_covariance(n, room.phi, own.independent[who], w)
    turn_rows(n, room.phi, own.shared[who], room.wide)
    turn_rows(n, room.phi, own.map_rows[who], room.wide)
    if to_s > own.time_s[who]:
        for i in range(n):
            for j in range(n):
                own.P[who, i, j] += room.noise[i, j]
                own.independent[who, i, j] += room.noise[i, j]
    own.time_s[who] = to_s


@part
def _copy(
    n: int,
    x: FloatArray,
    P: FloatArray,
    shared: FloatArray,
    map_rows: FloatArray,
    to_x: FloatArray,
    to_P: FloatArray,
    to_shared: FloatArray,
    to_map_rows: FloatArray,
) -> None:
    """Copy one filter of n states."""
    for i in range(n):
        to_x[i] = x[i]
        for j in range(n):
            to_P[i, j] = P[i, j]
        for c in range(shared.shape[1]):
            to_shared[i, c] = shared[i, c]
        for c in range(map_rows.shape[1]):
            to_map_rows[i, c] = map_rows[i, c]


@part
def _remember(fleet: Fleet, own: Own, past: Past, slot: int) -> None:
    """A new slot begins: keep what all filters are now, over the oldest of those kept."""
    at = past.begun[0] % len(past.slot)
    past.slot[at] = slot
    past.begun[0] += 1
    for who in range(len(own.time_s)):
        past.time_s[at, who] = own.time_s[who]
        _copy(
            fleet.size[who],
            own.x[who],
            own.P[who],
            own.shared[who],
            own.map_rows[who],
            past.x[at, who],
            past.P[at, who],
            past.shared[at, who],
            past.map_rows[at, who],
        )


@part
def _listen(
    fleet: Fleet,
    events: Events,
    event: int,
    method: Method,
    own: Own,
    past: Past,
    heard: Heard,
    room: Room,
    log: Log,
) -> int:
    """Entry of what the source of a range told in its slot: what it knew some slots ago, moved to now."""
    source, slot, at_s, slots = events.source[event], events.slot[event], events.time_s[event], len(past.slot)
    if slot != NO_SLOT and heard.slot[source] == slot:
        return int(heard.of[source])
    if slot != NO_SLOT and (past.begun[0] == 0 or past.slot[(past.begun[0] - 1) % slots] != slot):
        _remember(fleet, own, past, slot)
        for who in range(len(heard.slot)):
            heard.slot[who] = NO_SLOT
    entry = (heard.newest[0] + 1) % len(heard.owner)
    heard.newest[0] = entry
    if heard.owner[entry] != NOBODY and heard.of[heard.owner[entry]] == entry:
        heard.slot[heard.owner[entry]] = NO_SLOT  # overwritten
    heard.owner[entry] = source
    n = fleet.size[source]
    x, P, held, map_rows = room.x, room.P, room.held, heard.map_rows[entry]
    known_s = own.time_s[source]
    if slot == NO_SLOT:
        _copy(n, own.x[source], own.P[source], own.shared[source], own.map_rows[source], x, P, held, map_rows)
    else:
        oldest = past.begun[0] % slots if past.begun[0] > slots else 0
        known_s = past.time_s[oldest, source]
        _copy(
            n,
            past.x[oldest, source],
            past.P[oldest, source],
            past.shared[oldest, source],
            past.map_rows[oldest, source],
            x,
            P,
            held,
            map_rows,
        )
    if abs(at_s - known_s) >= SAME_TIME_S:
        step(fleet, source, x, known_s, at_s, room.phi, room.noise, room.step)
        turn_covariance(n, room.phi, P, room.step[0])
        if at_s > known_s:
            for i in range(n):
                for j in range(n):
                    P[i, j] += room.noise[i, j]
        turn_rows(n, room.phi, held, room.wide)
        turn_rows(n, room.phi, map_rows, room.wide)
    _tell(fleet, source, at_s, method.algorithm, x, P, held, heard, entry, room)
    log.sent[source] += 1
    for i in range(n):
        for j in range(n):
            own.independent[source, i, j] = 0.0  # all may be known now
    heard.of[source], heard.slot[source] = entry, slot
    return int(entry)


@part
def _tell(
    fleet: Fleet,
    source: int,
    at_s: float,
    algorithm: int,
    x: FloatArray,
    P: FloatArray,
    held: FloatArray,
    heard: Heard,
    entry: int,
    room: Room,
) -> None:
    """Fill the message: place and clock, their covariance, and their covariance with the errors of the points."""
    n, clock, told = fleet.size[source], fleet.clock[source], heard.told[entry]
    place(fleet, source, at_s, room.reading, room.derivative)
    position(n, room.reading, room.derivative, x, heard.place_m[entry])
    heard.clock_m[entry] = x[clock] if clock >= 0 else 0.0
    for j in range(n):
        for axis in range(3):
            told[axis, j] = room.derivative[axis, j]
        told[3, j] = 1.0 if j == clock else 0.0
    for a in range(4 if algorithm != EXACT else 0):
        for b in range(a, 4):
            total = 0.0
            for i in range(n):
                if told[a, i] != 0.0:
                    for j in range(n):
                        total += told[a, i] * P[i, j] * told[b, j]
            heard.covariance[entry, a, b] = heard.covariance[entry, b, a] = np.float64(np.float32(total))
        for b in range(held.shape[1] if algorithm == MODIFIED else 0):
            total = 0.0
            for i in range(n):
                total += told[a, i] * held[i, b]
            heard.shared[entry, a, b] = np.float64(np.float32(total))


@part
def _is_used(events: Events, event: int, method: Method, log: Log) -> bool:
    """Ranked filters hear those of a higher rank alone."""
    if events.kind[event] != PEER or (method.algorithm != RANKED and method.algorithm != MODIFIED):
        return True
    if method.ranks[events.source[event]] < method.ranks[events.receiver[event]]:
        return True
    log.counts[UNUSED] += 1
    return False


@part
def _use(
    fleet: Fleet,
    points: Points,
    events: Events,
    start: int,
    last: int,
    first: int,
    at_s: float,
    method: Method,
    own: Own,
    heard: Heard,
    entry: Int64Array,
    rejected: Int64Array,
    batch: Batch,
    room: Room,
    rows: Rows,
    log: Log,
) -> None:
    """One receiver's measurements of a group, those from ``start`` on, in one update."""
    who, count, is_moved = events.receiver[start], 0, False
    for event in range(start, last):
        if events.receiver[event] != who or not _is_used(events, event, method, log):
            continue
        if not is_moved:
            _move(fleet, own, who, at_s, room)
            is_moved = True
        by = entry[event - first] if events.kind[event] == PEER else NOBODY
        count += _linearise(fleet, points, events, event, by, method, own, heard, batch, count, room, rows, log)
    kept = 0
    for row in range(count):
        if _passes(fleet, events, row, method, own, rejected, batch, log):
            if kept < row:
                _copy_row(batch, row, kept)
            kept += 1
    if kept == 0:
        return
    if method.algorithm == SPLIT:
        for i in range(fleet.size[who]):
            room.x[i] = own.x[who, i]  # what all rows were linearised about
        for row in range(kept):
            _split_update(fleet, who, row, method, own, heard, batch, room)
    else:
        _update(fleet, events, who, kept, method, own, heard, batch, room)


@part
def _copy_row(batch: Batch, one: int, other: int) -> None:
    batch.event[other], batch.heard[other] = batch.event[one], batch.heard[one]
    for i in range(batch.h.shape[1]):
        batch.h[other, i] = batch.h[one, i]
    for c in range(batch.by_shared.shape[1]):
        batch.by_shared[other, c] = batch.by_shared[one, c]
    for a in range(4):
        batch.told[other, a] = batch.told[one, a]
    batch.innovation[other], batch.own[other] = batch.innovation[one], batch.own[one]
    batch.brought[other] = batch.brought[one]


@part
def _linearise(
    fleet: Fleet,
    points: Points,
    events: Events,
    event: int,
    by: int,
    method: Method,
    own: Own,
    heard: Heard,
    batch: Batch,
    at: int,
    room: Room,
    rows: Rows,
    log: Log,
) -> int:
    """Put the rows of an event into the batch, referred to the receiver's state now; return how many there are."""
    who, at_s = events.receiver[event], events.time_s[event]
    n, x, phi = fleet.size[who], room.x, room.phi
    for i in range(n):
        x[i] = own.x[who, i]
    is_back = abs(at_s - own.time_s[who]) > SAME_TIME_S
    if is_back:
        step(fleet, who, x, own.time_s[who], at_s, phi, room.noise, room.step)
    place(fleet, who, at_s, room.reading, room.derivative)
    source_m = room.source
    for axis in range(3):
        source_m[axis] = events.place_m[event, axis] if by == NOBODY else heard.place_m[by, axis]
    clock_m = 0.0 if by == NOBODY else heard.clock_m[by]
    count = observe(fleet, events, event, x, room.reading, room.derivative, source_m, clock_m, source_m, False, rows)
    if count == 0:
        log.counts[LOST] += 1
    for row in range(count):
        to = at + row
        batch.event[to], batch.heard[to], batch.innovation[to] = event, by, rows.innovation[row]
        for j in range(n):
            batch.h[to, j] = rows.receiver[row, j]
            if is_back:
                batch.h[to, j] = 0.0
                for i in range(n):
                    batch.h[to, j] += rows.receiver[row, i] * phi[i, j]
        for axis in range(3):
            batch.told[to, axis] = rows.place[row, axis]
        batch.told[to, 3] = rows.clock[row]
        batch.own[to] = rows.variance[row]
        _bring(points, events, event, by, method, heard, batch, to)
    return count


@part
def _bring(
    points: Points, events: Events, event: int, by: int, method: Method, heard: Heard, batch: Batch, to: int
) -> None:
    """Variance that the source brings with it, and the derivative by the errors of uncertain points."""
    for c in range(batch.by_shared.shape[1]):
        batch.by_shared[to, c] = 0.0
    brought = 0.0
    if by != NOBODY and method.algorithm != EXACT:
        for a in range(4):
            for b in range(4):
                brought += batch.told[to, a] * heard.covariance[by, a, b] * batch.told[to, b]
    elif events.kind[event] == POINT and points.uncertain[events.source[event]] >= 0:
        shared = 2 * points.uncertain[events.source[event]]
        for j in range(2):
            for axis in range(3):
                slope = points.axes[events.source[event], axis, j]
                batch.by_shared[to, shared + j] -= batch.told[to, axis] * slope
            if method.algorithm != EXACT:
                brought += batch.by_shared[to, shared + j] ** 2 * method.point_variance[shared + j]
    batch.brought[to] = max(brought, 0.0)


@part
def _passes(
    fleet: Fleet,
    events: Events,
    row: int,
    method: Method,
    own: Own,
    rejected: Int64Array,
    batch: Batch,
    log: Log,
) -> bool:
    """Whether an innovation is inside the gate; counts, and opens the clock after many rejections."""
    event = batch.event[row]
    who = events.receiver[event]
    total = batch.own[row] * events.spread[event] + batch.brought[row]
    for i in range(fleet.size[who]):
        for j in range(fleet.size[who]):
            total += batch.h[row, i] * own.P[who, i, j] * batch.h[row, j]
    passes = method.gate_sigma <= 0.0 or batch.innovation[row] ** 2 <= method.gate_sigma**2 * total
    at = log.counts[JUDGED]
    log.event[at], log.innovation[at], log.variance[at] = event, batch.innovation[row], total
    log.mark[at] = USED if passes else GATED
    log.counts[JUDGED] += 1
    rejected[who] = 0 if passes else rejected[who] + 1
    clock, other = fleet.clock[who], fleet.receiver_clock[who]
    if rejected[who] >= PATIENCE and clock >= 0 and events.kind[event] != HEIGHT:
        rejected[who] = 0
        log.counts[CLOCK_LEAPS] += 1
        own.P[who, clock, clock] += LEAP_M**2
        if other != clock:
            own.P[who, other, other] += LEAP_M**2
    return passes


@part
def solve(count: int, width: int, A: FloatArray, B: FloatArray) -> None:
    """B <- A^-1 B by elimination with the largest pivots; A (count, count) is spoiled, B is (count, width)."""
    for c in range(count):
        best = c
        for r in range(c + 1, count):
            if abs(A[r, c]) > abs(A[best, c]):
                best = r
        if best != c:
            for j in range(count):
                A[c, j], A[best, j] = A[best, j], A[c, j]
            for j in range(width):
                B[c, j], B[best, j] = B[best, j], B[c, j]
        for r in range(c + 1, count):
            factor = A[r, c] / A[c, c]
            if factor != 0.0:
                for j in range(c, count):
                    A[r, j] -= factor * A[c, j]
                for j in range(width):
                    B[r, j] -= factor * B[c, j]
    for c in range(count - 1, -1, -1):
        for j in range(width):
            for r in range(c + 1, count):
                B[c, j] -= A[c, r] * B[r, j]
            B[c, j] /= A[c, c]


@part
def _mix(
    fleet: Fleet, who: int, count: int, own: Own, heard: Heard, batch: Batch, first: int, mixed: FloatArray
) -> None:
    """Errors that each row of an update brings in, by the errors of all at the beginning of the window."""
    width = own.map_rows.shape[2]
    for row in range(first, first + count):
        by = batch.heard[row]
        for c in range(width):
            mixed[row - first, c] = 0.0
        for i in range(fleet.size[who]):
            if batch.h[row, i] != 0.0:
                for c in range(width):
                    mixed[row - first, c] += batch.h[row, i] * own.map_rows[who, i, c]
        if by != NOBODY:
            for i in range(fleet.size[heard.owner[by]]):
                told = 0.0
                for a in range(4):
                    told += batch.told[row, a] * heard.told[by, a, i]
                if told != 0.0:
                    for c in range(width):
                        mixed[row - first, c] += told * heard.map_rows[by, i, c]


@part
def _correct_map(n: int, count: int, gain: FloatArray, mixed: FloatArray, map_rows: FloatArray) -> None:
    """Rows of the map after an update; gain (count, n)."""
    for row in range(count):
        for i in range(n):
            if gain[row, i] != 0.0:
                for c in range(map_rows.shape[1]):
                    map_rows[i, c] -= gain[row, i] * mixed[row, c]


@part
def _update(
    fleet: Fleet,
    events: Events,
    who: int,
    count: int,
    method: Method,
    own: Own,
    heard: Heard,
    batch: Batch,
    room: Room,
) -> None:
    """Kalman update with the noise of the algorithm; shared errors are considered, not estimated.

    The gain solves S K' = H P + C', where C is the covariance of the states with the noise of the rows.
    """
    n, q, P = fleet.size[who], len(method.point_variance), own.P[who]
    S, right, is_modified = room.S, room.right, method.algorithm == MODIFIED
    for r in range(count):
        for i in range(n):
            right[r, i] = 0.0
            for j in range(n):
                right[r, i] += batch.h[r, j] * P[j, i]
            for c in range(q if is_modified else 0):
                right[r, i] += own.shared[who, i, c] * batch.by_shared[r, c]
    for r in range(count):
        for s in range(count):
            S[r, s] = batch.own[r] + batch.brought[r] if r == s else 0.0
            for i in range(n):
                S[r, s] += right[r, i] * batch.h[s, i]
                for c in range(q if is_modified else 0):  # H C, the part of C H' stands in right
                    S[r, s] += batch.h[r, i] * own.shared[who, i, c] * batch.by_shared[s, c]
            if r != s:
                S[r, s] += _common(events, r, s, method, heard, batch, room.cross)
    gain, kept = room.gain, room.kept
    for r in range(count):
        for s in range(count):
            kept[r, s] = S[r, s]
        for i in range(n):
            gain[r, i] = right[r, i]
    solve(count, n, S, gain)
    for r in range(count):
        for i in range(n):
            own.x[who, i] += gain[r, i] * batch.innovation[r]
    for i in range(n):
        for j in range(i, n):
            total = 0.0
            for r in range(count):
                for s in range(count):
                    total += gain[r, i] * kept[r, s] * gain[s, j]
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i]) - total
    if is_modified:
        _correct_shared(n, count, gain, method, own.shared[who], heard, batch)
    _mix(fleet, who, count, own, heard, batch, 0, room.mixed)
    _correct_map(n, count, gain, room.mixed, own.map_rows[who])


@part
def _told_shared(row: int, c: int, heard: Heard, batch: Batch) -> float:
    """Covariance of what a row's source told with the error c of the points."""
    total = 0.0
    if batch.heard[row] != NOBODY:
        for a in range(4):
            total += batch.told[row, a] * heard.shared[batch.heard[row], a, c]
    return total


@part
def _common(events: Events, r: int, s: int, method: Method, heard: Heard, batch: Batch, cross: FloatArray) -> float:
    """Covariance of the noise of two rows: all of it for one neighbour's two, else (modified) through the points."""
    one, two, total = batch.event[r], batch.event[s], 0.0
    if method.algorithm == EXACT:
        return 0.0
    if events.kind[one] == PEER and events.kind[two] == PEER and events.source[one] == events.source[two]:
        _between(heard, batch.heard[r], batch.heard[s], cross)
        for a in range(4):
            for b in range(4):
                total += batch.told[r, a] * cross[0, a, b] * batch.told[s, b]
        return total
    for c in range(len(method.point_variance) if method.algorithm == MODIFIED else 0):
        left = _told_shared(r, c, heard, batch) + batch.by_shared[r, c] * method.point_variance[c]
        other = _told_shared(s, c, heard, batch) + batch.by_shared[s, c] * method.point_variance[c]
        total += left * other / method.point_variance[c]
    return total


@part
def _between(heard: Heard, one: int, two: int, cross: FloatArray) -> None:
    """Fill ``cross[0]`` with the covariance of the errors in two messages of one sender: root times root.

    Errors of one sender are common to its messages. The symmetric roots make it a covariance whatever the two are.
    """
    if one == two:
        for a in range(4):
            for b in range(4):
                cross[0, a, b] = heard.covariance[one, a, b]
        return
    _root(heard.covariance[one], cross[1], cross[3], cross[4])
    _root(heard.covariance[two], cross[2], cross[3], cross[4])
    for a in range(4):
        for b in range(4):
            cross[0, a, b] = 0.0
            for c in range(4):
                cross[0, a, b] += cross[1, a, c] * cross[2, c, b]


@part
def _root(covariance: FloatArray, root: FloatArray, A: FloatArray, V: FloatArray) -> None:
    """Symmetric square root of a 4 x 4 covariance by Jacobi rotations; an eigenvalue that rounding left below 0 is 0.

    Source: Golub and Van Loan, Matrix Computations, 4th ed. 2013, section 8.5.
    """
    for i in range(4):
        for j in range(4):
            A[i, j], V[i, j] = covariance[i, j], 1.0 if i == j else 0.0
    for _ in range(JACOBI_SWEEPS):
        for p in range(3):
            for q in range(p + 1, 4):
                if A[p, q] == 0.0:
                    continue
                slope = (A[q, q] - A[p, p]) / (2.0 * A[p, q])
                t = (1.0 if slope >= 0.0 else -1.0) / (abs(slope) + np.sqrt(1.0 + slope * slope))
                c = 1.0 / np.sqrt(1.0 + t * t)
                for k in range(4):
                    A[k, p], A[k, q] = c * A[k, p] - c * t * A[k, q], c * t * A[k, p] + c * A[k, q]
                for k in range(4):
                    A[p, k], A[q, k] = c * A[p, k] - c * t * A[q, k], c * t * A[p, k] + c * A[q, k]
                    V[k, p], V[k, q] = c * V[k, p] - c * t * V[k, q], c * t * V[k, p] + c * V[k, q]
                A[p, q] = A[q, p] = 0.0
    for i in range(4):
        for j in range(4):
            root[i, j] = 0.0
            for k in range(4):
                root[i, j] += V[i, k] * np.sqrt(max(A[k, k], 0.0)) * V[j, k]


@part
def _correct_shared(
    n: int, count: int, gain: FloatArray, method: Method, shared: FloatArray, heard: Heard, batch: Batch
) -> None:
    """Covariance with the errors of the points after an update."""
    brought = np.empty(count)
    for c in range(shared.shape[1]):
        for row in range(count):  # all of them before the first correction
            brought[row] = batch.by_shared[row, c] * method.point_variance[c] + _told_shared(row, c, heard, batch)
            for i in range(n):
                brought[row] += batch.h[row, i] * shared[i, c]
        for row in range(count):
            for i in range(n):
                shared[i, c] -= gain[row, i] * brought[row]


@part
def _split_update(
    fleet: Fleet, who: int, row: int, method: Method, own: Own, heard: Heard, batch: Batch, room: Room
) -> None:
    """Split covariance intersection with one row, see ``plain.split_covariance``.

    Li and Nashashibi 2013, equations 10 to 14. ``room.x`` is the state that the row was linearised about.
    """
    n, P, independent = fleet.size[who], own.P[who], own.independent[who]
    h, brought, sensor = batch.h[row], batch.brought[row], batch.own[row]
    weight = 1.0
    if brought > 0.0:
        weight = _best_weight(n, h, P, independent, brought, sensor, method.weights)
    if weight == 0.0:
        return  # every weight leaves larger errors than none
    gain, S = room.right[0], sensor + (brought / (1.0 - weight) if brought > 0.0 else 0.0)
    innovation = batch.innovation[row]
    for i in range(n):
        innovation -= h[i] * (own.x[who, i] - room.x[i])
        gain[i] = 0.0
        for j in range(n):
            P[i, j] = (P[i, j] - independent[i, j]) / weight + independent[i, j]
            gain[i] += P[i, j] * h[j]
    for i in range(n):
        S += h[i] * gain[i]
    for i in range(n):
        gain[i] /= S
    for i in range(n):
        own.x[who, i] += gain[i] * innovation
        for j in range(n):
            P[i, j] -= gain[i] * gain[j] * S
    kept = room.phi
    for i in range(n):
        for j in range(n):
            kept[i, j] = (1.0 if i == j else 0.0) - gain[i] * h[j]
    turn_covariance(n, kept, independent, room.step[0])
    for i in range(n):
        for j in range(n):
            independent[i, j] += gain[i] * gain[j] * sensor
    _mix(fleet, who, 1, own, heard, batch, row, room.mixed)
    _correct_map(n, 1, room.right, room.mixed, own.map_rows[who])


@part
def _best_weight(
    n: int,
    h: FloatArray,
    P: FloatArray,
    independent: FloatArray,
    brought: float,
    sensor: float,
    weights: FloatArray,
) -> float:
    """Weight of the dependent part that leaves the least sum of variances, each over what it was; 0: none is better."""
    by_dependent, by_independent = np.zeros(n), np.zeros(n)
    one, two, least, best = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        least += 1.0 if P[i, i] > 0.0 else 0.0
        for j in range(n):
            by_dependent[i] += (P[i, j] - independent[i, j]) * h[j]
            by_independent[i] += independent[i, j] * h[j]
    for i in range(n):
        one += h[i] * by_dependent[i]
        two += h[i] * by_independent[i]
    least *= 1.0 - ROUNDING
    for weight in weights:
        S, left = one / weight + two + brought / (1.0 - weight) + sensor, 0.0
        for i in range(n):
            if P[i, i] > 0.0:
                grown = (P[i, i] - independent[i, i]) / weight + independent[i, i]
                left += (grown - (by_dependent[i] / weight + by_independent[i]) ** 2 / S) / P[i, i]
        if left < least:
            least, best = left, weight
    return best
