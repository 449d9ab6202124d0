"""Tables of the magnetic study.

Errors of every method, the claim and its limit, honesty of sigmas, refusals.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, frozen
from groundstation.methods.intervals import share_interval
from groundstation.results.figures import FigureData
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.study.bias import bank_at, power_law, power_law_above_floor
from groundstation.systems.magnetic.study.cases import BANK, CLAIM, EXACT_BANKS_DEG, PUBLISHED_BIAS_DEG, Setup, Sweep
from groundstation.systems.magnetic.study.judge import (
    JUDGED_METHODS,
    LIMITS,
    METHODS,
    NOT_ASSESSABLE,
    JudgedAnswer,
    JudgedMethod,
)
from groundstation.systems.magnetic.study.runs import SeedOutcome

DRAWS = 1000  # of the bootstrap: 95 % limits are good to 2 % of their distance
TAIL = 0.025
VERDICTS = ("accept", "reject", "undecided", NOT_ASSESSABLE)
BETTER, WORSE, UNDECIDED = "better", "worse", "no difference shown"
FLOOR_FREE_UP_TO_DEG = 30.0  # beyond, tangent and secant grow faster than any square
TABLE, IRON = "compass_table", "poisson_attitude"
POWER_SOURCES = ("steady banks by formula", "flights without noise", "flights with noise, above their floor")
RATIO_LIMITS = (1.0, 2.0, 3.0)
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_PLACE = re.compile(r": at # s # deg at # deg of bank")


@dataclass(frozen=True)
class OutcomeSample:
    """Outcomes of one point, run by run, and bootstrap weights, shape (1 + draws, runs).

    The first row of weights counts every run once. Runs are the independent units; the weights are the same at every
    point.
    """

    outcomes: tuple[JudgedAnswer, ...]
    weights: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", frozen(self.weights))

    def each(self, value: Callable[[JudgedAnswer], float]) -> FloatArray:
        """Return a figure of every run, shape (runs,), NaN where it has none."""
        return np.array([value(outcome) for outcome in self.outcomes], dtype=np.float64)

    def rms(self, values: FloatArray) -> FloatArray:
        """Return the RMS over the runs that have a figure, shape (1 + draws,)."""
        return np.sqrt(self.mean(np.square(values)))

    def mean(self, values: FloatArray) -> FloatArray:
        """Return the mean over the runs that have a figure, shape (1 + draws,)."""
        known = np.isfinite(values)
        count = self.weights @ known
        total = self.weights @ np.where(known, values, 0.0)
        return np.where(count > 0.0, total / np.where(count > 0.0, count, 1.0), np.nan)

    def of_method(self, method: str, *, whole: bool) -> FloatArray:
        """Return the RMS error of a method on every run: whole or without A."""
        place = METHODS.index(method)
        return self.each(lambda outcome: float((outcome.rms_deg if whole else outcome.shape_deg)[place]))

    def judged(self, method: str, value: Callable[[JudgedMethod], float]) -> FloatArray:
        """Return a figure of the sigmas of a method on every run."""
        return self.each(lambda outcome: value(outcome.judged[method]) if method in outcome.judged else float("nan"))


def resampling(runs: int, seed: int) -> FloatArray:
    """Return weights of the runs: all once, then bootstrap draws; shape (1 + draws, runs)."""
    drawn = np.random.default_rng(seed).multinomial(runs, np.full(runs, 1.0 / runs), DRAWS)
    return np.concatenate([np.ones((1, runs)), drawn])


def interval(values: FloatArray) -> tuple[float, float, float]:
    """Return value, low and high 95 % limit of resampled values (1 + draws,)."""
    known = values[1:][np.isfinite(values[1:])]
    if not known.size or not np.isfinite(values[0]):
        return float("nan"), float("nan"), float("nan")
    low, high = np.quantile(known, [TAIL, 1.0 - TAIL])
    return float(values[0]), float(low), float(high)


def samples_of(runs: Sequence[SeedOutcome], setups: Sequence[Setup], seed: int) -> dict[Setup, OutcomeSample]:
    """Return the outcomes of every setup."""
    weights = resampling(len(runs), seed)
    return {
        setup: OutcomeSample(tuple(run.swept[place] for run in runs), weights) for place, setup in enumerate(setups)
    }


def judged_sample(runs: Sequence[SeedOutcome], seed: int) -> OutcomeSample:
    """Return the whole flights of the judged family."""
    flown = tuple(run.judged for run in runs if run.judged is not None)
    return OutcomeSample(flown, resampling(len(flown), seed))


def accepted(sample: OutcomeSample, seed: int) -> OutcomeSample:
    """Return the sample of the runs that the estimator accepted."""
    kept = tuple(outcome for outcome in sample.outcomes if outcome.verdict == "accept")
    return OutcomeSample(kept, resampling(len(kept), seed) if kept else np.zeros((1 + DRAWS, 0)))


# Errors of the methods


def sweep_table(sweep: Sweep, samples: dict[Setup, OutcomeSample]) -> FigureData:
    """Tabulate the RMS error of every method over the points of a sweep.

    Whole and without A, with 95 % limits over flights. ``fitted`` flights count; ``inside2`` is the share of the
    headings on which the error is within 2 stated sigma.
    """
    rows = []
    for value, setup in sweep.points:
        sample = samples[setup]
        world = [float(np.median(sample.each(of))) for of in (lambda one: one.dip_deg, lambda one: one.horizontal_nt)]
        for method in METHODS:
            whole, shape = (sample.of_method(method, whole=is_whole) for is_whole in (True, False))
            inside = interval(sample.mean(sample.judged(method, lambda judged: float(judged.curve_inside[1]))))
            counts = len(sample.outcomes), int(np.isfinite(shape).sum())
            errors = (*interval(sample.rms(whole)), *interval(sample.rms(shape)))
            rows.append((value, *world, method, *counts, *errors, *inside))
    names = (
        *(sweep.column, "dip_deg", "horizontal_nt", "method", "flights", "fitted"),
        *("rms_deg", "rms_low_deg", "rms_high_deg", "shape_deg", "shape_low_deg", "shape_high_deg"),
        *("inside2", "inside2_low", "inside2_high"),
    )
    return _table(
        f"magnetic_{sweep.name}", names, rows, {"dip_deg": 1, "horizontal_nt": 0} | dict.fromkeys(names[6:], 3)
    )


def ratio_table(sweeps: Sequence[Sweep], samples: dict[Setup, OutcomeSample]) -> FigureData:
    """Tabulate errors of the iron fit and of one branch over that of the branch table.

    The errors are without A; the flights are the same.
    """
    rows = []
    for sweep in sweeps:
        for value, setup in sweep.points:
            sample = samples[setup]
            table = sample.of_method(TABLE, whole=False)
            for method in (IRON, "one_branch"):
                other = sample.of_method(method, whole=False)
                both = np.isfinite(table) & np.isfinite(other)
                errors = [sample.rms(np.where(both, values, np.nan)) for values in (other, table)]
                found = interval(errors[0] / errors[1])
                rows.append((sweep.name, value, method, int(both.sum()), *found, finding(*found[1:])))
    names = ("sweep", "value", "method", "flights", "ratio", "low", "high", "finding")
    return _table("magnetic_ratios", names, rows, {"value": 3, "ratio": 3, "low": 3, "high": 3})


def finding(low: float, high: float) -> str:
    """Return the conclusion from an interval of a ratio of errors; empty without one."""
    if np.isnan(low):
        return ""
    return BETTER if high < 1.0 else WORSE if low > 1.0 else UNDECIDED


def residual_table(sample: OutcomeSample) -> FigureData:
    """Tabulate the error that every method leaves on whole flights.

    Columns: every heading, and the held-out part against truth and INS.
    """
    rows = []
    for method in METHODS:
        whole, shape = (sample.of_method(method, whole=is_whole) for is_whole in (True, False))
        if method == "none":
            held, own = sample.each(lambda outcome: outcome.before_rms_deg), np.full(len(sample.outcomes), np.nan)
        else:
            held = sample.judged(method, lambda judged: judged.held_out_rms_deg)
            own = sample.judged(method, lambda judged: judged.own_rms_deg)
        parts = [part for values in (whole, shape, held, own) for part in interval(sample.rms(values))]
        rows.append((method, len(sample.outcomes), int(np.isfinite(shape).sum()), *parts))
    names = ["method", "flights", "fitted"]
    for name in ("rms", "shape", "held_out", "held_out_by_ins"):
        names += [f"{name}_deg", f"{name}_low_deg", f"{name}_high_deg"]
    return _table("magnetic_residuals", names, rows, dict.fromkeys(names[3:], 3))


# The published claim and its limit


def claim_table(runs: Sequence[SeedOutcome], samples: dict[Setup, OutcomeSample]) -> FigureData:
    """Tabulate the bank error of one branch and of the average, by formula and flown.

    The average is that of opposite branches; the flights have no noise. ``left`` is the share of one branch's error
    that the average keeps; published are the figures of the design.
    """
    rows = []
    for place, (bank, setup) in enumerate(CLAIM.points):
        sample = samples[setup]
        formula = [
            sample.rms(np.array([getattr(run.biases, name)[place] for run in runs]))
            for name in ("one_branch_deg", "average_deg")
        ]
        flown = [sample.rms(sample.of_method(name, whole=False)) for name in ("one_branch", TABLE)]
        fitted = int(np.isfinite(sample.of_method(TABLE, whole=False)).sum())
        parts = [*formula, *flown, flown[1] / flown[0]]
        published = PUBLISHED_BIAS_DEG.get(bank, float("nan"))
        rows.append((bank, len(runs), fitted, published, *(part for values in parts for part in interval(values))))
    names = ["bank_deg", "flights", "fitted", "published_deg"]
    for name in ("formula_branch", "formula_average", "flown_branch", "flown_average"):
        names += [f"{name}_deg", f"{name}_low_deg", f"{name}_high_deg"]
    names += ["left", "left_low", "left_high"]
    return _table("magnetic_claim", names, rows, {"bank_deg": 0} | dict.fromkeys(names[3:], 3))


def power_table(runs: Sequence[SeedOutcome], samples: dict[Setup, OutcomeSample]) -> FigureData:
    """Tabulate the exponent of the bank with which the average's bias grows.

    The table also has the bank at which the bias passes the limit.
    """
    banks = np.array(EXACT_BANKS_DEG)
    weigher = samples[CLAIM.points[0][1]]
    formula = np.stack([weigher.rms(np.array([run.biases.average_deg[k] for run in runs])) for k in range(len(banks))])
    exact = np.stack(
        [samples[setup].rms(samples[setup].of_method(TABLE, whole=False)) for _bank, setup in CLAIM.points]
    )
    noisy = [(bank, samples[setup]) for bank, setup in BANK.points if bank <= FLOOR_FREE_UP_TO_DEG]
    errors = np.stack([sample.rms(sample.of_method(TABLE, whole=False)) for _bank, sample in noisy])
    fits = (
        power_law(banks, formula.T),
        power_law(banks, exact.T),
        power_law_above_floor(np.array([bank for bank, _sample in noisy]), errors.T),
    )
    limit = LIMITS.bank_bias_max_deg
    rows = [
        (source, len(runs), *interval(exponent), limit, *interval(bank_at(limit, exponent, size)))
        for source, (exponent, size) in zip(POWER_SOURCES, fits, strict=True)
    ]
    names = (
        *("source", "flights", "exponent", "exponent_low", "exponent_high", "limit_deg"),
        *("bank_deg", "bank_low_deg", "bank_high_deg"),
    )
    return _table("magnetic_power", names, rows, dict.fromkeys(names[2:6], 2) | dict.fromkeys(names[6:], 1))


# Honesty


def honesty_table(sample: OutcomeSample) -> FigureData:
    """Tabulate the shares of the flights with an error within 1, 2, 3 stated sigma.

    Errors are against the truth; with 95 % limits.
    """
    rows: list[tuple[object, ...]] = []
    for method in JUDGED_METHODS:
        for place, letter in enumerate(LETTERS):
            ratio = sample.judged(method, lambda judged, at=place: float(judged.coefficient_ratio[at]))  # type: ignore[misc]
            rows.append((method, letter, *_inside(ratio)))
        for measure, name in MEASURES.items():
            ratio = sample.judged(method, lambda judged, of=name: float(getattr(judged, of)))  # type: ignore[misc]
            rows.append((method, measure, *_inside(ratio)))
        shares = [
            sample.judged(method, lambda judged, at=place: float(judged.curve_inside[at]))  # type: ignore[misc]
            for place in range(len(RATIO_LIMITS))
        ]
        known = int(np.isfinite(shares[0]).sum())
        parts = [part for share in shares for part in interval(sample.mean(share))]
        rows.append((method, EVERY_HEADING, known, *parts, float("nan")))
    names = ["method", "error_of", "flights"]
    for limit in RATIO_LIMITS:
        names += [f"inside{limit:g}", f"inside{limit:g}_low", f"inside{limit:g}_high"]
    names.append("rms_ratio")
    return _table("magnetic_honesty", names, rows, dict.fromkeys(names[3:], 3))


HELD_OUT = "mean of the held-out part, against the truth"
EVERY_HEADING = "level flight, share of all headings"
MEASURES = {
    HELD_OUT: "held_out_ratio",
    "mean of the held-out part, by its own INS and sigma": "own_ratio",
    "level flight, rms over all headings": "curve_ratio",
}


def _inside(ratio: FloatArray) -> tuple[float, ...]:
    """Return count, shares within the limits with exact intervals, and RMS of the ratio.

    The count is that of known ratios.
    """
    known = np.abs(ratio[np.isfinite(ratio)])
    parts: list[float] = [len(known)]
    for limit in RATIO_LIMITS:
        count = int(np.sum(known <= limit))
        parts += [count / len(known) if len(known) else float("nan"), *share_interval(count, len(known))]
    return (*parts, float(np.sqrt(np.mean(known**2))) if len(known) else float("nan"))


# Verdicts and refusals


def verdict_table(judged: OutcomeSample, sweeps: Sequence[Sweep], samples: dict[Setup, OutcomeSample]) -> FigureData:
    """Tabulate the verdicts at every point, and the commonest reason against acceptance.

    ``modulus_refused`` counts assessable flights on which the estimator's limits refuse the modulus fit.
    """
    points: list[tuple[str, float, OutcomeSample]] = [("whole flights", float("nan"), judged)]
    points += [(sweep.name, value, samples[setup]) for sweep in sweeps for value, setup in sweep.points]
    rows = []
    for name, value, sample in points:
        counts = [sum(outcome.verdict == verdict for outcome in sample.outcomes) for verdict in VERDICTS]
        total = len(sample.outcomes)
        reasons = reasons_of(outcome for outcome in sample.outcomes if outcome.verdict != "accept").most_common(1)
        share = (counts[0] / total if total else float("nan"), *share_interval(counts[0], total))
        refused = sum(outcome.is_modulus_refused for outcome in sample.outcomes)
        rows.append((name, value, total, *counts, *share, refused, reasons[0][0] if reasons else ""))
    names = (
        *("sweep", "value", "flights", "accepted", "rejected", "undecided", "not_assessable"),
        *("accepted_share", "low", "high", "modulus_refused", "most_frequent_reason"),
    )
    return _table("magnetic_verdicts", names, rows, {"value": 3, "accepted_share": 3, "low": 3, "high": 3})


def incomplete_table(runs: Sequence[SeedOutcome]) -> FigureData:
    """Tabulate how many incomplete figures were refused or accepted, by reason.

    In a reason, # stands for a number.
    """
    rows = []
    flown = [run.incomplete for run in runs if run.incomplete]
    for kind in flown[0] if flown else ():
        outcomes = [run[kind] for run in flown]
        for verdict in VERDICTS:
            chosen = [outcome for outcome in outcomes if outcome.verdict == verdict]
            for reason, count in reasons_of(chosen).most_common():
                limits = share_interval(count, len(outcomes))
                rows.append((kind, len(outcomes), verdict, count, count / len(outcomes), *limits, reason))
    names = ("figure", "flights", "verdict", "count", "share", "low", "high", "reason")
    return _table("magnetic_incomplete", names, rows, {"share": 2, "low": 2, "high": 2})


def reasons_of(outcomes: Iterable[JudgedAnswer]) -> Counter[str]:
    """Count each reason: the first one of each flight, without its numbers."""
    return Counter(plain_reason(outcome.reason) for outcome in outcomes)


def plain_reason(text: str) -> str:
    """Return the first reason of several without numbers and places.

    Examples
    --------
    >>> plain_reason("no opposite turns: at 37 s +402 deg at +20 deg of bank: no opposite turn; at 300 s ...")
    'no opposite turns: no opposite turn'
    """
    return _PLACE.sub("", _NUMBER.sub("#", text.split(";")[0]))


def rows_where(table: FigureData, **chosen: object) -> BoolArray:
    """Return rows of a table with given values."""
    return np.asarray(np.logical_and.reduce([table[name] == value for name, value in chosen.items()]), dtype=np.bool_)


def _table(name: str, names: Sequence[str], rows: Sequence[Sequence[object]], digits: dict[str, int]) -> FigureData:
    return FigureData(name, {key: np.array([row[place] for row in rows]) for place, key in enumerate(names)}, digits)
