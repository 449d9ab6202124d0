"""All results of one flight in one frozen object, for the recording and the report."""

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnknownNameError
from groundstation.base.failures import attempt
from groundstation.base.findings import Finding
from groundstation.base.ledger import Ledger
from groundstation.base.units import NS_PER_S
from groundstation.results.answer import A, Answers, PlanAnswer, R, SessionAnswer, answer_meeting, answer_of
from groundstation.results.arrays.typed import T
from groundstation.results.chosen import ChosenInterval
from groundstation.results.figures import FigureData, FigureSet, numbers
from groundstation.results.frames import RowsInside, Tabular, row_fields

if TYPE_CHECKING:
    import pandas as pd

Status = Literal["ok", "degraded", "failed"]


@dataclass(frozen=True)
class NotAssessable:
    """An analysis that could not be carried out, and the reason for people."""

    analysis: str  #: Name of the analysis, as in `groundstation list`.
    reason: str  #: What is missing, for people.


@dataclass(frozen=True)
class Source:
    """The log a flight came from: name without folders, SHA-256, size, reader that claimed it."""

    name: str  #: File name without folders.
    sha256: str = field(metadata={"pattern": "^[0-9a-f]{64}$"})  #: SHA-256 of the whole file, hexadecimal.
    size_bytes: int  #: Length of the file.
    reader: str  #: Format as the reader that claimed it names it.


KIND_OF_VEHICLE = "vehicle.kind"  # keys of the metadata: rolls, flies, walks, floats or unknown
WHY_THAT_VEHICLE, PHASES_BY = "vehicle.why", "phases.method"
SIMULATED_BY = "vehicle.simulated"  # what tells that a simulator made the log
ALTITUDE_DATUM = "altitude.datum"  # what the altitude of the overview is above: MSL or ellipsoid
# Facts that no log has: a run adds them.
FOUND_BY_RUN = (KIND_OF_VEHICLE, WHY_THAT_VEHICLE, PHASES_BY, SIMULATED_BY, ALTITUDE_DATUM)
NAT_NS = np.iinfo(np.int64).min  # numpy's "not a time"
UTC_OF = {"time_s": "utc", "start_s": "start_utc", "end_s": "end_utc"}  # columns of flight seconds, and their UTC


@dataclass(frozen=True, repr=False)
class FlightResults(Tabular):
    """Results of one flight.

    Parameters
    ----------
    flight_id : str
    source : Source
    metadata : mapping of str to str
        ``aircraft``, ``flight`` and what the log says.
    start_utc_ns : int, optional
        First corrected time, UTC nanoseconds since 1970; None for a log without absolute time.
    duration_s : float
    status : {'ok', 'degraded', 'failed'}
        degraded: data was lost; failed: a finding is a failure.
    completeness : mapping of topic to share of expected samples, 0 to 1
    ledger : Ledger
    clock : Clock
    findings, not_assessable : tuples
    answers : mapping of str to Answer
        By the name of the analysis, in the order they are shown.
    figures : sequence of FigureData
        Arrays behind every figure, those of the analyses among them.
    chosen : tuple of ChosenInterval
        Intervals that the user left out or forced.
    """

    flight_id: str
    source: Source
    metadata: Mapping[str, str]
    start_utc_ns: int | None
    duration_s: float
    status: Status
    completeness: Mapping[str, float] = field(default_factory=dict)
    ledger: Ledger = field(default_factory=Ledger)
    clock: Clock = field(default_factory=Clock)
    findings: tuple[Finding, ...] = ()
    not_assessable: tuple[NotAssessable, ...] = ()
    answers: Answers = field(default_factory=dict)
    figures: Sequence[FigureData] = ()
    chosen: tuple[ChosenInterval, ...] = ()

    @property
    def is_plan(self) -> bool:
        """Tell whether the results are those of a plan and not of something flown."""
        return self.answer_meeting(PlanAnswer) is not None

    @property
    def is_session(self) -> bool:
        """Tell whether the results are those of a session of several aircraft."""
        return self.answer_meeting(SessionAnswer) is not None or self.figure("session_clocks") is not None

    def answer(self, kind: type[A]) -> A | None:
        """The answer of that type, None where its analysis has none."""
        return answer_of(self.answers, kind)

    def answer_meeting(self, role: type[R]) -> R | None:
        """Return the answer that plays a role, None where there is none."""
        return answer_meeting(self.answers, role)

    def reasons(self, *analyses: str) -> tuple[str, ...]:
        """Return the reasons why these analyses could not run, for those that could not."""
        return tuple(entry.reason for entry in self.not_assessable if entry.analysis in analyses)

    def figure(self, name: str) -> FigureData | None:
        """The figure data of that name, None when the flight has none."""
        if isinstance(self.figures, FigureSet):
            return self.figures.named(name)
        return next((figure for figure in self.figures if figure.name == name), None)

    def rows_of(self, kind: type[T], *of: str) -> T | None:
        """Return the typed arrays of a figure; None when they are missing, empty or incomplete.

        Incomplete means that a column is missing.

        Parameters
        ----------
        kind : type of Arrays
        *of : str
            Names that tell several of a kind apart: ``together_<of>_motion``.

        Raises
        ------
        MissingColumnError
            When arrays that were saved lack a column that they must have, and nobody gathers failures.
        """
        found = self.figure(kind.figure.format(*of))
        return attempt("arrays", found.name, kind.of, found) if found is not None and len(found) else None

    def figure_with_rows(self, name: str) -> FigureData | None:
        """The figure data of that name, None when the flight has none or it is empty."""
        found = self.figure(name)
        return found if found is not None and len(found) else None

    @property
    def figure_names(self) -> tuple[str, ...]:
        """Names of the figure data; none of them is read for it."""
        if isinstance(self.figures, FigureSet):
            return self.figures.names
        return tuple(figure.name for figure in self.figures)

    @classmethod
    def _tables(cls) -> Mapping[str, RowsInside]:
        return {name: RowsInside(row, (name,)) for name, row in row_fields(cls).items()}

    def table_names(self) -> tuple[str, ...]:
        """Names that :meth:`to_frame` takes.

        They are findings, what was not assessable, and the arrays behind the figures.
        """
        return (*super().table_names(), *self.figure_names)

    def to_frame(self, table: str = "findings") -> "pd.DataFrame":
        """A table of the flight as a frame: a list of rows, or the arrays behind a figure.

        Where the flight has UTC, flight seconds of arrays have it beside them (``utc``, ``start_utc``, ``end_utc``).

        Raises
        ------
        UsageError
            When there is no such table.
        """
        if table in super().table_names():
            return super().to_frame(table)
        figure = self.figure(table)
        if figure is None:
            raise UnknownNameError("tables", table, self.table_names())
        frame = figure.to_frame()
        if self.start_utc_ns is not None:
            for place, name in enumerate([name for name in UTC_OF if name in figure.columns]):
                frame.insert(place, UTC_OF[name], self.utc(numbers(figure, name)))
        return frame

    def utc(self, flight_seconds: NDArray[np.float64]) -> "pd.DatetimeIndex":
        """UTC of flight seconds, NaT where unknown."""
        import pandas as pd

        known = np.isfinite(flight_seconds)
        offsets = np.rint(np.where(known, flight_seconds, 0.0) * NS_PER_S).astype(np.int64)
        times = np.where(known, offsets + (self.start_utc_ns or 0), NAT_NS)
        return pd.DatetimeIndex(times.astype("datetime64[ns]"), tz="UTC")

    def __repr__(self) -> str:
        told = f"answers {', '.join(self.answers) or 'none'}, {len(self.findings)} findings"
        return f"<FlightResults {self.flight_id}: {self.status}, {told}>"
