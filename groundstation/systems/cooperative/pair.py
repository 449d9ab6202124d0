"""Compiled loop of the filter with stored pairwise cross-covariances. See ``pairwise``."""

from typing import NamedTuple

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.records import BoolArray, Int64Array
from groundstation.methods.link_dynamics import ROOMS
from groundstation.systems.cooperative.alone_update import solve
from groundstation.systems.cooperative.joint import SAME_TIME_S
from groundstation.systems.cooperative.judging import count_rejection, write_down
from groundstation.systems.cooperative.loop_types import (
    LOST,
    OUTPUTS,
    PEER,
    POINT,
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


class Members(NamedTuple):
    """Filters of k vehicles: times, states, covariances, factors towards the others, map rows.

    The map rows are those of the error map.
    """

    time_s: FloatArray  # (k,)
    x: FloatArray  # (k, n)
    P: FloatArray  # (k, n, n)
    factor: FloatArray  # (k, k, n, n) s_ij: the cross-covariance of i and j is s_ij s_ji'
    has_factor: BoolArray  # (k, k)
    map_rows: FloatArray  # (k, n, N)
    rejected: Int64Array  # (k,) in a row


class PairWorkspace(NamedTuple):
    """Work arrays of the loop."""

    phi: FloatArray  # (n, n)
    noise: FloatArray
    step: FloatArray  # (ROOMS, n, n)
    reading: FloatArray  # (2, 3)
    derivative: FloatArray  # (2, 3, n)
    source: FloatArray  # (3,)
    wide: FloatArray  # (2 n, N)
    both: FloatArray  # (2 n, 2 n)
    h: FloatArray  # (2 n,)
    shared: FloatArray  # (2 n,)
    gain: FloatArray  # (2 n,)
    mixed: FloatArray  # (N,)


def room_for(n: int, width: int) -> PairWorkspace:
    """Make work arrays for vehicles of n states and an error map of so many columns."""
    return PairWorkspace(
        np.zeros((n, n)),
        np.zeros((n, n)),
        np.zeros((ROOMS, n, n)),
        np.zeros((2, 3)),
        np.zeros((2, 3, n)),
        np.zeros(3),
        np.zeros((2 * n, max(width, n))),
        np.zeros((2 * n, 2 * n)),
        np.zeros(2 * n),
        np.zeros(2 * n),
        np.zeros(2 * n),
        np.zeros(width),
    )


@in_place
def run_pairs(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    items: Items,
    begin: int,
    end: int,
    gate_sigma: float,
    members: Members,
    room: PairWorkspace,
    rows: LinearisedEvent,
    log: RunRecords,
) -> None:
    """Work through the items ``begin`` to ``end``: one window of the error map."""
    for item in range(begin, end):
        who = items.vehicle[item]
        if who >= 0:
            _advance(fleet, members, who, items.time_s[item], room)
            at = log.counts[OUTPUTS]
            for i in range(fleet.size[who]):
                log.x[at, i] = members.x[who, i]
                for j in range(fleet.size[who]):
                    log.P[at, i, j] = members.P[who, i, j]
            log.counts[OUTPUTS] += 1
        else:
            _use(fleet, points, events, items.first[item], gate_sigma, members, room, rows, log)


@in_place
def _advance(fleet: Fleet, members: Members, who: int, to_s: float, room: PairWorkspace) -> None:
    if to_s <= members.time_s[who] + SAME_TIME_S:
        return
    n = fleet.size[who]
    step(fleet, who, members.x[who], members.time_s[who], to_s, room.phi, room.noise, room.step)
    turn_covariance(n, room.phi, members.P[who], room.step[0])
    for i in range(n):
        for j in range(n):
            members.P[who, i, j] += room.noise[i, j]
    _scale_factors(n, who, -1, room.phi, members, room)
    turn_rows(n, room.phi, members.map_rows[who], room.wide)
    members.time_s[who] = to_s


@in_place
def _scale_factors(n: int, who: int, but: int, by: FloatArray, members: Members, room: PairWorkspace) -> None:
    """Multiply the factors of a vehicle towards all others but one by a matrix."""
    for other in range(len(members.time_s)):
        if other != but and members.has_factor[who, other]:
            turn_rows(n, by, members.factor[who, other], room.wide)


@in_place
def _use(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    event: int,
    gate_sigma: float,
    members: Members,
    room: PairWorkspace,
    rows: LinearisedEvent,
    log: RunRecords,
) -> None:
    """Use one measurement."""
    who, source, at_s = events.receiver[event], events.source[event], events.time_s[event]
    is_peer = events.kind[event] == PEER
    _advance(fleet, members, who, at_s, room)
    if is_peer:
        _advance(fleet, members, source, at_s, room)
        log.sent[source] += 1
        log.sent[who] += 1
    if _observe(fleet, events, event, members, room, rows) == 0:
        log.counts[LOST] += 1
    elif is_peer:
        _relative(fleet, events, event, gate_sigma, members, room, rows, log)
    else:
        _private(fleet, points, events, event, gate_sigma, members, room, rows, log)


@in_place
def _observe(
    fleet: Fleet, events: Events, event: int, members: Members, room: PairWorkspace, rows: LinearisedEvent
) -> int:
    who, source, at_s, clock_m = events.receiver[event], events.source[event], events.time_s[event], 0.0
    place(fleet, who, at_s, room.reading[0], room.derivative[0])
    for axis in range(3):
        room.source[axis] = events.place_m[event, axis]
    if events.kind[event] == PEER:
        place(fleet, source, at_s, room.reading[1], room.derivative[1])
        position(fleet.size[source], room.reading[1], room.derivative[1], members.x[source], room.source)
        clock_m = members.x[source, fleet.clock[source]] if fleet.clock[source] >= 0 else 0.0
    x, reading, derivative = members.x[who], room.reading[0], room.derivative[0]
    return observe(fleet, events, event, x, reading, derivative, room.source, clock_m, room.source, False, rows)


@in_place
def _passes(
    fleet: Fleet,
    events: Events,
    event: int,
    innovation: float,
    total: float,
    gate_sigma: float,
    members: Members,
    log: RunRecords,
) -> bool:
    """Tell whether an innovation is inside the gate.

    It also counts, and opens clocks after many rejections.
    """
    passes = gate_sigma <= 0.0 or innovation**2 <= gate_sigma**2 * total
    write_down(event, innovation, total, passes, log)
    for end in range(2 if events.kind[event] == PEER else 1):
        who = events.receiver[event] if end == 0 else events.source[event]
        count_rejection(fleet, who, passes, True, members.rejected, 0, members.P[who], log)
    return passes


@in_place
def _private(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    event: int,
    gate_sigma: float,
    members: Members,
    room: PairWorkspace,
    rows: LinearisedEvent,
    log: RunRecords,
) -> None:
    """Use a range to a point or satellite; no other vehicle is told."""
    who, source, variance = events.receiver[event], events.source[event], rows.variance[0]
    n, P, h, shared, gain = fleet.size[who], members.P[who], rows.receiver[0], room.shared, room.gain
    if events.kind[event] == POINT:
        for j in range(2):
            slope = 0.0
            for axis in range(3):
                slope += rows.place[0, axis] * points.axes[source, axis, j]
            variance += (points.sigma_m[source] * slope) ** 2
    total = variance
    for i in range(n):
        shared[i] = 0.0
        for j in range(n):
            shared[i] += P[i, j] * h[j]
    for i in range(n):
        total += h[i] * shared[i]
    spread = total - rows.variance[0] * (1.0 - events.spread[event])
    if not _passes(fleet, events, event, rows.innovation[0], spread, gate_sigma, members, log):
        return
    kept = room.phi
    for i in range(n):
        gain[i] = shared[i] / total
        members.x[who, i] += gain[i] * rows.innovation[0]
        for j in range(n):
            P[i, j] -= shared[i] * (shared[j] / total)
            kept[i, j] = (1.0 if i == j else 0.0) - gain[i] * h[j]
    _scale_factors(n, who, -1, kept, members, room)
    turn_rows(n, kept, members.map_rows[who], room.wide)


@in_place
def _relative(
    fleet: Fleet,
    events: Events,
    event: int,
    gate_sigma: float,
    members: Members,
    room: PairWorkspace,
    rows: LinearisedEvent,
    log: RunRecords,
) -> None:
    """Use a range between two vehicles: both are updated as one filter."""
    one, two = events.receiver[event], events.source[event]
    n, m = fleet.size[one], fleet.size[two]
    both, h, shared = room.both, room.h, room.shared
    _join(fleet, one, two, members, both)
    for j in range(n):
        h[j] = rows.receiver[0, j]
    for j in range(m):
        h[n + j] = 0.0
        for axis in range(3):
            h[n + j] += rows.place[0, axis] * room.derivative[1, axis, j]
    if fleet.clock[two] >= 0:
        h[n + fleet.clock[two]] += rows.clock[0]
    total = rows.variance[0]
    for i in range(n + m):
        shared[i] = 0.0
        for j in range(n + m):
            shared[i] += both[i, j] * h[j]
    for i in range(n + m):
        total += h[i] * shared[i]
    spread = total - rows.variance[0] * (1.0 - events.spread[event])
    if total <= 0.0 or not _passes(fleet, events, event, rows.innovation[0], spread, gate_sigma, members, log):
        return
    for i in range(n + m):
        room.gain[i] = shared[i] / total
        for j in range(n + m):
            both[i, j] -= shared[i] * (shared[j] / total)
    _share(fleet, one, two, rows.innovation[0], members, room)


@in_place
def _join(fleet: Fleet, one: int, two: int, members: Members, both: FloatArray) -> None:
    """Fill the joint covariance of two vehicles."""
    n, m = fleet.size[one], fleet.size[two]
    for i in range(n):
        for j in range(n):
            both[i, j] = members.P[one, i, j]
        for j in range(m):
            total = 0.0
            if members.has_factor[one, two]:
                for e in range(members.factor.shape[3]):
                    total += members.factor[one, two, i, e] * members.factor[two, one, j, e]
            both[i, n + j] = both[n + j, i] = total
    for i in range(m):
        for j in range(m):
            both[n + i, n + j] = members.P[two, i, j]


@in_place
def _share(fleet: Fleet, one: int, two: int, innovation: float, members: Members, room: PairWorkspace) -> None:
    """Give both vehicles their part of the update.

    Factors towards third ones are scaled by P(after) P(before)^-1.
    """
    n, width = fleet.size[one], members.map_rows.shape[2]
    both, gain, h, mixed = room.both, room.gain, room.h, room.mixed
    for c in range(width):
        mixed[c] = 0.0
    for end in range(2):
        who, first = (one, 0) if end == 0 else (two, n)
        for i in range(fleet.size[who]):
            if h[first + i] != 0.0:
                for c in range(width):
                    mixed[c] += h[first + i] * members.map_rows[who, i, c]
    for end in range(2):
        who, first, but = (one, 0, two) if end == 0 else (two, n, one)
        size, P = fleet.size[who], members.P[who]
        has_third = False
        for other in range(len(members.time_s)):
            has_third |= other != but and members.has_factor[who, other]
        if has_third:
            _over(size, first, both, P, room)
            _scale_factors(size, who, but, room.phi, members, room)
        for i in range(size):
            members.x[who, i] += gain[first + i] * innovation
            for j in range(size):
                P[i, j] = both[first + i, first + j]
            for c in range(width):
                members.map_rows[who, i, c] -= gain[first + i] * mixed[c]
    m = fleet.size[two]
    for i in range(members.factor.shape[2]):
        for j in range(members.factor.shape[3]):
            members.factor[one, two, i, j] = both[i, n + j] if i < n and j < m else 0.0
            members.factor[two, one, i, j] = 1.0 if i == j and i < m else 0.0
    members.has_factor[one, two] = members.has_factor[two, one] = True


@in_place
def _over(n: int, first: int, both: FloatArray, before: FloatArray, room: PairWorkspace) -> None:
    """Fill ``room.phi`` with after before^-1, scaled by the sigmas.

    States differ by eight powers of ten.
    """
    normal, right = room.step[1], room.step[2]
    for i in range(n):
        for j in range(n):
            normal[i, j] = before[i, j] / np.sqrt(before[i, i] * before[j, j])
            right[j, i] = both[first + i, first + j] / np.sqrt(before[j, j])
    solve(n, n, normal, right)
    for i in range(n):
        for j in range(n):
            room.phi[i, j] = right[j, i] / np.sqrt(before[j, j])
