"""Plug-ins by entry points: other people's code, which may fail in any way."""

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints


def entry_points_of(group: str) -> "EntryPoints":
    """Return the entry points of a group; what is installed is looked through once."""
    found: EntryPoints = _entry_points().select(group=group)
    return found


@cache
def _entry_points() -> Any:
    from importlib.metadata import entry_points

    return entry_points()


def load_plug_ins(group: str, what: str, take: Callable[[Any], str]) -> tuple[str, ...]:
    """Load the plug-ins of a group, and return a line for each that is not taken.

    Entry points that name modules of groundstation's own room of that group are built in and passed over.

    Parameters
    ----------
    group : str
        ``groundstation.readers``, ``groundstation.systems``.
    what : str
        Kind of plug-in, in words.
    take : callable
        ``take(found)`` keeps what an entry point names, or returns why it is left out. What it raises says why it
        cannot be used.
    """
    lines = []
    for entry in sorted(entry_points_of(group), key=lambda entry: entry.name):
        if entry.value.startswith(f"{group}."):
            continue
        try:
            why = take(entry.load())
            told = f"is left out: {why}" if why else ""
        except Exception as error:  # a stranger's code: whatever it raises must not stop a run
            told = f"cannot be used: {type(error).__name__}: {error}"
        if told:
            lines.append(" ".join(f"{what} plug-in {entry.name!r} ({entry.value}) {told}".split()))
    return tuple(lines)
