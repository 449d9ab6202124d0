"""Plots of the density of the heading error of every flight.

Overlaid with the fitted normal (figure 3 of the paper).
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.fleet.common import aircraft_name
from groundstation.chapters.plots.common import label
from groundstation.chapters.plots.fleet.common import left_out, roles_of, rows_shown
from groundstation.chapters.wording import number, plural
from groundstation.plots.marks import SERIES, AnyMark, Band, Curve, Emphasis, Floats, Role, series
from groundstation.plots.plot import Axis, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import padded
from groundstation.results.fleet import Densities, FittedNormal, FleetResults
from groundstation.systems.heading.fleet_densities_chapter import angle

MOST_LINES = 150  # flights drawn as lines; more become bands of quantiles
MOST_LINES_OF_A_PANEL = 60
MOST_PANELS = 12
PANEL_COLUMNS = 3
BANDS: tuple[tuple[float, float, Emphasis], ...] = ((0.05, 0.95, "usual"), (0.25, 0.75, "bold"))  # of the flights
LEFT_OUT = 0.001  # share of all samples that each end of the axis may leave out


def overlay(fleet: FleetResults) -> Plot:
    """Return the density of every flight over each other, and of each aircraft."""
    densities, roles = fleet.densities, roles_of(fleet)
    low, high = _span(densities)
    if len(densities.named) > 1:
        marks, top, told = _of_each(densities, roles)
    else:
        marks, top, told = _of_all(fleet, low, high)
    across = Axis("INS heading − GNSS track, °", low=low, high=high)
    return Plot(
        "fleet.densities",
        "Density of every flight",
        f"{told}{_beyond(densities, low, high)}",
        "Densities of the heading error of the flights over each other with the fitted normal curve.",
        one_panel(Panel(marks, across, Axis("probability density, 1/°", low=0.0, high=1.08 * top)), 69.0),
    )


def _of_all(fleet: FleetResults, low: float, high: float) -> tuple[list[AnyMark], float, str]:
    """Return marks of a fleet of one aircraft, the height of the axis, the caption."""
    densities, normal, roles = fleet.densities, fleet.normal(), roles_of(fleet)
    every = np.arange(len(densities))
    marks, top = _flights(densities, every, MOST_LINES, roles, densities.pooled_per_deg, is_named=True)
    marks.append(_all_samples(densities, densities.pooled_per_deg, "faint", "all samples"))
    marks += _normal(normal, low, high, "fitted normal")
    fitted = ""
    if normal is not None:
        mean_and_sigma = f"mean {angle(normal.mean_deg)} and σ {number(normal.sigma_deg, 3, '°')}"
        fitted = f"; black: the normal fitted to them with {mean_and_sigma}"
    told = f"{_how_drawn(len(densities), roles)} Dashed: all {plural(int(densities.samples.sum()), 'sample')}{fitted}."
    return marks, top, told


def _of_each(densities: Densities, roles: dict[str, Role]) -> tuple[list[AnyMark], float, str]:
    """Return marks of a fleet of several aircraft, the height of the axis, the caption."""
    counts = {name: int(np.sum(densities.aircraft == name)) for name in densities.named}
    shown = rows_shown(counts, len(SERIES))
    own = roles if _tell_apart(roles) else {**roles, **{name: series(place) for place, name in enumerate(shown)}}
    pooled = {name: densities.pooled_of(name) for name in shown}
    top = max(float(curve.max()) for curve in pooled.values())
    marks: list[AnyMark] = []
    rows = np.flatnonzero(np.isin(densities.aircraft, [*shown, ""]))
    is_drawn = len(rows) <= MOST_LINES
    if is_drawn:
        marks, top = _flights(densities, rows, MOST_LINES, own, pooled[shown[0]], is_named=False)
        top = max(top, *(float(curve.max()) for curve in pooled.values()))
    for name, curve in pooled.items():
        marks.append(_all_samples(densities, curve, own[name], label(aircraft_name(name), 12)))
    single = "thin: each flight" if is_drawn else f"{plural(len(rows), 'flight')} are not drawn by themselves"
    told = f"Dashed: the samples of an aircraft together; {single}.{left_out(len(shown), len(counts))}"
    return marks, top or 1.0, told


def _all_samples(densities: Densities, density: Floats, role: Role, name: str = "") -> Curve:
    x, y = _outline(densities, density)
    return Curve(x=x, y=y, role=role, name=name, dash="dashed", emphasis="bold")


def _how_drawn(flights: int, roles: dict[str, Role]) -> str:
    if flights <= MOST_LINES:
        by_colour = ", coloured by aircraft" if _tell_apart(roles) else ""
        return f"A thin line for each of {plural(flights, 'flight')}{by_colour}."
    return f"{plural(flights, 'flight')}: shaded, at each place, the middle 90 % and 50 % of them; thin line: median."


def _tell_apart(roles: dict[str, Role]) -> bool:
    """Tell whether more than one aircraft is named and each has its own role."""
    return len(roles) > 2 and len(set(roles.values())) > 2


def _span(densities: Densities) -> tuple[float, float]:
    """Return ends of the axis: almost all samples, and room for the outermost bins."""
    width = float(densities.edge_deg[1] - densities.edge_deg[0])
    below = np.append(0.0, np.cumsum(densities.pooled_per_deg) * width)
    first = int(np.searchsorted(below, LEFT_OUT, side="right")) - 1
    last = int(np.searchsorted(below, below[-1] - LEFT_OUT))
    low, high = float(densities.edge_deg[max(first, 0)]), float(densities.edge_deg[min(last, len(below) - 1)])
    return (low, high) if high > low else padded(low, high, 0.06, width)


def _beyond(densities: Densities, low: float, high: float) -> str:
    inside = (densities.center_deg > low) & (densities.center_deg < high)
    width = float(densities.edge_deg[1] - densities.edge_deg[0])
    beyond = int(np.sum(densities.density_per_deg[:, inside].sum(axis=1) * width < 0.5))
    return f" {plural(beyond, 'flight lies', 'flights lie')} mostly beyond the axis." if beyond else ""


def _outline(densities: Densities, density: Floats) -> tuple[Floats, Floats]:
    """Return bin centres and density without the empty bins on both sides."""
    filled = np.flatnonzero(density > 0.0)
    if not len(filled):
        return np.zeros(0), np.zeros(0)
    shown = slice(max(int(filled[0]) - 1, 0), int(filled[-1]) + 2)
    return densities.center_deg[shown], density[shown]


def _flights(
    densities: Densities, rows: NDArray[np.intp], most: int, roles: dict[str, Role], pooled: Floats, *, is_named: bool
) -> tuple[list[AnyMark], float]:
    """Return flights as lines, or as bands where they are many, and the height of the axis.

    ``pooled`` is the density of their samples together: the axis holds it.
    """
    if len(rows) > most:
        return _bands(densities, rows, pooled, is_named=is_named)
    told: set[str] = set()
    is_coloured = is_named and _tell_apart(roles)
    marks: list[AnyMark] = []
    for row in rows.tolist():
        name = str(densities.aircraft[row])
        text = label(aircraft_name(name), 12) if is_coloured and name not in told else ""
        told.add(name)
        x, y = _outline(densities, densities.density_per_deg[row])
        marks.append(Curve(x=x, y=y, role=roles[name], name=text, emphasis="faint"))
    peaks = densities.density_per_deg[rows].max(axis=1)
    return marks, float(max(np.quantile(peaks, 0.98), np.max(pooled))) or 1.0


def _bands(
    densities: Densities, rows: NDArray[np.intp], pooled: Floats, *, is_named: bool
) -> tuple[list[AnyMark], float]:
    shares = (*(share for low, high, _ in BANDS for share in (low, high)), 0.5)
    curves = np.quantile(densities.density_per_deg[rows], shares, axis=0)
    marks: list[AnyMark] = []
    for place, (low, high, heavy) in enumerate(BANDS):
        text = f"{100 * (high - low):.0f} % of the flights" if is_named else ""
        lower, upper = curves[2 * place], curves[2 * place + 1]
        marks.append(Band(x=densities.center_deg, low=lower, high=upper, role="ins", name=text, emphasis=heavy))
    x, y = _outline(densities, curves[-1])
    marks.append(Curve(x=x, y=y, role="ins", emphasis="thin"))
    return marks, float(max(curves.max(), np.max(pooled))) or 1.0


def _normal(normal: FittedNormal | None, low: float, high: float, text: str) -> list[AnyMark]:
    if normal is None or not normal.sigma_deg > 0.0:
        return []
    x = np.linspace(low, high, 400)
    z = (x - normal.mean_deg) / normal.sigma_deg
    height = np.exp(-0.5 * z**2) / (normal.sigma_deg * np.sqrt(2.0 * np.pi))
    return [Curve(x=x, y=height, role="ink", name=text, emphasis="bold")]


def by_aircraft(fleet: FleetResults) -> Plot:
    """Return densities of each aircraft on axes of their own."""
    densities, roles = fleet.densities, roles_of(fleet)
    names, flights = np.unique(densities.aircraft, return_counts=True)
    counts = {name: count for name, count in zip(names.tolist(), flights.tolist(), strict=True) if name}
    shown = rows_shown(counts, MOST_PANELS)
    low, high = _span(densities)
    panels = []
    for place, name in enumerate(shown):
        rows = np.flatnonzero(densities.aircraft == name)
        pooled = densities.pooled_of(name)
        marks, top = _flights(densities, rows, MOST_LINES_OF_A_PANEL, roles, pooled, is_named=False)
        marks.append(_all_samples(densities, pooled, "faint"))
        marks += _normal(fleet.normal(name), low, high, "")
        y = Axis("" if place % PANEL_COLUMNS else "1/°", low=0.0, high=1.08 * top)
        x_title = "INS heading − GNSS track, °" if place + PANEL_COLUMNS >= len(shown) else ""
        title = f"{label(name, 12)}, {plural(counts[name], 'flight')}"
        panels.append(Panel(marks, Axis(x_title, low=low, high=high), y, title=title, legend=""))
    starts = range(0, len(panels), PANEL_COLUMNS)
    return Plot(
        "fleet.densities_by_aircraft",
        "Density by aircraft",
        "The same for each aircraft; dashed: all its samples; black: their fitted normal. More than "
        f"{MOST_LINES_OF_A_PANEL} flights are drawn as bands that hold 90 % and 50 % of them at each place."
        f"{left_out(len(shown), len(counts))}",
        "A panel for each aircraft with the densities of its flights and the normal fitted to them.",
        tuple(Row(tuple(panels[at : at + PANEL_COLUMNS]), 31.0, columns=PANEL_COLUMNS) for at in starts),
    )
