"""Charts of one number against another: Rerun plots against time alone, so lines, axes and ticks are drawn in 2D.

The picture is a box of fixed shape; values are scaled into it, and the ticks say what they are.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.viewer import colours
from groundstation.viewer.colours import Colour, faint
from groundstation.viewer.recorder import FLIGHT_TIME, UTC, Line, Recorder
from groundstation.viewer.series import FloatArray

WIDTH = 160.0  # of the box
LEFT, RIGHT, TOP, BOTTOM = 24.0, 6.0, 14.0, 20.0  # room for ticks, a title and the names of the lines
TICKS = 5  # about so many
GRID, LABEL = 0.4, 0.1  # widths and radii in points of the screen
KEY_ROOM = 56.0  # beside the box, for the names of many lines
BAND_COLUMNS = 320  # upright lines of a filled band across the whole box
FILLING, BEHIND, MIDDLE, FRONT = -1.0, 0.0, 1.0, 2.0


@dataclass(frozen=True)
class Axis:
    """An axis: title with unit, range, and whether it is logarithmic."""

    title: str
    low: float
    high: float
    is_log: bool = False

    def share(self, values: FloatArray) -> FloatArray:
        """Place of values along the axis, 0 to 1; NaN outside of it."""
        with np.errstate(divide="ignore", invalid="ignore"):
            scaled = (
                np.log(values / self.low) / np.log(self.high / self.low)
                if self.is_log
                else (values - self.low) / (self.high - self.low)
            )
            return np.where((scaled >= -1e-9) & (scaled <= 1.0 + 1e-9), scaled, np.nan)

    def ticks(self) -> FloatArray:
        """Round values inside the range.

        Examples
        --------
        >>> Axis("lead, min", 0.0, 120.0).ticks().tolist(), Axis("RMS, m", 5.0, 300.0, True).ticks().tolist()
        ([0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 120.0], [5.0, 10.0, 20.0, 50.0, 100.0, 200.0])
        """
        if self.is_log:
            decades = 10.0 ** np.arange(np.floor(np.log10(self.low)), np.ceil(np.log10(self.high)) + 1)
            marks = np.concatenate([decades * factor for factor in (1.0, 2.0, 5.0)])
            return np.sort(marks[(marks >= self.low * (1 - 1e-9)) & (marks <= self.high * (1 + 1e-9))])
        step = round_step((self.high - self.low) / TICKS)
        first, last = np.ceil(self.low / step - 1e-9), np.floor(self.high / step + 1e-9)
        return np.asarray(np.arange(first, last + 1) * step + 0.0)  # + 0.0: no minus zero


def screen_radius(points: float) -> float:
    """Radius in points of the screen: Rerun takes a negative one for that."""
    return -points


def round_step(step: float) -> float:
    """Nearest of 1, 2 and 5 times a power of ten.

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
    x, y : Axis
    height : float
        Of the box, which is 160 wide.
    """

    def __init__(self, recorder: Recorder, path: str, x: Axis, y: Axis, height: float = 100.0) -> None:
        self.recorder, self.path, self.x, self.y, self.height = recorder, path, x, y, height
        self.right = RIGHT
        self._frame()

    def view(self) -> rrb.Spatial2DView:
        """The view that shows the chart, named after its axes."""
        bounds = rrb.VisualBounds2D(x_range=[-LEFT, WIDTH + self.right], y_range=[-TOP, self.height + BOTTOM])
        name = f"{self.y.title} by {self.x.title}"
        return rrb.Spatial2DView(name=name, origin=f"/{self.path}", visual_bounds=bounds)

    def points(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Places in the picture, shape (n, 2); its axes run right and down."""
        return np.column_stack([WIDTH * self.x.share(x), self.height * (1.0 - self.y.share(y))])

    def legend(self, lines: Sequence[Line]) -> None:
        """Write the names of a few lines above the box, each in its colour."""
        step = WIDTH / max(len(lines), 1)
        places = np.array([[step * (place + 0.5), -11.0] for place in range(len(lines))])
        self._texts("legend", places, [line.name for line in lines], [line.colour for line in lines])

    def curves(
        self, name: str, curves: Sequence[tuple[FloatArray, FloatArray, Line]], at_s: float | None = None
    ) -> None:
        """Log lines; with ``at_s`` they stand from that flight time on, until others take their place."""
        strips: list[FloatArray] = []
        shades: list[Colour] = []
        radii: list[float] = []
        for x, y, line in curves:
            pieces = unbroken(self.points(x, y))
            strips += pieces
            shades += [line.colour] * len(pieces)
            radii += [screen_radius(line.width)] * len(pieces)
        drawn = rr.LineStrips2D(strips, colors=shades, radii=radii, draw_order=FRONT)
        self._log(name, drawn, at_s)

    def band(
        self, name: str, x: FloatArray, low: FloatArray, high: FloatArray, colour: Colour, at_s: float | None = None
    ) -> None:
        """Log a filled band between two curves, of upright lines side by side, empty about NaN.

        ``at_s`` is as for :meth:`curves`.
        """
        places, share = np.linspace(0.0, 1.0, BAND_COLUMNS), self.x.share(x)
        known = np.isfinite(share)
        if not known.any():
            return
        share = share[known]
        order = np.argsort(share, kind="stable")
        clipped = (np.clip(edge[known][order], self.y.low, self.y.high) for edge in (low, high))
        ends = [
            self.height * (1.0 - np.interp(places, share[order], self.y.share(edge), left=np.nan, right=np.nan))
            for edge in clipped
        ]
        strips = np.stack([np.column_stack([WIDTH * places, end]) for end in ends], axis=1)
        filled = strips[np.isfinite(strips).all(axis=(1, 2))]
        radius = 0.75 * WIDTH / (BAND_COLUMNS - 1)  # more than half of the distance: no seams
        drawn = rr.LineStrips2D(list(filled), colors=[faint(colour)] * len(filled), radii=radius, draw_order=FILLING)
        self._log(name, drawn, at_s)

    def note(self, name: str, text: str, at_s: float | None = None) -> None:
        """Write a line of text at the top of the box."""
        place = [[0.5 * WIDTH, 4.0]]
        self._log(
            name, rr.Points2D(place, colors=[colours.LIGHT], labels=[text], radii=rr.Radius.ui_points(LABEL)), at_s
        )

    def key(self, lines: Sequence[Line]) -> None:
        """Write the names of many lines beside the box, one below the other, each in its colour."""
        self.right = KEY_ROOM
        step = self.height / max(len(lines), 1)
        places = np.array([[WIDTH + 0.5 * KEY_ROOM, step * (place + 0.1)] for place in range(len(lines))])
        self._texts("legend", places, [line.name for line in lines], [line.colour for line in lines])

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
        grid = []
        for place in (WIDTH * self.x.share(self.x.ticks())).tolist():
            grid.append([[place, 0.0], [place, self.height]])
        for place in (self.height * (1.0 - self.y.share(self.y.ticks()))).tolist():
            grid.append([[0.0, place], [WIDTH, place]])
        box = [[0.0, 0.0], [0.0, self.height], [WIDTH, self.height]]
        drawn = rr.LineStrips2D(
            [*grid, box],
            colors=[*[colours.DIM] * len(grid), colours.LIGHT],
            radii=rr.Radius.ui_points(GRID),
            draw_order=BEHIND,
        )
        self.recorder.static(f"{self.path}/axes/grid", drawn)
        x, y = self.x.ticks(), self.y.ticks()
        below = np.column_stack([WIDTH * self.x.share(x), np.full(len(x), self.height + 2.0)])
        beside = np.column_stack([np.full(len(y), -12.0), self.height * (1.0 - self.y.share(y)) - 5.0])
        places = np.concatenate([below, beside, [[0.5 * WIDTH, self.height + 10.0]]])
        texts = [*(f"{value:g}" for value in [*x.tolist(), *y.tolist()]), self.x.title]
        self._texts("axes/labels", places, texts, [colours.LIGHT] * len(texts))

    def _texts(self, name: str, places: FloatArray, texts: Sequence[str], shades: Sequence[Colour]) -> None:
        points = rr.Points2D(
            places,
            labels=texts,
            colors=shades,
            radii=rr.Radius.ui_points(LABEL),
            show_labels=True,
            draw_order=MIDDLE,
        )
        self.recorder.static(f"{self.path}/{name}", points)


def unbroken(points: FloatArray) -> list[FloatArray]:
    """Pieces of a line between its NaN, of two points or more.

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
