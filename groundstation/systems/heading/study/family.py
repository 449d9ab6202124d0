"""Study of the estimator on simulated taxi runs of the family.

Errors, coverage of both intervals, acceptance by gate.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import cast

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.results.arrays.typed import found_in
from groundstation.results.figures import FigureData
from groundstation.simulation.taxi import Family, TaxiCase, draw_run, taxi_flight
from groundstation.simulation.taxi_disturbance import KINDS
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.arrays import HeadingRunning
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import AircraftClass, AircraftData
from groundstation.systems.study import RunStore
from groundstation.tables.phases import flight_phases

BoolArray = NDArray[np.bool_]
Progress = Callable[[str], None]
NAMED_ARM_SIGMA_M = 0.05
MOST_SEGMENTS = 3  # so many and more count as one


@dataclass(frozen=True)
class RunOutcome:
    """One simulated run with its estimates; errors are estimate minus truth, degrees.

    ``seconds_to_precision`` is the taxi time after which the paper's e stays within its limit, None if it never does.
    """

    number: int
    case: TaxiCase
    error_deg: float
    low_deg: float
    high_deg: float
    low_measured_deg: float
    high_measured_deg: float
    paper_error_deg: float
    precision_deg: float
    quality_deg: float
    taxi_seconds: float
    verdict: str
    gates: dict[str, str]
    seconds_to_precision: float | None

    @property
    def is_inside(self) -> bool:
        """Tell whether our interval holds the truth (ends are given relative to it)."""
        return self.low_deg <= 0.0 <= self.high_deg

    @property
    def is_inside_measured(self) -> bool:
        """Tell whether the interval without steady sideslip holds the truth."""
        return self.low_measured_deg <= 0.0 <= self.high_measured_deg

    @property
    def half_width_measured_deg(self) -> float:
        return 0.5 * (self.high_measured_deg - self.low_measured_deg)

    @property
    def is_inside_paper(self) -> bool:
        """Tell whether the paper's mean +- e holds the truth."""
        return abs(self.paper_error_deg) <= self.precision_deg

    @property
    def half_width_deg(self) -> float:
        return 0.5 * (self.high_deg - self.low_deg)


def run_once(family: Family, seed: int, number: int, settings: HeadingSettings | None = None) -> RunOutcome:
    """Draw run ``number`` of a seed, estimate, and compare with the truth.

    The run passes through tables and estimator.
    """
    run = draw_run(family, seed, number)
    case = run.case
    aircraft = AircraftData(
        antenna_arm_m=case.antenna_arm_m if case.is_arm_known else None, antenna_arm_sigma_m=NAMED_ARM_SIGMA_M
    )
    flight = taxi_flight(run)
    told = case.disturbance
    aircraft = replace(aircraft, aircraft_class=cast(AircraftClass, told.aircraft_class))
    result = estimate_heading_error(
        flight,
        aircraft=aircraft,
        settings=settings,
        phases=flight_phases(flight),
        weather=(told.metar,) if told.metar else (),
    )
    return outcome_of(number, case, result, run.error_at(result.reference_time_s or 0.0))


def outcome_of(number: int, case: TaxiCase, result: HeadingResult, truth_deg: float) -> RunOutcome:
    """Return a result with the true error of its run."""
    running = found_in(result.figures, HeadingRunning)
    assert running is not None
    limit = next(gate.limit for gate in result.gates if gate.name == "precision")
    above = np.flatnonzero(~(running.precision_deg <= limit))
    reached = int(above[-1]) + 1 if len(above) else 0
    step_s = float(np.median(np.diff(running.time_s)))
    measured_deg = result.confidence95_measured_deg or result.confidence95_deg
    return RunOutcome(
        number=number,
        case=case,
        error_deg=result.error_deg - truth_deg,
        low_deg=result.confidence95_deg[0] - truth_deg,
        high_deg=result.confidence95_deg[1] - truth_deg,
        low_measured_deg=measured_deg[0] - truth_deg,
        high_measured_deg=measured_deg[1] - truth_deg,
        paper_error_deg=result.paper_error_deg - truth_deg,
        precision_deg=result.precision_deg,
        quality_deg=result.quality_deg,
        taxi_seconds=result.taxi_seconds,
        verdict=result.verdict,
        gates={gate.name: gate.state for gate in result.gates if gate.required},
        seconds_to_precision=(reached + 1) * step_s if reached < len(running) else None,
    )


def run_families(
    families: Sequence[tuple[Family, int]],
    runs: int,
    progress: Progress | None = None,
    *,
    kept: RunStore[RunOutcome] | None = None,
    is_over: Callable[[], bool] | None = None,
) -> dict[Family, tuple[RunOutcome, ...]]:
    """Run 0 to ``runs`` - 1 of each family and seed, by turns.

    Fewer, equally many of each, where time is over.

    Parameters
    ----------
    families : sequence of (family, seed)
    runs : int
    progress : callable, optional
        Called with a line for each run that is made.
    kept : RunStore, optional
        Runs that it has are taken from there; those that are made are put there.
    is_over : callable, optional
        Asked before each number but the first whether to stop.
    """
    outcomes: dict[Family, list[RunOutcome]] = {family: [] for family, _seed in families}
    for number in range(runs):
        if number > 0 and is_over is not None and is_over():
            break
        for family, seed in families:
            name = f"heading-{family}-{seed}"
            outcome = kept.get(name, number) if kept else None
            if outcome is None:
                outcome = run_once(family, seed, number)
                if kept:
                    kept.put(name, number, outcome)
                if progress:
                    error = f"{outcome.error_deg * ARCMIN_PER_DEG:+.1f} arcmin"
                    progress(f"{family} run {number}: error {error}, {outcome.verdict}")
            outcomes[family].append(outcome)
    return {family: tuple(found) for family, found in outcomes.items()}


def runs_table(name: str, outcomes: Sequence[RunOutcome]) -> FigureData:
    """Tabulate one row for each run: parameters that matter, error, interval, verdict."""

    def column(value: Callable[[RunOutcome], float | str | bool]) -> NDArray[np.generic]:
        return np.array([value(outcome) for outcome in outcomes])

    columns = {
        "run": column(lambda run: run.number),
        "taxi_s": column(lambda run: run.taxi_seconds),
        "segments": column(lambda run: len(run.case.segments_s)),
        "speed_mps": column(lambda run: run.case.cruise_mps),
        "sway_damping": column(lambda run: run.case.sway_damping),
        "sway_hz": column(lambda run: run.case.sway_hz),
        "correlated_mps": column(lambda run: run.case.correlated_mps),
        "correlation_s": column(lambda run: run.case.correlation_s),
        "standstill_s": column(lambda run: run.case.standstill_s),
        "arm_known": column(lambda run: run.case.is_arm_known),
        "error_arcmin": column(lambda run: run.error_deg * ARCMIN_PER_DEG),
        "kind": column(lambda run: run.case.disturbance.kind),
        "low_measured_arcmin": column(lambda run: run.low_measured_deg * ARCMIN_PER_DEG),
        "high_measured_arcmin": column(lambda run: run.high_measured_deg * ARCMIN_PER_DEG),
        "low_arcmin": column(lambda run: run.low_deg * ARCMIN_PER_DEG),
        "high_arcmin": column(lambda run: run.high_deg * ARCMIN_PER_DEG),
        "paper_error_arcmin": column(lambda run: run.paper_error_deg * ARCMIN_PER_DEG),
        "paper_e_arcmin": column(lambda run: run.precision_deg * ARCMIN_PER_DEG),
        "inside": column(lambda run: run.is_inside),
        "verdict": column(lambda run: run.verdict),
    }
    return FigureData(name, columns, dict.fromkeys(columns, 3))


Cell = tuple[str, BoolArray]


def _cells(outcomes: Sequence[RunOutcome]) -> Iterable[Cell]:
    """Return the names of the cells and the runs in each.

    Edges hold the grid values and divide the continuous ones.
    """

    def split(name: str, values: Iterable[float], edges: Sequence[float], unit: str) -> Iterable[Cell]:
        array = np.array(list(values))
        for low, high in pairwise(edges):
            inside = (array > low) & (array <= high)
            if inside.any():
                shown = np.unique(array[inside])
                label = f"{shown[0]:g}" if len(shown) == 1 else f"{low:g} to {high:g}"
                yield f"{name} {label}{unit}", inside

    cases = [outcome.case for outcome in outcomes]
    yield "all", np.ones(len(outcomes), dtype=bool)
    kinds = np.array([case.disturbance.kind for case in cases])
    if len(set(kinds)) > 1:
        yield from ((kind, kinds == kind) for kind in KINDS)
    yield from split("sway damping", (case.sway_damping for case in cases), (0.0, 0.05, 0.15, 0.3, 1.0), "")
    yield from split("GNSS correlated over", (case.correlation_s for case in cases), (0.0, 2.0, 5.0, 20.0), " s")
    lengths = [round(sum(case.segments_s), 6) for case in cases]
    yield from split("taxi", lengths, (0.0, 20.5, 40.5, 60.5, 90.5, 130.0), " s")
    yield from split("standstill", (case.standstill_s for case in cases), (0.0, 60.0, 120.0, 400.0), " s")
    known = np.array([case.is_arm_known for case in cases])
    yield from (("arm known", known), ("arm not known", ~known))
    verdicts = np.array([outcome.verdict for outcome in outcomes])
    yield from ((f"verdict {verdict}", verdicts == verdict) for verdict in ("accept", "advisory", "extend", "reject"))


def coverage_table(name: str, outcomes: Sequence[RunOutcome]) -> FigureData:
    """Tabulate coverage of both intervals, and errors, for each cell of the family.

    ``coverage_sigma`` is the sampling error of the coverage at 0.95.
    """
    error = np.array([outcome.error_deg for outcome in outcomes]) * ARCMIN_PER_DEG
    paper_error = np.array([outcome.paper_error_deg for outcome in outcomes]) * ARCMIN_PER_DEG
    half_width = np.array([outcome.half_width_deg for outcome in outcomes]) * ARCMIN_PER_DEG
    inside = np.array([outcome.is_inside for outcome in outcomes])
    inside_measured = np.array([outcome.is_inside_measured for outcome in outcomes])
    inside_paper = np.array([outcome.is_inside_paper for outcome in outcomes])
    half_measured = np.array([outcome.half_width_measured_deg for outcome in outcomes]) * ARCMIN_PER_DEG
    accepted = np.array([outcome.verdict == "accept" for outcome in outcomes])
    cells = [(label, mask) for label, mask in _cells(outcomes) if mask.any()]

    def column(value: Callable[[BoolArray], float]) -> NDArray[np.float64]:
        return np.array([value(mask) for _label, mask in cells])

    columns: dict[str, NDArray[np.generic]] = {
        "cell": np.array([label for label, _mask in cells]),
        "runs": np.array([int(mask.sum()) for _label, mask in cells]),
        "coverage": column(lambda mask: float(np.mean(inside[mask]))),
        "measured_coverage": column(lambda mask: float(np.mean(inside_measured[mask]))),
        "coverage_sigma": column(lambda mask: float(np.sqrt(0.95 * 0.05 / mask.sum()))),
        "paper_coverage": column(lambda mask: float(np.mean(inside_paper[mask]))),
        "rms_arcmin": column(lambda mask: float(np.sqrt(np.mean(error[mask] ** 2)))),
        "p95_arcmin": column(lambda mask: float(np.quantile(np.abs(error[mask]), 0.95))),
        "max_arcmin": column(lambda mask: float(np.max(np.abs(error[mask])))),
        "paper_rms_arcmin": column(lambda mask: float(np.sqrt(np.mean(paper_error[mask] ** 2)))),
        "half_width_arcmin": column(lambda mask: float(np.median(half_width[mask]))),
        "measured_half_width_arcmin": column(lambda mask: float(np.median(half_measured[mask]))),
        "accepted": column(lambda mask: float(np.sum(accepted[mask]))),
        "accepted_max_arcmin": column(lambda mask: float(np.max(np.abs(error[mask & accepted]), initial=0.0))),
    }
    return FigureData(name, columns, {key: 3 if "coverage" in key else 1 for key in columns})


def segments_table(name: str, outcomes: Sequence[RunOutcome]) -> FigureData:
    """Tabulate coverage with and without steady terms by number of segments.

    Each kind of disturbance has its own rows. What is the same all along one segment cannot be told from the error by
    that segment: with more of them, in other directions, their spread shows it.
    """
    kinds = np.array([outcome.case.disturbance.kind for outcome in outcomes])
    segments = np.minimum([len(outcome.case.segments_s) for outcome in outcomes], MOST_SEGMENTS)
    inside = np.array([(outcome.is_inside, outcome.is_inside_measured) for outcome in outcomes], dtype=np.float64)
    rows = []
    for kind in KINDS:
        masks = [(kinds == kind) & (segments == number) for number in range(1, MOST_SEGMENTS + 1)]
        if any(mask.any() for mask in masks):
            means = [inside[mask].mean(axis=0) if mask.any() else np.full(2, np.nan) for mask in masks]
            rows.append((kind, *(int(mask.sum()) for mask in masks), *(float(x) for m in means for x in m)))
    numbers = range(1, MOST_SEGMENTS + 1)
    names = ["cell", *(f"runs_of_{number}" for number in numbers)]
    names += [f"{what}_{number}" for number in numbers for what in ("coverage", "measured_coverage")]
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData(name, columns, dict.fromkeys(names[1 + MOST_SEGMENTS :], 3))


def gates_table(name: str, outcomes: Sequence[RunOutcome]) -> FigureData:
    """Tabulate the share of runs that pass each required gate, and each verdict's share."""
    names = list(outcomes[0].gates)
    shares = [float(np.mean([outcome.gates.get(gate) == "passed" for outcome in outcomes])) for gate in names]
    for verdict in ("accept", "advisory", "extend", "reject", "undecided"):
        names.append(f"verdict {verdict}")
        shares.append(float(np.mean([outcome.verdict == verdict for outcome in outcomes])))
    return FigureData(name, {"gate": np.array(names), "share": np.array(shares)}, {"share": 3})


def time_to_precision_table(name: str, outcomes: Sequence[RunOutcome]) -> FigureData:
    """Tabulate the taxi time that the paper's e needs to stay within its limit.

    A row for each length of run has the share that gets there, and quartiles.
    """
    lengths = np.array([sum(outcome.case.segments_s) for outcome in outcomes])
    seconds = np.array([np.inf if run.seconds_to_precision is None else run.seconds_to_precision for run in outcomes])
    rows = []
    for low, high in ((0.0, 40.5), (40.5, 60.5), (60.5, 90.5), (90.5, 130.0)):
        mask = (lengths > low) & (lengths <= high)
        if mask.any():
            reached = seconds[mask & np.isfinite(seconds)]
            quartiles = np.quantile(reached, [0.25, 0.5, 0.75]) if len(reached) else np.full(3, np.nan)
            rows.append((high, int(mask.sum()), len(reached) / mask.sum(), *quartiles))
    columns = ("taxi_up_to_s", "runs", "share_reached", "lower_quartile_s", "median_s", "upper_quartile_s")
    return FigureData(name, {key: np.array([row[i] for row in rows]) for i, key in enumerate(columns)}, {"median_s": 1})
