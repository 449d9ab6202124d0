"""Topics of the messages that are not data: text, parameters, information, drop-outs."""

from collections.abc import Iterator
from dataclasses import field
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import Column, Damage, Int64Array, RecordBatch
from groundstation.readers.ulog.blocks import UlogBlock
from groundstation.readers.ulog.messages import Keyed, keyed, logged_text

# No topic of PX4 has a dot in its name: these can be no topic of the log.
TEXT, PARAMETERS, INFORMATION, DROPOUTS = (
    f"raw.ulog.{name}" for name in ("text", "parameters", "information", "dropouts")
)
ROWS_A_BATCH = 2_048
CHARACTERS_A_BATCH = 1 << 21  # a text column is as wide as its longest text, for every row
MAX_TIME_US = (1 << 62) // 1_000 - 1  # sums and differences of two such times fit 64 bits of nanoseconds
_DEFAULTS = ((1, "system default"), (2, "default of the configuration"))


@dataclass(frozen=True)
class _Row:
    """One row of a text topic; ``width`` is the length of its longest text."""

    index: int
    time_us: int
    values: dict[str, Any]

    @property
    def width(self) -> int:
        return max((len(value) for value in self.values.values() if isinstance(value, str)), default=0)


@dataclass
class _Rows:
    """Rows that wait to become a batch."""

    rows: list[_Row] = field(default_factory=list)
    width: int = 0

    def add(self, row: _Row) -> bool:
        """Take in a row and tell whether it is time for a batch."""
        self.rows.append(row)
        self.width = max(self.width, row.width)
        return len(self.rows) == ROWS_A_BATCH or len(self.rows) * self.width > CHARACTERS_A_BATCH


@dataclass
class TextTopics:
    """Maker of the rows of text topics; counts drop-outs and unreadable messages.

    Parameters
    ----------
    start_us : int
        Time at which logging began, for what stands before the first data.
    """

    start_us: int
    unreadable: int = 0
    first_unreadable: int = 0
    dropouts: list[tuple[int, int]] = field(default_factory=list)
    _has_data: bool = False

    def batches(self, block: UlogBlock, newest_us: Int64Array) -> Iterator[RecordBatch]:
        """Yield the rows of a block's text topics.

        ``newest_us`` is the time of the newest data before each text message.
        """
        waiting: dict[str, _Rows] = {}
        for (number, kind, body), newest in zip(block.controls(), newest_us.tolist(), strict=True):
            self._has_data |= kind in "ALC"  # the first of them ends the definitions
            if kind not in "IMPQLCO":
                continue
            index, time_us = block.first_index + number, newest or self.start_us
            try:
                topic, time, values = self._read(kind, body, time_us)
                if waiting.setdefault(topic, _Rows()).add(_Row(index, time, values)):
                    yield _batch(topic, waiting.pop(topic).rows)
            except GroundstationError:
                self.first_unreadable = self.first_unreadable or index
                self.unreadable += 1
        for topic, left in waiting.items():
            yield _batch(topic, left.rows)

    def _read(self, kind: str, body: bytes, time_us: int) -> tuple[str, int, dict[str, Any]]:
        """Row of one message: topic, time and values."""
        if kind in "LC":
            line = logged_text(body, kind == "C")
            values = {"severity": line.severity, "text": line.text, "tag": line.tag}
            return TEXT, line.timestamp_us, values
        if kind == "O":
            duration = int.from_bytes(body[:2], "little")
            self.dropouts.append((time_us, duration))
            return DROPOUTS, time_us, {"duration_ms": float(duration)}
        if kind == "P":
            return _parameter(keyed(body), "changed" if self._has_data else "initial", time_us)
        if kind == "Q":
            kinds = [name for bit, name in _DEFAULTS if body[0] & bit] or ["default"]
            return _parameter(keyed(body[1:]), " and ".join(kinds), time_us)
        is_continued = kind == "M" and bool(body[0])
        fact = keyed(body[1:] if kind == "M" else body)
        values = {"name": fact.key, "text": _value_text(fact), "is_continued": is_continued}
        return INFORMATION, time_us, values

    def damages(self) -> Iterator[Damage]:
        """Drop-outs, and messages that could not be read."""
        lasting = [(time_us, ms) for time_us, ms in self.dropouts if ms]
        if lasting:
            first, last = lasting[0][0] / 1e6, lasting[-1][0] / 1e6
            place = f"at {first:.3f} s" if len(lasting) == 1 else f"{len(lasting)} times, {first:.3f} to {last:.3f} s"
            total = sum(ms for _time, ms in lasting)
            yield Damage("dropout", f"{place} since power-up", total, "milliseconds that the recorder could not write")
        if self.unreadable:
            what = "messages of text or parameters that cannot be read"
            yield Damage("corrupt", f"from message {self.first_unreadable} on", self.unreadable, what)


def _parameter(fact: Keyed, kind: str, time_us: int) -> tuple[str, int, dict[str, Any]]:
    if not isinstance(fact.value, int | float):
        raise GroundstationError("parameter", "a value that is no number")
    return PARAMETERS, time_us, {"name": fact.key, "value": float(fact.value), "kind": kind, "type": fact.type}


def _value_text(fact: Keyed) -> str:
    """Return a value as text: bytes that are no text in hexadecimal."""
    return fact.value.hex() if isinstance(fact.value, bytes) else str(fact.value)


def _batch(topic: str, rows: list[_Row]) -> RecordBatch:
    index = np.array([row.index for row in rows], dtype=np.int64)
    columns = {name: _column([row.values[name] for row in rows]) for name in rows[0].values}
    return RecordBatch(topic, index, device_time([row.time_us for row in rows]), columns)


def _column(values: list[Any]) -> Column:
    known = [value for value in values if value is not None]
    if len(known) == len(values):
        return Column(np.array(values))
    filler = np.array([0 if value is None else value for value in values], dtype=np.int64)
    return Column(filler, np.array([value is not None for value in values]))


def device_time(times_us: Any) -> Column:
    """Convert device times from microseconds to nanoseconds.

    Zero means no time, and so does a time past the largest that any clock has.
    """
    times = np.asarray(times_us, dtype=np.uint64)
    present = (times > 0) & (times <= MAX_TIME_US)
    values = np.where(present, times, 0).astype(np.int64) * 1_000
    return Column(values, None if present.all() else present)
