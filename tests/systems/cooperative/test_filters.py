"""Navigation between aircraft: models, measurements, filters."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.stats import chi2

from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import SessionScenario, load_session
from groundstation.systems.cooperative.aircraft import Aircraft, aircraft_of
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.estimate import estimate_session
from groundstation.systems.cooperative.events import Prepared, prepare
from groundstation.systems.cooperative.filters.centralised import is_about_reckoning
from groundstation.systems.cooperative.filters.decentralised import Decentralised
from groundstation.systems.cooperative.filters.observation import rows_of
from groundstation.systems.cooperative.filters.sights import Sights
from groundstation.systems.cooperative.filters.steps import MeasurementEvent
from groundstation.systems.cooperative.loop_types import KINDS, PEER, Events
from groundstation.systems.cooperative.messages import Broadcast, decode, pairwise_bytes, report_bytes
from groundstation.systems.cooperative.settings import (
    ALGORITHMS,
    CameraBelief,
    CooperativeSettings,
    InsBelief,
    OdometryBelief,
)
from groundstation.systems.cooperative.tracks import AlgorithmRun
from groundstation.systems.cooperative.wheeled_vehicle import WheeledVehicle
from groundstation.tables.session import NO_SLOT, DeadReckoning, GroundPoint, Heights, Odometry, Ranges, Session
from tests.systems.cooperative import plain
from tests.systems.cooperative.example import GLOBAL, LOCAL, believed, full_nees, truth_of

SEEDS = range(7000, 7024)  # written down before the first run; no other is used here
TAIL = 0.0005  # either side: seven tests of this kind fail by chance once in a hundred and fifty suites
BRIEF = replace(LOCAL, duration_s=20.0)  # every algorithm hears every neighbour and point many times
PLAIN_S = 15.0  # of a flight that is flown in the plain filters too
ROUNDING_M = 1e-6  # of positions of 6e6 m, through subtractions
ROUNDING_SIGMAS = 1e-5  # rounding the measurements alone moves a plain filter that trusts its neighbours by 1.4e-6


def test_transition_against_the_matrix_exponential() -> None:
    """Local frame: x, y, vx, vy, height, clock offset, clock frequency."""
    belief = InsBelief(
        velocity_mps=10.0, velocity_s=100.0, baro_m=5.0, baro_s=50.0, clock_mps=np.sqrt(5.0), clock_s=20.0
    )
    track = simulate_session(LOCAL, 1).session.vehicles[0]
    vehicle = aircraft_of(track, "local", CooperativeSettings(ins=belief))
    F, q = np.zeros((7, 7)), np.array([0.0, 0.0, 2.0, 2.0, 1.0, 0.0, 0.5])
    F[0, 2] = F[1, 3] = F[5, 6] = 1.0
    F[2, 2] = F[3, 3] = -1.0 / 100.0
    F[4, 4], F[6, 6] = -1.0 / 50.0, -1.0 / 20.0
    for step_s in (0.1, 1.0, 7.0):
        both = np.zeros((14, 14))
        both[:7, :7], both[:7, 7:], both[7:, 7:] = -F, np.diag(q), F.T
        exact = expm(both * step_s)
        _, phi, noise = vehicle.step(np.zeros(7), 0.0, step_s)
        assert phi == pytest.approx(exact[7:, 7:].T, rel=1e-12, abs=1e-14)
        assert noise == pytest.approx(exact[7:, 7:].T @ exact[:7, 7:], rel=1e-9, abs=1e-13)
    shortest = aircraft_of(track, "local", CooperativeSettings(ins=belief)).step(np.zeros(7), 0.0, 5e-13)[1]
    assert shortest == pytest.approx(np.eye(7), abs=1e-12)  # as the first step of all, too
    forth, back = vehicle.step(np.zeros(7), 0.0, 2.0)[1], vehicle.step(np.zeros(7), 2.0, 0.0)[1]
    assert forth @ back == pytest.approx(np.eye(7), abs=1e-13)


def test_global_transition_is_that_of_the_error_propagation_of_the_simulation() -> None:
    """Two independent writings of the same physics: the simulation's Runge-Kutta and the filter's matrices."""
    errors = replace(GLOBAL.errors, gyro_s=1e12, clock_s=1e12, baro_s=1e12)
    scenario = replace(GLOBAL, errors=errors, duration_s=240.0)
    simulated = simulate_session(scenario, 3)
    exact = simulate_session(scenario, 3, scale=0.0)  # dead reckoning without errors: the matrices along the truth
    settings = believed(scenario)
    for track, truth in list(zip(exact.session.vehicles, simulated.truth, strict=True))[:2]:
        assert isinstance(track, DeadReckoning)
        end = aircraft_of(track, "ecef", settings).step(truth.states[0], 0.0, 240.0)[0]
        grown = truth.states[-1] - truth.states[0]
        assert end[:2] == pytest.approx(truth.states[-1, :2], abs=2e-3 * float(np.abs(grown[:2]).max()))
        assert end[2:4] == pytest.approx(truth.states[-1, 2:4], abs=2e-3 * float(np.abs(grown[2:4]).max()))
        assert end[4:7] == pytest.approx(truth.states[-1, 4:7], abs=1e-7)


def inertial(frame: str) -> Aircraft:
    scenario = GLOBAL if frame == "ecef" else LOCAL
    track = simulate_session(scenario, 1).session.vehicles[1]
    assert isinstance(track, DeadReckoning)
    return aircraft_of(track, scenario.frame, believed(scenario, range_bias_m=5.0, lever_arm_m=3.0))


def wheeled() -> WheeledVehicle:
    time_s = np.arange(5.0)
    track = Odometry("R", time_s, np.full(5, 0.4), np.full(5, 20.0), (1.0, 2.0), 30.0)
    belief = OdometryBelief(speed_scale=0.1, turn_scale=0.1)
    camera = CameraBelief(range_scale=0.1, marker_bias_m=0.1, mount_deg=3.0, lag_s=0.1)
    return WheeledVehicle(track, CooperativeSettings(odometry=belief, camera=camera, range_bias_m=0.1))


ARM_M = np.array([30.0, -20.0, 5.0])


def lines_of(
    kind: int, vehicle: Aircraft | WheeledVehicle, x: np.ndarray, source: np.ndarray, clock: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Innovations of one range of 10 km about a state at 2.5 s, and derivatives by state, place and clock."""
    values = (2.5, kind, 0, 1, 1e4, 100.0, 0, source, np.nan, np.nan, False, ARM_M, 1.0)
    if isinstance(vehicle, WheeledVehicle):  # sees a bearing too
        event = MeasurementEvent(*values[:8], 0.3, 1e-4, False, 1e-3 * ARM_M, 1.0, 0)
        rows = rows_of(event, vehicle, x, source, clock)
        names = ("innovation", "receiver", "place", "clock")
        return tuple(np.array([getattr(row, name) for row in rows]) for name in names)
    sight = Sights((vehicle,), Events(*(np.array([value]) for value in (*values[:3], -1, *values[4:])))).receiver(0)
    assert sight is not None
    event = MeasurementEvent(*values, 0)
    rows = rows_of(event, vehicle, x, source, clock, sight=sight)
    unseen = rows_of(event, vehicle, x, source, clock)  # asks the vehicle
    assert rows[0].innovation == pytest.approx(unseen[0].innovation, abs=1e-9)
    names = ("innovation", "receiver", "place", "clock")
    return tuple(np.array([getattr(row, name) for row in rows]) for name in names)


@pytest.mark.parametrize("kind", [*KINDS, "bearing"])
def test_derivatives_against_central_differences(kind: str) -> None:
    is_bearing = kind == "bearing"
    vehicle = wheeled() if is_bearing else inertial("ecef" if kind in ("satellite", "peer") else "local")
    rng = np.random.default_rng(4)
    x = vehicle.start()[0] + 0.1 * rng.standard_normal(vehicle.size)
    at, _ = vehicle.place(x, 2.5)
    scale = 2e7 if kind == "satellite" else 4.0 if is_bearing else 2e4
    source = at + scale * np.array([0.5, -0.8, 0.0 if is_bearing else 0.3])
    number, step = PEER if is_bearing else KINDS.index(kind), 1e-3 if is_bearing else 1.0
    innovation, by_state, by_place, by_clock = lines_of(number, vehicle, x, source, 7.0)
    assert len(innovation) == (2 if is_bearing else 1)

    def numeric(dx: np.ndarray | float = 0.0, moved: np.ndarray | float = 0.0) -> np.ndarray:
        ends = [lines_of(number, vehicle, x + sign * dx, source + sign * moved, 7.0)[0].copy() for sign in (1.0, -1.0)]
        return (ends[1] - ends[0]) / (2.0 * step)

    for state, name in enumerate(vehicle.states):
        assert numeric(step * np.eye(vehicle.size)[state]) == pytest.approx(by_state[:, state], abs=2e-5), name
    if kind in ("peer", "bearing"):
        for axis in range(3):
            assert numeric(moved=step * np.eye(3)[axis]) == pytest.approx(by_place[:, axis], abs=1e-5)
        change = innovation - lines_of(number, vehicle, x, source, 8.0)[0]
        assert change == pytest.approx(by_clock, abs=1e-9)


UNSURE = replace(LOCAL, duration_s=30.0, points=(replace(LOCAL.points[0], position_sigma_m=200.0), LOCAL.points[1]))
WILD = replace(LOCAL, duration_s=30.0, link=replace(LOCAL.link, outlier_share=0.05, outlier_m=2e4, lost_share=0.2))
APART = replace(GLOBAL, duration_s=15.0, errors=replace(GLOBAL.errors, has_separate_clocks=True))
PLAIN = {
    "local": (UNSURE, {}),
    "frame by frame": (UNSURE, {"update": "simultaneous", "frame_s": 1.5}),  # hears everybody more than once in one
    "wild": (
        WILD,
        {"range_bias_m": 5.0, "latency_slots": 3, "map_window_s": 0.0, "correlated_share": 0.6, "range_share": 1e-4},
    ),
    "global": (APART, {"lever_arm_m": 3.0, "map_window_s": 0.0}),
}


def in_plain(prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> AlgorithmRun:
    if algorithm == "centralised":
        return plain.run_centralised(prepared, settings)
    if algorithm == "pairwise":
        return plain.run_pairwise(prepared, settings)
    return plain.run_decentralised(prepared, settings, algorithm)


@pytest.mark.parametrize("algorithm", [name for name in ALGORITHMS if name not in ("dead_reckoning", "smoothed")])
@pytest.mark.parametrize("session", PLAIN)
def test_filters_are_the_plain_ones(session: str, algorithm: str) -> None:
    scenario, changes = PLAIN[session]
    scenario = replace(scenario, duration_s=min(scenario.duration_s, PLAIN_S))
    settings = believed(scenario, **changes)  # type: ignore[arg-type]
    flown = simulate_session(scenario, 5).session
    arms = 20.0 * np.random.default_rng(6).standard_normal((len(flown.ranges), 3))
    prepared = prepare(replace(flown, ranges=replace(flown.ranges, arm_m=arms)), settings)
    run = run_algorithm(prepared, settings, algorithm)
    expected = in_plain(prepared, settings, algorithm)
    for track, other in zip(run.tracks, expected.tracks, strict=True):
        sigma = np.sqrt(np.einsum("nii->ni", other.covariance))
        assert track.time_s == pytest.approx(other.time_s, abs=0.0)
        assert (track.state - other.state) / sigma == pytest.approx(np.zeros_like(sigma), abs=ROUNDING_SIGMAS)
        assert track.position_m == pytest.approx(other.position_m, abs=ROUNDING_SIGMAS * float(sigma[:, :2].max()))
        change = (track.covariance - other.covariance) / (sigma[:, :, None] * sigma[:, None, :])
        assert change == pytest.approx(np.zeros_like(change), abs=ROUNDING_SIGMAS)
    assert (run.judged.event == expected.judged.event).all() and (run.judged.mark == expected.judged.mark).all()
    change = (run.judged.innovation - expected.judged.innovation) / expected.judged.sigma
    assert change == pytest.approx(np.zeros_like(change), abs=ROUNDING_SIGMAS)
    assert run.judged.sigma == pytest.approx(expected.judged.sigma, rel=1e-6)
    assert run.map_radius == pytest.approx(expected.map_radius, rel=1e-6)
    assert (run.counts, run.messages, run.update) == (expected.counts, expected.messages, expected.update)


def test_motion_of_a_wheeled_vehicle_against_central_differences() -> None:
    vehicle = wheeled()
    x = np.array([1.0, 2.0, 0.5, 0.05, -0.03, 0.1, 0.02, 0.03, -0.01, 0.04])
    _, phi, noise = vehicle.step(x, 0.3, 3.6)
    assert np.linalg.eigvalsh(noise).min() > -1e-15
    for at in range(vehicle.size):
        step = np.zeros(vehicle.size)
        step[at] = 1e-5
        numeric = (vehicle.step(x + step, 0.3, 3.6)[0] - vehicle.step(x - step, 0.3, 3.6)[0]) / 2e-5
        assert phi[:, at] == pytest.approx(numeric, abs=1e-8)
    there, forth, _ = vehicle.step(x, 0.3, 3.6)
    again, back, _ = vehicle.step(there, 3.6, 0.3)
    assert again == pytest.approx(x, abs=1e-12) and back @ forth == pytest.approx(np.eye(vehicle.size), abs=1e-12)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("scenario", [LOCAL, GLOBAL], ids=["local", "global"])
def test_without_errors_every_algorithm_is_right_to_rounding(algorithm: str, scenario: object) -> None:
    short = replace(scenario, duration_s=10.0)  # type: ignore[type-var]
    simulated = simulate_session(short, 1, scale=0.0)
    prepared = prepare(simulated.session, believed(short))
    assert not prepared.findings
    run = run_algorithm(prepared, believed(short), algorithm)
    for track, truth in zip(run.tracks, simulated.truth, strict=True):
        assert track.position_m == pytest.approx(truth.position_m, abs=ROUNDING_M)
    assert not run.counts.get("gated")


def test_centralised_nees() -> None:
    """Fewer flights than in the slow test below."""
    short = replace(LOCAL, duration_s=20.0)
    check_nees(short, believed(short), "centralised", 7, SEEDS[:12])


def test_dead_reckoning_nees() -> None:
    check_nees(LOCAL, believed(LOCAL), "dead_reckoning", 7)


@pytest.mark.slow
def test_centralised_nees_of_more_sessions() -> None:
    check_nees(LOCAL, believed(LOCAL), "centralised", 7)
    check_nees(LOCAL, believed(LOCAL, update="simultaneous"), "centralised", 7)
    check_nees(replace(GLOBAL, duration_s=40.0), believed(GLOBAL), "centralised", 13)
    controller = replace(LOCAL, points=(replace(LOCAL.points[0], position_sigma_m=200.0),))
    check_nees(controller, believed(controller), "centralised", 7)
    separate = replace(GLOBAL, duration_s=20.0, errors=replace(GLOBAL.errors, has_separate_clocks=True))
    check_nees(separate, believed(separate), "centralised", 15)


def check_nees(
    scenario: SessionScenario,
    settings: CooperativeSettings,
    algorithm: str,
    states: int,
    seeds: range = SEEDS,
) -> None:
    """Aircraft A at the end of every run: independent draws, all states."""
    total = 0.0
    for seed in seeds:
        simulated = simulate_session(scenario, seed)
        run = run_algorithm(prepare(simulated.session, settings), settings, algorithm)
        total += full_nees(run.tracks[0].state, run.tracks[0].covariance, simulated.truth[0])
    low, high = chi2.ppf([TAIL, 1.0 - TAIL], states * len(seeds))
    assert low < total < high


def test_split_intersection_is_never_too_sure_where_the_exact_neighbour_is() -> None:
    alone = replace(LOCAL, points=(), duration_s=30.0)
    totals = {"split_intersection": 0.0, "neighbour_exact": 0.0}
    seeds = SEEDS[:12]
    for seed in seeds:
        simulated = simulate_session(alone, seed)
        for name in totals:
            run = run_algorithm(prepare(simulated.session, believed(alone)), believed(alone), name)
            error = run.tracks[0].state[-1, :2] - simulated.truth[0].states[-1, :2]
            totals[name] += float(error @ np.linalg.solve(run.tracks[0].horizontal_m2[-1], error))
    high = chi2.ppf(1.0 - TAIL, 2 * len(seeds))
    assert totals["split_intersection"] < high < totals["neighbour_exact"] / 10.0


def test_two_aircraft_pairwise_is_the_centralised_filter() -> None:
    """With two members, and nothing that one of them sees alone, nothing is approximated."""
    pair = replace(LOCAL, aircraft=LOCAL.aircraft[:2], points=())
    simulated = simulate_session(pair, 5)
    settings = believed(pair, derivatives="estimate")
    one, other = (
        run_algorithm(prepare(simulated.session, settings), settings, name) for name in ("centralised", "pairwise")
    )
    for a, b in zip(one.tracks, other.tracks, strict=True):
        assert a.state == pytest.approx(b.state, rel=1e-6, abs=1e-6)
        assert a.covariance == pytest.approx(b.covariance, rel=1e-6, abs=1e-6)


def test_ranges_are_linearised_at_the_estimate_where_something_fixed_is_heard() -> None:
    for scenario, is_about in ((replace(LOCAL, points=()), True), (LOCAL, False), (GLOBAL, False)):
        settings = believed(scenario)
        prepared = prepare(simulate_session(scenario, 1).session, settings)
        assert is_about_reckoning(prepared, settings) is is_about
        assert is_about_reckoning(prepared, replace(settings, derivatives="reckoning"))


def test_three_aircraft_pairwise_stays_close_to_the_centralised_filter() -> None:
    simulated = simulate_session(LOCAL, 6)
    settings = believed(LOCAL)
    one, other = (
        run_algorithm(prepare(simulated.session, settings), settings, name) for name in ("centralised", "pairwise")
    )
    assert other.tracks[2].two_sigma_r_m[-1] == pytest.approx(one.tracks[2].two_sigma_r_m[-1], rel=0.2)


def test_one_aircraft_alone_is_a_single_filter_in_every_algorithm() -> None:
    single = replace(GLOBAL, aircraft=GLOBAL.aircraft[:1])
    simulated = simulate_session(single, 8)
    settings = believed(single)
    runs = [
        run_algorithm(prepare(simulated.session, settings), settings, name) for name in ALGORITHMS if name != "smoothed"
    ]
    reference = runs[list(ALGORITHMS).index("centralised")].tracks[0]
    for run in runs[1:]:
        assert run.tracks[0].position_m == pytest.approx(reference.position_m, abs=1e-3)
        assert run.tracks[0].two_sigma_r_m == pytest.approx(reference.two_sigma_r_m, rel=1e-4)


def test_no_ranges_at_all_is_dead_reckoning() -> None:
    session = replace(simulate_session(LOCAL, 2).session, ranges=Ranges.none())
    settings = believed(LOCAL)
    runs = [run_algorithm(prepare(session, settings), settings, name) for name in ALGORITHMS]
    for run in runs:
        assert run.tracks[1].position_m == pytest.approx(runs[0].tracks[1].position_m, abs=1e-9)
        assert not run.judged


def run_all(session: Session, settings: CooperativeSettings) -> dict[str, list[np.ndarray]]:
    prepared = prepare(session, settings)
    runs = {name: run_algorithm(prepared, settings, name) for name in ALGORITHMS}
    return {name: [track.position_m for track in run.tracks] for name, run in runs.items()}


def test_turning_the_world_turns_the_answer() -> None:
    settings = believed(LOCAL)
    session = simulate_session(BRIEF, 9).session
    angle = np.deg2rad(137.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    vehicles = tuple(
        replace(one, position_m=one.position_m @ turn.T, velocity_mps=one.velocity_mps @ turn.T)
        for one in session.vehicles
        if isinstance(one, DeadReckoning)
    )
    points = tuple(replace(one, position_m=tuple((turn @ np.array(one.position_m)).tolist())) for one in session.points)
    before, after = run_all(session, settings), run_all(replace(session, vehicles=vehicles, points=points), settings)
    for name in ALGORITHMS:
        tolerance = 0.05 if name in ("ranked", "modified", "split_intersection") else 1e-4  # 4-byte covariances
        for one, two in zip(before[name], after[name], strict=True):
            assert two == pytest.approx(one @ turn.T, abs=tolerance), name


def test_shifting_time_shifts_nothing_else() -> None:
    settings = believed(LOCAL)
    session = simulate_session(BRIEF, 10).session
    shift_s = 1000.0
    vehicles = tuple(replace(one, time_s=one.time_s + shift_s) for one in session.vehicles)
    ranges = replace(session.ranges, time_s=session.ranges.time_s + shift_s)
    before, after = run_all(session, settings), run_all(replace(session, vehicles=vehicles, ranges=ranges), settings)
    for name in ALGORITHMS:
        for one, two in zip(before[name], after[name], strict=True):
            assert two == pytest.approx(one, abs=1e-4), name


def test_shuffling_the_aircraft_shuffles_the_answer() -> None:
    settings = believed(LOCAL)
    session = simulate_session(BRIEF, 11).session
    before, after = run_all(session, settings), run_all(replace(session, vehicles=session.vehicles[::-1]), settings)
    for name in ALGORITHMS:
        for one, two in zip(before[name], after[name][::-1], strict=True):
            assert two == pytest.approx(one, abs=1e-4), name


@pytest.mark.slow
def test_dropping_a_third_of_the_ranges_leaves_the_filter_honest() -> None:
    thinned = replace(LOCAL, link=replace(LOCAL.link, lost_share=1.0 / 3.0))
    whole, fewer = (len(simulate_session(one, 1).session.ranges) for one in (LOCAL, thinned))
    assert fewer == pytest.approx(2 * whole / 3, rel=0.1)
    check_nees(thinned, believed(thinned), "centralised", 7)


@pytest.mark.slow
def test_coming_and_going() -> None:
    guests = (
        replace(LOCAL.aircraft[0], leaves_s=30.0),
        replace(LOCAL.aircraft[1], appears_s=20.0),
        LOCAL.aircraft[2],
    )
    points = (replace(LOCAL.points[0], leaves_s=25.0), LOCAL.points[1])
    scenario = replace(LOCAL, aircraft=guests, points=points)
    simulated = simulate_session(scenario, 3)
    answer, findings = estimate_session(simulated.session, settings=believed(scenario), truth=truth_of(simulated))
    assert {one.code for one in findings} <= {"cooperative.gated", "cooperative.refused"}  # pairwise: loops
    epochs = {row.vehicle: row.epochs for row in answer.vehicles if row.algorithm == "centralised"}
    assert epochs == {"A": 31, "B": 41, "C": 61}
    check_nees(scenario, believed(scenario), "centralised", 7, SEEDS[:12])


def test_messages_are_so_many_bytes_and_come_back_as_they_were() -> None:
    place, covariance, shared = np.array([1e6, -2e6, 5e6]), np.diag([1.0, 4.0, 9.0, 16.0]), np.ones((4, 2))
    for kind, bytes_, message in (
        ("neighbour_exact", 42, Broadcast(1, 2, 3, place, 4.0)),
        ("ranked", 82, Broadcast(1, 2, 3, place, 4.0, covariance)),
        ("split_intersection", 82, Broadcast(1, 2, 3, place, 4.0, covariance)),
        ("modified", 114, Broadcast(1, 2, 3, place, 4.0, covariance, shared)),
    ):
        sent = message.encode()
        got = decode(sent, kind)
        assert len(sent) == bytes_
        assert (got.sender, got.rank, got.slot, got.clock_m) == (1, 2, 3, 4.0)
        assert got.place_m.tolist() == place.tolist()
        assert got.covariance is None or got.covariance.tolist() == covariance.tolist()
        assert got.shared is None or got.shared.tolist() == shared.tolist()
    assert (report_bytes(0), report_bytes(3)) == (58, 91)
    assert pairwise_bytes(7, 7) == (682, 682)


def test_traffic_of_a_session() -> None:
    """60 frames; A, B and C transmit once in each; points say nothing of themselves."""
    simulated = simulate_session(LOCAL, 1)
    settings = believed(LOCAL)
    prepared = prepare(simulated.session, settings)
    assert run_algorithm(prepared, settings, "neighbour_exact").messages == dict.fromkeys("ABC", (60, 2520))
    assert run_algorithm(prepared, settings, "centralised").messages == {
        name: (60, 60 * report_bytes(4)) for name in "ABC"
    }
    assert not run_algorithm(prepared, settings, "dead_reckoning").messages
    pairs = run_algorithm(prepared, settings, "pairwise").messages
    assert sum(count for count, _ in pairs.values()) == 2 * 6 * 60
    assert sum(size for _, size in pairs.values()) == 2 * 6 * 60 * 682


def test_latency_delays_what_neighbours_know() -> None:
    simulated = simulate_session(LOCAL, 4)
    positions = []
    for latency in (0, 1, 3):
        settings = believed(LOCAL, latency_slots=latency)
        positions.append(
            run_algorithm(prepare(simulated.session, settings), settings, "neighbour_exact").tracks[0].position_m
        )
    assert np.abs(positions[1] - positions[0]).max() > 1e-6 and np.abs(positions[2] - positions[1]).max() > 1e-6


@pytest.mark.slow
def test_a_lone_net_of_exact_neighbours_feeds_its_errors_and_two_points_stop_it() -> None:
    radii = {}
    for name, points in (("alone", ()), ("two points", LOCAL.points)):
        scenario = replace(LOCAL, points=points, duration_s=300.0)
        settings = believed(scenario)
        run = run_algorithm(prepare(simulate_session(scenario, 2).session, settings), settings, "neighbour_exact")
        radii[name] = float(np.median(run.map_radius[10:]))  # windows of 10 s after the first 100 s
    assert radii["two points"] < 1.05 < 1.1 < radii["alone"]


def test_outliers_are_gated_and_counted() -> None:
    wild = replace(LOCAL, link=replace(LOCAL.link, outlier_share=0.05, outlier_m=20_000.0))
    simulated = simulate_session(wild, 1)
    answer, findings = estimate_session(
        simulated.session, settings=believed(wild), algorithms=("centralised",), truth=truth_of(simulated)
    )
    row = answer.algorithms[0]
    assert 0.03 * len(simulated.session.ranges) < row.gated < 0.07 * len(simulated.session.ranges)
    assert "cooperative.gated" in {one.code for one in findings}
    assert row.rms_m is not None and row.rms_m < 100.0 and not row.diverges


def test_range_bias_is_estimated() -> None:
    """Two-way ranges: every receiver reads 25 m too long, of aircraft and of points."""
    session = simulate_session(replace(LOCAL, duration_s=120.0), 1, scale=0.0).session
    ranges = session.ranges
    biased = replace(ranges, pseudorange_m=ranges.pseudorange_m + 25.0, is_two_way=True)
    settings = believed(LOCAL, range_bias_m=50.0)
    prepared = prepare(replace(session, ranges=biased), settings)
    assert prepared.vehicles[0].states[-1] == "range_bias_m" and prepared.vehicles[0].size == 8
    run = run_algorithm(prepared, settings, "centralised")
    for track in run.tracks:
        assert track.state[-1, -1] == pytest.approx(25.0, abs=3.0 * np.sqrt(track.covariance[-1, -1, -1]))
        assert np.sqrt(track.covariance[-1, -1, -1]) < 5.0


def test_damaged_input_is_counted_and_never_raises() -> None:
    simulated = simulate_session(LOCAL, 1)
    session = simulated.session
    ranges = session.ranges
    value, source, time_s = ranges.pseudorange_m.copy(), ranges.source.copy(), ranges.time_s.copy()
    value[:5], value[5] = np.nan, 1e12
    source[10:13] = "Z"
    time_s[20] = -3.0
    first = session.vehicles[0]
    assert isinstance(first, DeadReckoning)
    position, own_time = first.position_m.copy(), first.time_s.copy()
    position[7] = np.nan
    own_time[30] = 3.0
    broken = replace(
        session,
        vehicles=(replace(first, position_m=position, time_s=own_time), *session.vehicles[1:]),
        ranges=replace(ranges, pseudorange_m=value, source=source, time_s=time_s),
        heights=Heights(np.array([1.0]), np.array(["A"]), np.array([np.nan]), np.array([1.0])),
    )
    settings = replace(believed(LOCAL), pairwise_nees_limit=0.0)
    answer, findings = estimate_session(broken, settings=settings, truth=truth_of(simulated))
    counts = {one.code: one.count for one in findings}
    assert counts["cooperative.not_a_number"] == 5 and counts["cooperative.absurd_range"] == 1
    assert counts["cooperative.unknown_peer"] == 3 and counts["cooperative.clock_leap"] == 1
    assert counts["cooperative.dead_reckoning"] == 2 and counts["cooperative.no_dead_reckoning_then"] == 1
    assert counts["cooperative.height_rows"] == 1
    assert all(row.two_sigma_r_m is not None and np.isfinite(row.two_sigma_r_m) for row in answer.algorithms)


def test_negative_two_way_ranges_are_left_out() -> None:
    session = simulate_session(LOCAL, 1).session
    value = session.ranges.pseudorange_m.copy()
    value[:4] = -5.0
    two_way = replace(session, ranges=replace(session.ranges, pseudorange_m=value, is_two_way=True))
    found = prepare(two_way, believed(LOCAL)).findings
    assert [(one.code, one.count) for one in found] == [("cooperative.negative_range", 4)]


def test_a_clock_that_leaps_is_found_again() -> None:
    """0.1 ms in the clock of A from 20 s on: 30 km in its ranges; the filter opens the clock and goes on."""
    simulated = simulate_session(replace(LOCAL, duration_s=120.0), 1)
    session = simulated.session
    value = session.ranges.pseudorange_m.copy()
    late = session.ranges.time_s >= 20.0
    value[late & (session.ranges.receiver == "A")] += 30_000.0
    value[late & (session.ranges.source == "A")] -= 30_000.0
    leapt = replace(session, ranges=replace(session.ranges, pseudorange_m=value))
    settings = replace(believed(LOCAL), pairwise_nees_limit=0.0)
    answer, findings = estimate_session(
        leapt, settings=settings, algorithms=("smoothed", "centralised", "pairwise"), truth=truth_of(simulated)
    )
    codes = {one.code for one in findings}
    assert "cooperative.clock_reset" in codes and "cooperative.station_drift" not in codes
    for row in answer.vehicles:
        assert row.end_error_m is not None and row.end_error_m < 40.0
    leaps = next(one.text for one in findings if one.code == "cooperative.clock_reset" and "smoothed" in one.text)
    assert leaps.split()[-2] in ("1", "2")  # the readings of one knot lie on both sides of the leap


def test_a_vehicle_without_dead_reckoning_is_a_finding() -> None:
    session = simulate_session(LOCAL, 1).session
    first = session.vehicles[0]
    nothing = replace(
        first, **{name: value[:0] for name, value in vars(first).items() if isinstance(value, np.ndarray)}
    )
    answer, findings = estimate_session(
        replace(session, vehicles=(nothing, *session.vehicles[1:])), settings=believed(LOCAL)
    )
    assert answer.vehicle_names == ("B", "C")
    assert {"cooperative.no_dead_reckoning", "cooperative.unknown_peer"} <= {one.code for one in findings}


def test_bound_is_what_the_best_filter_reaches() -> None:
    simulated = simulate_session(LOCAL, 12)
    answer, _ = estimate_session(
        simulated.session,
        settings=believed(LOCAL),
        algorithms=("dead_reckoning", "centralised"),
        truth=truth_of(simulated),
    )
    ratios = {row.algorithm: row.bound_ratio for row in answer.algorithms}
    assert ratios["centralised"] is not None and ratios["dead_reckoning"] is not None
    assert ratios["centralised"] < 2.0 and ratios["dead_reckoning"] > ratios["centralised"]


def test_wheeled_vehicles_and_bearings() -> None:
    """A robot sees two landmarks in turn (one alone leaves a turn about it open); a wrong start is found."""
    time_s = np.arange(0.0, 40.0, 0.5)
    speed, turn = np.full(len(time_s), 0.3), np.full(len(time_s), 5.0)
    track = Odometry("R1", time_s, speed, turn, (0.1, -0.1), 2.0)
    exact = WheeledVehicle(replace(track, position_m=(0.0, 0.0), heading_deg=0.0), CooperativeSettings())
    marks, rows = np.array([[5.0, 1.0], [-3.0, 4.0]]), []
    x = exact.start()[0]
    for k in range(1, 70):
        x = exact.step(x, time_s[k - 1], time_s[k])[0]
        line = marks[k % 2] - x[:2]
        bearing = np.rad2deg((np.arctan2(line[1], line[0]) - x[2] + np.pi) % (2 * np.pi) - np.pi)
        rows.append((time_s[k], float(np.hypot(*line)), bearing, *x[:2]))
    at, distance, bearing_deg, north, east = np.array(rows).T
    n = len(at)
    ranges = Ranges(
        at,
        np.full(n, "R1"),
        np.array(["M", "L"] * n)[:n],
        distance,
        np.full(n, 0.05),
        np.full(n, NO_SLOT),
        bearing_deg,
        np.full(n, 1.0),
        True,
    )
    session = Session(
        "local", (track,), (GroundPoint("L", (5.0, 1.0, 0.0)), GroundPoint("M", (-3.0, 4.0, 0.0))), ranges
    )
    belief = OdometryBelief(position_m=0.2, heading_deg=3.0, along_m_per_sqrt_s=1e-4, turn_deg_per_sqrt_s=1e-3)
    settings = CooperativeSettings(odometry=belief, output_step_s=0.5, gate_sigma=0.0)
    run = run_algorithm(prepare(session, settings), settings, "centralised")
    track_found = run.tracks[0]
    assert np.interp(at[-1], track_found.time_s, track_found.position_m[:, 0]) == pytest.approx(north[-1], abs=0.02)
    assert np.interp(at[-1], track_found.time_s, track_found.position_m[:, 1]) == pytest.approx(east[-1], abs=0.02)


@pytest.mark.slow
def test_aircraft_in_line_keep_their_estimates_near_their_reckoning() -> None:
    """Ranges say next to nothing across the line; both runs overflowed while the directions alone stood still."""
    scenario = load_session("local-three-in-line")
    settings = believed(scenario, gate_sigma=0.0)
    for run in (6, 7):
        simulated = simulate_session(scenario, 80_000, run)
        found = run_algorithm(prepare(simulated.session, settings), settings, "centralised")
        for track, truth in zip(found.tracks, simulated.truth, strict=True):
            assert np.abs(track.state[:, :2] - truth.states[:, :2]).max() < 4.5 * scenario.errors.position_m


@pytest.mark.parametrize(("frame_s", "latency_slots"), [(1.0, 1), (10.0, 3)])
def test_no_vehicle_claims_less_than_the_error_of_a_point_that_it_shares(frame_s: float, latency_slots: int) -> None:
    """The joint covariance of a vehicle's states and the points keeps its positive eigenvalues."""
    scenario = replace(load_session("ranked-known-clocks"), duration_s=120.0)
    settings = believed(scenario, frame_s=frame_s, latency_slots=latency_slots, gate_sigma=0.0)
    filters = Decentralised(prepare(simulate_session(scenario, 3).session, settings), settings, "modified")
    filters.run()
    variance_m2 = np.repeat([point.position_sigma_m**2 for point in scenario.points if point.position_sigma_m > 0.0], 2)
    assert len(variance_m2) == 2
    for own in filters._own:
        joint = np.block([[own.P, own.shared], [own.shared.T, np.diag(variance_m2)]])
        scale = np.sqrt(np.diag(joint))
        assert np.linalg.eigvalsh(joint / np.outer(scale, scale)).min() > 0.0
