"""Index of an OUT: every flight and session in it, and the logs that gave none.

It is written as index.json and index.csv.
"""

from collections.abc import Sequence
from pathlib import Path

from groundstation.estimators.analyses import ANSWER_TYPES
from groundstation.pipeline.many_flights.fleet.columns import INDEXED, answer_values
from groundstation.pipeline.many_flights.fleet.scan import FLIGHTS, MOST_LISTED, Scan, scan
from groundstation.pipeline.many_flights.fleet.table import index_rows_of
from groundstation.pipeline.many_flights.inputs import OUT_FOLDER_MARK, flight_folders, session_folders
from groundstation.pipeline.one_flight.outcome import Outcome, State, reason_of
from groundstation.reports.index import IndexRow, Kind

MOST_SKIPPED = 1000  # files that the index lists


def write_index_of(
    out: Path, outcomes: Sequence[Outcome], kept_rows: Sequence[IndexRow] = (), found: Scan | None = None
) -> tuple[Outcome, ...]:
    """Write index.json and index.csv of a folder of flights.

    They list every flight and session in ``out``, and the logs of this run that gave none.

    Of more than 20 000 flights they say where the rows are. Returns what could not be listed: folders that cannot be
    read, an index that cannot be written.
    """
    from groundstation.reports.index import failed_row, index_row, write_index
    from groundstation.results.files import load

    found = scan(out) if found is None else found
    is_large = len(found) > MOST_LISTED
    problems: list[Outcome] = []
    rows = [*kept_rows, *([] if is_large else index_rows_of(found.table(["index"])))]
    unread = [out / name for name in found.stale]
    listed: tuple[tuple[Kind, list[Path]], ...] = (("flight", unread), ("session", found.sessions))
    for kind, folder in ((kind, folder) for kind, folders in listed for folder in folders):
        if is_large and kind == "flight" and len(unread) > MOST_LISTED:
            continue
        try:
            saved = load(folder, ANSWER_TYPES)
            rows.append(index_row(saved, kind, answer_values(saved.results)))
        except Exception as error:
            problems.append(outcome_beside(folder, "failed", *reason_of(folder.name, error)))
    logs = [one for one in outcomes if not one.is_beside]
    without_flight = [one for one in logs if not one.flight_id and not (one.is_session and one.state == "skipped")]
    rows += [failed_row(one.source, one.state, one.text) for one in (*_listed(without_flight), *problems)]
    try:
        write_index(out, rows, INDEXED, elsewhere=f"{len(found)} flights: {FLIGHTS}/" if is_large else "")
    except OSError as error:
        problems.append(
            outcome_beside(out, "failed", f"{out}: the index cannot be written ({error.strerror or error})")
        )
    return tuple(problems)


def _listed(without_flight: Sequence[Outcome]) -> list[Outcome]:
    """Logs without a flight as the index lists them.

    Very many skipped files are cut: the rest is one row.
    """
    skipped = [one for one in without_flight if one.state == "skipped"]
    rest = skipped[MOST_SKIPPED:]
    if not rest:
        return list(without_flight)
    others = [one for one in without_flight if one.state != "skipped"]
    told = Outcome(f"{len(rest)} more files", "skipped", f"skipped as these {MOST_SKIPPED}, and not listed")
    return [*others, *skipped[:MOST_SKIPPED], told]


def rows_without_flight(out: Path) -> list[IndexRow]:
    """Rows of the logs that gave no flight, from the index as it stands.

    Nothing else remembers them.
    """
    import json

    from groundstation.base.serial import MismatchError, from_json

    try:
        listed = json.loads((out / OUT_FOLDER_MARK).read_text(encoding="utf-8"))["rows"]
        rows = [from_json(IndexRow, row) for row in listed]
    except (OSError, ValueError, KeyError, TypeError, MismatchError):
        return []
    folders = {str(folder) for folder in (*flight_folders(out), *session_folders(out))}
    return [row for row in rows if row.kind in ("failed", "skipped") and row.source not in folders]


def outcome_beside(place: Path, state: State, text: str, trace: str = "") -> Outcome:
    """Outcome of something beside the flights, or of a flight folder that was there before."""
    return Outcome(str(place), state, text, trace=trace, is_beside=True)
