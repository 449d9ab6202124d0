"""The table of docs/evidence/benchmarks.md, from the JSON of `make bench`.

``python -m benchmarks.table build/bench/*.json`` puts these records into docs/evidence/benchmarks.json, in place of
the earlier ones of their parts, and writes the table of the page from it. ``--print`` writes nothing and prints the
table of these records alone.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from benchmarks.record import Record, as_json, goal_told, number, peer_told, ratio_told, read
from groundstation.chapters.markdown import escaped, table
from groundstation.pipeline.verbs.provenance import CHECKOUT

EVIDENCE = CHECKOUT / "docs" / "evidence"
PAGE, KEPT = EVIDENCE / "benchmarks.md", EVIDENCE / "benchmarks.json"
BEGIN, END = "<!-- written by python -m benchmarks.table -->", "<!-- end of what it writes -->"
HEADS = ("part", "figure", "ours", "peer", "ratio (interval)", "goal", "remark")
LOADED = 0.3  # cores: seconds are then not those of a quiet machine


def merged(earlier: Sequence[Record], later: Sequence[Record]) -> list[Record]:
    """Return the records by part, a part measured later in place of the earlier."""
    again = {record.part for record in later}
    kept = [*(record for record in earlier if record.part not in again), *later]
    return sorted(kept, key=lambda record: record.part)


def table_of(records: Sequence[Record]) -> str:
    """Return the table of records and, below it, where and when each part was measured."""
    rows = [[escaped(cell) for cell in _cells(record)] for record in records]
    return f"{table(HEADS, rows)}\n\n{provenance(records)}"


def _cells(record: Record) -> Sequence[str]:
    ours = f"{number(record.ours)} {record.unit}".strip() if record.ours is not None else ""
    if record.ratio is None and record.low is not None and record.high != record.low:
        ours += f" ({number(record.low)} to {number(record.high)})"
    peer = f"{peer_told(record)}: {number(record.peer)} {record.unit}" if record.peer is not None else peer_told(record)
    return record.part, record.what, ours, peer.strip(), ratio_told(record), goal_told(record), record.note


def provenance(records: Sequence[Record]) -> str:
    """Return lines of commit, date, machine and load; parts measured together share one."""
    parts: dict[tuple[str, str, str], dict[str, list[float]]] = {}
    for record in records:
        key = record.commit, record.date, str(record.machine)
        loads = parts.setdefault(key, {}).setdefault(record.part, [])
        loads += [] if record.others is None else [record.others]
    return "\n".join(_line(key, loads) for key, loads in parts.items())


def _line(key: tuple[str, str, str], loads: dict[str, list[float]]) -> str:
    commit, date, machine = key
    most = max((load for several in loads.values() for load in several), default=0.0)
    load = f"; other processes used up to {most:g} cores: read the ratios alone" if most > LOADED else ""
    return escaped(f"{', '.join(loads)}: commit {commit or 'unknown'}, {date}, {machine}{load}.").join(("- ", ""))


def page_with(page: str, records: Sequence[Record]) -> str:
    """Return the page with the table of the records between its marks."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{table_of(records)}\n\n{END}{after}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write or print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, help="JSON of make bench")
    parser.add_argument("--print", action="store_true", dest="is_printed", help="print, write nothing")
    given = parser.parse_args(arguments)
    records = [record for path in given.files for record in read(path)]
    if given.is_printed:
        print(table_of(records))
        return
    kept = merged(read(KEPT) if KEPT.exists() else [], records)
    KEPT.write_text(as_json(kept), encoding="utf-8")
    PAGE.write_text(page_with(PAGE.read_text(encoding="utf-8"), kept), encoding="utf-8")


if __name__ == "__main__":
    main()
