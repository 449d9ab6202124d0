"""Contents of a bag, whatever its container: connections, and blocks of messages.

The messages are not decoded yet.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage, Int64Array

ByteArray = NDArray[np.uint8]


@dataclass(frozen=True)
class Connection:
    """Topic as one writer wrote it.

    Parameters
    ----------
    number : int
        Place among those of the log, from 0.
    topic : str
        As in the log: ``/ins/imu``.
    type : str
        Name of the message type: ``sensor_msgs/Imu`` (ROS without ``/msg/``), ``foxglove.LocationFix``.
    encoding : str
        Of the messages: ``cdr``, ``ros1``, ``protobuf``, ``json`` or what the log says.
    schema_encoding : str
        Of the definition: ``ros2msg``, ``ros1msg``, ``protobuf``, ``jsonschema`` or what the log says.
    schema : bytes
        The definition; empty where the log has none.
    publisher : str
        Who wrote it, as far as the log tells: the name of a node, or the number of its channel.
    """

    number: int
    topic: str
    type: str
    encoding: str
    schema_encoding: str
    schema: bytes
    publisher: str = ""


@dataclass(frozen=True, eq=False)
class ConnectionBlock:
    """Messages of one connection, in the order of the log.

    Parameters
    ----------
    connection : Connection
    buffer : ndarray of uint8
    starts, sizes : ndarray of int64, shape (n,)
        Where each payload begins in the buffer, and its bytes.
    log_time_ns, publish_time_ns : ndarray of int64, shape (n,)
    record_index : ndarray of int64, shape (n,)
        Place of each message among those of the log.
    """

    connection: Connection
    buffer: ByteArray
    starts: Int64Array
    sizes: Int64Array
    log_time_ns: Int64Array
    publish_time_ns: Int64Array
    record_index: Int64Array

    def __len__(self) -> int:
        return len(self.starts)

    def take(self, rows: NDArray[np.int64] | slice) -> "ConnectionBlock":
        """Return the messages that ``rows`` selects; the buffer is shared."""
        return ConnectionBlock(
            self.connection,
            self.buffer,
            self.starts[rows],
            self.sizes[rows],
            self.log_time_ns[rows],
            self.publish_time_ns[rows],
            self.record_index[rows],
        )

    def payload(self, row: int) -> bytes:
        """Bytes of one message."""
        start = int(self.starts[row])
        return self.buffer[start : start + int(self.sizes[row])].tobytes()


@dataclass(frozen=True)
class Missing:
    """Messages of a topic that are not in the log although something in it counts them.

    ``what`` says which account counts them.
    """

    topic: str
    count: int
    what: str

    def damage(self) -> Damage:
        """Return it as damage of the log."""
        return Damage("dropped_rows", "the whole log", self.count, f"{self.what} (topic {self.topic})")


def counted_by(account: str) -> str:
    """Describe what is missing by an account that a log has of itself.

    Examples
    --------
    >>> counted_by("index of the bag")
    'messages that the index of the bag counts and that are not in it'
    """
    return f"messages that the {account} counts and that are not in it"


Part: TypeAlias = ConnectionBlock | Damage | Missing


def joined(gathered: dict[int, list[ConnectionBlock]]) -> list[ConnectionBlock]:
    """Join blocks into one for each connection, in the order of their numbers.

    Its messages are in the order of the log. All blocks share one buffer. Several nodes may publish on one topic: then
    the blocks of a connection interlace.

    Parameters
    ----------
    gathered : dict of connection number to list of ConnectionBlock
        Those of several connections may share a buffer: they came from one chunk.
    """
    blocks = [block for several in gathered.values() for block in several]
    buffers = {id(block.buffer): block.buffer for block in blocks}
    ends = np.cumsum([0, *(len(buffer) for buffer in buffers.values())]).tolist()
    places = dict(zip(buffers, ends[:-1], strict=True))
    buffer = (
        next(iter(buffers.values()))
        if len(buffers) == 1
        else np.concatenate([np.zeros(0, np.uint8), *buffers.values()])
    )
    united = (
        ConnectionBlock(
            several[0].connection,
            buffer,
            np.concatenate([block.starts + places[id(block.buffer)] for block in several]),
            np.concatenate([block.sizes for block in several]),
            np.concatenate([block.log_time_ns for block in several]),
            np.concatenate([block.publish_time_ns for block in several]),
            np.concatenate([block.record_index for block in several]),
        )
        for _number, several in sorted(gathered.items())
    )
    return [
        block if is_ascending(block.record_index) else block.take(np.argsort(block.record_index)) for block in united
    ]


def is_ascending(values: Int64Array) -> bool:
    """Tell whether each value is larger than the one before."""
    return bool((values[1:] > values[:-1]).all())
