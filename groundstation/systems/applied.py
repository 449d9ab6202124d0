"""Step behind the analyses of a flight that ``run --apply`` asks for.

A system that has one gives it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from groundstation.base.dataclasses import dataclass

if TYPE_CHECKING:
    from groundstation.base.records import RecordBatch
    from groundstation.results.flight import FlightResults
    from groundstation.systems.known import Known
    from groundstation.tables.table import Flight

APPLIED = ".applied"  # end of the code of the finding that tells that it was done: there is then an MCAP of it


@dataclass(frozen=True)
class Asked(ABC):
    """Value of ``--apply`` as plain values.

    It travels to worker processes and into the key of a run.
    """

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return plain values for the manifest."""


@dataclass(frozen=True)
class Derived:
    """Records that a step derived from those of a flight, at their times.

    Parameters
    ----------
    batch : RecordBatch
        All records of one topic.
    metadata : mapping
        What the MCAP tells of them besides the metadata of the flight.
    """

    batch: "RecordBatch"
    metadata: Mapping[str, str]


@dataclass(frozen=True)
class Applied:
    """Results of a flight with findings and figures of the step, and what it derived."""

    results: "FlightResults"
    derived: Derived | None = None


@dataclass(frozen=True)
class ApplyStep:
    """Step behind the analyses, as a part of a system.

    Parameters
    ----------
    read : callable
        ``read(text)``: what the text of ``--apply`` asks for; UsageError where it names nothing that can be applied.
    run : callable
        ``run(flight, results, asked, known)``: a finding says what was done, or why nothing was.
    """

    read: Callable[[str], Asked]
    run: "Callable[[Flight, FlightResults, Any, Known], Applied]"
