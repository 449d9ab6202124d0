"""Outcome of one log of a run, for the totals line, the index and the exit code."""

import traceback
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, lack_of_memory
from groundstation.base.failures import Failure
from groundstation.base.failures import reason_of as why
from groundstation.results.manifest import PartOfRun

State = Literal["done", "data_lost", "limit_reached", "incomplete", "failed", "skipped"]
EXIT_CODE: Mapping[State, int] = {
    "done": 0,
    "skipped": 0,
    "data_lost": 3,
    "limit_reached": 4,
    "incomplete": 1,
    "failed": 1,
}
WORST_FIRST = (1, 4, 3, 0)


@dataclass(frozen=True)
class Outcome:
    """Outcome of one log, or of a session of several.

    Parameters
    ----------
    source : str
        Path of the log as the user would type it.
    state : {'done', 'data_lost', 'limit_reached', 'incomplete', 'failed', 'skipped'}
        A flight that lacks a part which failed by a defect is incomplete; all else of it is there.
    text : str
        One line for people: the verdict, or the reason of a failure.
    flight_id, folder : str
        Empty when there is none.
    times_s : mapping
        Seconds spent, by stage.
    trace : str
        Where an internal error came from; shown on request.
    is_session : bool
        Whether it is of a session: ``source`` are then the names of its logs, and ``flight_id`` is that of the session.
    was_finished : bool
        Whether an earlier run had finished it, so that nothing was computed.
    failures : tuple of Failure
        The parts that failed.
    is_beside : bool
        Whether it is the outcome of no log, but of the index, the page of all flights, or another store.
    power_up : int
        Which of several power-ups in the log, from 1; 0 where the log holds one.
    more : tuple of Outcome
        Outcomes of the other power-ups.
    parts : tuple of PartOfRun
        The consecutive logs of the flight: their ends show whether another log continues it.
    loss : str
        Loss by the ledger of the log: data, or its end alone; empty where the state tells it.
    """

    source: str
    state: State
    text: str
    flight_id: str = ""
    folder: str = ""
    sha256: str = ""
    times_s: Mapping[str, float] = field(default_factory=dict)
    trace: str = ""
    is_session: bool = False
    was_finished: bool = False
    failures: tuple[Failure, ...] = ()
    is_beside: bool = False
    power_up: int = 0
    more: "tuple[Outcome, ...]" = ()
    parts: tuple[PartOfRun, ...] = ()
    loss: str = ""

    @property
    def code(self) -> int:
        """Exit code of this log alone."""
        return EXIT_CODE[self.state]


def reason_of(name: str, error: Exception) -> tuple[str, str]:
    """Return why a log failed, in one line, and the trace of an error that is our defect.

    The trace is empty for other errors.
    """
    if isinstance(error, GroundstationError):
        return str(error), ""
    if isinstance(error, OSError) and not lack_of_memory(error):
        file = f"{Path(error.filename).name}: " if error.filename and Path(error.filename).name != name else ""
        return f"{name}: {file}{error.strerror or error}", ""
    trace = "" if lack_of_memory(error) else "".join(traceback.format_exception(error))
    return f"{name}: {why(error)}", trace


def worst_code(outcomes: "tuple[Outcome, ...]") -> int:
    """Return the exit code of several logs: the worst wins, in the order 1, 4, 3, 0.

    Examples
    --------
    >>> worst_code((Outcome("a", "data_lost", ""), Outcome("b", "limit_reached", ""), Outcome("c", "done", "")))
    4
    """
    codes = {outcome.code for outcome in outcomes}
    return next((code for code in WORST_FIRST if code in codes), 0)
