"""Counts of values that cannot be or cannot be read, and their report at the end."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import field

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import NO_POSITION
from groundstation.base.records import AT_ODDS, HEADING_IS_TRACK, Damage, Int64Array, Item, RecordBatch, Remark
from groundstation.base.words import counted
from groundstation.readers.receiver.messages import Messages
from groundstation.readers.receiver.sentences import Sentences

MOST_SEPARATION_M = 120.0  # separation of geoid and ellipsoid; on Earth it is within 107 m
MOST_ROLL_DEG, MOST_PITCH_DEG, MOST_HEADING_DEG = 180.0, 90.0, 360.0
MOVING_MPS = 1.0
ZERO_POSITION, IMPOSSIBLE_ATTITUDE, NOT_MEASURED = "no_position", "impossible", "not_measured"
_NEARLY_ALL = 0.99
_NAMES_TOLD = 5
_REFUSED = {
    ZERO_POSITION: NO_POSITION,
    IMPOSSIBLE_ATTITUDE: f"records with a roll beyond {MOST_ROLL_DEG:g}, a pitch beyond {MOST_PITCH_DEG:g} or a "
    f"heading beyond {MOST_HEADING_DEG:g} deg: no attitude, kept as raw values alone",
}
ASTRAY, IMPOSSIBLE_DILUTION, SAME_DILUTION, HDOPS_DIFFER = AT_ODDS
_ODD = {
    ASTRAY: "altitude {alt} m, geoid {sep} m above the ellipsoid in {count}, as the receiver says, and a geoid is "
    f"never further than {MOST_SEPARATION_M:.0f} m from it: no height above the sea (altitude_msl_m); "
    "their sum is kept as the one "
    "above the ellipsoid (altitude_ellipsoid_m)",
    NOT_MEASURED: "{count} simulated or entered by hand, as the receiver says: integrity_ok is false",
    IMPOSSIBLE_DILUTION: "GSA says PDOP {PDOP}, HDOP {HDOP} and VDOP {VDOP} in {count}, which cannot be, as PDOP² = "
    "HDOP² + VDOP²: its HDOP and VDOP are something else, accuracies in metres perhaps, and are left out",
    SAME_DILUTION: "the HDOP of GGA or GNS ({HDOP}) is the PDOP of that GSA in {count}: one number with two names, "
    "kept as PDOP",
    HDOPS_DIFFER: "HDOP differs between sentences in {count}: {values}; that of GGA is taken, else of GNS",
}
_FIELDS = {
    ASTRAY: ("altitude_ellipsoid_m",),
    NOT_MEASURED: ("fix",),
    IMPOSSIBLE_DILUTION: ("pdop",),
    SAME_DILUTION: ("pdop",),
    HDOPS_DIFFER: ("hdop",),
}
SHORTER, OTHER_LENGTH, ODD_TEXT = "shorter", "of another length", "odd text"
_LENGTHS = {
    SHORTER: "messages shorter than their layout: only the fields that they have are kept",
    OTHER_LENGTH: "messages of another length than their layout: what does not fit it is not read",
    ODD_TEXT: "messages in text that do not fit their layout: only their text is kept",
}


@dataclass
class StreamTally:
    """Counts of odd rows, messages and cells by kind, each with the byte of the first.

    Parameters
    ----------
    bare : int
        Sentences without a checksum.
    """

    bare: int = 0
    _rows: Counter[tuple[str, str]] = field(default_factory=Counter)
    _lengths: Counter[tuple[str, str]] = field(default_factory=Counter)
    _cells: Counter[tuple[str, str]] = field(default_factory=Counter)
    _first: dict[tuple[str, str], int] = field(default_factory=dict)
    _ranges: dict[tuple[str, str], dict[str, tuple[float, float]]] = field(default_factory=dict)
    _as_track: int = 0
    _moving: int = 0
    _fixes: int = 0
    _positions: int = 0
    _most_satellites: float = 0.0

    def add(self, what: str, topic: str, places: Int64Array, **values: FloatArray) -> None:
        """Count rows, which begin at ``places``, and keep the ends of their values."""
        self._count(self._rows, (what, topic), places)
        for name, some in values.items() if len(places) else ():
            least, most = self._ranges.setdefault((what, topic), {}).get(name, (np.inf, -np.inf))
            self._ranges[what, topic][name] = (min(least, float(some.min())), max(most, float(some.max())))

    def add_lengths(self, messages: Messages, is_poll: bool) -> None:
        """Count the messages whose payload does not fit their layout.

        A message that asks for an answer has no payload.
        """
        if messages.is_short and not is_poll:
            self._count(self._lengths, (SHORTER, messages.name), messages.places)
        if messages.layout is None and not messages.is_sound:
            self._count(self._lengths, (ODD_TEXT, messages.name), messages.places)
        self._count(self._lengths, (OTHER_LENGTH, messages.name), messages.places[messages.misfits()])

    def add_cells(self, sentences: Sentences) -> None:
        """Count the fields of sentences that are no number."""
        for name, count in sentences.unreadable.items():
            self._cells[sentences.address, name] += count

    def add_headings(self, as_track: int, moving: int) -> None:
        """Count fixes of a moving vehicle, and those of them whose heading is their track."""
        self._as_track, self._moving = self._as_track + as_track, self._moving + moving

    def add_fixes(self, gnss: RecordBatch) -> None:
        """Count rows of ``gnss``, and those with a position."""
        self._fixes += len(gnss)
        if "latitude_deg" in gnss.columns:
            self._positions += int(np.count_nonzero(gnss.columns["latitude_deg"].mask))
        used = gnss.columns.get("satellites_used")
        if used is not None and used.mask.any():
            self._most_satellites = max(self._most_satellites, float(used.values[used.mask].max()))

    def _count(self, counter: Counter[tuple[str, str]], key: tuple[str, str], places: Int64Array) -> None:
        if len(places):
            counter[key] += len(places)
            self._first.setdefault(key, int(np.min(places)))

    def _odd(self, what: str, topic: str, count: int) -> str:
        """Return what is odd of some rows, with the values that they have."""
        ranges = {name: _range(*ends) for name, ends in self._ranges.get((what, topic), {}).items()}
        values = ", ".join(f"{text} ({name})" for name, text in ranges.items())
        noun = counted(count, "fix", "fixes") if what == NOT_MEASURED else counted(count, "row")
        verb = (" is" if count == 1 else " are") if what == NOT_MEASURED else ""
        return _ODD[what].format(count=f"{noun}{verb}", values=values, **ranges)

    def items(self, counts: Counter[str]) -> Iterator[Item]:
        """Yield remarks and damage; the raw topics keep what was refused.

        ``counts`` are those of all messages and sentences by name.
        """
        if not self._positions:
            most = f"{'at most ' if self._most_satellites else ''}{self._most_satellites:g} satellites"
            why = f"GNSS never had a fix: {self._fixes} rows, {most}; "
            yield Remark("no_position", f"no position in this file: {why if self._fixes else ''}{_named(counts)}")
        if self.bare:
            yield Remark("no_checksum", "sentences without a checksum: a damaged number is not seen")
        if self._moving and self._as_track >= _NEARLY_ALL * self._moving:
            text = (
                f"heading and track are the same in {self._as_track} of {self._moving} fixes above {MOVING_MPS:g} m/s: "
                "the receiver lets the nose point along the motion, so its heading is no second measurement"
            )
            yield Remark(HEADING_IS_TRACK, text, "ins", ("true_heading_deg",))
        for (what, topic), count in sorted(self._rows.items()):
            if what in _ODD:
                yield Remark(what, self._odd(what, topic, count), topic, _FIELDS[what])
            else:
                place = f"{topic}, the first at byte {self._first[what, topic]}"
                yield Damage(what, place, count, _REFUSED[what], topic, loses_data=False)
        for (how, name), count in sorted(self._lengths.items()):
            place = f"{name}, the first at byte {self._first[how, name]}"
            if how == ODD_TEXT:
                yield Remark("odd_text", f"{_LENGTHS[how]}: {count} ({place})", f"raw.{name}")
            else:
                yield Damage("corrupt", place, count, _LENGTHS[how])
        for (address, name), count in sorted(self._cells.items()):
            topic = f"raw.{address}"
            yield Damage("unreadable_cells", f"{topic}.{name}", count, "cells that are no number", topic)


def _range(least: float, most: float) -> str:
    """Return least and largest value, once where they are the same.

    Examples
    --------
    >>> _range(0.0, 0.0), _range(1382.35, 1397.1)
    ('0', '1382.35 to 1397.1')
    """
    texts = list(dict.fromkeys(f"{value:.2f}".rstrip("0").rstrip(".") for value in (least, most)))
    return " to ".join(texts)


def _named(counts: Counter[str]) -> str:
    names = ", ".join(f"{name} ({count})" for name, count in counts.most_common(_NAMES_TOLD))
    return names + (" and others" if len(counts) > _NAMES_TOLD else "")
