"""Notes in the head of a table: what its comment lines say of how the log was made."""

import re
from collections.abc import Iterable

NOTE = "note"  # the key of the metadata that holds them
MOST_CHARACTERS = 1000
FEWEST_WORDS = 3
LEAST_WORDS_OF_A_PART = 2  # between commas, on average: with fewer a line is a row, or a header
_KEYS = frozenset(("note", "notes", "comment", "comments", "remark", "remarks"))
_MOST_WORDS_OF_A_KEY = 3
_WORD = re.compile(r"[^\W\d_]{2,}")
_PARTS = re.compile(r"[,;\t]")


def is_entry(key: str) -> bool:
    """Tell whether text before a colon is a key, and no beginning of a sentence.

    Examples
    --------
    >>> is_entry("start_utc"), is_entry("The motion of this log is made up"), is_entry("")
    (True, False, False)
    """
    return 0 < len(key.split()) <= _MOST_WORDS_OF_A_KEY


def note_of(lines: Iterable[str]) -> str:
    """Return the sentences of comment lines in one text, empty without any.

    Comment lines begin with ``#``. Entries ``key: value`` are no sentences but those that are named a note; rows of
    cells are none.

    Examples
    --------
    >>> note_of(["# aircraft: A-1", "# Common motion is made up.", "# note: 1 Hz", "#time_s,aa.bb,cc.dd,ee.ff"])
    'Common motion is made up.; 1 Hz'
    """
    found: dict[str, None] = {}
    for line in lines:
        if not line.startswith("#"):
            continue
        text = line.lstrip("#").strip()
        key, colon, value = text.partition(":")
        if colon and is_entry(key):
            text = value.strip() if key.strip().lower() in _KEYS else ""
        elif not _is_sentence(text):
            text = ""
        if text:
            found[text] = None
    return "; ".join(found)[:MOST_CHARACTERS]


def _is_sentence(text: str) -> bool:
    words = sum(_WORD.search(word) is not None for word in text.split())
    return words >= max(FEWEST_WORDS, LEAST_WORDS_OF_A_PART * len(_PARTS.split(text)))
