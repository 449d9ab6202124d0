"""Flight in a notebook, from a log or from a flight folder."""

from abc import ABC, abstractmethod
from functools import cached_property
from html import escape
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from groundstation.base.clock import Clock
from groundstation.base.errors import (
    GroundstationError,
    NotAssessableError,
    UnknownNameError,
    UsageError,
    told_in_a_line,
)
from groundstation.base.ledger import Ledger
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.results.answer import A
from groundstation.results.arrays.states import BodyStates
from groundstation.results.flight import FlightResults, Source
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.latency.answer import Latencies
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.flux_answer import FluxDeviation
from groundstation.systems.magnetic.ground_answer import GroundDeviation
from groundstation.systems.trajectory.answer import BestTrajectory
from groundstation.tables.table import Flight, Table, Tables, TimedTable, timed

if TYPE_CHECKING:
    from groundstation.plots.plot import Plot
    from groundstation.results.files import SavedFlight

AnyPath = str | PathLike[str]
MOST_TOPICS = 12  # named in the card of a flight


class OpenFlight(ABC):
    """One flight in a notebook. All methods work alike for a log and for a flight folder."""

    @property
    @abstractmethod
    def source(self) -> Source:
        """The log it comes from: name, SHA-256, size, reader."""

    @property
    @abstractmethod
    def ledger(self) -> Ledger:
        """Integrity ledger: rates, gaps, losses and odd values of every topic."""

    @property
    @abstractmethod
    def clock(self) -> Clock:
        """Clock of the recorder: how it was read and repaired."""

    @property
    @abstractmethod
    def info(self) -> dict[str, str]:
        """Facts of the log: file, format, first and last sample, metadata."""

    @property
    @abstractmethod
    def flight(self) -> Flight:
        """Every topic on the corrected clock, as the estimators take it."""

    @property
    @abstractmethod
    def results(self) -> FlightResults:
        """Answers of all analyses.

        ``results.to_frame(name)`` gives findings and the arrays behind the figures.
        """

    @abstractmethod
    def with_settings(self, **sections: Any) -> "OpenFlight":
        """Return the same flight with other settings.

        The log is read again only for other ``thresholds`` of the ledger.

        Parameters
        ----------
        **sections
            ``heading``, ``inertial``, ``latency``, ``magnetic``, ``aircraft``, ``site``, ``thresholds``: mappings laid
            over what is set; ``exclude``, ``force``: lists of intervals (``from``, ``to``, ``reason``) in place of
            those set.

        Raises
        ------
        SettingsError
            For an unknown key or a value that cannot be used.
        """

    @abstractmethod
    def _saved(self) -> "SavedFlight":
        """Return the flight as the report reads it."""

    @cached_property
    def tables(self) -> Tables:
        """Tables by topic: ``tables["ins"]["roll_deg"]`` is an array.

        ``tables["ins"].utc`` are its times. ``tables["ins"].to_frame()`` is indexed by UTC, or by flight time where
        there is none.
        """
        return Tables(self.flight)

    def heading(self) -> HeadingResult:
        """Return the heading correction (system 1).

        Raises
        ------
        NotAssessableError
            When the data does not allow it; the message says why.
        """
        return self.answer(HeadingResult)

    def inertial(self) -> InertialResult:
        """Return the errors of the INS (system 2); raises as :meth:`heading`."""
        return self.answer(InertialResult)

    def forecast(self) -> ForecastResult:
        """Return how far the INS can be trusted without GNSS; raises as :meth:`heading`."""
        return self.answer(ForecastResult)

    def latency(self) -> Latencies:
        """Return how much later than the INS each sensor shows the motion.

        Raises as :meth:`heading`.
        """
        return self.answer(Latencies)

    def magnetic(self) -> MagneticResult:
        """Return the deviation of the magnetic heading (system 3); raises as :meth:`heading`."""
        return self.answer(MagneticResult)

    def magnetic_ground(self) -> GroundDeviation:
        """Return the error of the installed heading sensor on straight ground runs.

        Raises as :meth:`heading`.
        """
        return self.answer(GroundDeviation)

    def magnetic_flux(self) -> FluxDeviation:
        """Return the deviation of a compass that gives heading alone, in flight.

        Raises as :meth:`heading`.
        """
        return self.answer(FluxDeviation)

    def trajectory(self) -> BestTrajectory:
        """Return the best trajectory: state, accuracy, checks, errors of the on-board filter.

        :meth:`states` has the trajectory itself. Raises as :meth:`heading`.
        """
        return self.answer(BestTrajectory)

    def states(self) -> TimedTable:
        """Return every state of the best trajectory with its sigmas, as a table.

        ``states()["true_heading_deg"]`` is an array, ``states().to_frame()`` a frame indexed by UTC, or by flight time
        where there is none. Names are those of :attr:`tables`.

        Raises
        ------
        NotAssessableError
            As :meth:`trajectory`; or when the flight folder was made by a version that did not keep them.
        """
        of = self.trajectory()
        kept = self.results.rows_of(BodyStates)
        if kept is None:
            raise NotAssessableError(of.states_name, "its states are not kept", "", "run the log again")
        start_utc_ns = self.results.start_utc_ns
        start_ns = self.flight.start_ns if start_utc_ns is None else start_utc_ns
        time_ns = start_ns + np.rint(kept.time_s * NS_PER_S).astype(np.int64)
        columns = {name: Column(values) for name, values in kept.columns.items() if name != "time_s"}
        table = Table(of.states_name, time_ns, columns, np.arange(len(kept)), Column(time_ns))
        return timed(Flight({table.topic: table}, {}, start_ns, start_utc_ns is not None), table.topic)

    def answer(self, kind: type[A]) -> A:
        """Return the answer of any analysis, by its type.

        Raises
        ------
        NotAssessableError
            When the data does not allow it; the message says why.
        """
        found = self.results.answer(kind)
        if found is not None:
            return found
        from groundstation.systems import systems

        required = {one.answer: one.requires for one in systems().analyses}.get(kind, ())
        reasons = self.results.reasons(kind.analysis) or self.results.reasons(*required)
        raise NotAssessableError(kind.analysis, reasons[0] if reasons else "the log does not hold what it needs")

    @property
    def figures(self) -> dict[str, str]:
        """Names that :meth:`figure` takes, with their titles."""
        return {name: plot.title for name, plot in self._plots.items()}

    def figure(self, name: str) -> Any:
        """Return a figure of the report, for matplotlib.

        Parameters
        ----------
        name : str
            One of :attr:`figures`, or the name of arrays that one shows (``heading_distribution``).

        Returns
        -------
        matplotlib.figure.Figure
            A cell that ends with it shows it; it may be changed and saved.

        Raises
        ------
        UsageError
            When this flight has no such figure, or matplotlib is not installed.
        """
        showing = (plot for plot in self._plots.values() if name in plot.numbers)
        plot = self._plots.get(name) or next(showing, None)
        if plot is None:
            raise UnknownNameError("figures", name, self._plots)
        if find_spec("matplotlib") is None:
            raise UsageError(f"figure {name}", "no package matplotlib", "", "pip install 'groundstation[notebook]'")
        from groundstation.reports.notebook.figure import figure_of

        return figure_of(plot)

    @cached_property
    def _plots(self) -> "dict[str, Plot]":
        from groundstation.reports.notebook.plots import plots_of
        from groundstation.systems import systems

        return plots_of(self._saved(), systems())

    def recording(self, path: AnyPath) -> Path:
        """Write the Rerun recording to a file and return its path.

        ``groundstation view`` and Rerun open it.
        """
        from groundstation.systems import systems
        from groundstation.viewer.recording import write_recording

        target = Path(path)
        with told_in_a_line(str(target)):
            write_recording(target, self.flight, self.results, systems())
        return target

    def show(self, *, inline: bool | None = None, width: int | str = "auto", height: int | str = 700) -> Any:
        """Show the recording: in a notebook in the cell, elsewhere in the Rerun viewer.

        Parameters
        ----------
        inline : bool, optional
            Where; left out, in the cell if this is a notebook. The viewer's own window is waited for.
        width, height : int or "auto"
            Pixels, in the cell.

        Returns
        -------
        rerun.notebook.Viewer or None
            A cell that ends with it shows it.

        Raises
        ------
        GroundstationError
            When rerun-notebook is not installed (``pip install 'groundstation[notebook]'``), or no viewer starts.
        """
        from groundstation.systems import systems
        from groundstation.viewer.inline import inline_viewer, is_notebook
        from groundstation.viewer.launch import open_viewer

        if is_notebook() if inline is None else inline:
            return inline_viewer(self.flight, self.results, systems(), width=width, height=height)
        with told_in_a_line(self.source.name), TemporaryDirectory(prefix="groundstation-") as folder:
            code = open_viewer(self.recording(Path(folder) / "flight.rrd"))
        if code:
            raise GroundstationError("the Rerun viewer", f"ended with code {code}", next_step="is there a display?")
        return None

    def __repr__(self) -> str:
        from groundstation.pipeline.one_flight.flight import sentence

        done = self.__dict__.get("results")
        told = f": {sentence(done)}" if done is not None else ""
        return f"<{type(self).__name__} {self.source.name} ({self.source.reader}){told}>"

    def _repr_html_(self) -> str:
        """Return the top of the report as a short table: verdict, correction, span, topics."""
        from groundstation.chapters.front import front
        from groundstation.systems import systems

        told = front(self._saved().results, systems().chapters)
        rows = [(name, value if isinstance(value, str) else value.text) for name, value in told.pairs]
        rows.insert(0, ("Flight", told.title))
        if told.verdict is not None:
            rows.insert(0, ("Verdict", told.verdict.text))
        rows += [(name, f"{value}, {remark}" if remark else value) for name, value, remark in told.figures]
        topics = [f"{name} ({topic.rows})" for name, topic in sorted(self.ledger.topics.items())]
        more = f" and {len(topics) - MOST_TOPICS} more" if len(topics) > MOST_TOPICS else ""
        rows.append(("Topics (rows)", ", ".join(topics[:MOST_TOPICS]) + more))
        left = 'style="text-align:left"'
        cells = [f"<tr><th {left}>{escape(name)}</th><td {left}>{escape(value)}</td></tr>" for name, value in rows]
        why = " ".join(told.sentences)
        return f"<table><caption {left}><b>{escape(told.headline)}</b> {escape(why)}</caption>{''.join(cells)}</table>"
