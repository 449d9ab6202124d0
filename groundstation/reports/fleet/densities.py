"""Figures: density of the heading error of every flight, overlaid with the fitted normal (figure 3 of the paper)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.fleet.common import aircraft_name, plural
from groundstation.chapters.fleet.densities import angle
from groundstation.chapters.wording import number
from groundstation.plots.ranges import padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.fleet.common import colours_of, left_out, rows_shown
from groundstation.results.fleet import Densities, FittedNormal, FleetResults

MOST_LINES = 150  # flights drawn as lines; more become bands of quantiles
MOST_LINES_OF_A_PANEL = 60
MOST_PANELS = 12
PANEL_COLUMNS = 3
BANDS = ((0.05, 0.95, 0.25), (0.25, 0.75, 0.5))  # of the flights, and how dark
LEFT_OUT = 0.001  # share of all samples that each end of the axis may leave out


def overlay(fleet: FleetResults) -> Drawing:
    """Draw the density of every flight over each other."""
    densities, normal = fleet.densities, fleet.normal()
    everyone = np.arange(len(densities))
    low, high = _span(densities)
    colours = colours_of(fleet)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 81)
        top = _paint_flights(axes, densities, everyone, MOST_LINES, colours, named=True)
        d.line(
            axes,
            *_outline(densities, densities.pooled_per_deg),
            d.FAINT,
            1.6,
            label="all samples",
            zorder=5,
            linestyle=(0, (3, 1)),
        )
        _paint_normal(axes, normal, low, high, "fitted normal")
        axes.set_xlim(low, high)
        axes.set_ylim(0.0, 1.08 * top)
        axes.set_xlabel("INS heading − GNSS track, °")
        axes.set_ylabel("probability density, 1/°")
        layout.legend_above(axes, 5)

    fitted = "" if normal is None else f" with mean {angle(normal.mean_deg)} and σ {number(normal.sigma_deg, 3, '°')}"
    caption = (
        f"{_how_drawn(len(densities), colours)} Dashed: all {number(int(densities.samples.sum()), 0)} samples; "
        f"black: the normal fitted to them{fitted}. Where the "
        f"flights' heading errors differ, the normal of all is wider than any of theirs.{_beyond(densities, low, high)}"
    )
    alt = "Densities of the heading error of the flights over each other with the fitted normal curve."
    return Drawing("Density of every flight", caption, alt, d.draw("fleet-densities", 92, paint))


def _how_drawn(flights: int, colours: dict[str, str]) -> str:
    if flights <= MOST_LINES:
        by_colour = ", coloured by aircraft" if _tell_apart(colours) else ""
        return f"A thin line for each of {plural(flights, 'flight')}{by_colour}."
    return f"{plural(flights, 'flight')}: shaded, at each place, the middle 90 % and 50 % of them; thin line: median."


def _tell_apart(colours: dict[str, str]) -> bool:
    """Whether more than one aircraft is named and each has its own colour."""
    return len(colours) > 2 and len(set(colours.values())) > 2


def _span(densities: Densities) -> tuple[float, float]:
    """Ends of the axis: almost all samples, and room for the outermost bins."""
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


def _outline(densities: Densities, density: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Bin centres and density without the empty bins on both sides."""
    filled = np.flatnonzero(density > 0.0)
    if not len(filled):
        return np.zeros(0), np.zeros(0)
    shown = slice(max(int(filled[0]) - 1, 0), int(filled[-1]) + 2)
    return densities.center_deg[shown], density[shown]


def _paint_flights(
    axes: Any, densities: Densities, rows: NDArray[np.intp], most: int, colours: dict[str, str], named: bool
) -> float:
    """Draw flights as lines, or as bands where they are many; returns the height that shows them."""
    if len(rows) > most:
        return _paint_bands(axes, densities, rows, named)
    told: set[str] = set()
    is_coloured = named and _tell_apart(colours)
    for row in rows.tolist():
        name = str(densities.aircraft[row])
        text = d.label(aircraft_name(name), 12) if is_coloured and name not in told else None
        told.add(name)
        x, y = _outline(densities, densities.density_per_deg[row])
        axes.plot(x, y, color=colours[name], linewidth=0.6, alpha=0.55)
        if text is not None:
            axes.plot([], [], color=colours[name], linewidth=1.2, label=text)
    peaks = densities.density_per_deg[rows].max(axis=1)
    return float(max(np.quantile(peaks, 0.98), np.max(densities.pooled_per_deg))) or 1.0


def _paint_bands(axes: Any, densities: Densities, rows: NDArray[np.intp], named: bool) -> float:
    shares = (*(share for low, high, _ in BANDS for share in (low, high)), 0.5)
    curves = np.quantile(densities.density_per_deg[rows], shares, axis=0)
    for place, (low, high, shade) in enumerate(BANDS):
        text = f"{100 * (high - low):.0f} % of the flights" if named else None
        lower, upper = curves[2 * place], curves[2 * place + 1]
        axes.fill_between(densities.center_deg, lower, upper, color=d.INS, alpha=shade, linewidth=0, label=text)
    d.line(axes, *_outline(densities, curves[-1]), d.INS, 0.8)
    return float(max(curves.max(), np.max(densities.pooled_per_deg))) or 1.0


def _paint_normal(axes: Any, normal: FittedNormal | None, low: float, high: float, text: str | None) -> None:
    if normal is None or not normal.sigma_deg > 0.0:
        return
    x = np.linspace(low, high, 400)
    z = (x - normal.mean_deg) / normal.sigma_deg
    height = np.exp(-0.5 * z**2) / (normal.sigma_deg * np.sqrt(2.0 * np.pi))
    axes.plot(x, height, color=d.INK, linewidth=1.6, label=text, zorder=6)


def by_aircraft(fleet: FleetResults) -> Drawing:
    """Draw the densities of each aircraft on axes of their own."""
    densities = fleet.densities
    names, flights = np.unique(densities.aircraft, return_counts=True)
    counts = {name: count for name, count in zip(names.tolist(), flights.tolist(), strict=True) if name}
    shown = rows_shown(counts, MOST_PANELS)
    low, high = _span(densities)
    lines = (len(shown) + PANEL_COLUMNS - 1) // PANEL_COLUMNS
    height = 12.0 + 42.0 * lines
    colours = colours_of(fleet)

    def paint(figure: Any) -> None:
        for place, name in enumerate(shown):
            line, column = divmod(place, PANEL_COLUMNS)
            left, bottom = 13.0 + 57.0 * column, height - 42.0 * (line + 1) + 4.0
            axes = layout.place(figure, left, bottom, left + 47.0, bottom + 31.0)
            rows = np.flatnonzero(densities.aircraft == name)
            top = _paint_flights(axes, densities, rows, MOST_LINES_OF_A_PANEL, colours, named=False)
            _paint_normal(axes, fleet.normal(name), low, high, None)
            axes.set_xlim(low, high)
            axes.set_ylim(0.0, 1.08 * top)
            axes.set_title(f"{d.label(name, 12)}, {plural(counts[name], 'flight')}")
            if place + PANEL_COLUMNS >= len(shown):
                axes.set_xlabel("INS heading − GNSS track, °")
            if column == 0:
                axes.set_ylabel("1/°")

    caption = (
        f"The same for each aircraft; black: the normal fitted to its samples. More than {MOST_LINES_OF_A_PANEL} "
        f"flights are drawn as bands that hold 90 % and 50 % of them at each place.{left_out(len(shown), len(counts))}"
    )
    alt = "A panel for each aircraft with the densities of its flights and the normal fitted to them."
    return Drawing("Density by aircraft", caption, alt, d.draw("fleet-panels", height, paint))
