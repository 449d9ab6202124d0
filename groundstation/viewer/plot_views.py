"""Plots in a recording: a panel over flight time is a time view, any other one a chart.

Rerun's time views have linear vertical axes, without titles and without shaded ground: a panel with a logarithmic
axis is a chart with a cursor, a view is named after its axis and says the colours of a few lines, and a phase or an
outage is a lane of its own.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.dataclasses import dataclass
from groundstation.base.words import capitalised
from groundstation.plots import extents
from groundstation.plots.marks import Band, Curve, Dots, Lanes, Limit, Mark, Points, Spans
from groundstation.plots.plot import Panel, Plot
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.names import clean_text, markdown_text, path_parts
from groundstation.viewer.plot_chart import HEIGHT, chart_view
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.views import document, lanes, plot

MOST_TOLD = 90  # characters of a title that says colours; a longer one would be cut
ONE_DOT = colours.DOT["bold"]
SAME = 1e-9  # of a half width: the middle of a band is the line that it is about


def panels_of(
    recorder: Recorder, told: Plot | None, *, of: str = "", height: float = HEIGHT, apart: bool = False
) -> list[rrb.View]:
    """Log the panels of a plot under its name, and return a view each; none of no plot.

    Parameters
    ----------
    recorder : Recorder
    told : Plot, optional
    of : str
        What stands before the titles of the axes.
    height : float
        Of the boxes of charts, which are 160 wide.
    apart : bool
        Whether each curve of a logarithmic axis over time has a time view of its own, on a linear axis; else the panel
        is a chart.
    """
    views: list[rrb.View] = []
    for has_lanes, group in groupby(_named(told, of), key=lambda one: _has_lanes(one[2])):
        panels = list(group)
        if has_lanes:
            views.append(_lanes(recorder, panels))
        else:
            views += (view for one in panels for view in _views(recorder, *one, height, apart=apart))
    return views


def _has_lanes(panel: Panel) -> bool:
    return panel.x.scale == "time" and any(isinstance(mark, Lanes) for mark in panel.marks)


def _views(
    recorder: Recorder, path: str, title: str, panel: Panel, height: float, *, apart: bool
) -> Iterator[rrb.View]:
    """Log a panel without lanes: the one view of it, or one of each curve."""
    if panel.nothing:
        recorder.document(path, markdown_text(panel.nothing))
        yield document(title, path)
    elif panel.x.scale != "time" or (panel.y.scale == "log" and not apart):
        yield chart_view(recorder, path, panel, title, height)
    elif panel.y.scale == "log":
        curves = [mark for mark in panel.marks if isinstance(mark, Curve)]
        parts = path_parts(mark.name for mark in curves)
        for mark, part in zip(curves, parts, strict=True):
            alone = Panel([mark], panel.x, legend="")
            yield over_time(recorder, f"{path}/{part}", alone, f"{title}: {clean_text(mark.name)}")
    else:
        yield over_time(recorder, path, panel, title)


def runs_of(recorder: Recorder, told: Plot | None, path: str, *, height: float = 70.0) -> list[list[rrb.View]]:
    """Log the windows of a plot's time axis as charts, and return the views of each.

    Their paths are under ``path``, by the number of the window. A time view shows the whole flight or a stretch about
    the cursor; a run of two minutes in a flight of an hour is a sliver in it. Here it has an axis of its own, with the
    cursor on it while it lasts.
    """
    drawn = [one for one in _named(told, "") if not any(isinstance(mark, Lanes) for mark in one[2].marks)]
    count = max((len(panel.x.windows) for _, _, panel in drawn), default=0)
    return [
        [
            chart_view(recorder, f"{path}/{window + 1}/{part.rpartition('/')[2]}", panel, title, height, window)
            for part, title, panel in drawn
        ]
        for window in range(count)
    ]


def plot_of(recorder: Recorder, name: str, results: FlightResults, *of: str) -> Plot | None:
    """The description of a figure of a chapter; ``of`` says which of several alike."""
    return recorder.systems.plots[name](results, *of)


def _named(told: Plot | None, of: str) -> Iterator[tuple[str, str, Panel]]:
    """Yield panels with entity path and title.

    A panel without a title beside one that has it is named after that.
    """
    if told is None:
        return
    base = "/".join(path_parts([part])[0] for part in told.name.split("."))
    found = []
    for row in told.rows:
        first = row.panels[0].y.title
        for panel in row.panels:
            axis = panel.y.title or (first if panel.marks else "")
            own = "" if _has_lanes(panel) else panel.title
            found.append((panel, ": ".join(filter(None, (of, own, axis))) or told.title))
    parts = path_parts(_part(panel, title) for panel, title in found)
    for (panel, title), part in zip(found, parts, strict=True):
        yield f"{base}/{part}", clean_text(capitalised(title)), panel


def _part(panel: Panel, title: str) -> str:
    """Return the name of a panel in its entity path.

    "lanes" for lanes, the axis or the title for all others.
    """
    if any(isinstance(mark, Lanes) for mark in panel.marks):
        return panel.title or "lanes"
    axis = panel.y.title or title
    return axis.rpartition(", ")[0] or axis


# ---------------------------------------------------------------------------------------------- over flight time


@dataclass
class _Joined:
    """Lines that share their rows."""

    time_s: FloatArray
    values: list[FloatArray]
    lines: list[Line]


def over_time(recorder: Recorder, path: str, panel: Panel, title: str) -> rrb.View:
    """Log a panel over flight time under ``path``, and return its view.

    Lines are logged with all their rows and break where time leaps. Measurements that share the rows of a line are a
    line, too: Rerun would draw dots over everything else. A band about a line is logged with it.
    """
    unit = title.rpartition(", ")[2] if ", " in title else ""
    curves = [mark for mark in panel.marks if isinstance(mark, Curve)]
    of_band: dict[int, Curve] = {}
    for mark in panel.marks:
        if isinstance(mark, Band):
            about = [one for one in curves if _is_middle(one, mark) and id(one) not in map(id, of_band.values())]
            of_band |= {id(mark): about[0]} if about else {}
    banded = {id(one) for one in of_band.values()}
    groups: list[_Joined] = []
    limits: list[Limit] = []
    named: list[Line] = []
    for place, mark in enumerate(panel.marks):
        line = _line(replace(mark, name=mark.name or _name_of_alike(panel, mark)), unit, title)
        if isinstance(mark, Band):
            _band(recorder, f"{path}/c{place:02d}_band", mark, of_band.get(id(mark)), line, unit, title)
        elif isinstance(mark, Dots) and not _is_joined(mark, curves):
            rows = np.flatnonzero(np.isfinite(mark.x) & np.isfinite(mark.y))
            recorder.dots(f"{path}/d{place:02d}_dots", recorder.time_ns(mark.x[rows]), mark.y[rows], line)
        elif isinstance(mark, Points) and mark.is_hollow:
            rows = np.flatnonzero(np.isfinite(mark.x) & np.isfinite(mark.y))
            time_ns = recorder.time_ns(mark.x[rows])
            recorder.dots(f"{path}/e{place:02d}_hollow", time_ns, mark.y[rows], line, is_hollow=True)
        elif isinstance(mark, Curve | Dots):
            if id(mark) not in banded:
                _join(groups, mark, line)
        elif isinstance(mark, Limit):
            if not mark.is_upright and (mark.name or mark.label or mark.emphasis != "faint"):
                limits.append(mark)
            continue
        elif isinstance(mark, Spans):
            continue
        if mark.name and id(mark) not in of_band:
            named.append(Line(clean_text(mark.name), line.colour))
    for number, group in enumerate(groups):
        time_ns = recorder.time_ns(group.time_s)
        if len(time_ns) == 1:  # a line of one moment would not be seen
            for place, (values, line) in enumerate(zip(group.values, group.lines, strict=True)):
                recorder.dots(f"{path}/f{number:02d}_dots/{place}", time_ns, values, replace(line, width=ONE_DOT))
            continue
        values = np.column_stack(group.values)
        recorder.lines(f"{path}/b{number:02d}_lines", time_ns, values, group.lines, gap_after(time_ns))
    _limits(recorder, f"{path}/a_limits", panel, limits, unit, title)
    named += [Line(clean_text(mark.name), colours.ROLES[mark.role]) for mark in limits if mark.name]
    told = _title(title, named) if panel.legend else _title_beside(title, named)
    return plot(told or title, path, axis_range=_range(panel), legend=not told)


def _line(mark: Mark, unit: str, title: str) -> Line:
    width = (colours.DOT if isinstance(mark, Dots) else colours.LINE)[mark.emphasis]
    name = ", ".join(filter(None, (mark.name, unit))) if mark.name else title
    return Line(clean_text(name), colours.ROLES[mark.role], width)


def _name_of_alike(panel: Panel, mark: Mark) -> str:
    """Return the name of a mark of the same kind and role.

    Both edges of an interval have one name.
    """
    alike = (one for one in panel.marks if type(one) is type(mark) and one.role == mark.role and one.name)
    return next((one.name for one in alike), "")


def _is_joined(dots: Dots, curves: Sequence[Curve]) -> bool:
    """Tell whether dots are a line in a recording: the measurements behind a line."""
    return dots.role == "unused" and any(_same(dots.x, one.x) for one in curves)


def _same(one: FloatArray, other: FloatArray) -> bool:
    return one is other or np.array_equal(one, other, equal_nan=True)


def _is_middle(curve: Curve, band: Band) -> bool:
    """Tell whether a curve runs in the middle of a band."""
    if not _same(curve.x, band.x):
        return False
    with np.errstate(invalid="ignore", over="ignore"):
        off, half = np.abs(0.5 * (band.low + band.high) - curve.y), 0.5 * np.abs(band.high - band.low)
        size = np.maximum(half, np.abs(curve.y))
        return bool(np.isfinite(off).any() and not (off > SAME * size).any())


def _band(recorder: Recorder, path: str, band: Band, about: Curve | None, line: Line, unit: str, title: str) -> None:
    rows = np.flatnonzero(np.isfinite(band.x))
    time_ns = recorder.time_ns(band.x[rows])
    if len(rows) == 1:  # of one moment nothing would be seen but its ends
        for end, values in (("low", band.low), ("high", band.high)):
            recorder.dots(f"{path}/{end}", time_ns, values[rows], replace(line, width=colours.DOT["bold"]))
        return
    with np.errstate(over="ignore", invalid="ignore"):
        middle = _middle(band)[rows] if about is None else about.y[rows]
        half = band.high[rows] - middle
    if about is not None:
        own = _line(about, "", title)
        name = ", ".join(filter(None, (f"{own.name} ± {band.name}" if band.name else own.name, unit)))
        line = Line(clean_text(name), own.colour, own.width)
    else:
        line = Line(line.name, line.colour, colours.LINE["thin"])
    recorder.band(path, time_ns, middle, half, line, gap_after(time_ns))


def _middle(band: Band) -> FloatArray:
    """Return the line about which a band is drawn: zero for a band that stands on zero.

    Its axis begins there.
    """
    return np.where(np.isfinite(band.high), 0.0, np.nan) if not band.low.any() else 0.5 * (band.low + band.high)


def _join(groups: list[_Joined], mark: Curve | Dots, line: Line) -> None:
    """Put a line into the group that shares its rows."""
    known = np.isfinite(mark.x)
    time_s, values = mark.x[known], mark.y[known]
    for group in groups:
        if _same(group.time_s, time_s):
            group.values.append(values)
            group.lines.append(line)
            return
    groups.append(_Joined(time_s, [values], [line]))


def _limits(recorder: Recorder, path: str, panel: Panel, limits: Sequence[Limit], unit: str, title: str) -> None:
    """Log lines across a panel from its first to its last moment."""
    ends = extents.x_extent(panel.marks)
    if not limits or not len(ends):
        return
    lines = []
    for mark in limits:
        line = _line(mark, unit, title)
        name = ", ".join(filter(None, (mark.name or mark.label or f"{mark.value:g}", unit)))
        lines.append(Line(clean_text(name), line.colour, colours.LINE["thin"]))
    values = np.tile([mark.value for mark in limits], (2, 1))
    recorder.lines(path, recorder.time_ns(ends), values, lines)


def _range(panel: Panel) -> tuple[float, float] | None:
    """Return the ends of the vertical axis where a panel states them or has bands.

    Else None: Rerun fits the axis to lines alone.
    """
    has_band = any(isinstance(mark, Band) for mark in panel.marks)
    if panel.y.low is None and panel.y.high is None and not has_band:
        return None
    span = extents.y_span(panel)
    return min(span.low, span.high), max(span.low, span.high)


def _title(title: str, named: Sequence[Line]) -> str:
    """Return the title with the colours of its lines; empty where only a legend can name them."""
    if len({(line.name, line.colour) for line in named}) < 2:
        return title
    names = {line.colour: list(dict.fromkeys(one.name for one in named if one.colour == line.colour)) for line in named}
    told = f"{title}: " + "; ".join(f"{', '.join(of)} {colours.WORDS[shade]}" for shade, of in names.items())
    return told if len(told) <= MOST_TOLD else ""


def _title_beside(title: str, named: Sequence[Line]) -> str:
    """Return the title of a panel that leaves its legend to one beside it.

    It says the colours if there are several.
    """
    is_one = len({line.colour for line in named}) < 2
    return title if is_one else _title(title, named) or title


def _lanes(recorder: Recorder, panels: Sequence[tuple[str, str, Panel]]) -> rrb.View:
    """Log states over time in one view of panels that follow each other.

    It has the title of the first.

    Each mark is a lane that says every state, those that the page leaves out too.
    """
    paths = []
    for path, _, panel in panels:
        several = [mark for mark in panel.marks if isinstance(mark, Lanes)]
        for place, mark in enumerate(several):
            if len(mark.start):
                order = np.argsort(mark.start, kind="stable")
                own = {state: colours.ROLES[role] for state, role in mark.roles.items()}
                palette = {**own, **colours.STATES_OF_LANES}
                paths.append(f"{path}/{place:02d}" if len(several) > 1 else path)
                recorder.spans(paths[-1], mark.start[order], mark.end[order], mark.state[order], palette)
    return lanes(panels[0][1], paths)
