"""ICD as values: the contents of each bus word, and the canonical signal of each element."""

from collections.abc import Iterator
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass

FloatArray: TypeAlias = NDArray[np.float64]
Status = Literal["bnr", "bcd", "discrete", "none"]
Transform = Literal["", "asin_deg"]

ANY_SDI = -1


@dataclass(frozen=True)
class Element:
    """One value inside a word or message.

    Parameters
    ----------
    name : str
        Unique within its word or message.
    schema : str
        How its bits make a number.
    msbval : float
        Value of the most significant bit of the magnitude, in ``unit``; 0 means that the number counts ones.
    unit : str
        As the ICD writes it.
    description : str
    signal : str, optional
        Canonical signal that it feeds: ``ins.latitude_deg``, ``ins.2.roll_deg``. None: kept under its name only.
    factor : float
        Canonical value = transformed value x factor; sign and unit are in it.
    transform : {'', 'asin_deg'}
        ``asin_deg``: the word is the sine of an angle, which is then in degrees.
    is_by_name : bool
        The signal follows from the element's name and unit; the ICD does not state it.
    """

    name: str
    schema: str
    msbval: float = 0.0
    unit: str = ""
    description: str = ""
    signal: str | None = None
    factor: float = 1.0
    transform: Transform = ""
    is_by_name: bool = False


@dataclass(frozen=True)
class Element429(Element):
    """Element of an ARINC 429 word: ``bit_count`` bits from bit ``lsb`` upwards.

    Bits count from 1 to 32. The sign bit of a signed element is its highest and counts. ``status`` says how the
    sign/status matrix is read; ``step`` is the value of the last digit of BCD. ``fine_of`` names the word whose values
    are cut off downwards; those of this element, in the same unit, are added to them, and its signal is that word's.
    """

    lsb: int = 11
    bit_count: int = 19
    status: Status = "bnr"
    step: float = 1.0
    fine_of: str = ""


@dataclass(frozen=True)
class Element1553(Element):
    """Element of a 1553 message: ``count`` words from ``offset``, high word first.

    Offset 0 is the first data word. For bits, ``msb`` is the first in the first word and ``lsb`` the last in the last
    word; 1 is the most significant bit of a word, 16 the least. ``valid_if`` names the bit element of the message that
    is 1 where this one is valid.
    """

    offset: int = 0
    count: int = 1
    msb: int = 1
    lsb: int = 16
    valid_if: "Element1553 | None" = None


@dataclass(frozen=True)
class Word429:
    """An ARINC 429 word: label of one bus.

    Parameters
    ----------
    name : str
    label : int
        As a number: octal 310 is 200.
    bus : str
        Name of the bus in TMATS (``R-x\\ANM-n-m``); empty means any.
    channel, subchannel : int, optional
        Channel id of the packets and number of the bus in them, from 1: buses of one name are told apart by them.
    sdi : int
        Source/destination identifier 0 to 3; -1 takes any and leaves bits 9 and 10 to the data.
    rate_hz : float
        As the ICD states it; 0 when it does not.
    equipment : str
        ``lru_name``.
    elements : tuple of Element429
    """

    name: str
    label: int
    bus: str = ""
    channel: int | None = None
    subchannel: int | None = None
    sdi: int = ANY_SDI
    rate_hz: float = 0.0
    equipment: str = ""
    elements: tuple[Element429, ...] = ()

    def is_on(self, bus: str, channel: int, subchannel: int) -> bool:
        """Tell whether it is a word of a bus (TMATS name, channel id, number of the bus from 1)."""
        return (
            self.bus in ("", bus)
            and self.channel in (None, channel)
            and (self.subchannel is None or self.subchannel == subchannel)
        )

    def takes(self, words: NDArray[np.uint32]) -> NDArray[np.bool_]:
        """Tell which words, of shape (n,), have its label and SDI."""
        is_label = (words & np.uint32(0xFF)) == REVERSED_BYTE[self.label]
        if self.sdi == ANY_SDI:
            return np.asarray(is_label)
        return np.asarray(is_label & (((words >> np.uint32(8)) & np.uint32(3)) == self.sdi))


@dataclass(frozen=True)
class Message1553:
    """A MIL-STD-1553 message: the command word of its sender, of its receiver, or of both.

    Parameters
    ----------
    name : str
    transmit, receive : int
        Command words; 0 when there is no such side.
    bus : str
        Name of the bus in TMATS; empty means any.
    channel : int, optional
        Channel id of the packets.
    word_count : int
        Data words, 1 to 32.
    rate_hz : float
    equipment : tuple of str
        ``lru_name`` of sender and receiver.
    elements : tuple of Element1553
    """

    name: str
    transmit: int
    receive: int
    bus: str = ""
    channel: int | None = None
    word_count: int = 32
    rate_hz: float = 0.0
    equipment: tuple[str, ...] = ()
    elements: tuple[Element1553, ...] = ()

    def is_on(self, bus: str, channel: int) -> bool:
        """Tell whether it is a message of a bus (TMATS name, channel id)."""
        return self.bus in ("", bus) and self.channel in (None, channel)

    def takes(self, commands: NDArray[np.uint16], second: NDArray[np.uint16] | None = None) -> NDArray[np.bool_]:
        """Tell which messages have its command words.

        Parameters
        ----------
        commands : ndarray of uint16, shape (n,)
            The first command word; of a transfer between terminals the receiver's.
        second : ndarray of uint16, shape (n,), optional
            The sender's command word of transfers between terminals, 0 elsewhere.
        """
        sides = [side for side in (self.transmit, self.receive) if side]
        found = np.isin(commands, sides)
        return np.asarray(found if second is None else found | np.isin(second, sides))


@dataclass(frozen=True)
class Icd:
    """An ICD: the words and messages that it names.

    ``notes`` tell what was found odd while it was read: keys that are not known here.
    """

    name: str
    words_429: tuple[Word429, ...] = ()
    messages_1553: tuple[Message1553, ...] = ()
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.words_429) + len(self.messages_1553)

    def elements(self) -> Iterator[tuple[Word429 | Message1553, Element]]:
        """Every element with the word or message that holds it."""
        for word in self.words_429:
            yield from ((word, element) for element in word.elements)
        for message in self.messages_1553:
            yield from ((message, element) for element in message.elements)


def _reversed_bytes() -> NDArray[Any]:
    bits = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1)
    return np.packbits(bits[:, ::-1], axis=1)[:, 0].astype(np.uint32)


REVERSED_BYTE = _reversed_bytes()  # the label stands with its most significant bit in bit 1
REVERSED_BYTE.flags.writeable = False


def labels_of(words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Labels of ARINC 429 words as numbers, shape (n,).

    Examples
    --------
    >>> f"{int(labels_of(np.array([0x631A9D13], dtype=np.uint32))[0]):03o}"
    '310'
    """
    return np.asarray(REVERSED_BYTE[words & np.uint32(0xFF)])
