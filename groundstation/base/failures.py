"""Parts of a result that failed by a defect of ours: they are left out, the rest is made."""

import re
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field
from typing import TYPE_CHECKING, TypeVar, TypeVarTuple

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, lack_of_memory
from groundstation.base.printable import in_a_line

if TYPE_CHECKING:
    from groundstation.base.findings import Finding

CODE = "internal"  # first part of the codes of findings on them
MOST_OF_AN_ERROR = 300  # characters: an error may quote the log
_ADDRESS = re.compile(r"\b0x[0-9a-f]{4,}\b")  # differs from run to run

Made = TypeVar("Made")
Arguments = TypeVarTuple("Arguments")


@dataclass(frozen=True)
class Failure:
    """A part that failed.

    Parameters
    ----------
    part : str
        Kind of the part: analysis, figure, chapter, tab.
    name : str
    reason : str
        Why, for people.
    trace : str
        Where it came from; no part of the results.
    """

    part: str
    name: str
    reason: str
    trace: str = field(default="", compare=False, repr=False)

    @property
    def code(self) -> str:
        """Code of its finding.

        Examples
        --------
        >>> Failure("figure", "overview.track", "").code
        'internal.figure.overview.track'
        """
        return f"{CODE}.{self.part.replace(' ', '_')}.{self.name}"

    @property
    def text(self) -> str:
        """One line that says what is left out, and why."""
        return in_a_line(f"the {self.part} {self.name} is left out: {self.reason}")

    def finding(self) -> "Finding":
        """The finding of a flight that lacks the part."""
        from groundstation.base.findings import Finding  # brings numpy, which `--help` does without

        return Finding("warn", self.code, self.text)


_gathered: ContextVar[list[Failure] | None] = ContextVar("failures", default=None)


@contextmanager
def gathered_failures() -> Iterator[None]:
    """Gather failures in place of raising them; :func:`failures` returns those so far."""
    if _gathered.get() is not None:
        yield
        return
    token = _gathered.set([])
    try:
        yield
    finally:
        _gathered.reset(token)


def failures() -> tuple[Failure, ...]:
    """Failures gathered so far; none where nobody gathers."""
    return tuple(_gathered.get() or ())


def attempt(
    part: str,
    name: str,
    make: Callable[[*Arguments], Made],
    *arguments: *Arguments,
    unless: tuple[type[Exception], ...] = (),
) -> Made | None:
    """Make a part of a result; None where it fails and failures are gathered, else it raises.

    Parameters
    ----------
    part, name
        As of :class:`Failure`.
    make : callable
        Gets the ``arguments``.
    unless : tuple of type
        Errors that are no failure of this part alone: a full disk.

    Examples
    --------
    >>> with gathered_failures():
    ...     attempt("figure", "a", int, "no number"), attempt("figure", "b", int, "7")
    ...     print(failures()[0].code)
    (None, 7)
    internal.figure.a
    """
    try:
        return make(*arguments)
    except unless:
        raise
    except Exception as error:
        left_out(part, name, error)
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # raised by libraries in Rust; no Exception itself
            raise
        left_out(part, name, error)
    return None


def left_out(part: str, name: str, error: BaseException) -> Failure:
    """Record that a part failed; raise the error where nobody gathers failures."""
    gathered = _gathered.get()
    if gathered is None:
        raise error
    failure = Failure(part, name, reason_of(error), "".join(traceback.format_exception(error)))
    if failure.code not in {one.code for one in gathered}:
        gathered.append(failure)
    return failure


def reason_of(error: BaseException) -> str:
    """Reason of a failure, in one line that is the same at every run.

    Examples
    --------
    >>> reason_of(ValueError("bad <object at 0x7f3a5c001c40>")), reason_of(MemoryError())
    ('internal error (ValueError: bad <object at 0x...>); please report it', 'not enough memory')
    """
    if lacking := lack_of_memory(error):
        return lacking
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, GroundstationError):
        return in_a_line(str(error))
    told = _ADDRESS.sub("0x...", in_a_line(str(error)))
    told = told if len(told) <= MOST_OF_AN_ERROR else f"{told[:MOST_OF_AN_ERROR]}..."
    return f"internal error ({type(error).__name__}{': ' if told else ''}{told}); please report it"


def is_incomplete(findings: "Iterable[Finding]") -> bool:
    """Tell whether a flight with these findings lacks a part that failed."""
    return any(finding.code.startswith(f"{CODE}.") for finding in findings)


def with_failures(findings: "Sequence[Finding]", found: Iterable[Failure]) -> "tuple[Finding, ...]":
    """Append the findings on failures to other findings, each once."""
    told = {finding.code for finding in findings}
    return (*findings, *(failure.finding() for failure in found if failure.code not in told))
