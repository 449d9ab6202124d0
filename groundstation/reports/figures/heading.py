"""Figures of the taxi stage: difference over time, density, convergence, heading and track, estimates by segment."""

from typing import Any

import numpy as np

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.wording import clock, interval, is_number, number
from groundstation.reports import drawing as d
from groundstation.reports.drawing import Drawing
from groundstation.results.figures import FigureData, flags, numbers, texts
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult, TaxiSegment

TAXI_SPEED_MARGIN = 1.6  # the take-off run leaves the figure, or the taxi would be a line at its foot
SLOWEST_TRACK_MPS = 1.0  # below it the direction of motion is noise and is not drawn


def taxi_window(samples: FigureData) -> tuple[float, float]:
    """Flight times the taxi figures span: the used samples and a little around; all there are when none is used."""
    time, used = numbers(samples, "time_s"), flags(samples, "used")
    known = d.finite(time[used]) if used.any() else d.finite(time)
    if not known.size:
        return 0.0, 1.0
    return d.padded(float(known.min()), float(known.max()), 0.05, 5.0)


def difference(results: FlightResults) -> Drawing | None:
    """Difference over time with the running mean, its honest interval and e."""
    samples, running = results.figure_with_rows("heading_samples"), results.figure_with_rows("heading_running")
    if samples is None:
        return None
    time, value, used = numbers(samples, "time_s"), numbers(samples, "difference_deg"), flags(samples, "used")
    low, high = taxi_window(samples)
    count = int(np.count_nonzero(used & np.isfinite(value)))

    def paint(figure: Any) -> None:
        axes = d.place(figure, 16, 12, 174, 66)
        d.dots(axes, time[~used], value[~used], d.UNUSED, 1.5, 2500, zorder=1.5, label="not used")
        d.dots(axes, time[used], value[used], d.USED, 1.7, 3500, zorder=2, alpha=0.7, label="used")
        if running is not None:
            _running_band(axes, running)
        axes.set_ylabel("INS heading − GNSS track, °")
        axes.set_ylim(*_sample_range(value, used))
        d.time_axis(axes, low, high)
        d.legend_above(axes)

    caption = (
        f"Each dot is one GNSS epoch; n = {number(count, 0)} used. Black: running mean of the paper; shaded: its "
        "honest 95 % interval; dotted: ± e. Grey epochs failed a gate; those outside the axis are not drawn."
    )
    names = ("heading_samples",) if running is None else ("heading_samples", "heading_running")
    alt = "Scatter of heading minus track over flight time with the running mean settling."
    return Drawing("Heading minus track over time", caption, alt, d.draw("difference", 74, paint), names)


def _running_band(axes: Any, running: FigureData) -> None:
    time, mean = numbers(running, "time_s"), numbers(running, "mean_deg")
    keep = d.thin(len(running), 2000)
    time, mean = time[keep], mean[keep]
    honest, e = numbers(running, "honest_half_width_deg")[keep], numbers(running, "precision_deg")[keep]
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
    shown = d.finite(value[used]) if used.any() else d.finite(value)
    if not shown.size:
        return -1.0, 1.0
    low, high = (float(shown.min()), float(shown.max())) if used.any() else np.quantile(shown, [0.02, 0.98]).tolist()
    return d.padded(low, high, 0.12, 0.05)


def convergence(results: FlightResults) -> Drawing | None:
    """Precision e, quality and honest half width as the samples come in, with their limits."""
    running = results.figure_with_rows("heading_running")
    if running is None:
        return None
    cycles = numbers(running, "cycles")
    curves = (
        ("precision_deg", "precision e", d.INS, "precision"),
        ("quality_deg", "quality", d.GNSS, "quality"),
        ("honest_half_width_deg", "honest 95 % half width", d.INK, ""),
    )
    answer = results.answer(HeadingResult)
    limits = {} if answer is None else {gate.name: gate.limit for gate in answer.gates}
    keep = d.thin(len(running), 2000)

    def paint(figure: Any) -> None:
        axes = d.place(figure, 16, 12, 174, 52)
        axes.set_yscale("log")
        for column, text, colour, gate in curves:
            values = numbers(running, column)[keep]
            values = np.where(values > 0.0, values, np.nan)
            axes.plot(cycles[keep], values, color=colour, linewidth=1.0, label=text)
            limit = next((value for name, value in limits.items() if gate and name.startswith(gate)), None)
            if is_number(limit):
                d.limit_line(axes, limit, f"limit of {text} {limit:g}°", colour=colour)
        _plain_log_labels(axes.yaxis)
        axes.set_xlabel("cycles (distinct GNSS epochs used)")
        axes.set_ylabel("angle, °")
        known = d.finite(cycles)
        axes.set_xlim(0, max(float(known.max()), 2.0) if known.size else 1.0)
        d.legend_above(axes)

    caption = (
        "How the figures of merit settle as samples come in; dashed: limits of the gates. The honest width falls more "
        "slowly than e because neighbouring errors are alike."
    )
    alt = "Precision, quality and honest half width against the number of cycles on a logarithmic axis."
    return Drawing("Convergence", caption, alt, d.draw("convergence", 60, paint), ("heading_running",))


def _plain_log_labels(axis: Any, marks: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(10.0, subs=marks, numticks=20))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def density(results: FlightResults) -> Drawing | None:
    """Density of the heading error with the fitted normal (figure 3 of the paper)."""
    bars, normal = results.figure_with_rows("heading_distribution"), results.figure_with_rows("heading_normal")
    if bars is None:
        return None
    answer = results.answer(HeadingResult)
    low, high, height = (numbers(bars, name) for name in ("bin_low_deg", "bin_high_deg", "density_per_deg"))

    def paint(figure: Any) -> None:
        axes = d.place(figure, 16, 12, 174, 62)
        known = np.isfinite(low) & np.isfinite(high) & np.isfinite(height)
        if known.any():
            edges = np.append(low[known], high[known][-1])
            axes.stairs(
                height[known], edges, fill=True, facecolor=d.FILL, edgecolor=d.USED, linewidth=0.6, label="measured"
            )
        if normal is not None:
            d.line(
                axes,
                numbers(normal, "difference_deg"),
                numbers(normal, "density_per_deg"),
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
        d.legend_above(axes)

    count = number(None if answer is None else answer.samples, 0)
    deviation = number(None if answer is None else answer.estimate_sd_deg, 3, "°")
    caption = (
        f"Distribution of the n = {count} used differences, standard deviation {deviation}, and the normal curve "
        "fitted to them. Near-normal is a condition for taking the mean as the error."
    )
    alt = "Histogram of the heading error with a fitted normal curve."
    names = ("heading_distribution",) if normal is None else ("heading_distribution", "heading_normal")
    return Drawing("Density of the heading error", caption, alt, d.draw("density", 70, paint), names)


def taxi(results: FlightResults) -> Drawing | None:
    """Heading, track and speed during the taxi above the lanes that say which gate each epoch met."""
    samples = results.figure_with_rows("heading_samples")
    if samples is None:
        return None
    lanes, answer = results.figure_with_rows("heading_lanes"), results.answer(HeadingResult)
    speed_limit_mps = None if answer is None else answer.settings.get("taxi_speed_min_mps")
    low, high = taxi_window(samples)
    states = _lane_states(lanes, low, high)
    lane_mm = 4.6 * len(states)

    def paint(figure: Any) -> None:
        base = 12.0 + lane_mm + (3.0 if states else 0.0)
        upper = d.place(figure, 27, base + 30, 174, base + 72)
        lower = d.place(figure, 27, base, 174, base + 26)
        _paint_angles(upper, samples, low, high)
        _paint_speed(lower, samples, speed_limit_mps)
        d.time_axis(upper, low, high, title=False)
        d.time_axis(lower, low, high, title=not states)
        d.legend_above(upper)
        if states and lanes is not None:
            strip = d.place(figure, 27, 12, 174, 12 + lane_mm)
            start, end, state = numbers(lanes, "start_s"), numbers(lanes, "end_s"), texts(lanes, "state")
            d.lanes(strip, start, end, state, states, {"used": d.USED})
            d.time_axis(strip, low, high)

    caption = (
        "Heading and track agree on straight taxi up to the heading error; the lanes show which epochs are used, and "
        "what kept the others out."
    )
    alt = "INS heading, GNSS track and ground speed during the taxi with lanes for each gate."
    names = ("heading_samples",) if lanes is None else ("heading_samples", "heading_lanes")
    height = 12.0 + lane_mm + (3.0 if states else 0.0) + 80.0
    return Drawing("Taxi: heading, track, speed and gates", caption, alt, d.draw("taxi", height, paint), names)


def _paint_angles(axes: Any, samples: FigureData, low: float, high: float) -> None:
    time, nose, speed = (numbers(samples, name) for name in ("time_s", "heading_deg", "ground_speed_mps"))
    track = np.where(speed > SLOWEST_TRACK_MPS, numbers(samples, "track_deg"), np.nan)
    d.line(axes, time, d.broken_at_wrap(track), d.GNSS, 0.8, 3000, label="GNSS track")
    d.line(axes, time, d.broken_at_wrap(nose), d.INS, 1.0, 3000, label="INS heading")
    axes.set_ylabel("angle from true north, °")
    shown = (time >= low) & (time <= high)
    angles = d.finite(nose[shown], track[shown])
    if angles.size:
        axes.set_ylim(*d.padded(float(angles.min()), float(angles.max()), 0.06, 1.0))


def _paint_speed(axes: Any, samples: FigureData, limit_mps: Any) -> None:
    speed = numbers(samples, "ground_speed_mps")
    driven = d.finite(speed[flags(samples, "used")])
    d.line(axes, numbers(samples, "time_s"), speed, d.GNSS, 0.9, 3000)
    axes.set_ylabel("ground speed, m/s")
    axes.set_ylim(0.0, TAXI_SPEED_MARGIN * float(driven.max()) if driven.size else None)
    if is_number(limit_mps):
        d.limit_line(axes, limit_mps, f"used above {limit_mps:g} m/s")


def _lane_states(lanes: FigureData | None, low: float, high: float) -> list[str]:
    if lanes is None:
        return []
    start, end, state = numbers(lanes, "start_s"), numbers(lanes, "end_s"), texts(lanes, "state")
    seen = sorted(set(state[(end >= low) & (start <= high)].tolist()), key=lambda name: (name != "used", name))
    return seen[:12]


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
        axes = d.place(figure, 72, 12, 174, height - 6)
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
    whole = interval(answer.confidence95_deg, 3, "°")
    caption = (
        "Dot: estimate; bar: ± 1.96 σ. Green: straight segments; blue: directions of travel; black: the whole run with "
        f"its 95 % interval {whole}, thick what this taxi shows by itself. "
        f"Opposite directions that disagree point to side-slip or mounting.{more} "
        "Numbers: summary.json, results.heading."
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
    data = results.figure_with_rows("heading_spectrum")
    if data is None:
        return None
    frequency = numbers(data, "frequency_hz")
    columns = (("density_deg2_per_hz", "measured", d.USED), ("model_deg2_per_hz", "fitted model", d.INK))

    def paint(figure: Any) -> None:
        axes = d.place(figure, 16, 12, 174, 52)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for column, text, colour in columns:
            values = numbers(data, column)
            d.line(axes, frequency, np.where(values > 0.0, values, np.nan), colour, 1.1, label=text)
        _plain_log_labels(axes.xaxis)
        _plain_log_labels(axes.yaxis, (1.0,))
        axes.set_xlabel("frequency, Hz")
        axes.set_ylabel("spectral density, °²/Hz")
        d.legend_above(axes)

    caption = (
        "Residuals of the used samples by frequency. What counts for the error of the mean is the density at the low "
        "end: slow GNSS velocity errors sit there, sway at 0.2 to 0.6 Hz averages out."
    )
    alt = "Spectral density of the heading residuals with the fitted noise model, logarithmic axes."
    drawn = d.draw("spectrum", 60, paint)
    return Drawing("Spectrum of the residuals", caption, alt, drawn, ("heading_spectrum",))


def _segment_name(index: int, item: TaxiSegment) -> str:
    span = f"{clock(item.start_s)}–{clock(item.end_s)}"
    track, count = number(item.mean_track_deg, 0, "°"), number(item.samples, 0)
    return f"{index}  ·  {span}  ·  track {track}  ·  n {count}"


def _direction_name(item: TaxiSegment) -> str:
    return f"direction {number(item.mean_track_deg, 0, '°')}  ·  n {number(item.samples, 0)}"
