"""Forecast mode judged on the flight itself: outages replayed, every method, its sigma."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.errors import NotAssessableError
from groundstation.results.figures import FigureData
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.systems.inertial import figures
from groundstation.systems.inertial.bank import NoiseBank, run_bank
from groundstation.systems.inertial.coupled import CoupledRun, run_coupled
from groundstation.systems.inertial.coupled_forecast import coupled_rows, coupled_variance, hindcast_coupled
from groundstation.systems.inertial.estimate import Estimation
from groundstation.systems.inertial.filter import ChannelsRun
from groundstation.systems.inertial.forecast_answer import ClassicStart, ForecastResult, PhaseRow
from groundstation.systems.inertial.gaps import gap_rows
from groundstation.systems.inertial.hindcast import Hindcast, hindcast
from groundstation.systems.inertial.leads import leads_of, start_epochs
from groundstation.systems.inertial.model import POSITION, FloatArray
from groundstation.systems.inertial.replay import LEAST_STARTS, ReplayPlan, map_grid, plan_replay
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import calibration_rows, claimed_sigma, skill_rows
from groundstation.tables.sources import UNKNOWN

PhaseOf = Callable[[FloatArray], NDArray[np.str_]]

CLASSIC_H = (1.5, 2.0, 2.5, 3.0)
CLASSIC_METHODS = ("raw_ins", "last_estimate", "windows")
CLASSIC_HORIZONS_MIN = (30.0, 60.0, 90.0, 120.0)
SHORT_S, LONG_S = (10.0, 30.0, 60.0), (300.0, 600.0, 1800.0, 3600.0)
PHASE_STEP_S, PHASE_FROM_S = 60.0, 600.0


def assess_forecast(
    estimation: Estimation, *, settings: InertialSettings, phase_of: PhaseOf | None = None, take_off_s: float = 0.0
) -> ForecastResult:
    """Replay outages all over a flight and compare each method's forecast with GNSS.

    Parameters
    ----------
    estimation : Estimation
    settings : InertialSettings
    phase_of : callable, optional
        Flight phase at flight seconds, shape (n,); without it there is no table by phase.
    take_off_s : float
        Flight time of lift-off: the paper counts its starts from there.

    Raises
    ------
    NotAssessableError
        For an INS of which it cannot be told whether GNSS corrects it, and a flight too short for any replayed outage.

    Notes
    -----
    A replayed outage uses nothing later than its start: the filter's estimates, the class's parameters and scale, and
    outages of the same flight that were over before. The position is known when it begins.
    """
    result, run = estimation.result, estimation.run
    if result.kind == UNKNOWN:
        raise NotAssessableError("forecast", result.kind_reason)
    plan = plan_replay(run, settings)
    if not plan.horizons_min:
        minutes = float(np.ptp(run.epochs.time_s)) / 60.0
        raise NotAssessableError("forecast", f"{minutes:.0f} min of flight are too short for a replayed outage")
    coupled = estimation.coupled or run_coupled(estimation.compared, estimation.noise, settings)
    bank = run_bank(run, settings)
    separate = hindcast(run, plan.at, plan.lead_s, tuple(FORECAST_METHODS), settings, bank)
    since = slice(int(np.searchsorted(separate.start_s, plan.first_start_s - 1e-6)), None)
    together_m = hindcast_coupled(coupled, plan.at, plan.lead_s, settings)
    replay = _with_own_variance(separate, together_m, coupled, settings)
    claimed = {method: claimed_sigma(method, run, replay, settings) for method in FORECAST_METHODS}
    skill = skill_rows(replay, claimed, plan.horizons_min, plan.first_start_s)
    best = {
        f"{horizon:g}": min((row for row in skill if row.horizon_min == horizon), key=lambda row: row.rms_m).method
        for horizon in sorted({row.horizon_min for row in skill})  # GNSS may be absent at every end of a horizon
    }
    classic, classic_figures = _classic(run, coupled, bank, settings, take_off_s)
    judged, default = replay.of(since), claimed[settings.default_method]
    default = None if default is None else default.of(since)
    grid_at, grid_lead_s = map_grid(run, settings)
    return ForecastResult(
        default_method=settings.default_method,
        first_start_s=plan.first_start_s,
        start_step_s=plan.step_s,
        is_calibrated=plan.is_calibrated,
        calibration_reason=plan.reason,
        skill=skill,
        gaps=gap_rows(run, judged.at, _lengths_that_fit(plan), settings=settings),
        phases=_phases(run, coupled, bank, settings, phase_of, judged),
        classic_starts=classic,
        calibration=calibration_rows(replay, claimed, plan.horizons_min, plan.first_start_s),
        coupled=coupled_rows(together_m[since], separate.of(since), horizons_min=plan.horizons_min),
        best_method=best,
        figures=(
            figures.map_figure(
                _of_model(
                    hindcast(run, grid_at, grid_lead_s, tuple(FORECAST_METHODS), settings, bank), coupled, settings
                )
            ),
            figures.growth_figure(judged, default),
            figures.fan_figure(judged, settings.default_method, default),
            *classic_figures,
        ),
    )


def _of_model(replay: Hindcast, coupled: CoupledRun, settings: InertialSettings) -> Hindcast:
    """The replay with the last estimate of the model that the settings choose."""
    if settings.model == "separate" or "last_estimate" not in replay.forecast_m:
        return replay
    forecast = hindcast_coupled(coupled, replay.at, replay.lead_s, settings)
    return replace(replay, forecast_m=replay.forecast_m | {"last_estimate": forecast})


def _with_own_variance(
    replay: Hindcast, together_m: FloatArray, coupled: CoupledRun, settings: InertialSettings
) -> Hindcast:
    """Return the replay with the coupled last estimate and its variance, if the settings choose it."""
    if settings.model == "separate":
        return replay
    forecast, own = (
        {"last_estimate": together_m},
        {"last_estimate": coupled_variance(coupled, replay.at, replay.lead_s)},
    )
    return replace(replay, forecast_m=replay.forecast_m | forecast, variance_m2=replay.variance_m2 | own)


def _lengths_that_fit(plan: ReplayPlan) -> tuple[float, ...]:
    return tuple(length for length in plan.horizons_min if 10.0 <= length <= 90.0)


def _phases(
    run: ChannelsRun,
    coupled: CoupledRun,
    bank: NoiseBank,
    settings: InertialSettings,
    phase_of: PhaseOf | None,
    judged: Hindcast,
) -> tuple[PhaseRow, ...]:
    """Outages of 10 s to 1 h that begin in each phase, default method beside raw INS.

    From the first judged start on they are the judged ones; before it they come every minute.
    """
    if phase_of is None:
        return ()
    first_s = float(judged.start_s[0]) if len(judged.start_s) else np.inf
    early = start_epochs(run.epochs, float(run.epochs.time_s[0]) + PHASE_FROM_S, PHASE_STEP_S)
    early = early[run.epochs.time_s[early] < first_s - 1e-6]
    methods = tuple(dict.fromkeys(("raw_ins", settings.default_method)))
    rows = []
    for at, is_early in ((early, True), (judged.at, False)):
        if not len(at):
            continue
        phases = phase_of(run.epochs.time_s[at])
        for lengths, step in ((SHORT_S, SHORT_S[0]), (LONG_S, LONG_S[0])):
            lead_s = leads_of(step, lengths[-1])
            replay = _of_model(hindcast(run, at, lead_s, methods, settings, bank), coupled, settings)
            for length in lengths:
                lead = round(length / step) - 1
                errors = {method: replay.radial_m(method)[:, lead] for method in methods}
                for phase in dict.fromkeys(phases.tolist()):
                    here = (phases == phase) & np.isfinite(errors["raw_ins"])
                    if here.sum() >= LEAST_STARTS:
                        rms = [float(np.sqrt(np.mean(np.square(errors[method][here])))) for method in methods]
                        rows.append(PhaseRow(phase, length, int(here.sum()), rms[-1], rms[0], is_early))
    return tuple(sorted(rows, key=lambda row: (row.phase, not row.is_early, row.length_s)))


def _classic(
    run: ChannelsRun, coupled: CoupledRun, bank: NoiseBank, settings: InertialSettings, take_off_s: float
) -> tuple[tuple[ClassicStart, ...], tuple[FigureData, ...]]:
    """Replay the paper's four starts: rows at equal horizons, figure 2 to the flight's end."""
    time_s = run.epochs.time_s
    wanted = np.array([take_off_s + 3600.0 * hours for hours in CLASSIC_H])
    if wanted[-1] + 60.0 * CLASSIC_HORIZONS_MIN[0] > time_s[-1]:
        return (), ()
    at = np.searchsorted(time_s, wanted - 1e-6)
    rest = float(time_s[-1] - time_s[at[0]])
    lead_s = leads_of(60.0, rest)
    methods = tuple(dict.fromkeys((*CLASSIC_METHODS, settings.default_method)))
    replay = _of_model(hindcast(run, at, lead_s, methods, settings, bank), coupled, settings)
    rows = []
    for start, hours in enumerate(CLASSIC_H):
        for method in methods:
            error = replay.error_m(method)[start]
            for horizon in CLASSIC_HORIZONS_MIN:
                lead = round(horizon) - 1
                if lead < len(error) and np.isfinite(error[lead]).all():
                    radial = float(np.hypot(*error[lead]))
                    rows.append(ClassicStart(hours, method, horizon, radial, float(error[lead, 1])))
    return tuple(rows), (figures.classic_figure(replay, _known(run, replay), settings.default_method),)


def _known(run: ChannelsRun, replay: Hindcast) -> FloatArray:
    measured = run.epochs.position_m[replay.at]
    return np.where(np.isfinite(measured), measured, run.x[replay.at, POSITION])
