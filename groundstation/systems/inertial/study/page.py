"""Page of the forecast study: questions and results, in sentences from the tables."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.parts import Grid, Section
from groundstation.results.figures import FigureData
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.systems.inertial.study.cases import FilterCase
from groundstation.systems.inertial.study.runs import COUPLED, METHOD_NAMES, SETS_OF_STARTS, STUDY_HORIZONS_MIN
from groundstation.systems.inertial.study.tables import BETTER, COMPARED, REFERENCE, UNDECIDED, WORSE
from groundstation.systems.study import grid, section, table

HORIZON_HEAD = [f"{horizon:g} min" for horizon in STUDY_HORIZONS_MIN]
FREEDOM_A_RUN = 12  # six states, two channels
HONESTY_LEFT_OUT = ("flights", "first")
CONFIRMED = {BETTER: "confirmed", WORSE: "refuted", UNDECIDED: "neither shown"}


def page(
    cases: Sequence[FilterCase], tables: dict[str, FigureData], runs: int, calibrated_runs: int, default_method: str
) -> tuple[Section, ...]:
    """Return the study in sections."""
    return (
        section(
            "Study: forecast of INS errors",
            f"{runs} simulated flights of 16 000 s a case ({calibrated_runs} of routes nothing was tuned on); "
            "radial position error built up since the start of the forecast, "
            "against the truth, in metres; RMS over flights and starts, 95 % limits from a bootstrap over flights. "
            "All starts: every 300 s from 5400 s on; the paper's four: 1.5, 2, 2.5 and 3 h.",
            grid(("case", "what it is", "seed"), [(case.name, case.title, str(case.seed)) for case in cases]),
        ),
        _windows(cases, tables["forecast_ratios"]),
        _later(cases, tables["forecast_later_starts"]),
        _held_out(cases, tables, default_method),
        _honesty(tables, calibrated_runs),
        _bank(tables["forecast_coupled_bank"]),
        _outages(tables["forecast_outages"]),
        section(
            "RMS of every method, all starts",
            *(part for case in cases for part in _rms_of(case, tables["forecast_rms"])),
        ),
        section("RMS at the paper's four starts", _classic(cases, tables["forecast_rms"])),
    )


def _windows(cases: Sequence[FilterCase], ratios: FigureData) -> Section:
    """Return the section that compares windows: sentences, then ratios."""
    said = []
    for title, group in (
        ("the filter is told something false", [case.name for case in cases if case.is_misled]),
        ("the filter's noise is honest", [case.name for case in cases if not case.is_misled]),
    ):
        chosen = _rows(ratios, starts="all", method="windows") & np.isin(ratios["case"], group)
        said.append(f"Where {title} ({', '.join(group)}): {_tally(ratios['finding'][chosen])}.")
    for method in COMPARED[:2]:
        said.append(f"{FORECAST_METHODS[method].capitalize()} against the last estimate, all starts:")
        said += [f"{case.name}: {_in_words(ratios, case.name, method)}" for case in cases]
    cells = [
        [case.name, method, *(_cell(ratios, "ratio", 2, case=case.name, method=method, starts="all"))]
        for case in cases
        for method in COMPARED
    ]
    head = ["case", "RMS over that of the last estimate", *HORIZON_HEAD]
    return section("Are windows better than the last estimate?", *said, grid(head, cells))


def _tally(says: NDArray[Any]) -> str:
    """Return how often a claim of the paper was confirmed and refuted."""
    counts = (int((says == verdict).sum()) for verdict in (BETTER, WORSE))
    return "the paper's claim is confirmed at {} and refuted at {} of {} horizons".format(*counts, len(says))


def _in_words(ratios: FigureData, case: str, method: str) -> str:
    parts = []
    for verdict in (BETTER, WORSE, UNDECIDED):
        chosen = _rows(ratios, case=case, method=method, starts="all") & (ratios["finding"] == verdict)
        if chosen.any():
            horizons = ", ".join(f"{horizon:g}" for horizon in ratios["horizon_min"][chosen])
            parts.append(f"{verdict} at {horizons} min")
    return "; ".join(parts)


def _later(cases: Sequence[FilterCase], later: FigureData) -> Section:
    cells = [
        [case.name, method, *_cell(later, "ratio", 2, case=case.name, method=method), _claim(later, case.name, method)]
        for case in cases
        for method in (REFERENCE, "windows")
    ]
    return section(
        "Is a later start better at equal horizon?",
        "RMS from the latest of the four starts whose horizon still fits over RMS from 1.5 h: "
        f"{_tally(later['finding'])} and methods.",
        grid(["case", "method", *HORIZON_HEAD, "the claim"], cells),
    )


def _claim(later: FigureData, case: str, method: str) -> str:
    says = later["finding"][_rows(later, case=case, method=method)].tolist()
    return ", ".join(f"{word} {says.count(verdict)}" for verdict, word in CONFIRMED.items() if verdict in says)


def _held_out(cases: Sequence[FilterCase], tables: dict[str, FigureData], default_method: str) -> Section:
    """Return the section on the best method on flights that stand for real ones."""
    held_out, rms = tables["forecast_held_out"], tables["forecast_rms"]
    order = [str(name) for name in held_out["method"]]
    equal = [name for name, low in zip(order[1:], held_out["against_best_low"][1:], strict=True) if low <= 1.0]
    names = [case.name for case in cases if case.is_held_out]
    text = f"Best by score: {order[0]}."
    text += f" Not shown to be worse: {', '.join(equal)}." if equal else " Every other method is shown to be worse."
    place = order.index(default_method)
    if place:
        behind, low, high = (held_out[f"against_best{end}"][place] for end in ("", "_low", "_high"))
        text += (
            f" The default, {default_method}, has {behind:.3f} ({low:.3f} to {high:.3f}) times the error of the best."
        )
    else:
        text += " It is the default."
    cells = []
    for name in names:
        best = []
        for horizon in STUDY_HORIZONS_MIN:
            rows = np.flatnonzero(_rows(rms, case=name, starts="all") & (rms["horizon_min"] == horizon))
            best.append(str(rms["method"][rows[np.argmin(rms["rms_m"][rows])]]))
        cells.append([name, *best])
    return section(
        "Which method wins on held-out flights",
        f"Cases {', '.join(names)}; no seed of theirs was used for tuning. Score: geometric mean over cases and "
        "horizons of RMS over that of the last estimate.",
        text,
        table(held_out),
        grid(["least RMS", *HORIZON_HEAD], cells),
        "Where GNSS errors are correlated, R inflated honestly is set against the paper's windows (same flights):",
        table(tables["forecast_cure"]),
    )


def _honesty(tables: dict[str, FigureData], calibrated_runs: int) -> Section:
    honesty = tables["forecast_honesty"]
    consistent_runs = int(tables["forecast_consistency"]["freedom"][0]) // FREEDOM_A_RUN
    chosen = np.isin(honesty["method"], [REFERENCE, *COMPARED[:2], "noise_bank", COUPLED])
    columns = {name: values[chosen] for name, values in honesty.columns.items() if name not in HONESTY_LEFT_OUT}
    shown = FigureData(honesty.name, columns, honesty.digits)
    return section(
        "Are the sigmas honest?",
        f"The filter on {consistent_runs} flights of which its model is exactly true, 99 % limits of chi-square:",
        table(tables["forecast_consistency"]),
        f"Forecasts of {calibrated_runs} flights a case: coverage of the bands and NEES over all starts (1 is honest); "
        "first model: NEES of the first start alone, with its 99 % limits. Columns with model: before the sigma is "
        "scaled by the class and the flight's own past. All methods stand in tables/forecast_honesty.csv.",
        "Coverage is a mean over flights: outages of one flight overlap, so that with an honest sigma one flight may "
        "have 0.8 and another 1. coverage95_worst is what the tenth of the flights with the least has at most, "
        "flights_within the share of the flights whose own NEES lies within its 95 % limits.",
        table(shown),
        "Position measurements that the gate rejected:",
        table(tables["forecast_gate"]),
    )


def _bank(bank: FigureData) -> Section:
    methods = list(dict.fromkeys(bank["method"].tolist()))
    cells = []
    for case in dict.fromkeys(bank["case"].tolist()):
        for method in methods:
            rows = _rows(bank, case=case, method=method)
            pairs = zip(bank["over_coupled"][rows], bank["coverage95"][rows], strict=True)
            cells.append([case, method, *(f"{ratio:.3f}, {inside:.3f}" for ratio, inside in pairs)])
    head = [f"{horizon:g} min" for horizon in dict.fromkeys(bank["horizon_min"].tolist())]
    return section(
        "A bank of noise sets on the coupled model",
        f"{int(bank['flights'][0])} flights a case: RMS over that of the coupled model with the noise of the class, "
        "all starts, against the truth; coverage of the 95 % band, against GNSS. The second bank has the class's own "
        "filter among its sets, with half of the weight before any outage was over.",
        grid(["case", "method", *head], cells),
    )


def _outages(outages: FigureData) -> Section:
    return section(
        "Outages in the log",
        f"{int(outages['flights'][0])} flights a case, GNSS taken away for 1 to 60 min again and again. smoothed: RMS "
        "of the smoother's radial error inside the outages, against the truth; over free: the same over that without a "
        "gate; inside95: share of its errors in its band, scaled by the class; free95: without a gate. through95: the "
        "band of the default's forecast at the end of an outage, against GNSS; after: forecasts that start after an "
        "outage, to 10, 30 and 60 min; without: the same starts of the same flights without outages.",
        table(outages),
    )


def _rms_of(case: FilterCase, rms: FigureData) -> tuple[str, Grid]:
    cells = [[method, *_cell(rms, "rms_m", 0, case=case.name, method=method, starts="all")] for method in METHOD_NAMES]
    return f"{case.name}: {case.title}", grid(["method", *HORIZON_HEAD], cells)


def _classic(cases: Sequence[FilterCase], rms: FigureData) -> Grid:
    cells = [
        [case.name, starts, method, *_cell(rms, "rms_m", 0, case=case.name, method=method, starts=starts)]
        for case in cases
        for starts in SETS_OF_STARTS[1:]
        for method in ("raw_ins", REFERENCE, "windows", "drift_windows")
    ]
    return grid(["case", "start", "method", *HORIZON_HEAD], cells)


def _cell(table: FigureData, value: str, digits: int, **chosen: str) -> list[str]:
    """Return the value and limits at each horizon, empty where there is none."""
    rows, cells = _rows(table, **chosen), []
    for horizon in STUDY_HORIZONS_MIN:
        at = np.flatnonzero(rows & (table["horizon_min"] == horizon))
        if at.size:
            middle, low, high = (f"{table[name][at[0]]:.{digits}f}" for name in (value, *_limits(table)))
            cells.append(f"{middle} ({low} to {high})")
        else:
            cells.append("")
    return cells


def _limits(table: FigureData) -> tuple[str, str]:
    return ("low_m", "high_m") if "low_m" in table.columns else ("low", "high")


def _rows(table: FigureData, **chosen: str) -> NDArray[np.bool_]:
    rows: NDArray[np.bool_] = np.logical_and.reduce([table[name] == value for name, value in chosen.items()])
    return rows
