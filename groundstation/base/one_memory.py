"""Arrays in one piece of memory: the system gives larger pages for it."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

ALIGNED = 64  # bytes


def arrays_at_once(wanted: Sequence[tuple[tuple[int, ...], DTypeLike]]) -> list[NDArray[Any]]:
    """Return an array of each shape and type, none of them filled.

    Examples
    --------
    >>> [one.shape for one in arrays_at_once([((5,), "f4"), ((2, 3), "U3")])]
    [(5,), (2, 3)]
    """
    kinds = [np.dtype(kind) for _shape, kind in wanted]
    sizes = [math.prod(shape) * kind.itemsize for (shape, _kind), kind in zip(wanted, kinds, strict=True)]
    ends = np.cumsum([-(-size // ALIGNED) * ALIGNED for size in sizes]).tolist()
    memory = np.empty(ends[-1] if ends else 0, dtype=np.uint8)
    return [
        memory[start : start + size].view(kind).reshape(shape)
        for (shape, _kind), kind, size, start in zip(wanted, kinds, sizes, [0, *ends[:-1]], strict=False)
    ]
