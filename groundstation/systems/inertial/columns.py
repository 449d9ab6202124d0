"""Columns that INS errors and their forecast give to the tables of flights."""

from groundstation.results.columns import AnswerColumn
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.cause_answer import CauseParameter, CausesResult
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.inertial.units_answer import UnitsResult

RAW_INS = "raw_ins"  # method of the forecast that corrects nothing

INERTIAL_COLUMNS: tuple[AnswerColumn[InertialResult], ...] = (
    AnswerColumn("ins_kind", "category", "unaided, gnss_aided or unknown", lambda inertial: inertial.kind),
    AnswerColumn(
        "departure_m",
        "number",
        "largest distance of an aided INS from GNSS where it left it",
        lambda inertial: None if inertial.worst_departure is None else inertial.worst_departure.largest_m,
    ),
    AnswerColumn("radial_error_rate_fit_nmiph", "number", "INS radial position error rate, time-position fit"),
    AnswerColumn("radial_error_rate_50_nmiph", "number", "the same, median over time"),
    AnswerColumn("radial_error_rate_95_nmiph", "number", "the same, not exceeded 95 % of the time"),
)


def _rms_m(forecast: ForecastResult, horizon_min: float) -> float | None:
    """RMS of the shipped method at a horizon; None where it was not replayed."""
    rows = {row.horizon_min: row.rms_m for row in forecast.skill if row.method == forecast.default_method}
    return rows.get(horizon_min)


def _p95_m(forecast: ForecastResult, method: str, horizon_min: float) -> float | None:
    """Return the radial error that 95 % of the starts of a method stay below.

    None where it was not replayed.
    """
    return next((row.p95_m for row in forecast.skill if (row.method, row.horizon_min) == (method, horizon_min)), None)


FORECAST_COLUMNS: tuple[AnswerColumn[ForecastResult], ...] = (
    AnswerColumn(
        "forecast_method", "category", "method the forecast figures belong to", lambda forecast: forecast.default_method
    ),
    AnswerColumn(
        "forecast_30min_rms_m",
        "number",
        "radial error of the forecast after 30 min, RMS over starts",
        lambda forecast: _rms_m(forecast, 30.0),
    ),
    AnswerColumn("forecast_60min_rms_m", "number", "after 60 min", lambda forecast: _rms_m(forecast, 60.0)),
    AnswerColumn("forecast_120min_rms_m", "number", "after 120 min", lambda forecast: _rms_m(forecast, 120.0)),
    AnswerColumn(
        "forecast_60min_p95_m",
        "number",
        "radial error of the forecast after 60 min that 95 % of the starts stay below",
        lambda forecast: _p95_m(forecast, forecast.default_method, 60.0),
    ),
    AnswerColumn(
        "raw_60min_p95_m", "number", "the same of the raw INS", lambda forecast: _p95_m(forecast, RAW_INS, 60.0)
    ),
)


def _value(one: CauseParameter | None) -> float | None:
    return None if one is None else one.value


CAUSES_COLUMNS: tuple[AnswerColumn[CausesResult], ...] = (
    AnswerColumn(
        "schuler_start_mps",
        "number",
        "Schuler amplitude of the INS by its start",
        lambda causes: causes.start_mps.value,
        is_indexed=False,
    ),
    AnswerColumn(
        "mean_drift_north_dph",
        "number",
        "mean drift of the north channel",
        lambda causes: _value(causes.parameter("mean_drift_north")),
        is_indexed=False,
    ),
    AnswerColumn(
        "mean_drift_east_dph",
        "number",
        "the same, east",
        lambda causes: _value(causes.parameter("mean_drift_east")),
        is_indexed=False,
    ),
)
UNITS_COLUMNS: tuple[AnswerColumn[UnitsResult], ...] = (
    AnswerColumn(
        "units_verdict",
        "category",
        "of several INS: agree, off, one_of, not_judged",
        lambda units: units.verdict,
        is_indexed=False,
    ),
    AnswerColumn(
        "units_off",
        "text",
        "INS that are off, or one of which is",
        lambda units: ", ".join(units.off),
        is_indexed=False,
    ),
    AnswerColumn(
        "units_rates_nmiph",
        "text",
        "radial error rate of each INS by the time-position fit",
        lambda units: ", ".join(
            f"{one.topic} {one.rate_fit_nmiph.value:.2f}" for one in units.units if one.rate_fit_nmiph is not None
        ),
        is_indexed=False,
    ),
)
