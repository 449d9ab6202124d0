"""Study of ground stations: errors found, false alarms, and what the answer gains."""

from collections.abc import Callable, Sequence

import numpy as np

from groundstation.results.figures import FigureData
from groundstation.systems.cooperative.study.runs import WORKERS, Progress
from groundstation.systems.cooperative.study.station_cases import CASES, FIRST_SEED, StationCase
from groundstation.systems.cooperative.study.station_runs import StationRun, run_station_cases
from groundstation.systems.study import StudyResult, grid, section

HEADS = (
    *("case", "found", "wrong in doubt", "named alone", "plain test", "true shift inside 95 %", "RMS before, m"),
    *("RMS after, m", "NEES (2)", "error inside protection", "detectable, worst, m", "m per m", "NEES of survey (2)"),
)
SHARES = ("found", "in_doubt", "named", "left_out", "datum_told", "plain_found")
MEANS = ("inside_95", "nees", "protected", "detectable_m", "metres_per_metre", "survey_nees")


def study_stations(
    runs: int = 200,
    seed: int = 0,
    progress: Progress | None = None,
    *,
    cases: Sequence[StationCase] = CASES,
    workers: int = WORKERS,
) -> StudyResult:
    """Fly every case of both families.

    Parameters
    ----------
    runs : int
        Sessions of each case.
    seed : int
        The runs' seed is ``FIRST_SEED + seed``.
    progress : callable, optional
        Called with one line for each case.
    cases : sequence of StationCase
    workers : int
        Processes; the answer does not depend on them.
    """
    outcomes = run_station_cases(cases, runs, FIRST_SEED + seed, progress, workers)
    table = station_table(cases, outcomes)
    text = (
        f"{runs} simulated sessions a case, seed {FIRST_SEED + seed}: three aircraft over 500 s. Shares with their "
        "95 % intervals (Wilson). Found: any station in doubt; for right stations these are false alarms. Named alone: "
        "the wrong station and no other is in doubt. Plain test: |mean| sqrt(n) > 3 of the filter's normalised "
        "innovations of any link of a station after the first minute. RMS: the smoothed answer with the stations as "
        "they are, and as given. Error inside protection: aircraft whose largest error stays below their protection "
        "level, in runs in which no station is in doubt."
    )
    parts = [section("Study: ground stations", text)]
    for title, is_breaking in (("Assumptions kept", False), ("Assumptions broken", True)):
        mine = [at for at, case in enumerate(cases) if case.is_breaking is is_breaking]
        if mine:
            parts.append(section(title, grid(HEADS, [_told(cases[at], table, at) for at in mine])))
    return StudyResult("stations", (table,), tuple(parts))


def wilson(count: int, runs: int, z: float = 1.96) -> tuple[float, float]:
    """Return the 95 % interval of a share.

    Source: Wilson, Probable inference, Journal of the American Statistical Association 22 (1927).

    Examples
    --------
    >>> [round(bound, 3) for bound in wilson(190, 200)]
    [0.91, 0.973]
    """
    share, square = count / runs, z * z / runs
    middle = (share + 0.5 * square) / (1.0 + square)
    half = z * np.sqrt(share * (1.0 - share) / runs + square / (4.0 * runs)) / (1.0 + square)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def station_table(cases: Sequence[StationCase], outcomes: dict[str, tuple[StationRun, ...]]) -> FigureData:
    """Tabulate shares with intervals, errors before and after, and means."""
    columns: dict[str, list[object]] = {"case": [], "title": [], "runs": []}
    for case in cases:
        several = outcomes[case.name]
        row: dict[str, object] = {"case": case.name, "title": case.title, "runs": len(several)}
        for name in SHARES:
            count = sum(bool(getattr(one, name)) for one in several)
            low, high = wilson(count, len(several))
            row |= {f"{name}_count": count, f"{name}_low": low, f"{name}_high": high}
        for name in ("before_m", "after_m"):
            row[name] = float(np.sqrt(np.mean([getattr(one, name) ** 2 for one in several])))
        for name in MEANS:
            row[name] = _mean([getattr(one, name) for one in several])
        for name, value in row.items():
            columns.setdefault(name, []).append(value)
    digits = {name: 3 for name in columns if name.endswith(("_low", "_high"))}
    return FigureData("cooperative_stations_study", {name: np.array(part) for name, part in columns.items()}, digits)


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")


def _told(case: StationCase, table: FigureData, at: int) -> tuple[str, ...]:
    def share(name: str) -> str:
        low, high = (100.0 * float(table[f"{name}_{end}"][at]) for end in ("low", "high"))
        return f"{table[f'{name}_count'][at]} of {table['runs'][at]} ({low:.1f} to {high:.1f} %)"

    def value(name: str, digits: int) -> str:
        found = float(table[name][at])
        return "" if np.isnan(found) else f"{found:.{digits}f}"

    wrong: Callable[[str], str] = share if case.is_wrong else lambda _name: ""
    return (
        case.title + (f"; datum told {share('datum_told')}" if case.datum else ""),
        share("found"),
        wrong("in_doubt"),
        wrong("named"),
        share("plain_found") if case.asks_plainly else "",
        value("inside_95", 2),
        value("before_m", 1),
        value("after_m", 1),
        value("nees", 2),
        value("protected", 3),
        value("detectable_m", 0),
        value("metres_per_metre", 2),
        value("survey_nees", 2),
    )
