"""Study of the histories of INS units (docs/fleet.md): slopes, changes and dates.

Rates are drawn, not flown: what is judged is the statistics over flights.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.methods.fleet.confidence import share_high, share_low
from groundstation.methods.fleet.units import FlownUnit, histories_of
from groundstation.results.figures import FigureData
from groundstation.results.fleet_units import FleetUnitRow, UnitLimits, UnitOfFlight
from groundstation.systems.study import StudyResult, section, table

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]
START_NS = 1_777_874_400_000_000_000  # 2026-05-04T06:00:00Z
NS_PER_DAY = 86_400_000_000_000
LEVEL, LIMIT = 0.6, 2.0  # nmi/h
AGEING = 0.6  # nmi/h per year
STEP = 2.5  # times the level
FLIGHTS = (8, 15, 30, 60)
MOST_FALSE = 0.05


@dataclass(frozen=True)
class History:
    """Kind of history: how the level goes, how flights scatter about it.

    Parameters
    ----------
    name : str
    level : {'steady', 'linear', 'exponential', 'step'}
    scatter : {'lognormal', 'rayleigh', 'heavy', 'alike', 'clusters'}
        Rayleigh: the length of a vector, as an error of position is; heavy: one flight in fifteen is four times as bad;
        alike: neighbours are correlated by 0.5; clusters: ten flights in a week, then a month without.
    is_broken : bool
        Whether it breaks an assumption of the method.
    """

    name: str
    level: str
    scatter: str
    is_broken: bool = False


FAMILY = (
    History("steady, lognormal", "steady", "lognormal"),
    History("steady, length of a vector", "steady", "rayleigh"),
    History("steady, wild flights", "steady", "heavy"),
    History("ageing by a line", "linear", "lognormal"),
    History("ageing by a line, length of a vector", "linear", "rayleigh"),
    History("ageing by a factor", "exponential", "lognormal"),
    History("step", "step", "lognormal"),
    History("steady, flown in clusters", "steady", "clusters"),
    History("steady, flights alike", "steady", "alike", is_broken=True),
    History("ageing by a line, flights alike", "linear", "alike", is_broken=True),
)


@dataclass(frozen=True)
class JudgedHistory:
    """One history against its truth; None where nothing was claimed."""

    name: str
    flights: int
    slope_held: bool | None
    level_held: bool | None
    changed: bool
    step_found: bool
    outlook: str
    date_held: bool | None
    date_off_days: float


def study_units_over_time(runs: int = 200, seed: int = 71, progress: Progress | None = None) -> StudyResult:
    """Draw histories of every kind and length, and judge what is said of each.

    Parameters
    ----------
    runs : int
        Histories of each kind and length.
    seed : int
    progress : callable, optional
    """
    judged: list[JudgedHistory] = []
    for kind, history in enumerate(FAMILY):
        for flights in FLIGHTS:
            if progress is not None:
                progress(f"{history.name}, {flights} flights")
            judged += [
                judge(history, flights, np.random.default_rng([seed, kind, flights, run])) for run in range(runs)
            ]
    tables = (_table(judged), _false_table(judged))
    return StudyResult(
        "units_over_time",
        tables,
        (
            section(
                "Study: INS units over time",
                f"{runs} histories of each kind and length, seed {seed}; level {LEVEL:g} nmi/h, ageing {AGEING:g} nmi/h"
                f" per year, step by a factor of {STEP:g}, limit {LIMIT:g} nmi/h. Flights are spread over a year at "
                "random. Shares of histories: slope and level inside their 95 % intervals; a change was found; "
                "dated: a date was given; date inside: the true day is inside its interval.",
            ),
            section("By kind and length", table(tables[0])),
            section(
                "False changes",
                f"Histories without a step in which a change is called; at most {100 * MOST_FALSE:g} % is asked.",
                table(tables[1]),
            ),
        ),
    )


def judge(history: History, flights: int, rng: np.random.Generator) -> JudgedHistory:
    """Judge one history."""
    day = _days(history, flights, rng)
    truth = _level(history, day, day)
    rates = truth * _scatter(history, flights, rng)
    flown = [
        FlownUnit(
            UnitOfFlight("ins", "S-1", ins_class="navigation", rate_nmiph=float(rate)),
            f"F{place:04d}",
            "RA-1",
            START_NS + int(when * NS_PER_DAY),
        )
        for place, (when, rate) in enumerate(zip(day.tolist(), rates.tolist(), strict=True))
    ]
    found = histories_of(flown, UnitLimits(rate_nmiph=LIMIT))
    (row,) = found.rows
    places = [one.flight_id for one in found.events if one.kind == "changed"]
    step_at = flights // 2
    true_step = history.level == "step"
    slope = _true_slope(history, day)
    now = float(_level(history, day[-1:], day)[0])
    date_held, off = _date(history, row, day)
    return JudgedHistory(
        history.name,
        flights,
        _holds(row.slope_low_nmiph_per_year, row.slope_high_nmiph_per_year, slope) if slope is not None else None,
        _holds(row.rate_low_nmiph, row.rate_high_nmiph, now),
        bool(places),
        true_step and any(abs(int(one[1:]) - step_at) <= 2 for one in places),
        row.outlook,
        date_held,
        off,
    )


def _days(history: History, flights: int, rng: np.random.Generator) -> FloatArray:
    if history.scatter == "clusters":
        return np.array([30.0 * (place // 10) + 0.7 * (place % 10) for place in range(flights)])
    return np.sort(rng.uniform(0.0, 365.0, flights))


def _level(history: History, at: FloatArray, day: FloatArray) -> FloatArray:
    years = at / 365.25
    if history.level == "linear":
        return LEVEL + AGEING * years
    if history.level == "exponential":
        return np.asarray(LEVEL * np.exp(AGEING / LEVEL * years))
    if history.level == "step":
        return np.where(at >= day[len(day) // 2], STEP * LEVEL, LEVEL)
    return np.full(len(at), LEVEL)


def _scatter(history: History, flights: int, rng: np.random.Generator) -> FloatArray:
    """Factors with median one."""
    if history.scatter == "rayleigh":
        return np.asarray(rng.rayleigh(1.0 / np.sqrt(2.0 * np.log(2.0)), flights))
    noise = rng.normal(0.0, 1.0, flights)
    if history.scatter == "alike":
        for place in range(1, flights):
            noise[place] = 0.5 * noise[place - 1] + np.sqrt(0.75) * noise[place]
    factors = np.exp(0.25 * noise)
    if history.scatter == "heavy":
        factors *= np.where(rng.random(flights) < 1.0 / 15.0, 4.0, 1.0)
    return np.asarray(factors)


def _true_slope(history: History, day: FloatArray) -> float | None:
    """Slope per year; None where the level is no line."""
    if history.level in ("steady", "step"):
        return 0.0 if history.level == "steady" else None
    return AGEING if history.level == "linear" else None


def _date(history: History, row: FleetUnitRow, day: FloatArray) -> tuple[bool | None, float]:
    """Tell whether the true day is inside the interval of a date, and how far off the date is."""
    if row.outlook != "due" or row.due_utc_ns is None:
        return None, float("nan")
    due = (row.due_utc_ns - START_NS) / NS_PER_DAY
    if history.level in ("steady", "step"):
        return False, float("nan")
    years = (LIMIT - LEVEL) / AGEING if history.level == "linear" else np.log(LIMIT / LEVEL) / (AGEING / LEVEL)
    true_ns = START_NS + years * 365.25 * NS_PER_DAY
    early = row.due_earliest_utc_ns if row.due_earliest_utc_ns is not None else -np.inf
    late = row.due_latest_utc_ns if row.due_latest_utc_ns is not None else np.inf
    return bool(early - NS_PER_DAY <= true_ns <= late + NS_PER_DAY), due - years * 365.25


def _holds(low: float | None, high: float | None, truth: float) -> bool | None:
    return None if low is None or high is None else low <= truth <= high


def _table(judged: Sequence[JudgedHistory]) -> FigureData:
    groups: dict[tuple[str, int], list[JudgedHistory]] = {}
    for one in judged:
        groups.setdefault((one.name, one.flights), []).append(one)
    columns: dict[str, NDArray[np.generic]] = {
        "history": np.array([name for name, _ in groups]),
        "flights": np.array([flights for _, flights in groups]),
        "slope_inside": np.array([_share([one.slope_held for one in mine]) for mine in groups.values()]),
        "level_inside": np.array([_share([one.level_held for one in mine]) for mine in groups.values()]),
        "changed": np.array([_share([one.changed for one in mine]) for mine in groups.values()]),
        "step_found": np.array(
            [_share([one.step_found if one.name == "step" else None for one in mine]) for mine in groups.values()]
        ),
        "dated": np.array([_share([one.outlook == "due" for one in mine]) for mine in groups.values()]),
        "date_inside": np.array([_share([one.date_held for one in mine]) for mine in groups.values()]),
        "date_off_days": np.array([_middle([one.date_off_days for one in mine]) for mine in groups.values()]),
    }
    digits = {name: 3 for name, values in columns.items() if values.dtype.kind == "f"} | {"date_off_days": 0}
    return FigureData("units_over_time", columns, digits)


def _false_table(judged: Sequence[JudgedHistory]) -> FigureData:
    without = {one.name: one.is_broken for one in FAMILY if one.level != "step"}
    names = [*without, "all but those that break an assumption"]
    counts = []
    for name in names:
        mine = [one for one in judged if one.name == name or (name == names[-1] and not without.get(one.name, True))]
        counts.append((len(mine), sum(one.changed for one in mine)))
    return FigureData(
        "units_false_changes",
        {
            "history": np.array(names),
            "histories": np.array([count for count, _ in counts]),
            "changed": np.array([changed for _, changed in counts]),
            "share": np.array([changed / max(count, 1) for count, changed in counts]),
            "share_low": np.array([share_low(count, count - changed, 0.975) for count, changed in counts]),
            "share_high": np.array([share_high(count, count - changed, 0.975) for count, changed in counts]),
        },
        {"share": 3, "share_low": 3, "share_high": 3},
    )


def _share(flags: Sequence[bool | None]) -> float:
    known = [one for one in flags if one is not None]
    return float(np.mean(known)) if known else float("nan")


def _middle(values: Sequence[float]) -> float:
    known = np.array([one for one in values if np.isfinite(one)])
    return float(np.median(known)) if len(known) else float("nan")
