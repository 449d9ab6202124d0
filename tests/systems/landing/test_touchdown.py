"""Touchdown by its witnesses: against simulated truth, with what lacks, what disagrees, and what is none."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.markdown import markdown
from groundstation.pipeline.api import open_flight
from groundstation.results.answer import by_analysis
from groundstation.simulation.touchdown import (
    SimulatedTouchdown,
    TouchdownChannels,
    TouchdownMotion,
    simulate_touchdown,
)
from groundstation.systems.known import Known
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import Approach, LandingResult
from groundstation.systems.landing.evidence import Evidence, evidence_of
from groundstation.systems.landing.finals import _rolls_on
from groundstation.systems.landing.findings import findings_of
from groundstation.systems.landing.path import path_of
from groundstation.systems.landing.second_contact import second_contacts
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.landing.sink import sink_rate_of
from groundstation.systems.landing.touchdown_answer import Touchdown, Witness
from groundstation.systems.landing.touchdown_study import FAMILIES, TouchdownFamily, _mean_sink, drawn, study_touchdown
from groundstation.systems.landing.witnesses import LoadSamples, by_wheel_speed, decaying_sum
from groundstation.tables.phases import PhaseInterval, Phases, flight_phases
from tests.real_logs import real_log
from tests.report_example import example
from tests.told import chapter_of

NOTHING = TouchdownChannels(
    load_hz=0.0, pitch_hz=0.0, wheels_hz=0.0, radio_hz=0.0, has_altitude=False, has_vertical_speed=False
)
PLAIN = TouchdownMotion(speed_mps=60.0, sink_mps=1.0)


def made(
    motion: TouchdownMotion = PLAIN, channels: TouchdownChannels | None = None, seed: int = 3
) -> SimulatedTouchdown:
    return simulate_touchdown(motion, channels or TouchdownChannels(), np.random.default_rng(seed))


def evidence(simulated: SimulatedTouchdown, guess_off_s: float = -4.0) -> Evidence:
    path = path_of(simulated.flight, LandingSettings())
    found = evidence_of(simulated.flight, path, simulated.contact_s + guess_off_s)
    assert found is not None
    return found


def holds(found: Evidence, simulated: SimulatedTouchdown) -> bool:
    return found.confidence95_s[0] <= simulated.contact_s <= found.confidence95_s[1]


def witness(found: Evidence | Touchdown, name: str) -> Witness:
    return next(one for one in found.witnesses if one.name.startswith(name))


def approach(simulated: SimulatedTouchdown, *phases: tuple[float, float, Any]) -> Approach:
    """The approach by phases whose flight ends 5 s too early."""
    end_s = simulated.contact_s - 5.0
    told = phases or ((0.0, end_s, "airborne"), (end_s, simulated.flight.duration_s, "landing roll"))
    known = Known(Phases(tuple(PhaseInterval(*one) for one in told), "detector: said"))
    return LANDING.run(simulated.flight, known, LandingSettings()).answer.approaches[0]


def test_all_witnesses_together_find_the_contact() -> None:
    simulated = made()
    found = evidence(simulated)
    assert holds(found, simulated) and found.time_s == pytest.approx(simulated.contact_s, abs=0.25)
    assert found.sigma_s < 0.6
    assert "normal acceleration" in found.found_by
    assert {one.state for one in found.witnesses if one.time_s is not None} == {"agrees"}


@pytest.mark.parametrize("guess_off_s", [-6.0, 0.0, 3.0])
def test_the_first_guess_does_not_matter(guess_off_s: float) -> None:
    simulated = made()
    assert evidence(simulated, guess_off_s).time_s == pytest.approx(evidence(simulated).time_s, abs=0.1)


@pytest.mark.parametrize(
    ("channels", "name", "widest_s"),
    [
        (replace(NOTHING, load_hz=16.0), "normal acceleration", 0.3),
        (replace(NOTHING, wheel_speed_hz=4.0), "wheel speed", 0.4),
        (replace(NOTHING, radio_hz=4.0), "radio altitude", 3.0),
        (replace(NOTHING, has_altitude=True, has_vertical_speed=True, receiver_hz=10.0), "height", 3.0),
        (replace(NOTHING, pitch_hz=10.0), "pitch", 2.0),
        (replace(NOTHING, wheels_hz=1.0), "weight on wheels", 1.0),
    ],
)
def test_each_witness_alone_holds_the_contact(channels: TouchdownChannels, name: str, widest_s: float) -> None:
    simulated = made(channels=channels)
    found = evidence(simulated)
    assert [one.name for one in found.witnesses if one.state != "not used"] == [witness(found, name).name]
    assert holds(found, simulated) and (witness(found, name).sigma_s or np.inf) < widest_s
    assert all(one.reason for one in found.witnesses if one.state == "not used")


def test_a_slow_load_is_no_witness_and_says_why() -> None:
    found = evidence(made(channels=TouchdownChannels(load_hz=1.0)))
    assert "falls between the samples" in witness(found, "normal acceleration").reason


def test_a_wheel_speed_that_begins_one_sample_before_the_spin_up_is_a_witness() -> None:
    simulated = made(channels=replace(NOTHING, wheel_speed_hz=2.0))
    flight, table = simulated.flight, simulated.flight["discrete"]
    at_s = flight.time_s("discrete")
    late = table.take(at_s >= at_s[np.searchsorted(at_s, simulated.contact_s) - 1])
    grid_s = simulated.contact_s + np.arange(-12.0, 12.0, 0.02)
    found = by_wheel_speed(replace(flight, tables={**flight.tables, "discrete": late}), 60.0, grid_s)
    assert found.likelihood is not None
    assert abs(float(grid_s[np.argmax(found.likelihood)]) - simulated.contact_s) < 0.6


@pytest.mark.parametrize("slope", [-0.015, 0.015])
def test_a_runway_that_rises_or_falls_is_measured_and_moves_nothing(slope: float) -> None:
    channels = replace(NOTHING, has_altitude=True, has_vertical_speed=True, receiver_hz=5.0)
    simulated = made(replace(PLAIN, slope=slope), channels)
    found = evidence(simulated)
    ground = found.heights[0][1]
    assert ground is not None and ground.slope == pytest.approx(slope, abs=0.005)
    assert holds(found, simulated) and found.time_s == pytest.approx(simulated.contact_s, abs=1.5)
    sink = sink_rate_of(found)
    assert sink is not None and sink.sigma_mps is not None
    assert sink.rate_mps == pytest.approx(1.3, abs=2.5 * sink.sigma_mps), "onto the runway, not against the horizon"


def test_the_sink_rate_by_an_altitude_allows_for_a_runway_that_is_uneven() -> None:
    channels = replace(NOTHING, load_hz=8.0, has_altitude=True, has_vertical_speed=True, receiver_hz=5.0)
    kinked = replace(PLAIN, slope=0.03, kink=-0.01)
    for seed in range(4):
        found = sink_rate_of(evidence(made(kinked, channels, seed)))
        assert found is not None and found.sigma_mps is not None and found.topic == "gnss"
        assert abs(found.rate_mps - _mean_sink(kinked)) < NORMAL_95 * found.sigma_mps


def test_a_tail_dragger_gives_no_witness_of_pitch() -> None:
    simulated = made(replace(PLAIN, nose_after_s=None))
    found = evidence(simulated)
    assert witness(found, "pitch").reason == "the nose does not fall" and holds(found, simulated)


def test_a_late_switch_disagrees_and_is_told() -> None:
    simulated = made(channels=TouchdownChannels(load_hz=16.0, wheels_hz=4.0, wheels_late_s=5.0))
    told = approach(simulated)
    assert told.touchdown is not None
    assert told.touchdown.time_s == pytest.approx(simulated.contact_s, abs=0.3)
    assert witness(told.touchdown, "weight on wheels").state == "disagrees"
    assert "landing.witness_disagrees" in {one.code for one in findings_of(LandingResult((told,)))}


def test_a_bounce_is_a_second_contact_and_a_plain_landing_has_none() -> None:
    channels = TouchdownChannels(load_hz=16.0)
    bounced = made(replace(PLAIN, bounce_s=1.5, sink_mps=1.5), channels)
    found = evidence(bounced)
    assert bounced.second_contact_s is not None
    assert [one.time_s for one in second_contacts(found)] == [pytest.approx(bounced.second_contact_s, abs=0.3)]
    assert not second_contacts(evidence(made(channels=channels)))


def test_scattered_light_samples_of_a_roll_out_are_no_spell_in_the_air() -> None:
    found = evidence(made())
    time_s = np.arange(found.time_s - 30.0, found.time_s + 10.0, 0.125)
    load_g = np.where(np.arange(len(time_s)) % 4 == 0, 0.93, 1.0)
    load_g[(time_s >= found.time_s) & (time_s < found.time_s + 0.3)] = 1.4
    load_g[(time_s >= found.time_s + 4.0) & (time_s < found.time_s + 4.2)] = 1.2
    rolling = replace(found, load=LoadSamples("ins.accelerometer", time_s, load_g))
    assert second_contacts(rolling) == ()
    load_g = np.where((time_s > found.time_s + 2.0) & (time_s < found.time_s + 4.0), 0.9, load_g)
    (one,) = second_contacts(replace(found, load=LoadSamples("ins.accelerometer", time_s, load_g)))
    assert one.time_s == pytest.approx(found.time_s + 4.0, abs=0.2)


def test_a_touch_and_go_is_one() -> None:
    simulated = made()
    down, again = simulated.contact_s, simulated.contact_s + 8.0
    told = approach(
        simulated, (0.0, down, "airborne"), (down, down + 4.0, "landing roll"), (down + 4.0, again, "take-off run"),
        (again, simulated.flight.duration_s, "airborne"),
    )  # fmt: skip
    assert told.outcome == "touch-and-go" and told.touchdown is not None
    assert told.touchdown.time_s == pytest.approx(simulated.contact_s, abs=0.5)


@pytest.mark.filterwarnings("error")
def test_a_roll_without_any_speed_is_no_touch_and_go() -> None:
    path = path_of(made().flight, LandingSettings())
    silent = replace(path, ground_speed_mps=np.full(len(path.time_s), np.nan))
    assert _rolls_on(path, 90.0, 92.0) and not _rolls_on(silent, 90.0, 92.0)


def test_what_is_set_down_has_no_touchdown() -> None:
    flight = made().flight
    slow = {**flight["gnss"].columns}
    speed = flight["gnss"].values("ground_speed_mps")
    time_s = flight.time_s("gnss")
    slow["ground_speed_mps"] = replace(slow["ground_speed_mps"], values=np.where(time_s > 70.0, 3.0, speed))
    flight = replace(flight, tables={**flight.tables, "gnss": replace(flight["gnss"], columns=slow)})
    told = approach(replace(made(), flight=flight))
    assert told.touchdown is None and "too slowly to roll" in told.touchdown_reason


def test_without_any_witness_the_phases_are_told_to_be_alone() -> None:
    told = approach(made(channels=NOTHING))
    assert told.touchdown is not None and told.touchdown.confidence95_s is None
    assert told.touchdown.time_sigma_s == 3.0
    assert "landing.touchdown_unwitnessed" in {one.code for one in findings_of(LandingResult((told,)))}


def test_the_page_has_the_witnesses() -> None:
    answer = LandingResult((approach(made()),))
    section = chapter_of(replace(example(), answers=by_analysis(answer), figures=()), answer)
    told = markdown(section)
    assert "witnesses of the touchdown" in told and "Normal acceleration, ins.accelerometer" in told
    assert "Wheel speed" in told and "Not logged." in told and "onto the runway" in told


def test_spikes_and_gaps_are_no_contact() -> None:
    simulated = made(channels=TouchdownChannels(load_hz=16.0))
    table = simulated.flight["ins.accelerometer"]
    load = table.values("accel_z_mps2").copy()
    load[np.searchsorted(simulated.flight.time_s("ins.accelerometer"), simulated.contact_s - 6.0)] = 30.0
    columns = {"accel_z_mps2": replace(table.columns["accel_z_mps2"], values=load)}
    tables = {**simulated.flight.tables, "ins.accelerometer": replace(table, columns=columns)}
    spiked = replace(simulated, flight=replace(simulated.flight, tables=tables))
    assert evidence(spiked).time_s == pytest.approx(simulated.contact_s, abs=0.25)


def test_the_study_tells_every_family_and_repeats() -> None:
    first, again = (study_touchdown(3, 5, families=FAMILIES[:2]) for _ in range(2))
    data = first.tables[0]
    assert data.columns["family"].tolist() == ["plain", "gust"] and first.markdown == again.markdown
    assert drawn(np.random.default_rng(1)) == drawn(np.random.default_rng(1))


def test_a_family_in_which_nothing_is_measured_is_told_without_a_warning() -> None:
    deaf = TouchdownFamily("deaf", "no channel", lambda motion, channels, rng: (motion, NOTHING))
    (figure,) = study_touchdown(1, seed=1, families=(deaf,)).tables
    assert figure.columns["measured"][0] == 0.0 and np.isnan(figure.columns["coverage"][0])


@pytest.mark.slow
def test_the_interval_holds_what_it_says() -> None:
    data = study_touchdown(100, 9, families=FAMILIES[:1]).tables[0]
    assert data.columns["coverage"][0] >= 0.9  # 95 % less two standard deviations of the share
    assert data.columns["sink_coverage"][0] >= 0.9


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("log", "guess_s", "right_s"),
    [
        ("g1000/log_220417_125002_LFQA.csv", 2668.8, (2673.0, 2674.0)),
        ("g1000/log_210623_141501_TEST1.csv", 4352.6, (4355.6, 4355.6)),
        ("approach/Specimen_Flight.hdf5", 2198.6, (2196.6, 2196.8)),
        ("approach/flight_with_go_around_and_landing.hdf5", 13284.0, (13278.5, 13280.0)),
    ],
)
def test_recorded_touchdowns(log: str, guess_s: float, right_s: tuple[float, float]) -> None:
    flight = open_flight(real_log(log)).flight
    found = evidence_of(flight, path_of(flight, LandingSettings()), guess_s)
    assert found is not None
    assert found.confidence95_s[0] <= right_s[1] and found.confidence95_s[1] >= right_s[0]
    assert abs(found.time_s - np.mean(right_s)) < 1.5


@pytest.mark.real_log
def test_a_multicopter_touches_nothing_down() -> None:
    flight = open_flight(real_log("dataflash/copter_3.6.7_log0041.BIN")).flight
    path = path_of(flight, LandingSettings())
    ends = [one.end_s for one in flight_phases(flight).intervals if one.phase == "airborne"]
    assert all(evidence_of(flight, path, end_s) is None for end_s in [*ends, 0.5 * flight.duration_s])


def test_decaying_sum_is_the_filter_of_scipy_to_the_bit() -> None:
    values = np.exp(20.0 * np.random.default_rng(0).normal(size=(9, 161)))
    for gain, keep in ((0.04, 0.963), (0.0132, 0.9868)):
        assert np.array_equal(decaying_sum(gain, keep, values), lfilter([gain], [1.0, -keep], values, axis=-1))
