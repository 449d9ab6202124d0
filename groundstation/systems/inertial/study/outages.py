"""Flights with outages in the log.

The smoother inside them, the forecasts through and after them, and their bands.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from zlib import crc32

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.results.figures import FigureData
from groundstation.simulation.inertial_family import simulate_family
from groundstation.systems.inertial.coupled import CoupledRun, run_coupled
from groundstation.systems.inertial.coupled_forecast import coupled_variance, hindcast_coupled
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, run_filter, smooth
from groundstation.systems.inertial.hindcast import hindcast
from groundstation.systems.inertial.leads import built_up, leads_of, start_epochs
from groundstation.systems.inertial.model import POSITION
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import QUANTILES, claimed_sigma
from groundstation.systems.inertial.start_covariance import lead_growth
from groundstation.systems.inertial.study.cases import NO_GATE, FilterCase, differences_of, epochs_of, model_of
from groundstation.systems.inertial.study.runs import mean_known

FIRST_S, LENGTHS_S, BETWEEN_S = 3600.0, (60.0, 3600.0), (900.0, 1800.0)
AFTER_MIN = (10.0, 30.0, 60.0)
LEAD_STEP_S = 60.0


@dataclass(frozen=True)
class OutageOutcome:
    """One flight with outages.

    Parameters
    ----------
    outages, seams, reopened : int
        How many there are, at how many GNSS was beyond the gate and used, how often the filter was opened by patience.
    smoothed_m, free_m : float
        RMS of the smoother's radial error inside the outages: as shipped, and without a gate.
    inside, free_inside : float
        Share of the smoother's errors inside its 95 % band: as shipped, and without a gate.
    through : ndarray, shape (k,)
        Whether GNSS at the end of each outage is inside the band of the forecast through it, share of both channels.
    after, undisturbed : ndarrays, shape (3,)
        Coverage of forecasts that start after an outage, and of those from the same starts without any; NaN for none.
    """

    outages: int
    seams: int
    reopened: int
    smoothed_m: float
    free_m: float
    inside: float
    free_inside: float
    through: FloatArray
    after: FloatArray
    undisturbed: FloatArray


def outages_of(time_s: FloatArray, seed: int, run: int) -> list[tuple[float, float]]:
    """Return begin and end of the outages of a flight, seconds."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(run, crc32(b"outages"))))
    begin = float(time_s[0]) + FIRST_S
    found: list[tuple[float, float]] = []
    while True:
        length = float(np.exp(rng.uniform(*np.log(LENGTHS_S))))
        if begin + length + BETWEEN_S[0] > time_s[-1]:
            return found
        found.append((begin, begin + length))
        begin += length + float(rng.uniform(*BETWEEN_S))


def fly_with_outages(case: FilterCase, run: int, settings: InertialSettings) -> OutageOutcome:
    """Fly one flight of a case with outages in its log and judge what is made of them."""
    batch = simulate_family(case.family, 1, case.seed, first_run=run)
    whole = epochs_of(case, batch, 0)
    gaps = outages_of(whole.time_s, case.seed, run)
    blind = np.zeros(len(whole), dtype=bool)
    for begin, end in gaps:
        blind |= (whole.time_s > begin) & (whole.time_s < end)
    position, velocity = (np.where(blind[:, None], np.nan, part) for part in (whole.position_m, whole.velocity_mps))
    cut, model = replace(whole, position_m=position, velocity_mps=velocity), model_of(case, batch, 0)
    flown = run_filter(cut, model, case.noise, gate=case.gate)
    free = run_filter(cut, model, case.noise, gate=NO_GATE)
    truth = batch.position_error_m[0][blind]
    scale = case.noise.calibration.at(_to_the_nearer_end(whole.time_s, gaps)[blind])[:, None]
    rms, inside = [], []
    for smoothed in (smooth(one) for one in (flown, free)):
        error = smoothed.x[blind, POSITION] - truth
        band = QUANTILES[95] * scale * np.sqrt(smoothed.variance[blind, POSITION])
        rms.append(float(np.sqrt(np.mean(np.sum(np.square(error), axis=1)))))
        inside.append(float(np.mean(np.abs(error) <= band)))
    coupled = [run_coupled(differences_of(batch, 0, one), case.noise, settings) for one in (cut, whole)]
    at = start_epochs(cut, max(settings.first_start_s, gaps[0][1]), settings.start_step_s)
    runs = (flown, run_filter(whole, model, case.noise, gate=case.gate))
    after = [_after(*pair, at, whole, settings) for pair in zip(runs, coupled, strict=True)]
    return OutageOutcome(
        outages=len(gaps),
        seams=len(flown.seams),
        reopened=flown.reopened,
        smoothed_m=rms[0],
        free_m=rms[1],
        inside=inside[0],
        free_inside=inside[1],
        through=_through(flown, coupled[0], gaps, whole, settings),
        after=after[0],
        undisturbed=after[1],
    )


def _to_the_nearer_end(time_s: FloatArray, gaps: Sequence[tuple[float, float]]) -> FloatArray:
    ends = np.array(gaps).ravel()
    return np.asarray(np.min(np.abs(time_s[:, None] - ends[None, :]), axis=1))


def _through(
    flown: ChannelsRun,
    coupled: CoupledRun,
    gaps: Sequence[tuple[float, float]],
    whole: DifferenceEpochs,
    settings: InertialSettings,
) -> FloatArray:
    """Return the share of channels in the forecast's 95 % band at the end of each outage."""
    found = []
    for begin, end in gaps:
        at = np.array([int(np.searchsorted(whole.time_s, begin + 1e-6)) - 1])
        length = float(np.searchsorted(whole.time_s, end - 1e-6)) - float(at[0])  # epochs are a second apart
        lead_s = leads_of(length / max(1, round(length / settings.forecast_step_s)), length)
        error = hindcast_coupled(coupled, at, lead_s, settings)[0, -1] - built_up(whole, at, lead_s[-1:])[0, 0]
        scale = flown.noise.calibration.at(lead_s[-1:], "coupled")
        variance = coupled_variance(coupled, at, lead_s[-1:])[0, 0] * scale**2 + lead_growth(flown, lead_s).judge_m2[-1]
        found.append(float(np.mean(np.abs(error) <= QUANTILES[95] * np.sqrt(variance))))
    return np.array(found)


def _after(
    flown: ChannelsRun, coupled: CoupledRun, at: Int64Array, whole: DifferenceEpochs, settings: InertialSettings
) -> FloatArray:
    """Return the coverage of the default's 95 % band from the starts ``at``, by horizon.

    The reference is the GNSS of the same flight without any outage.
    """
    lead_s = leads_of(LEAD_STEP_S, 60.0 * AFTER_MIN[-1])
    every = start_epochs(flown.epochs, settings.first_start_s, settings.start_step_s)
    replay = hindcast(flown, every, lead_s, (), settings)
    forecast = {"last_estimate": hindcast_coupled(coupled, every, lead_s, settings)}
    variance = {"last_estimate": coupled_variance(coupled, every, lead_s)}
    replay = replace(replay, forecast_m=forecast, variance_m2=variance)
    claimed = claimed_sigma("last_estimate", flown, replay, settings)
    assert claimed is not None
    rows: BoolArray = np.isin(every, at)
    leads = [round(60.0 * minutes / LEAD_STEP_S) - 1 for minutes in AFTER_MIN]
    error = (replay.forecast_m["last_estimate"] - built_up(whole, every, lead_s))[rows][:, leads]
    inside = np.abs(error) <= QUANTILES[95] * claimed.scaled_m[rows][:, leads]
    known = np.isfinite(error)
    count = known.sum(axis=(0, 2))
    return np.where(count > 0, (inside & known).sum(axis=(0, 2)) / np.maximum(count, 1), np.nan)


def outage_table(outcomes: Mapping[str, Sequence[OutageOutcome]]) -> FigureData:
    """Tabulate one row per case, over its flights.

    Means of the coverages, RMS of the smoother's errors.
    """
    names = (
        *(
            "case",
            "flights",
            "outages",
            "seams",
            "reopened",
            "smoothed_m",
            "over_free",
            "inside95",
            "free95",
            "through95",
        ),
        *(f"{kind}{minutes:.0f}_95" for kind in ("after", "without") for minutes in AFTER_MIN),
    )
    rows = []
    for case, several in outcomes.items():
        smoothed, free = (
            float(np.sqrt(np.mean(np.square([getattr(one, name) for one in several]))))
            for name in ("smoothed_m", "free_m")
        )
        counts = (sum(getattr(one, name) for one in several) for name in ("outages", "seams", "reopened"))
        inside = (float(np.mean([getattr(one, name) for one in several])) for name in ("inside", "free_inside"))
        through = float(np.mean(np.concatenate([one.through for one in several])))
        after = [mean_known(np.array([getattr(one, name) for one in several])) for name in ("after", "undisturbed")]
        rows.append((case, len(several), *counts, smoothed, smoothed / free, *inside, through, *np.concatenate(after)))
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData("forecast_outages", columns, {"smoothed_m": 1} | dict.fromkeys(names[6:], 3))
