"""Streams of receivers against pyubx2 and pynmeagps: one object a message there, tables of everything here."""

import logging
from functools import partial
from pathlib import Path

from benchmarks.record import ROUNDS, Book, Goal, by_turns
from benchmarks.recorded import LOGS, are_here
from groundstation.base.records import RecordBatch
from groundstation.readers.receiver import read
from groundstation.readers.source import Source

STREAMS = ("walk_0827_gnss_1730.ubx", "pygpsdata_testobsdata.log", "inertialsense_Serial38400.nmea")
GOAL = Goal(50.0, "at least")
REPEATS = 5  # of ours in a round


def by_peers(path: Path) -> int:
    """Every message and sentence as an object; fields are parsed as it is made."""
    from pyubx2 import UBXReader

    with path.open("rb") as stream:
        return sum(1 for _raw, parsed in UBXReader(stream, protfilter=7, quitonerror=0) if parsed is not None)


def by_groundstation(path: Path) -> int:
    """Every field of every message and sentence as columns, raw and canonical; rows of them."""
    return sum(len(item) for item in read(Source(path)) if isinstance(item, RecordBatch))


def main() -> None:
    """Record the ratios."""
    logging.disable(logging.CRITICAL)  # complaints of the peers
    with Book("receivers") as book:
        if not book.has("pyubx2", "pynmeagps"):
            return
        for name in STREAMS:
            path = LOGS / "gnss" / name
            if not are_here(path):
                book.not_measured(name, "no recorded log")
                continue
            works = {"ours": partial(by_groundstation, path), "peer": partial(by_peers, path)}
            times = by_turns(works, ROUNDS, {"ours": REPEATS})
            peer = "pynmeagps" if path.suffix == ".nmea" else "pyubx2"
            what = f"{path.suffix[1:]} stream of {path.stat().st_size / 1e6:.1f} MB to batches"
            book.against(what, times["ours"], times["peer"], peer, goal=GOAL, is_times=True)


if __name__ == "__main__":
    main()
