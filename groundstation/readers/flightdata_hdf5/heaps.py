"""Heaps of text without an end; the HDF5 library reads them for ever.

This was seen with version 1.14 of the library.
"""

import struct
from typing import BinaryIO

HEAP = b"GCOL\x01\0\0\0"  # a global heap (HDF5 file format 3.0, III.E): texts of any length
HEAP_HEADER, OBJECT_HEADER = 16, 16
LARGEST_HEAP = 1 << 26
BLOCK_BYTES = 1 << 24
MOST_READ = 16  # times the size of the file: heaps do not overlap, but what is taken for one may


def endless_heaps(stream: BinaryIO, size: int) -> dict[int, bytes]:
    """Return the bytes, by place, that give an end to heaps that have none.

    The library would read such heaps for ever. ``stream``, of ``size`` bytes, is read from its beginning to its end.
    The free space of such a heap is made to reach to its end.

    Raises
    ------
    ValueError
        When there are more heaps than the file has room for.
    """
    stream.seek(0)
    at, kept, mended, read = 0, b"", dict[int, bytes](), 0
    while block := stream.read(BLOCK_BYTES):
        data, first = kept + block, at - len(kept)
        place = data.find(HEAP)
        while place >= 0:
            found, length = _without_end(stream, first + place, size)
            mended |= found
            read += length
            if read > MOST_READ * size:
                raise ValueError("heaps of text that lie in one another")
            place = data.find(HEAP, place + 1)
        at += len(block)
        kept = data[-(len(HEAP) - 1) :]
        stream.seek(at)
    return mended


def _without_end(stream: BinaryIO, at: int, file_bytes: int) -> tuple[dict[int, bytes], int]:
    """Return the right length, by place, of the object without one in a heap.

    The heap begins at ``at``. The second value is the number of bytes that were looked at.
    """
    stream.seek(at + len(HEAP))
    size = min(int.from_bytes(stream.read(8), "little"), LARGEST_HEAP)
    content = stream.read(max(min(size, file_bytes - at) - HEAP_HEADER, 0))
    place = 0
    while place + OBJECT_HEADER <= len(content):
        number, _references, _reserved, length = struct.unpack_from("<HHIQ", content, place)
        step = length if number == 0 else OBJECT_HEADER + -(-length // 8) * 8
        if step == 0:
            rest = size - HEAP_HEADER - place
            return {at + HEAP_HEADER + place + 8: rest.to_bytes(8, "little")}, len(content)
        place += step
    return {}, len(content)
