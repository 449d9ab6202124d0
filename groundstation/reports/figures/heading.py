"""Figures of the taxi stage: difference over time, density, convergence, heading and track, estimates by segment."""

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.wording import clock, is_number, number
from groundstation.plots.ranges import broken_at_wrap, finite, padded, thin, windows
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.arrays.heading import (
    HeadingDistribution,
    HeadingLanes,
    HeadingNormal,
    HeadingRunning,
    HeadingSamples,
    HeadingSpectrum,
)
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult, TaxiSegment

S = TypeVar("S", HeadingSamples, HeadingRunning)

TAXI_SPEED_MARGIN = 1.6  # the take-off run leaves the figure, or the taxi would be a line at its foot
SLOWEST_TRACK_MPS = 1.0  # below it the direction of motion is noise and is not drawn


def taxi_windows(samples: HeadingSamples) -> tuple[tuple[float, float], ...]:
    """Spans of flight time that the taxi figures show, one for each ground run that was used; of all where none was."""
    time, used = samples.time_s, samples.is_used
    return windows(time[used] if used.any() else time)


def _within(samples: S, span: tuple[float, float]) -> S:
    """The samples of a span of flight time."""
    return samples.where((samples.time_s >= span[0]) & (samples.time_s <= span[1]))


def difference(results: FlightResults) -> Drawing | None:
    """Difference over time with the running mean, its honest interval and e."""
    samples, running = results.rows_of(HeadingSamples), results.rows_of(HeadingRunning)
    if samples is None:
        return None
    time, value, used = samples.time_s, samples.difference_deg, samples.is_used
    spans = taxi_windows(samples)
    count = int(np.count_nonzero(used & np.isfinite(value)))

    def paint(figure: Any) -> None:
        panels = layout.time_panels(figure, (16, 12, 174, 66), spans)
        for axes, (low, high) in zip(panels, spans, strict=True):
            left, kept = ((time >= low) & (time <= high) & rows for rows in (~used, used))
            d.dots(axes, time[left], value[left], d.UNUSED, 1.5, 2500, zorder=1.5, label="not used")
            d.dots(axes, time[kept], value[kept], d.USED, 1.7, 3500, zorder=2, alpha=0.7, label="used")
            if running is not None:
                _running_band(axes, _within(running, (low, high)))
        panels[0].set_ylabel("INS heading − GNSS track, °")
        panels[0].set_ylim(*_sample_range(value, used))
        layout.legend_above(panels[-1])

    caption = f"A dot is one GNSS epoch, n = {number(count, 0)} used; running mean and e as in Markelov 2015."
    caption += " A panel for each ground run." if len(spans) > 1 else ""
    names = ("heading_samples",) if running is None else ("heading_samples", "heading_running")
    alt = "Scatter of heading minus track over flight time with the running mean settling."
    return Drawing("Heading minus track over time", caption, alt, d.draw("difference", 74, paint), names)


def _running_band(axes: Any, running: HeadingRunning) -> None:
    time, mean = running.time_s, running.mean_deg
    keep = thin(len(running), 2000)
    time, mean = time[keep], mean[keep]
    honest, e = running.honest_half_width_deg[keep], running.precision_deg[keep]
    if np.isfinite(honest).any():
        axes.fill_between(
            time,
            mean - honest,
            mean + honest,
            color="#1c2530",
            alpha=0.16,
            linewidth=0,
            zorder=3,
            label="95 % interval",
        )
    for sign in (-1.0, 1.0):
        axes.plot(
            time,
            mean + sign * e,
            color=d.INK,
            linewidth=0.7,
            linestyle=":",
            zorder=4,
            label="± e" if sign > 0 else None,
        )
    axes.plot(time, mean, color=d.INK, linewidth=1.2, zorder=5, label="running mean")


def _sample_range(value: Any, used: Any) -> tuple[float, float]:
    shown = finite(value[used]) if used.any() else finite(value)
    if not shown.size:
        return -1.0, 1.0
    low, high = (float(shown.min()), float(shown.max())) if used.any() else np.quantile(shown, [0.02, 0.98]).tolist()
    return padded(low, high, 0.12, 0.05)


def convergence(results: FlightResults) -> Drawing | None:
    """Precision e, quality and honest half width as the samples come in, with their limits."""
    running = results.rows_of(HeadingRunning)
    if running is None:
        return None
    cycles = running.cycles
    curves = (
        (running.precision_deg, "precision e", d.INS, "precision"),
        (running.quality_deg, "quality", d.GNSS, "quality"),
        (running.honest_half_width_deg, "honest 95 % half width", d.INK, ""),
    )
    answer = results.answer(HeadingResult)
    limits = {} if answer is None else {gate.name: gate.limit for gate in answer.gates}
    keep = thin(len(running), 2000)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 52)
        axes.set_yscale("log")
        for shown, text, colour, gate in curves:
            values = np.where(shown[keep] > 0.0, shown[keep], np.nan)
            axes.plot(cycles[keep], values, color=colour, linewidth=1.0, label=text)
            limit = next((value for name, value in limits.items() if gate and name.startswith(gate)), None)
            if is_number(limit):
                layout.limit_line(axes, limit, f"limit {limit:g}°", colour=colour)
        _plain_log_labels(axes.yaxis)
        axes.set_xlabel("cycles (distinct GNSS epochs used)")
        axes.set_ylabel("angle, °")
        known = finite(cycles)
        axes.set_xlim(0, max(float(known.max()), 2.0) if known.size else 1.0)
        layout.legend_above(axes)

    caption = "How the figures of merit settle; dashed: limits of the gates."
    alt = "Precision, quality and honest half width against the number of cycles on a logarithmic axis."
    return Drawing("Convergence", caption, alt, d.draw("convergence", 60, paint), ("heading_running",))


def _plain_log_labels(axis: Any, marks: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(10.0, subs=marks, numticks=20))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def density(results: FlightResults) -> Drawing | None:
    """Density of the heading error with the fitted normal (figure 3 of the paper)."""
    bars, normal = results.rows_of(HeadingDistribution), results.rows_of(HeadingNormal)
    if bars is None:
        return None
    answer = results.answer(HeadingResult)
    low, high, height = bars.bin_low_deg, bars.bin_high_deg, bars.density_per_deg

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 62)
        known = np.isfinite(low) & np.isfinite(high) & np.isfinite(height)
        if known.any():
            edges = np.append(low[known], high[known][-1])
            axes.stairs(
                height[known], edges, fill=True, facecolor=d.FILL, edgecolor=d.USED, linewidth=0.6, label="measured"
            )
        if normal is not None:
            d.line(
                axes,
                normal.difference_deg,
                normal.density_per_deg,
                d.INK,
                1.2,
                label="fitted normal",
            )
        error = None if answer is None else answer.error_deg
        if is_number(error):
            estimate = f"estimate {number(error, 3, '°', signed=True)}"
            axes.axvline(error, color=d.USED, linewidth=1.0, label=estimate)
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("INS heading − GNSS track, °")
        axes.set_ylabel("probability density, 1/°")
        layout.legend_above(axes)

    count = number(None if answer is None else answer.samples, 0)
    deviation = number(None if answer is None else answer.estimate_sd_deg, 3, "°")
    caption = f"n = {count} used differences, standard deviation {deviation}."
    alt = "Histogram of the heading error with a fitted normal curve."
    names = ("heading_distribution",) if normal is None else ("heading_distribution", "heading_normal")
    return Drawing("Density of the heading error", caption, alt, d.draw("density", 70, paint), names)


def taxi(results: FlightResults) -> Drawing | None:
    """Heading, track and speed during the taxi above the lanes that say which gate each epoch met."""
    samples = results.rows_of(HeadingSamples)
    if samples is None:
        return None
    lanes, answer = results.rows_of(HeadingLanes), results.answer(HeadingResult)
    speed_limit_mps = None if answer is None else answer.settings.get("taxi_speed_min_mps")
    spans = taxi_windows(samples)
    states = _lane_states(lanes, spans)
    lane_mm = 4.6 * len(states)

    def paint(figure: Any) -> None:
        base = 12.0 + lane_mm + (3.0 if states else 0.0)
        upper = layout.time_panels(figure, (27, base + 33, 174, base + 75), spans, title=False, shared=False)
        lower = layout.time_panels(figure, (27, base, 174, base + 26), spans, title=not states)
        _paint_angles(upper, samples, spans)
        _paint_speed(lower, samples, spans, speed_limit_mps)
        layout.legend_above(upper[-1])
        layout.legend_above(lower[-1])
        if states and lanes is not None:
            start, end, state = lanes.start_s, lanes.end_s, lanes.state
            strips = layout.time_panels(figure, (27, 12, 174, 12 + lane_mm), spans)
            for axes, (low, high) in zip(strips, spans, strict=True):
                mine = (end >= low) & (start <= high)
                d.lanes(axes, start[mine], end[mine], state[mine], states, {"used": d.USED})
                axes.tick_params(labelleft=axes is strips[0])

    caption = "The lanes show which epochs are used, and why the others are not."
    alt = "INS heading, GNSS track and ground speed during the taxi with lanes for each gate."
    names = ("heading_samples",) if lanes is None else ("heading_samples", "heading_lanes")
    height = 12.0 + lane_mm + (3.0 if states else 0.0) + 83.0
    return Drawing("Taxi: heading, track, speed and gates", caption, alt, d.draw("taxi", height, paint), names)


def _paint_angles(panels: list[Any], samples: HeadingSamples, spans: Sequence[tuple[float, float]]) -> None:
    for axes, span in zip(panels, spans, strict=True):
        mine = _within(samples, span)
        time, nose, speed = mine.time_s, mine.heading_deg, mine.ground_speed_mps
        track = np.where(speed > SLOWEST_TRACK_MPS, mine.track_deg, np.nan)
        d.line(axes, time, broken_at_wrap(track), d.GNSS, 0.8, 3000, label="GNSS track")
        d.line(axes, time, broken_at_wrap(nose), d.INS, 1.0, 3000, label="INS heading")
        angles = finite(nose, track)
        if angles.size:
            axes.set_ylim(*padded(float(angles.min()), float(angles.max()), 0.06, 1.0))
    panels[0].set_ylabel("angle from true north, °")


def _paint_speed(
    panels: list[Any], samples: HeadingSamples, spans: Sequence[tuple[float, float]], limit_mps: Any
) -> None:
    driven = finite(samples.ground_speed_mps[samples.is_used])
    for axes, span in zip(panels, spans, strict=True):
        mine = _within(samples, span)
        d.line(axes, mine.time_s, mine.ground_speed_mps, d.GNSS, 0.9, 3000)
        if is_number(limit_mps):
            layout.limit_line(axes, limit_mps, f"used above {limit_mps:g} m/s")
    panels[0].set_ylabel("ground speed, m/s")
    panels[0].set_ylim(0.0, TAXI_SPEED_MARGIN * float(driven.max()) if driven.size else None)


def _lane_states(lanes: HeadingLanes | None, spans: Sequence[tuple[float, float]]) -> list[str]:
    if lanes is None:
        return []
    start, end, state = lanes.start_s, lanes.end_s, lanes.state
    shown = np.any([(end >= low) & (start <= high) for low, high in spans], axis=0)
    return sorted(set(state[shown].tolist()), key=lambda name: (name != "used", name))[:12]


def forest(results: FlightResults) -> Drawing | None:
    """Estimates by segment and by direction with their intervals, beside the one of the whole run."""
    answer = results.answer(HeadingResult)
    if answer is None or not answer.segments:
        return None
    segments, shown = answer.segments, answer.segments[:24]
    rows = [(_segment_name(index, item), item, d.USED) for index, item in enumerate(shown, 1)]
    rows += [(_direction_name(item), item, d.INS) for item in answer.directions[:8]]
    height = 20.0 + 5.2 * (len(rows) + 1)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 72, 12, 174, height - 6)
        for place, (_, item, colour) in enumerate(rows):
            error = item.error_deg
            if is_number(error):
                width = NORMAL_95 * item.sigma_deg if is_number(item.sigma_deg) else 0.0
                axes.plot(
                    [error - width, error + width], [place, place], color=colour, linewidth=1.4, solid_capstyle="butt"
                )
                axes.plot([error], [place], "o", color=colour, markersize=4.0)
        _overall(axes, answer, len(rows))
        axes.set_yticks(range(len(rows) + 1), [*(d.label(name, 60) for name, _, _ in rows), "whole run"])
        axes.set_ylim(len(rows) + 0.6, -0.6)
        axes.grid(axis="y", visible=False)
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel("heading error, °")

    more = f" The first {len(shown)} of {len(segments)} segments." if len(shown) < len(segments) else ""
    blue = "; blue: directions of travel" if answer.directions else ""
    caption = (
        f"Bars: ± 1.96 σ. Green: straight segments{blue}; black: the whole run, thick: from this taxi alone. Opposite "
        f"directions that disagree point to side-slip or mounting.{more}"
    )
    alt = "Forest plot of the heading error by segment and by direction."
    return Drawing("Estimates by segment and direction", caption, alt, d.draw("forest", height, paint))


def _overall(axes: Any, answer: HeadingResult, place: int) -> None:
    error, bounds = answer.error_deg, answer.confidence95_deg
    if not is_number(error):
        return
    axes.axvline(error, color=d.INK, linewidth=0.6)
    if all(map(is_number, bounds)):
        axes.axvspan(bounds[0], bounds[1], color=d.INK, alpha=0.08, linewidth=0)
        axes.plot(bounds, [place, place], color=d.INK, linewidth=0.8, solid_capstyle="butt")
    measured = answer.confidence95_measured_deg or bounds
    if all(map(is_number, measured)):
        axes.plot(measured, [place, place], color=d.INK, linewidth=2.4, solid_capstyle="butt")
    axes.plot([error], [place], "D", color=d.INK, markersize=4.5)


def spectrum(results: FlightResults) -> Drawing | None:
    """Spectral density of the residuals beside the noise model that the honest interval rests on."""
    data = results.rows_of(HeadingSpectrum)
    if data is None:
        return None
    frequency = data.frequency_hz
    curves = ((data.density_deg2_per_hz, "measured", d.USED), (data.model_deg2_per_hz, "fitted model", d.INK))

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 52)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for values, text, colour in curves:
            d.line(axes, frequency, np.where(values > 0.0, values, np.nan), colour, 1.1, label=text)
        _plain_log_labels(axes.xaxis)
        _plain_log_labels(axes.yaxis, (1.0,))
        axes.set_xlabel("frequency, Hz")
        axes.set_ylabel("spectral density, °²/Hz")
        layout.legend_above(axes)

    caption = "The low end sets the error of the mean: slow GNSS errors are there; sway averages out."
    alt = "Spectral density of the heading residuals with the fitted noise model, logarithmic axes."
    drawn = d.draw("spectrum", 60, paint)
    return Drawing("Spectrum of the residuals", caption, alt, drawn, ("heading_spectrum",))


def _segment_name(index: int, item: TaxiSegment) -> str:
    span = f"{clock(item.start_s)}–{clock(item.end_s)}"
    track, count = number(item.mean_track_deg, 0, "°"), number(item.samples, 0)
    return f"{index}  ·  {span}  ·  track {track}  ·  n {count}"


def _direction_name(item: TaxiSegment) -> str:
    return f"direction {number(item.mean_track_deg, 0, '°')}  ·  n {number(item.samples, 0)}"
