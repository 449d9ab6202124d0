"""Merge of consecutive words into samples, in the order of the log."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.nearest import nearest_rows
from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch
from groundstation.readers.chapter10 import scan
from groundstation.readers.icd.model import FloatArray
from groundstation.readers.icd.signals import TRUE_TRACK
from groundstation.readers.layout import velocity_from_track

APART_NS = 50_000_000  # words of one unit that are so near each other are one sample of both
SAMPLE_NS = 10_000_000  # a unit sends the words of a sample one after the other: 27 of a high-speed bus in this time
SPEED = "ground_speed_mps"
_TRACK = {"ins": TRUE_TRACK, "gnss": "track_deg"}
_PAIRS = (("latitude_deg", "longitude_deg"), ("velocity_north_mps", "velocity_east_mps"))
Fields: TypeAlias = Mapping[str, tuple[FloatArray, BoolArray]]


@dataclass(frozen=True, eq=False)
class WordSamples:
    """Samples of one word or message.

    Parameters
    ----------
    holder : str
        Name of the word or message.
    index, time_ns : ndarrays of int64, shape (n,)
        Increasing places; device times.
    fields : mapping of field to values and presence, shape (n,) each
    fine_of : str
        Holder to whose values these are added; empty for none.
    """

    holder: str
    index: Int64Array
    time_ns: Int64Array
    fields: Fields
    fine_of: str = ""

    def take(self, rows: Int64Array | BoolArray) -> "WordSamples":
        """Return the samples that ``rows`` selects."""
        fields = {name: (values[rows], known[rows]) for name, (values, known) in self.fields.items()}
        return replace(self, index=self.index[rows], time_ns=self.time_ns[rows], fields=fields)


def completed(kind: str, pieces: list[WordSamples], *, has_velocity: bool) -> tuple[list[WordSamples], bool]:
    """Add fine parts to pieces and join pairs.

    Returns the pieces, and whether velocities were derived from track and speed.

    Parameters
    ----------
    kind : str
        Of the topic: ``ins``, ``gnss``.
    pieces : list of WordSamples
    has_velocity : bool
        The unit tells its velocities: none are derived.
    """
    whole = [piece for piece in pieces if not piece.fine_of]
    for fine in pieces:
        if fine.fine_of:
            whole = [_with_fine(piece, fine) if piece.holder == fine.fine_of else piece for piece in whole]
    for one, other in _PAIRS:
        whole = _paired(whole, one, other)
    track = _TRACK.get(kind, "")
    if track and not has_velocity:
        whole = _paired(whole, track, SPEED)
    is_derived = False
    made = []
    for piece in whole:
        if track in piece.fields and SPEED in piece.fields and not has_velocity:
            piece, is_derived = _with_velocity(piece, track), True
        fields = {name: field for name, field in piece.fields.items() if name != TRUE_TRACK}
        made += [replace(piece, fields=fields)] if fields else []
    return made, is_derived


def _with_velocity(piece: WordSamples, track: str) -> WordSamples:
    (track_deg, has_track), (speed, has_speed) = piece.fields[track], piece.fields[SPEED]
    north, east = velocity_from_track(track_deg, speed)
    known = has_track & has_speed
    return replace(
        piece, fields={**piece.fields, "velocity_north_mps": (north, known), "velocity_east_mps": (east, known)}
    )


def _nearest(one: WordSamples, other: WordSamples) -> tuple[Int64Array, Int64Array]:
    """Return the rows of two pieces that are each other's nearest in time.

    They are near enough; there are equally many of both.
    """
    if not len(one.index) or not len(other.index):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    to_other, to_one = (nearest_rows(b.time_ns, a.time_ns, takes_later=True) for a, b in ((one, other), (other, one)))
    rows = np.arange(len(one.index))
    is_mutual = (to_one[to_other] == rows) & (np.abs(other.time_ns[to_other] - one.time_ns) <= APART_NS)
    return rows[is_mutual], to_other[is_mutual]


def _with_fine(piece: WordSamples, fine: WordSamples) -> WordSamples:
    """Add fine parts to values; a sample without one stays as it is."""
    rows, parts = _nearest(piece, fine)
    fields = dict(piece.fields)
    for name, (values, known) in piece.fields.items():
        if name in fine.fields:
            sums = values.copy()
            part, has_part = fine.fields[name]
            sums[rows] += np.where(has_part[parts], part[parts], 0.0)
            fields[name] = sums, known
    return replace(piece, fields=fields)


def _paired(pieces: list[WordSamples], first: str, second: str) -> list[WordSamples]:
    """Join two fields that come in two words into one sample.

    It has the time of the earlier word. Words without a partner stay.
    """
    ones = [piece for piece in pieces if first in piece.fields and second not in piece.fields]
    others = [piece for piece in pieces if second in piece.fields and first not in piece.fields]
    if len(ones) != 1 or len(others) != 1:
        return pieces
    one, other = ones[0], others[0]
    rows, partners = _nearest(one, other)
    a, b = one.take(rows), other.take(partners)
    both = WordSamples(
        one.holder, np.minimum(a.index, b.index), np.minimum(a.time_ns, b.time_ns), {**a.fields, **b.fields}
    )
    left = (np.setdiff1d(np.arange(len(piece.index)), used) for piece, used in ((one, rows), (other, partners)))
    rest = [piece.take(which) for piece, which in zip((one, other), left, strict=True) if len(which)]
    return [*(piece for piece in pieces if piece is not one and piece is not other), both, *rest]


def merged(topic: str, pieces: list[WordSamples], span_ns: int) -> RecordBatch | None:
    """Merge pieces into one batch in the order of the log, a record for each sample.

    A record has the time and place of its first word. Words are of one sample until one tells a field again, or comes
    more than ``span_ns`` after the first. What is not known is absent; None when nothing is known.
    """
    names = list(dict.fromkeys(name for piece in pieces for name in piece.fields))
    index = np.concatenate([piece.index for piece in pieces])
    order = np.argsort(index, kind="stable")
    time_ns = np.concatenate([piece.time_ns for piece in pieces])[order]
    bits = [sum(1 << names.index(name) for name in piece.fields) for piece in pieces]
    fields = np.repeat(np.array(bits, dtype=np.int64), [len(piece.index) for piece in pieces])[order]
    sample = np.empty(len(index), dtype=np.int64)
    count = scan.samples(time_ns, fields, span_ns, sample)
    first = np.searchsorted(sample, np.arange(count))
    place = np.empty(len(index), dtype=np.int64)
    place[order] = sample
    values = {name: np.full(count, np.nan) for name in names}
    known = {name: np.zeros(count, dtype=bool) for name in names}
    ends = np.cumsum([len(piece.index) for piece in pieces])
    for piece, end in zip(pieces, ends.tolist(), strict=True):
        at = place[end - len(piece.index) : end]
        for name, (of_piece, is_known) in piece.fields.items():
            values[name][at[is_known]] = of_piece[is_known]
            known[name][at[is_known]] = True
    occupied = np.logical_or.reduce(list(known.values()))
    columns = {
        name: Column(values[name][occupied], None if (mask := known[name][occupied]).all() else mask)
        for name in names
        if known[name].any()
    }
    if not columns:
        return None
    return RecordBatch(topic, index[order][first][occupied], Column(time_ns[first][occupied]), columns)
