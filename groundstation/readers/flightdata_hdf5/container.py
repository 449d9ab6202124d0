"""HDF5 container: parameters with their data, masks and rates.

Only this module imports h5py.

Nothing in a file is believed before it is checked: links, data stored elsewhere or never written, more data than a file
of its size holds and attributes of any type are refused, each with its reason.
"""

import io
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from typing import Any, BinaryIO

import h5py
import numpy as np
from h5py import h5o, h5t

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.flightdata_hdf5.heaps import endless_heaps
from groundstation.readers.flightdata_hdf5.storage import Storage, storage_of
from groundstation.readers.source import Source

HIGHEST_RATE_HZ = 128.0
LONGEST_S = 7 * 86_400.0
MOST_PARAMETERS, MOST_NAMES = 5_000, 4  # in a file, of a parameter
# Recorded files hold two to five times their size, most of it numbers of eight bytes with a mask of one.
MOST_EXPANSION, FREE_BYTES, SAMPLE_BYTES = 64, 1 << 24, 9
LARGEST_BYTES = 1 << 34
MOST_TEXT, MOST_ATTRIBUTE_BYTES = 200, 1 << 16
_NUMBERS, _TEXTS = frozenset((h5t.INTEGER, h5t.FLOAT, h5t.ENUM)), frozenset((h5t.STRING,))
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
    data, mask : Storage
        A sample is valid where the mask is false.
    """

    name: str
    unit: str
    frequency_hz: float
    offset_s: float
    samples: int
    is_derived: bool
    data: Storage
    mask: Storage

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

    def read(self, first: int, last: int) -> "ParameterSamples":
        """Read the samples [first, last) and which of them are valid; lost ones are not.

        Raises one of :data:`FAILURES` where the library cannot read it.
        """
        count = last - first
        values, is_valid = np.zeros(count), np.zeros(count, dtype=bool)
        spans = [*self.data.lost(first, last), *self.mask.lost(first, last)]
        is_lost = np.zeros(count, dtype=bool)
        for start, end, _ in spans:
            is_lost[start - first : end - first] = True
        for start, end in _runs(~is_lost) if spans else [(0, count)]:
            part = slice(first + start, first + end)
            values[start:end] = self.data.dataset[part]
            is_valid[start:end] = self.mask.dataset[part] == 0
        return ParameterSamples(values, is_valid, int(is_lost.sum()), spans[0][2] if spans else "")


@dataclass(frozen=True, eq=False)
class ParameterSamples:
    """Samples of a parameter; ``lost`` of them cannot be read, for a reason."""

    values: FloatArray
    is_valid: BoolArray
    lost: int = 0
    reason: str = ""


def _runs(wanted: BoolArray) -> list[tuple[int, int]]:
    """Return first and last number (exclusive) of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], wanted, [False]))))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


@dataclass(frozen=True)
class Refused:
    """A parameter that is not read, and why."""

    name: str
    reason: str


@dataclass(frozen=True, eq=False)
class Container:
    """Contents of a recording: start, parameters, refused ones.

    The start is in UTC seconds since 1970, None where it is not told. ``missing_bytes``: how much was cut off;
    ``mended``: places of heaps of text without an end that were given one.
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
        try:
            mended = endless_heaps(stream, source.size)
        except ValueError as error:
            raise _unreadable(source, error) from error
        whole = max(_announced_size(source.head), source.size)
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
    """File with zeros in place of what was cut off, and other bytes at some places.

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
    """Return the size of the file by its superblock (HDF5 file format 3.0, II.A).

    0 where it cannot be told or believed.
    """
    place = {0: 40, 1: 44, 2: 28, 3: 28}.get(head[8] if len(head) > 8 else -1)
    if place is None or len(head) < place + 8:
        return 0
    announced = int.from_bytes(head[place : place + 8], "little")
    return announced if announced <= LARGEST_BYTES else 0


@dataclass
class _Room:
    """Room left in a file of its size: bytes stored in it, and bytes unpacked from those."""

    stored_bytes: int
    held_bytes: int

    def take(self, parameter: Parameter) -> None:
        """Make room for a parameter; ValueError where there is none."""
        stored = parameter.data.stored_bytes + parameter.mask.stored_bytes
        held = max(parameter.data.held_bytes + parameter.mask.held_bytes, SAMPLE_BYTES * parameter.samples)
        if stored > self.stored_bytes or held > self.held_bytes:
            raise ValueError(f"{parameter.samples} samples of data, more than the file can hold")
        self.stored_bytes -= stored
        self.held_bytes -= held


def _contents(file: Any, size: int, missing: int, mended: tuple[int, ...]) -> Container:
    start = _number(file.attrs, "start_timestamp")
    parameters: list[Parameter] = []
    refused: list[Refused] = []
    series = _inside(file, "series", h5py.Group)
    room, names = _Room(size, FREE_BYTES + MOST_EXPANSION * size), Counter[int]()
    for count, name in enumerate(series):
        if count >= MOST_PARAMETERS:
            refused.append(Refused("series", f"more than {MOST_PARAMETERS} parameters"))
            break
        try:
            place = _place_of(series, name)
            if names[place] >= MOST_NAMES:
                continue  # its data are there already
            parameter = _parameter(series, name, size)
            room.take(parameter)
        except FAILURES as error:
            refused.append(Refused(_text(name), " ".join(str(error).split())[:MOST_TEXT]))
        else:
            parameters.append(parameter)
            names[place] += place >= 0
    known_start = start if math.isfinite(start) and 0 < start < 2**32 else None
    return Container(known_start, tuple(parameters), tuple(refused), missing, mended)


def _parameter(series: Any, name: str, size: int) -> Parameter:
    """A parameter whose data can be read; ValueError with the reason where they cannot."""
    group = _inside(series, name, h5py.Group)
    data, mask = (_dataset(group, part, size) for part in ("data", "mask"))
    if mask.samples != data.samples:
        raise ValueError(f"{mask.samples} samples of its mask for {data.samples} of data")
    frequency, offset = _number(group.attrs, "frequency"), _number(group.attrs, "supf_offset")
    if not 0.0 < frequency <= HIGHEST_RATE_HZ:
        raise ValueError(f"a rate of {frequency:g} Hz")
    if not 0.0 <= offset <= LONGEST_S or data.samples / frequency > LONGEST_S:
        raise ValueError(f"{data.samples} samples at {frequency:g} Hz after {offset:g} s")
    is_derived = "lfl" in group.attrs and not bool(_number(group.attrs, "lfl"))
    unit = _text(_attribute(group.attrs, "units", _TEXTS))
    return Parameter(_text(name), unit, frequency, offset, data.samples, is_derived, data, mask)


def _dataset(group: Any, part: str, size: int) -> Storage:
    """A dataset of numbers in one row that lies within the file."""
    dataset = _inside(group, part, h5py.Dataset)
    if dataset.dtype.kind not in "fiub" or len(dataset.shape or ()) != 1:
        raise ValueError(f"{part} that is no row of numbers")
    if dataset.shape[0] * SAMPLE_BYTES > FREE_BYTES + MOST_EXPANSION * size:
        raise ValueError(f"{dataset.shape[0]} samples of {part}, more than the file can hold")
    return storage_of(dataset, part, size)


def _place_of(group: Any, name: str) -> int:
    """Return the place of a group's member in the file; -1 for one that is only a link."""
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        return -1
    return int(h5o.get_info(group.id, name.encode("utf-8", "surrogateescape")).addr)


def _inside(group: Any, name: str, kind: type) -> Any:
    """Return a group's member of a kind in the same file; no link is followed."""
    link = group.get(name, getlink=True)
    if link is None:
        raise ValueError(f"no {name}")
    if not isinstance(link, h5py.HardLink):
        raise ValueError(f"{name} that is a link")
    member = group[name]
    if not isinstance(member, kind):
        raise ValueError(f"{name} that is no {kind.__name__.lower()}")
    return member


def _attribute(attributes: Any, name: str, kinds: frozenset[int] = _NUMBERS) -> Any:
    """Return an attribute of one of these kinds; None without one, or if it is large."""
    try:
        found = attributes.get_id(name)
        if found.get_type().get_class() not in kinds or found.get_storage_size() > MOST_ATTRIBUTE_BYTES:
            return None
        return attributes[name]
    except FAILURES:
        return None


def _number(attributes: Any, name: str) -> float:
    """A numeric attribute, NaN where there is none."""
    try:
        return float(np.asarray(_attribute(attributes, name)).reshape(-1)[0])
    except (*FAILURES, IndexError):
        return math.nan


def _text(value: Any) -> str:
    """Return text of any encoding in one line, without unprintable characters."""
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="replace")
    text = value if isinstance(value, str) else ""
    return " ".join("".join(one if one.isprintable() else "?" for one in text).split())[:MOST_TEXT]
