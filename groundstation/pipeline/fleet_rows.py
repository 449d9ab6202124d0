"""What one flight adds to the fleet: its row, its checks, its forecast skill, its samples; from what it saved."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.errors import GroundstationError
from groundstation.base.records import MAX_TEXT_CHARACTERS
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.estimators.fleet.density import SampleHistogram, histogram_of
from groundstation.estimators.fleet.moments import Moments, moments_of
from groundstation.estimators.fleet.skill import SkillOfFlight
from groundstation.estimators.heading.figures import IN_PAUSE
from groundstation.estimators.heading.references import REFERENCE_SIGMA_DEG, logged_reference
from groundstation.reports.index import index_row
from groundstation.reports.sections.saved import heading_of, mapping, objects
from groundstation.results.figures import FigureData, flags, numbers, texts
from groundstation.results.files import SavedFlight, utf8_text
from groundstation.results.fleet import FLIGHT_COLUMNS, Kind

FloatArray = NDArray[np.float64]
NORMAL_95 = 1.959964
LARGEST = 1e15  # no figure of a flight is larger: what is comes from a file that is damaged
LATEST_NS = 7_000_000_000_000_000_000  # 2191: times of samples must fit beside the start


@dataclass(frozen=True)
class Check:
    """Something independent of the estimate beside it: residual, the sigma claimed for it, inside 95 % or not."""

    quantity: str
    residual_deg: float
    sigma_deg: float
    is_inside: bool


@dataclass(frozen=True)
class HeadingSamples:
    """The heading samples of a flight, without the rows that only break lines; ``error_deg`` is NaN below walking pace.

    ``moments`` and ``histogram`` are of the used ones, about the flight's estimate, so that none is cut at 180 deg.
    """

    columns: Mapping[str, NDArray[Any]]
    moments: Moments
    histogram: SampleHistogram


def to_number(value: Any) -> float:
    """A JSON value as a float; NaN when it is no finite number, or an absurd one.

    Examples
    --------
    >>> to_number(3), to_number("3"), to_number(True), to_number(None), to_number(10**400)
    (3.0, nan, nan, nan, nan)
    """
    if not isinstance(value, int | float) or isinstance(value, bool):
        return math.nan
    return float(value) if abs(value) <= LARGEST else math.nan


def start_utc_ns(value: Any) -> int | None:
    """Nanoseconds of the start as summary.json has it, None when it is missing or absurd.

    Examples
    --------
    >>> start_utc_ns("2026-05-04T06:00:00.250Z"), start_utc_ns(None), start_utc_ns("9999-01-01T00:00")
    (1777874400250000000, None, None)
    """
    try:
        found = iso_to_utc_ns(value)[0] if isinstance(value, str) else None
    except GroundstationError:
        return None
    return found if found is not None and abs(found) < LATEST_NS else None


def flight_row(saved: SavedFlight, samples: HeadingSamples | None) -> dict[str, Any]:
    """Build the row of a flight: a value for every one of :data:`FLIGHT_COLUMNS`, of the type its kind has."""
    heading = heading_of(saved)
    start = start_utc_ns(mapping(saved.summary, "flight").get("start_utc"))
    moments = samples.moments if samples is not None else Moments()
    found = index_row(saved) | {
        "flight_id": saved.folder.name,
        "start_utc": start,
        "month": "" if start is None else str(np.datetime64(start, "ns").astype("datetime64[M]")),
        "has_lost_data": _has_lost_data(mapping(saved.summary, "ledger")),
        "not_assessable": "; ".join(_reasons(saved)),
        "standstill_speed_of_mean_mps": mapping(heading, "standstill").get("speed_of_mean_mps"),
        **{name: heading.get(name) for name in _MORE_OF_HEADING},
    }
    if moments.count:
        found |= {"samples": moments.count, "sample_mean_deg": moments.mean, "sample_m2_deg2": moments.m2}
    return {column.name: _typed(column.kind, found.get(column.name)) for column in FLIGHT_COLUMNS}


_MORE_OF_HEADING = (*("paper_error_deg", "drift_sigma_deg_per_h", "lever_arm_m", "time_offset_s", "parking_sigma_deg"),)


def _has_lost_data(ledger: Mapping[str, Any]) -> bool:
    damages = objects(ledger, "damages")
    return bool(ledger.get("truncated")) or any(entry.get("loses_data") is True for entry in damages)


def _reasons(saved: SavedFlight) -> list[str]:
    entries = objects(saved.summary, "not_assessable")
    return [f"{entry.get('analysis', '')}: {entry.get('reason', '')}" for entry in entries]


def _typed(kind: Kind, value: Any) -> Any:
    if kind in ("number", "count"):
        return to_number(value)
    if kind in ("flag", "time"):
        return value
    return "" if value is None else utf8_text(value)[:MAX_TEXT_CHARACTERS]


def flights_table(columns: Mapping[str, Sequence[Any]]) -> FigureData:
    """Turn lists of typed values into the table of flights."""
    return FigureData("flights", {one.name: _column(one.kind, columns[one.name]) for one in FLIGHT_COLUMNS}, {})


def _column(kind: Kind, values: Sequence[Any]) -> NDArray[Any]:
    if kind == "time":
        stamps = [np.datetime64("NaT", "ns") if value is None else np.datetime64(value, "ns") for value in values]
        return np.array(stamps, dtype="datetime64[ns]")
    return np.array(values, dtype={"number": np.float64, "count": np.float64, "flag": np.bool_}.get(kind, np.str_))


def heading_samples(saved: SavedFlight) -> HeadingSamples | None:
    """The heading samples a flight saved, None when it has none.

    Raises
    ------
    UnreadableLogError
        When their file is broken.
    """
    figure = saved.figure("heading_samples")
    if figure is None:
        return None
    is_epoch = texts(figure, "gate") != IN_PAUSE
    difference, used = numbers(figure, "difference_deg")[is_epoch], flags(figure, "used")[is_epoch]
    centre = float(np.nan_to_num(wrap_180(to_number(heading_of(saved).get("error_deg")))))
    about_estimate = centre + wrap_180(difference[used] - centre)
    names = ("time_s", "segment", "heading_deg", "track_deg", "ground_speed_mps", "weight")
    columns = {name: numbers(figure, name)[is_epoch] for name in names}
    columns |= {"error_deg": difference, "used": used, "gate": texts(figure, "gate")[is_epoch]}
    return HeadingSamples(columns, moments_of(about_estimate), histogram_of(about_estimate))


def checks_of(saved: SavedFlight) -> list[Check]:
    """Everything independent that the flight's heading was compared with."""
    heading = heading_of(saved)
    found = [_reference_check(heading, mapping(saved.summary, "flight", "metadata"))]
    for runway in objects(heading, "runway"):
        found.append(_check("runway", runway.get("difference_deg"), to_number(runway.get("sigma_deg"))))
    difference = mapping(heading, "onboard").get("difference_error_deg")
    found.append(_check("onboard", difference, to_number(heading.get("standard_error_deg"))))
    return [check for check in found if check is not None]


def _reference_check(heading: Mapping[str, Any], metadata: Mapping[str, Any]) -> Check | None:
    reference = logged_reference({key: value for key, value in metadata.items() if isinstance(value, str)})
    sigma = math.hypot(
        to_number(heading.get("parking_sigma_deg")), reference.sigma_deg if reference else REFERENCE_SIGMA_DEG
    )
    return _check("reference", to_number(heading.get("reference_residual_arcmin")) / ARCMIN_PER_DEG, sigma)


def _check(quantity: str, residual: Any, sigma_deg: float) -> Check | None:
    residual_deg = to_number(residual)
    if math.isnan(residual_deg) or not sigma_deg > 0.0:
        return None
    return Check(quantity, residual_deg, sigma_deg, abs(residual_deg) <= NORMAL_95 * sigma_deg)


def skill_of(saved: SavedFlight) -> tuple[str, list[SkillOfFlight]]:
    """The shipped method of a flight and its rows of forecast skill."""
    forecast = mapping(saved.summary, "results", "forecast")
    rows = []
    for row in objects(forecast, "skill"):
        starts, horizon = to_number(row.get("starts")), to_number(row.get("horizon_min"))
        rms, coverage = to_number(row.get("rms_m")), to_number(row.get("coverage95"))
        if starts >= 1.0 and math.isfinite(horizon + rms):
            rows.append(SkillOfFlight(str(row.get("method")), horizon, int(starts), rms, coverage))
    return str(forecast.get("default_method", "")), rows
