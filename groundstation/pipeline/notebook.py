"""Flight in a notebook, from a log or from a flight folder."""

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from html import escape
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

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
from groundstation.pipeline.answer_methods import AnswerMethods
from groundstation.pipeline.logged_facts import events_frame, metadata_series, parameters_frame
from groundstation.results.arrays.flight import PhaseSpans
from groundstation.results.arrays.states import BodyStates
from groundstation.results.flight import FlightResults, Source
from groundstation.tables.table import Flight, Table, Tables, TimedTable, timed

if TYPE_CHECKING:
    import pandas as pd

    from groundstation.plots.plot import Plot
    from groundstation.results.files import SavedFlight

AnyPath = str | PathLike[str]
MOST_TOPICS = 12  # named in the card of a flight
LINE, MOST_LINES = 100, 4  # characters and lines of the text of a flight


class OpenFlight(AnswerMethods):
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
    def _logged(self) -> Mapping[str, str]:
        """Return the metadata of the log, by name."""

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

    @cached_property
    def parameters(self) -> "pd.DataFrame":
        """Parameters of the autopilot as a frame by name; without rows where the log has none.

        Columns: ``value``, ``default`` (NaN where the log does not tell it), ``differs`` from the default, ``first``,
        ``changed`` while the log was recorded. Units are the autopilot's own.
        """
        return parameters_frame(self.flight)

    @cached_property
    def metadata(self) -> "pd.Series[str]":
        """Facts that the log tells of itself, by name: vehicle, firmware, hardware, serials.

        After these it has everything else as the log names it.
        """
        return metadata_series(self._logged())

    @cached_property
    def events(self) -> "pd.DataFrame":
        """Events that the log names as a frame by time: markers, messages, modes.

        Columns: ``time_s`` (flight seconds), ``topic``, ``name``, ``severity`` (info, warn, fail, or empty).
        """
        return events_frame(self.flight)

    @property
    def phases(self) -> "pd.DataFrame":
        """Phases of the flight as a frame: start and end in flight seconds, with UTC beside."""
        return self.results.to_frame(PhaseSpans.figure)

    @property
    def findings(self) -> "pd.DataFrame":
        """Findings as a frame: severity, code, text with figures and units, topic, place."""
        return self.results.to_frame("findings")

    def utc(self, time_s: ArrayLike) -> "pd.DatetimeIndex":
        """Return UTC of flight seconds, which answers give their times in; NaT for NaN.

        Raises
        ------
        NotAssessableError
            When the flight has no UTC.
        """
        if self.results.start_utc_ns is None:
            raise NotAssessableError(self.source.name, "no UTC in this flight", "flight seconds")
        return self.results.utc(np.atleast_1d(np.asarray(time_s, dtype=np.float64)))

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

    def __dir__(self) -> list[str]:
        """Return the public names: what a person may ask for."""
        return sorted(name for name in super().__dir__() if not name.startswith("_") or name.startswith("__"))

    def __repr__(self) -> str:
        from groundstation.pipeline.one_flight.flight import sentence

        done = self.__dict__.get("results")
        told = f": {sentence(done)}" if done is not None else ""
        text = f"<{type(self).__name__} {self.source.name} ({self.source.reader}){told}>"
        return "\n".join(wrap(text, LINE, max_lines=MOST_LINES, placeholder=" ...>", break_on_hyphens=False))

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
