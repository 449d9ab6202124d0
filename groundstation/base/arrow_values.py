"""Arrow arrays to numpy and back by their buffers.

pyarrow's own conversions, from Python values as well as to numpy, import pandas where it is installed: a third of a
second for a log that needs nothing of it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from groundstation.base import arrow_compute as pc
from groundstation.base.records import BoolArray

_FLOATS = {"float": "float32", "double": "float64"}  # to numpy "float" is one of 64 bits
NO_TEXT = pa.nulls(1, pa.string())[0]


def texts(words: Sequence[str]) -> Any:
    """An array of text.

    Examples
    --------
    >>> texts(["nav", "σ"]).to_pylist()
    ['nav', 'σ']
    """
    coded = [word.encode() for word in words]
    ends = np.cumsum([0, *map(len, coded)], dtype=np.int32)
    return pa.Array.from_buffers(pa.string(), len(words), [None, pa.py_buffer(ends), pa.py_buffer(b"".join(coded))])


def flags(mask: BoolArray) -> Any:
    """An array of bools.

    Examples
    --------
    >>> flags(np.array([True, False])).to_pylist()
    [True, False]
    """
    bits = pa.py_buffer(np.packbits(mask, bitorder="little"))
    return pa.Array.from_buffers(pa.bool_(), len(mask), [None, bits])


EMPTY_TEXT = texts([""])[0]
FALSE = flags(np.zeros(1, dtype=bool))[0]


def mask(array: Any) -> BoolArray:
    """Bools of an arrow array without nulls, shape (n,).

    Examples
    --------
    >>> mask(flags(np.array([True, False, True]))[1:]).tolist()
    [False, True]
    """
    bits = np.frombuffer(array.buffers()[1], np.uint8) if len(array) else np.zeros(0, np.uint8)
    return np.unpackbits(bits, count=array.offset + len(array), bitorder="little")[array.offset :].astype(bool)


def is_valid(array: Any) -> BoolArray:
    """Return a mask, shape (n,), that is true where an array has a value."""
    return mask(pc.is_valid(array)) if array.null_count else np.ones(len(array), dtype=bool)


def values(array: Any, filler: float | int) -> NDArray[Any]:
    """Numbers of an arrow array, the filler where null, shape (n,).

    Examples
    --------
    >>> values(pc.cast(texts(["1.5", "2"]), pa.float64()), 0.0).tolist()
    [1.5, 2.0]
    >>> values(pc.cast(texts(["1.5", "2"]), pa.float32())[1:], 0.0).tolist()
    [2.0]
    """
    dtype = np.dtype(_FLOATS.get(str(array.type), str(array.type)))
    if not len(array):
        return np.zeros(0, dtype)
    numbers = np.frombuffer(array.buffers()[1], dtype, count=len(array), offset=array.offset * dtype.itemsize)
    return np.where(is_valid(array), numbers, dtype.type(filler)) if array.null_count else numbers


def column(array: Any) -> NDArray[Any]:
    """Return the values of an array or a chunked array, shape (n,), like ``to_numpy``.

    Numbers and bools keep their type, text becomes objects. Arrays with nulls and other types, which our own files do
    not have, are left to pyarrow.

    Examples
    --------
    >>> column(pa.chunked_array([texts(["a"]), texts(["b"])])).tolist()
    ['a', 'b']
    >>> column(flags(np.array([True, False]))).tolist(), column(pa.nulls(1, pa.float64())).tolist()
    ([True, False], [nan])
    """
    whole = array.combine_chunks() if isinstance(array, pa.ChunkedArray) else array
    kind = whole.type
    if whole.null_count == 0:
        if pa.types.is_boolean(kind):
            return mask(whole)
        if pa.types.is_integer(kind) or str(kind) in _FLOATS:
            return values(whole, 0)
        if pa.types.is_string(kind):
            return np.array(whole.to_pylist(), dtype=object)
    return np.asarray(whole.to_numpy(zero_copy_only=False))
