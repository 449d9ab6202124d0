"""Folders of flights for the tests of the fleet: saved results with plausible figures, made without logs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.timescales import utc_ns_to_stamp
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS
from groundstation.results.figures import FigureData
from groundstation.results.files import save
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.inertial.forecast_answer import ForecastResult, SkillRow
from tests.report_example import MANIFEST, example, figure, heading_result

START_NS = 1_777_874_400_000_000_000  # 2026-05-04T06:00:00Z
DAY_NS = 86_400 * NS_PER_S


def flights_table(columns: Mapping[str, Sequence[Any]]) -> FigureData:
    """The table of flights from lists of typed values."""
    kinds = {"number": np.float64, "count": np.float64, "flag": np.bool_, "time": "datetime64[ns]"}
    found = {one.name: np.array(columns[one.name], dtype=kinds.get(one.kind, np.str_)) for one in FLIGHT_COLUMNS}
    return FigureData("flights", found, {})


@cache
def _heading() -> HeadingResult:
    return heading_result(figures=(), reference_residual_arcmin=None, onboard=None, runway=())


def skill(horizons_min: Sequence[float] = (30.0, 60.0), rms_m: float = 300.0, starts: int = 10) -> ForecastResult:
    """Forecast skill of two methods, the shipped one with a band."""
    rows = [
        SkillRow(method, horizon, starts, rms_m * horizon / 30.0, 0.8 * rms_m, 2.0 * rms_m, coverage)
        for method, coverage in (("raw_ins", None), ("last_estimate", 0.9))
        for horizon in horizons_min
    ]
    return ForecastResult("last_estimate", 5400.0, 300.0, True, "", tuple(rows))


def save_flight(
    out: Path,
    number: int,
    *,
    aircraft: str = "A12",
    error_deg: float = 1.0,
    sigma_deg: float = 0.5,
    samples: int = 400,
    start_utc_ns: int | None = None,
    forecast: ForecastResult | None = None,
    **changes: Any,
) -> Path:
    """Save flight ``number``, one a day, with heading samples about ``error_deg``; ``changes`` are of its heading."""
    rng = np.random.default_rng([71, number])
    start_ns = START_NS + number * DAY_NS if start_utc_ns is None else start_utc_ns
    difference = error_deg + rng.normal(0.0, sigma_deg, samples)
    is_slow = np.arange(samples) < samples // 10
    taxi = figure(
        "heading_samples",
        time_s=60.0 + 0.1 * np.arange(samples),
        segment=np.where(is_slow, 0, 1),
        heading_deg=np.full(samples, 302.0),
        track_deg=np.where(is_slow, np.nan, 302.0 - difference),
        ground_speed_mps=np.where(is_slow, 0.5, 9.0),
        difference_deg=np.where(is_slow, np.nan, difference),
        residual_deg=difference - error_deg,
        is_used=~is_slow,
        gate=np.where(is_slow, "too slow", "used"),
        weight=np.where(is_slow, 0.0, 1.0),
    )
    heading = replace(_heading(), **({"error_deg": error_deg, "standard_error_deg": 0.03} | changes))
    results = example(
        replace(heading, figures=(taxi,)),
        forecast,
        flight_id=f"{utc_ns_to_stamp(start_ns)}_{number}",
        metadata={"aircraft": aircraft, "flight": str(number)},
        start_utc_ns=start_ns,
        figures=(taxi,),
    )
    folder = out / results.flight_id
    save(folder, results, MANIFEST)
    return folder
