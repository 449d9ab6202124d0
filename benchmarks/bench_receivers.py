"""Streams of receivers against pyubx2 and pynmeagps, which give one object a message; tables of everything from ours.

Seconds are by the clock, best of several rounds in which ours and the peer take turns: other programs slow both.
"""

import logging
import time
from collections.abc import Callable
from pathlib import Path

from recorded import LOGS, are_here

from groundstation.base.records import RecordBatch
from groundstation.readers.receiver import read
from groundstation.readers.source import Source

STREAMS = ("walk_0827_gnss_1730.ubx", "pygpsdata_testobsdata.log", "inertialsense_Serial38400.nmea")
ROUNDS = 3
WANTED = 50


def by_peers(path: Path) -> int:
    """Every message and sentence as an object; fields are parsed as it is made."""
    from pyubx2 import UBXReader

    with path.open("rb") as stream:
        return sum(1 for _raw, parsed in UBXReader(stream, protfilter=7, quitonerror=0) if parsed is not None)


def by_groundstation(path: Path) -> int:
    """Every field of every message and sentence as columns, raw and canonical; rows of them."""
    return sum(len(item) for item in read(Source(path)) if isinstance(item, RecordBatch))


def seconds_of(work: Callable[[Path], int], path: Path) -> float:
    """Wall seconds of one run."""
    started = time.perf_counter()
    work(path)
    return time.perf_counter() - started


def main() -> None:
    """Print speeds and their ratios."""
    logging.disable(logging.CRITICAL)  # complaints of the peers
    for name in STREAMS:
        path = LOGS / "gnss" / name
        if not are_here(path):
            continue
        by_groundstation(path)  # compiles
        best = {by_peers: float("inf"), by_groundstation: float("inf")}
        for _round in range(ROUNDS):
            for work in best:
                for _again in range(1 if work is by_peers else 5):
                    best[work] = min(best[work], seconds_of(work, path))
        size_mb = path.stat().st_size / 1e6
        theirs, ours = best[by_peers], best[by_groundstation]
        print(
            f"{name}: {size_mb:.1f} MB; peers {size_mb / theirs:.2f} MB/s, groundstation {size_mb / ours:.1f} MB/s: "
            f"{theirs / ours:.0f} times as fast, {WANTED} wanted"
        )


if __name__ == "__main__":
    main()
