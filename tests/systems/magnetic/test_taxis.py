"""Figure-eights after a taxi of every verdict: A within its sigma, and no accepted table contradicts the taxi."""

import numpy as np
import pytest

from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.gates_answer import NOT_IN_INTERVAL
from groundstation.systems.magnetic.study.cases import seed_of
from groundstation.systems.magnetic.study.taxis import (
    TaxiOutcome,
    fly_taxis,
    simulate_taxi_flight,
    taxi_cells,
    taxi_outcome,
    taxi_table,
    true_airframe_error,
)

SEED, JUDGED_SEED, FLIGHTS = 1, 92, 200
CELLS = tuple(taxi_cells())
WANTED_SHARE, WANTED_RMS_DEG = 0.99, 0.30
SPOILT = {"step": "steps", "mode change": "ins_mode", "held velocity": "held_velocity"}
VERDICTS = {
    "two ways": ("accept",),
    "one way": ("advisory",),
    "short": ("extend",),
    "no switch": ("undecided", "reject"),
    "noisy receiver": ("reject",),
    "begins in the air": ("none",),
    **dict.fromkeys(SPOILT, ("reject",)),
}


@pytest.mark.slow
@pytest.mark.parametrize("run", range(len(CELLS)))
def test_every_verdict_of_the_taxi_leads_to_a_table_within_its_sigma(run: int) -> None:
    outcome = taxi_outcome(CELLS[run], seed_of(SEED, run))
    assert outcome.heading_verdict in VERDICTS.get(outcome.cell, (outcome.heading_verdict,))
    assert abs(outcome.a_error_deg) < 3.0 * outcome.a_sigma_deg
    assert abs(outcome.left_deg) < 0.5, "two degrees of azimuth are found again"


@pytest.mark.parametrize(("cell", "gate"), SPOILT.items())
def test_what_is_spoilt_is_what_the_heading_analysis_refuses(cell: str, gate: str) -> None:
    flight = simulate_taxi_flight(taxi_cells()[cell], seed_of(SEED, CELLS.index(cell))).flight
    gates = {one.name: one.state for one in estimate_heading_error(flight).gates}
    assert gates[gate] == "failed"


def test_the_gates_that_refuse_are_gates_of_the_heading_analysis() -> None:
    flight = simulate_taxi_flight(taxi_cells()["short"], seed_of(SEED, 2)).flight
    assert {one.name for one in estimate_heading_error(flight).gates} >= NOT_IN_INTERVAL


def test_truth_is_that_of_the_log_as_it_is() -> None:
    """Before the step the INS shows something else than after it; after it, what the scenario says."""
    simulated = simulate_taxi_flight(taxi_cells()["step"], seed_of(SEED, CELLS.index("step")))
    ins, truth = simulated.scenario.ins, true_airframe_error(simulated)
    whole = ins.azimuth_error_deg + ins.boresight_deg
    assert truth(simulated.flight.duration_s - 10.0) == pytest.approx(whole, abs=0.05)
    assert 0.25 < abs(truth(10.0) - whole) < 0.65


def test_the_table_counts_cells_and_all() -> None:
    def outcome(cell: str, verdict: str, error: float) -> TaxiOutcome:
        return TaxiOutcome(cell, "accept", verdict, "", "", error, 0.2, error, 0.0)

    flown = (outcome("a", "accept", 0.1), outcome("a", "reject", 1.0), outcome("b", "not assessable", float("nan")))
    table = taxi_table(flown)
    assert table["cell"].tolist() == ["a", "b", "all"]
    assert table["tables"].tolist() == [2, 0, 2]
    assert table["accepted"].tolist() == [1, 0, 1]
    assert table["inside_3_sigma"].tolist()[::2] == [0.5, 0.5]
    assert table["accepted_rms_deg"][2] == pytest.approx(0.1)


@pytest.mark.slow
def test_two_hundred_flights_keep_what_is_promised() -> None:
    table = taxi_table(fly_taxis(JUDGED_SEED, range(FLIGHTS)))
    row = int(np.flatnonzero(table["cell"] == "all")[0])
    assert table["accepted"][row] >= 0.9 * FLIGHTS
    assert table["inside_3_sigma"][row] >= WANTED_SHARE
    assert table["accepted_rms_deg"][row] <= WANTED_RMS_DEG
