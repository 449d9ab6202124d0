"""Compiled loop of the centralised filter, on the Kalman core. See ``centralised``."""

from typing import NamedTuple

import numpy as np

from groundstation.base.compile import in_place, inlined
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import Pattern
from groundstation.methods.kalman.kernels import predict_covariance, predicted_variance, update_covariance
from groundstation.methods.link_dynamics import ROOMS
from groundstation.systems.cooperative.judging import count_rejection, write_down
from groundstation.systems.cooperative.loop_types import (
    HEIGHT,
    LOST,
    OUTPUTS,
    PEER,
    POINT,
    Events,
    Fleet,
    FloatArray,
    Items,
    LinearisedEvent,
    LoopRules,
    PointNumbers,
    RunRecords,
    rows_for,
)
from groundstation.systems.cooperative.motion import place, position, step
from groundstation.systems.cooperative.observation import observe

KNOWN_WRONG_SIGMAS = 3.0
SAME_TIME_S = 1e-12


class Joint(NamedTuple):
    """Joint state x and covariance P of all vehicles, then of the uncertain points.

    Changed in place.
    """

    first: Int64Array  # (k + 1,) indices of the vehicles in x
    x: FloatArray  # (N,)
    P: FloatArray  # (N, N)
    time_s: FloatArray  # (k,) of each vehicle's states
    offset_m: FloatArray  # (k, 3) dead reckoning less reference place
    rejected: Int64Array  # (k,) in a row


class JointWorkspace(NamedTuple):
    """Work arrays of the loop: N states in all, n of a vehicle at most."""

    x: FloatArray  # (2, n) receiver and source at the time of an event
    phi: FloatArray  # (2, n, n)
    noise: FloatArray  # (n, n)
    step: FloatArray  # (ROOMS, n, n)
    reading: FloatArray  # (2, 3)
    derivative: FloatArray  # (2, 3, n)
    line: FloatArray  # (4, 3) source, reference line, two others
    wide: FloatArray  # (N, N)
    g: FloatArray  # (N,)
    gain: FloatArray  # (N,)
    before: FloatArray  # (2, N) states before an event and before an update
    states: Int64Array  # (N,) 0, 1, ...
    held: Int64Array  # (0,) no state is considered only
    changed: Int64Array  # (n,) pattern of a vehicle's transition
    starts: Int64Array  # (n + 1,)
    columns: Int64Array  # (n n,), at least 2 n
    values: FloatArray  # (1, n n), at least 2 n


class JointRows(NamedTuple):
    """Rows of one update: sparse derivatives by the joint state, one below the other."""

    starts: Int64Array
    columns: Int64Array
    values: FloatArray
    innovation: FloatArray
    variance: FloatArray


def work(
    fleet: Fleet, points: PointNumbers, events: Events, items: Items, rules: LoopRules, joint: Joint, log: RunRecords
) -> None:
    """Work through a session."""
    size, n = len(joint.x), fleet.density.shape[1]
    most = int(np.max(items.last - items.first, initial=1))
    lines = JointRows(
        np.zeros(most + 1, dtype=np.int64),
        np.zeros(most * (2 * n + 2), dtype=np.int64),
        np.zeros(most * (2 * n + 2)),
        np.zeros(most),
        np.zeros(most),
    )
    run_joint(fleet, points, events, items, rules, joint, _room(size, n), rows_for(n), lines, log)


def _room(size: int, n: int) -> JointWorkspace:
    return JointWorkspace(
        np.zeros((2, n)),
        np.zeros((2, n, n)),
        np.zeros((n, n)),
        np.zeros((ROOMS, n, n)),
        np.zeros((2, 3)),
        np.zeros((2, 3, n)),
        np.zeros((4, 3)),
        np.zeros((size, size)),
        np.zeros(size),
        np.zeros(size),
        np.zeros((2, size)),
        np.arange(size),
        np.zeros(0, dtype=np.int64),
        np.zeros(n, dtype=np.int64),
        np.zeros(n + 1, dtype=np.int64),
        np.zeros(max(n, 2) * n, dtype=np.int64),
        np.zeros((1, max(n, 2) * n)),
    )


@in_place
def run_joint(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    items: Items,
    rules: LoopRules,
    joint: Joint,
    room: JointWorkspace,
    rows: LinearisedEvent,
    lines: JointRows,
    log: RunRecords,
) -> None:
    """Work through a session."""
    size, before = len(joint.x), room.before[0]
    for item in range(len(items.vehicle)):
        who, to_s = items.vehicle[item], items.time_s[item]
        if who >= 0:
            if _is_behind(joint, who, to_s):
                _advance(fleet, joint, who, to_s, room)
            _keep(fleet, joint, who, log)
        elif rules.uses_measurements:
            first, last = items.first[item], items.last[item]
            for event in range(first, last):
                for end in range(2 if events.kind[event] == PEER else 1):
                    one = events.receiver[event] if end == 0 else events.source[event]
                    if _is_behind(joint, one, to_s):
                        _advance(fleet, joint, one, to_s, room)
            for i in range(size):
                before[i] = joint.x[i]
            _use(fleet, points, events, first, last, rules, joint, room, rows, lines, log)
            for i in range(0 if rules.innovates else size):
                joint.x[i] = before[i]


@in_place
def _keep(fleet: Fleet, joint: Joint, who: int, log: RunRecords) -> None:
    """Write down a vehicle's states."""
    at, first = log.counts[OUTPUTS], joint.first[who]
    for i in range(fleet.size[who]):
        log.x[at, i] = joint.x[first + i]
        for j in range(fleet.size[who]):
            log.P[at, i, j] = joint.P[first + i, first + j]
    log.counts[OUTPUTS] += 1


@inlined
def _is_behind(joint: Joint, who: int, to_s: float) -> bool:
    """Tell whether a vehicle's block is to be moved on.

    It is asked before the call, which copies what it is handed.
    """
    return bool(to_s > joint.time_s[who] + SAME_TIME_S)


@in_place
def _advance(fleet: Fleet, joint: Joint, who: int, to_s: float, room: JointWorkspace) -> None:
    """Move one vehicle's block on."""
    n, first = fleet.size[who], joint.first[who]
    x, phi, noise = room.x[0], room.phi[0], room.noise
    for i in range(n):
        x[i] = joint.x[first + i]
    step(fleet, who, x, joint.time_s[who], to_s, phi, noise, room.step)
    changed, starts, columns, values = room.changed, room.starts, room.columns, room.values
    count = 0
    for i in range(n):
        joint.x[first + i] = x[i]
        changed[i], starts[i] = first + i, count
        for j in range(n):
            if phi[i, j] != 0.0:
                columns[count], values[0, count] = first + j, phi[i, j]
                count += 1
    starts[n] = count
    pattern = Pattern(changed[:n], starts, columns)
    predict_covariance(room.states, pattern, values, 0, joint.P, room.wide)
    for i in range(n):
        for j in range(i, n):
            if noise[i, j] != 0.0:
                joint.P[first + i, first + j] += noise[i, j]
                joint.P[first + j, first + i] = joint.P[first + i, first + j]
    joint.time_s[who] = to_s


@inlined
def _look_at(fleet: Fleet, joint: Joint, who: int, at_s: float, end: int, room: JointWorkspace) -> bool:
    """Fill the state of a vehicle at a time, its place, and the derivative by its state now.

    End 0 receives, 1 sends. Return whether the time is another than that of its state.
    """
    n, first = fleet.size[who], joint.first[who]
    x, phi = room.x[end], room.phi[end]
    for i in range(n):
        x[i] = joint.x[first + i]
    is_other = bool(abs(at_s - joint.time_s[who]) >= SAME_TIME_S)
    if is_other:
        step(fleet, who, x, joint.time_s[who], at_s, phi, room.noise, room.step)
    place(fleet, who, at_s, room.reading[end], room.derivative[end])
    return is_other


@inlined
def _linearise(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    event: int,
    rules: LoopRules,
    joint: Joint,
    room: JointWorkspace,
    rows: LinearisedEvent,
    lines: JointRows,
    at: int,
) -> int:
    """Put the rows of an event into ``lines`` from row ``at`` on; return how many there are."""
    who, source, at_s = events.receiver[event], events.source[event], events.time_s[event]
    is_back, is_source_back = _look_at(fleet, joint, who, at_s, 0, room), False
    source_m, clock_m, is_about = room.line[0], 0.0, False
    for axis in range(3):
        source_m[axis] = events.place_m[event, axis]
    is_peer = events.kind[event] == PEER
    uncertain = points.uncertain[source] if events.kind[event] == POINT else -1
    shared = joint.first[-1] + 2 * uncertain
    if is_peer:
        is_source_back = _look_at(fleet, joint, source, at_s, 1, room)
        position(fleet.size[source], room.reading[1], room.derivative[1], room.x[1], source_m)
        has_clocks = fleet.clock[who] >= 0 and fleet.clock[source] >= 0
        clock_m = room.x[1][fleet.clock[source]] if fleet.clock[source] >= 0 else 0.0
        if rules.about_reckoning and has_clocks:
            _refer(fleet, joint, who, source, events.arm_m[event], room)
            is_about = True
    elif uncertain >= 0:
        for axis in range(3):
            for j in range(2):
                source_m[axis] -= points.axes[source, axis, j] * joint.x[shared + j]
    count = observe(
        fleet,
        events,
        event,
        room.x[0],
        room.reading[0],
        room.derivative[0],
        source_m,
        clock_m,
        room.line[1],
        is_about,
        rows,
    )
    for row in range(count):
        entry = lines.starts[at + row]
        entry = _put(fleet.size[who], rows.receiver[row], is_back, room.phi[0], joint.first[who], lines, entry)
        if is_peer:
            by_source = room.gain
            for j in range(fleet.size[source]):
                by_source[j] = 0.0
                for axis in range(3):
                    by_source[j] += rows.place[row, axis] * room.derivative[1, axis, j]
            if fleet.clock[source] >= 0:
                by_source[fleet.clock[source]] += rows.clock[row]
            entry = _put(fleet.size[source], by_source, is_source_back, room.phi[1], joint.first[source], lines, entry)
        elif uncertain >= 0:
            for j in range(2):
                lines.columns[entry], lines.values[entry] = shared + j, 0.0
                for axis in range(3):
                    lines.values[entry] -= rows.place[row, axis] * points.axes[source, axis, j]
                entry += 1
        lines.starts[at + row + 1] = entry
        lines.innovation[at + row], lines.variance[at + row] = rows.innovation[row], rows.variance[row]
    return count


@inlined
def _put(n: int, h: FloatArray, is_back: bool, phi: FloatArray, first: int, lines: JointRows, entry: int) -> int:
    """Write the derivative by a vehicle's states now, h phi, where it is not zero.

    Returns the next free entry.
    """
    for j in range(n):
        total = h[j]
        if is_back:
            total = 0.0
            for i in range(n):
                total += h[i] * phi[i, j]
        if total != 0.0:
            lines.columns[entry], lines.values[entry] = first + j, total
            entry += 1
    return entry


@in_place
def _refer(fleet: Fleet, joint: Joint, who: int, source: int, arm_m: FloatArray, room: JointWorkspace) -> None:
    """Fill the line between two aircraft about which their range is linearised.

    Its ends move when known to be wrong.
    """
    here, about, across = room.line[2], room.line[1], room.line[3]
    position(fleet.size[who], room.reading[0], room.derivative[0], room.x[0], here)
    along = square = length = 0.0
    for axis in range(3):
        offset = joint.offset_m[who, axis] - joint.offset_m[source, axis]
        about[axis] = arm_m[axis] + room.reading[0, axis] - room.reading[1, axis] - offset
        across[axis] = arm_m[axis] + here[axis] - room.line[0, axis] - about[axis]
        along += about[axis] * across[axis]
        length += about[axis] ** 2
    for axis in range(3):
        across[axis] -= about[axis] * along / length
        square += across[axis] ** 2
    columns, values, count = room.columns, room.values[0], 0  # the derivative of the line's end, across it
    for end in range(2):
        one = who if end == 0 else source
        for i in range(fleet.size[one]):
            by_state = 0.0
            for axis in range(3):
                by_state += across[axis] * room.derivative[end, axis, i]
            if by_state != 0.0:
                columns[count], values[count] = joint.first[one] + i, by_state if end == 0 else -by_state
                count += 1
    variance = predicted_variance(columns, values, 0, count, joint.P)
    if square * square > KNOWN_WRONG_SIGMAS**2 * variance:
        for axis in range(3):
            joint.offset_m[who, axis] = room.reading[0, axis] - here[axis]
            joint.offset_m[source, axis] = room.reading[1, axis] - room.line[0, axis]
            about[axis] = arm_m[axis] + here[axis] - room.line[0, axis]


@inlined
def _judge(
    fleet: Fleet, events: Events, event: int, rules: LoopRules, joint: Joint, lines: JointRows, at: int, log: RunRecords
) -> bool:
    """Tell whether a row is inside the gate.

    It opens the clock of a vehicle none of whose ranges fits any more.
    """
    total = lines.variance[at] * events.spread[event] + predicted_variance(
        lines.columns, lines.values, lines.starts[at], lines.starts[at + 1], joint.P
    )
    is_gated = rules.gate_sigma > 0.0 and lines.innovation[at] ** 2 > rules.gate_sigma**2 * total
    write_down(event, lines.innovation[at], total, not is_gated, log)
    for end in range(2 if events.kind[event] == PEER else 1):
        who = events.receiver[event] if end == 0 else events.source[event]
        may_open = events.kind[event] != HEIGHT
        count_rejection(fleet, who, not is_gated, may_open, joint.rejected, joint.first[who], joint.P, log)
    return not is_gated


@inlined
def _correct(joint: Joint, room: JointWorkspace, lines: JointRows, at: int, innovation: float) -> None:
    """Use one scalar measurement with the optimal gain, in the core's symmetric form."""
    size = len(joint.x)
    update_covariance(
        room.states,
        lines.columns,
        lines.values,
        lines.starts[at],
        lines.starts[at + 1],
        lines.variance[at],
        room.held,
        joint.P,
        room.g,
        room.gain,
    )
    for i in range(size):
        joint.x[i] += room.gain[i] * innovation


@inlined
def _use(
    fleet: Fleet,
    points: PointNumbers,
    events: Events,
    first: int,
    last: int,
    rules: LoopRules,
    joint: Joint,
    room: JointWorkspace,
    rows: LinearisedEvent,
    lines: JointRows,
    log: RunRecords,
) -> None:
    """Use all measurements in one update, linearised once.

    Their noise is independent, so they may be used one after the other, each with what those before it have moved taken
    off its innovation.
    """
    count = 0
    for event in range(first, last):
        found = _linearise(fleet, points, events, event, rules, joint, room, rows, lines, count)
        if found == 0:
            log.counts[LOST] += 1
        for at in range(count, count + found):
            if not _judge(fleet, events, event, rules, joint, lines, at, log):
                lines.innovation[at] = np.nan
        count += found
    before = room.before[1]
    for i in range(len(before)):
        before[i] = joint.x[i]
    for at in range(count):
        innovation = lines.innovation[at]
        if np.isfinite(innovation):
            for e in range(lines.starts[at], lines.starts[at + 1] if at > 0 else 0):  # the first finds nothing moved
                innovation -= lines.values[e] * (joint.x[lines.columns[e]] - before[lines.columns[e]])
            _correct(joint, room, lines, at, innovation)
