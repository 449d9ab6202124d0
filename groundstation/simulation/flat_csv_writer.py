"""Flat CSV: all topics of a flight on one time column, each at its own rate.

It is byte for byte reproducible.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from groundstation.base.records import Column, Int64Array
from groundstation.base.signals import TOPICS, kind_of
from groundstation.simulation.faults import all_rows
from groundstation.tables.table import Flight, Table

BLOCK_ROWS = 65_536
NS_DIGITS = 9
DEFAULT_DECIMALS = {
    "deg": 7,
    "m": 3,
    "mps": 4,
    "dps": 4,
    "mps2": 4,
    "nt": 1,
    "a": 3,
    "s": 9,
    "m2": 3,
    "dots": 4,
    "mhz": 3,
    "dbhz": 1,
    "": 2,
}


def write_flat_csv(
    path: str | Path,
    flight: Flight,
    *,
    resolution: Mapping[str, float] | None = None,
    delimiter: str = ",",
    encoding: str = "utf-8",
    with_truth: bool = False,
    cut_bytes: int = 0,
) -> None:
    """Write a flight as flat CSV: ``# key: value`` lines, one header, a row per record.

    The rows are numbered by ``record_index``. Time is ``time_s``, the recorder's own (``device_time_ns``), printed
    exactly from the integer. A missing sample is an empty cell; NaN that the device wrote is ``nan``; flags are 0 and
    1.

    Parameters
    ----------
    flight : Flight
        Every row needs a device time.
    resolution : mapping of ``<topic>.<field>`` to float, optional
        Steps of the fields, which set their decimals; without one the decimals of the unit's default.
    with_truth : bool
        True to write ``truth.*``.
    cut_bytes : int
        Bytes missing at the end, as after a loss of power.
    """
    path = Path(path)
    tables = [flight[topic] for topic in _in_canonical_order(flight) if with_truth or kind_of(topic) != "truth"]
    rows = all_rows(flight, [table.topic for table in tables])
    time_ns = np.zeros(len(rows), dtype=np.int64)
    for table in tables:
        time_ns[np.searchsorted(rows, table.record_index)] = table.device_time_ns.values
    time_decimals = _decimals_of_times(time_ns)
    with path.open("wb") as file:
        for key, value in flight.metadata.items():
            file.write(f"# {key}: {value}\n".encode(encoding))
        names = [f"{table.topic}.{name}" for table in tables for name in _ordered_fields(table)]
        file.write((delimiter.join(["time_s", *names]) + "\n").encode(encoding))
        for start in range(0, len(rows), BLOCK_ROWS):
            block = rows[start : start + BLOCK_ROWS]
            cells = [_time_cells(time_ns[start : start + BLOCK_ROWS], time_decimals)]
            for table in tables:
                cells += _topic_cells(table, block, resolution or {}, delimiter)
            _write_block(file, cells, delimiter, encoding)
        if cut_bytes:
            file.truncate(max(file.tell() - cut_bytes, 0))


def _in_canonical_order(flight: Flight) -> list[str]:
    order = {kind: place for place, kind in enumerate(TOPICS)}
    return sorted(flight.topics(), key=lambda topic: (order.get(kind_of(topic), len(order)), topic))


def _ordered_fields(table: Table) -> list[str]:
    canonical = [item.name for item in TOPICS.get(kind_of(table.topic), ())]
    known = [name for name in canonical if name in table]
    return known + [name for name in table.columns if name not in canonical]


def _decimals_of_times(time_ns: Int64Array) -> int:
    """Fewest decimals that print every time exactly, at least one."""
    digits = NS_DIGITS
    while digits > 1 and not np.any(time_ns % 10 ** (NS_DIGITS - digits + 1)):
        digits -= 1
    return digits


def decimals_of(resolution: float) -> int:
    """Return the decimals that print a multiple of the resolution.

    Exactly where it is a power of ten, else to a thousandth of it.

    Examples
    --------
    >>> decimals_of(0.001), decimals_of(1.0), decimals_of(0.05), decimals_of(360 / 65536)
    (3, 0, 2, 6)
    """
    for digits in range(13):
        scaled = resolution * 10**digits
        if scaled >= 1.0 - 1e-9 and abs(scaled - round(scaled)) < 1e-9:
            return digits
    return max(math.ceil(-math.log10(resolution)), 0) + 3


def _topic_cells(table: Table, block: Int64Array, resolution: Mapping[str, float], delimiter: str) -> list[Any]:
    """Return the cells of all fields of a topic for a block of log rows.

    They are pyarrow text arrays without nulls.
    """
    first, last = np.searchsorted(table.record_index, [block[0], block[-1] + 1])
    place = np.searchsorted(block, table.record_index[first:last])
    units = {item.name: item.unit for item in TOPICS.get(kind_of(table.topic), ())}
    cells = []
    for name in _ordered_fields(table):
        step = resolution.get(f"{table.topic}.{name}")
        decimals = decimals_of(step) if step else DEFAULT_DECIMALS.get(units.get(name, ""), 6)
        column = table.columns[name].take(slice(first, last))
        cells.append(_spread(_value_cells(column, decimals, delimiter), place, len(block)))
    return cells


def _value_cells(column: Column, decimals: int, delimiter: str) -> Any:
    import pyarrow as pa
    import pyarrow.compute as pc

    values = column.values
    if values.dtype.kind == "b":
        cells = pc.cast(pa.array(values.astype(np.int8)), pa.string())
    elif values.dtype.kind == "U":
        codes = pa.array(values, pa.string()).dictionary_encode()  # few different texts, many rows
        cells = pa.array([_quoted(text, delimiter) for text in codes.dictionary.to_pylist()], pa.string())
        cells = cells.take(codes.indices)
    else:
        numbers = values.astype(np.float64)
        finite = np.isfinite(numbers)
        scaled = np.rint(np.where(finite, numbers, 0.0) * 10.0**decimals).astype(np.int64)
        cells = pc.if_else(pa.array(finite), _fixed_point(scaled, decimals), pa.scalar("nan"))
    return cells if column.present is None else pc.if_else(pa.array(column.present), cells, pa.scalar(""))


def _quoted(text: str, delimiter: str) -> str:
    if any(mark in text for mark in (delimiter, '"', "\n", "\r")):
        return '"' + text.replace('"', '""') + '"'
    return text


def _fixed_point(scaled: Int64Array, decimals: int) -> Any:
    """Text of scaled / 10^decimals from integers alone: -1234 with 3 decimals is -1.234."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if decimals == 0:
        return pc.cast(pa.array(scaled), pa.string())
    whole, fraction = np.divmod(np.abs(scaled), 10**decimals)
    tail = pc.utf8_lpad(pc.cast(pa.array(fraction), pa.string()), decimals, "0")
    head = pc.cast(pa.array(whole), pa.string())
    sign = pc.if_else(pa.array(scaled < 0), pa.scalar("-"), pa.scalar(""))
    return pc.binary_join_element_wise(pc.binary_join_element_wise(sign, head, ""), tail, ".")


def _time_cells(time_ns: Int64Array, decimals: int) -> Any:
    return _fixed_point(time_ns // 10 ** (NS_DIGITS - decimals), decimals)


def _spread(cells: Any, place: Int64Array, length: int) -> Any:
    """Put cells at their rows of the block, the rest empty."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if len(cells) == length:
        return cells
    index = np.zeros(length, dtype=np.int64)
    present = np.zeros(length, dtype=bool)
    index[place], present[place] = np.arange(len(cells)), True
    taken = cells.take(pa.array(index, mask=~present))
    return pc.fill_null(taken, "")


def _write_block(file: IO[bytes], cells: list[Any], delimiter: str, encoding: str) -> None:
    import pyarrow.compute as pc

    lines = pc.binary_join_element_wise(*cells, delimiter)
    text = "\n".join(lines.to_pylist()) + "\n"
    file.write(text.encode(encoding))
