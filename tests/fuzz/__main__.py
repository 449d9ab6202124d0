"""Fuzz every reader and the store: ``python -m tests.fuzz [--cases N] [--first SEED] [--seconds S] [FORMAT ...]``.

Prints one line for each format and one for each fault; ends with 1 when there was any. What is found is added to
``corpus/found.jsonl`` by hand, with a name of what it was, and is replayed by the tests from then on.
"""

import argparse
import json
import os
import sys
import time
from collections import Counter

from tests.fuzz.bases import FORMATS
from tests.fuzz.pool import run_all
from tests.fuzz.trial import Case, edits_of

DEFAULT_SECONDS = 180.0  # of `make fuzz` for all formats together
BAD = ("crash", "escape", "hang", "death")


def fuzz(format_name: str, first: int, cases: int | None, seconds: float | None) -> int:
    """Run one format; returns the number of faults."""
    began, counts, faults = time.monotonic(), Counter[str](), 0
    slowest, most_mb, done = 0.0, 0.0, 0
    seeds = range(first, first + (cases if cases is not None else 10**9))
    for case, found in run_all(Case(format_name, seed) for seed in seeds):
        counts[found["came_to"]] += 1
        done += 1
        slowest, most_mb = max(slowest, found["seconds"]), max(most_mb, found["growth_mb"])
        if found["came_to"] in BAD:
            faults += 1
            report(case, found)
        if seconds is not None and time.monotonic() - began > seconds:
            break
    spent = time.monotonic() - began
    told = ", ".join(f"{name} {count}" for name, count in sorted(counts.items()))
    print(
        f"{format_name:12} {done:6} logs in {spent:5.0f} s: {told}; slowest {slowest:.2f} s, "
        f"largest growth of memory {most_mb:.0f} MB; {faults} faults",
        flush=True,
    )
    return faults


def report(case: Case, found: dict) -> None:
    """Print a fault and the corpus entry that repeats it."""
    base, other, edits = edits_of(case)
    entry = {"base": base.name, "other": other.name, "edits": edits, "was": found["fault"].strip().splitlines()[-1:]}
    print(f"--- {case.format} seed {case.seed}: {found['came_to']}\n{found['fault']}", flush=True)
    print(json.dumps(entry), flush=True)


def main() -> int:
    """Read the command line; FUZZ in the environment is the number of logs of each format."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("formats", nargs="*", default=[], choices=[*FORMATS, []], metavar="FORMAT")
    parser.add_argument("--cases", type=int, default=int(os.environ["FUZZ"]) if os.environ.get("FUZZ") else None)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=None)
    options = parser.parse_args()
    formats = options.formats or FORMATS
    seconds = options.seconds
    if options.cases is None and seconds is None:
        seconds = DEFAULT_SECONDS / len(formats)
    faults = sum(fuzz(name, options.first, options.cases, seconds) for name in formats)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
