"""Monte Carlo study of a flux valve in flight: coverage of A to E, cell by cell."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.parts import Section
from groundstation.results.figures import FigureData
from groundstation.results.roles import LETTERS
from groundstation.simulation.flux_valve import FluxFlightSettings, simulate_flux_flight
from groundstation.simulation.readings import generator
from groundstation.systems.magnetic.flux_answer import FluxDeviation
from groundstation.systems.magnetic.flux_estimate import estimate_flux_deviation
from groundstation.systems.study import StudyResult, section, table

SEED_STEP = 100_000
FOUR, TWO = (0.0, 90.0, 180.0, 270.0), (0.0, 180.0)
SHALLOW_DEG = 6.0  # of bank: such turns do not show lean and lag
CELLS: Mapping[str, FluxFlightSettings] = {
    "INS": FluxFlightSettings(),
    "wind solved": FluxFlightSettings(with_ins=False),
    "four legs": FluxFlightSettings(with_ins=False, headings_deg=FOUR),
    "two legs": FluxFlightSettings(with_ins=False, headings_deg=TWO),
    "slaved": FluxFlightSettings(slaved_s=60.0),
    "slaved, wind solved": FluxFlightSettings(slaved_s=60.0, with_ins=False),
    "shallow turns": FluxFlightSettings(bank_deg=SHALLOW_DEG),
    "shallow turns, slaved": FluxFlightSettings(bank_deg=SHALLOW_DEG, slaved_s=60.0),
    "four legs, slaved": FluxFlightSettings(with_ins=False, headings_deg=FOUR, slaved_s=60.0),
    "four legs, slaved, wind changes": FluxFlightSettings(
        with_ins=False, headings_deg=FOUR, slaved_s=60.0, wind_wander_mps=2.0
    ),
    "shallow turns, slaved, load": FluxFlightSettings(bank_deg=SHALLOW_DEG, slaved_s=60.0, load_deg=1.5),
    "opposite turns": FluxFlightSettings(lean=0.0, headings_deg=TWO, full_turns=2),
    "steps of 1 deg": FluxFlightSettings(with_ins=False, step_deg=1.0),
    "wind changes": FluxFlightSettings(with_ins=False, wind_wander_mps=2.0),
    "INS drifts": FluxFlightSettings(ins_drift_sigma_dph=1.0),
    "declination wrong": FluxFlightSettings(declination_off_deg=0.5),
    "load": FluxFlightSettings(load_deg=1.5),
}
SLAVED_S = (30.0, 150.0)


@dataclass(frozen=True)
class FluxRun:
    """Flight judged: verdict, errors of the coefficients given, sigmas and their ratios."""

    cell: str
    verdict: str
    ratios: dict[str, float]
    errors_deg: dict[str, float]
    sigmas_deg: dict[str, float]
    lean: float | None = None
    lag_s: float | None = None


def fly_and_judge(cell: str, seed: int) -> FluxRun:
    """Fly one flight of a cell and judge what is found."""
    settings = CELLS[cell]
    if settings.slaved_s > 0.0:
        slaved_s = float(generator(seed, "flux slaving").uniform(*SLAVED_S))
        settings = replace(settings, slaved_s=slaved_s)
    flown = simulate_flux_flight(settings, seed)
    try:
        found = estimate_flux_deviation(flown.flight)
    except NotAssessableError:
        return FluxRun(cell, "not assessable", {}, {}, {})
    return _judged(cell, found, flown.coefficients_deg)


def study_flux(runs: int = 100, seed: int = 95, progress: Callable[[str], None] | None = None) -> StudyResult:
    """Fly every cell of the fourth family and tabulate the coverage of A to E.

    Parameters
    ----------
    runs : int
        Flights of each cell.
    seed : int
        Flights have the seeds ``100 000 seed + run``.
    progress : callable, optional
        Called with one line for each cell.
    """
    done: dict[str, list[FluxRun]] = {}
    for cell in CELLS:
        done[cell] = [fly_and_judge(cell, SEED_STEP * seed + run) for run in range(runs)]
        if progress is not None:
            progress(cell)
    found = coverage_table(done)
    return StudyResult("flux", (found,), _page(found, runs, seed))


def coverage_table(done: Mapping[str, list[FluxRun]]) -> FigureData:
    """Tabulate, by cell, how often coefficients that are given are within 1.96 stated sigma."""
    names = (
        *("cell", "flights", "accepted", "given", "inside95"),
        *(f"inside95_{letter.lower()}" for letter in LETTERS),
        *("rms_ratio", "rms_error_deg", "median_sigma_deg"),
    )
    rows = []
    for cell, outcomes in done.items():
        ratios = np.array([value for one in outcomes for value in one.ratios.values()])
        errors = np.array([value for one in outcomes for value in one.errors_deg.values()])
        sigmas = np.array([value for one in outcomes for value in one.sigmas_deg.values()])
        by_letter = [
            _share(np.array([one.ratios[letter] for one in outcomes if letter in one.ratios])) for letter in LETTERS
        ]
        accepted = sum(one.verdict == "accept" for one in outcomes)
        rms = [float(np.sqrt(np.mean(part**2))) if part.size else float("nan") for part in (ratios, errors)]
        middle = float(np.median(sigmas)) if sigmas.size else float("nan")
        rows.append((cell, len(outcomes), accepted, len(ratios), _share(ratios), *by_letter, *rms, middle))
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData("flux_coverage", columns, dict.fromkeys(names[4:], 2))


def _share(ratios: np.ndarray) -> float:
    return float(np.mean(np.abs(ratios) <= NORMAL_95)) if ratios.size else float("nan")


def _judged(cell: str, found: FluxDeviation, truth_deg: np.ndarray) -> FluxRun:
    errors, sigmas = {}, {}
    for letter, true in zip(LETTERS, truth_deg.tolist(), strict=True):
        row = found.coefficient(letter)
        if row.value_deg is not None:
            errors[letter], sigmas[letter] = row.value_deg - true, row.sigma_deg
    ratios = {letter: errors[letter] / sigmas[letter] for letter in errors}
    return FluxRun(cell, found.verdict, ratios, errors, sigmas, found.bank_error.lean, found.bank_error.lag_s)


def _page(found: FigureData, runs: int, seed: int) -> tuple[Section, ...]:
    text = (
        f"{runs} flights of each cell of the fourth family (docs/evidence/magnetic.md), seed {seed}. Given: "
        "coefficients that the headings flown show. Inside: share of them whose error is within 1.96 stated sigma."
    )
    return (section("Flux valve: coverage of A to E", text, table(found)),)
