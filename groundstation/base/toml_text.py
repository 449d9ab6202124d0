"""TOML text of a user's file: bounded in size and depth, refused with one line."""

import re
from datetime import date, time
from pathlib import Path
from typing import Any

from groundstation.base.errors import SettingsError

MAX_BYTES = 16 << 20  # a pipe or a device that never ends is refused there


def toml_text(path: Path, where: str, expected: str = "a TOML file", next_step: str = "") -> str:
    """Read the text of a file (UTF-8, with or without its mark).

    ``where`` names the file in errors; ``expected`` and ``next_step`` are what they say of it.

    Raises
    ------
    SettingsError
        When it cannot be opened, is longer than 16 MiB or no UTF-8.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = (getattr(error, "strerror", None) or "no such name").lower()
        raise SettingsError(where, f"no readable file ({reason})", expected, next_step) from error
    if len(content) > MAX_BYTES:
        raise SettingsError(where, f"more than {MAX_BYTES >> 20} MiB", expected, next_step)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = f"byte {error.start + 1}: 0x{content[error.start]:02x}"
        raise SettingsError(where, f"text that is not UTF-8 ({place})", expected, next_step) from error


def toml_table(text: str, where: str, expected: str = "a TOML file", next_step: str = "") -> dict[str, Any]:
    """Return the table that a TOML text holds, its dates as text: they need no quotes.

    Raises
    ------
    SettingsError
        When it is not TOML, or nested too deeply.

    Examples
    --------
    >>> toml_table("starts = [2014-06-01T20:01:12Z, 2014-06-01, 3]", "a.toml")
    {'starts': ['2014-06-01T20:01:12Z', '2014-06-01', 3]}
    """
    import tomllib  # 10 ms that most commands do not need

    try:
        table: dict[str, Any] = _with_dates_as_text(tomllib.loads(text))
        return table
    except tomllib.TOMLDecodeError as error:
        raise SettingsError(where, f"not TOML ({error})", expected, next_step) from error
    except RecursionError as error:
        raise SettingsError(where, "not TOML (brackets in brackets, too many)", expected, next_step) from error


def _with_dates_as_text(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _with_dates_as_text(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_with_dates_as_text(one) for one in value]
    if isinstance(value, date | time):  # a datetime is a date
        return re.sub(r"\+00:00$", "Z", value.isoformat())
    return value


def quoted(text: str) -> str:
    """Return a text as TOML writes it, between quotes; what is hidden is escaped.

    Examples
    --------
    >>> print(quoted('Speed "GPS" \\u00b5\\x7f\\u202e\\U000e0041'))
    "Speed \\"GPS\\" µ\\u007f\\u202e\\U000e0041"
    """
    import json

    from groundstation.base.printable import is_hidden

    written = json.dumps(text, ensure_ascii=False)
    return "".join(_escaped(mark) if is_hidden(mark) else mark for mark in written)


def _escaped(mark: str) -> str:
    return f"\\u{ord(mark):04x}" if ord(mark) <= 0xFFFF else f"\\U{ord(mark):08x}"
