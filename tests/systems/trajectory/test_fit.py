"""Fit of the noise: the score against differences of the likelihood, and noise that is found again."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from groundstation.simulation.imu.flight import simulate_imu
from groundstation.simulation.imu.settings import ImuSettings
from groundstation.systems.trajectory import estimate as core
from groundstation.systems.trajectory.fit import NUMBERS, fit_model
from groundstation.systems.trajectory.model import Model, gate
from groundstation.systems.trajectory.passes import Pass, run_pass
from groundstation.systems.trajectory.score import Scored
from groundstation.systems.trajectory.states import FloatArray
from groundstation.systems.trajectory.study.family import known_model
from groundstation.systems.trajectory.study.judged import log_of

SETTINGS = ImuSettings(duration_s=150.0, imu_class="mems")
NUDGE = 1e-2  # of a logarithm
AS_DIFFERENCES = 2e-3  # third derivatives over the nudge
FOUND = np.log(2.0)  # noise is known so well from 150 s
SEEN_WELL = ("gyro_noise_deg_rth", "accel_noise_mps_rth", "velocity_scale", "velocity_down_scale")


@cache
def smoothed() -> tuple[core.Problem, Model, Pass]:
    """A simulated log, a model with its noise, and a pass by it."""
    flight = simulate_imu("uav", 3, settings=SETTINGS)
    imu, fixes = log_of(flight)
    model = replace(known_model(SETTINGS), jitter_s=0.003)
    problem = core.pose(imu, fixes, may_stop=False)
    rules = gate(30.0)
    start = core.hypotheses_of(problem, model, rules)[0].start
    done = run_pass(problem.samples, problem.plan(model), problem.noise(model), rules, start)
    return problem, model, core.relinearised(problem, model, rules, done)


def scores() -> tuple[Model, Callable[[Callable[[FloatArray], Model], FloatArray], Scored]]:
    problem, model, done = smoothed()
    return model, core._scores(problem, done, float(done.plan.epoch_s[-1]))


def test_the_score_is_the_derivative_of_the_likelihood() -> None:
    model, scored = scores()

    def model_at(at: FloatArray) -> Model:
        return model.changed({one.name: float(np.exp(step)) for one, step in zip(NUMBERS, at, strict=True)})

    at = 0.3 * np.random.default_rng(2).standard_normal(len(NUMBERS))
    found = scored(model_at, at)
    steps = NUDGE * np.eye(len(NUMBERS))
    wanted = [(scored(model_at, at + step).value - scored(model_at, at - step).value) / (2.0 * NUDGE) for step in steps]
    size = np.maximum(np.abs(found.gradient), found.expected) + 1.0
    assert np.abs((found.gradient - wanted) / size).max() < AS_DIFFERENCES
    assert np.abs(found.gradient).min() > 0.0


def test_noise_that_was_wrong_is_found() -> None:
    model, scored = scores()
    wrong = model.changed({"gyro_noise_deg_rth": 4.0, "velocity_scale": 0.4, "accel_noise_mps_rth": 3.0})
    fit = fit_model(wrong, scored)
    for name in SEEN_WELL:
        assert abs(np.log(getattr(fit.model, name) / getattr(model, name))) < FOUND, name
    assert fit.value > fit_model(wrong, scored, begin=wrong, numbers=NUMBERS[:1]).value
