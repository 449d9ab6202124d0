"""Whole analysis on simulated logs: what is accepted, doubtful and refused, and that sigmas hold."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.geodesy import north_east_m
from groundstation.simulation.imu.families import Family
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu
from groundstation.simulation.imu.scenario import ImuScenario
from groundstation.simulation.imu.settings import (
    ImuSettings,
    MountingSettings,
    ReceiverSettings,
    StampSettings,
    WheelSettings,
)
from groundstation.simulation.imu.tables import log_tables
from groundstation.simulation.scenario import LogInterval
from groundstation.systems.known import Known
from groundstation.systems.trajectory.aid_settings import AidSettings
from groundstation.systems.trajectory.aiding import may_roll
from groundstation.systems.trajectory.answer import TRAVEL
from groundstation.systems.trajectory.estimate import Estimate, estimate
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements
from groundstation.systems.trajectory.judge import outage_rows, raised
from groundstation.systems.trajectory.outages import LENGTHS_S, Outages, replay, starts_of
from groundstation.systems.trajectory.sampling import at_times
from groundstation.systems.trajectory.settings import TrajectorySettings
from groundstation.systems.trajectory.solve import solve
from groundstation.systems.trajectory.states import NO_SLIP, POSITION
from groundstation.systems.trajectory.track import smoothed_track
from groundstation.tables.phases import flight_phases
from groundstation.tables.vehicle import Vehicle

WITHIN = 4.0  # sigmas: of some hundred independent errors none is larger


def inputs(flight: ImuFlight) -> tuple[ImuIncrements, GnssFixes]:
    """Input of the estimator from a simulated flight, axes those of the body."""
    gnss = flight.gnss
    imu = ImuIncrements(
        flight.time_s,
        flight.interval_s,
        flight.delta_angle_rad @ flight.case_from_body,
        flight.delta_velocity_mps @ flight.case_from_body,
        flight.is_integral,
    )
    fixes = GnssFixes(
        gnss.time_s,
        gnss.latitude_deg,
        gnss.longitude_deg,
        gnss.height_m,
        gnss.velocity_mps,
        gnss.position_sigma_m,
        gnss.velocity_sigma_mps,
        np.zeros(len(gnss.time_s), dtype=bool),
    )
    return imu, fixes


def errors_over_sigma(flight: ImuFlight, done: Estimate) -> dict[str, np.ndarray]:
    """Errors of the smoothed states over their sigmas, once a second after a minute.

    A constant turn of the axes is taken off.
    """
    time_s = np.arange(60.0, flight.true_time_s[-1] - 1.0, 1.0)
    states = at_times(smoothed_track(done.problem.samples, done.result), time_s)
    at = np.searchsorted(flight.true_time_s, time_s)
    north, east = north_east_m(
        states.latitude_deg, states.longitude_deg, flight.latitude_deg[at], flight.longitude_deg[at]
    )
    heading = np.asarray(wrap_180(states.heading_deg - flight.heading_deg[at]))
    heading = heading - np.median(heading)
    return {
        "north": north / states.position_sigma_m[:, 0],
        "east": east / states.position_sigma_m[:, 1],
        "velocity": (states.velocity_mps - flight.velocity_mps[at])[:, :2].ravel()
        / states.velocity_sigma_mps[:, :2].ravel(),
        "heading": heading / states.attitude_sigma_deg[:, 2],
    }


@cache
def found(family: Family) -> tuple[ImuFlight, Estimate]:
    """A simulated log and its estimate."""
    flight = simulate_imu(family, 3, settings=ImuSettings(duration_s=300.0, rate_hz=50.0))
    return flight, estimate(*inputs(flight), may_roll=family == "drive", may_stop=family == "drive")


@pytest.mark.parametrize("family", ["drive", "uav"])
def test_errors_agree_with_their_sigmas(family: Family) -> None:
    flight, done = found(family)
    for name, ratio in errors_over_sigma(flight, done).items():
        assert np.sqrt(np.mean(ratio**2)) < 2.0, name
        assert np.abs(ratio).max() < WITHIN, name
    assert len(done.hypotheses) == 1 or done.hypotheses[0].likelihood - done.hypotheses[1].likelihood > 10.0


def test_latency_lever_arm_and_gap_are_found() -> None:
    settings = ImuSettings(
        duration_s=300.0,
        rate_hz=50.0,
        gnss=ReceiverSettings(latency_s=0.3),
        mounting=MountingSettings(lever_arm_m=(0.8, -0.4, -0.6)),
        stamps=StampSettings(gaps=(LogInterval(100.0, 100.4),)),
    )
    done = estimate(*inputs(simulate_imu("uav", 5, settings=settings)), may_stop=False)
    assert done.latency_s == pytest.approx(0.3, abs=0.02)
    assert done.lag_s == pytest.approx(0.0, abs=0.03)


def test_outages_grow_with_their_length_and_stay_inside() -> None:
    outages = replay(found("drive")[1])
    rms = [float(np.sqrt(np.mean(outages.error_m[outages.of_length(length)] ** 2))) for length in (10.0, 60.0)]
    assert rms[0] < rms[1] < 20.0
    assert np.mean(outages.ratio <= 1.0) > 0.8
    assert np.median(outages.forward_end_m / outages.error_m) > 1.5


def test_outages_tried_are_those_told_and_those_left_out_with_the_reason() -> None:
    flight, done = found("drive")
    gone = (100.0, 160.0)  # a tunnel: no GNSS
    inside = (done.result.plan.valid_s >= gone[0]) & (done.result.plan.valid_s < gone[1])
    kind = np.where(inside & (done.result.plan.seen.kind == POSITION), NO_SLIP, done.result.plan.seen.kind)
    plan = replace(done.result.plan, seen=done.result.plan.seen._replace(kind=kind))
    outages = replay(replace(done, result=replace(done.result, plan=plan)))
    rows = outage_rows(outages, 1.0, 1.0)
    tried = {length: sum(map(len, starts_of(done, length))) for length in LENGTHS_S}
    assert {row.length_s: row.count + row.standing_count + row.without_gnss_count for row in rows} == {
        row.length_s: tried[row.length_s] for row in rows
    }
    assert len(outages) == sum(row.count for row in rows)
    assert len(outages) + len(outages.left_out_length_s) == sum(tried.values())
    ten = rows[0]
    within = [start for start in np.concatenate(starts_of(done, 10.0)) if gone[0] <= start and start + 10.0 <= gone[1]]
    assert ten.length_s == 10.0 and ten.without_gnss_count >= len(within) > 0
    assert flight.family == "drive"


def test_no_sideways_motion_is_of_what_rolls_and_can_be_switched_off() -> None:
    on, off = AidSettings(), AidSettings(use_no_sideways_motion=False)
    assert [may_roll(kind, on) for kind in ("rolls", "flies", "walks", "floats", None)] == [True, *[False] * 4]
    assert not may_roll("rolls", off)
    settings = ImuSettings(duration_s=240.0, rate_hz=25.0, imu_class="consumer", wheels=WheelSettings(rate_hz=10.0))
    log = log_tables(simulate_imu("drive", 4, settings=settings), ImuScenario("drive")).without("truth")
    known = Known(phases=replace(flight_phases(log), vehicle=Vehicle("rolls", "stated")))
    free, held = (solve(log, known, TrajectorySettings(aids=one))[0] for one in (off, on))
    assert held.aids[0].name == "no sideways motion" and held.aids[0].is_used
    assert held.parameter(TRAVEL[0]) is not None and "no sideways" in str(held.innovations)
    assert not any(row.is_used for row in free.aids) and "switched off" in free.aids[0].reason
    assert "switched off" in next(row.reason for row in free.aids if row.name == "wheel speed")
    assert free.parameter(TRAVEL[0]) is None and "no sideways" not in str(free.innovations)
    minute = [next(row for row in one.outages if row.length_s == 60.0) for one in (free, held)]
    assert minute[0].forward_end_rms_m > 2.0 * minute[1].forward_end_rms_m  # type: ignore[operator]
    short = log_tables(simulate_imu("drive", 4, settings=replace(settings, duration_s=90.0)), ImuScenario("drive"))
    boat = Known(phases=replace(flight_phases(short), vehicle=Vehicle("floats", "stated")))
    afloat = solve(short.without("truth"), boat, TrajectorySettings())[0]
    assert afloat.parameter(TRAVEL[0]) is None and "no sideways motion" not in {row.name for row in afloat.aids}


def test_later_in_time_all_is_the_same() -> None:
    flight = simulate_imu("uav", 6, settings=ImuSettings(duration_s=200.0, rate_hz=50.0))
    imu, gnss = inputs(flight)
    plain = estimate(imu, gnss, may_stop=False, fit=False)
    later = estimate(
        replace(imu, time_s=imu.time_s + 1e5), replace(gnss, time_s=gnss.time_s + 1e5), may_stop=False, fit=False
    )
    assert later.result.likelihood == pytest.approx(plain.result.likelihood, abs=1.0)
    assert later.result.constants[:30] == pytest.approx(plain.result.constants[:30], abs=1e-3)


def test_a_gap_makes_two_segments_and_the_longer_one_is_told_of() -> None:
    """The shorter one comes first: what is told of is looked for by its place."""
    stamps = StampSettings(gaps=(LogInterval(75.0, 78.0),))
    flight = simulate_imu("uav", 7, settings=ImuSettings(duration_s=190.0, rate_hz=25.0, stamps=stamps))
    log = log_tables(flight, ImuScenario("uav")).without("truth")
    answer, _findings, _solved = solve(log, Known(phases=flight_phases(log)), TrajectorySettings())
    assert [round(one.end_s - one.start_s) for one in answer.segments] == pytest.approx([75, 112], abs=3)
    assert sum(row.count for row in answer.held_out if row.quantity == "vertical position") > 30


def test_sigmas_are_raised_until_the_rms_of_outages_is_theirs() -> None:
    count, zeros = 12, np.zeros(12)
    wide = np.zeros((count, 3))
    error = np.where(np.arange(count) == 0, 6.0, 1.0)  # one outage is far beyond, the other eleven inside
    outages = Outages(
        zeros, np.full(count, 60.0), error, np.ones(count), error / 2.0, error, wide, wide, wide, zeros, zeros
    )
    factors, rows = raised(outages, None, 0.1, rolls=False)
    assert factors.position >= np.sqrt(np.mean(error**2)) > 1.0
    (row,) = outage_rows(outages, factors.position, factors.height)
    assert row.rms_over_sigma <= 1.0
    assert "in those of 60 s the RMS error is 1.98 times its sigma" in rows[0].reason
