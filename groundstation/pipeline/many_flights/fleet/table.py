"""Arrow table of what the flights add to the fleet, and what is read back from it."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.serial import from_json, to_json_exactly
from groundstation.methods.fleet.density import SampleHistogram
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS, TEXTS, FlightShare, dataset_schema
from groundstation.reports.index import IndexRow
from groundstation.results.columns import READ_BY_FLEETS, FlightColumn
from groundstation.results.figures import FigureData
from groundstation.results.files import parquet_bytes, utf8_text
from groundstation.results.fleet_units import UnitOfFlight
from groundstation.results.installations import Lesson

MOST_WIDE_CHARACTERS = 10_000_000  # of a column of texts as wide as its longest; beyond it each is an object


def to_arrow(shares: Sequence[FlightShare]) -> Any:
    """Put shares into a table of Arrow; its metadata ``columns`` tells the meanings."""
    import pyarrow as pa

    schema = dataset_schema()
    arrays = {column.name: _arrow(column, [share.row[column.name] for share in shares]) for column in FLIGHT_COLUMNS}
    arrays["index"] = pa.array([_json(to_json_exactly(share.index)) for share in shares], pa.string())
    arrays["shipped"] = pa.array([utf8_text(share.shipped) for share in shares], pa.string())
    for name in ("skill", "checks", "units"):
        rows = [list(map(_finite, getattr(share, name))) for share in shares]
        arrays[name] = pa.array(rows, schema.field(name).type)
    for name, part in (("sample_cell", "cell"), ("sample_count", "count")):
        counts = [getattr(share.histogram, part) for share in shares]
        arrays[name] = pa.array(counts, schema.field(name).type)
    lessons = ["" if share.lesson is None else _json(to_json_exactly(share.lesson)) for share in shares]
    arrays["lesson"] = pa.array(lessons, pa.string())
    return pa.table(arrays, schema=schema)


def flights_of(table: Any) -> FigureData:
    """The table of flights in a table of shares.

    Columns that statistics and pages read are there, empty, even where no system gives them.
    """
    columns = {column.name: _numpy(column, table.column(column.name)) for column in FLIGHT_COLUMNS}
    for name, kind in READ_BY_FLEETS.items():
        if name not in columns:
            columns[name] = np.full(len(table), "") if kind in TEXTS else np.full(len(table), math.nan)
    return FigureData("flights", columns, {})


def index_rows_of(table: Any) -> list[IndexRow]:
    """The rows of the index in a table of shares."""
    return [from_json(IndexRow, json.loads(text)) for text in table.column("index").to_pylist()]


def lessons_of(table: Any) -> Iterator[Lesson]:
    """Lessons in a table of shares, of the flights that state a serial."""
    yield from (from_json(Lesson, json.loads(text)) for text in table.column("lesson").to_pylist() if text)


def skill_rows_of(table: Any) -> tuple[NDArray[np.intp], dict[str, NDArray[Any]]]:
    """Skill of all flights in a table of shares: the row of the flight, and columns.

    ``is_within`` -1 is unknown.

    ``is_shipped`` says whether the method is the shipped one of its flight.
    """
    rows, parts = _flat(table.column("skill"))
    columns = {name: _values(array, -1 if name == "is_within" else math.nan) for name, array in parts.items()}
    shipped = np.array(table.column("shipped").to_pylist(), dtype=object)
    columns["is_shipped"] = (columns["method"] == shipped[rows]).astype(np.bool_)
    return rows, columns


def check_rows_of(table: Any) -> tuple[NDArray[np.intp], dict[str, NDArray[Any]]]:
    """The checks of all flights in a table of shares: the row of the flight, and columns."""
    rows, parts = _flat(table.column("checks"))
    return rows, {name: _values(array, math.nan) for name, array in parts.items()}


def units_of(table: Any) -> Iterator[list[UnitOfFlight]]:
    """Units of each flight in a table of shares."""
    for rows in table.column("units").to_pylist():
        yield [UnitOfFlight(**{name: value for name, value in row.items() if value is not None}) for row in rows or ()]


def _flat(column: Any) -> tuple[NDArray[np.intp], dict[str, Any]]:
    """Lists of rows as columns, and the list that each is from."""
    from groundstation.base import arrow_values as arrow

    whole = column.combine_chunks()
    parts = whole.flatten()
    counts = np.diff(arrow.column(whole.offsets))
    names = [field.name for field in parts.type]
    return np.repeat(np.arange(len(whole)), counts), dict(zip(names, parts.flatten(), strict=True))


def _values(array: Any, missing: float) -> NDArray[Any]:
    """Values of Arrow; ``missing`` stands for a number or a flag that is not there."""
    import pyarrow as pa

    from groundstation.base import arrow_values as arrow

    if pa.types.is_string(array.type):
        return np.array(array.to_pylist(), dtype=object)
    if pa.types.is_boolean(array.type):
        return arrow.column(array.cast(pa.int8()).fill_null(int(np.nan_to_num(missing))))
    if pa.types.is_floating(array.type):
        array = array.fill_null(missing)
    return arrow.column(array)


def histograms_of(table: Any) -> Iterator[SampleHistogram]:
    """The histogram of the used samples of each flight in a table of shares."""
    yield from map(SampleHistogram, *(_lists(table.column(name)) for name in ("sample_cell", "sample_count")))


def fleet_parquet(table: Any) -> bytes:
    """Encode the flights of a table of shares.

    Times are in UTC, categories have dictionaries, what is missing is null.

    The schema's metadata has ``columns``, JSON of every column's meaning.
    """
    meanings = json.dumps({column.name: column.meaning for column in FLIGHT_COLUMNS})
    flights = table.select([column.name for column in FLIGHT_COLUMNS])
    return parquet_bytes(flights.replace_schema_metadata({"columns": meanings}))


def _finite(row: Any) -> dict[str, Any]:
    """The fields of a row without those that are NaN, which are missing."""
    found = {name: value for name, value in asdict(row).items() if value == value}
    return {name: utf8_text(value) if isinstance(value, str) else value for name, value in found.items()}


def _json(document: Any) -> str:
    return utf8_text(json.dumps(document, ensure_ascii=False, separators=(",", ":")))


def _arrow(column: FlightColumn, values: list[Any]) -> Any:
    import pyarrow as pa

    if column.kind == "time":
        return pa.array(values, pa.int64()).cast(pa.timestamp("ns", tz="UTC"))
    if column.kind in TEXTS:
        found = pa.array([text or None for text in values], pa.string())
        return found.dictionary_encode() if column.kind == "category" else found
    if column.kind == "count":
        return pa.array([None if value != value else int(value) for value in values], pa.int64())
    if column.kind == "flag":
        return pa.array(list(map(bool, values)), pa.bool_())
    return pa.array(values, pa.float64(), from_pandas=True)


def _numpy(column: FlightColumn, array: Any) -> NDArray[Any]:
    import pyarrow as pa

    from groundstation.base import arrow_values as arrow

    if column.kind == "time":
        missing = np.iinfo(np.int64).min  # NaT
        return arrow.column(array.cast(pa.int64()).fill_null(missing)).view("datetime64[ns]")
    if column.kind in TEXTS:
        texts = array.cast(pa.string()).fill_null("").to_pylist()
        is_wide = len(texts) * max(map(len, texts), default=0) > MOST_WIDE_CHARACTERS
        return np.array(texts, dtype=object if is_wide else np.str_)
    if column.kind == "flag":
        return arrow.column(array).astype(np.bool_)
    return arrow.column(array.cast(pa.float64()).fill_null(math.nan))


def _lists(array: Any) -> list[NDArray[np.int32]]:
    from groundstation.base import arrow_values as arrow

    whole = array.combine_chunks()
    if len(whole) == 0:
        return []
    offsets, values = arrow.column(whole.offsets), arrow.column(whole.values)
    return [values[start:end] for start, end in pairwise(offsets.tolist())]
