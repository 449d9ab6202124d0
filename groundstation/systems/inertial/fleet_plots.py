"""Plots: skill of the forecast without GNSS over all flights."""

import numpy as np

from groundstation.chapters.fleet.common import aircraft_name
from groundstation.chapters.plots.common import label, line_with_dots
from groundstation.chapters.plots.fleet.common import Places, date_axis, left_out, roles_of, rows_shown, seconds_of
from groundstation.plots.marks import SERIES, AnyMark, Curve, Dots, Emphasis, Limit, Role, series
from groundstation.plots.plot import Axis, Panel, Plot, Row, one_panel
from groundstation.results.fleet import WHOLE_FLEET, FleetResults
from groundstation.systems.inertial.fleet_chapter import HEADLINE_MIN, drawn, method_title, parted, shipped_method
from groundstation.systems.inertial.forecast_plots import HORIZON, OTHERS

CONFIDENCE = 95.0


def growth(fleet: FleetResults) -> Plot:
    """Return the error against the horizon: of each method, or of each aircraft.

    Several aircraft have a line each, of the shipped method.
    """
    if parted(fleet):
        return _growth_by_aircraft(fleet)
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
    return Plot(
        "fleet.growth",
        "How the error grows",
        "Root mean square over all starts of all flights, by method; grey: the shipped method on each flight.",
        "RMS forecast error against horizon for each method, with the single flights, logarithmic axes.",
        _growing(marks),
    )


def _growth_by_aircraft(fleet: FleetResults) -> Plot:
    """Return the error of the shipped method against the horizon, a line for each aircraft."""
    rows, table, roles = drawn(fleet), fleet.skill_flights, roles_of(fleet)
    owner = {str(name): str(one) for name, one in zip(table.flight_id, table.aircraft, strict=True)}
    shown = rows_shown({name: list(owner.values()).count(name) for name in parted(fleet)}, len(SERIES))
    own_roles = roles if len(set(roles.values())) > 2 else {name: series(at) for at, name in enumerate(shown)}
    marks: list[AnyMark] = []
    known = (table.rms_m > 0.0) & (table.horizon_min > 0.0)
    for name in shown:
        own = known & (table.aircraft == name)
        marks.append(Dots(x=table.horizon_min[own], y=table.rms_m[own], role=own_roles[name]))
    if (nameless := known & (table.aircraft == "")).any():
        marks.append(Dots(x=table.horizon_min[nameless], y=table.rms_m[nameless], role="unused", name="not named"))
    for name in shown:
        shipped = shipped_method(fleet, name)
        line = sorted(
            (row.horizon_min, row.rms_m)
            for row in rows
            if (row.aircraft, row.method) == (name, shipped) and row.horizon_min > 0.0
        )
        x, y = np.array(line, dtype=np.float64).reshape(-1, 2).T
        marks.append(Curve(x=x, y=y, role=own_roles[name], name=label(aircraft_name(name), 12), emphasis="bold"))
    return Plot(
        "fleet.growth",
        "How the error grows",
        "Line: root mean square over all starts of an aircraft, by its shipped method; dots: each of its flights."
        f"{left_out(len(shown), len(parted(fleet)))}",
        "RMS forecast error against horizon for each aircraft, with its single flights, logarithmic axes.",
        _growing(marks),
    )


def _growing(marks: list[AnyMark]) -> tuple[Row, ...]:
    return one_panel(Panel(marks, Axis(HORIZON, "log"), Axis("RMS radial error, m", "log"), legend="beside"), 70.0)


def flights(fleet: FleetResults) -> Plot:
    """Return the shipped method on every flight, and how honest its band is."""
    horizons = np.unique(fleet.skill_flights.horizon_min)
    horizon = HEADLINE_MIN if HEADLINE_MIN in horizons else float(horizons[-1])
    by_colour = ", a line for each aircraft in the colour of its flights" if parted(fleet) else ""
    return Plot(
        "fleet.skill",
        "Flights and coverage",
        f"Left: the shipped method on every flight after {horizon:g} min without GNSS. Right: share of the errors of "
        f"all starts inside the band that the forecast claims{by_colour}; below the dashed line it is overconfident.",
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
    """Describe the share of errors inside the band by horizon, a line for each aircraft."""
    names, roles, rows = parted(fleet), roles_of(fleet), drawn(fleet)
    marks: list[AnyMark] = []
    for name in names or (WHOLE_FLEET,):
        shipped = shipped_method(fleet, name)
        covered = sorted(
            (row.horizon_min, 100.0 * row.coverage95)
            for row in rows
            if (row.aircraft, row.method) == (name, shipped)
            and row.coverage95 is not None
            and np.isfinite(row.horizon_min)
        )
        if covered:
            x, y = np.array(covered, dtype=np.float64).T
            marks += line_with_dots(x, y, roles[name] if names else "answer")
    if marks:
        marks.insert(0, Limit(value=CONFIDENCE, role="answer", name="wanted"))
    upright = Axis("inside the 95 % band, %", low=0.0, high=105.0)
    nothing = "" if marks else "no band claimed"
    return Panel(marks, Axis("horizon, min"), upright, legend="", nothing=nothing)
