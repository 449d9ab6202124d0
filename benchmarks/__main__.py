"""Parts of the benchmarks by name: ``python -m benchmarks ulog store``; all of them without a name.

A part whose peer is not installed is recorded as not measured. Each part writes build/bench/<part>.json.
"""

import importlib
import subprocess
import sys
from pathlib import Path

from benchmarks.record import Book

# LONG: minutes to an hour each, by name alone.
LONG = ("fleet", "fleet_store", "cooperative_smoother", "process")


def parts() -> list[str]:
    """Return the names of all parts."""
    return sorted(path.stem.removeprefix("bench_") for path in Path(__file__).parent.glob("bench_*.py"))


def run(part: str) -> None:
    """Run a part in this process."""
    try:
        module = importlib.import_module(f"benchmarks.bench_{part}")
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] in ("benchmarks", "groundstation"):
            raise
        with Book(part) as book:
            book.not_measured("every figure", f"{error.name} is not installed")
        return
    sys.argv = [part]
    module.main()


def main() -> int:
    """Run parts, each in a process of its own; return 1 where one failed."""
    names = sys.argv[1:]
    unknown = [name for name in names if name not in parts()]
    if unknown:
        print(f"error: no part {unknown[0]}, expected {', '.join(parts())}", file=sys.stderr)
        return 2
    if len(names) == 1:
        run(names[0])
        return 0
    wanted = names or [name for name in parts() if name not in LONG]
    codes = [subprocess.run([sys.executable, "-m", "benchmarks", name], check=False).returncode for name in wanted]
    failed = [name for name, code in zip(wanted, codes, strict=True) if code]
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
