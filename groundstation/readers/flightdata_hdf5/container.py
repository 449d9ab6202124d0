"""The HDF5 container: parameters with their data, masks and rates. Only this module imports h5py.

Nothing in a file is believed before it is checked: links that leave the file, data stored elsewhere, shapes that the
file cannot hold and attributes of any type are refused, each with its reason.
"""

import io
import math
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import h5py
import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.flightdata_hdf5.soundness import check_pieces, endless_heaps
from groundstation.readers.source import Source

HIGHEST_RATE_HZ = 128.0
LONGEST_S = 7 * 86_400.0
MOST_PARAMETERS = 5_000
MOST_CHUNK_BYTES = 1 << 26
MOST_EXPANSION = 1_100  # deflate makes at most 1032 bytes of one
LARGEST_BYTES = 1 << 34
MOST_TEXT = 200
# Whatever h5py raises for a file that is not what it says it is.
FAILURES = (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError, ArithmeticError, MemoryError)


@dataclass(frozen=True, eq=False)
class Parameter:
    """One recorded or derived parameter.

    Parameters
    ----------
    name, unit : str
    frequency_hz, offset_s : float
        Rate, and time of the first sample after the start of the recording.
    samples : int
    is_derived : bool
        Computed by the ground software from others, not recorded.
    data, mask : h5py.Dataset
        A sample is valid where the mask is false.
    """

    name: str
    unit: str
    frequency_hz: float
    offset_s: float
    samples: int
    is_derived: bool
    data: Any
    mask: Any
    _checked: tuple[set[int], set[int]] = field(default_factory=lambda: (set(), set()))  # pieces of data, of mask

    def times_ns(self, first: int, last: int) -> Int64Array:
        """Device times of samples [first, last), nanoseconds since the start of the recording."""
        step = np.arange(first, last, dtype=np.int64)
        return round(self.offset_s * NS_PER_S) + np.round(step * (NS_PER_S / self.frequency_hz)).astype(np.int64)

    def first_from(self, time_ns: int) -> int:
        """Number of the first sample at or after a time."""
        near = math.floor((time_ns / NS_PER_S - self.offset_s) * self.frequency_hz)
        around = np.arange(max(near - 1, 0), max(near + 3, 1))
        reached = self.times_ns(int(around[0]), int(around[-1]) + 1) >= time_ns
        return min(int(around[np.argmax(reached)]) if reached.any() else int(around[-1]) + 1, self.samples)

    def read(self, first: int, last: int) -> tuple[FloatArray, BoolArray]:
        """Values and where they are valid, samples [first, last).

        Raises one of :data:`FAILURES` where the file is damaged.
        """
        check_pieces(self.data, first, last, self._checked[0])
        check_pieces(self.mask, first, last, self._checked[1])
        values = np.asarray(self.data[first:last], dtype=np.float64)
        is_valid = np.asarray(self.mask[first:last]) == 0
        if values.shape != (last - first,) or is_valid.shape != values.shape:
            raise ValueError(f"{values.shape} samples where {last - first} were announced")
        return values, is_valid


@dataclass(frozen=True)
class Refused:
    """A parameter that is not read, and why."""

    name: str
    reason: str


@dataclass(frozen=True, eq=False)
class Container:
    """What a recording holds: start (UTC seconds since 1970, None where it is not told), parameters, refused ones.

    ``missing_bytes``: how much was cut off; ``mended``: where heaps of text without an end were given one.
    """

    start_utc_s: float | None
    parameters: tuple[Parameter, ...]
    refused: tuple[Refused, ...]
    missing_bytes: int = 0
    mended: tuple[int, ...] = ()


@contextmanager
def opened(source: Source) -> Iterator[Container]:
    """Open a recording for the length of a ``with`` block.

    Raises
    ------
    UnreadableLogError
        When it is no HDF5 file, or one without parameters.
    """
    with source.open() as stream:
        mended, whole = endless_heaps(stream), max(_announced_size(source.head), source.size)
        is_sound = not mended and whole == source.size
        try:
            file = h5py.File(stream if is_sound else _Mended(stream, whole, mended), "r")
        except FAILURES as error:
            raise _unreadable(source, error) from error
        with closing(file):
            try:
                container = _contents(file, source.size, whole - source.size, tuple(mended))
            except FAILURES as error:
                raise _unreadable(source, error) from error
            if not container.parameters:
                reason = container.refused[0].reason if container.refused else "it has none"
                raise UnreadableLogError(source.name, f"no parameter of this recording can be read ({reason})")
            yield container


def _unreadable(source: Source, error: BaseException) -> UnreadableLogError:
    text = " ".join(str(error).split())[:MOST_TEXT]
    return UnreadableLogError(source.name, f"HDF5 that cannot be opened ({text})", "", "check how it was copied")


class _Mended(io.RawIOBase):
    """A file with zeros in place of what was cut off, and other bytes at some places.

    The library refuses a file that is shorter than it says, and reads heaps without an end for ever.
    """

    def __init__(self, stream: BinaryIO, size: int, mended: Mapping[int, bytes]) -> None:
        self._stream, self._size, self._mended, self._at = stream, size, mended, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self._at = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._size}[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer from the present place; zeros behind the end of the file."""
        self._stream.seek(self._at)
        found = self._stream.read(len(buffer))
        buffer[:] = found + bytes(len(buffer) - len(found))
        for place, content in self._mended.items():
            for at, byte in enumerate(content, place - self._at):
                if 0 <= at < len(buffer):
                    buffer[at] = byte
        self._at += len(buffer)
        return len(buffer)


def _announced_size(head: bytes) -> int:
    """Size of the file by its superblock (HDF5 file format 3.0, II.A), 0 where it cannot be told or believed."""
    place = {0: 40, 1: 44, 2: 28, 3: 28}.get(head[8] if len(head) > 8 else -1)
    if place is None or len(head) < place + 8:
        return 0
    announced = int.from_bytes(head[place : place + 8], "little")
    return announced if announced <= LARGEST_BYTES else 0


def _contents(file: Any, size: int, missing: int, mended: tuple[int, ...]) -> Container:
    start = _number(file.attrs, "start_timestamp")
    parameters: list[Parameter] = []
    refused: list[Refused] = []
    series = _inside(file, "series", h5py.Group)
    for count, name in enumerate(series):
        if count >= MOST_PARAMETERS:
            refused.append(Refused("series", f"more than {MOST_PARAMETERS} parameters"))
            break
        try:
            parameters.append(_parameter(series, name, size, missing))
        except FAILURES as error:
            refused.append(Refused(_text(name), " ".join(str(error).split())[:MOST_TEXT]))
    known_start = start if math.isfinite(start) and 0 < start < 2**32 else None
    return Container(known_start, tuple(parameters), tuple(refused), missing, mended)


def _parameter(series: Any, name: str, size: int, missing: int) -> Parameter:
    """A parameter whose data can be read; ValueError with the reason where they cannot."""
    group = _inside(series, name, h5py.Group)
    data, mask = (_dataset(group, part, size, missing) for part in ("data", "mask"))
    samples = int(data.shape[0])
    if mask.shape != data.shape:
        raise ValueError(f"{mask.shape[0]} samples of its mask for {samples} of data")
    frequency, offset = _number(group.attrs, "frequency"), _number(group.attrs, "supf_offset")
    if not 0.0 < frequency <= HIGHEST_RATE_HZ:
        raise ValueError(f"a rate of {frequency:g} Hz")
    if not 0.0 <= offset <= LONGEST_S or samples / frequency > LONGEST_S:
        raise ValueError(f"{samples} samples at {frequency:g} Hz after {offset:g} s")
    is_derived = "lfl" in group.attrs and not bool(_number(group.attrs, "lfl"))
    return Parameter(
        _text(name), _text(_attribute(group.attrs, "units")), frequency, offset, samples, is_derived, data, mask
    )


def _dataset(group: Any, part: str, size: int, missing: int) -> Any:
    """A dataset of numbers in one row that lies within the file."""
    dataset = _inside(group, part, h5py.Dataset)
    if dataset.dtype.kind not in "fiub" or len(dataset.shape or ()) != 1:
        raise ValueError(f"{part} that is no row of numbers")
    if dataset.external or dataset.is_virtual:
        raise ValueError(f"{part} that is stored in another file")
    if dataset.shape[0] * dataset.dtype.itemsize > MOST_EXPANSION * size:
        raise ValueError(f"{dataset.shape[0]} samples of {part}, more than the file can hold")
    if dataset.chunks and dataset.chunks[0] * dataset.dtype.itemsize > MOST_CHUNK_BYTES:
        raise ValueError(f"{part} in pieces of {dataset.chunks[0]} samples")
    if dataset.chunks and dataset.id.get_num_chunks() != -(-dataset.shape[0] // dataset.chunks[0]):
        raise ValueError(f"pieces of {part} missing")  # they would read as zeros
    if missing and not dataset.compression:
        raise ValueError(f"{part} of which one cannot tell what was cut off")
    return dataset


def _inside(group: Any, name: str, kind: type) -> Any:
    """A member of a group that lies in the same file and is of that kind."""
    if name not in group:
        raise ValueError(f"no {name}")
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise ValueError(f"{name} that is a link")
    member = group[name]
    if not isinstance(member, kind):
        raise ValueError(f"{name} that is no {kind.__name__.lower()}")
    return member


def _attribute(attributes: Any, name: str) -> Any:
    try:
        return attributes.get(name)
    except FAILURES:
        return None


def _number(attributes: Any, name: str) -> float:
    """A numeric attribute, NaN where there is none."""
    try:
        return float(np.asarray(attributes[name]).reshape(-1)[0])
    except (*FAILURES, IndexError):
        return math.nan


def _text(value: Any) -> str:
    """Text of any encoding in one line, without what cannot be shown."""
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="replace")
    text = value if isinstance(value, str) else ""
    return " ".join("".join(one if one.isprintable() else "?" for one in text).split())[:MOST_TEXT]
