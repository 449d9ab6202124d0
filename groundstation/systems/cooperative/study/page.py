"""Tables and page of the cooperative study."""

from collections.abc import Sequence

import numpy as np

from groundstation.chapters.parts import Section
from groundstation.methods.intervals import nees_limits
from groundstation.results.figures import FigureData
from groundstation.systems.cooperative.consistency import DIVERGED
from groundstation.systems.cooperative.study.published_case import FACTOR, PublishedCase
from groundstation.systems.cooperative.study.runs import CaseRun, diverges
from groundstation.systems.study import grid, section

HONEST_SHARE = 0.99  # of honest filters inside the limits: some twenty are judged at once


def measured(case: PublishedCase, outcomes: Sequence[CaseRun]) -> tuple[float, float]:
    """Return the figure by the filter's covariance, and by its errors over the runs."""
    error = np.array([one.error_m for one in outcomes])
    sigma = np.array([one.sigma_m for one in outcomes])
    other = np.array([one.other_error_m for one in outcomes])
    other_sigma = np.array([one.other_sigma_m for one in outcomes])
    claimed_r = float(np.sqrt((sigma**2).sum(axis=1).mean()))
    real_r = float(np.sqrt((error**2).sum(axis=1).mean()))
    if case.metric == "two_sigma_r_m":
        return 2.0 * claimed_r, 2.0 * real_r
    if case.metric == "gain_over_ins":
        before = float(np.sqrt((other_sigma**2).sum(axis=1).mean())), float(np.sqrt((other**2).sum(axis=1).mean()))
        return before[0] / claimed_r, before[1] / real_r
    if case.metric in ("sigma_x_m", "sigma_y_m"):  # x north, y east
        axis = 0 if case.metric == "sigma_x_m" else 1
        return float(np.sqrt((sigma[:, axis] ** 2).mean())), float(np.sqrt((error[:, axis] ** 2).mean()))
    if case.metric == "correlation":
        peer = np.array([one.peer_error_m for one in outcomes])
        both = np.corrcoef(error[:, 0], peer[:, 0])[0, 1] if len(outcomes) > 2 else float("nan")
        return float("nan"), float(both)
    return claimed_r, real_r


def is_near(case: PublishedCase, value: float) -> bool | None:
    """Tell whether a figure lies within a factor of two of the published one.

    None where none was published.
    """
    if np.isnan(case.low):
        return None
    return bool(case.low / FACTOR <= value <= case.high * FACTOR)


def study_table(cases: Sequence[PublishedCase], outcomes: dict[str, tuple[CaseRun, ...]]) -> FigureData:
    """Tabulate our figures beside the published ones, with both verdicts."""
    rows = []
    for case in cases:
        several = outcomes[case.name]
        computed, real = measured(case, several)
        nees = float(np.mean([one.nees for one in several]))
        low, high = nees_limits(2, len(several), HONEST_SHARE)
        near = is_near(case, real)
        late = float(np.sqrt(np.mean([one.late_ratio**2 for one in several])))
        middle = float(np.sqrt(np.mean([one.middle_ratio**2 for one in several])))
        rows.append(
            (
                case.name,
                case.algorithm,
                case.update if case.algorithm != "modified" else "simultaneous",
                case.metric,
                case.published,
                case.low,
                case.high,
                computed,
                real,
                "" if near is None else "yes" if near else "no",
                nees,
                low,
                high,
                "yes" if low <= nees <= high else "no",
                "yes" if diverges(several) else "no",
                middle,
                late,
                float(np.nanmedian([one.radius for one in several])) if not np.isnan(several[0].radius) else np.nan,
                float(np.mean([one.bytes_per_frame for one in several])),
                len(several),
                case.verdict,
            )
        )
    names = (
        *("case", "algorithm", "update", "metric", "published", "published_low", "published_high"),
        *("computed", "measured", "within_factor_two", "nees", "nees_low", "nees_high", "consistent", "diverges"),
        *("middle_error_over_sigma", "late_error_over_sigma", "spectral_radius", "bytes_per_frame", "runs", "verdict"),
    )
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    digits = {"spectral_radius": 4, "bytes_per_frame": 0, "published_low": 3, "published_high": 3, "computed": 3}
    return FigureData("cooperative_published", columns, digits | {"measured": 3})


def page(cases: Sequence[PublishedCase], table: FigureData, runs: int, seed: int) -> tuple[Section, ...]:
    """Return the study in sections."""
    head = (
        "case",
        "algorithm",
        "published",
        "computed",
        "measured",
        "factor 2",
        "NEES (2)",
        "consistent",
        "diverges",
        "verdict",
    )
    body = []
    for k, case in enumerate(cases):
        nees = f"{table['nees'][k]:.2f} [{table['nees_low'][k]:.2f}, {table['nees_high'][k]:.2f}]"
        body.append(
            (
                case.title,
                f"{case.algorithm}, {table['update'][k]}",
                case.published,
                f"{table['computed'][k]:.3g}",
                f"{table['measured'][k]:.3g}",
                str(table["within_factor_two"][k]),
                nees,
                str(table["consistent"][k]),
                _divergence(table, k),
                case.verdict,
            )
        )
    outside = [k for k in range(len(cases)) if table["within_factor_two"][k] == "no"]
    return (
        section(
            "Study: navigation between aircraft",
            f"{runs} simulated sessions a case, seed {seed}; sessions are the TOML files of simulation/sessions, "
            "the filter believes exactly what they draw from. Computed: what the filter says of itself; measured: "
            "errors against truth over the runs. 2 sigma_r unless the metric in tables/cooperative_published.csv says "
            "otherwise. NEES of the judged aircraft's position at the time of the figure, with the 99 % limits of that "
            f"many independent runs. Diverges: error over computed sigma_r above {DIVERGED:g} in the last tenth, root "
            "mean square over all aircraft and runs (in brackets: middle, end; median spectral radius of the joint "
            "error map over 10 s). Verdict: of the published figure, by hand; the reasons stand below.",
            grid(head, body),
        ),
        section(
            "Outside a factor of two",
            *([_outside(cases[k], float(table["measured"][k])) for k in outside] or ["None."]),
        ),
        section(
            "Notes", *(f"{case.title}: {case.why}" for k, case in enumerate(cases) if case.why and k not in outside)
        ),
    )


def _outside(case: PublishedCase, measured_: float) -> str:
    return f"{case.title}: published {case.published}, ours {measured_:.3g}. {case.why}"


def _divergence(table: FigureData, k: int) -> str:
    radius = float(table["spectral_radius"][k])
    shown = "" if np.isnan(radius) else f"; {radius:.4f}"
    middle, late = table["middle_error_over_sigma"][k], table["late_error_over_sigma"][k]
    return f"{table['diverges'][k]} ({middle:.1f}, {late:.1f}{shown})"
