"""The bank of noise sets: coarse epochs, weights from finished outages alone, a mixture that says how far it is off."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.toml_settings import settings_from
from groundstation.methods.ins_noise import BankFactors, Calibration, GnssNoise, InsNoise, class_names, load_class
from groundstation.systems.inertial.bank import NoiseBank, run_bank
from groundstation.systems.inertial.coarse import COARSE_S, Coarse
from groundstation.systems.inertial.estimate import estimate_ins_errors
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, initial_of, run_filter
from groundstation.systems.inertial.hindcast import hindcast
from groundstation.systems.inertial.leads import leads_of, past_mean, start_epochs
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import claimed_sigma
from tests.systems.inertial.flights import batch_of, flight_of

SETTINGS = InertialSettings()
ALONE = BankFactors((1.0,), (1.0,), (1.0,), (1.0,), (1.0,))
LEADS_S = leads_of(600.0, 3600.0)
ROUNDING = 1e-9


@pytest.fixture(scope="module")
def run() -> ChannelsRun:
    return estimate_ins_errors(flight_of(batch_of(duration_s=12_000.0, route="manoeuvring"))).run


@pytest.fixture(scope="module")
def bank(run: ChannelsRun) -> NoiseBank:
    return run_bank(run, SETTINGS)


def test_sets_are_every_combination_and_random_drifts_go_with_their_times() -> None:
    noise = load_class("navigation")
    sets = noise.bank.sets(noise)
    assert len(sets) == len(set(sets)) == 16
    pairs = {(one.random_drift_dph, one.random_drift_correlation_s) for one in sets}
    assert len(pairs) == 2
    with pytest.raises(ValueError, match="zip"):
        BankFactors(random_drift=(1.0,), random_drift_correlation=(1.0, 2.0)).sets(noise)
    with pytest.raises(SettingsError, match="bank_scale"):
        Calibration(bank_scale=(1.0,))


def test_coarse_epochs_are_means_of_what_was_used(run: ChannelsRun) -> None:
    found = Coarse.of(run)
    coarse, epochs = found.epochs, run.epochs
    assert found.samples == COARSE_S
    third = slice(20, 30)
    assert coarse.time_s[2] == pytest.approx(epochs.time_s[third].mean())
    assert coarse.position_m[2] == pytest.approx(epochs.position_m[third].mean(axis=0))
    assert coarse.velocity_mps[2] == pytest.approx(epochs.velocity_mps[third].mean(axis=0))
    assert (found.begin_s[2], found.end_s[2]) == (epochs.time_s[20], epochs.time_s[29])
    used = np.array(run.used)
    used[22, 0] = -1
    without = Coarse.of(replace(run, used=used)).epochs
    kept = np.delete(np.arange(20, 30), 2)
    assert without.position_m[2] == pytest.approx(epochs.position_m[kept].mean(axis=0))
    assert without.time_s[2] == pytest.approx(epochs.time_s[kept].mean())


def test_slow_gnss_and_a_reset_have_epochs_of_their_own() -> None:
    time_s = np.arange(0.0, 600.0)
    position = np.where((np.arange(600) % 15 == 4)[:, None], time_s[:, None] * [1.0, -2.0], np.nan)
    is_reset = time_s == 87.0
    epochs = replace(DifferenceEpochs.plain(time_s, position, np.full_like(position, np.nan)), is_reset=is_reset)
    noise = load_class("navigation")
    model = estimate_ins_errors(flight_of(batch_of(duration_s=600.0))).run.model
    run = run_filter(epochs, model, noise, initial=initial_of(epochs, noise), gate=1e12)
    found = Coarse.of(run)
    coarse = found.epochs
    assert found.samples == 1.0
    seen = np.isfinite(coarse.position_m[:, 0])
    assert coarse.position_m[seen, 0] == pytest.approx(coarse.time_s[seen])
    assert seen.sum() == 40
    assert np.flatnonzero(coarse.is_reset).tolist() == [9]
    assert coarse.time_s[9] == pytest.approx(np.mean([87.0, 88.0, 89.0]))
    assert np.all(np.diff(coarse.time_s) > 0.0)


def test_nothing_of_a_gap_is_in_the_epochs_that_are_blinded(run: ChannelsRun) -> None:
    begin_s, end_s = float(run.epochs.time_s[5405]), float(run.epochs.time_s[6013])
    cut = Coarse.of(run).blinded(5405, begin_s, end_s, end_s + 600.0)
    assert cut.time_s[0] == begin_s
    assert np.isnan(cut.position_m[cut.time_s < end_s + COARSE_S / 2.0]).all()
    assert np.isfinite(cut.position_m[cut.time_s > end_s + COARSE_S]).all()
    assert end_s + 580.0 < cut.time_s[-1] < end_s + 600.0


def test_a_bank_of_the_class_alone_forecasts_as_the_last_estimate(run: ChannelsRun) -> None:
    """Ten-second means lose nothing: within 2 % of the claimed sigma, and that within 1 %."""
    one = replace(run, noise=replace(run.noise, bank=ALONE))
    at = start_epochs(run.epochs, 5400.0, 600.0)
    replay = hindcast(one, at, LEADS_S, ("noise_bank", "last_estimate"), SETTINGS)
    claimed = {method: claimed_sigma(method, one, replay, SETTINGS) for method in replay.forecast_m}
    assert claimed["noise_bank"] is not None and claimed["last_estimate"] is not None
    sigma = claimed["last_estimate"].model_m
    apart = (replay.forecast_m["noise_bank"] - replay.forecast_m["last_estimate"]) / sigma
    assert np.sqrt(np.mean(np.square(apart))) < 0.05
    assert claimed["noise_bank"].model_m / sigma == pytest.approx(1.0, abs=0.02)


def test_weights_sum_to_one_and_are_equal_before_any_outage_was_over(bank: NoiseBank) -> None:
    weight = bank.weights(np.array([600.0, 2399.0, 2401.0, 9000.0]))
    assert weight.sum(axis=0) == pytest.approx(1.0)
    assert weight[:, :2] == pytest.approx(1.0 / len(bank.runs))
    assert weight[:, 2].std() > 0.0
    assert weight[:, 3].max() > 2.0 / len(bank.runs)


def test_the_variance_is_that_of_a_mixture(run: ChannelsRun, bank: NoiseBank) -> None:
    at = start_epochs(run.epochs, 5400.0, 600.0)
    replay = hindcast(run, at, LEADS_S, ("noise_bank",), SETTINGS, bank)
    singles = [
        hindcast(run, at, LEADS_S, ("noise_bank",), SETTINGS, replace(bank, flown=run, runs=(member,))).forecast_m[
            "noise_bank"
        ]
        for member in bank.runs
    ]
    weight = bank.weights(replay.start_s)
    mean = np.einsum("ks,kslc->slc", weight, np.stack(singles))
    assert np.abs(replay.forecast_m["noise_bank"] - mean).max() < 1e-6
    spread = np.einsum("ks,kslc->slc", weight, np.square(np.stack(singles) - mean))
    assert np.all(replay.variance_m2["noise_bank"] > spread)


def test_nothing_later_than_a_start_is_used(run: ChannelsRun, bank: NoiseBank) -> None:
    begin = float(run.epochs.time_s[9000])
    position = np.array(run.epochs.position_m)
    later = run.epochs.time_s > begin
    position[later] += 3000.0 * np.sin(run.epochs.time_s[later] / 200.0)[:, None]
    other = replace(run, epochs=replace(run.epochs, position_m=position))
    at = np.array([6000, 9000])
    whole, changed = (hindcast(each, at, LEADS_S, ("noise_bank",), SETTINGS, None) for each in (run, other))
    assert np.abs(whole.forecast_m["noise_bank"] - changed.forecast_m["noise_bank"]).max() < ROUNDING
    ratio = whole.variance_m2["noise_bank"] / changed.variance_m2["noise_bank"]
    assert ratio == pytest.approx(1.0, rel=ROUNDING)
    assert not np.allclose(bank.weights(np.array([11_900.0])), run_bank(other, SETTINGS).weights(np.array([11_900.0])))


def test_past_mean_counts_what_was_over_and_how_far_it_reached_back() -> None:
    start_s = np.array([0.0, 300.0, 600.0, 900.0, 3000.0])
    values = np.array([[1.0], [3.0], [np.nan], [8.0], [100.0]])
    mean, independent = past_mean(values, start_s, 600.0, np.array([0.0, 599.0, 600.0, 1200.0, 1500.0]))
    assert mean[:, 0].tolist() == [0.0, 0.0, 1.0, 2.0, 4.0]
    assert independent == pytest.approx([0.0, 0.0, 1.0, 1.5, 1.75])
    nothing, none = past_mean(np.zeros((0, 2)), np.zeros(0), 600.0, np.array([5.0]))
    assert nothing.tolist() == [[0.0, 0.0]] and none.tolist() == [0.0]


def test_the_white_part_of_gnss_falls_with_the_samples_averaged() -> None:
    noise = GnssNoise(4.0, 3.0, 300.0, 0.2, 0.1, 60.0).averaged(16.0)
    assert (noise.position_white_m, noise.position_correlated_m) == (1.0, 3.0)
    assert (noise.velocity_white_mps, noise.velocity_correlated_mps) == (0.05, 0.1)


@pytest.mark.parametrize("name", class_names())
def test_the_shipped_classes_hold_under_the_strict_rules_for_users(name: str) -> None:
    file = ShippedToml("groundstation.methods", "ins_classes", "ins_class").read(name)
    assert load_class(name) == settings_from(InsNoise, {"name": name} | file.table, file.where)


def test_a_class_file_may_leave_the_scales_of_other_models_out(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text("[calibration]\nhorizon_min = [10.0, 60.0]\nscale = [1.2, 1.5]\n", encoding="utf-8")
    calibration = load_class(str(file)).calibration
    lead_s = np.array([600.0, 3600.0])
    assert calibration.at(lead_s).tolist() == pytest.approx([1.2, 1.5])
    assert calibration.at(lead_s, "coupled").tolist() == calibration.at(lead_s, "bank").tolist() == [1.0, 1.0]
