"""Conversion of MIL-STD-1553 data words to values and back, in every schema of DTS files.

Whole arrays are converted at once.

Of several words the first is the most significant. Sources: MIL-STD-1750A, 4.1.5 (floating point); IS-GPS-059 (GPS
floating point and CAPS); IEEE 754; scaling by the value of the most significant bit as in the DTS files.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.readers.icd.model import Element1553, FloatArray, Message1553
from groundstation.readers.icd.signals import turns_around

Data1553 = NDArray[np.uint16]
UInt64Array = NDArray[np.uint64]

WORDS_OF = {
    **dict.fromkeys(("SIGNED16", "UNSIGNED16", "FLOAT16"), 1),
    **dict.fromkeys(("SIGNED32", "UNSIGNED32", "FLOAT32_1750", "FLOAT32_IEEE", "FLOAT32_GPS"), 2),
    "CAPS": 3,
    **dict.fromkeys(("FLOAT64_IEEE", "FLOAT64_GPS"), 4),
}
SIGNED = ("SIGNED16", "SIGNED32", "SIGNEDBITS")
_INTEGERS = {"SIGNED16": "<i2", "UNSIGNED16": "<u2", "SIGNED32": "<i4", "UNSIGNED32": "<u4"}
GPS_BIAS = 128


def decode_1553(data: Data1553, element: Element1553) -> FloatArray:
    """Values of an element in the ICD's unit.

    Parameters
    ----------
    data : ndarray of uint16, shape (n, words)
        Data words of n messages; at least as many as the element reaches.
    element : Element1553

    Returns
    -------
    ndarray of float64, shape (n,)
        NaN where the format has a code for "undefined".

    Examples
    --------
    >>> heading = Element1553("heading", "SIGNED16", 90.0, offset=1)
    >>> decode_1553(np.array([[0, 0x4000], [0, 0xC000]], dtype=np.uint16), heading)
    array([ 90., -90.])
    """
    if element.schema in _INTEGERS:  # most of all words: as the processor has them
        words = np.ascontiguousarray(data[:, element.offset : element.offset + element.count][:, ::-1])
        return np.asarray(words.view(_INTEGERS[element.schema])[:, 0] * _scale(element), dtype=np.float64)
    field, bits = _field(data, element), _bits(element)
    if element.schema in _FLOATS:
        return _FLOATS[element.schema][0](field)
    if element.schema in SIGNED:
        unused = np.uint64(64 - bits)
        number = (field << unused).astype(np.int64) >> unused.astype(np.int64)
        return np.asarray(number * _scale(element), dtype=np.float64)
    return np.asarray(field * _scale(element), dtype=np.float64)


def usable_1553(data: Data1553, element: Element1553) -> NDArray[np.bool_]:
    """Tell whether the message says that the element is valid, shape (n,).

    All are valid where no bit says so.
    """
    bit = element.valid_if
    if bit is None:
        return np.ones(len(data), dtype=bool)
    return np.asarray(data[:, bit.offset] >> np.uint16(16 - bit.lsb) & np.uint16(1) == 1)


def encode_1553(message: Message1553, values: Mapping[str, FloatArray]) -> Data1553:
    """Encode values as data words: rounded, saturated at full scale.

    The inverse of :func:`decode_1553`.

    An angle whose full scale is a half turn goes on at its other end. Where a value is NaN its words are 0, and so is
    the bit that says it is valid; that bit is 1 elsewhere. Words that no value fills are 0.

    Parameters
    ----------
    message : Message1553
    values : mapping of an element's name to an ndarray of float64, shape (n,)
        In the ICD's units.
    """
    used = {element.name: element for element in message.elements}
    data = np.zeros((len(next(iter(values.values()))), message.word_count), dtype=np.uint16)
    invalid: dict[str, NDArray[np.bool_]] = {}
    for name, given in values.items():
        element, is_missing = used[name], np.isnan(given)
        _put(data, element, _encoded(np.where(is_missing, 0.0, given), element))
        if element.valid_if is not None:
            bit = element.valid_if.name
            invalid[bit] = invalid.get(bit, np.zeros(len(given), dtype=bool)) | is_missing
    for name, is_missing in invalid.items():
        _put(data, used[name], (~is_missing).astype(np.uint64))
    return data


def _bits(element: Element1553) -> int:
    if element.schema in WORDS_OF:
        return 16 * element.count
    return 16 * (element.count - 1) + element.lsb - element.msb + 1


def _scale(element: Element1553) -> float:
    if not element.msbval or element.schema == "ASCII":
        return 1.0
    return element.msbval / 2.0 ** (_bits(element) - (2 if element.schema in SIGNED else 1))


def _field(data: Data1553, element: Element1553) -> UInt64Array:
    """Bits of an element as whole numbers."""
    joined = np.zeros(len(data), dtype=np.uint64)
    for word in range(element.offset, element.offset + element.count):
        joined = (joined << np.uint64(16)) | data[:, word]
    if element.schema in WORDS_OF:
        return joined
    bits = _bits(element)
    mask = np.uint64((1 << bits) - 1)
    return np.asarray((joined >> np.uint64(16 - element.lsb)) & mask)


def _put(data: Data1553, element: Element1553, field: UInt64Array) -> None:
    low = 0 if element.schema in WORDS_OF else 16 - element.lsb
    shifted = field << np.uint64(low)
    for place in range(element.count):
        part = shifted >> np.uint64(16 * (element.count - 1 - place))
        data[:, element.offset + place] |= (part & np.uint64(0xFFFF)).astype(np.uint16)


def _encoded(values: FloatArray, element: Element1553) -> UInt64Array:
    if element.schema in _FLOATS:
        return _FLOATS[element.schema][1](values)
    number, bits = np.rint(values / _scale(element)), _bits(element)
    mask = np.uint64((1 << bits) - 1)
    if element.schema not in SIGNED:
        return np.clip(number, 0.0, float(mask)).astype(np.uint64)
    if not turns_around(element):
        half = 2.0 ** (bits - 1)
        number = np.clip(number, -half, half - 1.0)
    return np.asarray(number.astype(np.int64).view(np.uint64) & mask)


def _parts(field: UInt64Array, fraction_bits: int) -> tuple[NDArray[np.bool_], NDArray[np.int64], FloatArray]:
    """Split a field into sign, exponent of eight bits and fraction, laid out from the top."""
    fraction = (field & np.uint64((1 << fraction_bits) - 1)).astype(np.float64)
    exponent = ((field >> np.uint64(fraction_bits)) & np.uint64(0xFF)).astype(np.int64)
    is_negative = (field >> np.uint64(fraction_bits + 8)) & np.uint64(1) == 1
    return is_negative, exponent, fraction


def _from_gps(field: UInt64Array, fraction_bits: int) -> FloatArray:
    """Return sign x 2^(exponent - 128) x (1/2 + fraction).

    With exponent 0 it is the fraction; with exponent 0 and a sign it is undefined.
    """
    is_negative, exponent, fraction = _parts(field, fraction_bits)
    part = fraction / 2.0 ** (fraction_bits + 1)
    number = np.where(is_negative, -1.0, 1.0) * np.ldexp(0.5 + part, exponent - GPS_BIAS)
    return np.asarray(np.where(exponent == 0, np.where(is_negative, np.nan, part), number))


def _to_gps(values: FloatArray, fraction_bits: int) -> UInt64Array:
    mantissa, exponent = np.frexp(np.abs(values))  # 1/2 <= mantissa < 1
    fraction = np.rint((mantissa - 0.5) * 2.0 ** (fraction_bits + 1))
    is_carried = fraction >= 2.0**fraction_bits
    fraction, biased = np.where(is_carried, 0.0, fraction), exponent + is_carried + GPS_BIAS
    is_written = (values != 0.0) & (biased >= 1)
    biased, fraction = np.minimum(biased, 255), np.where(biased > 255, 2.0**fraction_bits - 1.0, fraction)
    top = ((values < 0.0).astype(np.int64) << 8 | biased).astype(np.uint64) << np.uint64(fraction_bits)
    return np.asarray(np.where(is_written, top | fraction.astype(np.uint64), np.uint64(0)))


def _from_caps(field: UInt64Array) -> FloatArray:
    return _from_gps(_swapped_caps(field), 39)


def _swapped_caps(field: UInt64Array) -> UInt64Array:
    """Rearrange CAPS to sign, exponent, fraction from the top.

    The last word of CAPS has the sign and the fraction's upper bits.
    """
    first, middle, last = (
        (field >> np.uint64(32)),
        (field >> np.uint64(16)) & np.uint64(0xFFFF),
        field & np.uint64(0xFFFF),
    )
    fraction = (last & np.uint64(0x7FFF)) << np.uint64(24) | middle << np.uint64(8) | first >> np.uint64(8)
    return np.asarray((last >> np.uint64(15)) << np.uint64(47) | (first & np.uint64(0xFF)) << np.uint64(39) | fraction)


def _to_caps(values: FloatArray) -> UInt64Array:
    whole = _to_gps(values, 39)
    fraction = whole & np.uint64((1 << 39) - 1)
    first = (fraction & np.uint64(0xFF)) << np.uint64(8) | (whole >> np.uint64(39)) & np.uint64(0xFF)
    middle = (fraction >> np.uint64(8)) & np.uint64(0xFFFF)
    last = (whole >> np.uint64(47)) << np.uint64(15) | fraction >> np.uint64(24)
    return np.asarray(first << np.uint64(32) | middle << np.uint64(16) | last)


def _from_1750(field: UInt64Array) -> FloatArray:
    """Convert MIL-STD-1750A floats: mantissa of 24 bits, exponent of 8, two's complement."""
    mantissa = (field.astype(np.int64) << 32) >> 40
    exponent = (field.astype(np.int64) << 56) >> 56
    return np.asarray(np.ldexp(mantissa / 2.0**23, exponent))


def _to_1750(values: FloatArray) -> UInt64Array:
    mantissa, exponent = np.frexp(values)
    number = np.rint(mantissa * 2.0**23).astype(np.int64)
    is_carried = number == 1 << 23  # two's complement: 1 does not fit, and -1/2 is written as -1
    is_half = number == -(1 << 22)
    number = np.where(is_carried, 1 << 22, np.where(is_half, -(1 << 23), number))
    exponent = exponent + is_carried - is_half
    is_small, is_large = exponent < -128, exponent > 127
    number = np.where(is_small, 0, np.where(is_large, np.where(number < 0, -(1 << 23), (1 << 23) - 1), number))
    exponent = np.where(is_small | (number == 0), 0, np.minimum(exponent, 127))
    return np.asarray(((number & 0xFFFFFF) << 8 | exponent & 0xFF).astype(np.uint64))


def _from_16(field: UInt64Array) -> FloatArray:
    """Convert floats with sign, eleven bits of mantissa, four bits of exponent to base 16."""
    mantissa = ((field >> np.uint64(4)) & np.uint64(0x7FF)).astype(np.float64)
    scale = 16.0 ** (field & np.uint64(0xF)).astype(np.float64)
    return np.asarray(np.where(field >> np.uint64(15) == 1, -mantissa, mantissa) * scale)


def _to_16(values: FloatArray) -> UInt64Array:
    magnitude, exponent = np.abs(values), np.zeros(len(values), dtype=np.int64)
    for _step in range(15):
        is_large = np.rint(magnitude) > 0x7FF
        magnitude, exponent = np.where(is_large, magnitude / 16.0, magnitude), exponent + is_large
    mantissa = np.minimum(np.rint(magnitude), 0x7FF).astype(np.int64)
    word = (values < 0.0).astype(np.int64) << 15 | mantissa << 4 | np.where(mantissa == 0, 0, exponent)
    return np.asarray(np.where(mantissa == 0, 0, word).astype(np.uint64))


_FLOATS: Mapping[str, tuple[Callable[[UInt64Array], FloatArray], Callable[[FloatArray], UInt64Array]]] = {
    "FLOAT32_IEEE": (
        lambda field: field.astype(np.uint32).view(np.float32).astype(np.float64),
        lambda values: values.astype(np.float32).view(np.uint32).astype(np.uint64),
    ),
    "FLOAT64_IEEE": (lambda field: field.view(np.float64), lambda values: values.astype(np.float64).view(np.uint64)),
    "FLOAT32_GPS": (lambda field: _from_gps(field, 23), lambda values: _to_gps(values, 23)),
    "FLOAT64_GPS": (lambda field: _from_gps(field, 55), lambda values: _to_gps(values, 55)),
    "CAPS": (_from_caps, _to_caps),
    "FLOAT32_1750": (_from_1750, _to_1750),
    "FLOAT16": (_from_16, _to_16),
}
