"""Messages of the filters over the data link, as bytes.

Little-endian; positions and covariances of full vectors as 8-byte numbers, the covariance of a broadcast position as
4-byte ones: a centimetre of an ECEF position does not fit into four. One byte each for sender and rank allows 256.
"""

import struct

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass

HEADER = struct.Struct("<BBIf")  # sender, rank, slot, seconds since the start of the slot's frame: 10 bytes
PLACE = struct.Struct("<4d")  # position and clock
RANGE = struct.Struct("<BHd")  # source, place in the frame, pseudo-range
PAIRS = [(i, j) for i in range(4) for j in range(i, 4)]
KINDS = ("neighbour_exact", "ranked", "modified", "split_intersection")


@dataclass(frozen=True, slots=True)
class Broadcast:
    """Broadcast of a vehicle to its neighbours about itself.

    Parameters
    ----------
    sender, rank, slot : int
    place_m : ndarray, shape (3,)
        Estimated position of the antenna at the time of transmission.
    clock_m : float
    covariance : ndarray, shape (4, 4), optional
        Of position and clock; ``ranked``, ``modified`` and ``split_intersection`` send it.
    shared : ndarray, shape (4, 2 q), optional
        Covariance with the errors of the q uncertain ground points; ``modified``.
    """

    sender: int
    rank: int
    slot: int
    place_m: FloatArray
    clock_m: float
    covariance: FloatArray | None = None
    shared: FloatArray | None = None

    def encode(self) -> bytes:
        """The message as bytes."""
        parts = [HEADER.pack(self.sender % 256, min(self.rank, 255), self.slot % 2**32, 0.0)]
        parts.append(PLACE.pack(*self.place_m, self.clock_m))
        if self.covariance is not None:
            parts.append(np.array([self.covariance[pair] for pair in PAIRS], dtype="<f4").tobytes())
        if self.shared is not None:
            parts.append(self.shared.astype("<f4").tobytes())
        return b"".join(parts)


def decode(message: bytes, kind: str) -> Broadcast:
    """Read a message of an algorithm back.

    Examples
    --------
    >>> sent = Broadcast(3, 1, 70, np.array([1.0, 2.0, 3.0]), 30.0, 4.0 * np.eye(4))
    >>> got = decode(sent.encode(), "ranked")
    >>> len(sent.encode()), got.place_m.tolist(), float(got.covariance[3, 3])
    (82, [1.0, 2.0, 3.0], 4.0)
    """
    sender, rank, slot, _ = HEADER.unpack_from(message)
    *place, clock = PLACE.unpack_from(message, HEADER.size)
    at = HEADER.size + PLACE.size
    covariance = None
    if kind != "neighbour_exact":
        covariance = _symmetric(np.frombuffer(message, "<f4", len(PAIRS), at).astype(np.float64))
        at += 4 * len(PAIRS)
    shared = None
    if kind == "modified":
        shared = np.frombuffer(message, "<f4", offset=at).astype(np.float64).reshape(4, -1)
    return Broadcast(sender, rank, slot, np.array(place), clock, covariance, shared)


def _symmetric(values: FloatArray) -> FloatArray:
    out = np.zeros((4, 4))
    for value, (i, j) in zip(values.tolist(), PAIRS, strict=True):
        out[i, j] = out[j, i] = value
    return out


def report_bytes(ranges: int) -> int:
    """Bytes of a report to the centre: header, dead-reckoned position and velocity, ranges.

    Examples
    --------
    >>> report_bytes(2)
    80
    """
    return HEADER.size + struct.calcsize("<6d") + ranges * RANGE.size


def pairwise_bytes(states: int, peer_states: int) -> tuple[int, int]:
    """Return the bytes of the two messages of a pairwise update.

    State, covariance and factor go there; the same come back corrected.

    Examples
    --------
    >>> pairwise_bytes(7, 7)
    (682, 682)
    """
    there = HEADER.size + 8 * (peer_states + peer_states * (peer_states + 1) // 2 + peer_states * states)
    return there, there
