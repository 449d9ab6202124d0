"""Recorder of one flight for Rerun: every tab logs with it, on both timelines."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray
from rerun.components import AggregationPolicy, InterpolationMode

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.systems.system import Systems
from groundstation.viewer.colours import SEVERITIES, Colour, for_states
from groundstation.viewer.names import clean_text
from groundstation.viewer.series import FloatArray, break_line, thin

UTC, FLIGHT_TIME = "utc", "flight_time"
ROWS_PER_CALL = 65_536  # larger chunks only cost the viewer memory
NO_SYSTEMS = Systems(())
MAX_LOG_TEXT = 600
MAX_HALF_WIDTH = 1e150  # of a band: its square is a number
LEVELS = {"info": "INFO", "warn": "WARN", "fail": "ERROR"}


@dataclass(frozen=True)
class Line:
    """Appearance of one series: its name with unit, colour and width in points."""

    name: str
    colour: Colour
    width: float = 1.5


class Recorder:
    """A Rerun stream that knows the flight's clock.

    Parameters
    ----------
    stream : rerun.RecordingStream
    start_ns : int
        Corrected time of flight time zero.
    has_utc : bool
        Whether corrected time is UTC; without it there is no timeline ``utc``.
    systems : Systems
        Those whose chapters and plots the tabs show.
    """

    def __init__(self, stream: rr.RecordingStream, start_ns: int, has_utc: bool, systems: Systems = NO_SYSTEMS) -> None:
        self.stream, self.start_ns, self.has_utc, self.systems = stream, start_ns, has_utc, systems

    def time_ns(self, flight_seconds: ArrayLike) -> Int64Array:
        """Return the corrected time of flight seconds, to the nanosecond."""
        offsets = np.rint(np.asarray(flight_seconds, dtype=np.float64) * NS_PER_S).astype(np.int64)
        return offsets + np.int64(self.start_ns)

    def indexes(self, time_ns: Int64Array) -> list[rr.TimeColumn]:
        """Return time columns of the rows on every timeline the flight has."""
        columns = [rr.TimeColumn(FLIGHT_TIME, duration=(time_ns - self.start_ns).astype("timedelta64[ns]"))]
        if self.has_utc:
            columns.append(rr.TimeColumn(UTC, timestamp=time_ns.astype("datetime64[ns]")))
        return columns

    def static(self, path: str, archetype: Any) -> None:
        """Log what holds for the whole flight."""
        self.stream.log(path, archetype, static=True)

    def document(self, path: str, markdown: str) -> None:
        """Log a text panel."""
        self.static(path, rr.TextDocument(markdown, media_type=rr.MediaType.MARKDOWN))

    def lines(
        self,
        path: str,
        time_ns: Int64Array,
        values: FloatArray,
        lines: Sequence[Line],
        breaks: BoolArray | None = None,
        *,
        is_stepped: bool = False,
    ) -> None:
        """Log series that share their rows.

        ``values`` has the shape (n, k), NaN where a line is interrupted. ``breaks``, shape (n - 1,), tells after which
        rows the lines end; a row of NaN is put there. Stepped lines hold each value until the next one.
        """
        if breaks is not None:
            time_ns, values = break_line(time_ns, values, breaks)
        style = rr.SeriesLines(
            names=[line.name for line in lines],
            colors=[line.colour for line in lines],
            widths=[line.width for line in lines],
            aggregation_policy=AggregationPolicy.MinMax,  # averages would hide spikes until one zooms in
            interpolation_mode=InterpolationMode.StepAfter if is_stepped else None,
        )
        self.static(path, style)
        self._scalars(path, time_ns, values)

    def thinned(
        self,
        path: str,
        time_ns: Int64Array,
        values: FloatArray,
        lines: Sequence[Line],
        breaks: BoolArray,
        limit: int,
    ) -> int:
        """Log series as :meth:`lines` does, thinned to ``limit`` rows; return the rows kept.

        See :func:`series.thin`; ``limit`` is approximate.
        """
        rows = thin(values, breaks, limit)
        self.lines(path, time_ns[rows], values[rows], lines, breaks[rows[:-1]])
        return len(rows)

    def band(
        self,
        path: str,
        time_ns: Int64Array,
        centre: FloatArray,
        half_width: FloatArray,
        line: Line,
        breaks: BoolArray | None = None,
    ) -> None:
        """Log a filled band of ``half_width`` on either side of a line, shapes (n,).

        Empty where one of them is NaN. Rerun fills one sigma of a measurement: its variance is the half width squared,
        whatever share the name says that the band holds. Axes are scaled by the line alone. Entities are drawn in the
        order of their names.
        """
        edges = np.column_stack([centre, half_width])
        if breaks is not None:
            time_ns, edges = break_line(time_ns, edges, breaks)
        known = np.isfinite(edges[:, 0]) & (np.abs(edges[:, 1]) < MAX_HALF_WIDTH)
        values, variances = np.where(known, edges[:, 0], np.nan), np.where(known, edges[:, 1], 0.0) ** 2
        style = rr.Measurements.from_fields(names=[line.name], colors=[line.colour], widths=[line.width])
        self.static(path, style)
        for part in self._parts(time_ns):
            columns = rr.Measurements.columns(values=values[part], variances=variances[part])
            self.stream.send_columns(path, self.indexes(time_ns[part]), columns)

    def dots(self, path: str, time_ns: Int64Array, values: FloatArray, line: Line, *, is_hollow: bool = False) -> None:
        """Log one series, shape (n,), as dots: samples that no line should join.

        The viewer has no hollow ones: they are crosses, twice as large.
        """
        size = 2.0 * line.width if is_hollow else line.width
        marker = rr.components.MarkerShape.Cross if is_hollow else rr.components.MarkerShape.Circle
        style = rr.SeriesPoints(names=[line.name], colors=[line.colour], marker_sizes=[size], markers=marker)
        self.static(path, style)
        self._scalars(path, time_ns, values[:, None])

    def _scalars(self, path: str, time_ns: Int64Array, values: FloatArray) -> None:
        width = values.shape[1]
        for part in self._parts(time_ns):
            scalars = rr.Scalars.columns(scalars=np.ascontiguousarray(values[part]).ravel())
            rows = len(time_ns[part])
            self.stream.send_columns(path, self.indexes(time_ns[part]), scalars.partition(np.full(rows, width)))

    def _parts(self, time_ns: Int64Array) -> Iterable[slice | Int64Array]:
        """Return rows in parts that one call sends."""
        return (slice(start, start + ROWS_PER_CALL) for start in range(0, len(time_ns), ROWS_PER_CALL))

    def lane(self, path: str, time_ns: Int64Array, states: Sequence[str], colours: Mapping[str, Colour]) -> None:
        """Log one lane of states, each until the next row.

        An empty state ends the one before.
        """
        shown = [clean_text(state) for state in states]
        shades = for_states((state for state in shown if state), colours)
        self.static(path, rr.StateConfiguration(values=list(shades), colors=list(shades.values())))
        self.stream.send_columns(path, self.indexes(time_ns), rr.StateChange.columns(state=shown))

    def spans(
        self,
        path: str,
        start_s: FloatArray,
        end_s: FloatArray,
        states: NDArray[np.str_],
        colours: Mapping[str, Colour],
    ) -> None:
        """Log a lane from spans in flight seconds; what no span covers stays empty."""
        starts, ends = self.time_ns(start_s), self.time_ns(end_s)
        closed = np.ones(len(starts), dtype=bool)
        closed[:-1] = ends[:-1] < starts[1:]
        times = np.concatenate([starts, ends[closed]])
        names = [*states.tolist(), *[""] * int(closed.sum())]
        order = np.argsort(times, kind="stable")
        self.lane(path, times[order], [names[position] for position in order], colours)

    def texts(self, path: str, time_ns: Int64Array, texts: Sequence[str], severities: Sequence[str]) -> None:
        """Log lines of a text log; severities are ``info``, ``warn`` or ``fail``."""
        columns = rr.TextLog.columns(
            text=[clean_text(text, MAX_LOG_TEXT) for text in texts],
            level=[LEVELS[severity] for severity in severities],
            color=[SEVERITIES[severity] for severity in severities],
        )
        self.stream.send_columns(path, self.indexes(time_ns), columns)
