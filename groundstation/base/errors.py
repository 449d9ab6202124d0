"""Errors that say where, what was found, what was expected and what to do next."""

import errno
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import PurePath

from groundstation.base.printable import in_a_line

_NOT_MAPPED = re.compile("failed to map segment|[Cc]annot allocate memory")
_NOT_HAD = re.compile("[Cc]annot allocate memory|[Uu]nable to allocate|malloc .*failed|std::bad_alloc|bad allocation")
_NO_THREAD = re.compile("can't start new thread|Failed to launch worker thread|Resource temporarily unavailable")
MOST_SHOWN = 2000  # characters of each part of an error: a file may have put much into it


class GroundstationError(Exception):
    """Report a failure in one line a user can act on.

    Parameters
    ----------
    where : str
        File, topic and time or row: ``"flight3.ulg, vehicle_gps at 12.4 s"``.
    found : str
        Text or value that stands there: ``"latitude 912"``.
    expected : str, optional
        Text or value that should stand there: ``"within [-90, 90]"``.
    next_step : str, optional
        Action of the user: ``"check the scale in the profile"``.

    Examples
    --------
    >>> print(GroundstationError("a.csv, row 7", "latitude 912", "within [-90, 90]", "check the scale"))
    a.csv, row 7: found latitude 912, expected within [-90, 90]: check the scale
    """

    def __init__(self, where: str, found: str, expected: str = "", next_step: str = "") -> None:
        self.where, self.found, self.expected, self.next_step = where, found, expected, next_step
        where, found, expected, next_step = (_shown(one) for one in (where, found, expected, next_step))
        text = f"{where}: found {found}" if expected else f"{where}: {found}"
        if expected:
            text += f", expected {expected}"
        if next_step:
            text += f": {next_step}"
        super().__init__(" ".join(text.split()))  # one line, whatever a log put into it

    def _render_traceback_(self) -> list[str]:
        """The error as a notebook shows it: its line, without the calls that led there."""
        return [f"{type(self).__name__}: {self}"]


def _shown(part: str) -> str:
    """Cut a part of a message to what a person reads, in characters that a terminal shows."""
    return in_a_line(part if len(part) <= MOST_SHOWN else f"{part[:MOST_SHOWN]} ... ({len(part)} characters)")


class UnreadableLogError(GroundstationError):
    """Error: no reader claims the file, or nothing in it could be read (exit code 1)."""


class UnclaimedLogError(UnreadableLogError):
    """Error: no reader claims the file.

    In a folder such a file is skipped; named on the command line it is an error.
    """


class UsageError(GroundstationError):
    """Error: the call cannot be carried out as asked (exit code 2)."""


class UnknownNameError(UsageError, KeyError):
    """Error: no such name; the message lists similar names, or all where none is similar.

    Parameters
    ----------
    where : str
        Place that was asked: ``"table ins"``.
    name : str
    known : iterable of str
        Names there are.

    Examples
    --------
    >>> print(UnknownNameError("table ins", "roll", ("roll_deg", "pitch_deg")))
    table ins: found no 'roll', expected roll_deg
    >>> print(UnknownNameError("table ins", "x", ("roll_deg", "pitch_deg")))
    table ins: found no 'x', expected one of roll_deg, pitch_deg
    """

    def __init__(self, where: str, name: str, known: Iterable[str]) -> None:
        names = tuple(known)
        near = near_names(name, names) or names
        expected = "nothing: there is none" if not names else ", ".join(near)
        super().__init__(where, f"no {name!r}", f"one of {expected}" if len(near) > 1 else expected)

    __str__ = Exception.__str__  # that of KeyError quotes the line


def near_names(name: str, known: Iterable[str], most: int = 5) -> tuple[str, ...]:
    """Return names that begin with or hold the one asked for, else names spelled alike.

    At most ``most`` of them.

    Examples
    --------
    >>> near_names("lat", ("latitude_deg", "gdop")), near_names("tarck_deg", ("track_deg", "gdop"))
    (('latitude_deg',), ('track_deg',))
    """
    from difflib import get_close_matches

    names = tuple(known)
    asked = name.lower()
    holding = sorted((one for one in names if asked and asked in one.lower()), key=lambda one: one.lower().find(asked))
    return tuple(holding[:most] or get_close_matches(name, names, most))


class NotAssessableError(GroundstationError):
    """Error: an analysis lacks what it needs, as the message says. Never fatal to a run."""


class SettingsError(UsageError):
    """Error: a settings, profile, aircraft or site file has a value that cannot be used."""


def lack_of_memory(error: BaseException) -> str:
    """Name the missing resource, memory or processes, in a few words; empty for other errors.

    Examples
    --------
    >>> lack_of_memory(MemoryError())
    'not enough memory'
    >>> lack_of_memory(ImportError("/a/libarrow.so.2600: failed to map segment from shared object"))
    'not enough memory to load libarrow.so.2600'
    >>> lack_of_memory(OSError(12, "Cannot allocate memory")), lack_of_memory(ImportError("No module named 'x'"))
    ('not enough memory', '')
    """
    told = str(error)
    if isinstance(error, ImportError) and _NOT_MAPPED.search(told):
        library = PurePath(told.partition(":")[0]).name
        return f"not enough memory to load {library}" if library else "not enough memory to load its libraries"
    if isinstance(error, OSError):
        return "not enough memory" if error.errno == errno.ENOMEM else ""
    if isinstance(error, MemoryError) or _NOT_HAD.search(told):
        return "not enough memory"
    return "no further thread or process is allowed" if _NO_THREAD.search(told) else ""


@contextmanager
def told_in_a_line(where: str) -> Iterator[None]:
    """Say in one line what the operating system refused, with the file where it is known."""
    try:
        yield
    except GroundstationError:
        raise
    except Exception as error:
        lacking = lack_of_memory(error)
        if lacking:
            raise GroundstationError(where, lacking) from error
        if not isinstance(error, OSError):
            raise
        place = where if error.filename is None else str(error.filename)
        raise GroundstationError(place, error.strerror or str(error)) from error
