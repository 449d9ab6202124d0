"""Names for people, and entity paths that no log can break.

Whatever a file calls its columns, both stay legible.
"""

import re
from collections.abc import Iterable

from groundstation.base import unit_names
from groundstation.base.printable import printable
from groundstation.chapters.markdown import escaped

MAX_LABEL_CHARACTERS = 80

# Words not written as they stand.
WORDS: dict[str, str] = {
    "ins": "INS",
    "gnss": "GNSS",
    "gdop": "GDOP",
    "pdop": "PDOP",
    "hdop": "HDOP",
    "msl": "MSL",
    "adf": "ADF",
    "ok": "OK",
    "accel": "acceleration",
    "rate": "angular rate",
}


def clean_text(text: str, limit: int = MAX_LABEL_CHARACTERS) -> str:
    """Return a text from a log as one printable line, cut at ``limit``.

    Control and direction marks become spaces.

    Examples
    --------
    >>> clean_text("roll\\x00\\n\\u202eangle")
    'roll angle'
    """
    line = " ".join(printable(text, " ").split())
    return line if len(line) <= limit else line[: limit - 1] + "…"


def path_parts(names: Iterable[str]) -> list[str]:
    """Return entity path parts of names, in their order and each unique.

    Letters, digits, ``_``, ``-`` and ``.`` alone. Separators, control characters and markup become ``_``; names that
    would then clash are numbered.

    Examples
    --------
    >>> path_parts(["ins.1", "a/b", "a:b", "", "__properties"])
    ['ins.1', 'a_b', 'a_b-2', 'unnamed', 'properties']
    """
    parts: list[str] = []
    used: set[str] = set()
    for name in names:
        kept = "".join(mark if mark.isalnum() or mark in "_-." else "_" for mark in name)
        base = kept.strip("_.")[:MAX_LABEL_CHARACTERS] or "unnamed"
        part, number = base, 1
        while part.casefold() in used:
            number += 1
            part = f"{base}-{number}"
        used.add(part.casefold())
        parts.append(part)
    return parts


def split_unit(field: str) -> tuple[str, str]:
    """Return the name of a field without its unit, and the unit as people write it.

    Examples
    --------
    >>> split_unit("velocity_north_mps"), split_unit("gdop"), split_unit("current_a")
    (('velocity_north', 'm/s'), ('gdop', ''), ('current', 'A'))
    """
    name, unit = unit_names.split_unit(field)
    return name, "" if unit is None else unit.spelled


def words(name: str) -> str:
    """Return words of a name in readable spelling.

    Examples
    --------
    >>> words("altitude_msl"), words("weight_on_wheels")
    ('altitude MSL', 'weight on wheels')
    """
    return clean_text(" ".join(WORDS.get(word, word) for word in name.split("_")))


def label(field: str) -> str:
    """Return the series name of a field, unit last: ``true heading, deg``.

    Examples
    --------
    >>> label("velocity_north_mps"), label("satellites_used")
    ('velocity north, m/s', 'satellites used')
    """
    name, unit = split_unit(field)
    return f"{words(name)}, {unit}" if unit else words(name)


def source_label(name: str) -> str:
    """Return the name of a topic or field that is not ours, as the source spells it.

    People search for that name.

    Examples
    --------
    >>> source_label("sensor_accel.1"), source_label("s_variance_m_s")
    ('sensor_accel.1', 's_variance_m_s')
    """
    return clean_text(name)


def natural_order(name: str) -> tuple[tuple[str, int], ...]:
    """Sort key that reads numbers as numbers and letters without case.

    Examples
    --------
    >>> sorted(["ins.10", "IMU", "ins.2", "ins"], key=natural_order)
    ['IMU', 'ins', 'ins.2', 'ins.10']
    """
    parts = re.split(r"([0-9]+)", name.casefold())
    return tuple(
        (parts[place], int((parts[place + 1 : place + 2] or ["-1"])[0][:18])) for place in range(0, len(parts), 2)
    )


def topic_label(topic: str) -> str:
    """Return the name of a topic for tab and view titles.

    Examples
    --------
    >>> topic_label("ins.2"), topic_label("radio_altimeter")
    ('INS 2', 'radio altimeter')
    """
    return clean_text(" ".join(words(part) for part in topic.split(".")))


def markdown_text(text: str, limit: int = 400) -> str:
    """Return text from a log made safe for a Markdown document.

    No markup of its own, no link, no picture, no table cell.

    Examples
    --------
    >>> print(markdown_text("a|b ![x](http://y)"))
    a\\|b !\\[x\\](http\\://y)
    """
    return escaped(clean_text(text, limit))
