"""Epochs of NMEA sentences, their times, and the canonical topics that they give together.

A sentence with a time belongs to the epoch of that time, one without to the epoch that is open. A time in whole seconds
without a fraction is the same as any within that second: some receivers cut the fraction off in RMC.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from groundstation.base.angles import wrap_360
from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch
from groundstation.base.units import MPS_PER_KMH, MPS_PER_KNOT, NS_PER_S
from groundstation.readers.layout import velocity_from_track
from groundstation.readers.receiver.sentences import TIMED, Sentences, time_of_day_ns
from groundstation.readers.receiver.stream import Frames
from groundstation.readers.receiver.times import Anchors, calendar_ns

Columns = dict[str, Column]
MOST_SEPARATION_M = 120.0  # of geoid and ellipsoid; on Earth they are within 107 m
_NOT_TIMED = -1
_TIME_FIELD = {"GLL": 4}
_QUALITY = np.array(
    ["none", "3d", "dgnss", "3d", "rtk_fixed", "rtk_float", "dead_reckoning", "other", "other", "dgnss", "ppp"]
)
_CENTURY = 80  # two digits of a year from here on are of the last century


@dataclass(frozen=True, eq=False)
class Epochs:
    """Epochs of a block.

    Parameters
    ----------
    sentences : mapping of address to Sentences
    epoch : mapping of address to ndarray of int64
        Number of the epoch of each sentence, -1 before the first.
    day_ns : ndarray of int64, shape (n,)
        Time of the day of each epoch.
    places : ndarray of int64, shape (n,)
        Byte of the file at which each begins.
    """

    sentences: Mapping[str, Sentences]
    epoch: Mapping[str, Int64Array]
    day_ns: Int64Array
    places: Int64Array

    def __len__(self) -> int:
        return len(self.day_ns)

    def time_of(self, address: str, time: Column) -> Column:
        """Time of each sentence, given that of the epochs."""
        epoch = self.epoch[address]
        if not len(self):
            return Column(np.zeros(len(epoch), dtype=np.int64), np.zeros(len(epoch), dtype=bool))
        at = np.maximum(epoch, 0)
        return Column(time.values[at], time.mask[at] & (epoch >= 0))

    def of(self, *formatters: str) -> list[tuple[Sentences, Int64Array]]:
        """Sentences with a formatter, those of combined solutions (GN) last, and their epochs."""
        found = [one for one in self.sentences.values() if one.formatter in formatters]
        return [(one, self.epoch[one.address]) for one in sorted(found, key=lambda one: one.address.startswith("GN"))]

    def values(self, formatter: str, names: tuple[str, ...]) -> Columns:
        """Fields of a formatter by epoch; where an epoch has several such sentences the last that has the field."""
        columns: Columns = {}
        for sentences, epoch in self.of(formatter):
            for name in names:
                column = sentences.columns[name]
                before = columns.get(name)
                values = np.zeros(len(self), dtype=column.values.dtype) if before is None else before.values.copy()
                present = np.zeros(len(self), dtype=bool) if before is None else before.mask.copy()
                rows = column.mask & (epoch >= 0)
                if column.values.dtype.kind == "U":
                    values = values.astype(np.result_type(values.dtype, column.values.dtype))
                values[epoch[rows]], present[epoch[rows]] = column.values[rows], True
                columns[name] = Column(values, present)
        return columns


def epochs_of(sentences: Mapping[str, Sentences]) -> Epochs:
    """Put the sentences of a block into epochs."""
    which, day_ns, is_whole = [], [], []
    for one in sentences.values():
        if one.formatter in TIMED:
            value, behind, state = one.numbers(_TIME_FIELD.get(one.formatter, 0))
            told_ns, sound = time_of_day_ns(value, behind)
            which.append(one.which)
            day_ns.append(np.where(sound & (state == 1), told_ns, _NOT_TIMED))
            is_whole.append(behind == 0)
    nothing = np.zeros(0, dtype=np.int64)
    order = np.argsort(np.concatenate([nothing, *which]), kind="stable")
    timed, told_ns = np.concatenate([nothing, *which])[order], np.concatenate([nothing, *day_ns])[order]
    whole = np.concatenate([np.zeros(0, dtype=bool), *is_whole])[order]
    has_time = told_ns >= 0
    timed, told_ns, whole = timed[has_time], told_ns[has_time], whole[has_time]
    told_ns = _with_fractions(told_ns, whole)
    is_new = np.append(True, told_ns[1:] != told_ns[:-1]) if len(told_ns) else np.zeros(0, dtype=bool)
    starts = timed[is_new]
    epoch = {
        address: np.searchsorted(starts, one.which, side="right").astype(np.int64) - 1
        for address, one in sentences.items()
    }
    frames = next(iter(sentences.values())).frames if sentences else None
    places = nothing if frames is None else frames.places[starts]
    return Epochs(sentences, epoch, told_ns[is_new], places)


def _with_fractions(told_ns: Int64Array, is_whole: BoolArray) -> Int64Array:
    """Times in whole seconds that stand behind one with a fraction in the same second take that time."""
    if not len(told_ns) or not is_whole.any() or is_whole.all():
        return told_ns
    last = np.maximum.accumulate(np.where(is_whole, -1, np.arange(len(told_ns))))
    before_ns = np.where(last >= 0, told_ns[np.maximum(last, 0)], _NOT_TIMED)
    is_same = is_whole & (before_ns // NS_PER_S * NS_PER_S == told_ns)
    return np.where(is_same, before_ns, told_ns)


def epoch_start(frames: Frames, sentences: Mapping[str, Sentences]) -> int:
    """Number of the frame with which the last second of a block begins, ``len(frames)`` where none has a time."""
    epochs = epochs_of(sentences)
    if not len(epochs):
        return len(frames)
    seconds = epochs.day_ns // NS_PER_S
    earlier = np.flatnonzero(seconds != seconds[-1])
    first = epochs.places[earlier[-1] + 1] if len(earlier) else epochs.places[0]
    return int(np.searchsorted(frames.places, first))


def full_times(sentences: Mapping[str, Sentences]) -> tuple[Int64Array, Int64Array]:
    """Places and UTC nanoseconds of the sentences that tell date and time: RMC (two digits of the year) and ZDA.

    Where an RMC calls its fix valid those that do not are left out: before it a receiver guesses.
    """
    places, utc_ns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for one in sentences.values():
        if one.formatter not in ("RMC", "ZDA"):
            continue
        value, behind, state = one.numbers(0)
        day_ns, sound = time_of_day_ns(value, behind)
        sound = sound & (state == 1)
        if one.formatter == "RMC":
            date, _behind, state = one.numbers(8)
            day, month, year = date // 10_000, date // 100 % 100, date % 100
            year = year + np.where(year < _CENTURY, 2000, 1900)
            is_valid = one.texts(1).values == "A"
            sound &= (state == 1) & (is_valid | ~is_valid.any())
        else:
            (day, _d, has_day), (month, _m, has_month), (year, _y, has_year) = (one.numbers(at) for at in (1, 2, 3))
            sound &= (has_day == 1) & (has_month == 1) & (has_year == 1)
        midnight_ns, exists = calendar_ns(year, month, day)
        sound &= exists
        places.append(one.places[sound])
        utc_ns.append((midnight_ns + day_ns)[sound])
    return np.concatenate(places), np.concatenate(utc_ns)


def gnss_batch(epochs: Epochs, time: Column) -> tuple[RecordBatch | None, int]:
    """One row an epoch that has a fix, or the word that there is none; and in how many rows the separation of geoid
    and ellipsoid cannot be one."""
    columns: Columns = {}
    for formatter in ("GLL", "RMC", "GNS", "GGA"):  # the last that has a position gives it
        columns |= _merged(columns, _position(epochs, formatter))
    astray = _heights(epochs, columns)
    columns |= _velocity(epochs)
    columns |= _quality(epochs)
    columns = {name: column for name, column in columns.items() if column.mask.any()}
    if not len(epochs) or not columns:
        return None, 0
    rows: BoolArray = np.logical_or.reduce([column.mask for column in columns.values()])
    return RecordBatch("gnss", epochs.places, time, columns).take(rows), astray


def _merged(columns: Columns, newer: Columns) -> Columns:
    """The newer values where there are any, the older ones elsewhere."""
    merged = {}
    for name, column in newer.items():
        before = columns.get(name)
        if before is not None:
            values = np.where(column.mask, column.values, before.values)
            column = Column(values, column.mask | before.mask)
        merged[name] = column
    return merged


def _position(epochs: Epochs, formatter: str) -> Columns:
    names = {"GGA": "quality", "RMC": "status", "GLL": "status", "GNS": "posMode"}
    found = epochs.values(formatter, ("lat", "lon", names[formatter]))
    if not found:
        return {}
    word = found[names[formatter]]
    valid = _has_fix(formatter, word)
    return {
        "latitude_deg": Column(found["lat"].values, found["lat"].mask & found["lon"].mask & valid),
        "longitude_deg": Column(found["lon"].values, found["lat"].mask & found["lon"].mask & valid),
    }


def _has_fix(formatter: str, word: Column) -> BoolArray:
    if formatter == "GGA":
        return np.asarray(word.mask & (word.values > 0))
    if formatter == "GNS":
        modes = np.char.strip(word.values.astype(str), "N")
        return np.asarray(word.mask & (modes != ""))
    return np.asarray(word.mask & (word.values == "A"))


def _heights(epochs: Epochs, columns: Columns) -> int:
    """Heights of GGA or GNS: above the sea, and with the separation above the ellipsoid. Returns how many of the
    separations cannot be one: the sum is the height above the ellipsoid all the same, the rest is left out."""
    astray = 0
    for formatter, word in (("GNS", "posMode"), ("GGA", "quality")):
        found = epochs.values(formatter, ("alt", "sep", word))
        if not found:
            continue
        valid = _has_fix(formatter, found[word])
        has_height, has_both = found["alt"].mask & valid, found["alt"].mask & found["sep"].mask & valid
        is_astray = has_both & (np.abs(found["sep"].values) > MOST_SEPARATION_M)
        astray = int(is_astray.sum())
        heights = {
            "altitude_msl_m": Column(found["alt"].values, has_height & ~is_astray),
            "altitude_ellipsoid_m": Column(found["alt"].values + found["sep"].values, has_both),
        }
        columns |= _merged(columns, heights)
    return astray


def _velocity(epochs: Epochs) -> Columns:
    """Speed and track of RMC, which has a time; of VTG where there is no RMC."""
    found = epochs.values("RMC", ("status", "spd", "cog"))
    if found:
        valid = found["status"].mask & (found["status"].values == "A")
        speed = Column(found["spd"].values * MPS_PER_KNOT, found["spd"].mask & valid)
        track = Column(found["cog"].values, found["cog"].mask & valid)
    else:
        found = epochs.values("VTG", ("cogt", "sogn", "sogk"))
        if not found:
            return {}
        in_knots, in_kmh = found["sogn"].values * MPS_PER_KNOT, found["sogk"].values * MPS_PER_KMH
        speed = Column(np.where(found["sogn"].mask, in_knots, in_kmh), found["sogn"].mask | found["sogk"].mask)
        track = found["cogt"]
    both = speed.mask & track.mask
    north, east = velocity_from_track(track.values, speed.values)
    return {
        "ground_speed_mps": speed,
        "track_deg": Column(wrap_360(track.values), track.mask),
        "velocity_north_mps": Column(north, both),
        "velocity_east_mps": Column(east, both),
    }


def _quality(epochs: Epochs) -> Columns:
    columns: Columns = {}
    dilution = epochs.values("GSA", ("PDOP", "HDOP"))
    if dilution:
        columns |= {"pdop": dilution["PDOP"], "hdop": dilution["HDOP"]}
    for formatter in ("GNS", "GGA"):
        found = epochs.values(formatter, ("HDOP", "numSV"))
        if found:
            columns |= _merged(columns, {"hdop": found["HDOP"], "satellites_used": found["numSV"]})
    spread = epochs.values("GST", ("stdLat", "stdLong", "stdAlt"))
    if spread:
        both = spread["stdLat"].mask & spread["stdLong"].mask
        columns["horizontal_sigma_m"] = Column(np.hypot(spread["stdLat"].values, spread["stdLong"].values), both)
        columns["vertical_sigma_m"] = spread["stdAlt"]
    return columns | _fix(epochs)


def _fix(epochs: Epochs) -> Columns:
    columns: Columns = {}
    status = epochs.values("RMC", ("status",))
    if status:
        columns["integrity_ok"] = Column(status["status"].values == "A", status["status"].mask)
    found = epochs.values("GGA", ("quality",))
    if found:
        quality = found["quality"]
        number = np.clip(quality.values, 0, len(_QUALITY) - 1).astype(np.int64)
        columns["fix"] = Column(_QUALITY[number], quality.mask)
        columns |= {"integrity_ok": _and(columns.get("integrity_ok"), Column(quality.values > 0, quality.mask))}
    return columns


def _and(one: Column | None, other: Column) -> Column:
    if one is None:
        return other
    values = np.where(one.mask, one.values, True) & np.where(other.mask, other.values, True)
    return Column(np.asarray(values), one.mask | other.mask)


def _heading(sentences: Sentences) -> Columns:
    """Heading by HDT, THS (true), HDM (magnetic), and attitude by PASHR."""
    columns = sentences.columns
    match sentences.formatter:
        case "HDT":
            return {"true_heading_deg": columns["headingT"]}
        case "THS":
            is_good = columns["mi"].mask & np.isin(columns["mi"].values, ("A", "E"))
            return {"true_heading_deg": Column(columns["headt"].values, columns["headt"].mask & is_good)}
        case "HDM":
            return {"magnetic_heading_deg": columns["headingM"]}
        case "PASHR":
            is_good = columns["gnssQual"].mask & (columns["gnssQual"].values > 0)
            is_good |= columns["imuAlign"].mask & (columns["imuAlign"].values > 0)
            is_good |= ~columns["gnssQual"].mask & ~columns["imuAlign"].mask
            names = {"true_heading": ("trueHdg", "hdgAcc"), "roll": ("roll", "rollAcc"), "pitch": ("pitch", "pitchAcc")}
            found = {}
            for name, (angle, accuracy) in names.items():
                found[f"{name}_deg"] = Column(columns[angle].values, columns[angle].mask & is_good)
                found[f"{name}_sigma_deg"] = Column(columns[accuracy].values, columns[accuracy].mask & is_good)
            return found
    return {}


HEADING_FORMATTERS = ("PASHR", "HDT", "THS", "HDM")  # the first that a log has is ``ins``


def ins_batch(epochs: Epochs, formatter: str, time: Column, mode: str) -> RecordBatch | None:
    """Attitude of the vehicle from the sentences with a formatter, one row each."""
    for sentences, _epoch in epochs.of(formatter):
        columns = _heading(sentences)
        for name in ("true_heading_deg", "magnetic_heading_deg"):
            if name in columns:
                columns[name] = Column(wrap_360(columns[name].values), columns[name].present)
                columns["mode"] = Column(np.full(len(sentences), mode), columns[name].present)
        rows: BoolArray = np.logical_or.reduce([column.mask for column in columns.values()])
        if rows.any():
            batch = RecordBatch("ins", sentences.places, epochs.time_of(sentences.address, time), columns)
            return batch.take(rows)
    return None


def day_times(epochs: Epochs, anchors: Anchors) -> Column:
    """UTC of the epochs; the time of the day where the date is nowhere told."""
    return anchors.of_day(epochs.places, epochs.day_ns)
