"""Contents of the buses: terminals and subaddresses, buses and labels, how often each."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, Item, LogHeader, RecordBatch
from groundstation.base.units import NS_PER_S
from groundstation.readers.chapter10 import scan
from groundstation.readers.chapter10.bus_words import ANY_ERROR, TOPIC_429, TOPIC_1553, words_of
from groundstation.readers.icd import Icd, Message1553, Word429, labels_of

KEYS = 1 << 16  # command words; buses of a channel and labels as they stand in a word
SAMPLES = 64  # words or messages kept of each key
_KEY = "bus."


class BusNames:
    """Names of buses, as a log's header keeps them: ``bus.<channel>``.

    Examples
    --------
    >>> names = BusNames({"bus.4": "BUS1553-3", "bus.6": "1=IRS-1; 2=IRS-2"})
    >>> names.of(4), names.of(6, 2), names.of(6, 3), names.of(9)
    ('BUS1553-3', 'IRS-2', '', '')
    """

    def __init__(self, metadata: Mapping[str, str]) -> None:
        self._texts = {key.removeprefix(_KEY): text for key, text in metadata.items() if key.startswith(_KEY)}

    def of(self, channel: int, sub_channel: int | None = None) -> str:
        """Name of a 1553 channel's bus, or of a bus of a 429 channel; empty where it is not known."""
        text = self._texts.get(str(channel), "")
        if sub_channel is None:
            return text
        named = (one.partition("=") for one in text.split("; "))
        return next((name for number, _sign, name in named if number == str(sub_channel)), "")


@dataclass(frozen=True)
class OnBus:
    """Messages of one command word, or words of one label of a bus.

    Parameters
    ----------
    channel : int
    sub_channel : int or None
        Of ARINC 429; None of 1553.
    bus : str
        Its name in TMATS; empty when not said.
    key : int
        Command word, or label as a number.
    count : int
    rate_hz : float
        Mean over its span; NaN when it is there once.
    sample : ndarray
        Some of the words: uint32, shape (m,), of 429; uint16, shape (m, 36), of 1553, as recorded.
    """

    channel: int
    sub_channel: int | None
    bus: str
    key: int
    count: int
    rate_hz: float
    sample: NDArray[np.uint16] | NDArray[np.uint32] = field(repr=False, compare=False)

    @property
    def title(self) -> str:
        """Name that people use for it.

        Examples
        --------
        >>> OnBus(4, None, "", 34720, 43, 150.0, np.zeros((0, 36), np.uint16)).title
        'RT 16 T SA 29'
        >>> OnBus(7, 1, "", 0o314, 21, 70.0, np.zeros(0, np.uint32)).title
        'label 314'
        """
        if self.sub_channel is not None:
            return f"label {self.key:03o}"
        return f"RT {self.key >> 11} {'T' if self.key & 0x400 else 'R'} SA {self.key >> 5 & 31}"


def keys_1553(words: NDArray[np.uint16], block_status: NDArray[np.uint16]) -> tuple[NDArray[np.uint16], ...]:
    """Return the command words of messages, and the sender's, shape (n,) each.

    The sender's is that of messages between terminals, 0 of all others.
    """
    return words[:, 0], np.where(block_status & scan.BETWEEN_TERMINALS, words[:, 1], 0).astype(np.uint16)


def keys_429(sub_channel: NDArray[np.uint16], words: NDArray[np.uint32]) -> NDArray[np.uint16]:
    """Number of the bus from 0, and label as it stands in the word, in one number; shape (n,)."""
    return ((sub_channel.astype(np.uint32) - np.uint32(1)) << np.uint32(8) | words & np.uint32(0xFF)).astype(np.uint16)


def channel_of(topic: str) -> int:
    """Channel of a raw topic of bus words."""
    return int(topic.rpartition(".")[2])


@dataclass
class _Counts:
    """Counts by key of one channel, when each came first and last, and some rows of each."""

    count: Int64Array = field(default_factory=lambda: np.zeros(KEYS, dtype=np.int64))
    first_ns: dict[int, int] = field(default_factory=dict)
    last_ns: dict[int, int] = field(default_factory=dict)
    samples: dict[int, list[NDArray[np.uint16] | NDArray[np.uint32]]] = field(default_factory=dict)

    def add(self, keys: NDArray[np.uint16], time_ns: Int64Array, rows: NDArray[np.uint16] | NDArray[np.uint32]) -> None:
        self.count += np.bincount(keys, minlength=KEYS)
        found, first = np.unique(keys, return_index=True)
        last = len(keys) - 1 - np.unique(keys[::-1], return_index=True)[1]
        for key, at, end in zip(found.tolist(), first.tolist(), last.tolist(), strict=True):
            self.first_ns.setdefault(key, int(time_ns[at]))
            self.last_ns[key] = int(time_ns[end])
            kept = self.samples.setdefault(key, [])
            if len(kept) < SAMPLES:
                kept.extend(rows[np.flatnonzero(keys == key)[: SAMPLES - len(kept)]])

    def rate_hz(self, key: int) -> float:
        span_ns = self.last_ns[key] - self.first_ns[key]
        return float("nan") if span_ns <= 0 else float(self.count[key] - 1) * NS_PER_S / span_ns


class BusContents:
    """Counter of what is on the buses, batch by batch."""

    def __init__(self) -> None:
        self._counts: dict[str, _Counts] = {}
        self._errors: dict[str, int] = {}
        self._names = BusNames({})

    def add(self, item: Item) -> None:
        """Take in an item of a log.

        Anything but its header and batches of bus words is passed over.
        """
        if isinstance(item, LogHeader):
            self._names = BusNames(item.metadata)
        elif isinstance(item, RecordBatch) and item.topic.startswith((TOPIC_1553, TOPIC_429)):
            time_ns = item.device_time_ns.values
            counts = self._counts.setdefault(item.topic, _Counts())
            if item.topic.startswith(TOPIC_429):
                words = item.columns["word"].values.astype(np.uint32)
                counts.add(keys_429(item.columns["sub_channel"].values.astype(np.uint16), words), time_ns, words)
            else:
                messages, status = words_of(item), item.columns["block_status"].values.astype(np.uint16)
                first, second = keys_1553(messages, status)
                counts.add(first, time_ns, messages)
                if second.any():
                    counts.add(second[second > 0], time_ns[second > 0], messages[second > 0])
                errors = int(np.count_nonzero(status & ANY_ERROR))
                self._errors[item.topic] = self._errors.get(item.topic, 0) + errors

    def entries(self) -> tuple[OnBus, ...]:
        """Everything that is on the buses, by channel."""
        ordered = sorted(self._counts.items(), key=lambda one: channel_of(one[0]))
        return tuple(
            entry
            for topic, counts in ordered
            for entry in sorted(self._of(topic, counts), key=lambda one: (one.sub_channel or 0, one.key))
        )

    def _of(self, topic: str, counts: _Counts) -> Iterator[OnBus]:
        channel, is_429 = channel_of(topic), topic.startswith(TOPIC_429)
        for key in np.flatnonzero(counts.count).tolist():
            sub_channel = (key >> 8) + 1 if is_429 else None
            told = int(labels_of(np.array([key], dtype=np.uint32))[0]) if is_429 else key
            sample: Any = np.array(counts.samples[key])
            name = self._names.of(channel, sub_channel)
            yield OnBus(channel, sub_channel, name, told, int(counts.count[key]), counts.rate_hz(key), sample)

    def errors(self) -> dict[int, int]:
        """Messages with an error, by channel."""
        return {channel_of(topic): count for topic, count in sorted(self._errors.items()) if count}


def named_by(entry: OnBus, icds: Iterable[Icd]) -> tuple[Word429 | Message1553, ...]:
    """Return the words or messages of ICDs that name an entry of a bus."""
    found: list[Word429 | Message1553] = []
    for icd in icds:
        if entry.sub_channel is not None:
            sub_channel = entry.sub_channel
            found += [
                w for w in icd.words_429 if w.label == entry.key and w.is_on(entry.bus, entry.channel, sub_channel)
            ]
        else:
            messages = (one for one in icd.messages_1553 if one.is_on(entry.bus, entry.channel))
            found += [one for one in messages if entry.key in (one.transmit, one.receive)]
    return tuple(found)
