"""Profiles as files: TOML that is read, checked and made a :class:`Profile`.

A mistake in one raises an error that names its key.
"""

import re
import string
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from groundstation.base.signals import RAW_PREFIX
from groundstation.readers.profile import Profile
from groundstation.readers.profile_columns import ColumnChecker
from groundstation.readers.profile_times import TimeChecker
from groundstation.readers.profile_values import Checker, profile_text, table_of

MOST_WIDTHS = 10_000
_DOUBT = re.compile(r"(?:^|\s)#\s(?:.*;\s)?\?\s(?P<doubt>.*\S)")


def load(path: Path) -> Profile:
    """Read and check a profile.

    Raises
    ------
    SettingsError
        Naming the file and the key: not TOML, an unknown key, unit, field or method, a wrong dimension ...
    """
    text = profile_text(path)
    return replace(_ProfileChecker(path).profile(table_of(text, path)), doubts=doubts_of(text))


def doubts_of(text: str) -> tuple[str, ...]:
    """Return the question marks that a draft still has, ``# ? ...`` and ``; ? ...``.

    Examples
    --------
    >>> doubts_of('"Alt" = { field = "gnss.altitude_msl_m", unit = "m" }  # 1 to 9; ? m assumed\\n"a" = 1  # why?\\n')
    ('Alt: m assumed',)
    >>> doubts_of("# ? names no zone\\n[time]  # dates\\n")
    ('names no zone',)
    """
    found = ((line, match) for line in text.splitlines() if (match := _DOUBT.search(line)))
    return tuple(_key_of(line[: match.start()]) + match["doubt"] for line, match in found)


def _key_of(before: str) -> str:
    """Return the key of a line, and a colon; nothing of a line that is all comment."""
    key = before.partition(" = ")[0].strip(" []\"'")
    return f"{key}: " if key else ""


class _ProfileChecker(Checker):
    """Parser of the whole TOML; the time and the columns have parsers of their own."""

    def profile(self, table: dict[str, Any]) -> Profile:
        allowed = (
            *("name", "description", "raw_topic", "recognise", "time", "metadata", "variation", "columns", "derived"),
            *("missing", "key"),
        )
        table = self.table(table, "", allowed, ("name", "time", "columns"))
        name = self.text(table["name"], "name")
        raw_topic = RAW_PREFIX + self.text(table.get("raw_topic", name), "raw_topic").removeprefix(RAW_PREFIX)
        keys = (
            "first_line",
            "columns",
            "names",
            "rows_after_header",
            "header_tells",
            "second_names",
            "delimiter",
            "widths",
        )
        recognise = self.table(table.get("recognise", {}), "recognise", keys)
        of_columns = ColumnChecker(self._path)
        time = TimeChecker(self._path).time(table["time"])
        missing = of_columns.missing(table.get("missing", []), "missing")
        columns = of_columns.columns(table["columns"], missing)
        key = self.table(table.get("key", {}), "key", ("column", "only"), ("column",) if "key" in table else ())
        metadata = self.table(table.get("metadata", {}), "metadata", ("find", "find_in_name", "join", "set"))
        constants, join = (self.table(metadata.get(name, {}), f"metadata.{name}", ()) for name in ("set", "join"))
        find, find_in_name = (self.patterns(metadata, name) for name in ("find", "find_in_name"))
        constants = {key: self.text(value, f"metadata.set.{key}") for key, value in constants.items()}
        known = find.keys() | find_in_name.keys() | constants.keys()
        names = self.texts(recognise["names"], "recognise.names") if "names" in recognise else ()
        if time.date and time.date not in known:
            self.fail("time.date", repr(time.date), "a name of metadata.find, find_in_name or set")
        if names and not {*(name for rule in columns for name in rule.names), *time.columns} <= set(names):
            self.fail("recognise.names", ", ".join(names), "every column that the profile names")
        rows_after = self.number(recognise.get("rows_after_header", 0), "recognise.rows_after_header")
        if rows_after != int(rows_after) or not 0 <= rows_after <= 10:
            self.fail("recognise.rows_after_header", repr(rows_after), "a whole number from 0 to 10")
        return Profile(
            name=name,
            path=self._path,
            description=str(table.get("description", "")),
            raw_topic=raw_topic,
            first_lines=self.first_lines(recognise.get("first_line", [])),
            required=self.texts(recognise["columns"], "recognise.columns")
            if "columns" in recognise
            else time.columns[:1],
            has_blanks=self.has_blanks(recognise),
            widths=self.widths(recognise.get("widths", [])),
            missing=missing,
            key=self.text(key["column"], "key.column") if key else "",
            only=self.texts(key["only"], "key.only") if "only" in key else (),
            rows_after_header=int(rows_after),
            header_tells=self.flag(recognise.get("header_tells", False), "recognise.header_tells"),
            has_second_names=self.flag(recognise.get("second_names", False), "recognise.second_names"),
            time=time,
            names=names,
            variation=of_columns.variation(table["variation"]) if "variation" in table else None,
            columns=columns,
            derived=of_columns.derivations(table.get("derived", []), columns, raw_topic),
            constants=constants,
            find=find,
            find_in_name=find_in_name,
            join={key: self.template(value, key, known) for key, value in join.items()},
        )

    def first_lines(self, value: Any) -> tuple[str, ...]:
        texts = value if isinstance(value, list) else [value]
        return tuple(self.text(text, "recognise.first_line") for text in texts)

    def has_blanks(self, recognise: Mapping[str, Any]) -> bool:
        if recognise.get("delimiter", "blanks") != "blanks":
            self.fail(
                "recognise.delimiter", repr(recognise["delimiter"]), '"blanks" (comma, semicolon and tab are found)'
            )
        if "delimiter" in recognise and "widths" in recognise:
            self.fail("recognise.delimiter", "widths beside it", "one of the two")
        return "delimiter" in recognise

    def widths(self, value: Any) -> tuple[int, ...]:
        if not isinstance(value, list) or len(value) > MOST_WIDTHS:
            self.fail("recognise.widths", repr(value)[:40], f"a list of up to {MOST_WIDTHS} whole numbers")
        found = [self.number(width, "recognise.widths") for width in value]
        if any(width != int(width) or not 1 <= width <= MOST_WIDTHS for width in found):
            self.fail("recognise.widths", repr(value)[:40], f"whole numbers from 1 to {MOST_WIDTHS}")
        return tuple(map(int, found))

    def patterns(self, metadata: Mapping[str, Any], name: str) -> dict[str, re.Pattern[str]]:
        """Return the regular expressions of a table of the metadata."""
        table = self.table(metadata.get(name, {}), f"metadata.{name}", ())
        return {key: self.pattern(value, f"metadata.{name}.{key}") for key, value in table.items()}

    def pattern(self, value: Any, key: str) -> re.Pattern[str]:
        try:
            pattern = re.compile(self.text(value, key))
        except re.error as error:
            self.fail(key, f"{value!r} ({error})", "a regular expression")
        if pattern.groups != 1:
            self.fail(key, f"{pattern.groups} groups", "one group, around the value")
        return pattern

    def template(self, value: Any, key: str, known: Any) -> str:
        text = self.text(value, f"metadata.join.{key}")
        try:
            names = [name for _text, name, _form, _conversion in string.Formatter().parse(text) if name is not None]
        except ValueError as error:
            self.fail(f"metadata.join.{key}", f"{text!r} ({error})", "text with {names} in braces")
        for name in names:
            if name not in known:
                self.fail(f"metadata.join.{key}", f"{{{name}}}", "names from metadata.find or metadata.set")
        return text
