"""Values of a profile's TOML; a mistake in one raises an error that names its key."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from groundstation.base.errors import SettingsError
from groundstation.base.signals import Field, field_of, is_canonical
from groundstation.base.toml_text import toml_table, toml_text
from groundstation.base.units import factor_to, units_of
from groundstation.readers.profile import ColumnRule


def profile_text(path: Path) -> str:
    """Read the text of a profile.

    Raises
    ------
    SettingsError
        When it cannot be read.
    """
    return toml_text(path, str(path), "a profile", "check the path; `groundstation profile list` has the names")


def table_of(text: str, path: Path) -> dict[str, Any]:
    """Return the TOML of a profile without checks.

    Raises
    ------
    SettingsError
        When it is no TOML.
    """
    return toml_table(text, str(path), "a profile as docs/profiles.md describes")


def read_table(path: Path) -> dict[str, Any]:
    """Read the TOML of a profile without checks."""
    return table_of(profile_text(path), path)


class Checker:
    """Checker of the values of a profile; every error names the file and the key."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def fail(self, key: str, found: str, expected: str = "") -> NoReturn:
        raise SettingsError(f"{self._path.name}, {key}", found, expected, "see docs/profiles.md")

    def table(self, value: Any, key: str, allowed: Sequence[str], needed: Sequence[str] = ()) -> dict[str, Any]:
        if not isinstance(value, dict):
            self.fail(key, repr(value), "a table")
        for name in value:
            if allowed and name not in allowed:
                self.fail(f"{key}.{name}".lstrip("."), "an unknown key", f"one of {', '.join(allowed)}")
        for name in needed:
            if name not in value:
                self.fail(f"{key}.{name}".lstrip("."), "nothing", "this key")
        return value

    def text(self, value: Any, key: str) -> str:
        if not isinstance(value, str) or not value:
            self.fail(key, repr(value), "a text that is not empty")
        return value

    def texts(self, value: Any, key: str) -> tuple[str, ...]:
        if not isinstance(value, list) or not value:
            self.fail(key, repr(value), "a list of texts")
        return tuple(self.text(item, key) for item in value)

    def number(self, value: Any, key: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
            self.fail(key, repr(value), "a finite number")
        try:
            return float(value)
        except OverflowError:
            self.fail(key, f"a number of {len(str(value))} digits", "a number")

    def canonical(self, value: Any, key: str) -> tuple[str, Field]:
        topic, _, name = self.text(value, key).rpartition(".")
        known = field_of(topic, name)
        if known is None:
            expected = "a field of that topic" if is_canonical(topic) else "<topic>.<field> of the canonical list"
            self.fail(key, repr(value), expected)
        return topic, known

    def unit(self, value: Any, key: str, wanted: str) -> float:
        expected = f"a unit of {wanted}: {', '.join(units_of(wanted))}" if wanted else "no unit"
        factor = factor_to(value, wanted) if isinstance(value, str) else None
        if factor is None:
            self.fail(key, repr(value), expected)
        return factor

    def column(self, name: str, key: str, topic: str, known: Field, table: dict[str, Any]) -> ColumnRule:
        if known.kind != "double":
            self.table(table, key, ("field",))
            return ColumnRule(name, topic, known)
        unit_factor = self.unit(table.get("unit", ""), f"{key}.unit", known.unit)
        scale = self.number(table.get("scale", 1.0), f"{key}.scale")
        sign = self.number(table.get("sign", 1), f"{key}.sign")
        if sign not in (1.0, -1.0) or scale == 0.0:
            self.fail(f"{key}.sign" if scale else f"{key}.scale", f"{sign:g}" if scale else "0", "1 or -1, scale not 0")
        offset = self.number(table.get("offset", 0.0), f"{key}.offset")
        return ColumnRule(name, topic, known, scale * sign * unit_factor, offset * unit_factor, unit_factor)

    def flag(self, value: Any, key: str) -> bool:
        if not isinstance(value, bool):
            self.fail(key, repr(value), "true or false")
        return value
