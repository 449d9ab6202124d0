"""Whole simulated flights with the errors of an INS class, great circles, and the faults that system 2 must survive."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import curvature_radii_m, north_east_m
from groundstation.simulation.faults import (
    Dropout,
    Fault,
    Frozen,
    Jitter,
    Jump,
    NotANumber,
    Reset,
    apply_faults,
    describe,
)
from groundstation.simulation.flight import Simulated, scenario_truth, simulate
from groundstation.simulation.flight_errors import flight_errors
from groundstation.simulation.readings import every
from groundstation.simulation.samples import write_log
from groundstation.simulation.scenario import load_scenario
from groundstation.tables.table import Flight
from tests.simulated_flights import FLIGHT_LEGS, QUIET_INS, scenario

FULL = QUIET_INS | {"error_model": "full", "ins_class": "navigation", "position_resolution_deg": 1e-9, "rate_hz": 5}
ROUNDING_M = 2e-3  # a position step of 1e-9 deg, and 1e-9 deg of the truth
CHORD_M = 100.0  # ellipsoid against sphere over some 700 km, in the middle of the way


@pytest.fixture(scope="module")
def long_flight() -> Simulated:
    return simulate(load_scenario("norilsk-moscow"))


def ins_position_error_m(simulated: Simulated, flight: Flight | None = None) -> FloatArray:
    """North and east, metres, shape (n, 2), by the definition: d_lat (M + h), d_lon (N + h) cos(lat)."""
    table = (flight or simulated.flight)["ins"]
    motion = simulated.trajectory.at(np.searchsorted(simulated.trajectory.time_ns, table.device_time_ns.values))
    meridian, normal = curvature_radii_m(motion.latitude_deg)
    north = np.deg2rad(table.values("latitude_deg") - motion.latitude_deg) * (meridian + motion.altitude_m)
    parallel = (normal + motion.altitude_m) * np.cos(np.deg2rad(motion.latitude_deg))
    return np.stack(
        [north, np.deg2rad(wrap_180(table.values("longitude_deg") - motion.longitude_deg)) * parallel], axis=1
    )


def test_log_of_a_flight_carries_the_errors_of_its_class() -> None:
    simulated = simulate(scenario(legs=FLIGHT_LEGS, ins=FULL))
    motion = simulated.trajectory.at(every(simulated.trajectory, 5.0))
    errors = flight_errors(motion, simulated.scenario.ins, simulated.scenario.seed)
    assert np.allclose(ins_position_error_m(simulated), np.stack(errors.position_m, axis=1), atol=ROUNDING_M)
    velocity = simulated.flight["ins"].values("velocity_east_mps") - motion.velocity_east_mps
    assert np.allclose(velocity, errors.velocity_mps[1], atol=6e-4)  # resolution 0.001
    heading = wrap_180(simulated.flight["ins"].values("true_heading_deg") - motion.heading_deg)
    assert np.allclose(heading, errors.heading_deg, atol=6e-4)
    assert scenario_truth(simulated)["heading_error_deg"] == pytest.approx(errors.heading_deg[0])
    assert 0.0 < np.max(np.abs(errors.pitch_deg)) < 0.02  # 50 micro-g of levelling is 0.003 deg


def test_seeds_repeat_and_other_sensors_do_not_feel_the_error_model() -> None:
    full = simulate(scenario(legs=FLIGHT_LEGS, ins=FULL), 3)
    again, other = (simulate(scenario(legs=FLIGHT_LEGS, ins=FULL), seed) for seed in (3, 4))
    plain = simulate(scenario(legs=FLIGHT_LEGS, ins=FULL | {"error_model": "schuler"}), 3)
    assert np.array_equal(ins_position_error_m(full), ins_position_error_m(again))
    assert not np.allclose(ins_position_error_m(full), ins_position_error_m(other), atol=0.1)
    for name in ("latitude_deg", "velocity_north_mps"):
        assert np.array_equal(full.flight["gnss"].values(name), plain.flight["gnss"].values(name))


def test_fast_ins_is_read_between_the_steps_of_its_errors() -> None:
    slow = simulate(scenario(legs=FLIGHT_LEGS, ins=FULL | {"rate_hz": 10}))
    fast = simulate(scenario(legs=FLIGHT_LEGS, ins=FULL | {"rate_hz": 50}))
    assert np.allclose(ins_position_error_m(fast)[::5], ins_position_error_m(slow), atol=ROUNDING_M)


@pytest.mark.parametrize("ins_class", ["strategic", ""])
def test_unknown_class_is_said(ins_class: str) -> None:
    with pytest.raises(SettingsError, match=r"key ins\.ins_class"):
        scenario(ins={"error_model": "full", "ins_class": ins_class})


def great_circle_legs(great_circle: bool) -> list[dict[str, object]]:
    return [
        {"kind": "parked", "duration_s": 1},
        {"kind": "take_off"},
        {"kind": "climb_to", "altitude_m": 3000, "airspeed_mps": 200},
        {"kind": "fly", "duration_s": 3600, "airspeed_mps": 200, "great_circle": great_circle},
    ]


def across_track_m(great_circle: bool) -> float:
    """Largest distance of the last leg from the plane through its ends and the centre of the Earth."""
    simulated = scenario(
        legs=great_circle_legs(great_circle), internal_rate_hz=10, parking_heading_deg=80.0, ins={"rate_hz": 1}
    )
    motion = simulate(simulated).trajectory
    leg = slice(6000, len(motion))
    latitude, longitude = np.deg2rad(motion.latitude_deg[leg]), np.deg2rad(motion.longitude_deg[leg])
    unit = np.stack(
        [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], axis=1
    )
    normal = np.cross(unit[0], unit[-1])
    return float(np.max(np.abs(unit @ (normal / np.linalg.norm(normal))))) * 6.371e6


def test_great_circle_is_a_plane_through_the_centre_and_a_rhumb_line_is_not() -> None:
    assert across_track_m(True) < CHORD_M
    assert across_track_m(False) > 100.0 * CHORD_M


def test_norilsk_moscow_is_the_papers_flight(long_flight: Simulated, tmp_path: Path) -> None:
    motion = long_flight.trajectory
    assert motion.time_ns[-1] / 1e9 == pytest.approx(16_000.0, abs=1.0)
    north, east = north_east_m(motion.latitude_deg[-1], motion.longitude_deg[-1], 55.60, 37.30)
    assert float(np.hypot(north, east)) < 5e3
    cruise = (motion.time_ns > 1500e9) & (motion.time_ns < 14_200e9)
    assert np.max(np.abs(motion.rate_z_dps[cruise])) < 0.01 and np.ptp(motion.altitude_m[cruise]) < 1e-6
    error_m = np.hypot(*ins_position_error_m(long_flight).T)
    assert 2e3 < float(error_m[-1]) < 25e3  # 16 000 s at 0.25 to 3 nmi/h
    size = write_log(long_flight, tmp_path).stat().st_size
    assert 1e6 < size < 12e6


def test_forecast_outages_are_in_the_log() -> None:
    simulated = simulate(load_scenario("forecast-outages"))
    gaps = np.diff(simulated.flight.time_s("gnss"))
    assert sorted(np.round(gaps[gaps > 2.0])) == [121.0, 601.0, 1801.0]
    assert len(simulated.flight["ins"]) > 40_000


def test_classes_of_a_flight_are_in_order() -> None:
    ends = []
    for name in ("navigation", "tactical", "mems"):
        error = ins_position_error_m(simulate(scenario(legs=FLIGHT_LEGS, ins=FULL | {"ins_class": name})))
        ends.append(float(np.hypot(*error[-1] - error[0])))
    assert ends[0] < ends[1] < ends[2]


def damaged(long_flight: Simulated, *faults: Fault) -> Flight:
    return apply_faults(long_flight.flight, faults)


def test_frozen_gnss_repeats_while_the_aircraft_moves(long_flight: Simulated) -> None:
    flight = damaged(long_flight, Frozen(topic="gnss", from_s=5000.0, to_s=5600.0))
    time_s = flight.time_s("gnss")
    inside = (time_s >= 5000.0) & (time_s < 5600.0)
    for name in ("latitude_deg", "longitude_deg", "velocity_north_mps", "gdop"):
        values = flight["gnss"].values(name)
        assert np.ptp(values[inside]) == 0.0
        assert np.array_equal(values[~inside], long_flight.flight["gnss"].values(name)[~inside])
    assert inside.sum() == 600


def test_jump_displaces_the_position_for_a_while(long_flight: Simulated) -> None:
    flight = damaged(long_flight, Jump(topic="gnss", from_s=5000.0, to_s=5060.0, north_m=3000.0, east_m=-4000.0))
    before, after = long_flight.flight["gnss"], flight["gnss"]
    latitude, longitude = before.values("latitude_deg"), before.values("longitude_deg")
    moved = np.stack(
        [
            north_east_m(lat, lon, lat0, lon0, 9100.0)
            for lat, lon, lat0, lon0 in zip(
                after.values("latitude_deg")[4990:5070],
                after.values("longitude_deg")[4990:5070],
                latitude[4990:5070],
                longitude[4990:5070],
                strict=True,
            )
        ]
    )
    inside = (flight.time_s("gnss")[4990:5070] >= 5000.0) & (flight.time_s("gnss")[4990:5070] < 5060.0)
    assert inside.sum() == 60
    assert np.allclose(moved[inside], [3000.0, -4000.0], rtol=1e-3)  # the parallel is shorter 3 km further north
    assert np.all(moved[~inside] == 0.0)


def test_reset_steps_the_errors_of_the_ins_and_they_stay(long_flight: Simulated) -> None:
    fault = Reset(topic="ins", at_s=8000.0, north_m=-1500.0, east_m=700.0, north_mps=0.4, east_mps=0.0)
    flight = damaged(long_flight, fault)
    step = ins_position_error_m(long_flight, flight) - ins_position_error_m(long_flight)
    time_s = flight.time_s("ins")
    north = np.where(time_s < 8000.0, 0.0, -1500.0 + 0.4 * (time_s - 8000.0))
    assert np.allclose(step[:, 0], north, atol=0.01 * np.max(np.abs(north)))
    assert np.allclose(step[:, 1], np.where(time_s < 8000.0, 0.0, 700.0), rtol=0.01)
    velocity = flight["ins"].values("velocity_north_mps") - long_flight.flight["ins"].values("velocity_north_mps")
    assert np.allclose(velocity, np.where(time_s < 8000.0, 0.0, 0.4))
    assert np.array_equal(
        flight["ins"].values("velocity_east_mps"), long_flight.flight["ins"].values("velocity_east_mps")
    )


def test_jitter_scatters_the_times_of_one_topic_alone(long_flight: Simulated) -> None:
    flight = damaged(long_flight, Jitter(topic="gnss", spread_s=0.2))
    shift_s = (flight["gnss"].device_time_ns.values - long_flight.flight["gnss"].device_time_ns.values) / 1e9
    assert np.max(np.abs(shift_s)) <= 0.2 and np.std(shift_s) == pytest.approx(0.2 / np.sqrt(3.0), rel=0.03)
    assert np.array_equal(flight["gnss"].time_ns, long_flight.flight["gnss"].time_ns)
    ins = flight["ins"]
    assert np.array_equal(ins.device_time_ns.values, long_flight.flight["ins"].device_time_ns.values)
    rows, times = (
        np.concatenate([getattr(flight[topic], name) for topic in ("ins", "gnss")])
        for name in ("record_index", "time_ns")
    )
    device = np.concatenate([flight[topic].device_time_ns.values for topic in ("ins", "gnss")])
    order = np.argsort(rows, kind="stable")
    assert np.all(np.diff(device[order]) >= 0) and len(times) == len(rows)
    shared = np.intersect1d(flight["gnss"].record_index, ins.record_index)
    assert len(shared) == 0
    with pytest.raises(SettingsError, match="less than half"):
        damaged(long_flight, Jitter(topic="gnss", spread_s=0.5))


def test_jittered_log_is_written_in_order_of_its_clock(tmp_path: Path) -> None:
    plain = simulate(scenario(legs=[{"kind": "parked", "duration_s": 20}], gnss={"rate_hz": 2}))
    path = write_log(
        replace(plain, scenario=replace(plain.scenario, faults=(Jitter(topic="gnss", spread_s=0.1, seed=4),))), tmp_path
    )
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    times = [float(line.partition(",")[0]) for line in lines[1:]]
    assert times == sorted(times) and len(times) > len(plain.flight["ins"])


@pytest.mark.parametrize(
    ("faults", "samples", "longest_gap_s"),
    [
        ((Dropout(topic="gnss", from_s=60.0, to_s=1e6),), 60, 1.0),  # GNSS for a minute only
        ((Dropout(topic="gnss", from_s=0.0, to_s=1e6),), 0, 0.0),  # a receiver that never had a fix
        ((Dropout(from_s=7000.0, to_s=10_600.0),), 16_001 - 3600, 3601.0),  # an hour of nothing
        ((NotANumber(topic="gnss", field="latitude_deg", from_s=0.0, to_s=1e6),), 16_001, 1.0),
    ],
)
def test_losses_of_gnss(
    long_flight: Simulated, faults: tuple[Fault, ...], samples: int, longest_gap_s: float, tmp_path: Path
) -> None:
    flight = damaged(long_flight, *faults)
    assert len(flight["gnss"]) == samples
    assert np.max(np.diff(flight.time_s("gnss")), initial=0.0) == pytest.approx(longest_gap_s)
    nan = np.isnan(flight["gnss"].values("latitude_deg"))
    assert np.all(nan) == any(isinstance(fault, NotANumber) for fault in faults) or samples == 0
    path = write_log(replace(long_flight, scenario=replace(long_flight.scenario, faults=faults)), tmp_path)
    rows = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    column = rows[0].split(",").index("gnss.longitude_deg") if samples else None
    filled = sum(1 for row in rows[1:] if column is not None and row.split(",")[column])
    assert filled == samples


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"kind": "frozen", "topic": "gnss", "from_s": 1, "to_s": 2}, "gnss repeats one sample from 1 to 2 s"),
        (
            {"kind": "jump", "topic": "gnss", "from_s": 1, "to_s": 2, "north_m": 5000},
            "gnss position off by 5000 m north, 0 m east from 1 to 2 s",
        ),
        (
            {"kind": "reset", "topic": "ins", "at_s": 3, "east_m": 9, "north_mps": 1.5},
            "ins errors step by 0 m north, 9 m east, 1.5 and 0 m/s at 3 s",
        ),
        ({"kind": "jitter", "topic": "gnss", "spread_s": 0.01}, "times of gnss scatter by up to 0.01 s"),
    ],
)
def test_faults_are_read_from_a_scenario_and_told(table: dict[str, object], text: str) -> None:
    assert [describe(fault) for fault in scenario(faults=[table]).faults] == [text]
