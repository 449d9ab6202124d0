"""Compiled loop of the filter over epochs: gates, rejections, reopening, records.

The letters are those of ``kernels``.
"""

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import (
    ABSENT,
    REJECTED,
    USED,
    Drive,
    Dynamics,
    FilterRecord,
    FilterWorkspace,
    FloatArray,
    GateRules,
    Marks,
    MeasurementRows,
    Now,
    Schedule,
    States,
)
from groundstation.methods.kalman.kernels import (
    add_noise,
    predict_covariance,
    predict_states,
    predicted,
    predicted_variance,
    update_covariance,
)


@in_place
def open_again(
    starts: Int64Array,
    columns: Int64Array,
    values: FloatArray,
    variance: FloatArray,
    row: Int64Array,
    begin: int,
    end: int,
    opened: FloatArray,
    is_by_innovation: bool,
    p: FloatArray,
    y: FloatArray,
    S: FloatArray,
    mark: Marks,
) -> None:
    """Widen the covariance for measurements that were rejected too often.

    They are those from ``begin`` to ``end``.
    """
    for i in range(len(opened)):
        p[i, i] += opened[i]
    if is_by_innovation:
        for m in range(begin, end):
            for e in range(starts[row[m]], starts[row[m] + 1]):
                for c in range(y.shape[1]):
                    if mark[m] != ABSENT:
                        p[columns[e], columns[e]] += (y[m, c] / values[e]) ** 2
    for m in range(begin, end):
        if mark[m] != ABSENT:
            r = row[m]
            S[m] = predicted_variance(columns, values, starts[r], starts[r + 1], p) + variance[r]


@in_place
def run_filter(
    states: States,
    dynamics: Dynamics,
    schedule: Schedule,
    lines: MeasurementRows,
    rules: GateRules,
    drive: Drive,
    z: FloatArray,
    held: Int64Array,
    now: Now,
    room: FilterWorkspace,
    out: FilterRecord,
) -> int:
    """Run the filter over epochs, and return how often it was opened.

    ``z`` (m, c) are the measurements, NaN absent.
    """
    n, channels = len(states), z.shape[1]
    pattern, F, noise_rows, noise_columns, before, after = dynamics
    step, jump, jumps, first, row = schedule
    starts, columns, values, variance, believed, kind = lines
    gate, patience, opened, is_by_innovation = rules
    driven, mix, push = drive
    x, p, in_a_row = now
    out_x, out_P, out_variance, out_K, y, S, mark, judged_innovation, judged_variance = out
    w, g, K, moved = room
    reopened = 0
    for k in range(len(step)):
        if step[k] >= 0:
            if len(before) > 0:
                add_noise(states, noise_rows, noise_columns, before, step[k], p)
            predict_covariance(states, pattern, F, step[k], p, w)
            if len(after) > 0:
                add_noise(states, noise_rows, noise_columns, after, step[k], p)
            if len(push) > 0:
                for c in range(channels):
                    moved[c] = push[k, c]
                    for j in range(channels):
                        moved[c] += mix[k, c, j] * x[j, driven]
            predict_states(states, pattern, F, step[k], x, w)
            if len(push) > 0:
                for c in range(channels):
                    x[c, driven] += moved[c]
        if jump[k] >= 0:
            for i in range(n):
                p[i, i] += jumps[jump[k], i]
        begin, stop = first[k], first[k + 1]
        while begin < stop:
            group = kind[row[begin]]
            end = begin + 1
            while end < stop and kind[row[end]] == group:
                end += 1
            verdict = ABSENT
            for m in range(begin, end):
                r = row[m]
                own, is_known, is_inside = 0.0, True, True
                for e in range(starts[r], starts[r + 1]):
                    inner = 0.0
                    for f in range(starts[r], starts[r + 1]):
                        inner += values[f] * p[columns[e], columns[f]]
                    own += values[e] * inner
                for c in range(channels):
                    residual = z[m, c]
                    for e in range(starts[r], starts[r + 1]):
                        residual -= values[e] * x[c, columns[e]]
                    y[m, c] = residual
                    if not np.isfinite(residual):
                        is_known = False
                    elif residual * residual > gate * (own + believed[r]):
                        is_inside = False
                mark[m], S[m] = ABSENT, np.nan
                if is_known:
                    mark[m], S[m] = USED, own + variance[r]
                    if not is_inside:
                        verdict = REJECTED
                    elif verdict == ABSENT:
                        verdict = USED
            if verdict == USED:
                in_a_row[group] = 0
            elif verdict == REJECTED:
                in_a_row[group] += 1
                if in_a_row[group] > patience[group]:
                    open_again(
                        starts,
                        columns,
                        values,
                        variance,
                        row,
                        begin,
                        end,
                        opened[group],
                        is_by_innovation,
                        p,
                        y,
                        S,
                        mark,
                    )
                    in_a_row[:] = 0
                    reopened += 1
                    verdict = USED
            if len(judged_variance) > 0:
                for m in range(begin, end):
                    judged_variance[m] = S[m]
                    for c in range(channels):
                        judged_innovation[m, c] = y[m, c]
            for m in range(begin, end):
                if mark[m] == USED and verdict == USED:
                    r = row[m]
                    if m > begin:
                        for c in range(channels):
                            y[m, c] = z[m, c] - predicted(columns, values, starts[r], starts[r + 1], x, c)
                    S[m] = update_covariance(
                        states, columns, values, starts[r], starts[r + 1], variance[r], held, p, g, K
                    )
                    for c in range(channels):
                        for i in range(n):
                            x[c, i] += K[i] * y[m, c]
                else:
                    if mark[m] == USED:
                        mark[m] = REJECTED
                    for i in range(n):
                        K[i] = 0.0
                if len(out_K) > 0:
                    for i in range(n):
                        out_K[m, i] = K[i]
            begin = end
        if len(out_x) > 0:
            for c in range(channels):
                for i in range(n):
                    out_x[k, i, c] = x[c, i]
        if len(out_P) > 0:
            for i in range(n):
                for j in range(n):
                    out_P[k, i, j] = p[i, j]
        if len(out_variance) > 0:
            for i in range(n):
                out_variance[k, i] = p[i, i]
    return reopened


@in_place
def run_driven(
    growth: FloatArray, mix: FloatArray, known: FloatArray, every: int, x: FloatArray, built_up: FloatArray
) -> None:
    """Add up what one state of many starts grows by, and by what it is dragged by itself.

    Parameters
    ----------
    growth : ndarray, shape (k, c, s)
        Growth over each step by the other states; k = ``every`` times the leads.
    mix : ndarray, shape (k, c, c, s)
        It drags what stands in the state and ``known`` together.
    known : ndarray, shape (c, s)
        Error that the state had built up before the start.
    x : ndarray, shape (2, c, s)
        The state, changed in place, and room.
    built_up : ndarray, shape (leads, c, s)
        Filled: the state after every ``every`` steps.
    """
    channels, count = known.shape
    for k in range(len(growth)):
        for c in range(channels):
            for s in range(count):
                x[1, c, s] = x[0, c, s] + growth[k, c, s]
            for j in range(channels):
                for s in range(count):
                    x[1, c, s] += mix[k, c, j, s] * (known[j, s] + x[0, j, s])
        for c in range(channels):
            for s in range(count):
                x[0, c, s] = x[1, c, s]
        if (k + 1) % every == 0:
            for c in range(channels):
                for s in range(count):
                    built_up[(k + 1) // every - 1, c, s] = x[0, c, s]
