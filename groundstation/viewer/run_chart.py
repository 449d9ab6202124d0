"""Charts of one run (a taxi, an approach) over the time since its start.

A time view shows the whole flight or a stretch about the cursor, on the timeline chosen; a run of two minutes in a
flight of an hour is a sliver in it. Here it has an axis of its own, with the cursor on it while it lasts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.timescales import duration_text
from groundstation.viewer import colours
from groundstation.viewer.chart import Axis, Chart, screen_radius
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray

HEIGHT = 70.0  # of the box, which is 160 wide
CURSOR = 0.6  # radius in points of the screen
CURSOR_STEPS = 600  # of a run
MARGIN = 0.08


@dataclass(frozen=True)
class Run:
    """A stretch of the flight, flight seconds."""

    start_s: float
    end_s: float

    def rows(self, time_s: FloatArray) -> np.ndarray:
        """Positions of the rows inside."""
        return np.flatnonzero((time_s >= self.start_s) & (time_s <= self.end_s))


class RunChart:
    """Series of one run under ``path``; the vertical axis holds all that is drawn unless ``ends`` says otherwise.

    Parameters
    ----------
    recorder : Recorder
    path : str
    title : str
        Of the vertical axis, with unit.
    run : Run
    shown : sequence of ndarray
        Values that the vertical axis holds.
    ends : (float, float), optional
        Its ends.
    """

    def __init__(
        self,
        recorder: Recorder,
        path: str,
        title: str,
        run: Run,
        shown: Sequence[FloatArray],
        ends: tuple[float, float] | None = None,
    ) -> None:
        self.run = run
        x = Axis(
            f"time since {duration_text(round(run.start_s)).removesuffix('.0')}, s",
            0.0,
            max(run.end_s - run.start_s, 1.0),
        )
        self.chart = Chart(recorder, path, x, Axis(title, *(ends or _ends(shown))), HEIGHT)
        self._cursor(recorder, path)

    def view(self, lines: Sequence[Line] = ()) -> rrb.Spatial2DView:
        """The view, with the names of the lines above the box."""
        if lines:
            self.chart.legend(lines)
        return self.chart.view()

    def line(self, name: str, time_s: FloatArray, values: FloatArray, line: Line) -> None:
        """Log a line, interrupted at NaN."""
        self.chart.curves(name, [(time_s - self.run.start_s, values, line)])

    def band(self, name: str, time_s: FloatArray, low: FloatArray, high: FloatArray, line: Line) -> None:
        """Log a filled band."""
        self.chart.band(name, time_s - self.run.start_s, low, high, line.colour)

    def dots(self, name: str, time_s: FloatArray, values: FloatArray, line: Line) -> None:
        """Log samples that no line should join."""
        points = self.chart.points(time_s - self.run.start_s, values)
        inside = points[np.isfinite(points).all(axis=1)]
        drawn = rr.Points2D(inside, colors=[line.colour] * len(inside), radii=screen_radius(line.width), draw_order=1.0)
        self.chart.recorder.static(f"{self.chart.path}/{name}", drawn)

    def _cursor(self, recorder: Recorder, path: str) -> None:
        """Log an upright line that moves while the run lasts and is gone afterwards."""
        time_s = np.linspace(self.run.start_s, self.run.end_s, CURSOR_STEPS)
        x = self.chart.points(time_s - self.run.start_s, np.full(len(time_s), self.chart.y.low))[:, 0]
        strips = [np.array([[place, 0.0], [place, HEIGHT]]) for place in np.nan_to_num(x).tolist()]
        style = rr.LineStrips2D.from_fields(colors=[colours.LIGHT], radii=screen_radius(CURSOR), draw_order=3.0)
        recorder.static(f"{path}/cursor", style)
        after = np.append(time_s, self.run.end_s + (time_s[1] - time_s[0]))
        columns = rr.LineStrips2D.columns(strips=strips).partition([*[1] * len(strips), 0])
        recorder.stream.send_columns(f"{path}/cursor", recorder.indexes(recorder.time_ns(after)), columns)


def _ends(shown: Sequence[FloatArray]) -> tuple[float, float]:
    """Ends of an axis that holds all finite values, with a margin."""
    known = np.concatenate([values[np.isfinite(values)] for values in shown])
    if not known.size:
        return 0.0, 1.0
    margin = max(MARGIN * float(np.ptp(known)), 1e-3)
    return float(known.min()) - margin, float(known.max()) + margin


def runs_of(time_s: FloatArray, longest_gap_s: float) -> tuple[Run, ...]:
    """Stretches of rows between which no more time passes than stated; single rows are none.

    Examples
    --------
    >>> [(run.start_s, run.end_s) for run in runs_of(np.array([0.0, 1.0, 2.0, 50.0, 51.0, 99.0]), 10.0)]
    [(0.0, 2.0), (50.0, 51.0)]
    """
    known = np.unique(time_s[np.isfinite(time_s)])
    parts = np.split(known, np.flatnonzero(np.diff(known) > longest_gap_s) + 1)
    return tuple(Run(float(part[0]), float(part[-1])) for part in parts if len(part) > 1)
