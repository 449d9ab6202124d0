"""The study of several units: what is flown, how it is counted, a study of few flights."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.serial import from_json, to_json_exactly
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.pipeline.verbs.synthesis import KeptRuns
from groundstation.simulation.ins_units.family import BAD_INPUTS, BROKEN, FAULT_CASES, healthy_flight
from groundstation.simulation.ins_units.flight import simulate_units
from groundstation.systems.inertial.study import units
from groundstation.systems.inertial.study.units import study_units
from groundstation.systems.inertial.study.units_runs import (
    EXPECTED_KIND,
    FIRST_SEED,
    CellError,
    UnitsCase,
    UnitsOutcome,
    judge_flight,
    run_units,
    tracks_of,
    truth_track,
    units_cases,
)
from groundstation.systems.inertial.study.units_tables import (
    alarm_list,
    bad_input_table,
    broken_table,
    coverage_table,
    false_alarm_table,
    fault_table,
)
from groundstation.systems.inertial.units_answer import FAULT_KINDS

SEED = 5
CASES = units_cases(12, SEED)
PLAIN = UnitsOutcome("healthy", "", "", 0, 2, "with", "navigation", "dogleg", 1.0, "agree", "all agree")


def outcome(**changed: object) -> UnitsOutcome:
    return replace(PLAIN, **changed)  # type: ignore[arg-type]


def test_every_case_of_the_family_is_flown_on_seeds_of_its_own() -> None:
    assert len(CASES) == 1 + len(FAULT_CASES) + len(BAD_INPUTS) + len(BROKEN)
    assert len({case.name for case in CASES}) == len(CASES)
    assert {case.seed for case in CASES} == {FIRST_SEED + 10 * SEED, FIRST_SEED + 10 * SEED + 1}
    assert not {case.seed for case in CASES} & {case.seed for case in units_cases(12, SEED + 1)}
    assert set(EXPECTED_KIND) == {case.kind for case in FAULT_CASES}
    assert set(EXPECTED_KIND.values()) <= set(FAULT_KINDS)


def test_tracks_are_what_the_units_wrote() -> None:
    settings = replace(healthy_flight(SEED, 4), duration_s=900.0, outages=())
    flight = simulate_units(settings, SEED, 4)
    tracks, truth = tracks_of(flight), truth_track(flight)
    assert [track.topic for track in tracks.units] == ["ins", "ins.1"]
    gnss = tracks.reference
    assert gnss is not None and truth is not None and np.array_equal(gnss.time_s, truth.time_s)
    assert np.array_equal(tracks.units[1].velocity_mps, flight.units[1].velocity_mps)
    assert tracks.ins_class == settings.ins and tracks.units[1].start_s == (0.0 if settings.states_start else None)
    assert np.std(gnss.velocity_mps - truth.velocity_mps) == pytest.approx(0.036, abs=0.008)
    assert tracks_of(simulate_units(replace(settings, has_gnss=False), SEED, 4)).reference is None


def test_what_counts_as_found_named_and_wrong() -> None:
    fault = outcome(group="fault", case="reset", verdict="off", off=("ins.1",), faulty=("ins.1",))
    assert fault.is_called and fault.is_found and fault.is_named and not fault.is_wrong
    either = replace(fault, verdict="one_of", off=("ins", "ins.1"))
    assert either.is_found and not either.is_named and not either.is_wrong
    wrong = replace(fault, off=("ins",))
    assert wrong.is_wrong and not wrong.is_found
    missed = replace(fault, verdict="agree", off=())
    assert not missed.is_called and not missed.is_wrong
    assert (
        replace(fault, faulty_kinds=("tilt", "step")).has_kind and not replace(fault, faulty_kinds=("tilt",)).has_kind
    )


def test_tables_count() -> None:
    healthy = [outcome(run=run, verdict="off" if run < 3 else "agree", units=2 + run % 2) for run in range(40)]
    table = false_alarm_table(healthy)
    assert (table["flights"][0], table["alarms"][0]) == (40, 3)
    assert table["share"][0] == pytest.approx(0.075)
    assert table["share_low"][0] < 0.05 < table["share"][0] < table["share_high"][0] < 0.21
    assert len(alarm_list(healthy)) == 3
    faulty = [
        outcome(group="fault", case="drift", size="8", verdict=verdict, off=off, faulty=("ins",), late_s=late_s)
        for verdict, off, late_s in (
            ("off", ("ins",), 10.0),
            ("one_of", ("ins", "ins.1"), 30.0),
            ("off", ("ins.1",), float("nan")),
            ("agree", (), float("nan")),
        )
    ]
    row = fault_table(faulty)
    assert [row[name][0] for name in ("found", "named", "one_of", "wrong")] == [0.5, 0.25, 0.25, 0.25]
    assert row["late_s"][0] == 20.0
    cells = tuple(CellError("rate_fit_nmiph", error, 1.0) for error in (-0.5, 0.2, 3.0, -0.9))
    (inside,) = coverage_table([outcome(cells=cells)])["inside95"][:1]
    assert inside == 0.75
    broken = broken_table([outcome(group="broken", case="clocks", cells=cells)])
    assert broken["rates"][0] == 4 and broken["inside95"][0] == 0.75
    bad = bad_input_table([outcome(group="bad", case="twin", is_told=True, verdict="not_assessable")])
    assert (bad["no_answer"][0], bad["told"][0], bad["called"][0]) == (1, 1.0, 0.0)


def test_outcomes_are_kept_and_read_back(tmp_path: Path) -> None:
    cells = (CellError("rate_fit_nmiph", 0.1, 0.2),)
    kept = outcome(group="fault", case="drift", off=("ins",), cells=cells, late_s=3.5)
    assert from_json(UnitsOutcome, to_json_exactly(kept)) == kept
    store: KeptRuns[UnitsOutcome] = KeptRuns(tmp_path, UnitsOutcome)
    case = UnitsCase("healthy", "", "", 1, 1, healthy_flight)
    store.put(case.name, 0, kept) if store.get(case.name, 0) is None else None
    assert run_units([case], kept=KeptRuns(tmp_path, UnitsOutcome)) == (kept,)


def case_of(name: str) -> UnitsCase:
    return next(case for case in CASES if f"{case.case} {case.size}".strip() == name)


@pytest.mark.slow
def test_a_judged_flight_names_what_was_put_in() -> None:
    found = judge_flight(case_of("step 1000 m"), 1)  # three units with GNSS
    assert (found.units, found.mode) == (3, "with")
    assert found.is_named and found.has_kind and abs(found.late_s) < 60.0
    (step,) = [cell for cell in found.cells if cell.quantity == "step, m"]
    assert abs(step.error) < 20.0
    healthy = judge_flight(CASES[0], 1)
    assert not healthy.is_called and not healthy.faulty
    rates = [cell for cell in healthy.cells if cell.quantity == "rate_fit_nmiph"]
    assert len(rates) == 3 and all(0.0 < abs(cell.error) < 0.1 for cell in rates)


def test_the_truth_of_the_table_is_that_of_the_simulated_errors() -> None:
    """The figures that the intervals are held against, computed here from the errors themselves."""
    settings = replace(healthy_flight(SEED, 1), duration_s=3600.0, outages=(), states_start=True)
    flight = simulate_units(settings, SEED, 1)
    true = tracks_of(flight).judged(truth_track(flight))
    hours = flight.time_s / 3600.0
    for unit, simulated in zip(true.units, flight.units, strict=True):
        radial_nmi = np.hypot(*simulated.errors.position_m.T) / M_PER_NAUTICAL_MILE
        assert unit.rate_fit_nmiph is not None and unit.velocity_rms_mps is not None and unit.largest_m is not None
        rate = np.sum(hours * radial_nmi) / np.sum(hours**2)
        assert unit.rate_fit_nmiph.value == pytest.approx(rate, rel=0.01, abs=1e-3)
        rms = np.sqrt(np.mean(np.sum(simulated.errors.velocity_mps**2, axis=1)))
        assert unit.velocity_rms_mps.value == pytest.approx(rms, rel=0.01, abs=2e-3)
        assert unit.largest_m.value == pytest.approx(radial_nmi.max() * M_PER_NAUTICAL_MILE, rel=0.01, abs=1.0)


@pytest.mark.slow
def test_study_writes_its_tables_and_page(monkeypatch: pytest.MonkeyPatch) -> None:
    few = tuple(replace(case_of(name), flights=2) for name in ("drift 8", "stuck 60 s", "clock 0.5 s", "clocks"))
    cases = (replace(CASES[0], flights=4), *few)
    monkeypatch.setattr(units, "units_cases", lambda _runs, _seed: cases)
    lines: list[str] = []
    study = study_units(runs=12, seed=SEED, progress=lines.append)
    tables = {table.name: table for table in study.tables}
    assert {"units_false_alarms", "units_faults", "units_bad_inputs", "units_coverage", "units_broken"} <= set(tables)
    assert tables["units_false_alarms"]["flights"][0] == 4
    assert len(lines) == 12
    assert set(tables["units_faults"]["fault"]) == {"drift", "stuck"}
    for text in ("False alarms", "Coverage of the intervals", "Assumptions broken", "12 of 12 flights"):
        assert text in study.markdown
    assert study.markdown == study_units(runs=12, seed=SEED).markdown
    early = study_units(runs=12, seed=SEED, minutes=0.0)
    assert "5 of 12 flights" in early.markdown
