"""The reader of bags and telemetry against rosbags, mcap-ros2-support and pymavlink, in one run.

Both sides read every value of every message of a simulated robot: ours into columns (two passes, raw and canonical),
theirs into one object a message.
"""

import argparse
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.record import ROUNDS, Book, Goal, by_turns
from groundstation.base.records import RecordBatch
from groundstation.readers import registry
from groundstation.readers.bags.marks import METADATA
from tests.readers.bag_writer import small_flight, write_ros1, write_ros2
from tests.readers.telemetry_writer import telemetry

TLOG_GOAL = Goal(10.0, "at least")


def ours(path: Path) -> int:
    """Messages read, by the raw topics."""
    log = path / METADATA if path.is_dir() else path
    batches = (item for item in registry.read(log) if isinstance(item, RecordBatch))
    return sum(len(batch) for batch in batches if batch.topic.startswith("raw."))


def by_rosbags(path: Path) -> int:
    """Messages that rosbags decodes."""
    from rosbags.highlevel import AnyReader

    count = 0
    with AnyReader([path]) as reader:
        for connection, _time, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            count += 1
    return count


def by_mcap_ros2(path: Path) -> int:
    """Messages that mcap with its ROS 2 decoder decodes."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with next(path.glob("*.mcap")).open("rb") as stream:
        return sum(1 for _message in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages())


def by_pymavlink(path: Path) -> int:
    """Messages that pymavlink's own loop reads."""
    from pymavlink import mavutil

    log, count = mavutil.mavlogfile(str(path)), 0
    while log.recv_msg() is not None:
        count += 1
    return count


def main() -> None:
    """Record each container beside each peer."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, default=5_000, help="instants of the simulated robot")
    options = parser.parse_args()
    with Book("bags") as book, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tlog = folder / "a.tlog"
        tlog.write_bytes(bytes(telemetry().data) * (options.rows // 50))
        forms: list[tuple[str, str, Path, Callable[[Path], int], Goal | None]] = []
        if book.has("pymavlink"):
            forms.append(("MAVLink telemetry", "pymavlink", tlog, by_pymavlink, TLOG_GOAL))
        if book.has("rosbags"):  # it writes the bags too
            flight, old_flight = small_flight(rows=options.rows), small_flight(is_ros1=True, rows=options.rows)
            mcap, sqlite = write_ros2(folder / "mcap", flight), write_ros2(folder / "sqlite", flight, "sqlite3")
            ros1, lz4 = write_ros1(folder / "a.bag", old_flight), write_ros1(folder / "b.bag", old_flight, "lz4")
            bags = (("ROS 2 bag, MCAP", mcap), ("ROS 2 bag, sqlite3", sqlite), ("ROS 1 bag", ros1), ("ROS 1, lz4", lz4))
            forms += [(form, "rosbags", path, by_rosbags, None) for form, path in bags]
            if book.has("mcap-ros2-support"):
                forms.append(("ROS 2 bag, MCAP", "mcap-ros2-support", mcap, by_mcap_ros2, None))
        for form, peer, path, read, goal in forms:
            count, same = ours(path), read(path)
            assert count == same, f"{count} messages, {same} by {peer}"
            times = by_turns({"ours": partial(ours, path), "peer": partial(read, path)}, ROUNDS)
            what = f"{form} to batches, {count} messages"
            book.against(what, times["ours"], times["peer"], peer, goal=goal, is_times=True)


if __name__ == "__main__":
    main()
