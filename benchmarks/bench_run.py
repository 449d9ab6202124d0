"""`run` on one hour at 100 Hz: wall time by stage, peak memory, and compile time apart; ``--pdf``: with PDFs."""

import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

COMMAND = [sys.executable, "-m", "groundstation"]
PDF = [one for one in sys.argv[1:] if one == "--pdf"]


def run_once(log: Path, out: Path, cache: Path) -> tuple[float, str]:
    """Wall seconds of one `run`, and what -v told of its stages."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    started = time.perf_counter()
    done = subprocess.run(
        [*COMMAND, "run", str(log), "-o", str(out), "-v", *PDF],
        check=True,
        capture_output=True,
        text=True,
        env=environment,
    )
    return time.perf_counter() - started, done.stderr


def main() -> None:
    """Print seconds with an empty and with a filled compile cache, stages, file sizes and peak memory."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        started = time.perf_counter()
        subprocess.run([*COMMAND, "simulate", "hour-100hz", "-o", str(root / "log")], check=True, capture_output=True)
        log = next((root / "log").glob("*.csv"))
        rows = sum(block.count(b"\n") for block in iter_blocks(log))
        simulated_s = time.perf_counter() - started
        print(f"log     {log.stat().st_size / 1e6:.1f} MB, {rows} rows, simulated in {simulated_s:.1f} s")
        cold, _ = run_once(log, root / "cold", root / "cache")
        warm, stages = run_once(log, root / "warm", root / "cache")
        peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
        print(f"run     {warm:.1f} s with compiled code cached; compiling adds {cold - warm:.1f} s once")
        print(f"stages  {'; '.join(re.findall(r'[a-z A-Z]+ [0-9.]+ s', stages))}")
        print(f"memory  {peak_mb:.0f} MB peak")
        for path in sorted((root / "warm").rglob("*")):
            if path.suffix in (".mcap", ".rrd", ".html"):
                print(f"file    {path.suffix[1:]:5} {path.stat().st_size / 1e6:7.1f} MB")


def iter_blocks(path: Path) -> "list[bytes]":
    """Bytes of a file in blocks."""
    with path.open("rb") as stream:
        return list(iter(lambda: stream.read(1 << 24), b""))


if __name__ == "__main__":
    main()
