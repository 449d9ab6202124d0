"""Plots of the taxi stage.

Difference over time, density, convergence, heading and track, estimates by segment.
"""

from collections.abc import Mapping
from itertools import islice
from typing import Any

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.plots.common import label, lane_roles, positive
from groundstation.chapters.wording import clock, is_number, number
from groundstation.plots.axes import broken_time_axis
from groundstation.plots.marks import (
    AnyMark,
    Band,
    Curve,
    Dots,
    Floats,
    Histogram,
    Intervals,
    Lanes,
    Limit,
    Role,
    Spans,
)
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import around, broken_at_wrap, finite, padded, windows
from groundstation.results.arrays.typed import Flags
from groundstation.results.flight import FlightResults
from groundstation.systems.heading.answer import HeadingResult, TaxiSegment
from groundstation.systems.heading.arrays import (
    HeadingDistribution,
    HeadingLanes,
    HeadingNormal,
    HeadingRunning,
    HeadingSamples,
    HeadingSpectrum,
)

Windows = tuple[tuple[float, float], ...]

TAXI_SPEED_MARGIN = 1.6  # the take-off run leaves the plot, or the taxi would be a line at its foot
SLOWEST_TRACK_MPS = 1.0  # below it the direction of motion is noise and is not drawn
MOST_LANES, MOST_SEGMENTS, MOST_DIRECTIONS = 12, 24, 8
FARTHEST_SHOWN = 8  # of the segments shown, where there are more than fit: these, and the first others
LANE_MM, ROW_MM = 4.6, 5.2


def taxi_windows(samples: HeadingSamples) -> Windows:
    """Return the spans of flight time that the taxi plots show, one for each ground run used.

    Spans of all ground runs where none was used.
    """
    time, used = samples.time_s, samples.is_used
    return windows(time[used] if used.any() else time)


def difference(results: FlightResults) -> Plot | None:
    """Return the difference over time with the running mean, its honest interval and e."""
    samples, running = results.rows_of(HeadingSamples), results.rows_of(HeadingRunning)
    if samples is None:
        return None
    time, value, used = samples.time_s, samples.difference_deg, samples.is_used
    spans = taxi_windows(samples)
    marks: list[AnyMark] = [
        Dots(x=time[~used], y=value[~used], role="unused", name="not used"),
        Dots(x=time[used], y=value[used], role="answer", name="used"),
        *(() if running is None else _running(running)),
    ]
    low, high = _sample_range(value, used)
    panel = Panel(marks, broken_time_axis(spans), Axis("INS heading − GNSS track, °", low=low, high=high))
    count = int(np.count_nonzero(used & np.isfinite(value)))
    caption = f"A dot is one GNSS epoch, n = {number(count, 0)} used; running mean and e as in Markelov 2015."
    caption += " A panel for each ground run." if len(spans) > 1 else ""
    return Plot(
        "heading.difference",
        "Heading minus track over time",
        caption,
        "Scatter of heading minus track over flight time with the running mean settling.",
        one_panel(panel, 54.0),
        ("heading_samples",) if running is None else ("heading_samples", "heading_running"),
    )


def _running(running: HeadingRunning) -> list[AnyMark]:
    """Return the running mean with e and its honest interval."""
    time, mean, e = running.time_s, running.mean_deg, running.precision_deg
    honest = running.honest_half_width_deg
    marks: list[AnyMark] = []
    if np.isfinite(honest).any():
        marks.append(Band(x=time, low=mean - honest, high=mean + honest, role="ink", name="95 % interval"))
    marks.append(Curve(x=time, y=mean - e, role="ink", dash="dotted", emphasis="thin"))
    marks.append(Curve(x=time, y=mean + e, role="ink", dash="dotted", emphasis="thin", name="± e"))
    marks.append(Curve(x=time, y=mean, role="ink", name="running mean"))
    return marks


def _sample_range(value: Floats, used: Flags) -> tuple[float, float]:
    shown = finite(value[used]) if used.any() else finite(value)
    if not shown.size:
        return -1.0, 1.0
    low, high = (float(shown.min()), float(shown.max())) if used.any() else np.quantile(shown, [0.02, 0.98]).tolist()
    return padded(low, high, 0.12, 0.05)


def convergence(results: FlightResults) -> Plot | None:
    """Return precision e, quality and honest half width as samples come in, with limits."""
    running = results.rows_of(HeadingRunning)
    if running is None:
        return None
    answer = results.answer(HeadingResult)
    limits = {} if answer is None else {gate.name: gate.limit for gate in answer.gates}
    curves: tuple[tuple[Floats, str, Role, str], ...] = (
        (running.precision_deg, "precision e", "ins", "precision"),
        (running.quality_deg, "quality", "gnss", "quality"),
        (running.honest_half_width_deg, "honest 95 % half width", "ink", ""),
    )
    cycles = running.cycles.astype(np.float64)
    marks: list[AnyMark] = []
    for values, name, role, gate in curves:
        marks.append(Curve(x=cycles, y=positive(values), role=role, name=name))
        limit = limits.get(gate)
        if is_number(limit):
            marks.append(Limit(value=limit, role=role, name=f"limit {limit:g}°"))
    last = max(float(cycles.max()), 2.0) if cycles.size else 1.0
    x = Axis("cycles (distinct GNSS epochs used)", low=0.0, high=last)
    return Plot(
        "heading.convergence",
        "Convergence",
        "How the figures of merit settle; dashed: limits of the gates.",
        "Precision, quality and honest half width against the number of cycles on a logarithmic axis.",
        one_panel(Panel(marks, x, Axis("angle, °", "log")), 40.0),
        ("heading_running",),
    )


def density(results: FlightResults) -> Plot | None:
    """Return the density of the heading error with the fitted normal (figure 3 of the paper)."""
    bars, normal = results.rows_of(HeadingDistribution), results.rows_of(HeadingNormal)
    if bars is None:
        return None
    answer = results.answer(HeadingResult)
    low, high, height = bars.bin_low_deg, bars.bin_high_deg, bars.density_per_deg
    marks: list[AnyMark] = []
    known = np.isfinite(low) & np.isfinite(high) & np.isfinite(height)
    if known.any():
        edges = np.append(low[known], high[known][-1])
        marks.append(Histogram(edges=edges, heights=height[known], role="answer", name="measured"))
    if normal is not None:
        marks.append(Curve(x=normal.difference_deg, y=normal.density_per_deg, role="ink", name="fitted normal"))
    error = None if answer is None else answer.error_deg
    if is_number(error):
        estimate = f"estimate {number(error, 3, '°', signed=True)}"
        marks.append(Limit(value=error, is_upright=True, role="answer", dash="", name=estimate))
    count = number(None if answer is None else answer.samples, 0)
    deviation = number(None if answer is None else answer.estimate_sd_deg, 3, "°")
    x, y = Axis("INS heading − GNSS track, °"), Axis("probability density, 1/°", low=0.0)
    return Plot(
        "heading.density",
        "Density of the heading error",
        f"n = {count} used differences, standard deviation {deviation}.",
        "Histogram of the heading error with a fitted normal curve.",
        one_panel(Panel(marks, x, y), 50.0),
        ("heading_distribution",) if normal is None else ("heading_distribution", "heading_normal"),
    )


def taxi(results: FlightResults) -> Plot | None:
    """Return heading, track and speed during the taxi, and lanes of the gates.

    The lanes show which gate each epoch met.
    """
    samples = results.rows_of(HeadingSamples)
    if samples is None:
        return None
    lanes, answer = results.rows_of(HeadingLanes), results.answer(HeadingResult)
    speed_limit_mps = None if answer is None else answer.settings.get("taxi_speed_min_mps")
    spans = taxi_windows(samples)
    time = broken_time_axis(spans)
    states = _lane_states(lanes, spans)
    rows = [
        Row((_angles(samples, spans, time),), 42.0, shares_x=True),
        Row((_speed(samples, time, speed_limit_mps),), 26.0, shares_x=bool(states)),
    ]
    if states and lanes is not None:
        drawn = Lanes(
            start=lanes.start_s,
            end=lanes.end_s,
            state=lanes.state,
            order=states,
            role="faint",
            roles=lane_roles(states, {"used": "answer"}),
        )
        rows.append(Row((Panel((drawn,), time, legend=""),), LANE_MM * len(states)))
    return Plot(
        "heading.taxi",
        "Taxi: heading, track, speed and gates",
        "The lanes show which epochs are used, and why the others are not.",
        "INS heading, GNSS track and ground speed during the taxi with lanes for each gate.",
        tuple(rows),
        ("heading_samples",) if lanes is None else ("heading_samples", "heading_lanes"),
    )


def _angles(samples: HeadingSamples, spans: Windows, time: Axis) -> Panel:
    nose, speed = samples.heading_deg, samples.ground_speed_mps
    track = np.where(speed > SLOWEST_TRACK_MPS, samples.track_deg, np.nan)
    (track_s, track_line), (nose_s, nose_line) = (broken_at_wrap(samples.time_s, angle) for angle in (track, nose))
    marks = (
        Curve(x=track_s, y=track_line, role="gnss", name="GNSS track", emphasis="thin"),
        Curve(x=nose_s, y=nose_line, role="ins", name="INS heading"),
    )
    ranges = []
    for low, high in spans:
        mine = (samples.time_s >= low) & (samples.time_s <= high)
        ranges.append(around(nose[mine], track[mine], share=0.06, least=1.0))
    return Panel(marks, time, Axis("angle from true north, °", ranges=tuple(ranges)))


def _speed(samples: HeadingSamples, time: Axis, limit_mps: Any) -> Panel:
    driven = finite(samples.ground_speed_mps[samples.is_used])
    marks: list[AnyMark] = [Curve(x=samples.time_s, y=samples.ground_speed_mps, role="gnss", emphasis="thin")]
    if is_number(limit_mps):
        marks.append(Limit(value=limit_mps, name=f"used above {limit_mps:g} m/s"))
    high = TAXI_SPEED_MARGIN * float(driven.max()) if driven.size else None
    return Panel(marks, time, Axis("ground speed, m/s", low=0.0, high=high))


def _lane_states(lanes: HeadingLanes | None, spans: Windows) -> tuple[str, ...]:
    if lanes is None:
        return ()
    start, end, state = lanes.start_s, lanes.end_s, lanes.state
    shown = np.any([(end >= low) & (start <= high) for low, high in spans], axis=0)
    return tuple(sorted(set(state[shown].tolist()), key=lambda name: (name != "used", name))[:MOST_LANES])


def forest(results: FlightResults) -> Plot | None:
    """Return estimates by segment and by direction with intervals, and that of the whole run."""
    answer = results.answer(HeadingResult)
    if answer is None or not answer.segments:
        return None
    segments, by_distance = answer.segments, _farthest_first(answer)
    farthest = by_distance[:FARTHEST_SHOWN]
    others = (place for place in range(len(segments)) if place not in farthest)
    shown = sorted((*farthest, *islice(others, max(MOST_SEGMENTS - len(farthest), 0))))
    listed: list[tuple[str, TaxiSegment, Role]] = [
        (_segment_name(place + 1, segments[place]), segments[place], "answer") for place in shown
    ]
    listed += [(_direction_name(item), item, "ins") for item in answer.directions[:MOST_DIRECTIONS]]
    marks: list[AnyMark] = [*_whole_run(answer, len(listed))]
    for row, (_, item, role) in enumerate(listed):
        if is_number(item.error_deg):
            half = NORMAL_95 * item.sigma_deg if is_number(item.sigma_deg) else 0.0
            ends = item.error_deg - half, item.error_deg + half
            marks.append(Intervals(row=row, value=item.error_deg, thin=ends, role=role))
    titles = [*(label(name, 60) for name, _, _ in listed), "whole run"]
    names = tuple((float(row), title) for row, title in enumerate(titles))
    y = Axis(low=len(listed) + 0.6, high=-0.6, names=names)
    more = f" {len(shown)} of {len(segments)} segments." if len(shown) < len(segments) else ""
    if len(segments) > 1 and by_distance:
        worst = segments[by_distance[0]]
        off = number(wrap_180(worst.error_deg - answer.error_deg), 2, "°", signed=True)
        span = f"{clock(worst.start_s)} – {clock(worst.end_s)}"
        more += f" Farthest off by its σ: {by_distance[0] + 1}, {span}, by {off}."
    blue = "; blue: directions of travel" if answer.directions else ""
    return Plot(
        "heading.forest",
        "Estimates by segment and direction",
        f"Bars: ± 1.96 σ. Green: straight segments{blue}; black: the whole run, thick: from this taxi alone. Opposite "
        f"directions that disagree point to side-slip or mounting.{more}",
        "Forest plot of the heading error by segment and by direction.",
        one_panel(Panel(marks, Axis("heading error, °"), y, legend=""), 2.0 + ROW_MM * (len(listed) + 1)),
    )


def _farthest_first(answer: HeadingResult) -> list[int]:
    """Return the places of the segments, that farthest from the whole run by its sigma first."""
    known = [
        place
        for place, item in enumerate(answer.segments)
        if is_number(item.error_deg) and is_number(item.sigma_deg) and item.sigma_deg > 0.0
    ]
    if not is_number(answer.error_deg):
        return []

    def distance(place: int) -> float:
        item = answer.segments[place]
        return abs(float(wrap_180(item.error_deg - answer.error_deg))) / item.sigma_deg

    return sorted(known, key=distance, reverse=True)


def _whole_run(answer: HeadingResult, row: int) -> list[AnyMark]:
    """Return the estimate of the whole run through all rows, and its own row."""
    error, bounds = answer.error_deg, answer.confidence95_deg
    if not is_number(error):
        return []
    marks: list[AnyMark] = [Limit(value=error, is_upright=True, role="ink", dash="", emphasis="faint")]
    thin = (bounds[0], bounds[1]) if all(map(is_number, bounds)) else None
    if thin is not None:
        start, end = (np.array([value]) for value in thin)
        marks.append(Spans(start=start, end=end, kind=np.array([""]), role="ink", emphasis="faint"))
    measured = answer.confidence95_measured_deg or bounds
    thick = (measured[0], measured[1]) if all(map(is_number, measured)) else None
    marks.append(Intervals(row=row, value=error, thin=thin, thick=thick, symbol="diamond", role="ink"))
    return marks


def spectrum(results: FlightResults) -> Plot | None:
    """Return the spectral density of the residuals and the noise model of the interval.

    The honest interval rests on that model.
    """
    data = results.rows_of(HeadingSpectrum)
    if data is None:
        return None
    curves: tuple[tuple[Floats, str, Role], ...] = (
        (data.density_deg2_per_hz, "measured", "answer"),
        (data.model_deg2_per_hz, "fitted model", "ink"),
    )
    marks = [Curve(x=data.frequency_hz, y=positive(values), role=role, name=name) for values, name, role in curves]
    x, y = Axis("frequency, Hz", "log"), Axis("spectral density, °²/Hz", "log")
    return Plot(
        "heading.spectrum",
        "Spectrum of the residuals",
        "The low end sets the error of the mean: slow GNSS errors are there; sway averages out.",
        "Spectral density of the heading residuals with the fitted noise model, logarithmic axes.",
        one_panel(Panel(marks, x, y), 40.0),
        ("heading_spectrum",),
    )


def _segment_name(index: int, item: TaxiSegment) -> str:
    times = f"{clock(item.start_s)}–{clock(item.end_s)}"
    track, count = number(item.mean_track_deg, 0, "°"), number(item.samples, 0)
    return f"{index}  ·  {times}  ·  track {track}  ·  n {count}"


def _direction_name(item: TaxiSegment) -> str:
    return f"direction {number(item.mean_track_deg, 0, '°')}  ·  n {number(item.samples, 0)}"


PLOTS: Mapping[str, Describe] = {
    "heading.difference": difference,
    "heading.density": density,
    "heading.convergence": convergence,
    "heading.taxi": taxi,
    "heading.forest": forest,
    "heading.spectrum": spectrum,
}
