"""Rows of a run's flights in a Delta table: ``run --store delta:PLACE``.

Several runs may write into one table.
"""

import hashlib
from collections.abc import Sequence
from typing import Any

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS
from groundstation.pipeline.many_flights.fleet.scan import Scan
from groundstation.pipeline.one_flight.outcome import Outcome

KIND = "delta:"
DIGEST = "row_sha256"
TRIES = 20  # of a commit that another writer comes before: each time one of them has written
MEANING = "of the row: a row already there with the same digest is not written again"


def delta_place(store: str) -> str:
    """Path or URL of the table that ``--store`` names.

    Raises
    ------
    UsageError
        When it names something else, or deltalake is not installed.
    """
    place = store.removeprefix(KIND)
    if not store.startswith(KIND) or not place:
        raise UsageError(f"--store {store}", "no such store", "delta:PATH or delta:URL")
    try:
        import deltalake  # noqa: F401
    except ImportError as error:
        raise UsageError(
            f"--store {store}", "no package deltalake", "", "pip install 'groundstation[delta]'"
        ) from error
    return place


def put_flights(store: str, found: Scan, outcomes: Sequence[Outcome]) -> tuple[Outcome, ...]:
    """Merge the rows of a run's flights into a Delta table by flight id.

    Returns what went wrong.

    A row that is there already, equal in all columns, is not written; the table is made when it is missing.

    Parameters
    ----------
    store : str
        ``delta:`` and a path or URL.
    found : Scan
        The flights of OUT.
    outcomes : sequence of Outcome
        Of the run: the flights in them are meant.
    """
    place = delta_place(store)
    wanted = {one.flight_id for one in outcomes if one.flight_id}
    try:
        rows = _rows(found, wanted)
        if len(rows):
            _merge(place, rows)
    except Exception as error:  # every store has errors of its own
        reason = str(error) if isinstance(error, GroundstationError) else f"{type(error).__name__}: {error}"
        return (Outcome(place, "failed", f"{place}: not written ({' '.join(reason.split())[:300]})", is_beside=True),)
    return ()


def _rows(found: Scan, flight_ids: set[str]) -> Any:
    """Rows of some flights as Delta takes them.

    Texts have no dictionaries, times are in microseconds.
    """
    import pyarrow as pa

    some = found.with_only(flight_ids)
    table = some.table([column.name for column in FLIGHT_COLUMNS])
    fields, arrays = [], []
    for column in FLIGHT_COLUMNS:
        values = table.column(column.name).combine_chunks()
        kind = pa.timestamp("us", tz="UTC") if column.kind == "time" else values.type
        kind = pa.string() if pa.types.is_dictionary(kind) else kind
        arrays.append(values.cast(kind, safe=False))
        fields.append(pa.field(column.name, kind, metadata={"comment": column.meaning}))
    lines = zip(*(array.to_pylist() for array in arrays), strict=True)
    arrays.append(pa.array([hashlib.sha256(repr(line).encode()).hexdigest() for line in lines], pa.string()))
    fields.append(pa.field(DIGEST, pa.string(), metadata={"comment": MEANING}))
    return pa.table(arrays, schema=pa.schema(fields))


def _merge(place: str, rows: Any) -> None:
    from deltalake import DeltaTable
    from deltalake.exceptions import CommitFailedError

    for left in reversed(range(TRIES)):
        try:  # the making of the table is a commit, too
            DeltaTable.create(place, rows.schema, mode="ignore", name="flights", description="one row per flight")
            (
                DeltaTable(place)
                .merge(rows, "kept.flight_id = new.flight_id", "new", "kept", merge_schema=True)
                .when_matched_update_all(f"kept.{DIGEST} IS DISTINCT FROM new.{DIGEST}")
                .when_not_matched_insert_all()
                .execute()
            )
        except CommitFailedError:
            if not left:
                raise
        else:
            return
