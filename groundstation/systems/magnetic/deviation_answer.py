"""Deviation on its own: applied to a heading, and as a table (deviation.csv)."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UsageError
from groundstation.base.serial import MismatchError
from groundstation.base.words import counted
from groundstation.results.figures import FigureData
from groundstation.results.files import csv_text, mapping
from groundstation.results.flight import FlightResults
from groundstation.results.restore import restored_answer
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import (
    DEVIATION_CSV,
    METHOD_TITLES,
    MagneticResult,
    MagneticVerdict,
    PoissonParameters,
)
from groundstation.systems.magnetic.arrays import FluxCurve, MagneticCurves, MagneticTable
from groundstation.systems.magnetic.flux_answer import FLUX_TITLES, FluxDeviation

BINS = 360
MIDDLE_TOLERANCE_DEG = 0.01  # a spreadsheet may have rounded
READING, TO_ADD, SIGMA = "uncorrected_magnetic_heading_deg", "deviation_to_add_deg", "deviation_sigma_deg"
TABLE_TO_ADD, TABLE_SIGMA, COVERAGE = "table_deviation_to_add_deg", "table_deviation_sigma_deg", "coverage"
METHOD, VERDICT, FLIGHT, AIRCRAFT = "method", "verdict", "flight_id", "aircraft"
NEEDED = (READING, TO_ADD, METHOD, VERDICT)
RUN_AGAIN = "run its log again"
TITLES: dict[str, str] = {str(name): title for name, title in (*METHOD_TITLES.items(), *FLUX_TITLES.items())}


@dataclass(frozen=True)
class Deviation:
    """Deviation of the magnetic heading that one flight found, by the method it recommends.

    Parameters
    ----------
    flight_id, aircraft : str
        Flight and aircraft it is of; empty where they are not known.
    method, verdict, verdict_reason : str
    magnetometer_topic : str
        Sensor that it belongs to; empty where that is not known.
    table_deg : tuple of 360 float
        To be added in the middle of each degree of the uncorrected magnetic heading; empty where the coefficients stand
        for it.
    coefficients_deg : mapping of A ... E to deg
        Coefficients of the error, the negative of what is added; empty where the table stands for it.
    iron : PoissonParameters, optional
        For readings of the field along three axes.
    """

    flight_id: str
    aircraft: str
    method: str
    verdict: str
    verdict_reason: str = ""
    magnetometer_topic: str = ""
    table_deg: tuple[float, ...] = ()
    coefficients_deg: Mapping[str, float] = field(default_factory=dict)
    iron: PoissonParameters | None = None

    @property
    def is_of_heading(self) -> bool:
        """Tell whether it is that of a compass that gives heading alone."""
        return self.method in FLUX_TITLES

    @property
    def title(self) -> str:
        """Name of the flight it is of, for people."""
        return self.flight_id or "an unnamed flight"


def deviation_of(found: MagneticResult, flight_id: str, aircraft: str) -> Deviation:
    """The deviation of a result, by its recommended method."""
    by_table = found.recommended_method == "compass_table"
    return Deviation(
        flight_id,
        aircraft,
        found.recommended_method,
        found.verdict,
        found.verdict_reason,
        found.magnetometer_topic,
        found.deviation_deg if by_table else (),
        {} if by_table else dict(found.method(found.recommended_method).coefficients_deg),
        found.poisson if found.recommended_method == "poisson_attitude" else None,
    )


def flux_deviation_of(found: FluxDeviation, flight_id: str, aircraft: str) -> Deviation:
    """The deviation of a compass that gives heading alone."""
    name, verdict, reason, topic = found.recommended_method, found.verdict, found.verdict_reason, found.ins_topic
    return Deviation(flight_id, aircraft, name, verdict, reason, topic, found.deviation_deg)


def deviation_from_summary(summary: Mapping[str, Any], where: str) -> Deviation:
    """The deviation in a flight's summary.json.

    Raises
    ------
    UsageError
        When it holds none, or one that cannot be used.
    """
    flight = mapping(summary, "flight")
    whose = str(flight.get("id") or ""), str(flight.get("aircraft") or "")
    of_heading = bool(mapping(summary, "results", "magnetic_flux")) and not mapping(summary, "results", "magnetic")
    if not of_heading and not mapping(summary, "results", "magnetic"):
        entries = summary.get("not_assessable")
        found = [mapping(one) for one in entries] if isinstance(entries, list) else []
        why = next((f" ({one.get('reason')})" for one in found if one.get("analysis") == "magnetic"), "")
        raise UsageError(where, f"no magnetic deviation{why}", "the summary.json of a flight that has one")
    try:
        if of_heading:
            return _checked(flux_deviation_of(restored_answer(summary, FluxDeviation), *whose), where)
        own = deviation_of(restored_answer(summary, MagneticResult), *whose)
        return _checked(own, where)
    except (MismatchError, ValueError, KeyError, TypeError, AttributeError) as error:
        what = f"a magnetic deviation that cannot be used ({error})"
        raise UsageError(where, what, "one that this version writes", RUN_AGAIN) from error


def deviation_from_csv(text: str, where: str) -> Deviation:
    """Read the deviation from a table that :func:`deviation_csv` wrote.

    Further columns and the order of rows do not matter.

    Raises
    ------
    UsageError
        When a column or a degree is missing, or a value is none.
    """
    try:
        reader = csv.DictReader(io.StringIO(text.removeprefix("\ufeff"), newline=""), strict=True)
        rows = list(reader)
        names = list(reader.fieldnames or ())
    except csv.Error as error:
        raise UsageError(where, f"no CSV ({error})", f"a {DEVIATION_CSV} of a flight folder") from error
    missing = [name for name in NEEDED if name not in names]
    if missing:
        raise UsageError(where, f"no column {missing[0]}", f"a {DEVIATION_CSV} of a flight folder, with commas")
    table = [math.nan] * BINS
    for number, row in enumerate(rows, 2):
        reading, added = (_number(row[name], f"{where}, row {number}, {name}") for name in (READING, TO_ADD))
        if not 0.0 <= reading < BINS or abs(reading % 1.0 - 0.5) > MIDDLE_TOLERANCE_DEG:
            raise UsageError(
                f"{where}, row {number}, {READING}", f"{reading:g}", "the middle of a degree, 0.5 to 359.5"
            )
        table[int(reading)] = added
    empty = [place for place, added in enumerate(table) if math.isnan(added)]
    if empty or len(rows) != BINS:
        found = f"no row for {empty[0]} to {empty[0] + 1} deg" if empty else counted(len(rows), "row")
        raise UsageError(where, found, f"{BINS} rows, one for each degree")
    told = {name: _only(rows, name, where) for name in (FLIGHT, AIRCRAFT, METHOD, VERDICT)}
    return _checked(Deviation(told[FLIGHT], told[AIRCRAFT], told[METHOD], told[VERDICT], table_deg=tuple(table)), where)


def deviation_csv(results: FlightResults) -> str | None:
    """Return the deviation of a flight as a table of 360 rows; None when it has none.

    None also when the flight lacks the arrays. Columns: the uncorrected magnetic heading in the middle of its
    bin; what is to be added to it, with its sigma, by the recommended method and by the table of branches; whether both
    branches covered the bin; whose it is. Deviations are those of level flight, east positive.

    Source of the form: RFC 4180, Common Format and MIME Type for CSV Files, 2005.
    """
    magnetic = results.answer(MagneticResult)
    if magnetic is None:
        return _flux_csv(results)
    curves, table = results.rows_of(MagneticCurves), results.rows_of(MagneticTable)
    if curves is None or table is None:
        return None
    if len(table) != len(curves) or "compass_table" not in curves.sigma_deg:
        return None
    columns: dict[str, NDArray[Any]] = {
        READING: table.uncorrected_magnetic_heading_deg,
        TO_ADD: curves.deviation_to_add_deg,
        SIGMA: curves.deviation_sigma_deg,
        TABLE_TO_ADD: table.deviation_deg,
        TABLE_SIGMA: curves.sigma_deg["compass_table"],
        COVERAGE: np.where(table.is_interpolated, "interpolated", "covered"),
    }
    return _with_owner(columns, magnetic.recommended_method, magnetic.verdict, results)


def _flux_csv(results: FlightResults) -> str | None:
    """Return the table of a compass that gives heading alone; None without one."""
    found, curve = results.answer(FluxDeviation), results.rows_of(FluxCurve)
    if found is None or curve is None:
        return None
    columns: dict[str, NDArray[Any]] = {
        READING: curve.uncorrected_magnetic_heading_deg,
        TO_ADD: curve.deviation_to_add_deg,
        SIGMA: curve.deviation_sigma_deg,
        COVERAGE: np.where(curve.is_interpolated, "interpolated", "covered"),
    }
    return _with_owner(columns, found.recommended_method, found.verdict, results)


def _with_owner(columns: dict[str, NDArray[Any]], method: str, verdict: str, results: FlightResults) -> str:
    owner = {
        METHOD: method,
        VERDICT: verdict,
        FLIGHT: results.flight_id,
        AIRCRAFT: results.metadata.get("aircraft", ""),
    }
    told = columns | {name: np.full(BINS, value) for name, value in owner.items()}
    return csv_text(FigureData("deviation", told, {}), "\r\n")


def _checked(found: Deviation, where: str) -> Deviation:
    """The deviation, if every number of it is one and its verdict is known."""
    if found.verdict not in get_args(MagneticVerdict):
        raise UsageError(where, f"the verdict {found.verdict!r}", f"one of {', '.join(get_args(MagneticVerdict))}")
    if found.method not in TITLES:
        raise UsageError(where, f"the method {found.method!r}", f"one of {', '.join(TITLES)}")
    numbers = [*found.table_deg, *(found.coefficients_deg.get(letter, math.nan) for letter in LETTERS)]
    numbers = numbers[:BINS] if found.table_deg else numbers
    if found.iron is not None:
        numbers += [*found.iron.hard_iron_nt, *(value for row in found.iron.soft_iron for value in row)]
        numbers += found.iron.current_effect_nt_per_a or ()
    if not all(map(math.isfinite, numbers)) or (found.table_deg and len(found.table_deg) != BINS):
        raise UsageError(where, "a magnetic deviation with numbers missing", "", RUN_AGAIN)
    if any(abs(value) > 180.0 for value in found.table_deg):
        raise UsageError(where, "a deviation beyond 180 deg", "", "check that it is in degrees")
    if found.iron is not None and not _is_invertible(found.iron.soft_iron):
        raise UsageError(where, "a soft iron that cannot be inverted", "", RUN_AGAIN)
    return found


def _is_invertible(soft: Sequence[Sequence[float]]) -> bool:
    (a, b, c), (d, e, f), (g, h, i) = soft
    return abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)) > 1e-6


def _number(text: str | None, where: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(where, repr(text or ""), "a number, with a decimal point")
    return value


def _only(rows: Sequence[Mapping[str, str | None]], name: str, where: str) -> str:
    """Return the one text of a column.

    The apostrophe that keeps a spreadsheet from running it is taken off.
    """
    texts = {row.get(name) or "" for row in rows}
    if len(texts) > 1:
        raise UsageError(where, f"several values of {name}", "the table of one flight")
    text = texts.pop()
    return text[1:] if text.startswith("'") else text
