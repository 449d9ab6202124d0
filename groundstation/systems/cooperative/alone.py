"""Compiled loop of the filters in which every vehicle estimates its own states alone.

See ``decentralised``.
"""

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.alone_types import (
    EXACT,
    MODIFIED,
    NOBODY,
    RANKED,
    SPLIT,
    AloneWorkspace,
    HeardBroadcasts,
    NeighbourRules,
    OwnFilters,
    Past,
    UpdateRows,
)
from groundstation.systems.cooperative.alone_update import split_update, update
from groundstation.systems.cooperative.joint import SAME_TIME_S
from groundstation.systems.cooperative.judging import count_rejection, write_down
from groundstation.systems.cooperative.loop_types import (
    HEIGHT,
    LOST,
    OUTPUTS,
    PEER,
    POINT,
    UNUSED,
    Events,
    Fleet,
    FloatArray,
    Items,
    LinearisedEvent,
    PointNumbers,
    RunRecords,
)
from groundstation.systems.cooperative.motion import place, position, step, turn_covariance, turn_rows
from groundstation.systems.cooperative.observation import observe
from groundstation.tables.session import NO_SLOT


@in_place
def run_alone(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    items: Items,
    begin: int,
    end: int,
    method: NeighbourRules,
    own: OwnFilters,
    past: Past,
    heard: HeardBroadcasts,
    rejected: Int64Array,
    batch: UpdateRows,
    room: AloneWorkspace,
    rows: LinearisedEvent,
    log: RunRecords,
) -> None:
    """Work through the items ``begin`` to ``end``: one window of the error map."""
    entry = room.entry
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


@in_place
def _keep(fleet: Fleet, own: OwnFilters, who: int, log: RunRecords) -> None:
    at = log.counts[OUTPUTS]
    for i in range(fleet.size[who]):
        log.x[at, i] = own.x[who, i]
        for j in range(fleet.size[who]):
            log.P[at, i, j] = own.P[who, i, j]
    log.counts[OUTPUTS] += 1


@in_place
def _move(fleet: Fleet, own: OwnFilters, who: int, to_s: float, room: AloneWorkspace) -> None:
    """Move a vehicle's filter to another time."""
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


@in_place
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


@in_place
def _remember(fleet: Fleet, own: OwnFilters, past: Past, slot: int) -> None:
    """Keep the state of all filters at the begin of a slot, over the oldest of those kept."""
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


@in_place
def _listen(
    fleet: Fleet,
    events: Events,
    event: int,
    method: NeighbourRules,
    own: OwnFilters,
    past: Past,
    heard: HeardBroadcasts,
    room: AloneWorkspace,
    log: RunRecords,
) -> int:
    """Return the entry of the broadcast of a range's source in its slot.

    It holds what the source knew some slots ago, moved to now.
    """
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


@in_place
def _tell(
    fleet: Fleet,
    source: int,
    at_s: float,
    algorithm: int,
    x: FloatArray,
    P: FloatArray,
    held: FloatArray,
    heard: HeardBroadcasts,
    entry: int,
    room: AloneWorkspace,
) -> None:
    """Fill the message: place and clock, and their covariances.

    One is their own, the other is with the errors of the points.
    """
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


@in_place
def _is_used(events: Events, event: int, method: NeighbourRules, log: RunRecords) -> bool:
    """Tell whether a measurement is used: ranked filters hear only vehicles of higher rank."""
    if events.kind[event] != PEER or (method.algorithm != RANKED and method.algorithm != MODIFIED):
        return True
    if method.ranks[events.source[event]] < method.ranks[events.receiver[event]]:
        return True
    log.counts[UNUSED] += 1
    return False


@in_place
def _use(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    start: int,
    last: int,
    first: int,
    at_s: float,
    method: NeighbourRules,
    own: OwnFilters,
    heard: HeardBroadcasts,
    entry: Int64Array,
    rejected: Int64Array,
    batch: UpdateRows,
    room: AloneWorkspace,
    rows: LinearisedEvent,
    log: RunRecords,
) -> None:
    """Use one receiver's measurements of a group, from ``start`` on, in one update."""
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
            split_update(fleet, who, row, method, own, heard, batch, room)
    else:
        update(fleet, events, who, kept, method, own, heard, batch, room)


@in_place
def _copy_row(batch: UpdateRows, one: int, other: int) -> None:
    batch.event[other], batch.heard[other] = batch.event[one], batch.heard[one]
    for i in range(batch.h.shape[1]):
        batch.h[other, i] = batch.h[one, i]
    for c in range(batch.by_shared.shape[1]):
        batch.by_shared[other, c] = batch.by_shared[one, c]
    for a in range(4):
        batch.told[other, a] = batch.told[one, a]
    batch.innovation[other], batch.own[other] = batch.innovation[one], batch.own[one]
    batch.brought[other] = batch.brought[one]


@in_place
def _linearise(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    event: int,
    by: int,
    method: NeighbourRules,
    own: OwnFilters,
    heard: HeardBroadcasts,
    batch: UpdateRows,
    at: int,
    room: AloneWorkspace,
    rows: LinearisedEvent,
    log: RunRecords,
) -> int:
    """Put the rows of an event into the batch; return how many there are.

    They are referred to the receiver's state now.
    """
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


@in_place
def _bring(
    points: PointNumbers,
    events: Events,
    event: int,
    by: int,
    method: NeighbourRules,
    heard: HeardBroadcasts,
    batch: UpdateRows,
    to: int,
) -> None:
    """Set the variance that the source adds, and the derivative by errors of uncertain points."""
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


@in_place
def _passes(
    fleet: Fleet,
    events: Events,
    row: int,
    method: NeighbourRules,
    own: OwnFilters,
    rejected: Int64Array,
    batch: UpdateRows,
    log: RunRecords,
) -> bool:
    """Tell whether an innovation is inside the gate.

    It also counts, and opens the clock after many rejections.
    """
    event = batch.event[row]
    who = events.receiver[event]
    total = batch.own[row] * events.spread[event] + batch.brought[row]
    for i in range(fleet.size[who]):
        for j in range(fleet.size[who]):
            total += batch.h[row, i] * own.P[who, i, j] * batch.h[row, j]
    passes = method.gate_sigma <= 0.0 or batch.innovation[row] ** 2 <= method.gate_sigma**2 * total
    write_down(event, batch.innovation[row], total, passes, log)
    count_rejection(fleet, who, passes, events.kind[event] != HEIGHT, rejected, 0, own.P[who], log)
    return passes
