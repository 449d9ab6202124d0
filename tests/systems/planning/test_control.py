"""Laws of control: exact gradients, the optimum against a general optimiser, the filter's own covariance, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import LinearConstraint, minimize

from groundstation.base.errors import GroundstationError
from groundstation.systems.cooperative.aircraft import aircraft_of
from groundstation.systems.cooperative.settings import CooperativeSettings, InsBelief
from groundstation.systems.planning.session.accuracy import AccuracyModel
from groundstation.systems.planning.session.answer import UNCONTROLLED, ControlPlan
from groundstation.systems.planning.session.descent import nearest_law
from groundstation.systems.planning.session.laws import Law, PlannedSession, StepMeasure, integral_law, local_law
from groundstation.systems.planning.session.measures import geometry_of
from groundstation.systems.planning.session.plan import plan_session
from groundstation.systems.planning.session.scenario import (
    LOCAL_CRITERIA,
    Axis,
    Control,
    LocalCriterion,
    PlannedAircraft,
    PlannedErrors,
    PlannedPoint,
    Ranging,
    SessionPlan,
)
from groundstation.tables.session import DeadReckoning

FloatArray = NDArray[np.float64]
SLOPE_TOLERANCE = 1e-5  # of the largest: central differences of 1e-3 m/s lose the rest to rounding
SAME_OPTIMUM = 1e-3  # of the loss: the gap at which a descent stops
USER = PlannedAircraft(
    *("user", 0.0, 0.0, 8000.0, 220.0, 20.0),
    control=("speed", "heading"),
    speed_low_mps=180.0,
    speed_high_mps=260.0,
    heading_swing_deg=50.0,
)
NEIGHBOURS = (
    PlannedAircraft("A", 9000.0, 3000.0, 7500.0, 200.0, 10.0, is_exact=True),
    PlannedAircraft("B", -4000.0, 7000.0, 9000.0, 240.0, -30.0, 3.0, control=("speed",)),
)
POINTS = (PlannedPoint("P", 20_000.0, -6000.0, 100.0), PlannedPoint("Q", -8000.0, 15_000.0, 700.0))


def mixed(**changes: object) -> SessionPlan:
    """One exact aircraft, one that is estimated too and may change its speed, two points."""
    plan = SessionPlan("mixed", (USER, *NEIGHBOURS), POINTS, duration_s=12.0, step_s=1.0)
    return replace(plan, **changes)  # type: ignore[arg-type]


def answer_of(plan: SessionPlan) -> ControlPlan:
    answer = plan_session(plan).answers["control"]
    assert isinstance(answer, ControlPlan)
    return answer


def wandering(session: PlannedSession, seed: int = 3) -> FloatArray:
    """Controls off the straight way, inside their bounds."""
    noise = np.random.default_rng(seed).normal(0.0, 1.0, session.motion.shape)
    return session.project(session.motion.uncontrolled + np.cumsum(noise, axis=1))


def differences(measure: object, at: FloatArray, step: float = 1e-3) -> FloatArray:
    found = np.zeros(at.shape)
    for place in np.ndindex(at.shape):
        moved = np.zeros(at.shape)
        moved[place] = step
        found[place] = (measure(at + moved)[0] - measure(at - moved)[0]) / (2.0 * step)  # type: ignore[operator]
    return found


def assert_slopes_agree(exact: FloatArray, numeric: FloatArray) -> None:
    assert np.abs(numeric).max() > 0.0
    assert np.abs(exact - numeric).max() <= SLOPE_TOLERANCE * np.abs(numeric).max()


@pytest.mark.parametrize("is_two_way", [False, True])
@pytest.mark.parametrize("weight_up", [0.0, 2.0])
def test_the_gradient_of_the_variance_is_exact(is_two_way: bool, weight_up: float) -> None:
    ranging = Ranging(10.0, is_two_way=is_two_way)
    session = PlannedSession(mixed(ranging=ranging, control=Control(weight_east=3.0, weight_up=weight_up)))
    at = wandering(session)
    _, slope = session.variance(at)
    assert slope.shape == (3, 12)
    assert_slopes_agree(slope, differences(session.variance, at))


@pytest.mark.parametrize("criterion", LOCAL_CRITERIA)
@pytest.mark.parametrize("axes", [("north", "east"), ("north", "east", "up"), ("north", "east", "up", "clock")])
def test_the_gradient_of_every_measure_is_exact(criterion: LocalCriterion, axes: tuple[Axis, ...]) -> None:
    session = PlannedSession(mixed(control=Control(axes=axes)))
    at = wandering(session)
    one_step = StepMeasure(session, criterion, at, 7)
    _, slope = one_step(at[:, 7])
    assert_slopes_agree(slope, differences(one_step, at[:, 7]))


def test_the_gradient_with_the_separation_is_exact() -> None:
    session = PlannedSession(mixed(separation_m=9000.0))
    at = wandering(session)
    assert session.crowding(session.motion.paths(at).position_m)[0] > 1.0

    def crowded(controls: FloatArray) -> tuple[float, FloatArray]:
        return session.variance(controls, 100.0)

    assert_slopes_agree(crowded(at)[1], differences(crowded, at))
    one_step = StepMeasure(session, "dop", at, 7)
    assert_slopes_agree(one_step(at[:, 7])[1], differences(one_step, at[:, 7]))


@pytest.mark.slow
def test_laws_keep_the_separation_that_they_would_break_without_it() -> None:
    """A single source ahead: the nearer one passes it, the faster its direction turns."""
    ahead = PlannedAircraft("A", 3000.0, 400.0, 8000.0, 200.0, 0.0, is_exact=True)
    user, far = replace(USER, track_deg=0.0), PlannedPoint("P", 60_000.0, 2000.0, 100.0)
    free = SessionPlan(
        *("close", (user, ahead), (far,)), duration_s=40.0, step_s=5.0, separation_m=0.0, control=Control(starts=0)
    )
    apart = answer_of(replace(free, separation_m=2900.0)).law("covariance")
    near = answer_of(free).law("covariance")
    assert near.least_separation_m is not None and near.least_separation_m < 2700.0
    assert apart.least_separation_m == pytest.approx(2900.0, rel=1e-3)
    assert near.two_sigma_r_m < apart.two_sigma_r_m < answer_of(free).law(UNCONTROLLED).two_sigma_r_m


def test_the_covariance_is_that_of_the_textbook() -> None:
    session = PlannedSession(mixed())
    positions = session.motion.paths(wandering(session)).position_m
    found = session.model.accuracy(positions).covariance
    F, Q, P = _models(session.plan)
    assert found[0] == pytest.approx(P)
    for epoch in range(1, 13):
        rows = []
        for receiver, first in ((0, 0), (2, 7)):
            for source in (one for one in range(5) if one != receiver):
                line = positions[epoch, receiver] - positions[epoch, source]
                row = np.zeros(14)
                row[[first, first + 1, first + 4]] = line / np.linalg.norm(line)
                row[first + 5] = 1.0
                if source in (0, 2):
                    other = 0 if source == 0 else 7
                    row[[other, other + 1, other + 4]] = -line / np.linalg.norm(line)
                    row[other + 5] = -1.0
                rows.append(row)
        H = np.array(rows)
        P = np.linalg.inv(np.linalg.inv(F @ P @ F.T + Q) + H.T @ H / 100.0)
        assert found[epoch] == pytest.approx(P, rel=1e-6, abs=1e-6)


def _models(plan: SessionPlan) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Transition, noise and start of two aircraft by matrix exponentials (Van Loan)."""
    errors = plan.aircraft[0].errors
    rates = np.zeros((7, 7))
    rates[0, 2] = rates[1, 3] = rates[5, 6] = 1.0
    driven = {
        2: (errors.velocity_mps, errors.velocity_s),
        3: (errors.velocity_mps, errors.velocity_s),
        4: (errors.baro_m, errors.baro_s),
        6: (errors.clock_mps, errors.clock_s),
    }
    density = np.zeros((7, 7))
    for state, (sigma, time_s) in driven.items():
        rates[state, state], density[state, state] = -1.0 / time_s, 2.0 * sigma**2 / time_s
    both = expm(np.block([[-rates, density], [np.zeros((7, 7)), rates.T]]) * plan.step_s)
    F = both[7:, 7:].T
    sigmas = [errors.position_m, errors.position_m, errors.velocity_mps, errors.velocity_mps, errors.baro_m]
    start = np.diag(np.square([*sigmas, errors.clock_m, errors.clock_mps]))
    twice = np.eye(2)
    return np.kron(twice, F), np.kron(twice, F @ both[:7, 7:]), np.kron(twice, start)


def test_an_aircraft_has_the_errors_of_the_cooperative_filter() -> None:
    belief = InsBelief(position_m=120.0, velocity_mps=0.4, velocity_s=300.0, baro_m=15.0, clock_m=20.0, clock_mps=1.0)
    names = ("position_m", "velocity_mps", "velocity_s", "baro_m", "baro_s", "clock_m", "clock_mps", "clock_s")
    errors = PlannedErrors(**{name: getattr(belief, name) for name in names})
    model = AccuracyModel(SessionPlan("one", (replace(USER, errors=errors),), POINTS, duration_s=4.0, step_s=2.0))
    time_s = np.array([0.0, 2.0, 4.0])
    track = DeadReckoning(
        "user", time_s, np.zeros((3, 3)), np.zeros((3, 3)), np.tile(np.eye(3), (3, 1, 1)), *np.full((2, 3), np.nan)
    )
    vehicle = aircraft_of(track, "local", CooperativeSettings(ins=belief))
    x, P = vehicle.start()
    _, transition, noise = vehicle.step(x, 0.0, 2.0)
    still = np.tile([[0.0, 0.0, 1000.0], [1e6, 0.0, 0.0], [0.0, 1e6, 0.0]], (3, 1, 1))
    blind = AccuracyModel(replace(model.plan, ranging=Ranging(1e5, 600.0)))
    assert model.dynamics == pytest.approx(transition, rel=1e-12)
    assert blind.accuracy(still).covariance[0] == pytest.approx(P)
    predicted = transition @ P @ transition.T + noise
    assert blind.accuracy(still).covariance[1] == pytest.approx(predicted, rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("seed", range(40))
def test_the_nearest_law_is_the_least_squares_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    steps, change = int(rng.integers(1, 12)), float(rng.uniform(0.05, 1.0))
    start, wanted = float(rng.uniform(-1.0, 2.0)), rng.normal(0.0, 3.0, steps)
    found = nearest_law(wanted, start, -1.0, 2.0, change)
    first = np.zeros(steps)
    first[0] = start
    changes = LinearConstraint(np.eye(steps) - np.eye(steps, k=-1), first - change, first + change)
    oracle = minimize(
        lambda x: (0.5 * ((x - wanted) ** 2).sum(), x - wanted),
        np.full(steps, start),
        jac=True,
        method="SLSQP",
        bounds=[(-1.0, 2.0)] * steps,
        constraints=changes,
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert found == pytest.approx(oracle.x, abs=1e-6)


def test_the_optimum_is_that_of_a_general_optimiser() -> None:
    plan = mixed(duration_s=24.0, step_s=2.0, control=Control(iterations=500, tolerance=1e-5))
    session = PlannedSession(plan)
    law = integral_law(session, [session.motion.uncontrolled])
    assert law.has_converged and law.gap <= 1e-5
    count, steps = session.motion.shape
    changes = np.kron(np.eye(count), np.eye(steps) - np.eye(steps, k=-1))
    first = np.zeros((count, steps))
    first[:, 0] = [bound.start for bound in session.motion.bounds]
    most = np.repeat([bound.change for bound in session.motion.bounds], steps)

    def measure(flat: FloatArray) -> tuple[float, FloatArray]:
        value, slope = session.variance(flat.reshape(count, steps))
        return value, slope.ravel()

    oracle = minimize(
        measure,
        session.motion.uncontrolled.ravel(),
        jac=True,
        method="SLSQP",
        bounds=[(bound.low, bound.high) for bound in session.motion.bounds for _ in range(steps)],
        constraints=LinearConstraint(changes, first.ravel() - most, first.ravel() + most),
        options={"ftol": 1e-10, "maxiter": 500},
    )
    ours, theirs = session.variance(law.controls)[0], float(oracle.fun)
    assert ours <= theirs * (1.0 + SAME_OPTIMUM)
    assert ours < 0.9 * session.variance(session.motion.uncontrolled)[0]


@pytest.mark.parametrize("criterion", LOCAL_CRITERIA)
def test_a_local_law_is_the_best_of_what_each_step_reaches(criterion: LocalCriterion) -> None:
    plan = mixed(aircraft=(replace(USER, control=("heading",)), *(replace(one, control=()) for one in NEIGHBOURS)))
    session = PlannedSession(plan)
    law = local_law(session, criterion)
    (bound,) = session.motion.bounds
    before = bound.start
    for step in range(plan.steps):
        reach = np.clip(np.linspace(before - bound.change, before + bound.change, 81), bound.low, bound.high)
        one_step = StepMeasure(session, criterion, law.controls, step)
        least = min(one_step(np.array([value]))[0] for value in reach)
        assert one_step(law.controls[:, step])[0] <= least + 1e-9 * abs(least)
        before = float(law.controls[0, step])


def test_laws_keep_their_bounds() -> None:
    session = PlannedSession(mixed())
    for law in (local_law(session, "determinant"), integral_law(session, [session.motion.uncontrolled])):
        for bound, values in zip(session.motion.bounds, law.controls, strict=True):
            room = 1e-9 * bound.scale
            assert values.min() >= bound.low - room and values.max() <= bound.high + room
            assert np.abs(np.diff(values, prepend=bound.start)).max() <= bound.change + room


def test_the_determinant_of_two_ranges_is_the_squared_sine_of_their_angle() -> None:
    angle = np.deg2rad(35.0)
    directions = np.array([[[1.0, 0.0, 0.0], [np.cos(angle), np.sin(angle), 0.0]]])
    found = geometry_of(directions, ("north", "east"))
    assert found.determinant[0] == pytest.approx(np.sin(angle) ** 2)
    assert found.least_eigenvalue[0] == pytest.approx(1.0 - np.cos(angle))
    assert found.dilution()[0] == pytest.approx(np.sqrt(2.0) / np.sin(angle))


def turned(plan: SessionPlan, angle_deg: float) -> SessionPlan:
    angle = np.deg2rad(angle_deg)

    def moved(one: PlannedAircraft | PlannedPoint) -> dict[str, float]:
        north = one.north_m * np.cos(angle) - one.east_m * np.sin(angle)
        return {"north_m": float(north), "east_m": float(one.north_m * np.sin(angle) + one.east_m * np.cos(angle))}

    return replace(
        plan,
        aircraft=tuple(replace(one, **moved(one), track_deg=one.track_deg + angle_deg) for one in plan.aircraft),
        points=tuple(replace(point, **moved(point)) for point in plan.points),
    )


def test_a_turned_world_and_another_order_change_nothing() -> None:
    plan = mixed(control=Control(starts=0))
    mine = answer_of(plan)
    around, shuffled = (
        answer_of(turned(plan, 137.0)),
        answer_of(replace(plan, aircraft=plan.aircraft[::-1], judged="user")),
    )
    for other in (around, shuffled):
        assert [row.law for row in other.laws] == [row.law for row in mine.laws]
        for row, same in zip(mine.laws, other.laws, strict=True):
            assert same.two_sigma_r_m == pytest.approx(row.two_sigma_r_m, rel=SAME_OPTIMUM)
            assert same.determinant == pytest.approx(row.determinant, rel=0.05)


def test_control_improves_what_it_is_asked_for() -> None:
    answer = answer_of(mixed())
    laws = {row.law: row for row in answer.laws}
    assert list(laws) == [UNCONTROLLED, *LOCAL_CRITERIA, "covariance"]
    least = laws["covariance"].two_sigma_r_m
    assert all(least <= row.two_sigma_r_m * (1.0 + 1e-6) for row in laws.values())
    assert laws["determinant"].determinant > laws[UNCONTROLLED].determinant
    assert laws["eigenvalue"].eigenvalue > laws[UNCONTROLLED].eigenvalue
    assert laws["dop"].dop < laws[UNCONTROLLED].dop
    assert answer.gain == pytest.approx(laws[UNCONTROLLED].two_sigma_r_m / least)


def codes(plan: SessionPlan) -> set[str]:
    return {finding.code for finding in plan_session(plan).findings}


def test_nothing_controlled_is_the_accuracy_as_it_flies() -> None:
    plan = mixed(aircraft=tuple(replace(one, control=()) for one in (USER, *NEIGHBOURS)))
    assert answer_of(plan).recommended == UNCONTROLLED and answer_of(plan).gain == 1.0
    assert codes(plan) == {"control.nothing_controlled"}


def test_a_control_without_room_gains_nothing_and_says_so() -> None:
    held = replace(USER, control=("speed",), acceleration_mps2=0.0)
    plan = mixed(aircraft=(held, NEIGHBOURS[0]))
    assert answer_of(plan).gain == pytest.approx(1.0)
    assert "control.no_gain" in codes(plan)


def test_sources_on_one_line_are_told() -> None:
    ahead = tuple(PlannedPoint(name, distance, 0.0, 8000.0) for name, distance in (("P", 3e4), ("Q", 5e4)))
    straight = replace(USER, track_deg=0.0, control=("speed",))
    plan = mixed(aircraft=(straight,), points=ahead)
    answer = answer_of(plan)
    assert "control.singular" in codes(plan)
    assert np.isnan(answer.law("dop").dop) and answer.law("dop").determinant == pytest.approx(0.0, abs=1e-12)
    assert not answer.law("dop").has_converged


def test_a_way_through_a_source_is_refused_in_a_line() -> None:
    plan = mixed(aircraft=(replace(USER, track_deg=0.0),), points=(PlannedPoint("P", 2200.0, 0.0, 8000.0), POINTS[1]))
    with pytest.raises(GroundstationError, match="from P at 10 s"):
        plan_session(plan)


def test_a_law_never_leads_through_a_source() -> None:
    near = (PlannedPoint("P", 2200.0, 30.0, 8000.0), PlannedPoint("Q", 2200.0, -9000.0, 8000.0))
    plan = mixed(aircraft=(replace(USER, track_deg=0.0),), points=near)
    assert min(row.least_range_m for row in answer_of(plan).laws) >= 1.0


def test_a_descent_that_is_stopped_says_so() -> None:
    plan = mixed(control=Control(starts=0, iterations=1, tolerance=1e-9))
    assert not answer_of(plan).law("covariance").has_converged
    assert "control.not_converged" in codes(plan)


def test_aircraft_that_come_near_are_a_warning() -> None:
    plan = mixed(separation_m=1e5)
    assert "control.separation" in codes(plan)


def test_a_law_is_a_value() -> None:
    law = Law(np.zeros((1, 3)))
    with pytest.raises(ValueError, match="read-only"):
        law.controls[0, 0] = 1.0
