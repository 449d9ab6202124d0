"""NovAtel OEM messages of a block: names, times, canonical topics ``gnss`` and ``ins``.

NovAtel's vehicle has y forward, x right and z up: roll about y is right wing down positive, pitch about x nose up,
azimuth clockwise from north, as here. INSPVA's height is above the ellipsoid; others tell it above the sea, with the
undulation of the geoid.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch
from groundstation.base.timescales import gps_week_to_utc_ns
from groundstation.readers.layout import velocity_from_track
from groundstation.readers.receiver import novatel_text, scan
from groundstation.readers.receiver.credible import credible_attitude, credible_dilution, credible_position
from groundstation.readers.receiver.layouts import layout
from groundstation.readers.receiver.messages import Columns, Messages, MessagesByName, occupied
from groundstation.readers.receiver.novatel_messages import LAYOUTS, VELOCITY_OF, name_of
from groundstation.readers.receiver.stream import Frames
from groundstation.readers.receiver.tally import StreamTally
from groundstation.readers.receiver.ubx import FIRST_WEEK, LAST_WEEK

LONG = np.dtype(
    {
        "names": ["header", "number", "kind", "status", "week", "week_ms"],
        "formats": ["u1", "<u2", "u1", "u1", "<u2", "<u4"],
        "offsets": [3, 4, 6, 13, 14, 16],
        "itemsize": 28,
    }
)
SHORT = np.dtype(
    {
        "names": ["number", "week", "week_ms"],
        "formats": ["<u2", "<u2", "<u4"],
        "offsets": [4, 6, 8],
        "itemsize": scan.NOVATEL_SHORT_HEADER,
    }
)
_NOT_BINARY = 0xE0  # bits of the kind that mark an answer to a command, or a text
_LEAST_TIME_STATUS = 100  # coarse; below it the time is a guess
_MS_PER_WEEK = 604_800_000
_COMPUTED = 0
_ALIGNING, _GOOD, _FREE = (1, 8, 9, 10, 11, 12), (2, 3, 7), 6
_MODES = np.array(["", "align", "gnss_aided", "nav"])
_HEIGHT_IS_GIVEN, _LAST_TYPE = 2, 255  # types of position: FIXEDHEIGHT, and the last that is looked up


def _fixes() -> NDArray[np.str_]:
    """Return the kind of solution by NovAtel's position type; ``other`` if unknown."""
    kinds = {"none": (0,), "2d": (2,), "3d": (8, 16), "dgnss": (17, 18, 20, 64, 65, 66), "dead_reckoning": (19,)}
    kinds |= {"ppp": (68, 69, 77, 78), "rtk_float": (32, 33, 34), "rtk_fixed": (48, 49, 50, 51)}
    kinds |= {"gnss_ins": (52, 53, 54, 55, 56, 57, 58, 59, 73, 74, 79, 80)}
    fixes = np.full(_LAST_TYPE + 1, "other", dtype="<U16")
    for name, numbers in kinds.items():
        fixes[list(numbers)] = name
    return fixes


_FIXES = _fixes()
_CORRECTED = ("dgnss", "rtk_float", "rtk_fixed", "ppp")  # fixes by corrections, which have an age


class TimedMessages(Messages):
    """Messages with the week and millisecond of their headers."""

    def time(self) -> Column:
        """UTC of each message; absent where the receiver does not know it yet."""
        week, week_ms, known = self.header_time()
        utc_ns = gps_week_to_utc_ns(np.where(known, week, 0), np.where(known, week_ms, 0))
        return Column(np.where(known, utc_ns, 0), None if known.all() else known)

    def header_time(self) -> tuple[Int64Array, Int64Array, BoolArray]:
        """Week, millisecond and whether both are known."""
        is_long = self.frames.data[self.frame_at + 2] == 0x12
        longs = self.frames.records(self.frame_at, LONG)
        shorts = self.frames.records(self.frame_at, SHORT)
        week = np.where(is_long, longs["week"], shorts["week"]).astype(np.int64)
        week_ms = np.where(is_long, longs["week_ms"], shorts["week_ms"]).astype(np.int64)
        known = (week >= FIRST_WEEK) & (week < LAST_WEEK) & (week_ms < _MS_PER_WEEK)
        has_status = (longs["status"] >= _LEAST_TIME_STATUS) & (longs["header"] >= LONG.itemsize)
        return week, week_ms, known & (~is_long | has_status)

    @property
    def frame_at(self) -> Int64Array:
        """Places where the frames begin in the data of the block."""
        return self.places - self.frames.first_byte


def messages_of(frames: Frames) -> Iterator[TimedMessages]:
    """NovAtel messages of a block by name."""
    which = frames.of(scan.NOVATEL, scan.NOVATEL_SHORT)
    at, is_long = frames.offsets[which], frames.kinds[which] == scan.NOVATEL
    longs = frames.records(at, LONG)
    header = np.where(is_long, longs["header"], scan.NOVATEL_SHORT_HEADER).astype(np.int64)
    sizes = frames.lengths[which] - header - scan.CRC_BYTES
    is_answer = is_long & (longs["kind"] & _NOT_BINARY != 0)
    for key in np.unique(longs["number"] * 2 + is_answer.astype(np.int64)).tolist():
        number, answer = divmod(key, 2)
        rows = np.flatnonzero((longs["number"] == number) & (is_answer == bool(answer)))
        name = name_of(number) + ("-answer" if answer else "")
        yield from _by_size(name, frames, at[rows], at[rows] + header[rows], sizes[rows])
    yield from _of_text(novatel_text.as_binary(frames))


def _of_text(logs: novatel_text.TextLogs | None) -> Iterator[TimedMessages]:
    """Logs that are text, by name."""
    if logs is None:
        return
    names = np.array(logs.names)
    for name in np.unique(names).tolist():
        rows = np.flatnonzero(names == name)
        yield from _by_size(name, logs.frames, logs.offsets[rows], logs.payload_at[rows], logs.sizes[rows])


def _by_size(
    name: str, frames: Frames, at: Int64Array, payload_at: Int64Array, sizes: Int64Array
) -> Iterator[TimedMessages]:
    """Yield messages by size of payload: those shorter than the layout apart."""
    known = layout(LAYOUTS[name]) if name in LAYOUTS else None
    is_short = sizes < (known.size if known is not None else 0)
    is_odd = name.removesuffix(novatel_text.KEPT) in LAYOUTS and known is None
    for size in (*np.unique(sizes[is_short]).tolist(), None):
        rows = np.flatnonzero(~is_short if size is None else is_short & (sizes == size))
        if len(rows):
            is_sound = not is_odd if size is None else known is not None and size >= known.needed
            yield TimedMessages(
                name, frames, frames.first_byte + at[rows], payload_at[rows], sizes[rows], known, is_sound
            )


def epoch_start(frames: Frames) -> int:
    """Return the number of the first message of the last epoch in a block.

    ``len(frames)`` where there is none.
    """
    which = frames.of(scan.NOVATEL, scan.NOVATEL_TEXT)
    if not len(which):
        return len(frames)
    week_ms = frames.records(frames.offsets[which], LONG)["week_ms"].astype(np.int64)
    is_text = frames.kinds[which] == scan.NOVATEL_TEXT
    last_ms = -1
    for first in range(len(which) - 1, -1, -1):
        found = novatel_text.week_ms_of(frames, int(which[first])) if is_text[first] else int(week_ms[first])
        last_ms = found if last_ms < 0 else last_ms
        if found != last_ms:
            return int(which[first + 1])
    return int(which[0])


@np.errstate(all="ignore")  # doubles of a device may be anything
def gnss_batch(block: MessagesByName, leader: str, tally: StreamTally) -> RecordBatch | None:
    """Return one row for each position, with velocity and dilution of the same moment."""
    messages, fields = block.get(leader), block.fields(leader)
    if not isinstance(messages, TimedMessages) or fields is None:
        return None
    computed = fields["solution_status"] == _COMPUTED
    height, undulation = fields["orthometric_height"], fields["undulation"].astype(np.float64)
    kind = np.where(computed, np.minimum(fields["position_type"], _LAST_TYPE), 0)
    flat = kind == _HEIGHT_IS_GIVEN
    age_s = fields["diff_age"].astype(np.float64)
    upright = computed & ~flat
    columns = {
        "latitude_deg": Column(fields["latitude"], computed),
        "longitude_deg": Column(fields["longitude"], computed),
        "altitude_msl_m": Column(height, upright),
        "altitude_ellipsoid_m": Column(height + undulation, upright),
        "horizontal_sigma_m": Column(_root(fields, "latitude_std_dev", "longitude_std_dev"), computed),
        "vertical_sigma_m": Column(fields["height_std_dev"].astype(np.float64), upright),
        "position_north_sigma_m": Column(fields["latitude_std_dev"].astype(np.float64), computed),
        "position_east_sigma_m": Column(fields["longitude_std_dev"].astype(np.float64), computed),
        "satellites_used": Column(fields["num_soln_svs"].astype(np.float64)),
        "integrity_ok": Column(computed, ~flat),
        "fix": Column(_FIXES[kind]),
        "satellites_tracked": Column(fields["num_svs"].astype(np.float64)),
        "age_of_corrections_s": Column(age_s, np.isin(_FIXES[kind], _CORRECTED) & (age_s >= 0.0)),
    }
    columns |= _joined(block, messages, VELOCITY_OF[leader], _velocity)
    columns |= _joined(block, messages, "PSRDOP", _dilution)
    columns = credible_position(credible_dilution(columns), "gnss", messages.places, tally)
    return occupied("gnss", messages.places, messages.time(), columns)


@np.errstate(all="ignore")
def ins_batch(block: MessagesByName, source: str, tally: StreamTally) -> RecordBatch | None:
    """Return position, velocity and attitude of the receiver's inertial filter.

    For a HEADING message it is the heading of the receiver's two antennas.
    """
    messages, fields = block.get(source), block.fields(source)
    if not isinstance(messages, TimedMessages) or fields is None:
        return None
    if "HEADING" in source:
        columns = _two_antennas(fields)
    else:
        columns = _inertial(fields)
        for other, columns_of in (("INSCOV", _covariance), ("INSCOVS", _covariance), ("INSSTDEV", _spreads)):
            if "roll_std_dev" not in fields:
                columns |= _joined(block, messages, other, columns_of)
    columns = credible_attitude(credible_position(columns, "ins", messages.places, tally), messages.places, tally)
    return occupied("ins", messages.places, solution_time(messages, fields), columns)


def solution_time(messages: TimedMessages, fields: Mapping[str, NDArray[Any]]) -> Column:
    """Return the time of validity: the week and second inside the message, or of its header.

    Those of the header count where the message has none.
    """
    if "seconds" not in fields:
        return messages.time()
    week, seconds = fields["week"].astype(np.int64), fields["seconds"]
    known = (week >= FIRST_WEEK) & (week < LAST_WEEK) & (seconds >= 0.0) & (seconds < _MS_PER_WEEK / 1e3)
    ns = np.round(np.where(known, seconds, 0.0) * 1e9).astype(np.int64)
    utc_ns = gps_week_to_utc_ns(np.where(known, week, 0), ns // 1_000_000) + ns % 1_000_000
    return Column(np.where(known, utc_ns, 0), None if known.all() else known)


def _inertial(fields: Mapping[str, NDArray[Any]]) -> Columns:
    status = fields["ins_solution_status"]
    mode = np.select([np.isin(status, _ALIGNING), np.isin(status, _GOOD), status == _FREE], [1, 2, 3], 0)
    known = mode >= 2
    columns = {
        "roll_deg": Column(fields["roll"], known),
        "pitch_deg": Column(fields["pitch"], known),
        "true_heading_deg": Column(fields["azimuth"], known),
        "mode": Column(_MODES[mode], mode > 0),
        "valid": Column(known),
    }
    if "latitude" in fields:
        columns |= {
            "latitude_deg": Column(fields["latitude"], known),
            "longitude_deg": Column(fields["longitude"], known),
        }
        columns |= {f"velocity_{axis}_mps": Column(fields[f"{axis}_vel"], known) for axis in ("north", "east")}
        columns["velocity_down_mps"] = Column(-fields["up_vel"], known)
        if "height" in fields:
            columns["altitude_ellipsoid_m"] = Column(fields["height"], known)
        else:
            above_sea = fields["orthometric_height"]
            columns["altitude_msl_m"] = Column(above_sea, known)
            columns["altitude_ellipsoid_m"] = Column(above_sea + fields["undulation"], known)
    if "roll_std_dev" in fields:
        columns |= {name: Column(column.values, known) for name, column in _spreads(fields).items()}
    return columns


def _two_antennas(fields: Mapping[str, NDArray[Any]]) -> Columns:
    known = fields["solution_status"] == _COMPUTED
    return {
        "true_heading_deg": Column(fields["heading"].astype(np.float64), known),
        "true_heading_sigma_deg": Column(fields["heading_std_dev"].astype(np.float64), known),
        "mode": Column(np.full(len(known), "gnss_aided"), known),
    }


def _velocity(fields: Mapping[str, NDArray[Any]]) -> Columns:
    computed, track = fields["solution_status"] == _COMPUTED, wrap_360(fields["ground_track"])
    north, east = velocity_from_track(track, fields["horizontal_speed"])
    return {
        "velocity_north_mps": Column(north, computed),
        "velocity_east_mps": Column(east, computed),
        "velocity_down_mps": Column(-fields["vertical_speed"], computed),
        "ground_speed_mps": Column(fields["horizontal_speed"], computed),
        "track_deg": Column(track, computed),
    }


def _dilution(fields: Mapping[str, NDArray[Any]]) -> Columns:
    return {name: Column(fields[name].astype(np.float64)) for name in ("gdop", "pdop", "hdop")}


def _root(fields: Mapping[str, NDArray[Any]], *names: str) -> FloatArray:
    return np.asarray(np.sqrt(sum(np.square(fields[name].astype(np.float64)) for name in names)))


def _spreads(fields: Mapping[str, NDArray[Any]]) -> Columns:
    names = {"roll": "roll", "pitch": "pitch", "true_heading": "azimuth"}
    found = {f"{name}_sigma_deg": _root(fields, f"{source}_std_dev") for name, source in names.items()}
    found["horizontal_sigma_m"] = _root(fields, "latitude_std_dev", "longitude_std_dev")
    found["vertical_sigma_m"] = _root(fields, "height_std_dev")
    found["velocity_sigma_mps"] = _root(fields, "north_vel_std_dev", "east_vel_std_dev")
    return {name: Column(values) for name, values in found.items()}


def _covariance(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return the roots of the diagonals of the covariances.

    Position and velocity: x east, y north, z up. Attitude: about x (pitch), y (roll), z.
    """

    def root(kind: str, *axes: int) -> Column:
        return Column(np.sqrt(sum(fields[f"{kind}_cov_{axis}"] for axis in axes)))

    return {
        "pitch_sigma_deg": root("att", 1),
        "roll_sigma_deg": root("att", 5),
        "true_heading_sigma_deg": root("att", 9),
        "horizontal_sigma_m": root("pos", 1, 5),
        "vertical_sigma_m": root("pos", 9),
        "velocity_sigma_mps": root("vel", 1, 5),
    }


def _joined(block: MessagesByName, leader: TimedMessages, name: str, columns_of: Any) -> Columns:
    """Return columns of another message, on the rows of the leading one with its time."""
    other, fields = block.get(name), block.fields(name)
    if not isinstance(other, TimedMessages) or fields is None:
        return {}
    (week, week_ms, known), (other_week, other_ms, other_known) = leader.header_time(), other.header_time()
    wanted, had = week * _MS_PER_WEEK + week_ms, np.where(other_known, other_week * _MS_PER_WEEK + other_ms, -1)
    order = np.argsort(had, kind="stable")
    at = order[np.maximum(np.searchsorted(had, wanted, side="right", sorter=order) - 1, 0)]
    same = known & (had[at] == wanted)
    return {key: Column(one.values[at], same & one.mask[at]) for key, one in columns_of(fields).items()}
