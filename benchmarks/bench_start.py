"""Time to answer: `groundstation --help` in a new process, beside the bare interpreter."""

import statistics
import subprocess
import sys
import time

REPEATS = 15


def median_seconds(command: list[str]) -> float:
    """Median wall time of a command, seconds, over REPEATS calls after one that fills the caches."""
    times = []
    for _ in range(REPEATS + 1):
        started = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - started)
    return statistics.median(times[1:])


def main() -> None:
    """Print both times and their ratio."""
    bare = median_seconds([sys.executable, "-c", "pass"])
    ours = median_seconds([sys.executable, "-m", "groundstation", "--help"])
    print(
        f"start   python -c pass {bare * 1e3:6.1f} ms   groundstation --help {ours * 1e3:6.1f} ms   {ours / bare:.1f} x"
    )


if __name__ == "__main__":
    main()
