"""Figures of the benchmarks over commits, docs/evidence/benchmarks_trend.jsonl.

``python -m benchmarks.trend build/bench/*.json`` adds a line for each part; ``python -m benchmarks.trend`` prints, for
each figure, the last runs and how the newest compares with the one before. Ratios to a peer travel between machines;
seconds and megabytes are compared on one machine alone.
"""

import argparse
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.record import Record, number, read
from benchmarks.table import EVIDENCE

TREND = EVIDENCE / "benchmarks_trend.jsonl"
RUNS = 5  # shown of each figure


def lines_of(records: Iterable[Record]) -> list[str]:
    """Return a line of JSON for each part: commit, date, machine, and its figures by name."""
    parts: dict[str, dict[str, Any]] = {}
    for record in records:
        figure = record.ours if record.ratio is None else record.ratio
        if figure is None:
            continue
        facts = {"commit": record.commit, "date": record.date, "machine": str(record.machine)}
        part = parts.setdefault(record.part, {"part": record.part, **facts, "figures": {}})
        part["figures"][_name(record)] = figure
    return [json.dumps(part, ensure_ascii=False) for part in parts.values()]


def _name(record: Record) -> str:
    if record.ratio is None:
        return f"{record.what}, {record.unit}"
    return f"{record.what}, {'times' if record.is_times else 'of'} {record.peer_name}"


def told(runs: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a line for each figure: its last runs, oldest first, and the newest over the one before."""
    seen: dict[tuple[str, str, str], list[tuple[str, float]]] = {}
    for run in runs:
        for name, figure in run["figures"].items():
            is_ratio = name.rpartition(", ")[2].startswith(("times ", "of "))
            key = run["part"], name, "" if is_ratio else run["machine"]
            seen.setdefault(key, []).append((run["commit"], figure))
    found = []
    for (part, name, machine), several in seen.items():
        shown = "  ".join(f"{commit} {number(figure)}" for commit, figure in several[-RUNS:])
        before = several[-2][1] if len(several) > 1 else 0.0
        change = f"; {100.0 * (several[-1][1] / before - 1.0):+.0f} %" if before else ""
        found.append(f"{part}: {name}{f' ({machine})' if machine else ''}: {shown}{change}")
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Add records, or print the trend."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, help="JSON of make bench, to be added")
    given = parser.parse_args(arguments)
    if given.files:
        with TREND.open("a", encoding="utf-8") as stream:
            stream.writelines(f"{line}\n" for line in lines_of(one for path in given.files for one in read(path)))
        return
    text = TREND.read_text(encoding="utf-8") if TREND.exists() else ""
    print("\n".join(told([json.loads(line) for line in text.splitlines()])) or "no run was added yet")


if __name__ == "__main__":
    main()
