"""Figures of the forecast: growth by horizon, calibration, the hindcast map."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.wording import number
from groundstation.plots.ranges import finite, thin
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import has_values, plain_log
from groundstation.results.arrays.forecast import ForecastGrowth, ForecastMap
from groundstation.results.flight import FlightResults
from groundstation.results.forecast import FEWEST_STARTS, METHODS, CalibrationRow, ForecastResult

OTHERS = ("#e69f00", "#56b4e9", "#8a2be2", "#7a6a00", "#cc79a7", "#a9b1ba", "#d55e00")
MAP_CELLS = 90  # along each side: finer is not seen on paper and makes the page heavy
LEVELS = 12
MAP_QUANTILE = 0.98  # the scale of colour ends there: a few bad starts would darken the rest
NOMINAL = (0.50, 0.68, 0.95)  # shares that the bands should hold


def _shipped(results: FlightResults) -> str:
    answer = results.answer(ForecastResult)
    return "" if answer is None else answer.default_method


def growth(results: FlightResults) -> Drawing | None:
    """RMS error by horizon, a line for each method, the shipped one thick; logarithmic axes."""
    data, default = results.rows_of(ForecastGrowth), _shipped(results)
    known = [] if data is None else [name for name in METHODS if has_values(data.rms_m.get(name))]
    if data is None or not known or not has_values(data.horizon_min):
        return None
    horizon = data.horizon_min
    colours = dict(zip((name for name in METHODS if name not in ("raw_ins", default)), OTHERS, strict=False))
    colours |= {"raw_ins": d.INS, default: d.USED}
    ordered = sorted(known, key=lambda name: -_last(data.rms_m[name]))

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 112, 82)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for name in ordered:
            text = f"{METHODS[name]}{' (shipped)' if name == default else ''}"
            values = data.rms_m[name]
            width, order = (2.6, 4) if name == default else (1.0, 2)
            values = np.where(values > 0.0, values, np.nan)
            d.line(axes, horizon, values, colours[name], width, label=d.label(text), zorder=order)
        sigma = data.sigma_m
        if sigma is not None and np.isfinite(sigma).any():
            d.line(axes, horizon, sigma, d.INK, 1.0, linestyle=(0, (2, 2)), label="σ claimed (shipped)")
        plain_log(axes.xaxis)
        plain_log(axes.yaxis)
        axes.set_xlabel("horizon, min without GNSS")
        axes.set_ylabel("RMS radial error, m")
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), labelspacing=0.7)

    caption = (
        "Error built up since the start, root mean square over all starts. After about one Schuler period (84 min) a "
        "mainly oscillating error returns to its start, so the raw INS looks good for a moment."
    )
    alt = "RMS error against horizon for each forecast method, logarithmic axes."
    return Drawing("How the error grows", caption, alt, d.draw("growth", 90, paint), ("forecast_growth",))


def _last(values: NDArray[np.float64]) -> float:
    known = finite(values)
    return float(known[-1]) if known.size else 0.0


def calibration(results: FlightResults) -> Drawing | None:
    """Shares inside the 50, 68 and 95 % bands by horizon, and NEES with its limits, of the shipped method."""
    answer = results.answer(ForecastResult)
    mine = [] if answer is None else [row for row in answer.calibration if row.method == answer.default_method]
    mine = sorted((row for row in mine if np.isfinite(row.horizon_min)), key=lambda row: row.horizon_min)
    if not mine:
        return None

    def paint(figure: Any) -> None:
        left, right = layout.place(figure, 18, 12, 86, 56), layout.place(figure, 106, 12, 174, 56)
        _paint_bands(left, mine)
        _paint_nees(right, mine)
        for axes in (left, right):
            axes.set_xlabel("horizon, min without GNSS")

    caption = (
        "Left: share of the errors inside the claimed bands; bands on the dashed lines are honest, below them too "
        "narrow. Right: squared error over claimed variance; above the shaded limits the forecast is overconfident. "
        f"Hollow: fewer than {FEWEST_STARTS} independent starts, not judged."
    )
    alt = "Coverage of the claimed bands and NEES by horizon."
    return Drawing("Calibration of the shipped method", caption, alt, d.draw("calibration", 64, paint))


def _paint_bands(axes: Any, rows: list[CalibrationRow]) -> None:
    horizon = np.array([row.horizon_min for row in rows])
    inside = np.array([[row.inside50, row.inside68, row.inside95] for row in rows])
    for shares, nominal, colour in zip(inside.T, NOMINAL, (d.INS, d.GNSS, d.USED), strict=True):
        axes.plot(horizon, 100.0 * shares, "o-", color=colour, markersize=3.0, linewidth=1.0)
        layout.limit_line(axes, 100.0 * nominal, "", colour=colour)
    axes.set_ylim(0.0, 105.0)
    axes.set_ylabel("errors inside the band, %")
    axes.set_yticks([0.0, 25.0, *(100.0 * nominal for nominal in NOMINAL), 100.0])
    axes.set_title("Bands of 50, 68 and 95 %")


def _paint_nees(axes: Any, rows: list[CalibrationRow]) -> None:
    horizon, nees = np.array([row.horizon_min for row in rows]), np.array([row.nees for row in rows])
    low, high = [row.nees_low for row in rows], [row.nees_high for row in rows]
    axes.fill_between(horizon, low, high, color=d.USED, alpha=0.18, linewidth=0, label="95 % limits")
    axes.plot(horizon, nees, "o-", color=d.INK, markersize=3.0, linewidth=1.0, label="NEES")
    few = np.array([row.independent_starts < FEWEST_STARTS for row in rows])
    axes.plot(horizon[few], nees[few], "o", color=d.INK, markerfacecolor="white", markersize=3.0)
    axes.axhline(1.0, color=d.FAINT, linewidth=0.6)
    axes.set_ylim(bottom=0.0)
    layout.legend_above(axes)
    axes.set_ylabel("NEES, 1 is honest")


def hindcast_map(results: FlightResults) -> Drawing | None:
    """Radial error by start and horizon, the shipped method beside the raw INS, on one scale of colour."""
    data = results.rows_of(ForecastMap)
    if data is None:
        return None
    names = [name for name in dict.fromkeys((_shipped(results), "raw_ins")) if has_values(data.radial_m.get(name))]
    starts, horizons = np.unique(finite(data.start_s)), np.unique(finite(data.horizon_min))
    if not names or min(len(starts), len(horizons)) < 2 or len(starts) * len(horizons) != len(data):
        return None
    rows, columns = thin(len(starts), MAP_CELLS), thin(len(horizons), MAP_CELLS)
    cubes = [data.radial_m[name].reshape(len(starts), len(horizons))[np.ix_(rows, columns)].T for name in names]
    hours, minutes = starts[rows] / 3600.0, horizons[columns]
    top = float(np.quantile(finite(*cubes), MAP_QUANTILE))

    def paint(figure: Any) -> None:
        from matplotlib.ticker import MaxNLocator

        levels = MaxNLocator(LEVELS).tick_values(0.0, max(top, 1.0))
        drawn = None
        for place, (name, cells) in enumerate(zip(names, cubes, strict=True)):
            axes = layout.place(figure, 16 + 72 * place, 12, 80 + 72 * place, 66)
            axes.grid(visible=False)
            drawn = axes.contourf(hours, minutes, np.ma.masked_invalid(cells), levels, cmap="viridis", extend="max")
            d.tell(axes, *np.meshgrid(hours, minutes), cells, "radial error, m")
            axes.set_title(METHODS.get(name, name))
            axes.set_xlabel("start, h of flight time")
            axes.set_ylabel("horizon, min without GNSS" if place == 0 else "")
        bar = figure.colorbar(drawn, cax=layout.place(figure, 157, 12, 161, 66))
        bar.set_label("radial error, m")

    caption = (
        f"Forecast started at {number(len(starts), 0)} moments of the flight: radial error by start and horizon, both "
        "maps on one scale, clipped at the worst 2 %. White: beyond the end of the flight, or no GNSS."
    )
    alt = "Maps of the forecast error by start and horizon for the shipped method and the raw INS."
    return Drawing("Hindcast map", caption, alt, d.draw("map-hindcast", 74, paint), ("forecast_map",))
