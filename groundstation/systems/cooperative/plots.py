"""Plots of navigation between aircraft: map, errors against sigma, geometry, residuals."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.ellipse import fits, magnified, outlines, told_ellipses
from groundstation.base.local_frame import plane_through
from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.plots.common import M_PER_KM, label
from groundstation.plots.axes import time_axis
from groundstation.plots.marks import (
    SERIES,
    AnyMark,
    Band,
    Curve,
    Dots,
    Floats,
    Limit,
    Outlines,
    Points,
    Role,
    Told,
    series,
)
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, Scale, one_panel
from groundstation.plots.ranges import broken_at_gaps, finite, thin
from groundstation.results.arrays.session import SessionPoints
from groundstation.results.arrays.typed import Flags
from groundstation.results.flight import FlightResults
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.arrays import CooperativeGeometry, CooperativeLinks, CooperativeTracks
from groundstation.systems.cooperative.chapter import REFERENCE, in_text, title_of, trusted

ELLIPSES = 8  # of each track
MOST_PANELS = 8
DECADES, FLAT, DIP_SHARE, MARGIN = 100.0, 5.0, 0.02, 1.15
Rows = NDArray[np.int64]
Ends = tuple[float, float]
STEEP = 20.0  # a dilution so many times its median is drawn on a logarithmic axis


def _tracks(results: FlightResults) -> tuple[CooperativeResult, CooperativeTracks, str] | None:
    """Return the answer, its tracks and the algorithm that is drawn."""
    answer, data = results.answer(CooperativeResult), results.rows_of(CooperativeTracks)
    return None if answer is None or data is None else (answer, data, trusted(answer).algorithm)


def _places(data: CooperativeTracks | SessionPoints) -> Floats:
    return np.column_stack([data.x_m, data.y_m, data.z_m])


def session_map(results: FlightResults) -> Plot | None:
    """Return tracks from above with their 2 sigma ellipses, and the ground points."""
    found = _tracks(results)
    if found is None:
        return None
    answer, data, algorithm = found
    rows = data.algorithm == algorithm
    place, vehicle = _places(data)[rows], data.vehicle[rows]
    ellipses = _ellipses(data, rows)
    origin = plane_through(place) if answer.frame == "ecef" else None
    plane = place if origin is None else origin.from_ecef_m(place)
    is_crowd = _is_crowd(answer)
    of_each = {name: np.flatnonzero(vehicle == name) for name in answer.vehicle_names}
    with_ellipse: Mapping[str, Rows] = {
        name: mine[-1:] if is_crowd else mine[thin(len(mine), ELLIPSES)] for name, mine in of_each.items()
    }
    with_ellipse, larger, wider = _drawn(plane, ellipses, with_ellipse)
    x, y = plane[:, 1] / M_PER_KM, plane[:, 0] / M_PER_KM
    marks: list[AnyMark] = []
    for number, name in enumerate(answer.vehicle_names):
        mine = of_each[name]
        if not len(mine):
            continue
        role, first, title = series(number), mine[:1], label(name, 12)
        drawn = [(plane[row, :2] + larger * ellipses[row])[:, ::-1] / M_PER_KM for row in with_ellipse[name]]
        marks.append(Outlines(rings=tuple(drawn), magnified=larger, role=role, emphasis="faint", makes_room=False))
        marks.append(Curve(x=x[mine], y=y[mine], role=role, name=title))
        marks.append(Points(x=x[first], y=y[first], labels=(title,) if is_crowd else (), role=role))
    stations = results.rows_of(SessionPoints)
    if stations is not None:
        points = _places(stations) if origin is None else origin.from_ecef_m(_places(stations))
        names = tuple(label(str(name), 16) for name in stations.label)
        east, north = points[:, 1] / M_PER_KM, points[:, 0] / M_PER_KM
        marks.append(Points(x=east, y=north, symbol="triangle", labels=names, role="ink"))
    marks.append(Told(x=x, y=y, value=data.time_s[rows], title="flight time", is_time=True))
    when = "at the end" if is_crowd else f"at {ELLIPSES} times"
    told = told_ellipses(f"2σ ellipses {when} of each track", larger, wider)
    return Plot(
        "cooperative.map",
        "Map",
        f"Tracks from above: {in_text(algorithm)}; the dot is where each begins. {told}"
        + (" Triangles: ground stations." if stations is not None else ""),
        "Tracks of the aircraft.",
        one_panel(
            Panel(marks, Axis("east, km"), Axis("north, km"), legend="" if is_crowd else "above", is_map=True), 92.0
        ),
        _numbers(results),
    )


def _ellipses(data: CooperativeTracks, rows: Flags) -> Floats:
    """Return 2 sigma ellipses about the origin, north and east, shape (n, 49, 2).

    Their axes are north and east where no correlation is saved.
    """
    north, east = data.sigma_north_m[rows], data.sigma_east_m[rows]
    return outlines(north, east, np.nan_to_num(data.correlation_north_east[rows]), 2.0)


def _drawn(plane: Floats, ellipses: Floats, rows: Mapping[str, Rows]) -> tuple[Mapping[str, Rows], int, int]:
    """Return rows whose ellipses have room on the map, their enlargement, how many have none."""
    side = float(np.nanmax(np.nanmax(plane[:, :2], axis=0) - np.nanmin(plane[:, :2], axis=0)))
    half = np.hypot(*np.moveaxis(ellipses, 2, 0)).max(axis=1)
    kept = {name: mine[fits(side, half[mine])] for name, mine in rows.items()}
    wider = sum(len(mine) for mine in rows.values()) - sum(len(mine) for mine in kept.values())
    return kept, magnified(side, half[np.concatenate([*kept.values()])]), wider


def _numbers(results: FlightResults) -> tuple[str, ...]:
    found = results.rows_of(CooperativeTracks), results.rows_of(SessionPoints)
    return tuple(one.name for one in found if one is not None)


def _is_crowd(answer: CooperativeResult) -> bool:
    """Tell whether there are more aircraft than roles of a series.

    Their lines then share roles.
    """
    return len(answer.vehicle_names) > len(SERIES)


def errors(results: FlightResults) -> Plot | None:
    """Return the horizontal error of each aircraft against its computed 2 sigma_r.

    That of dead reckoning is drawn too.
    """
    return _errors(results, is_linear=False)


def errors_over_time(results: FlightResults) -> Plot | None:
    """Return the same on linear axes, for a recording: dead reckoning where it fits in."""
    return _errors(results, is_linear=True)


def _errors(results: FlightResults, *, is_linear: bool) -> Plot | None:
    found = _tracks(results)
    if found is None:
        return None
    answer, data, algorithm = found
    shown = _largest(answer, algorithm)
    scale, ends = _error_axis(data, shown, algorithm)
    if is_linear:
        tops = {name: _error_values(data, name, algorithm).max(initial=0.0) or 1.0 for name in shown}
        scale, ends = "linear", {name: (0.0, MARGIN * float(top)) for name, top in tops.items()}
    panels = [_error(data, name, algorithm, scale, ends[name], legend=name == shown[0]) for name in shown]
    rows = []
    for first in range(0, len(panels), 2):
        rows.append(Row(tuple(panels[first : first + 2]), 28.0, shares_x=first + 4 <= len(panels), columns=2))
    more = len(answer.vehicle_names) - len(shown)
    return Plot(
        "cooperative.errors",
        "Error against 2σ_r",
        f"{title_of(algorithm)}: horizontal error against the truth, where a log holds one, and the computed 2σ_r "
        "(shaded). Grey: 2σ_r of dead reckoning alone."
        + (f" The {len(shown)} with the largest 2σ_r at the end; {more} more in the table." if more else ""),
        "Horizontal error and 2 sigma of each aircraft with time.",
        tuple(rows),
        _numbers(results),
    )


def _error_axis(data: CooperativeTracks, shown: Sequence[str], algorithm: str) -> tuple[Scale, Mapping[str, Ends]]:
    """Return the scale that all panels of errors have, and the ends of each.

    It is logarithmic where the values of an aircraft span more than two decades (a short dip towards zero is no span),
    or where a linear axis that holds dead reckoning would flatten all else.
    """
    ends, is_log = {}, False
    for name in shown:
        own, reckoned = _error_values(data, name, algorithm), _error_values(data, name, REFERENCE)
        known = finite(own, reckoned)
        low, high = (float(np.quantile(known, DIP_SHARE)), float(known.max())) if known.size else (1.0, 1.0)
        is_log |= high > DECADES * low or (own.size > 0 and high > FLAT * float(own.max()))
        ends[name] = low, high
    if not is_log:
        return "linear", {name: (0.0, MARGIN * high) for name, (_, high) in ends.items()}
    return "log", {name: (low / MARGIN, MARGIN * high) for name, (low, high) in ends.items()}


def _error_values(data: CooperativeTracks, name: str, algorithm: str) -> Floats:
    """Return the positive values that a panel of errors shows of an algorithm."""
    mine = (data.vehicle == name) & (data.algorithm == algorithm)
    known = finite(data.two_sigma_r_m[mine], *(() if algorithm == REFERENCE else (data.error_m[mine],)))
    return known[known > 0.0]


def _error(data: CooperativeTracks, name: str, algorithm: str, scale: Scale, ends: Ends, *, legend: bool) -> Panel:
    time, error, bound = data.time_s, data.error_m, data.two_sigma_r_m
    mine, reckoned = ((data.vehicle == name) & (data.algorithm == which) for which in (algorithm, REFERENCE))
    marks: list[AnyMark] = [
        Band(x=time[mine], low=np.full(int(mine.sum()), ends[0]), high=bound[mine], role="answer", name="2σ_r"),
        Curve(x=time[reckoned], y=bound[reckoned], role="faint", name="2σ_r without ranges", emphasis="thin"),
    ]
    if np.isfinite(error[mine]).any():
        marks.append(Curve(x=time[mine], y=error[mine], role="ins", name="error"))
    y = Axis(f"{label(name, 12)}, m", scale, *ends)
    return Panel(marks, time_axis(float(time.min()), float(time.max())), y, legend="above" if legend else "")


def _largest(answer: CooperativeResult, algorithm: str) -> list[str]:
    """Return the aircraft that have a panel, in their order.

    Very many are cut to those with the largest 2 sigma_r at the end.
    """
    rows = [row for row in answer.vehicles if row.algorithm == algorithm]
    kept = {row.vehicle for row in sorted(rows, key=lambda row: -row.two_sigma_r_m)[:MOST_PANELS]}
    return [name for name in answer.vehicle_names if name in kept]


def _styles(answer: CooperativeResult) -> dict[str, tuple[Role, str]]:
    """Return role and label of the line of each aircraft.

    In a crowd, only the aircraft with the poorest geometry stands out; it is drawn last.
    """
    names = answer.vehicle_names
    if not _is_crowd(answer) or not answer.geometry:
        return {name: (series(number), label(name, 12)) for number, name in enumerate(names)}
    worst = min(answer.geometry, key=lambda row: row.determinant_median).vehicle
    others: dict[str, tuple[Role, str]] = {name: ("faint", "") for name in names if name != worst}
    return {**others, worst: ("limit", f"{label(worst, 12)}, least median det(H'H)")}


def geometry(results: FlightResults) -> Plot | None:
    """Return HDOP, determinant and smallest eigenvalue of every aircraft with time."""
    answer, data = results.answer(CooperativeResult), results.rows_of(CooperativeGeometry)
    if answer is None or data is None:
        return None
    measures = ((data.hdop, "HDOP"), (data.determinant, "det(H'H)"), (data.eigenvalue, "least eigenvalue"))
    columns = [one for one in measures if np.isfinite(one[0]).any()]
    time = time_axis(float(data.time_s.min()), float(data.time_s.max()))
    rows: list[Row] = []
    for values, title in columns:
        marks = []
        for name, (role, told) in _styles(answer).items():
            mine = data.vehicle == name
            x, y = broken_at_gaps(data.time_s[mine], values[mine])
            marks.append(Curve(x=x, y=y, role=role, name=told, emphasis="usual" if told else "faint"))
        known = finite(values)
        is_steep = title == "HDOP" and known.size and known.max() > STEEP * np.median(known)
        panel = Panel(marks, time, Axis(title, "log" if is_steep else "linear"), legend="" if rows else "above")
        rows.append(Row((panel,), 34.0, shares_x=title != columns[-1][1]))
    return Plot(
        "cooperative.geometry",
        "Geometry",
        "Geometry of the sources that each aircraft hears in a frame: dilution, and determinant and least eigenvalue "
        "of H'H, horizontal directions only; a line ends where an aircraft hears none."
        + (" Grey: the other aircraft, numbers in the table." if _is_crowd(answer) else ""),
        "Geometry measures with time.",
        tuple(rows),
        ("cooperative_geometry",),
    )


def links(results: FlightResults) -> Plot | None:
    """Return residuals of every range over their own sigma; gated ones stand out."""
    answer, data = results.answer(CooperativeResult), results.rows_of(CooperativeLinks)
    if answer is None or data is None:
        return None
    time, is_used, is_crowd = data.time_s, data.mark > 0, _is_crowd(answer)
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = data.innovation / data.sigma
    far = finite(np.abs(normal))
    ceiling = float(np.clip(1.1 * far.max(initial=3.0), 4.0, 12.0))
    shown = np.clip(normal, -ceiling, ceiling)
    marks: list[AnyMark] = []
    if is_crowd:
        marks.append(Dots(x=time[is_used], y=shown[is_used], role="ins", name="used"))
    for number, name in enumerate(() if is_crowd else answer.vehicle_names):
        mine = (data.receiver == name) & is_used
        marks.append(Dots(x=time[mine], y=shown[mine], role=series(number), name=label(name, 12)))
    if not is_used.all():
        marks.append(Dots(x=time[~is_used], y=shown[~is_used], role="limit", name="gated", emphasis="bold"))
    marks += [Limit(value=NORMAL_95, name="95 %"), Limit(value=-NORMAL_95)]
    y = Axis("residual over its sigma", low=-1.05 * ceiling, high=1.05 * ceiling)
    return Plot(
        "cooperative.links",
        "Residuals of the links",
        "Residuals of the ranges over their computed sigma, "
        f"{in_text(answer.links_algorithm)}{'' if is_crowd else ', by receiver'}; values beyond "
        f"{ceiling:.0f} are drawn at the edge.",
        "Residuals of the ranges with time.",
        one_panel(Panel(marks, time_axis(float(time.min()), float(time.max())), y), 44.0),
        ("cooperative_links",),
    )


PLOTS: Mapping[str, Describe] = {
    "cooperative.map": session_map,
    "cooperative.errors": errors,
    "cooperative.geometry": geometry,
    "cooperative.links": links,
}
