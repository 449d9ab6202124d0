"""Records of fixed layouts, packed in the order of their times."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Int64Array

Packed = NDArray[np.void]


def records(count: int, *parts: tuple[str, str, object]) -> Packed:
    """Return packed records of ``count`` rows; a part is a name, a type, and its values.

    Examples
    --------
    >>> records(2, ("kind", "u1", 7), ("value", "<u2", [1, 2])).tobytes().hex()
    '070100070200'
    """
    found = np.zeros(count, dtype=[(name, kind) for name, kind, _values in parts])
    for name, _kind, values in parts:
        found[name] = values
    return found


def interleaved(streams: Sequence[tuple[Int64Array, Packed]]) -> list[tuple[int, int, int]]:
    """Return runs of records in the order of their times.

    A run is the number of its stream, its first row, and the row behind its last. The times of a stream never decrease;
    of equal times the earlier stream comes first.

    Examples
    --------
    >>> one, two = np.array([1, 2, 5]), np.array([2, 3])
    >>> interleaved([(one, np.zeros(3, "V1")), (two, np.zeros(2, "V1"))])
    [(0, 0, 2), (1, 0, 2), (0, 2, 3)]
    """
    times = np.concatenate([time for time, _rows in streams])
    stream = np.repeat(np.arange(len(streams)), [len(time) for time, _rows in streams])
    row = np.concatenate([np.arange(len(time)) for time, _rows in streams])
    order = np.argsort(times, kind="stable")
    stream, row = stream[order], row[order]
    begins = np.flatnonzero(np.diff(stream, prepend=-1))
    ends = np.append(begins[1:], len(stream))
    return [
        (int(stream[begin]), int(row[begin]), int(row[end - 1]) + 1) for begin, end in zip(begins, ends, strict=True)
    ]


def joined(streams: Sequence[tuple[Int64Array, Packed]]) -> bytes:
    """Return the bytes of the records of several streams in the order of their times."""
    return b"".join(streams[one][1][first:end].tobytes() for one, first, end in interleaved(streams))
