"""The return of GNSS after an outage: what is used at once, what is not, and what the smoother makes of the outage."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.methods.ins_noise import InsNoise
from groundstation.simulation.inertial_family import ErrorBatch, simulate_family
from groundstation.systems.inertial import coupled
from groundstation.systems.inertial.channel_group import ChannelGroup
from groundstation.systems.inertial.estimate import Estimation, estimate_ins_errors
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, Initial, run_filter, smooth
from groundstation.systems.inertial.model import POSITION, FloatArray
from groundstation.systems.inertial.seams import FACTOR_MAX, PATIENCE_S, factor_of, fixes_since, returns_of
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.study.cases import NO_GATE, differences_of, epochs_of, full_case, model_of
from groundstation.tables.table import Flight
from tests.systems.inertial.flights import changed, flight_of, without_rows

CASE = full_case("manoeuvring", "", "navigation", "manoeuvring", 2500)
SETTINGS = InertialSettings()
GAP_S, BEHIND_S = 600, 5400
# Outages of 10 min of run 1 at whose end the position is 5 to 8 sigma of the two separate channels off
SEAMS_S = (4500, 5100, 6300, 12_300, 13_200)
AS_GOOD = 1.2  # of the issue: RTS error over that without rejection
WORSE = 2.0  # by which rejection for a minute made it worse
COVERED = 0.85
SAME_M = 1.0


@pytest.fixture(scope="module")
def batch() -> ErrorBatch:
    return simulate_family(CASE.family, 1, CASE.seed, first_run=1)


@pytest.fixture(scope="module")
def flown(batch: ErrorBatch) -> ChannelsRun:
    return run_filter(epochs_of(CASE, batch, 0), model_of(CASE, batch, 0), CASE.noise)


def replayed(
    flown: ChannelsRun, start: int, gap_s: int = GAP_S, *, gate: float = 25.0, **changes: FloatArray
) -> ChannelsRun:
    """The filter from a start on without GNSS for a while; ``changes`` are added to what is measured behind it."""
    epochs, use = flown.epochs, slice(start, start + gap_s + BEHIND_S)
    columns = {name: np.array(getattr(epochs, name)[use]) for name in ("position_m", "velocity_mps")}
    for name, values in columns.items():
        values[:gap_s] = np.nan
        values[gap_s:] += changes.get(name, 0.0)
    cut = DifferenceEpochs(
        epochs.time_s[use], columns["position_m"], columns["velocity_mps"], epochs.drag_per_s[use], epochs.is_reset[use]
    )
    initial = Initial(flown.x[start], flown.P[:, start])
    return run_filter(cut, flown.model, flown.noise, gate=gate, initial=initial)


def errors_of(run: ChannelsRun, batch: ErrorBatch, start: int) -> tuple[float, float]:
    """Largest radial error of the smoother in the outage, and the share of its errors within 1.96 of its sigmas."""
    truth, found = batch.position_error_m[0][start : start + GAP_S], smooth(run)
    error = found.x[:GAP_S, POSITION] - truth
    inside = np.abs(error) < 1.96 * np.sqrt(found.variance[:GAP_S, POSITION])
    return float(np.hypot(*error.T).max()), float(inside.mean())


def sigmas_off(run: ChannelsRun) -> float:
    """How far the forecast is from the first fix, in sigmas of the model, by the worse channel."""
    variance = run.covariance_beforehand(0)[GAP_S - 1, POSITION, POSITION] + 49.0  # of a fix, as the gate believes it
    return float(np.abs(run.epochs.position_m[GAP_S] - run.x[GAP_S - 1, POSITION]).max() / np.sqrt(variance))


def test_the_smoother_crosses_a_seam_as_well_as_without_rejection(
    batch: ErrorBatch, flown: ChannelsRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours = [replayed(flown, start) for start in SEAMS_S]
    assert all(4.8 < sigmas_off(run) < 8.0 and len(run.seams) == 1 and not (run.used == -1).any() for run in ours)
    free = [replayed(flown, start, gate=NO_GATE) for start in SEAMS_S]
    monkeypatch.setattr(ChannelGroup, "_seam_at", lambda *_: None)  # as it was: rejected until patience ends
    before = [replayed(flown, start) for start in SEAMS_S]
    found = [
        [errors_of(run, batch, start) for run, start in zip(runs, SEAMS_S, strict=True)]
        for runs in (ours, free, before)
    ]
    rms = [float(np.sqrt(np.mean([largest**2 for largest, _ in part]))) for part in found]
    assert rms[0] < AS_GOOD * rms[1]
    assert rms[2] > WORSE * rms[1]
    assert np.mean([inside for _, inside in found[0]]) > COVERED > np.mean([inside for _, inside in found[1]])


def test_the_sigma_of_an_outage_is_that_of_the_model_times_the_factor(flown: ChannelsRun) -> None:
    run = replayed(flown, SEAMS_S[0])
    (seam,) = run.seams
    assert (seam.last, seam.first, seam.back) == (0, GAP_S, GAP_S)
    blind = replayed(flown, SEAMS_S[0], gate=NO_GATE)
    inside = slice(1, GAP_S)
    np.testing.assert_allclose(run.P[:, inside], seam.factor**2 * blind.P[:, inside], rtol=1e-9)
    np.testing.assert_allclose(run.covariance_beforehand(0)[:GAP_S], blind.P[0, :GAP_S], rtol=1e-9)
    np.testing.assert_allclose(run.x[inside], blind.x[inside], rtol=1e-12)
    assert np.isfinite(run.covariance_without_data).all()


def test_a_receiver_that_agrees_with_itself_far_off_waits_for_patience(flown: ChannelsRun) -> None:
    """Half a nautical mile after ten minutes, 14 sigma: rejected for a minute, then opened, which is told."""
    run = replayed(flown, 9000, position_m=np.array([926.0, 0.0]))
    assert run.seams == () and run.reopened == 1
    rejected = (run.used[:, 0] == -1).any(axis=1)
    assert rejected[GAP_S : GAP_S + round(PATIENCE_S)].all()


def test_a_jump_without_an_outage_is_never_a_seam(flown: ChannelsRun) -> None:
    epochs, at = flown.epochs, 8000
    position = np.array(epochs.position_m)
    position[at:] += 150.0
    run = run_filter(replace(epochs, position_m=position), flown.model, flown.noise)
    assert run.seams == () and run.reopened == 1
    assert (run.used[at : at + round(PATIENCE_S), 0] == -1).all()


def test_position_alone_is_told_from_an_error_of_the_model_sooner() -> None:
    """A forecast that is off in position is off in velocity too; a receiver that is misled need not be."""
    predicted = np.array([[65.0**2, 0.94 * 65.0 * 0.25], [0.94 * 65.0 * 0.25, 0.25**2]])
    believed = np.array([49.0, 0.024])
    alone, as_model = (factor_of(np.array([500.0, velocity]), predicted, believed) for velocity in (0.0, 1.8))
    assert alone > 1.3 * as_model


def test_fixes_that_disagree_do_not_open_the_filter_and_odd_ones_are_left_out(flown: ChannelsRun) -> None:
    plain = replayed(flown, SEAMS_S[1])
    rng = np.random.default_rng(8)
    wild = np.zeros((BEHIND_S, 2))
    wild[:8] = 400.0 * rng.standard_normal((8, 2))
    run = replayed(flown, SEAMS_S[1], position_m=wild)
    (seam,) = run.seams
    assert GAP_S + 5 <= seam.back <= GAP_S + 8 and seam.first == GAP_S
    assert (run.used[GAP_S : seam.back] == -1).all() and (run.used[seam.back :] == 1).all()
    assert np.abs(run.x[-1, POSITION] - plain.x[-1, POSITION]).max() < SAME_M
    never = replayed(flown, SEAMS_S[1], position_m=400.0 * rng.standard_normal((BEHIND_S, 2)))
    assert never.seams == ()


def test_a_gap_in_one_channel_alone_is_judged_by_that_channel(flown: ChannelsRun) -> None:
    start, epochs = SEAMS_S[1], flown.epochs
    position, velocity = np.array(epochs.position_m), np.array(epochs.velocity_mps)
    for values in (position, velocity):
        values[start + 1 : start + GAP_S, 0] = np.nan
    run = run_filter(replace(epochs, position_m=position, velocity_mps=velocity), flown.model, flown.noise)
    assert len(run.parts) == 2 and run.seams_of_parts[1] == ()
    assert all(seam.first == start + GAP_S for seam in run.seams_of_parts[0])


def test_no_factor_is_larger_than_what_explains_the_innovation() -> None:
    predicted, believed = np.diag([100.0, 1.0]), np.array([4.0, 0.04])
    assert factor_of(np.array([5.0, 0.5]), predicted, believed) == 1.0
    assert factor_of(np.array([70.0, 7.0]), predicted, believed) == pytest.approx(7.0, rel=0.01)
    assert factor_of(np.array([1e6, 0.0]), predicted, believed) == np.inf
    assert factor_of(np.array([FACTOR_MAX * 10.0]), predicted[:1, :1], np.array([1e-9])) == pytest.approx(FACTOR_MAX)


def test_returns_are_those_after_an_outage() -> None:
    time_s = np.concatenate([np.arange(50.0), np.arange(100.0, 150.0)])
    is_fix = np.ones(100, dtype=bool)
    assert returns_of(time_s, is_fix).tolist() == [50]
    is_fix[[20, 21, 22, 23, 24]] = False  # five seconds
    assert returns_of(time_s, is_fix).tolist() == [50]
    is_fix[:12] = False
    assert returns_of(time_s, is_fix).tolist() == [12, 50]
    slow = np.arange(0.0, 3000.0, 30.0)
    assert returns_of(slow, np.ones(100, dtype=bool)).tolist() == []
    assert returns_of(slow, np.zeros(100, dtype=bool)).tolist() == []


def test_fixes_are_positions_where_there_are_any_and_a_dead_channel_does_not_count() -> None:
    time_s, nothing = np.arange(100.0), np.full((100, 2), np.nan)
    position, velocity = np.array(nothing), np.zeros((100, 2))
    assert fixes_since(time_s, position, velocity, 20).tolist() == list(range(20, 85))
    position[::10, 0] = 1.0
    assert fixes_since(time_s, position, velocity, 20).tolist() == [20, 30, 40, 50, 60, 70, 80]


def short(noise: InsNoise, factor: float) -> InsNoise:
    """Noise that claims so many times too little of the INS."""
    return replace(
        noise,
        drift_dph=noise.drift_dph / factor,
        random_drift_dph=noise.random_drift_dph / factor,
        tilt_walk_deg_per_sqrt_h=noise.tilt_walk_deg_per_sqrt_h / factor,
        velocity_walk_mps_per_sqrt_s=noise.velocity_walk_mps_per_sqrt_s / factor,
        accelerometer_ug=noise.accelerometer_ug / factor,
    )


def test_the_coupled_model_opens_by_its_own_scaled_sigma_and_never_to_20_km(batch: ErrorBatch) -> None:
    epochs, start = epochs_of(CASE, batch, 0), 5100
    position, velocity = np.array(epochs.position_m), np.array(epochs.velocity_mps)
    for values in (position, velocity):
        values[start + 1 : start + GAP_S] = np.nan
    differences = differences_of(batch, 0, replace(epochs, position_m=position, velocity_mps=velocity))
    run = coupled.run_coupled(differences, short(CASE.noise, 12.0), SETTINGS)
    back = start + GAP_S
    assert run.reopened == 0 and (run.used[back : back + 30, 0] == 1).all()
    assert (run.sigma[back + 1 :, coupled.CHANNELS[:, POSITION]] < 100.0).all()
    position[back:] += 3000.0
    jumped = replace(differences, epochs=replace(differences.epochs, position_m=position))
    far = coupled.run_coupled(jumped, short(CASE.noise, 12.0), SETTINGS)
    assert far.reopened >= 1 and (far.used[back : back + round(PATIENCE_S), 0] == -1).all()
    assert far.sigma[back:, coupled.CHANNELS[:, POSITION]].max() < 5000.0


@pytest.fixture(scope="module")
def flight(batch: ErrorBatch) -> Flight:
    return flight_of(batch)


def with_outage(flight: Flight, start_s: float) -> Flight:
    time_s = flight.time_s("gnss")
    return without_rows(flight, "gnss", (time_s <= start_s) | (time_s >= start_s + GAP_S))


def codes(found: Estimation) -> dict[str, int]:
    return {finding.code: finding.count or 0 for finding in found.findings}


def test_a_seam_is_told_and_a_misled_receiver_is_told_louder(flight: Flight) -> None:
    cut = with_outage(flight, 5100.0)
    found = estimate_ins_errors(cut)
    (told,) = [finding for finding in found.findings if finding.code == "inertial.seam"]
    assert "after 600 s without it" in told.text and "5700" in told.place and told.severity == "warn"
    assert "inertial.reopened" not in codes(found)
    late = cut.time_s("gnss") > 5400.0
    shifted = changed(cut, "gnss", latitude_deg=cut["gnss"].values("latitude_deg") + np.where(late, 0.02, 0.0))
    misled = estimate_ins_errors(shifted)
    assert "inertial.seam" not in codes(misled) and codes(misled)["inertial.reopened"] == 1


def test_an_outage_that_the_sigma_covers_is_no_seam(flown: ChannelsRun) -> None:
    run = replayed(flown, 7500)
    assert sigmas_off(run) < 4.0
    assert run.seams == () and not (run.used == -1).any()
