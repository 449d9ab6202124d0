"""YAML read as plain mappings, lists and texts.

Nothing is constructed, nested deeply or repeated without bound.

Scalars stay the text that was written. YAML 1.1 would read the key ``off`` as false and the label ``076`` as 62.
"""

from dataclasses import field
from pathlib import Path
from typing import Any, TypeAlias

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError

Value: TypeAlias = "str | list[Value] | dict[str, Value] | None"

MAX_BYTES = 64 * 1024 * 1024
MAX_DEPTH = 12
MAX_VALUES = 5_000_000  # aliases count as often as they are used
NULLS = ("", "~", "null", "Null", "NULL")


def read_yaml(path: Path) -> dict[str, Value]:
    """Read a YAML file whose content is one mapping.

    Raises
    ------
    SettingsError
        In one line: a file that cannot be read, is not YAML, is no mapping, holds a key twice, or is nested or
        repeated beyond any sense.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        reason = (error.strerror or type(error).__name__).lower()
        raise SettingsError(str(path), f"no readable file ({reason})", "", "check the path") from error
    if len(content) > MAX_BYTES:
        raise SettingsError(path.name, f"more than {MAX_BYTES >> 20} MiB", "an ICD in YAML")
    try:
        return parse_yaml(content.decode("utf-8-sig"), path.name)
    except UnicodeDecodeError as error:
        raise SettingsError(path.name, f"no UTF-8 text ({error})", "an ICD in YAML") from error


def parse_yaml(text: str, where: str) -> dict[str, Value]:
    """The mapping that a YAML text holds. Raises as :func:`read_yaml`.

    Examples
    --------
    >>> parse_yaml("a: {off: 076, on: 'x'}", "x.yaml")
    {'a': {'off': '076', 'on': 'x'}}
    """
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    builder = _Builder(where)
    try:
        for event in yaml.parse(text, Loader=loader):
            builder.take(event)
    except yaml.YAMLError as error:
        raise SettingsError(where, f"no valid YAML ({' '.join(str(error).split())[:200]})") from error
    if not isinstance(builder.root, dict):
        raise SettingsError(where, f"{kind_of_value(builder.root)}", "a mapping of message or word definitions")
    return builder.root


def kind_of_value(value: Value) -> str:
    """Describe a value for errors, never with its whole content."""
    if isinstance(value, dict):
        return f"a mapping of {len(value)}"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return "nothing" if value is None else repr(value[:80])


@dataclass
class _Open:
    """Mapping or list that has begun.

    Its value, the key that waits for a value, its anchor, and its count of values.
    """

    value: Any
    anchor: str | None
    key: str | None = None
    count: int = 1


@dataclass
class _Builder:
    """Builder of a value from the events of a parser."""

    where: str
    root: Value = None
    documents: int = 0
    count: int = 0
    stack: list[_Open] = field(default_factory=list)
    anchors: dict[str, tuple[Value, int]] = field(default_factory=dict)

    def take(self, event: Any) -> None:
        name = type(event).__name__
        if name == "DocumentStartEvent":
            self.documents += 1
            if self.documents > 1:
                self._fail(event, "a second document", "one")
        elif name in ("MappingStartEvent", "SequenceStartEvent"):
            self._open(event, {} if name == "MappingStartEvent" else [])
        elif name in ("MappingEndEvent", "SequenceEndEvent"):
            done = self.stack.pop()
            self._put(event, done.value, done.count, done.anchor)
        elif name == "ScalarEvent":
            is_null = event.style is None and event.value in NULLS
            self._put(event, None if is_null else event.value, 1, event.anchor)
        elif name == "AliasEvent":
            if event.anchor not in self.anchors:
                self._fail(event, f"alias *{event.anchor} of nothing that was completed before")
            self._put(event, *self.anchors[event.anchor], None)

    def _open(self, event: Any, value: Any) -> None:
        if len(self.stack) >= MAX_DEPTH:
            self._fail(event, f"more than {MAX_DEPTH} levels")
        if self.stack and isinstance(self.stack[-1].value, dict) and self.stack[-1].key is None:
            self._fail(event, "a key that is a mapping or a list", "a text")
        self.stack.append(_Open(value, event.anchor))

    def _put(self, event: Any, value: Value, count: int, anchor: str | None) -> None:
        if anchor is not None:
            self.anchors[anchor] = (value, count)
        if not self.stack:
            self.root = value
            return
        top = self.stack[-1]
        top.count += count
        if top.count > MAX_VALUES:
            self._fail(event, f"more than {MAX_VALUES} values")
        if isinstance(top.value, list):
            top.value.append(value)
        elif top.key is None:
            top.key = value if isinstance(value, str) else self._fail(event, "a key that is no text", "a text")
            if top.key in top.value:
                self._fail(event, f"{top.key!r} twice", "each key once")
        else:
            top.value[top.key] = value
            top.key = None

    def _fail(self, event: Any, found: str, expected: str = "") -> Any:
        raise SettingsError(f"{self.where}, line {event.start_mark.line + 1}", found, expected)
