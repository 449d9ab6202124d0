"""The forecast replayed: on simulated flights, on a real one against published figures, and never with the future."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.systems.inertial import leads as forecast_leads
from groundstation.systems.inertial.estimate import Estimation, estimate_ins_errors
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, initial_of, run_filter
from groundstation.systems.inertial.forecast import assess_forecast
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.inertial.hindcast import hindcast
from groundstation.systems.inertial.leads import leads_of, start_epochs
from groundstation.systems.inertial.model import POSITION, SIZE, ChannelModel
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import claimed_sigma
from groundstation.systems.inertial.starts import start_states
from tests.real_logs import real_log
from tests.systems.inertial.flights import batch_of, flight_of, without_rows

SETTINGS = InertialSettings()
ROUNDING_M = 1e-6
# RMS in metres at 10, 30, 60, 90 and 120 min on ff02 as published with the task: same starts, same protocol
FORECAST_HORIZONS_MIN = (10.0, 30.0, 60.0, 90.0, 120.0)
STARTS = (41, 37, 31, 25, 19)
PUBLISHED = {
    "raw_ins": (842.0, 2116.0, 1788.0, 1209.0, 2710.0),
    "hold_velocity": (330.0, 2371.0, 5994.0, 6568.0, 9181.0),
    "schuler_fit": (175.0, 572.0, 846.0, 1121.0, 1747.0),
}
TUNED_ELSEWHERE = (61.0, 407.0, 941.0, 1018.0, 1358.0)
RTS_GAPS = {10.0: 7.0, 30.0: 34.0, 60.0: 111.0, 90.0: 331.0}


@pytest.fixture(scope="module")
def found() -> Estimation:
    return estimate_ins_errors(flight_of(batch_of(duration_s=14_400.0, route="norilsk_moscow")))


@pytest.fixture(scope="module")
def forecast(found: Estimation) -> ForecastResult:
    return assess_forecast(found, settings=SETTINGS)


def cut(run: ChannelsRun, epoch: int) -> ChannelsRun:
    """The run of a flight that ended at an epoch."""
    part = slice(0, epoch + 1)
    epochs = run.epochs
    past = DifferenceEpochs(
        epochs.time_s[part],
        epochs.position_m[part],
        epochs.velocity_mps[part],
        epochs.drag_per_s[part],
        epochs.is_reset[part],
    )
    first = initial_of(past, run.noise)
    return run_filter(past, run.model, run.noise, gate=SETTINGS.gate_sigmas**2, initial=first)


@pytest.mark.parametrize("method", [method for method in FORECAST_METHODS if method != "noise_bank"])
def test_a_start_uses_nothing_later_than_itself(found: Estimation, method: str) -> None:
    epoch = 9000
    whole = start_states(method, found.run, np.array([epoch]), SETTINGS)
    short = start_states(method, cut(found.run, epoch), np.array([epoch]), SETTINGS)
    scale = np.array([1.0, 1e-2, 1e-6, 1e-10, 1e-14, 1e-10])[:, None]  # of the states, SI
    assert np.abs((whole - short)[0] / scale).max() < ROUNDING_M


def test_the_scale_of_the_sigma_uses_only_outages_that_were_over(found: Estimation) -> None:
    run, lead_s = found.run, leads_of(60.0, 1800.0)
    at = start_epochs(run.epochs, 1800.0, 300.0)
    early = run.epochs.time_s[at] <= 7200.0
    position = np.array(run.epochs.position_m)
    later = run.epochs.time_s > 7200.0
    position[later] += 5000.0 * np.sin(run.epochs.time_s[later] / 300.0)[:, None]
    other = replace(run, epochs=replace(run.epochs, position_m=position))
    scales = []
    for each in (run, other):
        claimed = claimed_sigma(
            "last_estimate", each, hindcast(each, at, lead_s, ["last_estimate"], SETTINGS), SETTINGS
        )
        assert claimed is not None
        scales.append(claimed.scale)
    assert np.array_equal(scales[0][early], scales[1][early])
    assert not np.array_equal(scales[0][-1], scales[1][-1])


def test_every_method_and_horizon_of_the_contract_is_there(forecast: ForecastResult) -> None:
    assert {row.method for row in forecast.skill} == set(FORECAST_METHODS)
    assert {row.horizon_min for row in forecast.skill} == {1.0, 5.0, 10.0, 30.0, 60.0, 90.0, 120.0}
    for row in forecast.skill:
        assert row.median_m <= row.p95_m
        assert (row.coverage95 is None) == (row.method in PUBLISHED)


def test_the_filter_beats_the_raw_ins_and_the_held_velocity_at_ten_minutes(forecast: ForecastResult) -> None:
    rms = {row.method: row.rms_m for row in forecast.skill if row.horizon_min == 10.0}
    assert rms["last_estimate"] < 0.5 * min(rms["raw_ins"], rms["hold_velocity"])


def test_data_on_both_sides_beat_data_on_one(forecast: ForecastResult) -> None:
    errors = {(row.method, row.length_min): row.max_error_rms_m for row in forecast.gaps}
    for length in (10.0, 30.0, 60.0):
        assert errors["rts", length] < 0.5 * errors["forward", length]


def test_the_classic_starts_are_compared_at_equal_horizons(forecast: ForecastResult) -> None:
    starts = {(row.start_h, row.horizon_min) for row in forecast.classic_starts}
    assert {(hours, 30.0) for hours in (1.5, 2.0, 2.5, 3.0)} <= starts
    assert {row.method for row in forecast.classic_starts} >= {"last_estimate", "windows", "raw_ins"}


def test_the_map_is_rectangular_and_empty_beyond_the_flight(forecast: ForecastResult, found: Estimation) -> None:
    figure = next(figure for figure in forecast.figures if figure.name == "forecast_map")
    starts, leads = np.unique(figure["start_s"]), np.unique(figure["horizon_min"])
    assert len(figure) == len(starts) * len(leads)
    beyond = figure["start_s"] + 60.0 * figure["horizon_min"] > found.run.epochs.time_s[-1] + 1.0
    assert np.isnan(figure["last_estimate_m"][beyond]).all()
    assert np.isfinite(figure["last_estimate_m"][~beyond]).all()


def test_the_coupled_model_is_used_when_it_is_chosen(found: Estimation, forecast: ForecastResult) -> None:
    separate = assess_forecast(found, settings=InertialSettings(model="separate"))
    assert separate.coupled == forecast.coupled
    chosen = {row.horizon_min: row.rms_m for row in forecast.skill if row.method == "last_estimate"}
    for row in separate.coupled:  # what the separate model's result announces is what the coupled one delivers
        assert chosen[row.horizon_min] == pytest.approx(row.rms_m, rel=1e-9)
    scales = [{row.scale for row in each.calibration if row.method == "last_estimate"} for each in (forecast, separate)]
    assert not scales[0] & scales[1]
    others = [row for row in forecast.skill if row.method == "windows"]
    assert others == [row for row in separate.skill if row.method == "windows"]


def test_an_outage_of_the_log_is_crossed_by_the_method_and_model_chosen() -> None:
    flight = flight_of(batch_of(duration_s=7200.0))
    time_s = flight.time_s("gnss")
    lost = without_rows(flight, "gnss", (time_s < 4000.0) | (time_s > 5800.0))
    tracks = {}
    for name, settings in (
        ("filter", InertialSettings()),
        ("windows", InertialSettings(default_method="windows")),
        ("bank", InertialSettings(default_method="noise_bank")),
        ("separate", InertialSettings(model="separate")),
    ):
        tracks[name] = estimate_ins_errors(lost, settings=settings).corrected_error_m
    inside = slice(5000, 5700)
    assert np.array_equal(tracks["filter"][:4000], tracks["windows"][:4000])
    for other in ("windows", "bank", "separate"):
        apart = np.abs(tracks[other][inside] - tracks["filter"][inside]).max()
        assert 1.0 < apart < 5000.0  # m: another forecast, of the same INS


def test_a_short_flight_says_that_it_is_not_calibrated() -> None:
    short = estimate_ins_errors(flight_of(batch_of(duration_s=2400.0)))
    result = assess_forecast(short, settings=SETTINGS)
    assert not result.is_calibrated
    assert "Schuler period" in result.calibration_reason
    assert max(row.horizon_min for row in result.skill) <= 20.0


def test_held_velocity_and_raw_ins_are_what_they_say() -> None:
    time_s = np.arange(4000.0)
    velocity = np.tile([0.5, -0.25], (4000, 1))
    epochs = DifferenceEpochs.plain(time_s, velocity * time_s[:, None], velocity)
    found = estimate_ins_errors(flight_of(batch_of(duration_s=1200.0)))
    run = run_filter(epochs, found.run.model, found.noise)
    replay = hindcast(run, np.array([2000]), leads_of(60.0, 600.0), ["raw_ins", "hold_velocity"], SETTINGS)
    assert np.abs(replay.error_m("hold_velocity")).max() < ROUNDING_M
    expected = np.hypot(0.5, 0.25) * replay.lead_s
    assert np.abs(replay.radial_m("raw_ins")[0] - expected).max() < ROUNDING_M


@pytest.fixture(scope="module")
def real_forecast(tmp_path_factory: pytest.TempPathFactory) -> ForecastResult:
    from groundstation.pipeline.one_flight.convert import convert_log
    from groundstation.pipeline.one_flight.flight import read_flight
    from groundstation.pipeline.one_flight.log import open_log

    path = real_log("inertial/gv_ff02.csv")
    mcap = Path(tmp_path_factory.mktemp("ff02")) / "flight.mcap"
    flight = read_flight(mcap, convert_log(open_log(path, None), mcap))
    return assess_forecast(estimate_ins_errors(flight), settings=SETTINGS)


@pytest.mark.parametrize("method", PUBLISHED)
def test_simple_methods_agree_with_the_published_figures(real_forecast: ForecastResult, method: str) -> None:
    rows = {row.horizon_min: row for row in real_forecast.skill if row.method == method}
    assert tuple(rows[horizon].starts for horizon in FORECAST_HORIZONS_MIN) == STARTS
    digitised = 0.02  # the start of the fit, the mean latitude and the sphere are the author's own choice
    for horizon, published in zip(FORECAST_HORIZONS_MIN, PUBLISHED[method], strict=True):
        assert rows[horizon].rms_m == pytest.approx(published, rel=digitised)


def test_the_shipped_method_beats_a_filter_tuned_on_another_flight(real_forecast: ForecastResult) -> None:
    rows = {row.horizon_min: row for row in real_forecast.skill if row.method == real_forecast.default_method}
    for horizon, published in zip(FORECAST_HORIZONS_MIN, TUNED_ELSEWHERE, strict=True):
        assert rows[horizon].rms_m < published


def test_gaps_of_the_real_flight_are_near_the_published_ones(real_forecast: ForecastResult) -> None:
    shortfall = 1.1  # at 90 min we are 8 % worse, at the others better
    for row in real_forecast.gaps:
        if row.method == "rts":
            assert row.max_error_rms_m < shortfall * RTS_GAPS[row.length_min]


@pytest.mark.parametrize("channels", [1, 2])
def test_forecast_is_the_model_step_by_step_with_the_drag_of_the_sphere(channels: int) -> None:
    """Any states and drags of two starts, against the whole transition applied at each step."""
    rng = np.random.default_rng(8)
    model, count, leads, every = ChannelModel.at(50.0, 9000.0, 1e-3), 2, 4, 3
    states = rng.standard_normal((count, SIZE, channels)) * np.array([10.0, 1.0, 1e-4, 1e-7, 1e-11, 1e-7])[:, None]
    known, drag = rng.standard_normal((count, channels)), 1e-3 * rng.standard_normal((every * leads, 2, 2, count))
    path = forecast_leads.Path(np.zeros(count), 30.0 * np.arange(1.0, leads + 1.0), known, drag, 10.0, every)
    phi, x, expected = model.transition_over(10.0), states, []
    for step in range(every * leads):
        moved = np.einsum("ijs,sj->si", drag[step], x[:, POSITION] + known) if channels == 2 else 0.0
        x = phi @ x
        x[:, POSITION] += moved
        if (step + 1) % every == 0:
            expected.append(np.array(x[:, POSITION]))
    assert path.carried(model, states) == pytest.approx(np.stack(expected, axis=1), rel=1e-12)
    held = path.carried(None, states) - path.carried(None, np.where(np.arange(SIZE)[:, None] == 1, 0.0, states))
    if channels == 1:
        assert held[:, :, 0] == pytest.approx(path.lead_s * states[:, 1], rel=1e-12)
