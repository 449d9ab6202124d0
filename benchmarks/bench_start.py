"""Time to answer: `groundstation --help` in a new process, beside the bare interpreter."""

import subprocess
import sys

from benchmarks.record import Book, Goal, by_turns

ROUNDS = 15
GOAL_MS = 300.0


def main() -> None:
    """Measure both, and record."""
    works = {
        "bare": lambda: subprocess.run([sys.executable, "-c", "pass"], check=True),
        "ours": lambda: subprocess.run(
            [sys.executable, "-m", "groundstation", "--help"], check=True, capture_output=True
        ),
    }
    with Book("start") as book:
        times = by_turns(works, ROUNDS)
        book.against("--help in a new process", times["ours"], times["bare"], "bare interpreter")
        clock_ms = [1e3 * one for one in times["ours"].clock_s]
        book.figure("--help by the clock", clock_ms, "ms", goal=Goal(GOAL_MS))


if __name__ == "__main__":
    main()
