"""Plots of the forecast: growth by horizon, calibration, the hindcast map."""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.plots.common import has_values, label, line_with_dots, positive
from groundstation.chapters.wording import number
from groundstation.plots.marks import AnyMark, Band, Cells, Curve, Dots, Emphasis, Floats, Limit, Points, Role
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import finite, thin
from groundstation.results.flight import FlightResults
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.systems.inertial.forecast_answer import FEWEST_STARTS, CalibrationRow, ForecastResult
from groundstation.systems.inertial.forecast_arrays import ForecastGrowth, ForecastMap

OTHERS: tuple[Role, ...] = ("series 5", "series 6", "limit", "series 7", "series 4", "unused", "series 2")
MAP_CELLS = 90  # along each side: finer is not seen on paper and makes the page heavy
MAP_QUANTILE = 0.98  # the scale of colour ends there: a few bad starts would darken the rest
NOMINAL: tuple[tuple[float, Role], ...] = ((0.50, "ins"), (0.68, "gnss"), (0.95, "answer"))  # shares in the bands
HORIZON = "horizon, min without GNSS"


def _shipped(results: FlightResults) -> str:
    answer = results.answer(ForecastResult)
    return "" if answer is None else answer.default_method


def method_roles(default: str) -> dict[str, Role]:
    """Return a role for every method; raw INS and shipped method have roles of their own."""
    others = (name for name in FORECAST_METHODS if name not in ("raw_ins", default))
    return {**dict(zip(others, OTHERS, strict=False)), "raw_ins": "ins", default: "answer"}


def growth(results: FlightResults) -> Plot | None:
    """Return the RMS error by horizon, a line for each method, on logarithmic axes.

    The line of the shipped method is thick.
    """
    data, default = results.rows_of(ForecastGrowth), _shipped(results)
    known = [] if data is None else [name for name in FORECAST_METHODS if has_values(data.rms_m.get(name))]
    if data is None or not known or not has_values(data.horizon_min):
        return None
    horizon, roles = data.horizon_min, method_roles(default)
    marks: list[AnyMark] = []
    ordered = sorted(known, key=lambda name: (name == default, -_last(data.rms_m[name])))  # the shipped over the others
    for name in ordered:
        is_shipped = name == default
        text = label(f"{FORECAST_METHODS[name]}{' (shipped)' if is_shipped else ''}")
        heavy: Emphasis = "bold" if is_shipped else "usual"
        marks.append(Curve(x=horizon, y=positive(data.rms_m[name]), role=roles[name], name=text, emphasis=heavy))
    if data.sigma_m is not None and np.isfinite(data.sigma_m).any():
        marks.append(Curve(x=horizon, y=data.sigma_m, role="ink", dash="dotted", name="σ claimed (shipped)"))
    panel = Panel(marks, Axis(HORIZON, "log"), Axis("RMS radial error, m", "log"), legend="beside")
    return Plot(
        "forecast.growth",
        "How the error grows",
        "Error built up since the start, root mean square over all starts. After about one Schuler period (84 min) a "
        "mainly oscillating error returns to its start, so the raw INS looks good for a moment.",
        "RMS error against horizon for each forecast method, logarithmic axes.",
        one_panel(panel, 70.0),
        ("forecast_growth",),
    )


def _last(values: Floats) -> float:
    known = finite(values)
    return float(known[-1]) if known.size else 0.0


def calibration(results: FlightResults) -> Plot | None:
    """Return shares inside the 50, 68 and 95 % bands, and NEES, of the shipped method.

    Both are by horizon; NEES has its limits.
    """
    answer = results.answer(ForecastResult)
    mine = [] if answer is None else [row for row in answer.calibration if row.method == answer.default_method]
    mine = sorted((row for row in mine if np.isfinite(row.horizon_min)), key=lambda row: row.horizon_min)
    if not mine:
        return None
    return Plot(
        "forecast.calibration",
        "Calibration of the shipped method",
        "Left: share of the errors inside the claimed bands; bands on the dashed lines are honest, below them too "
        "narrow. Right: squared error over claimed variance; above the shaded limits the forecast is overconfident. "
        f"Hollow: fewer than {FEWEST_STARTS} independent starts, not judged.",
        "Coverage of the claimed bands and NEES by horizon.",
        (Row((_bands(mine), _nees(mine)), 44.0),),
    )


def _bands(rows: list[CalibrationRow]) -> Panel:
    horizon = np.array([row.horizon_min for row in rows])
    inside = np.array([[row.inside50, row.inside68, row.inside95] for row in rows], dtype=np.float64)
    marks: list[AnyMark] = []
    for shares, (nominal, role) in zip(inside.T, NOMINAL, strict=True):
        marks += [Limit(value=100.0 * nominal, role=role), *line_with_dots(horizon, 100.0 * shares, role)]
    ticks = (0.0, 25.0, *(100.0 * nominal for nominal, _ in NOMINAL))
    y = Axis("errors inside the band, %", low=0.0, high=105.0, ticks=ticks)
    return Panel(marks, Axis(HORIZON), y, title="Bands of 50, 68 and 95 %", legend="")


def _nees(rows: list[CalibrationRow]) -> Panel:
    horizon, nees, low, high = np.array(
        [(row.horizon_min, row.nees, row.nees_low, row.nees_high) for row in rows], dtype=np.float64
    ).T
    few = np.array([row.independent_starts < FEWEST_STARTS for row in rows])
    marks: list[AnyMark] = [
        Band(x=horizon, low=low, high=high, role="answer", name="95 % limits"),
        Limit(value=1.0, role="faint", dash="", emphasis="faint"),
        Curve(x=horizon, y=nees, role="ink", name="NEES"),
        Dots(x=horizon[~few], y=nees[~few], role="ink", emphasis="bold"),
        Points(x=horizon[few], y=nees[few], role="ink", is_hollow=True),
    ]
    return Panel(marks, Axis(HORIZON), Axis("NEES, 1 is honest", low=0.0))


def hindcast_map(results: FlightResults) -> Plot | None:
    """Return the radial error by start and horizon, shipped method beside raw INS.

    Both on one scale of colour.
    """
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
    top = max(float(np.quantile(finite(*cubes), MAP_QUANTILE)), 1.0)
    panels: list[Panel] = []
    for name, cells in zip(names, cubes, strict=True):
        mark = Cells(x=hours, y=minutes, values=cells, low=0.0, high=top, title="radial error, m")
        y = Axis("" if panels else HORIZON)
        panels.append(
            Panel((mark,), Axis("start, h of flight time"), y, title=FORECAST_METHODS.get(name, name), legend="")
        )
    return Plot(
        "forecast.hindcast_map",
        "Hindcast map",
        f"Forecast started at {number(len(starts), 0)} moments of the flight: radial error by start and horizon, both "
        "maps on one scale, clipped at the worst 2 %. White: beyond the end of the flight, or no GNSS.",
        "Maps of the forecast error by start and horizon for the shipped method and the raw INS.",
        (Row(tuple(panels), 54.0),),
        ("forecast_map",),
    )


PLOTS: Mapping[str, Describe] = {
    "forecast.growth": growth,
    "forecast.calibration": calibration,
    "forecast.hindcast_map": hindcast_map,
}
