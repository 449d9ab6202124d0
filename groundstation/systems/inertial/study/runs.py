"""Flights of the forecast study: each simulated, filtered and replayed.

A small outcome of each is kept.
"""

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import partial

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.simulation.inertial_family import ErrorBatch, simulate_family
from groundstation.systems.inertial.coupled import run_coupled
from groundstation.systems.inertial.coupled_forecast import coupled_variance, hindcast_coupled
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, run_filter
from groundstation.systems.inertial.hindcast import Hindcast, hindcast
from groundstation.systems.inertial.leads import MEMORY_S, built_up
from groundstation.systems.inertial.replay import plan_replay
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import QUANTILES, WITH_SIGMA, Claimed, claimed_sigma
from groundstation.systems.inertial.study.cases import FilterCase, differences_of, epochs_of, model_of
from groundstation.systems.study import OutcomeT, mapped

Progress = Callable[[str], None]

COUPLED = "coupled"  # the last estimate of the coupled model; the others are those of two separate channels
METHOD_NAMES = (*FORECAST_METHODS, COUPLED)
JUDGED_NAMES = (*WITH_SIGMA, COUPLED)
STUDY_HORIZONS_MIN = (10.0, 30.0, 60.0, 84.0, 120.0)
CLASSIC_START_H = (1.5, 2.0, 2.5, 3.0)
SETS_OF_STARTS = ("all", *(f"{hours:g} h" for hours in CLASSIC_START_H))
LEVELS = tuple(QUANTILES)


@dataclass(frozen=True)
class Honesty:
    """Comparison of the forecasts' sigmas with the errors of one flight.

    Axes: method with a covariance, horizon.

    Parameters
    ----------
    inside, inside_model : ndarrays, shape (7, h, 3)
        Shares of the channel errors inside the 50, 68 and 95 % bands, over all starts: sigma scaled, and by the model.
    nees, nees_model : ndarrays, shape (7, h)
        Mean squared ratio of error to sigma over all starts and both channels.
    first, first_model : ndarrays, shape (7, h)
        Sum of the squared ratios over both channels from the first start alone: flights are independent, starts not.
    independent : ndarray, shape (h,)
        How many independent starts the flight has.
    """

    inside: FloatArray
    inside_model: FloatArray
    nees: FloatArray
    nees_model: FloatArray
    first: FloatArray
    first_model: FloatArray
    independent: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))


@dataclass(frozen=True)
class CaseFlight:
    """One flight in one case.

    Parameters
    ----------
    mean_square_m2 : ndarray, shape (10, 5, h)
        Of the radial error built up, against the truth: method, set of starts (all; 1.5, 2, 2.5, 3 h), horizon; NaN
        where the horizon ends after the flight.
    rejected_share : float
        Of the position measurements, by the gate.
    honesty : Honesty, optional
    """

    mean_square_m2: FloatArray
    rejected_share: float
    honesty: Honesty | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean_square_m2", frozen(self.mean_square_m2))


def run_cases(
    cases: Sequence[FilterCase],
    runs: int,
    calibrated_runs: int,
    settings: InertialSettings,
    progress: Progress | None = None,
) -> dict[str, tuple[CaseFlight, ...]]:
    """Replay ``runs`` flights of every case.

    Cases of one family and seed see the same flights.

    Parameters
    ----------
    cases : sequence of FilterCase
    runs : int
    calibrated_runs : int
        So many flights of each case look at the sigma too, which takes four times as long.
    settings : InertialSettings
    progress : callable, optional
        Called with a line for each flight simulated.

    Returns
    -------
    dict of case name to tuple of Outcome
        In the order of the flights, whatever the number of processes.
    """
    flights: list[StudyFlight] = []
    for seed in dict.fromkeys(case.seed for case in cases):
        together = tuple(case for case in cases if case.seed == seed)
        flown = calibrated_runs if together[0].is_new else runs
        flights += [StudyFlight(together, run, run < calibrated_runs, settings) for run in range(flown)]
    outcomes: dict[str, list[CaseFlight]] = {case.name: [] for case in cases}
    with mapped(len(flights)) as each:
        for flight, found in zip(flights, each(fly, flights), strict=True):
            for case, outcome in zip(flight.cases, found, strict=True):
                outcomes[case.name].append(outcome)
            if progress:
                progress(f"flight {flight.run} of {', '.join(case.name for case in flight.cases)}")
    return {name: tuple(several) for name, several in outcomes.items()}


def fly_held_out(
    cases: Sequence[FilterCase],
    runs: int,
    settings: InertialSettings,
    fly_one: Callable[[FilterCase, int, InertialSettings], OutcomeT],
) -> dict[str, list[OutcomeT]]:
    """Fly so many flights of every case that stands for real ones, in the order of the runs."""
    jobs = [(case, run, settings) for case in cases if case.is_held_out for run in range(runs)]
    outcomes: dict[str, list[OutcomeT]] = {case.name: [] for case, _, _ in jobs}
    with mapped(len(jobs)) as each:
        for (case, _, _), outcome in zip(jobs, each(partial(_fly_job, fly_one), jobs), strict=True):
            outcomes[case.name].append(outcome)
    return outcomes


def _fly_job(
    fly_one: Callable[[FilterCase, int, InertialSettings], OutcomeT], job: tuple[FilterCase, int, InertialSettings]
) -> OutcomeT:
    return fly_one(*job)


@dataclass(frozen=True)
class StudyFlight:
    """One flight to simulate, and the cases that filter it."""

    cases: tuple[FilterCase, ...]
    run: int
    is_calibrated: bool
    settings: InertialSettings


def fly(flight: StudyFlight) -> list[CaseFlight]:
    """Simulate a flight and replay it in each of its cases."""
    first = flight.cases[0]
    batch = simulate_family(first.family, 1, first.seed, first_run=flight.run)
    return [
        replay_flight(case, batch, 0, flight.is_calibrated and case.is_calibrated, flight.settings)
        for case in flight.cases
    ]


def replay_flight(
    case: FilterCase, batch: ErrorBatch, row: int, is_calibrated: bool, settings: InertialSettings
) -> CaseFlight:
    """Filter a flight of a batch and replay its outages with every method.

    The truth judges the forecasts.
    """
    epochs = epochs_of(case, batch, row)
    run = run_filter(epochs, model_of(case, batch, row), case.noise, gate=case.gate)
    plan = plan_replay(run, settings)
    replay = hindcast(run, plan.at, plan.lead_s, tuple(FORECAST_METHODS), settings)
    if case.is_held_out:
        replay = _with_coupled(replay, case, batch, row, settings)
    since = slice(int(np.searchsorted(replay.start_s, settings.first_start_s - 1e-6)), None)
    truth = DifferenceEpochs.plain(epochs.time_s, batch.position_error_m[row], batch.velocity_error_mps[row])
    judged = replay.of(since)
    judged = replace(judged, actual_m=built_up(truth, judged.at, judged.lead_s))
    return CaseFlight(
        mean_squares(judged),
        float(np.mean(run.used[:, 0] < 0)),
        _honesty(run, replay, since, settings) if is_calibrated else None,
    )


def _with_coupled(
    replay: Hindcast, case: FilterCase, batch: ErrorBatch, row: int, settings: InertialSettings
) -> Hindcast:
    """Return the replay with the last estimate of the coupled model beside the others."""
    run = run_coupled(differences_of(batch, row, epochs_of(case, batch, row)), case.noise, settings)
    forecast = hindcast_coupled(run, replay.at, replay.lead_s, settings)
    variance = coupled_variance(run, replay.at, replay.lead_s)
    return replace(
        replay,
        forecast_m=replay.forecast_m | {COUPLED: forecast},
        variance_m2=replay.variance_m2 | {COUPLED: variance},
    )


def _claimed(method: str, run: ChannelsRun, replay: Hindcast, settings: InertialSettings) -> Claimed:
    """Return the sigma that a method claims.

    The coupled last estimate claims what it does where the settings choose the coupled model.
    """
    if method == COUPLED:
        own = {"last_estimate": replay.variance_m2[COUPLED]}
        replay = replace(replay, forecast_m={"last_estimate": replay.forecast_m[COUPLED]}, variance_m2=own)
        method = "last_estimate"
    claimed = claimed_sigma(method, run, replay, settings)
    assert claimed is not None
    return claimed


def mean_squares(replay: Hindcast) -> FloatArray:
    """Return the mean square of the radial error, shape (methods, sets, horizons).

    The mean is over each set of starts.
    """
    leads = leads_at(replay)
    classic = [np.flatnonzero(np.abs(replay.start_s - 3600.0 * hours) < 1.0) for hours in CLASSIC_START_H]
    out = np.full((len(METHOD_NAMES), len(SETS_OF_STARTS), len(leads)), np.nan)
    for index, method in enumerate(METHOD_NAMES):
        if method not in replay.forecast_m:
            continue
        square = np.square(replay.radial_m(method)[:, leads])
        for place, rows in enumerate((np.arange(len(square)), *classic)):
            out[index, place] = mean_known(square[rows])
    return out


def leads_at(replay: Hindcast) -> list[int]:
    """Return the index of each horizon of the study among the leads."""
    return [int(np.argmin(np.abs(replay.lead_s - 60.0 * horizon))) for horizon in STUDY_HORIZONS_MIN]


def _honesty(run: ChannelsRun, replay: Hindcast, since: slice, settings: InertialSettings) -> Honesty:
    """Return errors over sigmas; GNSS is the reference, its error at both ends is claimed."""
    leads = leads_at(replay)
    parts: list[list[FloatArray]] = []
    for method in JUDGED_NAMES:
        if method not in replay.forecast_m:
            parts.append([np.full_like(part, np.nan) for part in parts[0]])
            continue
        claimed = _claimed(method, run, replay, settings)
        error = replay.error_m(method)[since][:, leads]
        ratios = [np.square(error / sigma[since][:, leads]) for sigma in (claimed.scaled_m, claimed.model_m)]
        parts.append(
            [
                *(np.stack([_share_inside(ratio, level) for level in LEVELS], axis=1) for ratio in ratios),
                *(mean_known(ratio.mean(axis=2)) for ratio in ratios),
                *(ratio[0].sum(axis=1) for ratio in ratios),
            ]
        )
    starts_s = replay.start_s[since]
    last_s = float(run.epochs.time_s[-1]) - 60.0 * np.array(STUDY_HORIZONS_MIN)
    spans_s = np.minimum(last_s, starts_s[-1]) - starts_s[0]
    independent = 1.0 + np.floor(spans_s / np.maximum(60.0 * np.array(STUDY_HORIZONS_MIN), MEMORY_S))
    stacked = [np.stack([method[item] for method in parts]) for item in range(len(parts[0]))]
    names = [item.name for item in fields(Honesty)]
    return Honesty(**dict(zip(names, [*stacked, independent], strict=True)))


def _share_inside(ratio: FloatArray, level: int) -> FloatArray:
    """Return the share of the squared ratios (s, h, c) inside a band, per horizon."""
    inside = np.where(np.isfinite(ratio), ratio <= QUANTILES[level] ** 2, np.nan)
    return mean_known(inside.mean(axis=2))


def mean_known(values: FloatArray) -> FloatArray:
    """Return the mean over the first axis of what is known, NaN where nothing is."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    return np.asarray(np.where(count > 0, np.where(known, values, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan))
