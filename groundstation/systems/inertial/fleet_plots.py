"""Plots: skill of the forecast without GNSS over all flights."""

import numpy as np

from groundstation.chapters.plots.common import label, line_with_dots
from groundstation.chapters.plots.fleet.common import Places, date_axis, roles_of, seconds_of
from groundstation.plots.marks import AnyMark, Curve, Dots, Emphasis, Limit, Role, series
from groundstation.plots.plot import Axis, Panel, Plot, Row, one_panel
from groundstation.results.fleet import FleetResults
from groundstation.systems.inertial.fleet_chapter import HEADLINE_MIN, drawn, method_title, shipped_method
from groundstation.systems.inertial.forecast_plots import HORIZON, OTHERS

CONFIDENCE = 95.0


def growth(fleet: FleetResults) -> Plot:
    """Return the error of each method against the horizon."""
    rows, shipped = drawn(fleet), shipped_method(fleet)
    methods = list(dict.fromkeys(row.method for row in rows))
    others = (name for name in methods if name not in ("raw_ins", shipped))
    roles: dict[str, Role] = {"raw_ins": "ins", shipped: "answer", **dict(zip(others, OTHERS, strict=False))}
    table = fleet.skill_flights
    own = (table.method == shipped) & (table.rms_m > 0.0) & (table.horizon_min > 0.0)
    highest = {name: max(row.rms_m for row in rows if row.method == name) for name in methods}
    marks: list[AnyMark] = [Dots(x=table.horizon_min[own], y=table.rms_m[own], role="unused", name="flights (shipped)")]
    for name in sorted(methods, key=lambda name: -highest[name]):
        line = sorted((row.horizon_min, row.rms_m) for row in rows if row.method == name and row.horizon_min > 0.0)
        x, y = np.array(line, dtype=np.float64).reshape(-1, 2).T
        heavy: Emphasis = "bold" if name == shipped else "usual"
        text = label(f"{method_title(name)}{' (shipped)' if name == shipped else ''}")
        marks.append(Curve(x=x, y=y, role=roles.get(name, "faint"), name=text, emphasis=heavy))
    panel = Panel(marks, Axis(HORIZON, "log"), Axis("RMS radial error, m", "log"), legend="beside")
    return Plot(
        "fleet.growth",
        "How the error grows",
        "Root mean square over all starts of all flights, by method; grey: the shipped method on each flight.",
        "RMS forecast error against horizon for each method, with the single flights, logarithmic axes.",
        one_panel(panel, 70.0),
    )


def flights(fleet: FleetResults) -> Plot:
    """Return the shipped method on every flight, and how honest its band is."""
    horizons = np.unique(fleet.skill_flights.horizon_min)
    horizon = HEADLINE_MIN if HEADLINE_MIN in horizons else float(horizons[-1])
    return Plot(
        "fleet.skill",
        "Flights and coverage",
        f"Left: the shipped method on every flight after {horizon:g} min without GNSS. Right: share of the errors of "
        "all starts inside the band that the forecast claims; below the dashed line it is overconfident.",
        "Forecast error of every flight over time, and coverage of the forecast's band by horizon.",
        (Row((_flights(fleet, horizon), _coverage(fleet)), 42.0),),
    )


def by_horizon(fleet: FleetResults, x: Axis, places: Places) -> Panel | None:
    """Describe the shipped method on every flight, a series a horizon.

    None where there is no number.
    """
    table = fleet.skill_flights
    known, at = np.isfinite(table.rms_m), places(table.flight_id)
    marks = []
    for number, horizon in enumerate(np.unique(table.horizon_min[known]).tolist()):
        mine = np.flatnonzero(known & (table.horizon_min == horizon))
        mine = mine[np.argsort(at[mine], kind="stable")]
        name = f"after {horizon:g} min"
        marks.append(Dots(x=at[mine], y=table.rms_m[mine], role=series(number), name=name, emphasis="bold"))
    return Panel(marks, x, Axis("RMS of the shipped method by flight, m")) if marks else None


def _flights(fleet: FleetResults, horizon: float) -> Panel:
    table, roles = fleet.skill_flights, roles_of(fleet)
    title = f"RMS after {horizon:g} min, m"
    own = (table.horizon_min == horizon) & (table.rms_m > 0.0) & ~np.isnat(table.start_utc)
    if not own.any():
        return Panel((), Axis(), Axis(title), legend="", nothing="no flight with a time", share=2.3)
    time, rms, owner = seconds_of(table.start_utc[own]), table.rms_m[own], table.aircraft[own].tolist()
    marks = []
    for role in dict.fromkeys(roles[name] for name in owner):
        mine = np.array([roles[name] == role for name in owner])
        marks.append(Dots(x=time[mine], y=rms[mine], role=role, emphasis="bold"))
    low, high = float(rms.min()), float(rms.max())
    middle = np.sqrt(low * high)
    y = Axis(title, "log", float(min(low / 1.3, middle / 3.0)), float(max(high * 1.3, middle * 3.0)))
    return Panel(marks, date_axis(table.start_utc[own]), y, legend="", share=2.3)


def _coverage(fleet: FleetResults) -> Panel:
    shipped = shipped_method(fleet)
    covered = sorted(
        (row.horizon_min, 100.0 * row.coverage95)
        for row in fleet.skill
        if row.method == shipped and row.coverage95 is not None and np.isfinite(row.horizon_min)
    )
    marks: tuple[AnyMark, ...] = ()
    if covered:
        x, y = np.array(covered, dtype=np.float64).T
        marks = (Limit(value=CONFIDENCE, role="answer", name="wanted"), *line_with_dots(x, y, "answer"))
    upright = Axis("inside the 95 % band, %", low=0.0, high=105.0)
    nothing = "" if covered else "no band claimed"
    return Panel(marks, Axis("horizon, min"), upright, legend="", nothing=nothing)
