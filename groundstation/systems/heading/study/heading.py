"""Monte Carlo study of the heading correction.

Accuracy, coverage, gates, and the figures of the paper again.
"""

import time

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.parts import Section
from groundstation.results.figures import FigureData
from groundstation.simulation.taxi import Family
from groundstation.systems.heading.study.family import (
    Progress,
    RunOutcome,
    coverage_table,
    gates_table,
    run_families,
    runs_table,
    segments_table,
    time_to_precision_table,
)
from groundstation.systems.heading.study.paper import arm_table, precision_table, quality_table, standstill_tables
from groundstation.systems.study import RunStore, StudyResult, section, table

PUBLISHED: tuple[Family, ...] = ("grid", "continuous")  # families that the published figures are compared with
PAPER_RUNS = 2000  # realisations of the plain processes: the paper had more than 500 at standstill


def study_heading(
    runs: int = 200,
    seed: int = 71,
    progress: Progress | None = None,
    *,
    kept: RunStore[RunOutcome] | None = None,
    minutes: float | None = None,
) -> StudyResult:
    """Run the estimator over the families of docs/evidence/heading.md and measure it.

    Parameters
    ----------
    runs : int
        Runs of each family; 1000 give the coverage to 0.7 %.
    seed : int
        Seed of family grid; families continuous and wide take the next two.
    progress : callable, optional
        Called with one line for each run.
    kept : RunStore, optional
        Runs of an earlier call: these are not made again.
    minutes : float, optional
        Time after which no further run is begun; the page is then that of the runs made so far.
    """
    families: tuple[tuple[Family, int], ...] = (("grid", seed), ("continuous", seed + 1), ("wide", seed + 2))
    end_s = np.inf if minutes is None else time.monotonic() + 60.0 * minutes
    outcomes = run_families(families, runs, progress, kept=kept, is_over=lambda: time.monotonic() > end_s)
    rng = np.random.default_rng(seed)
    plain = (
        precision_table(rng, PAPER_RUNS),
        quality_table(rng, PAPER_RUNS // 10),
        *standstill_tables(rng, PAPER_RUNS),
    )
    tables: list[FigureData] = []
    for family, found in outcomes.items():
        tables += [
            coverage_table(f"heading_coverage_{family}", found),
            gates_table(f"heading_gates_{family}", found),
            time_to_precision_table(f"heading_time_{family}", found),
            runs_table(f"heading_runs_{family}", found),
        ]
    tables.append(segments_table("heading_segments_wide", outcomes["wide"]))
    tables += [*plain, arm_table(), published_table([run for family in PUBLISHED for run in outcomes[family]])]
    return StudyResult("heading", tuple(tables), _page(tables, families, len(outcomes["wide"])))


def published_table(outcomes: list[RunOutcome]) -> FigureData:
    """Tabulate published figures beside those of all simulated runs together."""
    accepted = np.array([run.verdict == "accept" for run in outcomes])
    error = np.abs([run.error_deg for run in outcomes]) * 60.0
    precise = np.array([run.precision_deg <= 0.05 for run in outcomes])
    spread = np.array([run.precision_deg * np.sqrt(run.taxi_seconds * 10.0) / NORMAL_95 for run in outcomes])
    reached = [run.seconds_to_precision for run in outcomes if run.seconds_to_precision is not None]
    rows = [
        ("largest error of an accepted run, arcmin", 20.0, float(error[accepted].max()) if accepted.any() else np.nan),
        ("largest error of any run, arcmin", np.nan, float(error.max())),
        (
            "largest error with e within 0.05 deg, arcmin",
            20.0,
            float(error[precise].max()) if precise.any() else np.nan,
        ),
        (
            "samples until e stays within 0.05 deg, median",
            400.0,
            float(np.median(reached)) * 10.0 if reached else np.nan,
        ),
        ("standard deviation of the differences, deg", 0.51, float(np.median(spread))),
    ]
    columns = {
        "figure": np.array([row[0] for row in rows]),
        "published": np.array([row[1] for row in rows]),
        "simulated": np.array([row[2] for row in rows]),
    }
    return FigureData("heading_published", columns, {"published": 2, "simulated": 2})


TITLES = {
    "heading_coverage": "Errors and coverage of the 95 % interval",
    "heading_segments": "Coverage by number of segments (3: and more)",
    "heading_gates": "Share of runs that pass each gate",
    "heading_time": "Taxi time until e stays within 0.05 deg",
    "heading_paper_e": "Coverage of the paper's e on 60-s runs",
    "heading_quality": "Quality gate on 120-s runs (limit 0.3 deg)",
    "standstill_pass": "Mean velocity at standstill against 0.01 m/s",
    "heading_arm": "Uncorrected antenna arm inside the gates",
    "heading_published": "Published figures beside the simulated ones",
}


def _page(tables: list[FigureData], families: tuple[tuple[Family, int], ...], runs: int) -> tuple[Section, ...]:
    seeds = ", ".join(f"{family} seed {seed}" for family, seed in families)
    sections = [
        section(
            "Study: heading correction before take-off",
            f"{runs} runs of each family of docs/evidence/heading.md ({seeds}), each through tables and estimator. "
            "Coverage is the share of runs whose 95 % interval holds the truth; its sampling error stands beside it. "
            "Measured are coverage and half width without steady sideslip, which only family wide has. "
            "It has cells for what one flight cannot show: there only the whole interval can hold the truth.",
        )
    ]
    for one in tables:
        title = next((text for key, text in TITLES.items() if one.name.startswith(key)), "")
        if title:
            family = next((f" (family {family})" for family, _seed in families if one.name.endswith(family)), "")
            sections.append(section(f"{title}{family}", table(one)))
    return tuple(sections)
