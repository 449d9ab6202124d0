"""Flights with several units: exact without errors, faults that begin at their time and change nothing else."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import SettingsError, UsageError
from groundstation.base.geodesy import north_east_m
from groundstation.base.toml_settings import settings_from
from groundstation.pipeline.verbs.synthesis import simulate_to
from groundstation.simulation.ins_class import InsClass, load_ins_class
from groundstation.simulation.ins_units.family import (
    BAD_INPUTS,
    BROKEN,
    FAULT_CASES,
    GNSS_MODES,
    UNIT_NUMBERS,
    faulty_flight,
    gnss_mode,
    healthy_flight,
)
from groundstation.simulation.ins_units.flight import UnitsFlight, class_tilt_rad, simulate_units
from groundstation.simulation.ins_units.log import units_log
from groundstation.simulation.ins_units.scenario import (
    UnitsScenario,
    load_units_scenario,
    units_scenario_names,
)
from groundstation.simulation.ins_units.settings import (
    AnyUnitFault,
    CommonErrors,
    GnssOutage,
    UnitAided,
    UnitClock,
    UnitDrift,
    UnitExchanged,
    UnitFrozen,
    UnitOutput,
    UnitReset,
    UnitsSettings,
    UnitStep,
    UnitStuck,
    UnitSwapped,
    UnitTilt,
    UnitTwin,
    UnitWithoutPosition,
)

SEED = 5
ROUNDING_DEG = 1e-12
EXACT = UnitOutput(0.0, 0.0, 0.0, 0.0, 0.0)
PERFECT = InsClass(gyro_constant_dph=0.0, deflection_arcsec=0.0, initial_position_m=0.0, initial_velocity_mps=0.0,
                   initial_tilt_rad=0.0)  # fmt: skip
FLIGHT = UnitsSettings(units=3, route="manoeuvring", duration_s=3600.0, output=EXACT)
SCHULER_RADPS = 1.24e-3
PARTS = ("position_m", "velocity_mps", "tilt_rad", "azimuth_rad")


def flown(*faults: AnyUnitFault, **changed: object) -> UnitsFlight:
    return simulate_units(replace(FLIGHT, faults=faults, **changed), SEED)  # type: ignore[arg-type]


def first_difference(one: UnitsFlight, other: UnitsFlight, unit: int, name: str) -> float:
    """First second at which an output of a unit differs, infinity where none does."""
    values = [np.asarray(getattr(flight.units[unit - 1], name)).reshape(len(one.time_s), -1) for flight in (one, other)]
    differs = np.flatnonzero(np.any(values[0] != values[1], axis=1))
    return float(one.time_s[differs[0]]) if differs.size else float("inf")


@pytest.fixture(scope="module")
def healthy() -> UnitsFlight:
    return flown()


def test_units_without_errors_equal_the_truth() -> None:
    flight = flown(ins=PERFECT)
    motion = flight.truth.motion
    assert len(flight.units) == 3
    for unit in flight.units:
        assert np.abs(unit.latitude_deg - motion.latitude_deg[0]).max() < ROUNDING_DEG
        assert np.abs(unit.longitude_deg - flight.truth.longitude_deg).max() < ROUNDING_DEG
        assert np.array_equal(unit.velocity_mps[:, 0], motion.velocity_north_mps[0])
        assert np.array_equal(unit.velocity_mps[:, 1], motion.velocity_east_mps[0])
        assert np.array_equal(unit.heading_deg, motion.heading_deg[0])


def test_true_position_is_the_integral_of_true_velocity(healthy: UnitsFlight) -> None:
    motion, longitude = healthy.truth.motion, healthy.truth.longitude_deg
    north, east = north_east_m(motion.latitude_deg[0, 1:], longitude[1:], motion.latitude_deg[0, :-1], longitude[:-1])
    for moved, velocity in ((north, motion.velocity_north_mps[0]), (east, motion.velocity_east_mps[0])):
        # on the ellipsoid at sea level: 9 km of altitude are 0.15 %
        assert np.abs(moved - 0.5 * (velocity[1:] + velocity[:-1])).max() < 0.002 * np.abs(velocity).max() + 0.01


def test_units_share_gravity_and_the_position_typed_in_and_nothing_else(healthy: UnitsFlight) -> None:
    first, second, third = (unit.errors for unit in healthy.units)
    for other in (second, third):
        assert np.array_equal(first.position_m[0], other.position_m[0])
        assert not np.any(np.isclose(first.velocity_mps[0], other.velocity_mps[0]))
        assert not np.any(np.isclose(first.position_m[-1], other.position_m[-1]))
    only_gravity = replace(PERFECT, deflection_arcsec=10.0)
    same = flown(ins=only_gravity).units
    assert np.array_equal(same[0].errors.velocity_mps, same[1].errors.velocity_mps)
    assert np.abs(same[0].errors.velocity_mps).max() > 1e-3


def test_another_unit_or_fault_changes_no_other_unit(healthy: UnitsFlight) -> None:
    two = flown(units=2)
    faulty = flown(UnitDrift(unit=2), UnitStep(unit=2, at_s=900.0, north_m=50.0))
    for name in ("latitude_deg", "velocity_mps", "heading_deg"):
        for unit in (1, 2):
            assert np.array_equal(getattr(two.units[unit - 1], name), getattr(healthy.units[unit - 1], name))
        for unit in (1, 3):
            assert first_difference(faulty, healthy, unit, name) == float("inf")
    assert two.gnss is not None and healthy.gnss is not None
    assert np.array_equal(two.gnss.latitude_deg, healthy.gnss.latitude_deg)


@pytest.mark.parametrize(
    ("fault", "name", "begin_s"),
    [
        (UnitStep(unit=2, at_s=1200.0, north_m=300.0), "latitude_deg", 1200.0),
        (UnitStep(unit=2, at_s=1200.0, east_mps=1.0), "velocity_mps", 1200.0),
        (UnitReset(unit=2, at_s=1200.0), "latitude_deg", 1200.0),
        (UnitDrift(unit=2, times=8.0, at_s=1200.0), "velocity_mps", 1201.0),
        (UnitTilt(unit=2, times=4.0), "velocity_mps", 1.0),
        (UnitStuck(unit=2, from_s=1200.0, to_s=1500.0), "velocity_mps", 1201.0),
        (UnitFrozen(unit=2, from_s=1200.0, to_s=1500.0), "latitude_deg", 1201.0),
        (UnitExchanged(unit=2, at_s=1200.0), "latitude_deg", 1200.0),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, UnitStep) else None,
)
def test_a_fault_begins_at_its_time(healthy: UnitsFlight, fault: AnyUnitFault, name: str, begin_s: float) -> None:
    faulty = flown(fault)
    assert begin_s <= first_difference(faulty, healthy, 2, name) <= begin_s + 2.0
    for other in (1, 3):
        assert first_difference(faulty, healthy, other, name) == float("inf")


def test_steps_have_their_size_and_start_a_schuler_oscillation(healthy: UnitsFlight) -> None:
    step = flown(UnitStep(unit=1, at_s=600.0, north_m=300.0, east_m=-400.0, north_mps=1.0))
    added = {name: getattr(step.units[0].errors, name) - getattr(healthy.units[0].errors, name) for name in PARTS}
    assert added["position_m"][600] == pytest.approx([300.0, -400.0], abs=1e-9)
    assert added["velocity_mps"][600] == pytest.approx([1.0, 0.0], abs=1e-12)
    later = 600 + round(0.5 * np.pi / SCHULER_RADPS)  # a quarter of the period: the velocity is used up
    assert abs(added["velocity_mps"][later, 0]) < 0.15
    assert added["position_m"][later, 0] == pytest.approx(300.0 + 1.0 / SCHULER_RADPS, rel=0.05)


def test_a_reset_takes_the_errors_away(healthy: UnitsFlight) -> None:
    reset = flown(UnitReset(unit=3, at_s=1800.0)).units[2].errors
    assert np.hypot(*healthy.units[2].errors.position_m[1800]) > 20.0
    assert reset.position_m[1800] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert reset.velocity_mps[1800] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.array_equal(reset.tilt_rad[1800], healthy.units[2].errors.tilt_rad[1800])


@pytest.mark.parametrize("ins", ["navigation", "i-21"])
def test_tilt_and_drift_grow_with_their_size(ins: str) -> None:
    plain = flown(ins=ins)
    tilted = flown(UnitTilt(unit=1, times=4.0, direction_deg=0.0), ins=ins).units[0].errors
    tilt = tilted.tilt_rad[0] - plain.units[0].errors.tilt_rad[0]
    assert tilt == pytest.approx([4.0 * class_tilt_rad(load_ins_class(ins)), 0.0])
    drifts = [flown(UnitDrift(unit=1, times=times), ins=ins).units[0].errors for times in (2.0, 8.0)]
    added = [np.hypot(*(one.position_m[-1] - plain.units[0].errors.position_m[-1])) for one in drifts]
    assert added[1] == pytest.approx(4.0 * added[0], rel=1e-6)
    assert added[0] > 500.0  # 0.02 deg/h for an hour: 0.02 deg less the Schuler wave


def test_faults_of_outputs_leave_the_errors_alone(healthy: UnitsFlight) -> None:
    swapped = flown(UnitSwapped(unit=1, at_s=600.0)).units[0]
    assert np.array_equal(swapped.velocity_mps[600:], healthy.units[0].velocity_mps[600:, ::-1])
    assert np.array_equal(swapped.velocity_mps[:600], healthy.units[0].velocity_mps[:600])
    stuck = flown(UnitStuck(unit=1, from_s=600.0, to_s=900.0, axis="east")).units[0]
    assert len(np.unique(stuck.velocity_mps[600:900, 1])) == 1
    assert np.array_equal(stuck.velocity_mps[900:], healthy.units[0].velocity_mps[900:])
    assert np.array_equal(stuck.velocity_mps[:, 0], healthy.units[0].velocity_mps[:, 0])
    assert np.array_equal(stuck.latitude_deg, healthy.units[0].latitude_deg)
    frozen = flown(UnitFrozen(unit=1, from_s=600.0, to_s=900.0)).units[0]
    for name in ("latitude_deg", "longitude_deg", "heading_deg", "roll_deg", "altitude_m"):
        assert len(np.unique(getattr(frozen, name)[600:900])) == 1
    for unit in (swapped, stuck, frozen):
        for name in PARTS:
            assert np.array_equal(getattr(unit.errors, name), getattr(healthy.units[0].errors, name))


def test_bad_inputs_are_what_they_say(healthy: UnitsFlight) -> None:
    late = flown(UnitClock(unit=2, late_s=0.5, rate_ppm=100.0)).units[1]
    assert late.stamp_s == pytest.approx(healthy.time_s * 1.0001 + 0.5)
    assert np.array_equal(late.latitude_deg, healthy.units[1].latitude_deg)
    twin = flown(UnitTwin(unit=3, of=1))
    for item in fields(twin.units[0]):
        if item.name not in ("topic", "errors"):
            assert np.array_equal(getattr(twin.units[2], item.name), getattr(twin.units[0], item.name))
    assert twin.units[2].topic == "ins.2"
    exchanged = flown(UnitExchanged(unit=1, at_s=1200.0)).units[0]
    assert exchanged.serials == ((0.0, "SIM-101"), (1200.0, "SIM-201"))
    assert np.array_equal(exchanged.latitude_deg[:1200], healthy.units[0].latitude_deg[:1200])


def test_an_aided_unit_stays_with_the_truth_and_coasts_in_an_outage() -> None:
    outage = (GnssOutage(1200.0, 3000.0),)
    plain = flown(outages=outage).units[1].errors
    aided = flown(UnitAided(unit=2), outages=outage).units[1]
    radial = np.hypot(*aided.errors.position_m.T)
    outside = (np.arange(len(radial)) < 1200) | (np.arange(len(radial)) >= 3000)
    assert aided.is_aided and radial[outside].max() < 12.0
    assert 12.0 < radial[2999] < np.hypot(*plain.position_m[2999])
    assert np.abs(np.diff(radial[1195:1205])).max() < 3.0  # no jump where it begins


def test_common_errors_are_common_and_tails_are_heavy() -> None:
    plain, moved = flown(), flown(common=CommonErrors(tilt_times=2.0, azimuth_deg=0.1))
    added = [two.errors.tilt_rad[0] - one.errors.tilt_rad[0] for one, two in zip(plain.units, moved.units, strict=True)]
    assert np.hypot(*added[0]) == pytest.approx(2.0 * class_tilt_rad(load_ins_class("navigation")))
    assert added[1] == pytest.approx(added[0]) and added[2] == pytest.approx(added[0])
    rough = flown(common=CommonErrors(deflection_arcsec=20.0, deflection_km=20.0))
    assert not np.allclose(rough.units[0].errors.velocity_mps, plain.units[0].errors.velocity_mps)
    heavy = flown(common=CommonErrors(heavy_tail_freedom=3))
    assert not np.allclose(heavy.units[0].errors.velocity_mps, plain.units[0].errors.velocity_mps)


def test_gnss_is_absent_in_outages_and_where_there_is_none() -> None:
    flight = flown(outages=(GnssOutage(600.0, 1800.0),))
    assert flight.gnss is not None
    assert not np.any((flight.gnss.time_s >= 600.0) & (flight.gnss.time_s < 1800.0))
    assert len(flight.gnss.time_s) == 3601 - 1200
    assert flown(has_gnss=False).gnss is None


def test_settings_that_make_no_flight_are_refused() -> None:
    for table, place in (
        ({"faults": [{"kind": "tilt", "unit": 3}]}, r"faults\[0\].unit"),
        ({"faults": [{"kind": "twin", "unit": 1, "of": 1}]}, r"faults\[0\].of"),
        ({"faults": [{"kind": "reset", "unit": 1, "at_s": 9000.0}]}, r"faults\[0\]"),
        ({"faults": [{"kind": "stuck", "unit": 1, "from_s": 90.0, "to_s": 80.0}]}, "faults"),
        ({"outages": [{"from_s": 90.0, "to_s": 80.0}]}, "outages"),
        ({"units": 0}, "units"),
    ):
        with pytest.raises(SettingsError, match=place):
            settings_from(UnitsSettings, table, "x.toml")


def test_the_family_is_spread_evenly_and_a_run_is_always_the_same() -> None:
    flights = [healthy_flight(SEED, run) for run in range(60)]
    assert flights[7] == healthy_flight(SEED, 7) != healthy_flight(SEED + 1, 7)
    cells = [(flight.units, gnss_mode(flight)) for flight in flights]
    assert {cells.count((units, mode)) for units in UNIT_NUMBERS for mode in GNSS_MODES} == {10}
    assert {flight.ins for flight in flights} == {"navigation", "i-21"}
    assert len({flight.route for flight in flights}) == 6
    assert min(flight.duration_s for flight in flights) >= 1800.0
    for flight in flights:
        for outage in flight.outages:
            assert 0.0 <= outage.from_s < outage.to_s <= flight.duration_s
    assert all(not flight.faults for flight in flights)


def test_every_case_gives_a_flight_with_its_fault_in_each_unit() -> None:
    assert len({case.name for case in (*FAULT_CASES, *BAD_INPUTS)}) == len(FAULT_CASES) + len(BAD_INPUTS)
    for case in (*FAULT_CASES, *BAD_INPUTS):
        flights = [faulty_flight(case, SEED, run) for run in range(40)]
        for run, flight in enumerate(flights):
            assert replace(flight, faults=()) == healthy_flight(SEED, run)
        assert {flight.faults[0].unit for flight in flights} == {1, 2, 3}
    for name, change in BROKEN.items():
        assert change(healthy_flight(SEED, 1)) != healthy_flight(SEED, 1), name


def test_tables_have_the_units_own_stamps() -> None:
    faults = (UnitClock(unit=2, late_s=-0.25), UnitWithoutPosition(unit=1), UnitAided(unit=3, is_stated=True))
    flight = simulate_units(replace(FLIGHT, duration_s=900.0, faults=faults), SEED)
    tables = units_log(flight, UnitsScenario(flown=flight.settings, with_truth=True))
    assert set(tables.topics()) == {"ins", "ins.1", "ins.2", "gnss", "truth"}
    assert tables["ins"].time_ns[0] - tables["ins.1"].time_ns[0] == 250_000_000
    assert tables["ins.1"].device_time_ns.values[0] == 0 and tables["ins"].device_time_ns.values[0] == 250_000_000
    assert "latitude_deg" not in tables["ins"] and "latitude_deg" in tables["ins.1"]
    assert set(tables["ins.2"].text("mode")) == {"gnss_aided"}


@pytest.mark.parametrize("name", units_scenario_names())
def test_shipped_scenarios_load_and_say_what_they_are(name: str) -> None:
    scenario = load_units_scenario(name)
    assert scenario.title and scenario.name == name and scenario.flown.units >= 2


def test_a_log_is_written_and_not_overwritten(tmp_path: Path) -> None:
    text = "seed = 3\nwith_truth = true\n[flown]\nunits = 2\nduration_s = 600.0\n"
    text += '[[flown.faults]]\nkind = "swapped"\nunit = 2\n'
    (tmp_path / "mine.toml").write_text(text)
    (path,) = simulate_to(str(tmp_path / "mine.toml"), tmp_path / "logs")
    lines = path.read_text().splitlines()
    header = next(line for line in lines if line.startswith("time_s"))
    assert {"ins.latitude_deg", "ins.1.velocity_east_mps", "truth.latitude_deg"} <= set(header.split(","))
    assert "# ins_serial.ins.1: SIM-102" in lines
    assert len(lines) - lines.index(header) - 1 == 601
    again = path.read_bytes()
    with pytest.raises(UsageError, match="exists"):
        simulate_to(str(tmp_path / "mine.toml"), tmp_path / "logs")
    simulate_to(str(tmp_path / "mine.toml"), tmp_path / "logs", force=True)
    assert path.read_bytes() == again
    with pytest.raises(UsageError, match="scenario of one flight"):
        simulate_to("units-two", tmp_path / "logs", form="ch10")
