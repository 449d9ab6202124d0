"""Trends of each aircraft: control charts, changes of level, slopes, date of a limit."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.methods.fleet.changes import ChangeSettings, ControlChart, control_chart
from groundstation.methods.fleet.slopes import Line, line_of
from groundstation.methods.fleet.unit_series import (
    Crossing,
    SeriesSettings,
    UnitSeries,
    crossing_of,
    curve_of,
    line_crossing,
    series_of,
)
from groundstation.results.arrays.fleet import FleetTrend
from groundstation.results.arrays.typed import joined
from groundstation.results.figures import FigureData
from groundstation.results.fleet_trends import DAYS_PER_YEAR, NS_PER_DAY, ChangePoint, SlopeRow, TrendQuantity
from groundstation.results.fleet_units import UnitLimits

FloatArray = NDArray[np.float64]
# Aircraft change by steps, as a unit is set up anew, and by slopes: where a line explains flights hardly worse than a
# step does, both are as likely, and neither is preferred.
FALSE_STEPS = 0.05
MOST_ORDERS = 2_000_000  # flights in all drawn orders of one series
TEST_RATIO_LIMIT = 1.0  # the on-board filter refuses a measurement beyond it
LIMIT_COLUMNS: Mapping[TrendQuantity, str] = {  # where the answers of the flights say from when a check warns
    "health_vibration_mps2": "health_vibration_limit_mps2",
    "health_hdop": "health_hdop_limit",
}

# Figures that are positive and skewed are judged by their logarithm.
OF_AUTOPILOTS: tuple[TrendQuantity, ...] = (
    *("health_vibration_mps2", "health_hdop", "health_test_ratio"),
    *("onboard_heading_rms_deg", "onboard_tilt_rms_deg"),
)
POSITIVE = {
    *("standard_error_deg", "estimate_sd_deg", "radial_error_rate_fit_nmiph", "forecast_60min_rms_m"),
    *OF_AUTOPILOTS,
}
TRENDS: tuple[TrendQuantity, ...] = ("error_deg", "radial_error_rate_fit_nmiph", *OF_AUTOPILOTS)


@dataclass(frozen=True)
class FleetTrends:
    """Control charts of a fleet, the changes of level in them and the lines behind them."""

    charts: FleetTrend
    changes: tuple[ChangePoint, ...]
    slopes: tuple[SlopeRow, ...]


def groups_of(flights: FigureData) -> dict[str, NDArray[np.intp]]:
    """Rows of each named aircraft, by name."""
    names = flights["aircraft"]
    return {name: np.flatnonzero(names == name) for name in np.unique(names).tolist() if name}


def scaled(quantity: str, value: FloatArray) -> FloatArray:
    """Return the figure, or the logarithm of one that is positive (NaN where it is not)."""
    if quantity not in POSITIVE:
        return value
    return np.log(np.where(value > 0.0, value, np.nan))


def unscaled(quantity: str, value: FloatArray) -> FloatArray:
    """Return the figure itself of what :func:`scaled` gave."""
    with np.errstate(over="ignore"):  # a limit of absurd figures may be infinite
        return np.asarray(np.exp(value) if quantity in POSITIVE else value)


def trends(flights: FigureData, settings: ChangeSettings, limits: UnitLimits | None = None) -> FleetTrends:
    """Return control charts, changes and slopes of every aircraft and quantity.

    Those with enough flights that have a time are charted. The level of a chart is a line where that explains the
    flights as well as a step does.

    Parameters
    ----------
    flights : FigureData
        The table of flights.
    settings : ChangeSettings
    limits : UnitLimits, optional
        Limits for the dates.
    """
    charted = [FleetTrend.empty()]
    changes: list[ChangePoint] = []
    slopes: list[SlopeRow] = []
    stated = _limits(limits or UnitLimits())
    for name, rows in groups_of(flights).items():
        for quantity in TRENDS:
            value = scaled(quantity, flights[quantity][rows])
            timed = rows[np.isfinite(value) & ~np.isnat(flights["start_utc"][rows])]
            timed = timed[np.argsort(flights["start_utc"][timed], kind="stable")]
            raw = flights[quantity][timed]
            value = scaled(quantity, raw)
            if len(value) < settings.fewest:
                continue
            day = flights["start_utc"][timed].astype("datetime64[ns]").astype(np.int64) / NS_PER_DAY
            series, curve = _series(day, raw, value, settings)
            chart = control_chart(value - curve, settings=settings, changes=series.changes)
            if chart is None:
                continue
            limit = stated.get(quantity, _limit_of_check(flights, quantity, timed))
            own = FleetTrend(
                aircraft=np.full(len(timed), name),
                quantity=np.full(len(timed), quantity),
                flight_id=flights["flight_id"][timed],
                start_utc=flights["start_utc"][timed],
                value=raw,
                level=unscaled(quantity, chart.level + curve),
                low=unscaled(quantity, chart.low + curve),
                high=unscaled(quantity, chart.high + curve),
                is_outside=chart.is_outside(value - curve),
                limit=np.full(len(timed), np.nan if limit is None else limit),
            )
            charted.append(own)
            changes += _change_points(name, quantity, own, chart)
            found = _slope(name, quantity, day, own, series, limit)
            slopes += [] if found is None else [found]
    return FleetTrends(joined(charted), tuple(changes), tuple(slopes))


def _limits(limits: UnitLimits) -> dict[TrendQuantity, float]:
    """Limits of the charted quantities: those stated, and that of the on-board filter."""
    stated: Mapping[TrendQuantity, float | None] = {
        "error_deg": limits.heading_error_deg,
        "radial_error_rate_fit_nmiph": limits.rate_nmiph,
        "health_test_ratio": TEST_RATIO_LIMIT,
    }
    return {name: limit for name, limit in stated.items() if limit is not None}


def _limit_of_check(flights: FigureData, quantity: TrendQuantity, rows: NDArray[np.intp]) -> float | None:
    """Return the value from which the check of a quantity warns, by the last flight with one."""
    name = LIMIT_COLUMNS.get(quantity)
    values = flights[name][rows] if name is not None else np.zeros(0)
    known = values[np.isfinite(values)]
    return float(known[-1]) if len(known) else None


def _series(
    day: FloatArray, value: FloatArray, shown: FloatArray, settings: ChangeSettings
) -> tuple[UnitSeries, FloatArray]:
    """Return changes and line of a series, and the curve of its levels: zero for steps."""
    is_positive = shown is not value
    draws = int(np.clip(MOST_ORDERS // len(day), 99, 999))
    series = series_of(day, value, settings=SeriesSettings(settings, FALSE_STEPS, draws), is_positive=is_positive)
    curve = curve_of(day, value, shown, is_positive=is_positive) if series.is_sloped else None
    return series, np.zeros(len(day)) if curve is None else curve


def _slope(
    name: str, quantity: TrendQuantity, day: FloatArray, own: FleetTrend, series: UnitSeries, limit: float | None
) -> SlopeRow | None:
    """Return the line since the last change, with the date of the limit where it is a slope."""
    day, value = day[series.since :], np.asarray(own.value)[series.since :]
    line = line_of(day, value)
    if line is None:
        return None
    now = day[-1:]
    low, high = (float(one[0]) for one in line.bounds(now))
    start_ns = own.start_utc[series.since :].astype("datetime64[ns]").astype(np.int64)
    is_slope = series.is_sloped and (line.slope_low > 0.0 or line.slope_high < 0.0)
    level = float(line.at(now)[0])
    is_over = limit is not None and abs(level) >= limit
    due: tuple[float | None, ...] = (None, None, None)
    if is_slope and limit is not None and not is_over:
        found = _crossing(day, value, line, limit, is_positive=quantity in POSITIVE)
        due = (found.best, found.earliest, found.latest)
    return SlopeRow(
        name,
        quantity,
        len(day),
        int(start_ns[0]),
        int(start_ns[-1]),
        level,
        low,
        high,
        DAYS_PER_YEAR * line.slope,
        DAYS_PER_YEAR * line.slope_low,
        DAYS_PER_YEAR * line.slope_high,
        line.slope * float(day[-1] - day[0]) / (len(day) - 1),
        is_slope,
        limit,
        is_over,
        *(None if one is None else round(one) * NS_PER_DAY for one in due),
    )


def _crossing(day: FloatArray, value: FloatArray, line: Line, limit: float, *, is_positive: bool) -> Crossing:
    """Return when a slope reaches a limit; a falling one reaches its negative."""
    if is_positive:
        return crossing_of(day, value, limit) if line.slope > 0.0 else Crossing(None, None, None)
    rising = line if line.slope > 0.0 else line_of(day, -value)
    return Crossing(None, None, None) if rising is None else line_crossing(rising, float(day[-1]), limit)


def _change_points(name: str, quantity: TrendQuantity, own: FleetTrend, chart: ControlChart) -> list[ChangePoint]:
    edges = [0, *(change.index for change in chart.changes), len(own)]
    return [
        ChangePoint(
            aircraft=name,
            quantity=quantity,
            flight_id=str(own.flight_id[change.index]),
            start_utc_ns=int(own.start_utc[change.index].astype(np.int64)),
            flights_before=change.index - before,
            flights_after=after - change.index,
            level_before=float(own.level[change.index - 1]),
            level_after=float(own.level[change.index]),
            p_value=change.p_value,
        )
        for change, before, after in zip(chart.changes, edges[:-2], edges[2:], strict=True)
    ]
