"""Conversion of ARINC 429 words to values and back, whole arrays at once.

Bits count from 1, label, to 32, parity.

Source: ARINC Specification 429 part 1, chapter 2 (word formats; sign/status matrix, tables 2-1 to 2-3); value of the
most significant bit as in the DTS files.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.readers.icd.model import ANY_SDI, REVERSED_BYTE, Element429, FloatArray, Status, Word429
from groundstation.readers.icd.signals import turns_around

Words429 = NDArray[np.uint32]

# Sign/status matrix, bits 31 and 30, of a value that may be used; all others say: failure, no computed data, test.
USABLE: Mapping[Status, tuple[int, ...]] = {"bnr": (3,), "bcd": (0, 3), "discrete": (0,), "none": (0, 1, 2, 3)}
NO_COMPUTED_DATA = 1
MINUS = 3  # sign/status of BCD: minus, south, west, left, from, below
SIGN_AT = 29


def status_of(words: Words429) -> NDArray[np.uint32]:
    """Sign/status matrix of words, 0 to 3, shape (n,): bit 31 is its higher bit."""
    return np.asarray((words >> np.uint32(29)) & np.uint32(3))


def has_odd_parity(words: Words429) -> NDArray[np.bool_]:
    """Tell whether the number of ones in each word is odd, as in every sound one."""
    return np.asarray(np.bitwise_count(words) & np.uint8(1) == 1)


def decode_429(words: Words429, element: Element429) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Values of an element in the ICD's unit, and whether each may be used.

    Words of even parity are not usable, nor those whose sign/status matrix says anything but normal operation (for BCD
    also minus), nor those with digits above nine. Label and SDI are for :meth:`Word429.takes`.

    Parameters
    ----------
    words : ndarray of uint32, shape (n,)
    element : Element429

    Returns
    -------
    values : ndarray of float64, shape (n,)
    usable : ndarray of bool, shape (n,)

    Examples
    --------
    >>> latitude = Element429("latitude", "SIGNEDBITS", 90.0, lsb=9, bit_count=21)
    >>> values, usable = decode_429(np.array([0x631A9D13], dtype=np.uint32), latitude)
    >>> round(float(values[0]), 4), bool(usable[0])
    (34.9195, True)
    """
    field = ((words >> np.uint32(element.lsb - 1)) & np.uint32((1 << element.bit_count) - 1)).astype(np.int64)
    status = status_of(words)
    usable = has_odd_parity(words) & np.isin(range(4), USABLE[element.status])[status]
    if element.schema == "BCD":
        digits = _digits(field, element.bit_count)
        values = np.zeros(len(words))
        for place, digit in enumerate(digits):
            values += digit * (10.0**place * element.step)
        usable &= np.logical_and.reduce([digit <= 9 for digit in digits])
        if element.status == "bcd":
            values[status == MINUS] *= -1.0
        return values, np.asarray(usable)
    sign = np.int64(1) << np.int64(element.bit_count - 1)
    if element.schema == "SIGNEDBITS":
        field = (field ^ sign) - sign
    elif element.schema == "SIGNMAG":
        field = np.where(field & sign, -(field & (sign - 1)), field)
    return np.asarray(field * step_429(element), dtype=np.float64), np.asarray(usable)


def step_429(element: Element429) -> float:
    """Value of an element's last bit, or digit, in the ICD's unit."""
    if element.schema == "BCD":
        return element.step
    below = element.bit_count - (1 if element.schema == "UNSIGNEDBITS" else 2)
    return element.msbval / 2.0**below if element.msbval else 1.0


def encode_429(word: Word429, values: Mapping[str, FloatArray], *, sdi: int = 0) -> Words429:
    """Encode values as words: rounded, of odd parity, saturated at full scale.

    The inverse of :func:`decode_429`.

    An angle whose full scale is a half turn goes on at its other end. NaN in any element becomes "no computed data".

    Parameters
    ----------
    word : Word429
    values : mapping of an element's name to an ndarray of float64, shape (n,)
        In the ICD's units. An element that is not named is 0.
    sdi : int
        Of a word that states none and whose data leave bits 9 and 10 free.
    """
    used = {element.name: element for element in word.elements}
    length = len(next(iter(values.values())))
    words = np.full(length, REVERSED_BYTE[word.label], dtype=np.int64)
    if all(element.lsb > 10 for element in word.elements):
        words |= (sdi if word.sdi == ANY_SDI else word.sdi) << 8
    missing = np.zeros(length, dtype=bool)
    status = np.full(length, USABLE[word.elements[0].status][0], dtype=np.int64)
    for name, given in values.items():
        element = used[name]
        missing |= np.isnan(given)
        number = np.where(np.isnan(given), 0.0, given)
        words |= _field(number, element) << (element.lsb - 1)
        if element.status == "bcd":
            status[number < 0.0] = MINUS
    if word.elements[0].status != "none":
        words = np.where(missing, words & 0x3FF, words) | np.where(missing, NO_COMPUTED_DATA, status) << SIGN_AT
    whole = words.astype(np.uint32)
    return np.asarray(np.where(has_odd_parity(whole), whole, whole | np.uint32(1 << 31)))


def _field(values: FloatArray, element: Element429) -> NDArray[np.int64]:
    """Bits of an element, from bit 0 upwards."""
    if element.schema == "BCD":
        number = np.rint(np.abs(values) / element.step).astype(np.int64)
        field = np.zeros(len(values), dtype=np.int64)
        for place in range((element.bit_count + 3) // 4):
            field |= number // 10**place % 10 << 4 * place
        return field & ((1 << element.bit_count) - 1)
    number = np.rint(values / step_429(element))
    full = 1 << (element.bit_count - 1)
    if element.schema == "SIGNMAG":
        magnitude = np.minimum(np.abs(number), full - 1).astype(np.int64)
        return np.where(number < 0, magnitude | full, magnitude)
    if element.schema != "SIGNEDBITS":
        return np.clip(number, 0, 2 * full - 1).astype(np.int64)
    if not turns_around(element):
        number = np.clip(number, -full, full - 1)
    return np.asarray(number.astype(np.int64) & (2 * full - 1))


def _digits(field: NDArray[np.int64], bit_count: int) -> list[NDArray[np.int64]]:
    """Return decimal digits, the last first; the first may have fewer than four bits."""
    return [(field >> place) & 0xF for place in range(0, bit_count, 4)]
