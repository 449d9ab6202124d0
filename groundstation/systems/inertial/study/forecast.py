"""Monte Carlo study of the forecast.

Every method under true and false models, and how honest the forecasts are.
"""

from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.study import tables
from groundstation.systems.inertial.study.cases import study_cases
from groundstation.systems.inertial.study.consistency import RUNS, consistency_table
from groundstation.systems.inertial.study.coupled_bank import bank_table, fly_bank
from groundstation.systems.inertial.study.outages import fly_with_outages, outage_table
from groundstation.systems.inertial.study.page import page
from groundstation.systems.inertial.study.runs import COUPLED, Progress, fly_held_out, run_cases
from groundstation.systems.study import StudyResult

OUTAGE_RUNS = 30  # flights of a case with outages in the log
BANK_RUNS = 10  # that decide on the bank on the coupled model: two seconds of processor time each
CALIBRATED_SHARE = 0.3  # of the flights: sigmas take longer than forecasts, and their shares converge sooner


def study_forecast(runs: int = 200, seed: int = 71, progress: Progress | None = None) -> StudyResult:
    """Fly every case and compare the methods.

    RMS, ratios and coverage with intervals over flights.

    Parameters
    ----------
    runs : int
        Flights of each case; 200 give a ratio of two methods to some 5 %.
    seed : int
        Family seeds are ``50 000 + 10 seed`` and the nine that follow.
    progress : callable, optional
        Called with one line for each flight.
    """
    settings = InertialSettings()
    cases = study_cases(seed)
    calibrated = max(2, round(CALIBRATED_SHARE * runs))
    outcomes = run_cases(cases, runs, calibrated, settings, progress)
    samples = {name: tables.Resampled.of(several, seed) for name, several in outcomes.items()}
    found = (
        tables.rms_table(samples),
        tables.ratio_table(samples),
        tables.later_table(samples),
        tables.cure_table(samples["coloured"], samples["inflated"]),
        tables.held_out_table(cases, samples),
        tables.honesty_table(outcomes),
        tables.gate_table(outcomes),
        consistency_table(cases[0].seed, min(runs, RUNS)),
        bank_table(fly_held_out(cases, max(2, min(calibrated, BANK_RUNS)), settings, fly_bank)),
        outage_table(fly_held_out(cases, max(2, min(calibrated, OUTAGE_RUNS)), settings, fly_with_outages)),
    )
    is_coupled = settings.model == "coupled" and settings.default_method == tables.REFERENCE
    shipped = COUPLED if is_coupled else settings.default_method
    text = page(cases, {table.name: table for table in found}, runs, calibrated, shipped)
    return StudyResult("forecast", found, text)
