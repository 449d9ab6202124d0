"""Navigation between aircraft: the centralised filter against filterpy, and what every filter costs against k.

Ten aircraft in a local frame, 70 states, every direction of every link once a second. filterpy runs the same extended
filter: the same transition of each slot, the same range linearised at its own estimate, one scalar update after the
other; places of dead reckoning are computed before its clock starts. States and sigmas are compared before any ratio
is recorded.

Before, every algorithm on a session of three aircraft over 500 s. Then the number of aircraft: all hear all
(centralised, neighbour taken as exact), and each hears two (every decentralised filter, without the error map, which is
a judge and no part of a filter).
"""

import argparse
import os
from dataclasses import replace
from functools import partial

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # one core on both sides

import numpy as np  # noqa: E402
from filterpy.kalman import ExtendedKalmanFilter  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from scipy.linalg import block_diag  # noqa: E402

from benchmarks.record import ROUNDS, Book, Goal, by_turns  # noqa: E402
from groundstation.simulation.session import simulate_session  # noqa: E402
from groundstation.simulation.session_scenario import (  # noqa: E402
    LinkSettings,
    SessionAircraft,
    SessionScenario,
    load_session,
)
from groundstation.systems.cooperative.algorithms import run_algorithm  # noqa: E402
from groundstation.systems.cooperative.events import Prepared, prepare  # noqa: E402
from groundstation.systems.cooperative.settings import ALGORITHMS, CooperativeSettings  # noqa: E402
from groundstation.systems.cooperative.study.cases import CASES, settings_of  # noqa: E402

Array = NDArray[np.float64]
SEED, AIRCRAFT, DURATION_S = 2010, 10, 100.0
RATIO_GOAL, AGREE_SIGMAS = Goal(1.0, "at least"), 1e-6
FEW_ROUNDS = 3  # of costs without a peer
COUNTS = (2, 3, 5, 10, 15, 20)
SESSIONS = ("ranked-points-turn", "three-two-satellites-turn")
ALONE = ("neighbour_exact", "ranked", "split_intersection", "pairwise")


def session(count: int, duration_s: float, frame_s: float, hears: int = 0) -> SessionScenario:
    """Aircraft 20 km apart in rows of five; ``hears``: of how many each uses the slots, 0 of all."""
    names = [f"F{number:02d}" for number in range(count)]
    aircraft = tuple(
        SessionAircraft(
            name,
            -20e3 * (number // 5),
            20e3 * (number % 5),
            rank=number,
            hears=tuple(names[(number + step) % count] for step in range(1, hears + 1)),
        )
        for number, name in enumerate(names)
    )
    return SessionScenario("grid", "local", aircraft, duration_s=duration_s, link=LinkSettings(frame_s=frame_s))


def prepared_of(scenario: SessionScenario, settings: CooperativeSettings) -> Prepared:
    """One simulated session, ready for the filters."""
    return prepare(simulate_session(scenario, SEED).session, settings)


class Peer:
    """The same filter by filterpy."""

    def __init__(self, prepared: Prepared) -> None:
        self.events, vehicles = prepared.events, prepared.vehicles
        starts = [vehicle.start() for vehicle in vehicles]
        self.x0, self.P0 = np.concatenate([x for x, _ in starts]), block_diag(*[P for _, P in starts])
        self.n, self.variance = vehicles[0].size, float(self.events.variance_m2[0])
        zero = np.zeros(self.n)
        pairs = zip(self.events.time_s, self.events.receiver, self.events.source, strict=True)
        self.read = [(vehicles[a].place(zero, at_s)[0], vehicles[b].place(zero, at_s)[0]) for at_s, a, b in pairs]
        steps = np.unique(np.round(np.diff(self.events.time_s), 9))
        self.steps = {}
        for step in steps[steps > 0.0].tolist():
            _, phi, noise = vehicles[0].step(zero, 0.0, step)
            self.steps[step] = block_diag(*[phi] * len(vehicles)), block_diag(*[noise] * len(vehicles))

    def run(self) -> tuple[Array, Array]:
        """Last states and covariance."""
        kalman = ExtendedKalmanFilter(dim_x=len(self.x0), dim_z=1)
        kalman.x, kalman.P, kalman.R = self.x0.copy(), self.P0.copy(), np.array([[self.variance]])
        before = 0.0
        for number, at_s in enumerate(self.events.time_s.tolist()):
            if at_s > before:
                kalman.F, kalman.Q = self.steps[round(at_s - before, 9)]
                kalman.predict()
                before = at_s
            z = np.array([self.events.value_m[number]])
            kalman.update(z, self.derivative, self.range_m, args=(number,), hx_args=(number,))
        return kalman.x, kalman.P

    def _line(self, x: Array, number: int) -> tuple[int, int, Array]:
        a, b = (self.n * int(part[number]) for part in (self.events.receiver, self.events.source))
        here, there = self.read[number]
        north, east, height = (x[b + at] - x[a + at] for at in (0, 1, 4))  # down is minus height
        return a, b, here - there + np.array([north, east, -height])

    def range_m(self, x: Array, number: int) -> Array:
        """Predicted pseudo-range."""
        a, b, line = self._line(x, number)
        return np.array([np.sqrt(line @ line) + x[a + 5] - x[b + 5]])

    def derivative(self, x: Array, number: int) -> Array:
        """Its derivative by all states."""
        a, b, line = self._line(x, number)
        north, east, down = line / np.sqrt(line @ line)
        H = np.zeros((1, len(x)))
        H[0, [a, a + 1, a + 4, a + 5]] = -north, -east, down, 1.0
        H[0, [b, b + 1, b + 4, b + 5]] = north, east, -down, -1.0
        return H


def against_filterpy(book: Book) -> None:
    """Record how the centralised filter compares."""
    settings = CooperativeSettings(gate_sigma=0.0, derivatives="estimate", output_step_s=10.0)
    prepared = prepared_of(session(AIRCRAFT, DURATION_S, 1.0), settings)
    ends = np.searchsorted(prepared.events.time_s, DURATION_S)
    assert ends == len(prepared.events.time_s)
    peer = Peer(prepared)
    x, P = peer.run()
    run = run_algorithm(prepared, replace(settings, output_step_s=prepared.events.time_s[-1]), "centralised")
    sigma = np.sqrt(np.diag(P))
    ours = np.concatenate([track.state[-1] for track in run.tracks])
    spread = np.concatenate([np.sqrt(np.diag(track.covariance[-1])) for track in run.tracks])
    apart = max(float(np.abs((ours - x) / sigma).max()), float(np.abs(spread / sigma - 1.0).max()))
    assert apart <= AGREE_SIGMAS, f"{apart:.1e} sigma apart"
    times = by_turns({"ours": partial(run_algorithm, prepared, settings, "centralised"), "peer": peer.run}, ROUNDS)
    ranges = len(prepared.events.time_s)
    what = f"centralised filter of {AIRCRAFT} aircraft, 70 states, 1 Hz, {DURATION_S:g} s, {ranges} ranges"
    given = {"goal": RATIO_GOAL, "is_times": True, "note": f"{apart:.0e} sigma apart"}
    book.against(what, times["ours"], times["peer"], "filterpy", **given)


def against_number(book: Book) -> None:
    """Record the cost of every filter for more and more aircraft."""
    settings = CooperativeSettings(gate_sigma=0.0, output_step_s=10.0, map_window_s=0.0)
    for count in COUNTS:
        everybody = prepared_of(session(count, 60.0, 2.0), settings)
        two = prepared_of(session(count, 120.0, 2.0, min(2, count - 1)), settings)
        works = {name: partial(run_algorithm, two, settings, name) for name in ALONE}
        works["centralised"] = partial(run_algorithm, everybody, settings, "centralised")
        times = by_turns(works, min(ROUNDS, FEW_ROUNDS))
        ranges = len(everybody.events.time_s)
        joint_us = [1e6 * one / ranges for one in times["centralised"].processor_s]
        book.figure(f"centralised filter, all {count} aircraft hear all", joint_us, "us a range")
        for name in ALONE:
            each_us = [1e6 * one / count / 60.0 for one in times[name].processor_s]
            book.figure(f"{name} filter, {count} aircraft, each hears two", each_us, "us an aircraft and frame")


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args()
    with Book("cooperative") as book:
        for name in SESSIONS:
            scenario = load_session(name)
            settings = settings_of(scenario, CASES[0])
            prepared = prepared_of(scenario, settings)
            works = {one: partial(run_algorithm, prepared, settings, one) for one in ALGORITHMS}
            for one, times in by_turns(works, min(ROUNDS, FEW_ROUNDS)).items():
                what = f"{one} filter on {name}, {len(prepared.events.time_s)} measurements"
                book.figure(what, times.processor_s, "s")
        against_filterpy(book)
        against_number(book)


if __name__ == "__main__":
    main()
