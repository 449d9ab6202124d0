"""Facts that the first pass over a bag keeps of a connection.

Columns of its first messages, its stamps and log times.
"""

from collections.abc import Iterable, Sequence
from dataclasses import field, replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array
from groundstation.readers.bags import px4
from groundstation.readers.bags.clocks import Stamped
from groundstation.readers.bags.decode import Decoder
from groundstation.readers.bags.messages import Connection, ConnectionBlock
from groundstation.readers.bags.profile import MessageRule

SAMPLE = 4_000  # messages of a connection that are looked at
LOOKED_AT = 200  # messages looked at if their values stand at places that are found once
LATER = 4  # messages of each later block, where a stamp does not stand at one place in all messages
STAMPS = ("header.stamp_ns", "timestamp_ns")


@dataclass
class SeenMessages:
    """Facts seen of one connection, or of all connections of one source.

    Attributes
    ----------
    connection : Connection
    numbers : tuple of int
        Of all connections of the source that it tells of.
    rule : MessageRule, optional
        What the user's profile says of its messages.
    columns : dict of str to Column
        Of some of its first messages.
    has_header : bool
        Its stamps are those of the messages; else they are publish times.
    stamped : list of Stamped
        Stamps and log times of each of its connections.
    """

    connection: Connection
    numbers: tuple[int, ...] = ()
    rule: MessageRule | None = None
    columns: dict[str, Column] = field(default_factory=dict)
    has_header: bool = False
    stamped: list[Stamped] = field(default_factory=lambda: [Stamped()])
    _first_stamps: list[Int64Array] = field(default_factory=list)
    _looked_at: int = 0
    _stamps_kept: int = 0

    @classmethod
    def of(cls, several: Sequence["SeenMessages"]) -> "SeenMessages":
        """Join the facts of all connections of a source, in their order."""
        return replace(
            several[0],
            numbers=tuple(one.connection.number for one in several),
            columns=next((one.columns for one in several if one.columns), {}),
            has_header=any(one.has_header for one in several),
            stamped=[stamped for one in several for stamped in one.stamped],
            _first_stamps=[part for one in several for part in one._first_stamps],
        )

    @property
    def first_stamps(self) -> Int64Array:
        """Stamps of the first messages that have one."""
        return np.concatenate([np.zeros(0, dtype=np.int64), *self._first_stamps])

    def take(self, block: ConnectionBlock, decoder: Decoder) -> None:
        """Count a block, and decode some of it."""
        rows, stamp_ns = self._stamps(block, decoder)
        if len(rows):
            self.has_header = True
            kept = stamp_ns[: max(SAMPLE - self._stamps_kept, 0)]
            self._first_stamps += [kept] if len(kept) else []
            self._stamps_kept += len(kept)
        elif not self.has_header:
            rows = np.flatnonzero(block.publish_time_ns != block.log_time_ns)
            stamp_ns = block.publish_time_ns[rows]
        self.stamped[0].take(block.record_index, block.log_time_ns, rows, stamp_ns)

    def _stamps(self, block: ConnectionBlock, decoder: Decoder) -> tuple[Int64Array, Int64Array]:
        """Return the messages that have a stamp, and the stamps.

        Those of all messages where the stamp stands at one place in all, else of some.
        """
        found: list[tuple[Int64Array, Int64Array]] = []
        for part_rows, columns in self._looked_into(block, decoder):
            self.columns = self.columns or columns
            stamp_ns = self.stamp_of(columns)
            if stamp_ns is not None:
                found.append((part_rows, stamp_ns))
        name = self._stamp_name()
        placed = decoder.values_at_one_place(block, name) if name else None
        if placed is not None:
            rows, values = placed
            return rows, self._as_ns(name, values)
        if not found:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        rows = np.concatenate([part_rows for part_rows, _stamp_ns in found])
        order = np.argsort(rows)
        return rows[order], np.concatenate([stamp_ns for _rows, stamp_ns in found])[order]

    def _looked_into(self, block: ConnectionBlock, decoder: Decoder) -> Iterable[tuple[Int64Array, dict[str, Column]]]:
        """Yield some messages of a block, decoded."""
        rows = np.arange(min(len(block), SAMPLE - self._looked_at), dtype=np.int64)
        if decoder.has_places and not self.columns:
            rows = rows[:LOOKED_AT]
        elif decoder.stands_at_one_place(self._stamp_name()):  # the stamp is read without decoding the rest
            rows = rows[:0]
        elif not len(rows):
            rows = np.unique(np.linspace(0, len(block) - 1, LATER).astype(np.int64))
        self._looked_at = min(self._looked_at + len(block), SAMPLE)
        for part in decoder.decode(block.take(rows)) if len(rows) else ():
            yield rows[part.rows], part.columns

    def _stamp_name(self) -> str:
        """Return the name of the column with the time of validity."""
        if self.rule is not None and self.rule.time is not None:
            return self.rule.time[0]
        name = next((name for name in STAMPS if name in self.columns), "")
        return name or ("timestamp" if px4.is_px4(self.connection.type) and "timestamp" in self.columns else "")

    def stamp_of(self, columns: dict[str, Column]) -> Int64Array | None:
        """Return the times of validity that messages state themselves, shape (n,).

        None where they state none.
        """
        if self.rule is not None and self.rule.time is not None:
            return self.rule.stamp_ns(columns)
        name = next((name for name in (*STAMPS, "timestamp") if name in columns), "")
        if not name or (name not in STAMPS and not px4.is_px4(self.connection.type)):
            return None
        return self._as_ns(name, columns[name])

    def _as_ns(self, name: str, column: Column) -> Int64Array:
        if self.rule is not None and self.rule.time is not None:
            stamp_ns = self.rule.stamp_ns({name: column})
            assert stamp_ns is not None
            return stamp_ns
        if name in STAMPS:
            return column.values.astype(np.int64)
        stamp_us = column.values.astype(np.float64)
        return (np.where(stamp_us < 2.0**52, stamp_us, 0.0) * 1e3).astype(np.int64)
