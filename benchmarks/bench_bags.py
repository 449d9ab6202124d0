"""The reader of bags and telemetry against rosbags, mcap-ros2-support and pymavlink, in one run.

Both sides read every value of every message of a simulated robot: ours into columns (two passes, raw and canonical),
theirs into one object a message. Processor seconds, best of several rounds that take turns.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from pymavlink import mavutil
from rosbags.highlevel import AnyReader

from groundstation.base.records import RecordBatch
from groundstation.readers import registry
from groundstation.readers.bags.bag import METADATA
from tests.readers.bag_writer import small_flight, write_ros1, write_ros2
from tests.readers.telemetry_writer import telemetry


def ours(path: Path) -> int:
    """Messages read, by the raw topics."""
    log = path / METADATA if path.is_dir() else path
    batches = (item for item in registry.read(log) if isinstance(item, RecordBatch))
    return sum(len(batch) for batch in batches if batch.topic.startswith("raw."))


def by_rosbags(path: Path) -> int:
    """Messages that rosbags decodes."""
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
    log, count = mavutil.mavlogfile(str(path)), 0
    while log.recv_msg() is not None:
        count += 1
    return count


def best_of(rounds: int, *readers: tuple[Callable[[Path], int], Path]) -> list[tuple[float, int]]:
    """Processor seconds and messages of each, taking turns."""
    best = [(float("inf"), 0)] * len(readers)
    for _ in range(rounds):
        for number, (read, path) in enumerate(readers):
            began = time.process_time()
            count = read(path)
            best[number] = min(best[number], (time.process_time() - began, count))
    return best


def main() -> None:
    """Print one line for each container and peer."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, default=5_000, help="instants of the simulated robot")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        flight, old_flight = small_flight(rows=options.rows), small_flight(is_ros1=True, rows=options.rows)
        mcap, sqlite = write_ros2(folder / "mcap", flight), write_ros2(folder / "sqlite", flight, "sqlite3")
        ros1, lz4 = write_ros1(folder / "a.bag", old_flight), write_ros1(folder / "b.bag", old_flight, "lz4")
        tlog = folder / "a.tlog"
        tlog.write_bytes(bytes(telemetry().data) * (options.rows // 50))
        peers: list[tuple[str, str, Path, Callable[[Path], int]]] = [
            ("ROS 2 MCAP", "rosbags", mcap, by_rosbags),
            ("ROS 2 sqlite3", "rosbags", sqlite, by_rosbags),
            ("ROS 1 bag", "rosbags", ros1, by_rosbags),
            ("ROS 1 bag, lz4", "rosbags", lz4, by_rosbags),
            ("tlog", "pymavlink", tlog, by_pymavlink),
        ]
        try:
            import mcap_ros2  # noqa: F401
        except ImportError:
            print("mcap-ros2-support is not installed: left out")
        else:
            peers.append(("ROS 2 MCAP", "mcap-ros2-support", mcap, by_mcap_ros2))
        for form, peer, path, read in peers:
            (own_s, count), (peer_s, same) = best_of(options.rounds, (ours, path), (read, path))
            assert count == same, f"{count} messages, {same} by {peer}"
            speed = f"{count / own_s / 1e3:.0f} thousand messages/s"
            print(f"{form:15} {speed:30} {peer_s / own_s:5.1f} times {peer}")


if __name__ == "__main__":
    main()
