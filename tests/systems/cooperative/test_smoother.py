"""Smoother of a session: its models against the filters', its solver against a dense one, its honesty."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import SessionScenario
from groundstation.systems.cooperative.events import Prepared, prepare
from groundstation.systems.cooperative.filters.observation import rows_of
from groundstation.systems.cooperative.filters.steps import MeasurementEvent
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER, POINT
from groundstation.systems.cooperative.settings import (
    CameraBelief,
    CooperativeSettings,
    OdometryBelief,
    SmootherSettings,
)
from groundstation.systems.cooperative.smoother.chain import Chain, Problem, block
from groundstation.systems.cooperative.smoother.knots import Knots, knots_of
from groundstation.systems.cooperative.smoother.layout import Layout, layout_of
from groundstation.systems.cooperative.smoother.rows import Rows
from groundstation.systems.cooperative.smoother.smoothed import run_smoothed, smooth
from groundstation.systems.cooperative.smoother.weights import cauchy, honest_factor
from groundstation.tables.session import NO_SLOT, GroundPoint, Heights, Odometry, Ranges, Session
from tests.systems.cooperative.example import GLOBAL, LOCAL, believed, full_nees

SEEDS = range(9100, 9124)  # written down before the first run
ROUNDING_M = 1e-4  # positions of 6e6 m, and dynamics of a global frame averaged over a knot
NEES_LIMITS_7 = (4.9, 9.4)  # chi-square of 7 degrees of freedom, mean over 24 sessions: 99.8 % within


def put(prepared: Prepared, settings: CooperativeSettings) -> tuple[Layout, Knots]:
    layout, knots = layout_of(prepared, settings), knots_of(prepared, settings)
    for number, group in enumerate(layout.groups):
        group.set_knots(np.ascontiguousarray(knots.own_s[:, list(layout.members[number])]))
    return layout, knots


def robots() -> tuple[Prepared, CooperativeSettings]:
    """Two robots with cameras that see each other and a landmark, all states of odometry and camera."""
    rng = np.random.default_rng(3)
    time_s = 0.2 * np.arange(50)
    tracks = tuple(
        Odometry(name, time_s, 0.3 + 0.1 * rng.random(50), 30.0 * rng.standard_normal(50), place, 20.0)
        for name, place in (("R1", (0.0, 0.0)), ("R2", (3.0, 1.0)))
    )
    at_s = np.sort(10.0 * rng.random(40))
    receiver, other = np.where(rng.random(40) < 0.5, "R1", "R2"), rng.random(40) < 0.5
    source = np.where(other, np.where(receiver == "R1", "R2", "R1"), "L1")
    value, bearing = np.full(40, 3.0), 20.0 * rng.standard_normal(40)
    ranges = Ranges(
        at_s, receiver, source, value, np.full(40, 0.05), np.full(40, NO_SLOT), bearing, np.full(40, 1.0), True
    )
    settings = CooperativeSettings(
        odometry=OdometryBelief(speed_scale=0.1, turn_scale=0.1),
        camera=CameraBelief(range_scale=0.05, marker_bias_m=0.03, mount_deg=1.0, lag_s=0.1),
        range_bias_m=0.1,
        smoother=SmootherSettings(pair_bias_m=0.02),
    )
    return prepare(Session("local", tracks, (GroundPoint("L1", (2.0, -2.0, 0.0), 0.1),), ranges), settings), settings


def flown(scenario: SessionScenario, **changes: object) -> tuple[Prepared, CooperativeSettings]:
    short = replace(scenario, duration_s=20.0)
    settings = believed(short, range_bias_m=5.0, lever_arm_m=3.0, **changes)
    session = simulate_session(short, 1).session
    heights = Heights(np.array([3.0, 8.5]), np.array(["A", "B"]), np.array([900.0, 1100.0]), np.array([20.0, 20.0]))
    return prepare(replace(session, heights=heights), settings), settings


def some_states(prepared: Prepared, layout: Layout, knots: Knots) -> np.ndarray:
    rng = np.random.default_rng(8)
    scale = np.sqrt(layout.variance) * (0.2 if layout.groups[0].size < 12 else 0.5)
    return np.asarray(layout.start + scale * rng.standard_normal((len(knots.time_s), layout.size)))


@pytest.mark.parametrize("what", ["local", "global", "robots"])
def test_motion_is_that_of_the_filters(what: str) -> None:
    prepared, settings = robots() if what == "robots" else flown(LOCAL if what == "local" else GLOBAL)
    layout, knots = put(prepared, settings)
    x = some_states(prepared, layout, knots)
    (group,) = layout.groups
    moved, phi, noise = group.move(x[:-1, layout.span(0)].reshape(-1, group.count, group.size), 0, len(x) - 1)
    for who, vehicle in enumerate(prepared.vehicles):
        start = np.sqrt(np.diag(vehicle.start()[1]))
        for knot in range(0, len(x) - 1, max(1, len(x) // 12)):
            one, two = knots.own_s[knot, who], knots.own_s[knot + 1, who]
            after, by_state, added = vehicle.step(x[knot, layout.of(who)], one, two)
            sigma = np.sqrt(np.maximum(np.diag(added), 1e-30))
            assert moved[knot, who] == pytest.approx(after, rel=1e-6, abs=1e-7)
            change = (phi[knot, who] - by_state) * start / start[:, None]
            assert change == pytest.approx(np.zeros_like(change), abs=1e-5)
            assert noise[knot, who] / np.outer(sigma, sigma) == pytest.approx(added / np.outer(sigma, sigma), abs=1e-3)


@pytest.mark.parametrize("what", ["local", "global", "robots"])
def test_rows_are_those_of_the_filters(what: str) -> None:
    prepared, settings = robots() if what == "robots" else flown(LOCAL if what == "local" else GLOBAL)
    layout, knots = put(prepared, settings)
    rows = Rows(prepared, layout, knots)
    x = some_states(prepared, layout, knots)
    seen = rows.linearise(x, 0, len(x))
    assert (
        len(seen.residual)
        == np.isfinite(prepared.events.value_m).sum() + np.isfinite(prepared.events.bearing_rad).sum()
    )
    for row in range(0, len(seen.residual), max(1, len(seen.residual) // 60)):
        number, knot = int(rows.event[row]), int(rows.knot[row])
        values = [column[number] for column in prepared.events]
        event = MeasurementEvent(*values, number)  # type: ignore[arg-type]
        own, vehicle = knots.own_s[knot, event.receiver], prepared.vehicles[event.receiver]
        here = vehicle.step(x[knot, layout.of(event.receiver)], own, event.time_s)[0]
        late = 0.0 if what != "robots" else here[list(vehicle.states).index("lag_s")]
        source_m, clock = None, 0.0
        if event.kind == PEER:
            peer = prepared.vehicles[event.source]
            there = peer.step(x[knot, layout.of(event.source)], knots.own_s[knot, event.source], event.time_s)[0]
            source_m = peer.place(there, event.time_s)[0]
            if late:  # where it was when it was seen
                source_m = peer.place(peer.step(there, event.time_s, event.time_s - late)[0], event.time_s)[0]
            clock = float(there[peer.clock]) if peer.clock >= 0 else 0.0
        elif event.kind == POINT and layout.points[event.source] >= 0:
            at = layout.points[event.source]
            source_m = event.place_m - prepared.points.axes[event.source] @ x[knot, at : at + 2]
        expected = rows_of(event, vehicle, here, source_m, clock)[1 if rows.is_bearing[row] else 0].innovation
        if layout.pairs and not rows.is_bearing[row]:
            expected -= x[knot, rows.columns[row, -1]]
        near = 3e-3 if late else 1e-3 if event.kind == HEIGHT else ROUNDING_M  # a late peer turns while it was late
        assert seen.residual[row] == pytest.approx(expected, abs=near), (event.kind, rows.is_bearing[row])


@pytest.mark.parametrize("what", ["local", "global", "robots"])
def test_derivatives_of_the_rows_against_central_differences(what: str) -> None:
    prepared, settings = robots() if what == "robots" else flown(LOCAL if what == "local" else GLOBAL)
    layout, knots = put(prepared, settings)
    rows = Rows(prepared, layout, knots)
    x = some_states(prepared, layout, knots)
    seen = rows.linearise(x, 0, len(x))
    dense = np.zeros((len(seen.residual), layout.size + 1))
    np.put_along_axis(dense, rows.columns, seen.values, axis=1)
    for state in range(layout.size):
        step = np.zeros(layout.size)
        step[state] = 1e-5 if what == "robots" else 1.0 / max(np.abs(dense[:, state]).max(), 1e-3)  # a metre
        ends = [rows.linearise(x + sign * step, 0, len(x)).residual for sign in (1.0, -1.0)]
        numeric = (ends[1] - ends[0]) / (2.0 * step[state])
        scale = max(1.0, float(np.abs(numeric).max()))
        assert dense[:, state] / scale == pytest.approx(numeric / scale, abs=2e-4), state


@pytest.mark.parametrize("rows_of_a_knot", [2, 9], ids=["fewer rows than states", "more rows than states"])
def test_chain_is_the_dense_solution(monkeypatch: pytest.MonkeyPatch, rows_of_a_knot: int) -> None:
    """Against all unknowns stacked, with states without noise and a constant; in pieces and as a whole."""
    rng = np.random.default_rng(2)
    t, v, n = 6, 2, 3
    size = v * n + 1
    phi = np.eye(n) + 0.2 * rng.standard_normal((t - 1, v, n, n))
    noise = np.zeros((t - 1, v, n, n))
    noise[..., 0, 0], noise[..., 1, 1] = 0.5, 0.2  # the third has none
    first = np.arange(t + 1) * rows_of_a_knot
    many = int(first[-1])
    columns = np.array([rng.permutation(size)[:3] for _ in range(many)])
    columns[::4, 2] = size  # no state
    values = rng.standard_normal((many, 3))
    problem = Problem(
        [slice(0, v * n)],
        [phi],
        [noise],
        0.3 * rng.standard_normal((t - 1, size)) * np.append(np.ones(v * n), 0.0),
        rng.standard_normal(size),
        np.linspace(0.5, 2.0, size),
        first,
        columns,
        values,
        rng.standard_normal(many),
        0.5 + rng.random(many),
    )
    F = np.zeros((t, size, size))
    for k in range(1, t):
        F[k, -1, -1] = 1.0
        for i in range(v):
            F[k, n * i : n * i + n, n * i : n * i + n] = phi[k - 1, i]
    mean, P = np.zeros((t, size)), np.zeros((t, size, t, size))  # prior of all knots
    mean[0], P[0, :, 0] = problem.start, np.diag(problem.variance)
    for k in range(1, t):
        mean[k] = F[k] @ mean[k - 1] + problem.defect[k - 1]
        P[k] = np.einsum("ij,jtm->itm", F[k], P[k - 1])
        P[:, :, k] = np.einsum("tmj,ij->tmi", P[:, :, k - 1], F[k])
        P[k, :, k] = F[k] @ P[k - 1, :, k - 1] @ F[k].T
        for i in range(v):
            P[k, n * i : n * i + n, k, n * i : n * i + n] += noise[k - 1, i]
    H = np.zeros((many, t, size + 1))
    for row in range(many):
        H[row, row // rows_of_a_knot, columns[row]] = values[row]
    H = H[:, :, :size].reshape(many, -1)
    whole = P.reshape(t * size, -1)
    gain = whole @ H.T @ np.linalg.inv(H @ whole @ H.T + np.diag(1.0 / problem.weight))
    expected = mean.ravel() + gain @ (problem.residual - H @ mean.ravel())
    after = (whole - gain @ H @ whole).reshape(t, size, t, size)
    for kept in (1e9, 1.0):
        monkeypatch.setattr("groundstation.systems.cooperative.smoother.chain.KEPT_BYTES", kept)
        chain = Chain(problem)
        step, _ = chain.solve()
        assert step.ravel() == pytest.approx(expected, abs=1e-9)
        for knot, covariance, _, behind in chain.covariances():
            assert block(covariance, behind, slice(0, size)) == pytest.approx(after[knot, :, knot], abs=1e-9)


def test_without_errors_the_answer_is_right_to_rounding() -> None:
    for scenario in (LOCAL, GLOBAL):
        short = replace(scenario, duration_s=20.0)
        simulated = simulate_session(short, 1, scale=0.0)
        run = run_smoothed(prepare(simulated.session, believed(short)), believed(short))
        for track, truth in zip(run.tracks, simulated.truth, strict=True):
            assert track.position_m == pytest.approx(truth.position_m, abs=ROUNDING_M)


def test_nees_of_all_states_and_gain_over_the_start() -> None:
    """In the middle and at the end: of a smoother both are right, and the start is known as well as the end."""
    middle, end, square = [], [], []
    for seed in SEEDS:
        simulated = simulate_session(LOCAL, seed)
        found = smooth(prepare(simulated.session, believed(LOCAL)), believed(LOCAL))
        assert found.has_settled and not found.run.counts.get("gated")
        for track, truth in zip(found.run.tracks, simulated.truth, strict=True):
            middle.append(full_nees(track.state, track.covariance, truth, 30))
            end.append(full_nees(track.state, track.covariance, truth))
            square.append(((track.state[0, :2] - truth.states[0, :2]) ** 2).sum())
    assert NEES_LIMITS_7[0] < np.mean(middle) < NEES_LIMITS_7[1]
    assert NEES_LIMITS_7[0] < np.mean(end) < NEES_LIMITS_7[1]
    assert np.sqrt(np.mean(square)) < 30.0  # 424 m before any range


def test_wrong_ranges_hardly_move_the_answer() -> None:
    wild = replace(LOCAL, link=replace(LOCAL.link, outlier_share=0.05, outlier_m=2e4))
    errors = []
    for scenario in (LOCAL, wild):
        simulated = simulate_session(scenario, 4)
        run = run_smoothed(prepare(simulated.session, believed(LOCAL)), believed(LOCAL))
        errors.append(
            max(
                float(np.abs(t.state[-1, :2] - e.states[-1, :2]).max())
                for t, e in zip(run.tracks, simulated.truth, strict=True)
            )
        )
        assert (run.counts.get("gated", 0) > 20) == (scenario is wild)
    assert errors[1] < errors[0] + 15.0


def test_a_leap_of_a_clock_is_found_where_it_was() -> None:
    simulated = simulate_session(LOCAL, 6)
    ranges = simulated.session.ranges
    late = (ranges.receiver == "B") & (ranges.time_s > 30.0)
    heard = (ranges.source == "B") & (ranges.time_s > 30.0)
    value = ranges.pseudorange_m + 3e4 * late - 3e4 * heard
    leapt = replace(simulated.session, ranges=replace(ranges, pseudorange_m=value))
    run = run_smoothed(prepare(leapt, believed(LOCAL)), believed(LOCAL))
    assert run.counts["clock_leaps"] >= 1 and run.counts.get("gated", 0) < 0.05 * len(ranges)
    for track, truth in zip(run.tracks, simulated.truth, strict=True):
        error = np.linalg.norm(
            track.state[:, :2] - truth.states[np.searchsorted(truth.time_s, track.time_s - 1e-6), :2], axis=1
        )
        assert (error < 1.5 * track.two_sigma_r_m + 5.0).all()


def test_an_uncertain_point_is_estimated_with_its_sigma() -> None:
    """Two surveyed points and the session tell where the third one stands."""
    third = replace(LOCAL.points[0], name="N3", north_m=-60_000.0, east_m=40_000.0, position_sigma_m=200.0)
    scenario = replace(LOCAL, points=(*LOCAL.points, third), duration_s=120.0)
    ratios = []
    for seed in SEEDS[:12]:
        simulated = simulate_session(scenario, seed)
        (found,) = smooth(prepare(simulated.session, believed(scenario)), believed(scenario)).points
        error = found.error_m - np.array(simulated.point_errors_m["N3"][:2])
        ratios.append(float(error @ np.linalg.solve(found.covariance_m2, error)))
        assert np.sqrt(np.trace(found.covariance_m2)) < 100.0
    assert 0.8 < np.mean(ratios) < 3.9  # chi-square of 2 x 12: 99.8 % within


def test_pair_biases_are_found() -> None:
    """Two-way ranges, those between A and B 40 m too long: with a state for it the answer is that without the error."""
    simulated = simulate_session(LOCAL, 9)
    ranges = simulated.session.ranges
    both = np.isin(ranges.receiver, ("A", "B")) & np.isin(ranges.source, ("A", "B"))
    wrong = replace(simulated.session, ranges=replace(ranges, pseudorange_m=ranges.pseudorange_m + 40.0 * both))
    settings = believed(LOCAL, smoother=SmootherSettings(pair_bias_m=50.0))
    run = run_smoothed(prepare(wrong, settings), settings)
    for track, truth in zip(run.tracks, simulated.truth, strict=True):
        assert np.linalg.norm(track.state[-1, :2] - truth.states[-1, :2]) < 2.0 * track.two_sigma_r_m[-1]


def test_correlated_readings_count_for_less() -> None:
    """Errors of every link follow a Gauss-Markov process of 5 s: the residuals show it, the sigma follows."""
    scenario = replace(LOCAL, link=replace(LOCAL.link, range_sigma_m=0.1))
    simulated = simulate_session(scenario, 11)
    ranges, rng = simulated.session.ranges, np.random.default_rng(12)
    noise = {"white": rng.standard_normal(len(ranges)), "correlated": np.zeros(len(ranges))}
    link = np.char.add(ranges.receiver, ranges.source)
    for one in np.unique(link):
        mine = np.flatnonzero(link == one)
        value, last_s = rng.standard_normal(), ranges.time_s[mine[0]]
        for row in mine:
            kept = np.exp(-(ranges.time_s[row] - last_s) / 5.0)
            value, last_s = kept * value + np.sqrt(1.0 - kept**2) * rng.standard_normal(), ranges.time_s[row]
            noise["correlated"][row] = value
    sigma = {}
    for name, error in noise.items():
        table = replace(ranges, pseudorange_m=ranges.pseudorange_m + 10.0 * error, sigma_m=np.full(len(ranges), 10.0))
        run = run_smoothed(prepare(replace(simulated.session, ranges=table), believed(LOCAL)), believed(LOCAL))
        sigma[name] = float(run.tracks[0].two_sigma_r_m[-1])
    assert sigma["correlated"] > 1.5 * sigma["white"]


def test_weights_of_cauchy() -> None:
    assert cauchy(np.array([0.0, 2.0]), 2.0).tolist() == [1.0, 0.5]
    u = np.random.default_rng(1).standard_normal(200_000)
    weight = cauchy(u, 2.385)
    spread = np.mean((weight * u) ** 2) / np.mean(2.0 * weight**2 - weight) ** 2  # of the location of many
    assert weight.mean() * honest_factor(2.385) == pytest.approx(1.0 / spread, rel=0.01)


def test_a_session_of_one_reading_and_of_none() -> None:
    session = simulate_session(LOCAL, 1).session
    for rows in (0, 1):
        few = replace(session, ranges=session.ranges.take(slice(0, rows)))
        run = run_smoothed(prepare(few, believed(LOCAL)), believed(LOCAL))
        assert all(np.isfinite(track.covariance).all() for track in run.tracks)
        alone_m = 2.0 * np.sqrt(2.0) * 300.0
        assert (0.6 * alone_m if rows else 0.999 * alone_m) < run.tracks[0].two_sigma_r_m[0] < 1.001 * alone_m
