"""What the HDF5 library takes on trust: heaps of text that end, and pieces of data as long as they should be.

The library reads a heap whose free space has no length for ever, and hands out whatever stood in memory where a piece
unpacks to less than its samples take (both seen with its version 1.14).
"""

import struct
import zlib
from typing import Any, BinaryIO

HEAP = b"GCOL"  # a global heap (HDF5 file format 3.0, III.E): texts of any length
HEAP_HEADER, OBJECT_HEADER = 16, 16
LARGEST_HEAP = 1 << 26
BLOCK_BYTES = 1 << 24
DEFLATE, SHUFFLE, FLETCHER32 = 1, 2, 3
CHECKSUM_BYTES = 4


def endless_heaps(stream: BinaryIO) -> dict[int, bytes]:
    """What has to stand where so that heaps end that the library would read for ever: bytes by their place.

    ``stream`` is read from its beginning to its end. The free space of such a heap is made to reach to its end.
    """
    stream.seek(0)
    at, kept, mended = 0, b"", dict[int, bytes]()
    while block := stream.read(BLOCK_BYTES):
        data, first = kept + block, at - len(kept)
        place = data.find(HEAP)
        while place >= 0:
            mended |= _without_end(stream, first + place)
            place = data.find(HEAP, place + 1)
        at += len(block)
        kept = data[-(len(HEAP) - 1) :]
        stream.seek(at)
    return mended


def _without_end(stream: BinaryIO, at: int) -> dict[int, bytes]:
    """The length of the object that has none in the heap that begins there, as it should be, by its place."""
    stream.seek(at + 8)
    size = min(int.from_bytes(stream.read(8), "little"), LARGEST_HEAP)
    content = stream.read(max(size - HEAP_HEADER, 0))
    place = 0
    while place + OBJECT_HEADER <= len(content):
        number, _references, _reserved, length = struct.unpack_from("<HHIQ", content, place)
        step = length if number == 0 else OBJECT_HEADER + -(-length // 8) * 8
        if step == 0:
            rest = size - HEAP_HEADER - place
            return {at + HEAP_HEADER + place + 8: rest.to_bytes(8, "little")}
        place += step
    return {}


def check_pieces(dataset: Any, first: int, last: int, checked: set[int]) -> None:
    """Refuse samples [first, last) of a dataset in which a piece has another length than its samples take.

    Parameters
    ----------
    dataset : h5py.Dataset
        In one row, in pieces or not; pieces packed in ways other than deflate and shuffle are not looked at.
    first, last : int
    checked : set of int
        Pieces that were found sound before; those found now are added.

    Raises
    ------
    ValueError
        With the piece and both lengths.
    """
    if not dataset.chunks:
        return
    layout, samples = dataset.id.get_create_plist(), dataset.chunks[0]
    filters = [layout.get_filter(number)[0] for number in range(layout.get_nfilters())]
    if set(filters) - {DEFLATE, SHUFFLE, FLETCHER32}:
        return
    for number in range(first // samples, -(-last // samples)):
        if number not in checked:
            left_out, packed = dataset.id.read_direct_chunk((number * samples,))
            length = _unpacked(packed, filters, left_out, samples * dataset.id.get_type().get_size())
            if length != samples * dataset.id.get_type().get_size():
                raise ValueError(f"piece {number} of {length} bytes")
            checked.add(number)


def _unpacked(packed: bytes, filters: list[int], left_out: int, most: int) -> int:
    """Bytes that a piece unpacks to, ``most`` + 1 where they are more; bit n of ``left_out``: filter n was not used."""
    used = [kind for number, kind in enumerate(filters) if not left_out >> number & 1]
    if FLETCHER32 in used:
        packed = packed[:-CHECKSUM_BYTES]
    if DEFLATE not in used:
        return len(packed)
    try:
        return len(zlib.decompressobj().decompress(packed, most + 1))
    except zlib.error as error:
        raise ValueError(f"a piece that does not unpack ({error})") from error
