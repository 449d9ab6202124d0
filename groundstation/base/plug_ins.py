"""Plug-ins by entry points: other people's code, which may fail in any way."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

_OURS = "groundstation."
_DOUBT = f"[{_OURS}]\n?"  # what is not known may name code of others


def entry_points_of(group: str) -> "Iterable[EntryPoint]":
    """Return the entry points of a group; what is installed is looked through once.

    Where nobody but groundstation itself has any in its groups, there are none: ``importlib.metadata`` takes as long
    as a third of numpy to find that out, so it is asked only where somebody may have.
    """
    return _entry_points().select(group=group) if _may_have_plug_ins() else ()


@cache
def _entry_points() -> Any:
    from importlib.metadata import entry_points

    return entry_points()


@cache
def _may_have_plug_ins() -> bool:
    """Tell whether an installed package may name code of others in one of our groups.

    True too where packages are found by other means than folders: in a zip, or by a finder of somebody.
    """
    finders = (finder for finder in sys.meta_path if hasattr(finder, "find_distributions"))
    if any(getattr(finder, "__name__", "") != "PathFinder" for finder in finders):
        return True
    return any(_names_others(text) for folder in dict.fromkeys(sys.path) for text in _told_in(folder))


def _told_in(folder: str) -> Iterator[str]:
    """Yield what packages of a folder say of entry points; a doubt where unknown."""
    endings = (".dist-info", ".egg-info", *(("egg-info",) if folder.lower().endswith(".egg") else ()))
    try:
        with os.scandir(folder or ".") as inside:
            packages = [one.path for one in inside if one.name.lower().endswith(endings)]
    except FileNotFoundError:
        return
    except OSError:  # a zip, or a folder that may not be read
        yield _DOUBT
        return
    for package in packages:
        try:
            # in a Python with 200 packages a Path for each takes longer than reading
            with open(f"{package}/entry_points.txt", "rb") as file:  # noqa: PTH123
                told = file.read().decode()
        except (FileNotFoundError, NotADirectoryError):
            continue
        except (OSError, UnicodeDecodeError):
            told = _DOUBT
        yield told


def _names_others(text: str) -> bool:
    """Tell whether a file of entry points names code of others in our groups.

    Examples
    --------
    >>> _names_others("[groundstation.readers]\\nflat_csv = groundstation.readers.flat_csv")
    False
    >>> _names_others("[console_scripts]\\na = b:c\\n[groundstation.readers]\\nother = other.reader")
    True
    """
    if _OURS not in text:
        return False
    group = ""
    for line in map(str.strip, text.splitlines()):
        if line.startswith("[") and line.endswith("]"):
            group = line.strip("[]")
        elif group.startswith(_OURS) and line and not line.startswith("#"):
            is_built_in = line.partition("=")[2].strip().startswith(f"{group}.")
            if not is_built_in:
                return True
    return False


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
