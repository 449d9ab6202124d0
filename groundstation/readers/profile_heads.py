"""Heads of the shipped profiles: which of them a table may be, by its first lines.

A profile is loaded where its head fits: most tables are those of none.
"""

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_text import toml_table, toml_text
from groundstation.readers.dialect import HeadLine, detect_encoding, head_lines
from groundstation.readers.source import Source

SHIPPED = Path(__file__).parent / "profiles"
DAMAGED_HEAD_LINES = 20  # lines searched for a header row when the first line is not the profile's
_OF_NUMBERS = frozenset(b"%c" % sign for sign in b"0123456789+-.,;")
_COMMENTS = re.compile(r"\A(?:#[^\n]*\n\s*)+")


@dataclass(frozen=True)
class Beginning:
    """Beginning of a table.

    Parameters
    ----------
    first, row : str
        The first line, and the first one that is none of the metadata above a header; what follows stands behind.
    is_of_rows : bool
        The file begins with numbers, even if the first row is cut.
    """

    source: Source
    first: str
    row: str
    is_of_rows: bool

    def is_that_of(self, first_lines: tuple[str, ...]) -> bool:
        """Tell whether a profile's first line stands on top, or below other metadata."""
        return self.first.startswith(first_lines) or self.row.startswith(first_lines)

    def is_above(self, first_lines: tuple[str, ...]) -> bool:
        """Tell whether a profile's first line stands below the rows of another log.

        The beginning of that other log is lost.
        """
        return self.is_of_rows and any(b"\n" + line.encode() in self.source.head for line in first_lines)


def beginning_of(source: Source) -> Beginning:
    """Return the beginning of a table."""
    first = source.head[:4096].removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace").lstrip()
    is_of_rows = any(line.strip()[:1] in _OF_NUMBERS for line in source.head[:4096].split(b"\n", 2)[:2])
    return Beginning(source, first, _COMMENTS.sub("", first), is_of_rows)


def are_named(required: Sequence[str], lines: Sequence[HeadLine]) -> bool:
    """Tell whether one of the first lines has all names that a header row must have."""
    return any(all(name in line.text for name in required) for line in lines[:DAMAGED_HEAD_LINES])


@dataclass(frozen=True)
class ProfileHead:
    """Head of a shipped profile: first lines of its files, names of their header row.

    ``required`` is empty where files have no header row.
    """

    path: Path
    first_lines: tuple[str, ...]
    required: tuple[str, ...]


def head_of(path: Path) -> ProfileHead:
    """Read the head of a shipped profile: it stands above the columns."""
    text = toml_text(path, path.name).partition("\n[columns]\n")[0]
    recognise = toml_table(text, path.name)["recognise"]
    first = recognise.get("first_line", [])
    is_headless = "names" in recognise
    return ProfileHead(
        path,
        tuple(first) if isinstance(first, list) else (first,),
        () if is_headless else tuple(recognise["columns"]),
    )


def _may_be_header(line: str, required: Sequence[str]) -> bool:
    """Tell whether all names begin where a cell may.

    ``gnss.latitude_deg`` is no cell of the name behind its point.
    """
    is_quick = bool(required) and all(name in line for name in required)
    return is_quick and all(re.search(rf"(?<![\w.]){re.escape(name)}", line) for name in required)


@cache
def _heads() -> tuple[ProfileHead, ...]:
    return tuple(map(head_of, sorted(SHIPPED.glob("*.toml"))))


def that_may_fit(source: Source) -> tuple[Path, ...]:
    """Return the shipped profiles that may be those of a table.

    Raises
    ------
    UnreadableLogError
        For UTF-16.
    """
    begins, encoding = beginning_of(source), detect_encoding(source.head, source.name)
    lines = head_lines(source, encoding, DAMAGED_HEAD_LINES)

    def may_fit(head: ProfileHead) -> bool:
        if not head.first_lines:
            return False
        is_its_own = begins.is_that_of(head.first_lines) or begins.is_above(head.first_lines)
        return is_its_own or any(_may_be_header(line.text, head.required) for line in lines)

    return tuple(head.path for head in _heads() if may_fit(head))
