"""Charts of one number against another, drawn in 2D: lines, axes and ticks.

Rerun itself plots against time alone. The picture is a box of fixed shape; values are scaled into it, and the ticks say
what they are.
"""

from collections.abc import Sequence
from textwrap import wrap

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.dataclasses import dataclass
from groundstation.chapters.wording import clock
from groundstation.plots.plot import Scale
from groundstation.plots.ranges import thin
from groundstation.plots.scales import ScaleSpan
from groundstation.viewer import colours
from groundstation.viewer.colours import Colour, faint
from groundstation.viewer.names import clean_text
from groundstation.viewer.recorder import FLIGHT_TIME, UTC, Line, Recorder
from groundstation.viewer.series import FloatArray

WIDTH = 160.0  # of the box
LEFT, RIGHT, TOP, BOTTOM = 24.0, 6.0, 14.0, 20.0  # room for ticks, a title and the names of the lines
TICKS = 5  # about so many
TIME_STEPS_S = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400)
MOST_DECADES = 3  # of an axis on which twos and fives are written, too
GRID, LABEL = 0.4, 0.1  # widths and radii in points of the screen
KEY_ROOM, MOST_KEY_ROOM, LETTER = 56.0, 110.0, 4.4  # beside the box, for the names of many lines
MOST_ABOVE, MOST_LETTERS, MOST_OF_A_NAME = 4, 60, 25  # names above the box, their letters; letters of a row beside it
MOST_ROWS, MOST_WRAPPED = 3, 6  # rows of a name beside the box, where there are no more than so many names
BAND_COLUMNS, FINE = 320, 0.8  # upright lines of a filled band across the whole box; breadth of a line of a box
CURSOR, CURSOR_STEPS = 0.6, 300  # radius in points of the screen; places of a run
MOST_PLACES = 600  # of a mark that moves
FILLING, BEHIND, MIDDLE, FRONT, NOW = -1.0, 0.0, 1.0, 2.0, 90.0


@dataclass(frozen=True)
class ChartAxis:
    """Axis of a chart: title with unit, ends, scale, and the places that have own texts.

    One that runs backwards has the greater end first; a symlog scale is linear up to ``linear_to``.
    """

    title: str
    low: float
    high: float
    scale: Scale = "linear"
    linear_to: float = 1.0
    texts: tuple[tuple[float, str], ...] = ()

    def share(self, values: FloatArray) -> FloatArray:
        """Return the place of values along the axis, 0 to 1; NaN outside of it."""
        with np.errstate(invalid="ignore"):
            scaled = ScaleSpan(self.scale, self.low, self.high, self.linear_to).shares(values)
            return np.where((scaled >= -1e-9) & (scaled <= 1.0 + 1e-9), scaled, np.nan)

    def within(self, values: FloatArray) -> FloatArray:
        """Clip values to the ends of the axis."""
        return np.clip(values, min(self.low, self.high), max(self.low, self.high))

    def ticks(self) -> tuple[tuple[float, str], ...]:
        """Return round values inside the range, each with its text.

        Examples
        --------
        >>> [text for _, text in ChartAxis("lead, min", 0.0, 120.0).ticks()]
        ['0', '20', '40', '60', '80', '100', '120']
        >>> [text for _, text in ChartAxis("RMS, m", 5.0, 300.0, "log").ticks()]
        ['5', '10', '20', '50', '100', '200']
        >>> [text for _, text in ChartAxis("a, m", 3.2, 4.5, "log").ticks()]
        ['3.2', '3.4', '3.6', '3.8', '4', '4.2', '4.4']
        >>> [text for _, text in ChartAxis("flight time", 50.0, 200.0, "time").ticks()]
        ['1:00', '1:30', '2:00', '2:30', '3:00']
        """
        if self.texts:
            return tuple(one for one in self.texts if np.isfinite(self.share(np.array([one[0]]))[0]))
        low, high = min(self.low, self.high), max(self.low, self.high)
        if self.scale == "log" and len(places := _of_decades(low, high)) > 1:
            return tuple((place, f"{place:g}") for place in places)
        if self.scale == "symlog":
            sizes = [size for size in _of_decades(self.linear_to, max(abs(low), high)) if size >= self.linear_to]
            places = [*(-size for size in reversed(sizes)), 0.0, *sizes]
            return tuple((place, f"{place:g}") for place in places if low <= place <= high)
        step = round_step((high - low) / TICKS)
        if self.scale == "time":
            step = min((one for one in TIME_STEPS_S if TICKS * one * 2 > high - low), default=TIME_STEPS_S[-1])
        first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
        places = (np.arange(first, last + 1) * step + 0.0).tolist()  # + 0.0: no minus zero
        return tuple((place, clock(place) if self.scale == "time" else f"{place:g}") for place in places)


def _of_decades(low: float, high: float) -> list[float]:
    """Return ones, twos and fives of every decade; of many decades only the ones."""
    first, last = np.floor(np.log10(low)), np.ceil(np.log10(high))
    parts = (1.0, 2.0, 5.0) if np.log10(high / low) <= MOST_DECADES else (1.0,)
    marks = np.concatenate([part * 10.0 ** np.arange(first, last + 1) for part in parts])
    return sorted(marks[(marks >= low * (1 - 1e-9)) & (marks <= high * (1 + 1e-9))].tolist())


def screen_radius(points: float) -> float:
    """Return a radius in points of the screen; for Rerun that is a negative number."""
    return -points


def round_step(step: float) -> float:
    """Return the nearest of 1, 2 and 5 times a power of ten.

    Examples
    --------
    >>> round_step(24.0), round_step(0.13)
    (20.0, 0.1)
    """
    decade = 10.0 ** np.floor(np.log10(step))
    return float(min((1.0, 2.0, 5.0, 10.0), key=lambda factor: abs(factor * decade - step)) * decade)


class Chart:
    """Lines of one number against another under ``path``, with axes that stand still.

    Parameters
    ----------
    recorder : Recorder
    path : str
        Entity the chart lives under.
    x, y : ChartAxis
    height : float
        Of the box, which is 160 wide.
    """

    def __init__(self, recorder: Recorder, path: str, x: ChartAxis, y: ChartAxis, height: float = 100.0) -> None:
        self.recorder, self.path, self.x, self.y, self.height = recorder, path, x, y, height
        self.right = RIGHT
        self._frame()

    def view(self, name: str = "") -> rrb.Spatial2DView:
        """Return the view that shows the chart, named after its axes unless it has a name."""
        bounds = rrb.VisualBounds2D(x_range=[-LEFT, WIDTH + self.right], y_range=[-TOP, self.height + BOTTOM])
        name = name or f"{self.y.title} by {self.x.title}"
        return rrb.Spatial2DView(name=name, origin=f"/{self.path}", visual_bounds=bounds)

    def points(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return places in the picture, shape (n, 2); its axes run right and down."""
        return np.column_stack([WIDTH * self.x.share(x), self.height * (1.0 - self.y.share(y))])

    def legend(self, lines: Sequence[Line], *, is_beside: bool = False) -> None:
        """Write the names of lines, each in its colour: of a few above the box, of many beside it."""
        letters = [len(line.name) for line in lines]
        if is_beside or len(lines) > MOST_ABOVE or sum(letters) > MOST_LETTERS:
            longest = min(max(letters, default=0), MOST_OF_A_NAME)
            self.right = min(max(KEY_ROOM, LETTER * longest), MOST_KEY_ROOM)
            step = self.height / max(len(lines), 1)
            places = [[WIDTH + 0.5 * self.right, step * (place + 0.1)] for place in range(len(lines))]
        else:
            step = WIDTH / max(len(lines), 1)
            places = [[step * (place + 0.5), -11.0] for place in range(len(lines))]
        names = [clean_text(line.name, MOST_LETTERS) for line in lines]
        if self.right > RIGHT:
            rows = MOST_ROWS if len(lines) <= MOST_WRAPPED else 1
            names = ["\n".join(wrap(name, MOST_OF_A_NAME, max_lines=rows, placeholder=" ...")) for name in names]
        self.texts("legend", np.array(places), names, [line.colour for line in lines])

    def curves(
        self,
        name: str,
        curves: Sequence[tuple[FloatArray, FloatArray, Line]],
        at_s: float | None = None,
        order: float = FRONT,
    ) -> None:
        """Log lines; with ``at_s`` they are shown from that flight time on.

        They stay until others take their place.
        """
        strips: list[FloatArray] = []
        shades: list[Colour] = []
        radii: list[float] = []
        for x, y, line in curves:
            pieces = unbroken(self.points(x, y))
            strips += pieces
            shades += [line.colour] * len(pieces)
            radii += [screen_radius(line.width)] * len(pieces)
        self._log(name, rr.LineStrips2D(strips, colors=shades, radii=radii, draw_order=order), at_s)

    def dots(self, name: str, x: FloatArray, y: FloatArray, line: Line, order: float = MIDDLE) -> None:
        """Log samples that no line should join."""
        points = self.points(x, y)
        inside = points[np.isfinite(points).all(axis=1)]
        drawn = rr.Points2D(inside, colors=[line.colour], radii=screen_radius(line.width), draw_order=order)
        self.recorder.static(f"{self.path}/{name}", drawn)

    def band(
        self,
        name: str,
        x: FloatArray,
        low: FloatArray,
        high: FloatArray,
        colour: Colour,
        at_s: float | None = None,
        order: float = FILLING,
    ) -> None:
        """Log a filled band between two curves, of upright lines side by side, empty about NaN.

        ``at_s`` is as for :meth:`curves`.
        """
        places, share = np.linspace(0.0, 1.0, BAND_COLUMNS), self.x.share(x)
        known = np.isfinite(share)
        if not known.any():
            return
        share = share[known]
        along = np.argsort(share, kind="stable")
        ends = [
            self.height
            * (1.0 - np.interp(places, share[along], self.y.share(self.y.within(edge[known][along])), np.nan, np.nan))
            for edge in (low, high)
        ]
        strips = np.stack([np.column_stack([WIDTH * places, end]) for end in ends], axis=1)
        filled = strips[np.isfinite(strips).all(axis=(1, 2))]
        radius = 0.75 * WIDTH / (BAND_COLUMNS - 1)  # more than half of the distance: no seams
        drawn = rr.LineStrips2D(
            filled.astype(np.float32), colors=[faint(colour)] * len(filled), radii=radius, draw_order=order
        )
        self._log(name, drawn, at_s)

    def boxes(
        self,
        name: str,
        across: tuple[FloatArray, FloatArray],
        up: tuple[FloatArray, FloatArray],
        shades: Sequence[Colour],
        order: float = FILLING,
    ) -> None:
        """Log filled boxes between ends across and up, shapes (n,).

        Each box is made of upright lines side by side. Ends of lines are round, so that one line as broad as its box
        would not look like one.
        """
        left, right = (WIDTH * self.x.share(self.x.within(ends)) for ends in across)
        low, high = (self.height * (1.0 - self.y.share(self.y.within(ends))) for ends in up)
        broad = np.abs(right - left)
        rows = np.flatnonzero(np.isfinite(broad + low + high) & (broad > 0.0) & (low != high))
        counts = np.ceil(broad[rows] / FINE).astype(np.int64)
        each, radii = np.repeat(rows, counts), np.repeat(0.5 * broad[rows] / counts, counts)
        place = np.arange(len(each)) - np.repeat(np.cumsum(counts) - counts, counts)
        middle = np.minimum(left, right)[each] + radii * (2.0 * place + 1.0)
        strips = np.stack([np.column_stack([middle, ends[each]]) for ends in (low, high)], axis=1)
        colours_of = [shades[row] for row in each.tolist()]
        drawn = rr.LineStrips2D(strips.astype(np.float32), colors=colours_of, radii=1.02 * radii, draw_order=order)
        self.recorder.static(f"{self.path}/{name}", drawn)

    def note(self, name: str, text: str, at_s: float | None = None) -> None:
        """Write a line of text at the top of the box."""
        place = [[0.5 * WIDTH, 4.0]]
        self._log(
            name, rr.Points2D(place, colors=[colours.LIGHT], labels=[text], radii=rr.Radius.ui_points(LABEL)), at_s
        )

    def texts(self, name: str, places: FloatArray, texts: Sequence[str], shades: Sequence[Colour]) -> None:
        """Write texts at places of the picture, shape (n, 2)."""
        points = rr.Points2D(
            places,
            labels=texts,
            colors=shades,
            radii=rr.Radius.ui_points(LABEL),
            show_labels=True,
            draw_order=MIDDLE,
        )
        self.recorder.static(f"{self.path}/{name}", points)

    def moving(self, name: str, time_s: FloatArray, x: FloatArray, y: FloatArray, line: Line) -> None:
        """Log a mark that is at a place from its flight time on.

        Rows without a place in the box are left out. Of very many places 600 are logged, evenly spread.
        """
        points = self.points(x, y)
        known = np.flatnonzero(np.isfinite(points).all(axis=1) & np.isfinite(time_s))
        rows = known[thin(len(known), MOST_PLACES)]
        style = rr.Points2D.from_fields(colors=[line.colour], radii=screen_radius(line.width), draw_order=NOW)
        self.recorder.static(f"{self.path}/{name}", style)
        indexes = self.recorder.indexes(self.recorder.time_ns(time_s[rows]))
        columns = rr.Points2D.columns(positions=points[rows].astype(np.float32))
        self.recorder.stream.send_columns(f"{self.path}/{name}", indexes, columns)

    def cursor(self) -> None:
        """Log an upright line on an axis of time, at the flight time of the playhead.

        It is gone outside the axis.
        """
        time_s = np.linspace(self.x.low, self.x.high, CURSOR_STEPS)
        x = np.linspace(0.0, WIDTH, CURSOR_STEPS)
        strips = np.zeros((CURSOR_STEPS, 2, 2))
        strips[:, :, 0], strips[:, 1, 1] = x[:, None], self.height
        style = rr.LineStrips2D.from_fields(colors=[colours.LIGHT], radii=screen_radius(CURSOR), draw_order=NOW)
        self.recorder.static(f"{self.path}/cursor", style)
        after = np.append(time_s, self.x.high + (time_s[1] - time_s[0]))
        columns = rr.LineStrips2D.columns(strips=strips).partition([*[1] * len(strips), 0])  # type: ignore[arg-type]
        indexes = self.recorder.indexes(self.recorder.time_ns(after))
        self.recorder.stream.send_columns(f"{self.path}/cursor", indexes, columns)

    def _log(self, name: str, archetype: rr.AsComponents, at_s: float | None) -> None:
        entity = f"{self.path}/{name}"
        if at_s is None:
            self.recorder.static(entity, archetype)
            return
        recorder, stream = self.recorder, self.recorder.stream
        time_ns = int(recorder.time_ns(at_s))
        stream.set_time(FLIGHT_TIME, duration=np.timedelta64(time_ns - recorder.start_ns, "ns"))
        if recorder.has_utc:
            stream.set_time(UTC, timestamp=np.datetime64(time_ns, "ns"))
        stream.log(entity, archetype)
        stream.reset_time()

    def _frame(self) -> None:
        x_ticks, y_ticks = self.x.ticks(), self.y.ticks()
        across = WIDTH * self.x.share(np.array([place for place, _ in x_ticks]))
        down = self.height * (1.0 - self.y.share(np.array([place for place, _ in y_ticks])))
        grid = [[[place, 0.0], [place, self.height]] for place in across.tolist()]
        grid += [[[0.0, place], [WIDTH, place]] for place in down.tolist()]
        box = [[0.0, 0.0], [0.0, self.height], [WIDTH, self.height]]
        drawn = rr.LineStrips2D(
            [*grid, box],
            colors=[*[colours.DIM] * len(grid), colours.LIGHT],
            radii=rr.Radius.ui_points(GRID),
            draw_order=BEHIND,
        )
        self.recorder.static(f"{self.path}/axes/grid", drawn)
        below = np.column_stack([across, np.full(len(across), self.height + 2.0)])
        beside = np.column_stack([np.full(len(down), -12.0), down - 5.0])
        places = np.concatenate([below, beside, [[0.5 * WIDTH, self.height + 10.0]]])
        texts = [*(text for _, text in (*x_ticks, *y_ticks)), self.x.title]
        self.texts("axes/labels", places, texts, [colours.LIGHT] * len(texts))


def unbroken(points: FloatArray) -> list[FloatArray]:
    """Return pieces of a line between its NaN, of two points or more.

    Examples
    --------
    >>> line = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, np.nan], [3.0, 3.0], [4.0, np.nan], [5.0, 5.0], [6.0, 6.0]])
    >>> [piece[:, 0].tolist() for piece in unbroken(line)]
    [[0.0, 1.0], [5.0, 6.0]]
    """
    known = np.asarray(np.isfinite(points).all(axis=1))
    cuts = np.flatnonzero(known[1:] != known[:-1]) + 1
    pieces = np.split(points, cuts)
    starts = [0, *cuts.tolist()]
    return [piece for piece, start in zip(pieces, starts, strict=True) if len(piece) > 1 and known[start]]
