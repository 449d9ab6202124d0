"""Heading by ground run: each on a time axis of its own, wherever in the flight it lies."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.results.arrays.heading import HeadingRunning, HeadingSamples
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.run_chart import Run, RunChart, runs_of

AFTER_TAXI = ("too fast", "take-off run", "landing roll", "airborne")
SPEED_LIMIT_MPS = 6.0  # the paper's; the result's own settings stand above it
LONGEST_GAP_S = 60.0  # between two rows of one run
MOST_RUNS = 4
WHOLE = 0.5  # a run that is this share of the flight needs no view of its own
MARGIN, SMALLEST_MARGIN_DEG = 0.15, 0.05
SAMPLES, MEAN, HONEST = (
    Line("samples", colours.SAMPLES, 1.2),
    Line("running mean", colours.ANSWER, 2.0),
    Line("honest 95 %", colours.HONEST, 1.0),
)


def heading_runs(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the ground runs with used samples, the longest few in order of time; None where one fills the flight."""
    samples = results.rows_of(HeadingSamples)
    if samples is None or range_of_used(samples) is None:
        return None
    time_s = samples.time_s
    ground = ~np.isin(samples.gate, AFTER_TAXI)
    runs = [run for run in runs_of(time_s[ground], LONGEST_GAP_S) if samples.is_used[run.rows(time_s)].any()]
    longest = sorted(runs, key=lambda run: run.start_s - run.end_s)[:MOST_RUNS]
    if not longest or longest[0].end_s - longest[0].start_s > WHOLE * results.duration_s:
        return None
    shown = sorted(longest, key=lambda run: run.start_s)
    panels = [
        rrb.Vertical(contents=_views(recorder, results, samples, run, f"heading/run/{number}"))
        for number, run in enumerate(shown, start=1)
    ]
    return rrb.Vertical(contents=panels, name="Each ground run")


def _views(recorder: Recorder, results: FlightResults, samples: HeadingSamples, run: Run, path: str) -> list[rrb.View]:
    rows = run.rows(samples.time_s)
    rows = rows[samples.is_used[rows]]
    time_s = samples.time_s
    ends = range_of_used(samples)
    difference = RunChart(recorder, f"{path}/difference", "INS heading − GNSS track, deg,", run, [], ends)
    difference.dots("samples", time_s[rows], samples.difference_deg[rows], SAMPLES)
    running = results.rows_of(HeadingRunning)
    if running is not None:
        mine = run.rows(running.time_s)
        at_s, mean, half = running.time_s[mine], running.mean_deg[mine], running.honest_half_width_deg[mine]
        difference.band("honest", at_s, mean - half, mean + half, HONEST)
        difference.line("mean", at_s, mean, MEAN)
    limit, every = speed_limit_mps(results), run.rows(time_s)
    lines = Line("GNSS ground speed", colours.GNSS), Line(f"threshold {limit:g} m/s", colours.LIMIT, 1.0)
    speed_mps = samples.ground_speed_mps[every]
    speed = RunChart(recorder, f"{path}/speed", "Ground speed, m/s,", run, [speed_mps, np.array([0.0, limit])])
    speed.line("speed", time_s[every], speed_mps, lines[0])
    speed.line("threshold", np.array([run.start_s, run.end_s]), np.full(2, limit), lines[1])
    return [difference.view((SAMPLES, MEAN, HONEST)), speed.view(lines)]


def range_of_used(samples: HeadingSamples) -> tuple[float, float] | None:
    """Axis on which all samples used are seen: the bands of the first few samples are far wider than anything else."""
    values = samples.difference_deg[samples.is_used]
    values = values[np.isfinite(values)]
    if not len(values):
        return None
    margin = max(MARGIN * float(np.ptp(values)), SMALLEST_MARGIN_DEG)
    return float(values.min()) - margin, float(values.max()) + margin


def speed_limit_mps(results: FlightResults) -> float:
    """Ground speed above which samples were used."""
    answer = results.answer(HeadingResult)
    value = {} if answer is None else answer.settings
    limit = value.get("taxi_speed_min_mps", SPEED_LIMIT_MPS)
    return float(limit) if isinstance(limit, int | float) else SPEED_LIMIT_MPS
