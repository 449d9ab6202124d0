"""Losses that nothing tells: ``python -m tests.fuzz.silent [N [FIRST [FORMAT ...]]]``.

A record of a sound log whose own bytes stand together in the mutated file must be given, or the file must be told to
have lost data (exit code 3) or be refused (1). The definitions may be damaged: then the records cannot be read, but
that must be told. Canonical values count as well: a column whose name is damaged loses them and no row.
"""

import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Damage, RecordBatch
from groundstation.base.signals import is_canonical
from tests.fuzz.bases import bases
from tests.fuzz.mutation import Mutant
from tests.fuzz.recovery import READERS, Expected, expected_of
from tests.fuzz.trial import Case, edits_of, suffix_of

FIRST = 60_000_000


@dataclass(frozen=True)
class Silent:
    """A mutated log with a loss that nothing tells: its seed, what is gone, and the edits."""

    seed: int
    records: int
    values: dict[str, int]
    edits: str


@dataclass
class Tally:
    """What became of the mutated logs of a format."""

    files: int = 0
    refused: int = 0
    told: int = 0
    whole: int = 0
    silent: int = 0
    records_silent: int = 0


def values_of(path: Path) -> tuple[Counter[str], bool]:
    """Canonical values by field, and whether the log is said to have lost data."""
    from groundstation.pipeline.one_flight.log import open_log

    counted: Counter[str] = Counter()
    tells = False
    for item in open_log(path).items():
        if isinstance(item, Damage):
            tells |= item.loses_data
        elif isinstance(item, RecordBatch) and is_canonical(item.topic):
            for name, column in item.columns.items():
                counted[f"{item.topic}.{name}"] += int(np.count_nonzero(column.mask))
    return counted, tells


def untouched(expected: Expected, mutant: Mutant) -> Counter:
    """Keys of the records that are whole, whatever became of their definitions."""
    kept = mutant.kept(expected.starts, expected.ends)
    return Counter(key for key, is_kept in zip(expected.keys, kept, strict=True) if is_kept)


def silent_losses(format_name: str, cases: int, first: int, tally: Tally) -> Iterator[Silent]:
    """Mutate sound logs and yield those with a loss that is not told."""
    known = {base.name: expected_of(base) for base in bases(format_name) if not base.is_harmful}
    give = READERS[format_name]["groundstation"]
    sound: dict[str, Counter[str]] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"log{suffix_of(format_name)}"
        for base in bases(format_name):
            path.write_bytes(base.data)
            sound[base.name] = values_of(path)[0]
        seed = first
        while tally.files < cases:
            base, other, edits = edits_of(Case(format_name, seed))
            seed, expected = seed + 1, known.get(base.name)
            if expected is None:
                continue
            mutant = Mutant(base.data, other.data, edits)
            path.write_bytes(mutant.content)
            tally.files += 1
            found: Counter = Counter()
            try:
                values, tells = values_of(path)
                give(path, found)
            except GroundstationError:
                tally.refused += 1
                continue
            kept = untouched(expected, mutant)
            missing = (kept - found).total()
            touched = len(expected.keys) - kept.total()
            gone = {
                name: count - values[name]
                for name, count in sound[base.name].items()
                if count - values[name] > touched  # each touched record may cost a value of each field
            }
            if tells:
                tally.told += 1
            elif missing or gone:
                tally.silent += 1
                tally.records_silent += missing
                yield Silent(seed - 1, missing, gone, repr(edits)[:200])
            else:
                tally.whole += 1


def main() -> int:
    """Print what was found, and a table; 1 where there was any loss in silence."""
    silent = 0
    cases, first = (int(text) for text in (*sys.argv[1:3], *("200", str(FIRST))[len(sys.argv[1:3]) :]))
    for format_name in sys.argv[3:] or READERS:
        tally = Tally()
        for one in silent_losses(format_name, cases, first, tally):
            print("  ", format_name, one, flush=True)
            silent += 1
        print(
            f"| {format_name} | {tally.files} | {tally.whole} | {tally.told} | {tally.refused} | {tally.silent} |",
            flush=True,
        )
    return 1 if silent else 0


if __name__ == "__main__":
    sys.exit(main())
