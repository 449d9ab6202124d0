"""Bytes that are held in pieces are read from any place as one, in memory and in a file."""

import numpy as np
import pytest

from groundstation.readers.held import HeldBytes


@pytest.mark.parametrize("most", [0, 10, 40, 1_000], ids=["a file", "a file soon", "a file late", "memory"])
def test_pieces_are_read_as_one_from_any_place(most: int) -> None:
    pieces = [b"abc", b"", np.arange(7, dtype=np.uint8), b"xyz" * 11, bytearray(b"0123")]
    whole = b"".join(map(bytes, pieces))
    held = HeldBytes(most)
    held.extend(pieces)
    assert held.size == len(whole)
    for at in range(len(whole) + 2):
        for size in (0, 1, 5, len(whole)):
            assert held.read(at, size) == whole[at : at + size]
            room = bytearray(size)
            count = held.readinto(at, room)
            assert bytes(room[:count]) == whole[at : at + size]


def test_what_is_held_in_memory_is_not_copied() -> None:
    piece = np.zeros(5_000_000, np.uint8)
    held = HeldBytes()
    held.write(piece)
    piece[4_999_999] = 7  # a copy would not have it
    assert held.read(4_999_998, 2) == b"\x00\x07"
