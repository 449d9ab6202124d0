"""MCAP of other programs, read by the store's own byte-level code."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.records import Damage
from groundstation.readers.bags.definitions import plain_name
from groundstation.readers.bags.messages import Connection, ConnectionBlock, Missing, Part
from groundstation.readers.skipped import bytes_place
from groundstation.readers.source import Source

if TYPE_CHECKING:
    from groundstation.store.foreign import ForeignLost, ForeignMessages

_HEAD_BYTES = 31  # bytes of a message record before its payload


class Mcap:
    """Iterable over the messages of an MCAP.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._connections: dict[tuple[int, str, str, bytes], Connection] = {}

    def __iter__(self) -> Iterator[Part]:
        from groundstation.store.foreign import ForeignLost, ForeignMcap, ForeignMessages
        from groundstation.store.foreign import Missing as ForeignMissing

        with self._source.open() as stream:
            for found in ForeignMcap(stream, self._source.size):
                if isinstance(found, ForeignMessages):
                    messages = found.messages
                    log_ns, publish_ns = messages.head("log_time"), messages.head("publish_time")
                    yield ConnectionBlock(
                        self._connection(found),
                        messages.buffer,
                        messages.starts + _HEAD_BYTES,
                        messages.sizes - _HEAD_BYTES,
                        np.where(log_ns == 0, publish_ns, log_ns),  # some writers leave it out
                        publish_ns,
                        found.places,
                    )
                elif isinstance(found, ForeignLost):
                    yield _damage(found)
                elif isinstance(found, ForeignMissing):
                    yield Missing(found.topic, found.count, found.what)
                else:
                    what = "messages of a channel that no record of the file defines"
                    yield Damage("dropped_channel", "the whole log", found.messages, what)

    def _connection(self, found: "ForeignMessages") -> Connection:
        channel, schema = found.channel, found.schema
        kind, form, text = ("", "", b"") if schema is None else (plain_name(schema.name), schema.encoding, schema.data)
        key = channel.id, channel.message_encoding, kind, text
        if key not in self._connections:
            encoding, number = channel.message_encoding, len(self._connections)
            publisher = channel.metadata.get("callerid") or f"channel {channel.id}"  # converters of ROS 1 bags write it
            self._connections[key] = Connection(number, channel.topic, kind, encoding, form, text, publisher)
        return self._connections[key]


def _damage(lost: "ForeignLost") -> Damage:
    place = bytes_place(lost.start, lost.end) if lost.end > lost.start else f"byte {lost.start}"
    kind = "truncated" if lost.is_cut else "corrupt"
    return Damage(kind, place, lost.count, lost.what, between_records=(lost.before - 1, lost.before))
