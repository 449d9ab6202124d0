"""Aids beside GNSS: what helps, what is left out with its reason, and that a wrong one changes nothing."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.records import Column
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.simulation.imu.dataflash import write_dataflash
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu
from groundstation.simulation.imu.scenario import ImuScenario
from groundstation.simulation.imu.settings import (
    BarometerSettings,
    CompassSettings,
    ImuSettings,
    ReceiverSettings,
    WheelSettings,
)
from groundstation.simulation.imu.tables import log_tables, write_csv
from groundstation.simulation.imu.ulog import write_ulog
from groundstation.systems.known import AircraftData, Known
from groundstation.systems.trajectory.aid_settings import AidSettings
from groundstation.systems.trajectory.aiding import aided
from groundstation.systems.trajectory.aids_answer import AidRow
from groundstation.systems.trajectory.aids_input import Aids, aids_of
from groundstation.systems.trajectory.estimate import Estimate, estimate
from groundstation.systems.trajectory.examine import examine_trajectory
from groundstation.systems.trajectory.inputs import AidReadings, GnssFixes
from groundstation.systems.trajectory.outages import replay
from groundstation.systems.trajectory.pressure_checks import Beside, beside_gnss
from groundstation.systems.trajectory.sampling import at_times
from groundstation.systems.trajectory.settings import TrajectorySettings
from groundstation.systems.trajectory.solve import solve
from groundstation.systems.trajectory.study.family import known_model, known_sigmas
from groundstation.systems.trajectory.track import smoothed_track
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight
from tests.systems.trajectory.test_solve import inputs

TIME_S = np.arange(0.0, 400.0, 0.1)
FT_PER_M = 1.0 / 0.3048
ORDINARY = AidSettings()


def climb(time_s: np.ndarray) -> np.ndarray:
    """Height of a flight that climbs to 80 m and swells there."""
    return 200.0 + 80.0 * np.clip((time_s - 60.0) / 60.0, 0.0, 1.0) + 6.0 * np.sin(time_s / 15.0) * (time_s > 120.0)


def fixes(sigma_m: float = 1.5) -> GnssFixes:
    """Fixes at 5 Hz with that noise of the height."""
    time_s = TIME_S[::2]
    count, rng = len(time_s), np.random.default_rng(1)
    height = climb(time_s) + sigma_m * rng.standard_normal(count)
    place, velocity = np.full(count, 56.0), np.zeros((count, 3))
    velocity[:, 0] = 12.0 + 3.0 * np.sin(time_s / 9.0)
    sigma = np.full((count, 3), sigma_m)
    return GnssFixes(time_s, place, place, height, velocity, sigma, 0.1 * sigma, np.zeros(count, dtype=bool))


def beside(value: np.ndarray) -> Beside:
    """Judge readings at 10 Hz against those fixes."""
    seconds = value.reshape(-1, 10)
    return beside_gnss(
        TIME_S.reshape(-1, 10).mean(axis=1), np.median(seconds, axis=1), TIME_S, value, fixes(), ORDINARY
    )


def pressure() -> np.ndarray:
    """Sound readings: another level, air 3 % thicker, noise."""
    return 1.03 * climb(TIME_S) - 45.0 + 0.3 * np.random.default_rng(2).standard_normal(len(TIME_S))


def test_level_and_air_of_the_day_are_taken_off() -> None:
    found = beside(pressure())
    assert not found.wrong
    off = found.height_m - climb(found.time_s)
    assert np.std(off) < 0.6  # 3 % of 80 m would be more
    assert abs(np.median(off)) < 0.5


def test_spikes_are_no_jump_and_are_not_seen() -> None:
    value = pressure()
    value[np.random.default_rng(3).choice(len(value), 80, replace=False)] += 300.0
    found = beside(value)
    assert not found.wrong
    assert np.abs(found.height_m - climb(found.time_s)).max() < 5.0


def stuck(value: np.ndarray) -> np.ndarray:
    return np.where((TIME_S > 70.0) & (TIME_S < 140.0), value[700], value)


WRONG = {
    "one height for": stuck,
    "one height": lambda value: np.full_like(value, value[0]),
    "jumps by": lambda value: value + 12.0 * (TIME_S > 250.0),
    "feet in place of metres": lambda value: value * FT_PER_M,
    "metres taken for feet": lambda value: value / FT_PER_M,
    "moves by -1.0": lambda value: -value,
    "moves by 0.0": lambda value: value * 0.01,
}


@pytest.mark.parametrize("why", WRONG)
def test_readings_that_cannot_be_right_are_named(why: str) -> None:
    assert why in beside(WRONG[why](pressure())).wrong


def test_a_jump_of_gnss_is_not_the_barometers() -> None:
    gnss = fixes()
    gnss = replace(gnss, height_m=gnss.height_m + 15.0 * (gnss.time_s > 250.0))
    value = pressure()
    found = beside_gnss(
        TIME_S.reshape(-1, 10).mean(axis=1), np.median(value.reshape(-1, 10), axis=1), TIME_S, value, gnss, ORDINARY
    )
    assert not found.wrong


# ------------------------------------------------------------------------------------------------- simulated logs


@cache
def driven() -> tuple[ImuFlight, Estimate]:
    """A car with a consumer unit, a barometer and wheels, and its estimate without them."""
    settings = ImuSettings(
        duration_s=240.0,
        rate_hz=25.0,
        imu_class="consumer",
        barometer=BarometerSettings(rate_hz=10.0, gust_m=0.2, drift_m=1.0),
        wheels=WheelSettings(rate_hz=10.0),
    )
    flight = simulate_imu("drive", 4, settings=settings)
    prior, sigmas = known_model(settings), known_sigmas(settings)
    return flight, estimate(*inputs(flight), may_roll=True, prior=prior, sigmas=sigmas, fit=False)


def tables(flight: ImuFlight) -> Flight:
    return log_tables(flight, ImuScenario(flight.family)).without("truth")


def aids(flight: ImuFlight, log: Flight | None = None, aircraft: AircraftData | None = None) -> Aids:
    """Aids of a simulated log."""
    log = tables(flight) if log is None else log
    known = Known(phases=flight_phases(log), aircraft=AircraftData() if aircraft is None else aircraft)
    return aids_of(log, known, inputs(flight)[1], ORDINARY, rolls=flight.family == "drive")


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.slow
def test_barometer_and_wheels_make_outages_smaller_and_coverage_stays() -> None:
    flight, plain = driven()
    done, rows = aided(plain, aids(flight), ORDINARY, ambiguous_below=10.0)
    assert {row.name: row.is_used for row in rows} == {"barometer": True, "wheel speed": True}
    before, after = replay(plain), replay(done)
    assert rms(after.error_m) < 0.8 * rms(before.error_m)
    assert rms(after.down_m) < 0.9 * rms(before.down_m)
    assert np.mean(after.ratio <= 1.0) >= 0.9
    assert np.mean(after.down_ratio <= 1.0) >= 0.9
    scale, sigma = done.result.constants[-1], float(np.sqrt(done.result.constants_variance[-1]))
    assert scale == pytest.approx(flight.settings.wheels.scale - 1.0, abs=4.0 * sigma)
    assert sigma < 0.002


def test_an_aid_that_does_not_fit_leaves_the_estimate_as_it_was() -> None:
    """A barometer that jumps where no check of the input looks: the innovations find it."""
    flight, plain = driven()
    height = aids(flight).height
    assert height is not None
    steps = np.cumsum(np.random.default_rng(1).choice([-40.0, 0.0, 40.0], len(height)))
    row = AidRow("barometer", "baro", True, "")
    done, rows = aided(
        plain,
        Aids(AidReadings(height.time_s, height.value + steps, height.change), rows=(row,)),
        ORDINARY,
        ambiguous_below=10.0,
    )
    assert done is plain
    assert [one.is_used for one in rows] == [False]
    assert rows[0].is_wrong and "limit" in rows[0].reason


def test_wheels_of_another_unit_are_named_and_those_of_an_aircraft_not_used() -> None:
    flight, _ = driven()
    log = tables(flight)
    odometry = log["odometry"]
    speed = odometry.values("speed_mps")
    for factor, why in ((3.6, "km/h in place of m/s"), (-1.0, "reversed")):
        changed = replace(odometry, columns={"speed_mps": Column(factor * speed)})
        found = aids(flight, replace(log, tables={**log.tables, "odometry": changed}))
        assert found.speed is None
        assert why in next(row.reason for row in found.rows if row.name == "wheel speed")
    known = Known(phases=flight_phases(log))
    assert aids_of(log, known, inputs(flight)[1], ORDINARY, rolls=False).speed is None


def test_switches_leave_aids_out() -> None:
    flight, _ = driven()
    log, off = tables(flight), AidSettings(use_barometer=False, use_wheel_speed=False)
    found = aids_of(log, Known(phases=flight_phases(log)), inputs(flight)[1], off, rolls=True)
    assert found.height is None and found.speed is None and not found.rows


@cache
def hovered() -> tuple[ImuFlight, Estimate]:
    """A multicopter that hardly moves, whose receiver has poor positions and no velocity: two headings fit."""
    settings = ImuSettings(
        duration_s=90.0,
        rate_hz=50.0,
        imu_class="consumer",
        gnss=ReceiverSettings(position_white_m=8.0),
        compass=CompassSettings(rate_hz=10.0),
    )
    flight = simulate_imu("hover", 3, settings=settings)
    imu, gnss = inputs(flight)
    return flight, estimate(imu, replace(gnss, velocity_mps=np.full_like(gnss.velocity_mps, np.nan)), may_stop=False)


def heading_errors_deg(flight: ImuFlight, done: Estimate) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the smoothed heading and their sigmas."""
    time_s = np.arange(60.0, 85.0)
    states = at_times(smoothed_track(done.problem.samples, done.result), time_s)
    true = flight.heading_deg[np.searchsorted(flight.true_time_s, time_s)]
    return np.asarray(wrap_180(states.heading_deg - true)), states.attitude_sigma_deg[:, 2]


def test_a_compass_of_stated_deviation_decides_where_motion_does_not() -> None:
    flight, plain = hovered()
    assert plain.hypotheses[0].likelihood - plain.hypotheses[1].likelihood < 10.0
    stated = AircraftData(compass_deviation_deg=flight.settings.compass.deviation_deg)
    done, rows = aided(plain, aids(flight, aircraft=stated), ORDINARY, ambiguous_below=10.0)
    assert [row.is_used for row in rows] == [True]
    assert len(done.hypotheses) == 1 or done.hypotheses[0].likelihood - done.hypotheses[1].likelihood > 10.0
    error, sigma = heading_errors_deg(flight, done)
    assert np.abs(error / sigma).max() < 3.0
    assert np.median(sigma) < 5.0 < np.median(heading_errors_deg(flight, plain)[1])


def test_a_compass_against_the_motion_is_left_out() -> None:
    flight, plain = hovered()
    turned = (179.0, *flight.settings.compass.deviation_deg[1:])
    done, rows = aided(
        plain, aids(flight, aircraft=AircraftData(compass_deviation_deg=turned)), ORDINARY, ambiguous_below=10.0
    )
    assert done is plain
    assert rows[0].is_wrong and "motion shows" in rows[0].reason


def test_without_stated_deviation_a_compass_is_not_used_and_the_reason_is_told() -> None:
    flight, _ = hovered()
    found = aids(flight)
    assert found.compass is None
    assert [(row.name, row.is_used, row.is_wrong) for row in found.rows] == [("magnetic heading", False, False)]
    assert "compass_deviation_deg" in found.rows[0].reason


@pytest.mark.parametrize("write", [write_csv, write_ulog, write_dataflash])
def test_a_barometer_comes_through_every_format(write: object, tmp_path: Path) -> None:
    settings = ImuSettings(duration_s=20.0, rate_hz=50.0, barometer=BarometerSettings(rate_hz=10.0))
    flight, scenario = simulate_imu("uav", 1, settings=settings), ImuScenario("uav")
    path = tmp_path / {write_csv: "x.csv", write_ulog: "x.ulg", write_dataflash: "x.BIN"}[write]  # type: ignore[index]
    write(path, flight, scenario)  # type: ignore[operator]
    mcap = tmp_path / "x.mcap"
    found = read_flight(mcap, convert_log(open_log(path), mcap))["baro"].values("pressure_altitude_m")
    assert found == pytest.approx(flight.aids.pressure_altitude_m, abs=0.01)


def stuck_barometer(log: Flight) -> Flight:
    """The log with a barometer that keeps one height."""
    baro = log["baro"]
    one = np.full(len(baro), 100.0)
    return replace(log, tables={**log.tables, "baro": replace(baro, columns={"pressure_altitude_m": Column(one)})})


def test_check_names_a_stuck_barometer() -> None:
    log = stuck_barometer(tables(driven()[0]))
    known = Known(phases=flight_phases(log))
    told = [one.text for one in examine_trajectory(log, known, TrajectorySettings())]
    assert "baro: barometer does not aid: it keeps one height" in told


@pytest.mark.slow
def test_a_stuck_barometer_changes_nothing_but_a_finding() -> None:
    log = tables(driven()[0])
    answers = []
    for one in (log.without("baro"), stuck_barometer(log)):
        answers.append(solve(one, Known(phases=flight_phases(one)), TrajectorySettings()))
    (plain, before, _), (answer, findings, _) = answers
    assert replace(answer, aids=plain.aids, figures=()) == replace(plain, figures=())
    new = [one.code for one in findings if one not in before]
    assert new == ["trajectory.barometer"]
