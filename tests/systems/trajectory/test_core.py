"""Core of the trajectory estimator: rows of the measurements, filter and smoother against dense least squares."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from groundstation.base.records import Int64Array
from groundstation.simulation.imu.families import Family
from groundstation.simulation.imu.flight import simulate_imu
from groundstation.simulation.imu.motion import true_states
from groundstation.simulation.imu.settings import ImuSettings
from groundstation.systems.trajectory.model import DEG, Model, StartSigmas, gate
from groundstation.systems.trajectory.passes import Pass, Start, run_pass
from groundstation.systems.trajectory.states import (
    ATT,
    BA,
    BARO,
    BG,
    HEADING,
    HEIGHT,
    KEPT_ROWS,
    LAG,
    LAT,
    LEV,
    MG,
    MISALIGNED,
    MNT,
    NAVIGATION,
    NO_RATE,
    NO_SLIP,
    POS,
    POSITION,
    SG,
    SLOW,
    STATES,
    STILL,
    VELOCITY,
    WHEEL,
    WHL,
    Seen,
)
from groundstation.systems.trajectory.track import _attitude_sigma
from tests.systems.trajectory.core_cases import (
    NOISE,
    SIZES,
    FloatArray,
    carried,
    nudged,
    perfect,
    plan_of,
    samples_of,
    start_at,
    transition,
)

ABSENT = 1e9
# Rows that central differences find otherwise: rounding of the latitude, 1e-9 m against steps of 1e-3 m and more, and
# the change of the gravity with the height.
ROW = 3e-5
# Biases turn and push the antenna between the fix and the epoch: left out, since that is 10 ms at most but for the
# latency that is still to be found.
LEFT_OUT = [*range(BG, BG + 3), *range(BA, BA + 3)]
SCALARS = {POSITION: 3, VELOCITY: 3, STILL: 3, NO_RATE: 3, NO_SLIP: 2, HEIGHT: 1, HEADING: 1, WHEEL: 1}


def value_of(rng: np.random.Generator) -> FloatArray:
    """Values of the constants, none of them zero."""
    value = np.zeros(STATES)
    value[BG:LEV] = 0.3 * SIZES[BG:LEV] * rng.standard_normal(LEV - BG)
    value[LEV:LAT] = 0.5, 0.2, -1.0
    value[LAT], value[LAG] = 0.05, 0.02
    value[SLOW:MNT] = rng.standard_normal(6)
    value[MNT:BARO] = 0.05, -0.03
    value[BARO], value[WHL] = 2.0, 0.01
    return value


def measured(kind: int, start: Start) -> FloatArray:
    """Values of a measurement near those of a start, shape (3,)."""
    found = np.full(3, np.nan)
    if kind == POSITION:
        found[:] = start.nav[:3] + np.array([1e-6, -1e-6, 1.0])
    elif kind in (VELOCITY, STILL):
        found[:] = start.nav[3:6] + np.array([0.1, -0.2, 0.3])
    elif kind == NO_RATE:
        found[:] = 0.01, 0.02, -0.03
    elif kind == NO_SLIP:
        found[:2] = 0.0
    else:
        found[0] = {HEIGHT: start.nav[2], WHEEL: float(np.linalg.norm(start.nav[3:6]))}.get(kind, 3.0)
    return found


def rows_of(linear_h: FloatArray, columns: Int64Array) -> FloatArray:
    """Rows of measurements as a dense matrix, shape (s, STATES)."""
    H = np.zeros((len(linear_h), STATES))
    np.add.at(H, (np.arange(len(H))[:, None], columns), linear_h)
    return H


@pytest.mark.parametrize("kind", SCALARS)
@pytest.mark.parametrize(("family", "time_s"), [("uav", 100.0), ("hover", 83.0)])
def test_rows_are_derivatives_of_what_is_measured(family: Family, time_s: float, kind: int) -> None:
    flight = perfect(family)
    samples = samples_of(flight)
    start = start_at(flight, time_s, value_of(np.random.default_rng(1)))
    truth = true_states(flight.motion, np.array([time_s]))
    seen = Seen(
        np.array([kind]),
        np.array([0.02]),
        measured(kind, start)[None],
        np.ones((1, 3)),
        np.array(truth.rate_earth_radps),
        np.array(truth.force_mps2),
    )
    plan = plan_of(samples, [round(time_s * 100.0)], seen, [0, 1])
    linear = carried(samples, plan, start)
    count = SCALARS[kind]
    assert (linear.z[:count] != ABSENT).all() and (linear.z[count:] == ABSENT).all()
    found = rows_of(linear.h, linear.columns)[:count]
    wanted = np.empty_like(found)
    for state in range(STATES):
        by = 1e-3 * SIZES[state]
        up, down = (carried(samples, plan, nudged(start, state, sign * by)).z[:count] for sign in (1.0, -1.0))
        wanted[:, state] = (down - up) / (2.0 * by)
    off = np.abs(found - wanted) * SIZES
    kept = [state for state in range(STATES) if state not in LEFT_OUT or kind not in (POSITION, VELOCITY)]
    assert off[:, kept].max() < ROW
    assert (np.abs(found).max(axis=1) > 0.0).all()


def test_no_rate_holds_what_the_strapdown_takes_off() -> None:
    """Scale and misalignment act on the bias too: half a degree a second of it is read through them."""
    flight = perfect("uav")
    value, read = value_of(np.random.default_rng(2)), np.radians([0.5, -0.4, 0.3])
    errors = np.diag(value[SG : SG + 3])
    for at, (reads, turned) in enumerate(MISALIGNED):
        errors[reads, turned] = value[MG + at]
    value[BG : BG + 3] = read - errors @ read
    start, zero = start_at(flight, 10.0, value), np.zeros((1, 3))
    seen = Seen(np.array([NO_RATE]), np.zeros(1), read[None], np.ones((1, 3)), zero, zero)
    linear = carried(samples_of(flight), plan_of(samples_of(flight), [1000], seen, [0, 1]), start)
    assert np.abs(linear.z[:3]).max() < 1e-12


def short_problem(family: Family, epochs: int, *, with_line: bool = False) -> tuple[Pass, Seen, FloatArray]:
    """Pass over some epochs of 0.2 s, with measurements of every kind; its measurements, and the covariance."""
    rng = np.random.default_rng(7)
    flight = simulate_imu(family, 5, settings=ImuSettings(duration_s=100.0, scale_factor=0.005))
    samples = samples_of(flight)
    first = 7000
    edges = [first + 20 * number for number in range(epochs)]
    start = start_at(flight, 70.0)
    kinds, variances, values, back, first_seen = [], [], [], [], [0]
    for edge in edges:
        truth = start_at(flight, edge / 100.0)
        for kind in rng.choice(list(SCALARS), 2, replace=False):
            value = measured(kind, truth)
            if kind == HEADING:
                value[0] = np.radians(flight.heading_deg[edge - 1])
            variance = np.full(3, {POSITION: 1.0, VELOCITY: 0.01, HEIGHT: 4.0}.get(kind, 0.01))
            if kind == VELOCITY and rng.random() < 0.3:
                variance[2] = np.nan
            kinds.append(kind)
            values.append(value)
            variances.append(variance)
            back.append(0.004)
        first_seen.append(len(kinds))
    seen = Seen(
        np.array(kinds, dtype=np.int64),
        np.array(back),
        np.array(values),
        np.array(variances),
        np.tile([0.02, -0.05, 0.1], (len(kinds), 1)),
        np.tile([0.3, 0.2, -9.8], (len(kinds), 1)),
    )
    sigmas = StartSigmas().variances(NOISE, Model(), has_latency=True, has_slip=True, has_baro=True, has_wheels=True)
    sigmas[:NAVIGATION] = np.repeat([25.0, 1.0, (5.0 * DEG) ** 2], 3)
    mix = np.eye(STATES) + 0.1 * rng.standard_normal((STATES, STATES))
    p = np.sqrt(sigmas)[:, None] * (mix @ mix.T) * np.sqrt(sigmas)
    prior = 0.3 * np.sqrt(sigmas) * rng.standard_normal(STATES)
    plan = plan_of(samples, edges, seen, first_seen)
    done = run_pass(samples, plan, NOISE, gate(1e6), replace(start, p=p, prior=prior), keeps_all=True)
    return done, seen, p


def test_only_what_is_wanted_is_smoothed_and_to_the_same_numbers() -> None:
    short, _seen, p = short_problem("uav", 24)
    begun = replace(short.begun, p=p)
    of = samples_of(simulate_imu("uav", 5, settings=ImuSettings(duration_s=100.0, scale_factor=0.005))), short.plan
    whole = run_pass(*of, NOISE, gate(1e6), begun)
    wanted = np.isin(np.arange(24), (7, 8, 9, 17))
    part = run_pass(*of, NOISE, gate(1e6), begun, wanted=wanted)
    for name in ("x", "variance", "plane", "before_variance"):
        assert np.array_equal(getattr(part, name)[wanted], getattr(whole, name)[wanted])
        assert np.isnan(getattr(part, name)[[0, 5, 11, 15, 21, 23]]).all()
    plain = run_pass(*of, NOISE, gate(1e6), begun, has_sigmas=False)
    assert np.array_equal(plain.x, whole.x) and np.isnan(plain.variance).all()
    for one in (part, plain):
        assert np.array_equal(one.start.value, whole.start.value) and np.array_equal(one.constants, whole.constants)


def process_noise(done: Pass, epoch: int) -> FloatArray:
    """Covariance that an epoch adds, from the densities of the model."""
    Q = np.zeros((STATES, STATES))
    total, of_angle, of_velocity = done.linear.spent[epoch]
    q = NOISE.density[1] * total + of_velocity
    for axis in range(3):
        Q[axis, axis], Q[axis, 3 + axis], Q[3 + axis, axis] = q * total**2 / 3.0, q * total / 2.0, q * total / 2.0
        Q[3 + axis, 3 + axis] = q
        Q[6 + axis, 6 + axis] = NOISE.density[0] * total + of_angle
        Q[BG + axis, BG + axis] = NOISE.density[2] * total
        Q[BA + axis, BA + axis] = NOISE.density[3] * total
    Q[range(MNT, BARO), range(MNT, BARO)] = NOISE.density[4] * total
    fade = np.diag(transition(done.linear, epoch))
    for place, state in enumerate((*range(SLOW, MNT), BARO)):
        Q[state, state] = NOISE.variance[place] * (1.0 - fade[state] ** 2)
    return Q


@cache
def dense(family: Family, epochs: int) -> tuple[Pass, FloatArray, FloatArray, FloatArray, FloatArray]:
    """A short pass, and dense results: filter's covariances and corrections, then those of all data at once.

    The states of all epochs are one Gaussian vector, which the measurements condition: least squares in one step.
    """
    done, seen, p = short_problem(family, epochs)
    linear, n = done.linear, STATES
    H, used = rows_of(linear.h, linear.columns), done.solved.mark == 1
    assert used.sum() > 3 * epochs and (done.solved.mark >= 0).all()
    starts = 3 * done.plan.schedule.seen
    mean, joint = np.zeros(epochs * n), np.zeros((epochs * n, epochs * n))
    x, c = done.begun.prior, p
    xs, ps = np.empty((epochs, n)), np.empty((epochs, n, n))
    running_x, running_p = x, c
    for epoch in range(epochs):
        F, Q = transition(linear, epoch), process_noise(done, epoch)
        here = slice(epoch * n, epoch * n + n)
        if epoch == 0:
            mean[here], joint[here, here] = F @ x, F @ c @ F.T + Q
        else:
            before = slice(here.start - n, here.start)
            mean[here] = F @ (mean[before] - linear.closed[epoch - 1])
            joint[here, : here.start] = F @ joint[before, : here.start]
            joint[: here.start, here] = joint[here, : here.start].T
            joint[here, here] = F @ joint[before, before] @ F.T + Q
            running_x = running_x - linear.closed[epoch - 1]
        running_x, running_p = F @ running_x, F @ running_p @ F.T + Q
        xs[epoch], ps[epoch] = running_x, running_p
        at = [one for one in range(starts[epoch], starts[epoch + 1]) if used[one]]
        R = np.diag(seen.variance.ravel()[at])
        gain = np.linalg.solve(H[at] @ running_p @ H[at].T + R, H[at] @ running_p).T
        running_x = running_x + gain @ (linear.z[at] - H[at] @ running_x)
        keep = np.eye(n) - gain @ H[at]
        running_p = keep @ running_p @ keep.T + gain @ R @ gain.T
    at = np.flatnonzero(used)
    epoch_of = np.searchsorted(starts, at, side="right") - 1
    big = np.zeros((len(at), epochs * n))
    for row, (one, epoch) in enumerate(zip(at, epoch_of, strict=True)):
        big[row, epoch * n : epoch * n + n] = H[one]
    S = big @ joint @ big.T + np.diag(seen.variance.ravel()[at])
    # scaled, so that the conditioning is that of the problem and not of its units
    scale = 1.0 / np.sqrt(np.diag(S))
    gain = (np.linalg.solve(S * scale[:, None] * scale, (big @ joint) * scale[:, None]) * scale[:, None]).T
    smoothed = mean + gain @ (linear.z[at] - big @ mean)
    spread = (joint - gain @ (big @ joint)).reshape(epochs, n, epochs, n)
    return done, xs, ps, smoothed.reshape(epochs, n), np.stack([spread[e, :, e] for e in range(epochs)])


@pytest.mark.parametrize(("family", "epochs"), [("uav", 24), ("hover", 40)])
def test_filter_is_the_dense_filter(family: Family, epochs: int) -> None:
    done, xs, ps, *_ = dense(family, epochs)
    sigma = np.sqrt(np.einsum("eii->ei", ps))
    assert np.abs((done.solved.before - xs) / sigma).max() < 1e-8
    off = (done.solved.p - ps[:, :KEPT_ROWS]) / (sigma[:, :KEPT_ROWS, None] * sigma[:, None, :])
    assert np.abs(off).max() < 1e-8
    assert np.array_equal(done.solved.tilt[:, 0], done.solved.p[:, ATT, ATT + 1])
    assert (np.abs(done.solved.tilt[1:, 1]) > 0.0).all()


def test_sigmas_of_roll_and_pitch_are_those_along_the_vehicle() -> None:
    heading = np.radians([0.0, 30.0, 90.0, 200.0])
    roll, pitch = np.radians(0.3), np.radians(0.1)
    c, s = np.cos(heading), np.sin(heading)
    variance = np.stack(
        [(c * roll) ** 2 + (s * pitch) ** 2, (s * roll) ** 2 + (c * pitch) ** 2, 0.01 + 0.0 * c], axis=1
    )
    found = _attitude_sigma(np.zeros(4), heading, variance, c * s * (roll**2 - pitch**2))
    assert np.allclose(found, np.tile([roll, pitch, 0.1], (4, 1)), rtol=1e-12)


@pytest.mark.parametrize(("family", "epochs"), [("uav", 24), ("hover", 40)])
def test_smoother_is_least_squares_of_all_data(family: Family, epochs: int) -> None:
    done, _xs, _ps, smoothed, spread = dense(family, epochs)
    wanted = np.einsum("eii->ei", spread)[:, :KEPT_ROWS]
    assert np.abs(done.variance / wanted - 1.0).max() < 1e-8
    for at, first in enumerate((POS, ATT)):
        off = done.plane[:, at] - spread[:, first, first + 1]
        assert np.abs(off / np.sqrt(wanted[:, first] * wanted[:, first + 1])).max() < 1e-8
    assert np.abs((done.x - smoothed[:, :KEPT_ROWS]) / np.sqrt(wanted)).max() < 1e-8
    filtered = np.einsum("eii->ei", done.solved.p[:, :, :KEPT_ROWS])
    assert (done.variance[:-1] < 0.999 * filtered[:-1]).any(axis=1).all()  # it does know more than the filter
