"""Places of a dataset's samples in the file, and which of them can be believed.

The library gives zeros for samples that were never written, and whatever stood in memory where a piece unpacks to less
than its samples take. So each dataset is placed first: in one block, in its header, or in pieces.
"""

import zlib
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any

from h5py import h5d

from groundstation.base.dataclasses import dataclass

DEFLATE, SHUFFLE, FLETCHER32, LZF = 1, 2, 3, 32_000
FILTERS = frozenset((DEFLATE, SHUFFLE, FLETCHER32, LZF))
CHECKSUM_BYTES = 4
MOST_PIECE_BYTES = 1 << 26
NEVER_WRITTEN = "never written"
_LITERAL, _LONG = 32, 7  # LZF: first control byte of a copy, length that has one more byte


@dataclass(frozen=True)
class StoredChunk:
    """Piece of a dataset: its place and bytes in the file, and the filters left out (bits)."""

    place: int
    nbytes: int
    left_out: int


@dataclass(frozen=True, eq=False)
class Storage:
    """The samples of a dataset in one row.

    Parameters
    ----------
    dataset : h5py.Dataset
    samples, sample_bytes : int
    whole : int
        Samples that stand within the file, of a dataset in one block.
    per_piece : int
        Samples of a piece, 0 where the dataset is in one block.
    pieces : mapping of int to StoredChunk
        By number; those that were never written are missing.
    filters : tuple of int
    file_bytes : int
        Size of the file.
    """

    dataset: Any
    samples: int
    sample_bytes: int
    whole: int
    per_piece: int
    pieces: Mapping[int, StoredChunk]
    filters: tuple[int, ...]
    file_bytes: int
    _reasons: dict[int, str] = field(default_factory=dict)

    @property
    def stored_bytes(self) -> int:
        """Bytes of the file that the dataset takes."""
        if not self.per_piece:
            return self.whole * self.sample_bytes
        return sum(piece.nbytes for piece in self.pieces.values())

    @property
    def held_bytes(self) -> int:
        """Bytes that come out of the dataset when all is read."""
        if not self.per_piece:
            return self.samples * self.sample_bytes
        return max(len(self.pieces) * self.per_piece, self.samples) * self.sample_bytes

    def lost(self, first: int, last: int) -> Iterator[tuple[int, int, str]]:
        """Yield the samples of [first, last) that are missing or cannot be believed.

        Each entry: first, last (exclusive) and the reason.
        """
        if not self.per_piece:
            if last > self.whole:
                yield max(first, self.whole), last, "cut off"
            return
        for number in range(first // self.per_piece, -(-last // self.per_piece)):
            reason = self._reason(number)
            if reason:
                start = number * self.per_piece
                yield max(first, start), min(last, start + self.per_piece), reason

    def _reason(self, number: int) -> str:
        if number not in self._reasons:
            piece = self.pieces.get(number)
            self._reasons[number] = NEVER_WRITTEN if piece is None else self._fault(number, piece)
        return self._reasons[number]

    def _fault(self, number: int, piece: StoredChunk) -> str:
        """Return the fault of a piece; empty for a sound one."""
        if piece.place + piece.nbytes > self.file_bytes:
            return "cut off"
        wanted = self.per_piece * self.sample_bytes
        used = [kind for at, kind in enumerate(self.filters) if not piece.left_out >> at & 1]
        checksum = CHECKSUM_BYTES if FLETCHER32 in used else 0
        length = piece.nbytes - checksum
        if DEFLATE in used or LZF in used:
            _, packed = self.dataset.id.read_direct_chunk((number * self.per_piece,))
            packed = packed[: len(packed) - checksum]
            try:
                length = inflated_length(packed, wanted) if DEFLATE in used else lzf_length(packed)
            except zlib.error as error:
                return f"a piece that does not unpack ({error})"
        return "" if length == wanted else f"a piece of {length} bytes for {wanted}"


def storage_of(dataset: Any, part: str, file_bytes: int) -> Storage:
    """Find out where the samples of a dataset stand.

    Raises
    ------
    ValueError
        With the reason: they are in another file, were never written, or are packed in ways that are not read.
    """
    if dataset.external or dataset.is_virtual:
        raise ValueError(f"{part} that is stored in another file")
    samples, sample_bytes = int(dataset.shape[0]), int(dataset.dtype.itemsize)
    layout = dataset.id.get_create_plist()
    filters = tuple(layout.get_filter(number)[0] for number in range(layout.get_nfilters()))
    if set(filters) - FILTERS or len(set(filters)) < len(filters) or {DEFLATE, LZF} <= set(filters):
        raise ValueError(f"{part} packed by filters that are not read ({', '.join(map(str, filters))})")
    kind, whole, per_piece, pieces = layout.get_layout(), samples, 0, dict[int, StoredChunk]()
    if kind == h5d.CONTIGUOUS:
        place = dataset.id.get_offset()
        if samples and place is None:
            raise ValueError(f"{part} {NEVER_WRITTEN}")
        whole = min(samples, max(file_bytes - (place or 0), 0) // max(sample_bytes, 1))
    elif kind == h5d.CHUNKED:
        per_piece = int(dataset.chunks[0])
        if per_piece * sample_bytes > MOST_PIECE_BYTES:
            raise ValueError(f"{part} in pieces of {per_piece} samples")
        pieces = _pieces(dataset, per_piece)
        if samples and not pieces:
            raise ValueError(f"{part} {NEVER_WRITTEN}")
    elif kind != h5d.COMPACT:
        raise ValueError(f"{part} that is stored in an unknown way")
    return Storage(dataset, samples, sample_bytes, whole, per_piece, pieces, filters, file_bytes)


def _pieces(dataset: Any, per_piece: int) -> dict[int, StoredChunk]:
    """Pieces of a dataset by number."""
    found: dict[int, StoredChunk] = {}

    def add(piece: Any) -> None:
        found[piece.chunk_offset[0] // per_piece] = StoredChunk(piece.byte_offset, piece.size, piece.filter_mask)

    dataset.id.chunk_iter(add)
    return found


def inflated_length(packed: bytes, most: int) -> int:
    """Return the bytes that a deflated piece unpacks to; ``most`` + 1 if more."""
    return len(zlib.decompressobj().decompress(packed, most + 1))


def lzf_length(packed: bytes) -> int:
    """Return the bytes that a piece packed by LZF unpacks to.

    Examples
    --------
    >>> lzf_length(bytes([1, 65, 66, 32, 0, 224, 3, 1]))  # two letters, three copied, 7 + 3 + 2 copied
    17
    """
    at, length = 0, 0
    while at < len(packed):
        control = packed[at]
        if control < _LITERAL:
            length += control + 1
            at += control + 2
        else:
            copied = control >> 5
            if copied == _LONG and at + 1 < len(packed):
                copied += packed[at + 1]
                at += 1
            length += copied + 2
            at += 2
    return length
