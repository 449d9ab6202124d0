"""Damage to a file as a list of edits: made from a seed, kept as JSON; what was not touched stays known.

A file under mutation is a row of pieces: spans of the original, and bytes that are new. A record of the original is
untouched when one piece holds all of it.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Edit = tuple[Any, ...]  # kind, place, then what the kind needs
MOST_EDITS = 4
MAX_GROWTH = 4  # no mutation makes a file longer than so many times the original, and 1 MiB
HUGE = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 10**10, (1 << 63) - 1, (1 << 64) - 1)
TOKENS = (
    *(
        b"\0",
        b"\n",
        b"\r",
        b'"',
        b",",
        b";",
        b"\t",
        b"\x1a",
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        b"nan",
        b"inf",
        b"-",
        b"1e999",
    ),
    *(
        b"9" * 400,
        b"=1+1",
        b"<script>",
        b"../../x",
        b"\xd1\x8f\xd1\x8f",
        b"\xa3\x95\x80",
        b"\xa3\x95",
        b"# start_utc: x",
    ),
    *(b"\x2f\x73\x13\x20\x25\x0c\xbb\x12", b"ULog\x01\x12\x35", b"\x89MCAP0\r\n", b"\x28\xb5\x2f\xfd", b"\x1f\x8b\x08"),
)


@dataclass(frozen=True)
class Piece:
    """Bytes of the file: from ``start`` of the original, or new ones where that is None."""

    start: int | None
    content: bytes

    def cut(self, first: int, end: int) -> "Piece":
        """The bytes from ``first`` to ``end`` of this piece."""
        return Piece(None if self.start is None else self.start + first, self.content[first:end])


class Mutant:
    """A file and the edits made to it.

    Parameters
    ----------
    original, other : bytes
        The file, and the one that splices take their bytes from.
    edits : sequence of edits

    Examples
    --------
    >>> mutant = Mutant(b"abcdef", b"", [("delete", 2, 2)])
    >>> mutant.content, [mutant.is_kept(0, 2), mutant.is_kept(1, 3), mutant.is_kept(4, 6)]
    (b'abef', [True, False, True])
    """

    def __init__(self, original: bytes, other: bytes, edits: Sequence[Edit]) -> None:
        self._pieces = [Piece(0, original)]
        self._other = other
        self._most = MAX_GROWTH * len(original) + (1 << 20)
        self.edits = [tuple(edit) for edit in edits]
        for kind, place, *rest in self.edits:
            _EDITS[kind](self, place, *rest)
        self.content = b"".join(piece.content for piece in self._pieces)

    def __len__(self) -> int:
        return sum(len(piece.content) for piece in self._pieces)

    def is_kept(self, start: int, end: int) -> bool:
        """Whether the bytes ``start`` to ``end`` of the original stand somewhere in the file, together."""
        return any(
            piece.start is not None and piece.start <= start and end <= piece.start + len(piece.content)
            for piece in self._pieces
        )

    def kept(self, starts: Any, ends: Any) -> Any:
        """:meth:`is_kept` of many spans at once."""
        starts, ends = np.asarray(starts), np.asarray(ends)
        found = np.zeros(len(starts), dtype=bool)
        for piece in self._pieces:
            if piece.start is not None:
                found |= (piece.start <= starts) & (ends <= piece.start + len(piece.content))
        return found

    def _replace(self, at: int, length: int, new: Sequence[Piece]) -> None:
        """Put pieces in the place of ``length`` bytes."""
        before, rest = self._split(at)
        _gone, after = _split(rest, length)
        self._pieces = [*before, *new, *after]

    def _split(self, at: int) -> tuple[list[Piece], list[Piece]]:
        return _split(self._pieces, at)

    def _span(self, at: int, length: int) -> list[Piece]:
        return _split(self._split(at)[1], length)[0]

    def _flip(self, at: int, bit: int) -> None:
        for piece in self._span(at, 1):
            if piece.content:
                self._replace(at, 1, [Piece(None, bytes([piece.content[0] ^ 1 << bit]))])

    def _fill(self, at: int, length: int, value: int) -> None:
        self._replace(at, length, [Piece(None, bytes([value]) * min(length, max(0, len(self) - at)))])

    def _number(self, at: int, width: int, value: int) -> None:
        content = (value % (1 << 8 * width)).to_bytes(width, "little")[: max(0, len(self) - at)]
        self._replace(at, len(content), [Piece(None, content)])

    def _insert(self, at: int, content: str) -> None:
        self._replace(at, 0, [Piece(None, bytes.fromhex(content))])

    def _delete(self, at: int, length: int) -> None:
        self._replace(at, length, [])

    def _truncate(self, at: int) -> None:
        self._replace(at, len(self), [])

    def _repeat(self, at: int, length: int, times: int) -> None:
        span = self._span(at, length)
        room = max(0, (self._most - len(self)) // max(1, length))
        again = [Piece(None, piece.content) for piece in span] * min(times, room)
        self._replace(at + length, 0, again)

    def _splice(self, at: int, other_at: int, length: int, is_end: bool) -> None:
        content = self._other[other_at : other_at + length]
        self._replace(at, len(self) if is_end else 0, [Piece(None, content)])


def _split(pieces: Sequence[Piece], at: int) -> tuple[list[Piece], list[Piece]]:
    before: list[Piece] = []
    for number, piece in enumerate(pieces):
        if at < len(piece.content):
            head = [piece.cut(0, at)] if at else []
            return [*before, *head], [piece.cut(at, len(piece.content)), *pieces[number + 1 :]]
        at -= len(piece.content)
        before.append(piece)
    return before, []


_EDITS: dict[str, Callable[..., None]] = {
    "flip": Mutant._flip,
    "fill": Mutant._fill,
    "number": Mutant._number,
    "insert": Mutant._insert,
    "delete": Mutant._delete,
    "truncate": Mutant._truncate,
    "repeat": Mutant._repeat,
    "splice": Mutant._splice,
}
KINDS = tuple(_EDITS)


def random_edits(size: int, other_size: int, fields: Sequence[int], rng: np.random.Generator) -> list[Edit]:
    """Draw one to four edits (flips in bunches) of a file.

    Parameters
    ----------
    size, other_size : int
        Bytes of the file and of the one that splices come from.
    fields : sequence of int
        Places of length fields and definitions, hit by half of the ``number`` edits.
    rng : numpy Generator
    """
    edits: list[Edit] = []
    for _ in range(int(rng.integers(1, MOST_EDITS + 1))):
        kind = KINDS[int(rng.integers(len(KINDS)))]
        at, length = int(rng.integers(max(1, size))), int(2 ** rng.uniform(0, np.log2(max(2, size / 4))))
        if rng.random() < 0.2:
            at = int(rng.integers(min(size, 512) or 1))  # headers are short, and there is much to break in them
        edits += _edit(kind, at, length, size, other_size, fields, rng)
    return edits


def _edit(
    kind: str, at: int, length: int, size: int, other_size: int, fields: Sequence[int], rng: np.random.Generator
) -> list[Edit]:
    if kind == "flip":
        places = [at, *(int(place) for place in rng.integers(max(1, size), size=int(rng.integers(0, 12))))]
        return [(kind, place, int(rng.integers(8))) for place in places]
    if kind == "fill":
        return [(kind, at, length, int(rng.choice([0, 0xFF, 0x20, 0x80])))]
    if kind == "number":
        if len(fields) and rng.random() < 0.5:
            at = int(fields[int(rng.integers(len(fields)))])
        return [(kind, at, int(rng.choice([1, 2, 4, 8])), int(HUGE[int(rng.integers(len(HUGE)))]))]
    if kind == "insert":
        token = TOKENS[int(rng.integers(len(TOKENS)))]
        return [(kind, at, (token if rng.random() < 0.5 else rng.bytes(min(length, 4096))).hex())]
    if kind == "repeat":
        return [(kind, at, length, int(rng.choice([1, 1, 2, 20, 300])))]
    if kind == "splice":
        return [(kind, at, int(rng.integers(max(1, other_size))), length, bool(rng.random() < 0.5))]
    return [(kind, at)] if kind == "truncate" else [(kind, at, length)]


def to_json(edits: Sequence[Edit]) -> str:
    """Edits as text."""
    return json.dumps([list(edit) for edit in edits])
