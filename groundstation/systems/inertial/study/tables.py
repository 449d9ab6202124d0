"""Tables of the forecast study.

RMS, ratios and findings with intervals over flights, held-out scores, honesty.
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import chi_square_quantile
from groundstation.base.records import frozen
from groundstation.results.figures import FigureData
from groundstation.systems.inertial.study.cases import FilterCase
from groundstation.systems.inertial.study.runs import (
    COUPLED,
    JUDGED_NAMES,
    LEVELS,
    METHOD_NAMES,
    SETS_OF_STARTS,
    STUDY_HORIZONS_MIN,
    CaseFlight,
    Honesty,
)

DRAWS = 1000  # of the bootstrap: 95 % limits are good to 2 % of their distance
TAIL = 0.025
CHI_SQUARE_TAIL = 0.005  # either side of the 99 % limits
WORST = 0.1
REFERENCE = "last_estimate"
COMPARED = ("windows", "drift_windows", "consistent_windows", "smoothed_start", "noise_bank", COUPLED)
BETTER, WORSE, UNDECIDED = "better", "worse", "no difference shown"
_ALL = SETS_OF_STARTS.index("all")


@dataclass(frozen=True)
class Resampled:
    """Mean squares of one case over all flights, and over bootstrap draws of flights.

    Flights are drawn with replacement.

    Parameters
    ----------
    mean_square_m2 : ndarray, shape (1 + draws, 10, 5, h)
        First the flights themselves, then the bootstrap; flights are the independent units, starts are not.
    flights : int
    """

    mean_square_m2: FloatArray
    flights: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean_square_m2", frozen(self.mean_square_m2))

    @classmethod
    def of(cls, outcomes: Sequence[CaseFlight], seed: int) -> "Resampled":
        """Return a case with ``DRAWS`` bootstrap draws of its flights.

        Cases with equally many flights get the same draws.
        """
        each = np.stack([outcome.mean_square_m2 for outcome in outcomes])
        count = len(each)
        weights = np.random.default_rng(seed).multinomial(count, np.full(count, 1.0 / count), DRAWS) / count
        weights = np.concatenate([np.full((1, count), 1.0 / count), weights])
        return cls(np.tensordot(weights, each, axes=1), count)

    def rms_m(self, method: str, starts: int = _ALL) -> FloatArray:
        """Return the RMS over flights and starts, shape (1 + draws, h)."""
        return np.asarray(np.sqrt(self.mean_square_m2[:, METHOD_NAMES.index(method), starts]))

    def ratio(self, method: str, reference: str = REFERENCE, starts: int = _ALL) -> FloatArray:
        """Return the RMS of a method over that of another, shape (1 + draws, h)."""
        return np.asarray(self.rms_m(method, starts) / self.rms_m(reference, starts))


def interval(values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return value, low and high 95 % limit of resampled values (1 + draws, ...)."""
    low, high = np.quantile(values[1:], [TAIL, 1.0 - TAIL], axis=0)
    return values[0], low, high


def finding(low: float, high: float) -> str:
    """Return the conclusion from an interval of a ratio of errors; empty without one."""
    if np.isnan(low):
        return ""
    return BETTER if high < 1.0 else WORSE if low > 1.0 else UNDECIDED


def rms_table(cases: dict[str, Resampled]) -> FigureData:
    """Tabulate the RMS of every method in every case, at all starts and the paper's four.

    The values have 95 % limits.
    """
    rows = []
    for case, sample in cases.items():
        for place, starts in enumerate(SETS_OF_STARTS):
            for method in METHOD_NAMES:
                for at, found in enumerate(zip(*interval(sample.rms_m(method, place)), strict=True)):
                    if np.isfinite(found[0]):
                        rows.append((case, starts, method, STUDY_HORIZONS_MIN[at], *found, sample.flights))
    names = ("case", "starts", "method", "horizon_min", "rms_m", "low_m", "high_m", "flights")
    return _table("forecast_rms", names, rows, {"horizon_min": 0, "rms_m": 1, "low_m": 1, "high_m": 1})


def ratio_table(cases: dict[str, Resampled]) -> FigureData:
    """Tabulate the RMS of windows and smoothed start over that of the last estimate.

    The ratios have 95 % limits and a conclusion.
    """
    rows = []
    for case, sample in cases.items():
        for place, starts in enumerate(SETS_OF_STARTS):
            for method in COMPARED:
                for at, found in enumerate(zip(*interval(sample.ratio(method, starts=place)), strict=True)):
                    if np.isfinite(found[0]):
                        says = finding(*found[1:])
                        rows.append((case, starts, method, STUDY_HORIZONS_MIN[at], *found, says))
    names = ("case", "starts", "method", "horizon_min", "ratio", "low", "high", "finding")
    return _table("forecast_ratios", names, rows, {"horizon_min": 0, "ratio": 3, "low": 3, "high": 3})


def later_table(cases: dict[str, Resampled]) -> FigureData:
    """Tabulate RMS from the latest start over RMS from the first, with 95 % limits.

    The latest of the four starts whose horizon fits.
    """
    rows = []
    for case, sample in cases.items():
        for method in (REFERENCE, "windows"):
            for at, horizon in enumerate(STUDY_HORIZONS_MIN):
                fits = [p for p in range(1, len(SETS_OF_STARTS)) if np.isfinite(sample.rms_m(method, p)[0, at])]
                if len(fits) < 2:
                    continue
                ratio = sample.rms_m(method, fits[-1])[:, at] / sample.rms_m(method, fits[0])[:, at]
                found = tuple(float(part) for part in interval(ratio))
                early, late = SETS_OF_STARTS[fits[0]], SETS_OF_STARTS[fits[-1]]
                rows.append((case, method, horizon, early, late, *found, finding(*found[1:])))
    names = ("case", "method", "horizon_min", "early", "late", "ratio", "low", "high", "finding")
    return _table("forecast_later_starts", names, rows, {"horizon_min": 0, "ratio": 3, "low": 3, "high": 3})


def cure_table(windows: Resampled, cure: Resampled) -> FigureData:
    """Tabulate the paper's windows over the last estimate with R inflated.

    The GNSS error is coloured; the flights are the same.
    """
    ratio = windows.rms_m("windows") / cure.rms_m(REFERENCE)
    rows = [
        (STUDY_HORIZONS_MIN[at], float(windows.rms_m("windows")[0, at]), float(cure.rms_m(REFERENCE)[0, at]), *found)
        for at, found in enumerate(zip(*interval(ratio), strict=True))
    ]
    names = ("horizon_min", "windows_rms_m", "inflated_rms_m", "ratio", "low", "high")
    digits = {"horizon_min": 0, "windows_rms_m": 1, "inflated_rms_m": 1, "ratio": 2, "low": 2, "high": 2}
    return _table("forecast_cure", names, rows, digits)


def held_out_table(cases: Sequence[FilterCase], samples: dict[str, Resampled]) -> FigureData:
    """Tabulate the score of every method on the held-out flights, best first.

    ``score`` is the geometric mean, over cases and horizons (all starts), of RMS over that of the last estimate;
    ``against_best`` the same over the best method, with 95 % limits over flights.
    """
    held_out = [samples[case.name] for case in cases if case.is_held_out]
    logs = {}
    for method in METHOD_NAMES:
        known = [sample.ratio(method) for sample in held_out]
        if all(np.isfinite(ratio).all() for ratio in known):
            logs[method] = np.mean([np.log(ratio).mean(axis=1) for ratio in known], axis=0)
    ranking = sorted(logs, key=lambda method: float(logs[method][0]))
    rows = []
    for method in ranking:
        score = tuple(float(part) for part in interval(np.exp(logs[method])))
        against = tuple(float(part) for part in interval(np.exp(logs[method] - logs[ranking[0]])))
        rows.append((method, *score, *against))
    names = ("method", "score", "low", "high", "against_best", "against_best_low", "against_best_high")
    return _table("forecast_held_out", names, rows, dict.fromkeys(names[1:], 3))


def honesty_table(outcomes: dict[str, tuple[CaseFlight, ...]], flights_at_least: int = 2) -> FigureData:
    """Tabulate coverage of the 50, 68 and 95 % bands, and NEES, by case, method and horizon.

    ``nees`` is the mean over all starts (1 is honest); ``first`` the mean over the first start of each flight, whose
    99 % limits come from chi-square with two degrees of freedom a flight. Columns ``_model`` are before the sigma is
    scaled by the class and the flight's past. ``coverage95_sigma`` is the spread of the mean over flights,
    ``coverage95_worst`` what the tenth of the flights with the least has at most. ``flights_within`` is the share of
    the flights whose own NEES is within its 95 % limits, from the independent starts of each.
    """
    rows = []
    for case, several in outcomes.items():
        known = [outcome.honesty for outcome in several if outcome.honesty is not None]
        if len(known) < flights_at_least:
            continue
        inside, inside_model = (np.stack([getattr(h, name) for h in known]) for name in ("inside", "inside_model"))
        nees, model = (np.mean([getattr(h, name) for h in known], axis=0) for name in ("nees", "nees_model"))
        first, bare = (np.mean([getattr(h, n) for h in known], axis=0) / 2.0 for n in ("first", "first_model"))
        freedom = 2 * len(known)
        limits = [
            float(chi_square_quantile(part, freedom)) / freedom for part in (CHI_SQUARE_TAIL, 1.0 - CHI_SQUARE_TAIL)
        ]
        spread = inside[..., LEVELS.index(95)].std(axis=0, ddof=1) / np.sqrt(len(known))
        within = _flights_within(known)
        worst = np.quantile(inside[..., LEVELS.index(95)], WORST, axis=0)
        for index, method in enumerate(JUDGED_NAMES):
            for at, horizon in enumerate(STUDY_HORIZONS_MIN):
                if not np.isfinite(nees[index, at]):
                    continue
                shares = (
                    *(*inside.mean(axis=0)[index, at], spread[index, at], worst[index, at]),
                    *(within[index, at], inside_model.mean(axis=0)[index, at, 2]),
                )
                ratios = (nees[index, at], model[index, at], first[index, at], bare[index, at], *limits)
                rows.append((case, method, horizon, len(known), *(float(value) for value in (*shares, *ratios))))
    names = (
        *("case", "method", "horizon_min", "flights", "coverage50", "coverage68", "coverage95", "coverage95_sigma"),
        *(
            "coverage95_worst",
            "flights_within",
            "coverage95_model",
            "nees",
            "nees_model",
            "first",
            "first_model",
            "first_low",
            "first_high",
        ),
    )
    return _table("forecast_honesty", names, rows, {"horizon_min": 0} | dict.fromkeys(names[4:], 3))


def _flights_within(known: Sequence[Honesty]) -> FloatArray:
    """Return the share of flights with NEES in its 95 % limits, shape (methods, h)."""
    inside = []
    for honesty in known:
        freedom = 2.0 * honesty.independent
        low, high = (chi_square_quantile(part, freedom) / freedom for part in (TAIL, 1.0 - TAIL))
        inside.append((honesty.nees >= low) & (honesty.nees <= high))
    return np.asarray(np.mean(inside, axis=0))


def gate_table(outcomes: dict[str, tuple[CaseFlight, ...]]) -> FigureData:
    """Tabulate the share of the position measurements that the gate rejected.

    Mean over flights, and largest.
    """
    shares = {case: np.array([outcome.rejected_share for outcome in several]) for case, several in outcomes.items()}
    rows = [(case, float(share.mean()), float(share.max())) for case, share in shares.items()]
    names = ("case", "rejected_share", "largest_rejected_share")
    return _table("forecast_gate", names, rows, dict.fromkeys(names[1:], 4))


def _table(name: str, names: Sequence[str], rows: Sequence[Sequence[object]], digits: dict[str, int]) -> FigureData:
    columns = {key: np.array([row[place] for row in rows]) for place, key in enumerate(names)}
    return FigureData(name, columns, digits)
