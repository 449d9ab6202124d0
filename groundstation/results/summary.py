"""summary.json: the answers of one flight as plain values, each rounded to its stated digits, NaN as null."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from groundstation.base.timescales import utc_ns_to_iso
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults

SCHEMA_VERSION = 1

# Decimals by unit suffix; by full name where a suffix is not enough. 6 where neither says anything.
DIGITS_BY_NAME: Mapping[str, int] = {
    "drift_deg_per_h": 2,
    "drift_sigma_deg_per_h": 2,
    "latitude_deg": 7,
    "longitude_deg": 7,
    "start_s": 3,
    "end_s": 3,
    "taxi_seconds": 1,
    "value": 5,
    "reference_residual_arcmin": 2,
}
DIGITS_BY_UNIT: Mapping[str, int] = {
    "deg": 4,
    "arcmin": 2,
    "mps": 4,
    "m": 3,
    "s": 3,
    "min": 3,
    "h": 4,
    "hz": 4,
    "arcsec": 3,
    "dph": 6,
    "dphph": 6,
    "nmiph": 4,
    "nt": 2,
}


def digits_of(name: str) -> int:
    """Decimals a number is rounded to, from its field name.

    Examples
    --------
    >>> digits_of("error_deg"), digits_of("ground_speed_mps"), digits_of("drift_deg_per_h"), digits_of("share")
    (4, 4, 2, 6)
    >>> digits_of("north_drift_sigma_dph"), digits_of("radial_error_rate_50_nmiph"), digits_of("horizon_min")
    (6, 4, 3)
    """
    if name in DIGITS_BY_NAME:
        return DIGITS_BY_NAME[name]
    for part in reversed(name.split("_")):
        unit = part.rstrip("0123456789")
        if unit in DIGITS_BY_UNIT:
            return DIGITS_BY_UNIT[unit]
    return 6


def plain(value: Any, name: str = "") -> Any:
    """Turn a value into JSON: floats rounded by their name, NaN and infinities null, dataclasses and arrays opened.

    Examples
    --------
    >>> plain({"error_deg": 1.234567, "gap_s": float("nan")})
    {'error_deg': 1.2346, 'gap_s': None}
    """
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        number = float(value)
        return round(number, digits_of(name)) + 0.0 if math.isfinite(number) else None  # + 0.0: no minus zero
    if isinstance(value, Mapping):
        return {str(key): plain(item, str(key)) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        parts = [part for part in fields(value) if not _is_figures(getattr(value, part.name))]
        return {part.name: plain(getattr(value, part.name), part.name) for part in parts}
    if isinstance(value, tuple | list | np.ndarray):
        return [plain(item, name) for item in value]
    return value if value is None else str(value)


def _is_figures(value: Any) -> bool:
    return isinstance(value, tuple) and bool(value) and isinstance(value[0], FigureData)


def _answer(answer: Answer) -> dict[str, Any]:
    """An answer as plain values; its arrays have files of their own."""
    out: dict[str, Any] = plain(answer)
    out.pop("figures", None)
    return out


def summary_of(results: FlightResults) -> dict[str, Any]:
    """Build the content of summary.json.

    Parameters
    ----------
    results : FlightResults

    Returns
    -------
    dict
        JSON values only; keys in the order of the contract. The schema is schemas/summary.schema.json.
    """
    flight = {
        "id": results.flight_id,
        "aircraft": results.metadata.get("aircraft", ""),
        "flight": results.metadata.get("flight", ""),
        "start_utc": None if results.start_utc_ns is None else utc_ns_to_iso(results.start_utc_ns),
        "duration_s": results.duration_s,
        "source": results.source,
        "metadata": dict(sorted(results.metadata.items())),
    }
    answers = {name: _answer(answer) for name, answer in results.answers.items()}
    return {
        "schema_version": SCHEMA_VERSION,
        "flight": plain(flight),
        "status": results.status,
        "completeness": plain(dict(sorted(results.completeness.items()))),
        "ledger": plain(results.ledger),
        "clock": plain(results.clock),
        "findings": plain(results.findings),
        "not_assessable": plain(results.not_assessable),
        "results": answers,
    }
