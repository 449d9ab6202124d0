"""Channels derived for other programs: map positions, 3-D poses, lines of a log.

Messages of Foxglove's schemas, which Foxglove and Rerun's own loader draw by themselves. Reading skips them.

Sources: https://docs.foxglove.dev/docs/sdk/schemas; protobuf encoding, https://protobuf.dev/programming-guides/encoding.
"""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

import numpy as np
from foxglove_schemas_protobuf import LocationFix_pb2, Log_pb2, PoseInFrame_pb2
from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.attitude import quaternion_enu_from_flu_xyzw
from groundstation.base.findings import Finding, Severity, place_time_ns
from groundstation.base.geodesy import north_east_m, on_earth
from groundstation.base.records import Column, Int64Array, RecordBatch
from groundstation.base.units import NS_PER_S
from groundstation.store.channel import DERIVED_KEY, ChannelWriter, Chunk, channel_record
from groundstation.store.wire import Slot, encode_text

# One sigma of a range, with which dilutions of precision become metres: 7.0 m hold 95 % of them.
# Source: GPS Standard Positioning Service Performance Standard, 5th edition, 2020, table 3.4-1.
RANGE_SIGMA_M = 7.0 / 1.96
POSE_FRAME = "local_enu"
POSE_STEP_NS = NS_PER_S // 10  # one pose per step: enough to look at, and little of the file
MOST_METRES = 1e8  # a position further from the origin is none
LOG_TOPIC = "log"
LEVELS: dict[Severity, int] = {"info": 2, "warn": 3, "fail": 4}  # foxglove.Log.Level


class DerivedWriter(ChannelWriter):
    """Channel of a Foxglove schema made from another topic."""

    def __init__(
        self,
        channel_id: int,
        topic: str,
        source: str,
        emit: Callable[[Chunk], None],
        message: Descriptor,
        has_utc: bool,
    ) -> None:
        super().__init__(channel_id, topic, emit)
        self._source, self._message, self._has_utc = source, message, has_utc
        self._metadata: dict[str, str] = {}

    def timestamp(self, prefix: bytes, time_ns: Int64Array | None) -> list[Slot]:
        """Return the timestamp behind its tag, on an absolute clock."""
        return [Slot(prefix + b"\x0c", _timestamps(time_ns))] if self._has_utc and time_ns is not None else []

    def definition(self, metadata: Mapping[str, str] = MappingProxyType({})) -> tuple[Schema, Channel]:
        """Return Foxglove's schema; the channel's metadata says that reading skips it."""
        files = FileDescriptorSet()
        for descriptor in _with_imports(self._message.file, {}).values():
            descriptor.CopyToProto(files.file.add())
        data = files.SerializeToString(deterministic=True)
        schema = Schema(id=self.id, name=self._message.full_name, encoding="protobuf", data=data)
        return schema, channel_record(self.id, self.topic, {DERIVED_KEY: self._source, **self._metadata})


class LocationFixWriter(DerivedWriter):
    """Writer of the positions of a GNSS topic as ``foxglove.LocationFix``.

    Any viewer can show them on a map.

    The covariance is that of the receiver's own sigmas, else of the dilutions of precision and the range error that
    the GPS performance standard states; without either it is absent. The frame is named after the topic.
    """

    def __init__(self, channel_id: int, source: str, emit: Callable[[Chunk], None], has_utc: bool) -> None:
        message = LocationFix_pb2.LocationFix.DESCRIPTOR
        super().__init__(channel_id, f"location_fix.{source}", source, emit, message, has_utc)
        self._metadata = {
            "covariance": "sigmas of the receiver, north and east alike; where it states none: "
            f"hdop and sqrt(pdop^2 - hdop^2) times {RANGE_SIGMA_M:.2f} m",
            "frame": "east, north, up",
        }

    def write(self, batch: RecordBatch) -> None:
        """Take in the rows that have a position on Earth: no viewer can draw another."""
        latitude, longitude = (batch.columns.get(name) for name in ("latitude_deg", "longitude_deg"))
        if latitude is None or longitude is None:
            return
        place = on_earth(latitude.values, longitude.values)
        known = np.logical_and.reduce([latitude.mask, longitude.mask, *map(np.isfinite, place)])
        if known.any():
            super().write(batch if known.all() else batch.take(known))

    def slots(self, batch: RecordBatch) -> list[Slot]:
        """Position, covariance, timestamp and frame, in order of their numbers."""
        tags = {"latitude_deg": b"\x09", "longitude_deg": b"\x11"}
        altitude = next((name for name in ("altitude_ellipsoid_m", "altitude_msl_m") if name in batch.columns), None)
        if altitude:
            tags[altitude] = b"\x19"
        columns = ((tag, batch.columns[name]) for name, tag in tags.items())
        slots = [Slot(tag, column.values.astype("<f8", copy=False), column.present) for tag, column in columns]
        variances = position_variances_m2(batch)
        known = np.asarray(np.isfinite(variances).all(axis=1), dtype=bool)
        if known.any():
            matrix = np.zeros((len(batch), 9), "<f8")
            matrix[:, [0, 4, 8]] = variances
            approximated = np.full(len(batch), LocationFix_pb2.LocationFix.APPROXIMATED, np.uint8)
            slots += [Slot(b"\x22\x48", matrix.view("V72")[:, 0], known), Slot(b"\x28", approximated, known)]
        return [*slots, *self.timestamp(b"\x32", batch.time_ns), _constant(b"\x3a", self._source, len(batch))]


def position_variances_m2(batch: RecordBatch) -> FloatArray:
    """Return the variances of positions east, north and up, shape (n, 3), in m2.

    NaN where the batch does not tell.
    """
    across, up = _values(batch, "horizontal_sigma_m") / np.sqrt(2.0), _values(batch, "vertical_sigma_m")
    hdop, pdop = _values(batch, "hdop"), _values(batch, "pdop")
    with np.errstate(invalid="ignore", over="ignore"):
        stated = np.column_stack([across, across, up]) ** 2
        vertical = np.sqrt(np.where(pdop > hdop, pdop**2 - hdop**2, np.nan))
        level = hdop / np.sqrt(2.0)  # it is of north and east together
        of_geometry = (RANGE_SIGMA_M * np.column_stack([level, level, vertical])) ** 2
    return np.where(np.isfinite(stated).all(axis=1, keepdims=True), stated, of_geometry)


class Origin:
    """Origin of the local frame of a file's poses: the first position, of whichever topic."""

    def __init__(self) -> None:
        self.place: tuple[float, float, float] | None = None

    def enu_m(self, geodetic: FloatArray) -> FloatArray:
        """Return east, north and up of latitudes, longitudes (deg) and heights (m), (n, 3)."""
        known = np.flatnonzero(np.isfinite(geodetic[:, :2]).all(axis=1))
        if self.place is None and len(known):
            latitude, longitude, height = geodetic[known[0]].tolist()
            self.place = latitude, longitude, height if np.isfinite(height) else 0.0
        if self.place is None:
            return np.full(geodetic.shape, np.nan)
        north, east = north_east_m(geodetic[:, 0], geodetic[:, 1], *self.place[:2])
        return np.column_stack([east, north, geodetic[:, 2] - self.place[2]])


class PoseWriter(DerivedWriter):
    """Writer of attitude and position of an INS topic as ``foxglove.PoseInFrame``, for 3-D.

    Body axes are forward-left-up, the frame is east-north-up at the first position of the file. There are at most ten
    poses a second. A row of attitude without a position of its own has the last one. Single precision is enough to look
    at.
    """

    def __init__(self, channel_id: int, source: str, emit: Callable[[Chunk], None], has_utc: bool, origin: Origin):
        message = PoseInFrame_pb2.PoseInFrame.DESCRIPTOR
        super().__init__(channel_id, f"pose.{source}", source, emit, message, has_utc)
        self._origin, self._step = origin, -1
        self._last: dict[str, float] = {}  # last known value of each coordinate

    def write(self, batch: RecordBatch) -> None:
        """Take in the first row with an attitude of each step in time."""
        attitude = [batch.columns.get(name) for name in ("roll_deg", "pitch_deg", "true_heading_deg")]
        rows = _known_rows(attitude, len(batch))
        if batch.time_ns is not None and len(rows):
            steps = batch.time_ns[rows] // POSE_STEP_NS
            rows = rows[np.flatnonzero(np.diff(steps, prepend=self._step))]
            self._step = int(steps[-1])
        place = self._places(batch, rows)  # called for no rows too, as it remembers the last one
        if batch.time_ns is None or not len(rows):
            return
        turn = quaternion_enu_from_flu_xyzw(*(column.values[rows] for column in attitude if column is not None))
        shown = np.column_stack([place, turn]).astype(np.float32).astype("<f8")
        columns = {str(number): Column(values) for number, values in enumerate(shown.T.copy())}
        validity_ns = None if batch.validity_time_ns is None else batch.validity_time_ns[rows]
        where = batch.record_index[rows], batch.device_time_ns.take(rows), columns
        super().write(RecordBatch(self.topic, *where, batch.time_ns[rows], validity_ns))

    def slots(self, batch: RecordBatch) -> list[Slot]:
        """Timestamp, frame, position and orientation."""
        frame = _constant(b"\x12", POSE_FRAME, len(batch))
        inside = [b"\x1a\x43\x0a\x1b\x09", b"\x11", b"\x19", b"\x12\x24\x09", b"\x11", b"\x19", b"\x21"]
        values = [Slot(tag, column.values) for tag, column in zip(inside, batch.columns.values(), strict=True)]
        return [*self.timestamp(b"\x0a", batch.time_ns), frame, *values]

    def _places(self, batch: RecordBatch, rows: Int64Array) -> FloatArray:
        """Return east, north and up of rows, shape (n, 3).

        From geodetic positions, else from the log's own local frame; 0 where not known.
        """
        height = "altitude_ellipsoid_m" if "altitude_ellipsoid_m" in batch.columns else "altitude_msl_m"
        geodetic = [self._held(batch, name, rows) for name in ("latitude_deg", "longitude_deg", height)]
        local = [self._held(batch, f"position_{axis}_m", rows) for axis in ("east", "north", "down")]
        geodetic[:2] = on_earth(*geodetic[:2])
        place = self._origin.enu_m(np.column_stack(geodetic))
        if not np.isfinite(place[:, :2]).any():
            place = np.column_stack(local) * np.array([1.0, 1.0, -1.0])
        return np.where(np.abs(place) < MOST_METRES, place, 0.0)

    def _held(self, batch: RecordBatch, name: str, rows: Int64Array) -> FloatArray:
        """Return values of a column at rows, shape (n,), held where a row has none.

        The value held may come from an earlier batch.
        """
        before, column = self._last.get(name, np.nan), batch.columns.get(name)
        known = _known_rows([column], len(batch))
        if column is None or not len(known):
            return np.full(len(rows), before)
        self._last[name] = float(column.values[known[-1]])
        if len(known) == len(batch):
            return column.values[rows].astype(np.float64)
        at = np.searchsorted(known, rows, side="right") - 1
        return np.where(at >= 0, column.values[known[np.maximum(at, 0)]], before)


def _known_rows(columns: Iterable[Column | None], count: int) -> Int64Array:
    """Return the rows in which every column has a finite value."""
    known = np.ones(count, dtype=bool)
    for column in columns:
        if column is None:
            return np.empty(0, np.int64)
        np.logical_and(known, np.isfinite(column.values), out=known)
        if column.present is not None:
            np.logical_and(known, column.present, out=known)
    return np.arange(count) if known.all() else np.flatnonzero(known)


class LogWriter(DerivedWriter):
    """Writer of findings and events as ``foxglove.Log``.

    They are gathered until the file is finished, for findings come last.
    """

    def __init__(self, emit: Callable[[Chunk], None], has_utc: bool) -> None:
        super().__init__(0, LOG_TOPIC, "event", emit, Log_pb2.Log.DESCRIPTOR, has_utc)
        self._entries: list[tuple[int, int, str, str]] = []

    def add_events(self, batch: RecordBatch) -> None:
        """Take in the names of events, each with its grade, information where it has none."""
        column = batch.columns.get("name")
        if column is None or batch.time_ns is None:
            return
        said = np.flatnonzero(column.mask & (column.values != ""))
        grade = batch.columns.get("severity")
        graded = np.full(len(batch), "info") if grade is None else np.where(grade.mask, grade.values, "info")
        rows = (batch.time_ns[said].tolist(), column.values[said].tolist(), graded[said].tolist())
        for time_ns, name, severity in zip(*rows, strict=True):
            self._entries.append((time_ns, LEVELS.get(severity, LEVELS["info"]), name, batch.topic))

    def finish(self, channel_id: int, findings: Iterable[Finding], first_ns: int, last_ns: int) -> None:
        """Write all lines in order of time.

        A finding without a time in the file is written at its beginning.
        """
        self.id = channel_id
        for one in findings:
            time_ns = place_time_ns(one.place, first_ns, has_utc=self._has_utc)
            if time_ns is None or not first_ns <= time_ns <= last_ns:
                time_ns = first_ns
            where = ", ".join(part for part in (one.topic, one.place) if part)
            told = f"{one.text} ({where})" if where else one.text
            self._entries.append((time_ns, LEVELS[one.severity], told, one.code))
        if not self._entries:
            return
        self._entries.sort(key=lambda entry: (entry[0], -entry[1]))
        times, levels, texts, names = zip(*self._entries, strict=True)
        columns = {
            "level": Column(np.array(levels, np.uint8)),
            "message": Column(np.array(texts)),
            "name": Column(np.array(names)),
        }
        log_time = np.array(times, np.int64)
        self.write(RecordBatch(self.topic, np.arange(len(times)), Column(log_time), columns, log_time))
        self.flush()

    def slots(self, batch: RecordBatch) -> list[Slot]:
        """Timestamp, level, message and name."""
        level, message, name = (column.values for column in batch.columns.values())
        texts = [(tag, encode_text(values)) for tag, values in ((b"\x1a", message), (b"\x22", name))]
        return [
            *self.timestamp(b"\x0a", batch.time_ns),
            Slot(b"\x10", level),
            *(Slot(tag, encoded, None, np.strings.str_len(encoded)) for tag, encoded in texts),
        ]


def _values(batch: RecordBatch, name: str) -> FloatArray:
    """Return a column as float64, shape (n,), NaN where absent."""
    column = batch.columns.get(name)
    if column is None:
        return np.full(len(batch), np.nan)
    return np.where(column.mask, column.values.astype(np.float64), np.nan)


def _constant(tag: bytes, text: str, count: int) -> Slot:
    """Return a slot with the same text in every message."""
    encoded = text.encode()
    return Slot(tag + bytes([len(encoded)]) + encoded, np.empty(count, "V0"))


def _with_imports(file: FileDescriptor, found: dict[str, FileDescriptor]) -> dict[str, FileDescriptor]:
    """Return a file's descriptor and all that it imports, imported ones first."""
    for imported in file.dependencies:
        _with_imports(imported, found)
    found[file.name] = file
    return found


def _timestamps(time_ns: Int64Array) -> NDArray[np.void]:
    """Encode each time as google.protobuf.Timestamp.

    Varints are padded to five bytes, so that all are equally long.
    """
    seconds, nanos = np.divmod(time_ns, NS_PER_S)
    out = np.empty((len(time_ns), 12), np.uint8)
    for at, tag, value in ((0, 0x08, seconds), (6, 0x10, nanos)):
        out[:, at] = tag
        for k in range(5):
            out[:, at + 1 + k] = (value >> (7 * k)) & 0x7F | (0x80 if k < 4 else 0)
    return out.view("V12")[:, 0]
