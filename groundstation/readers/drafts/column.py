"""Guess of what a column of a table becomes, as a line of a draft."""

from collections.abc import Iterable

from groundstation.base.dataclasses import dataclass
from groundstation.base.toml_text import quoted


@dataclass(frozen=True)
class ColumnGuess:
    """One column: what it becomes, and why.

    ``target`` is empty where it is left; ``doubt`` is what the user has to look at. ``is_pair``: latitude and longitude
    stand in each cell, and ``target`` is the latitude. ``side``:
    the column of letters that gives the sign. ``missing``: numbers that mean no value.
    """

    at: int
    name: str
    target: str = ""
    unit: str = ""
    scale: float = 1.0
    sign: int = 1
    values: str = ""
    why: str = ""
    doubt: str = ""
    north: str = ""
    offset: float = 0.0
    is_pair: bool = False
    is_variance: bool = False
    side: str = ""
    missing: tuple[str, ...] = ()

    @property
    def line(self) -> str:
        """The line of the draft."""
        return self.line_with(self.doubt)

    def line_with(self, doubt: str) -> str:
        """Return the line with this doubt in place of its own."""
        scale = f", scale = {self.scale:g}" * (self.scale != 1.0)
        sign = ", sign = -1" * (self.sign < 0)
        unit = f", unit = {quoted(self.unit)}" * bool(self.unit)
        offset = f", offset = {self.offset:.9g}" * bool(self.offset)
        variance = ", variance = true" * self.is_variance
        side = f", side = {quoted(self.side)}" * bool(self.side)
        north = f", north = {quoted(self.north)}" * bool(self.north)
        if self.is_pair:
            east = self.target.replace("latitude", "longitude")
            parts = (
                f"{{ field = {quoted(target)}, unit = {quoted(self.unit)}, part = {number} }}"
                for number, target in enumerate((self.target, east), start=1)
            )
            return f"{quoted(self.name)} = [{', '.join(parts)}]" + (f"  # {self.values}" if self.values else "")
        missing = f", missing = [{', '.join(self.missing)}]" * bool(self.missing)
        said = f"{unit}{scale}{sign}{offset}{north}{variance}{side}{missing}"
        entry = f"{quoted(self.name)} = {{ field = {quoted(self.target)}{said} }}"
        notes = "; ".join(filter(None, (self.values, self.why, f"? {doubt}" if doubt else "")))
        return f"{entry}  # {notes}" if notes else entry


def both(one: str, other: str) -> str:
    """Return two doubts as one."""
    return "; ".join(filter(None, (one, other)))


def columns_in_doubt(columns: Iterable[ColumnGuess]) -> dict[str, tuple[str, ...]]:
    """Return each doubt by itself, and the names of the columns that have it."""
    found: dict[str, tuple[str, ...]] = {}
    for column in columns:
        for doubt in filter(None, column.doubt.split("; ")):
            found[doubt] = (*found.get(doubt, ()), column.name)
    return found
