"""A plot of the fleet report that is described shows what its matplotlib drawer shows."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.chapters.fleet import CHAPTERS
from groundstation.chapters.parts import Figure
from groundstation.chapters.plots.fleet import FLEET_PLOTS
from groundstation.reports.drawing import sketching
from groundstation.reports.fleet import DRAWERS
from groundstation.results.arrays.fleet import FleetInstallationFlights
from groundstation.results.fleet import FleetResults
from groundstation.results.installation import InstallationRow
from tests.figure_arrays import filled
from tests.painted_axes import Shown, Thing, painted
from tests.test_fleet_report import fleet_of
from tests.test_plots_equal import compare, same_words

SECONDS_PER_DAY = 86_400.0
DEVIATION = {
    "magnetic_verdict": ["accept"] * 20 + [""] * 10,
    "magnetic_method": ["poisson_attitude"] * 20 + [""] * 10,
    **{f"magnetic_{letter}_deg": [0.1 * place] * 20 + [np.nan] * 10 for place, letter in enumerate("abcde")},
    **{f"magnetic_{letter}_sigma_deg": [0.1] * 20 + [np.nan] * 10 for letter in "abcde"},
}


def with_installation(fleet: FleetResults) -> FleetResults:
    """A fleet with one installation of four flights, of which the first knew nothing."""
    row = InstallationRow(1, "4711", "A1", "f1", "f4", 4, 4)
    flights = FleetInstallationFlights.of(
        filled(
            "installation_flights",
            place=np.ones(4, dtype=np.int64),
            sum_deg=np.array([np.nan, 0.1, 0.15, 0.12]),
            sum_sigma_deg=np.array([np.nan, 0.1, 0.07, 0.05]),
            factor=np.array([np.nan, 0.03, 0.028, 0.027]),
            factor_sigma=np.array([np.nan, 0.012, 0.011, 0.009]),
        )
    )
    return replace(fleet, installations=(row,), installation_flights=flights)


FLEETS: dict[str, Callable[[], FleetResults]] = {
    "usual": lambda: fleet_of(60),
    "bands": lambda: fleet_of(200, samples=20),
    "one": lambda: fleet_of(1),
    "unnamed": lambda: fleet_of(30, ("",)),
    "timeless": lambda: fleet_of(30, start_utc=[None] * 30),
    "deviation": lambda: fleet_of(30, **DEVIATION),
    "installations": lambda: with_installation(fleet_of(30)),
    "forty aircraft": lambda: fleet_of(80, [f"R{number}" for number in range(40)], samples=5),
}


@pytest.mark.parametrize("name", FLEETS)
def test_the_descriptions_of_a_fleet_show_what_the_drawers_paint(name: str) -> None:
    fleet = FLEETS[name]()
    compared = 0
    for figure in figures_of(fleet):
        of = (figure.of,) if figure.of else ()
        with sketching() as sketches:
            drawer: Any = DRAWERS[figure.name]
            drawing = drawer(fleet, *of)
        describe: Any = FLEET_PLOTS[figure.name]
        plot = describe(fleet, *of)
        assert (drawing is None) == (plot is None), figure
        if drawing is not None:
            assert plot.name == ".".join((figure.name, *of))
            same_words(drawing, plot)
            compare([in_seconds(one) for one in painted(sketches[drawing.svg])], plot)
            compared += 1
    assert compared


def test_every_plot_of_a_fleet_is_told_in_some_fleet() -> None:
    assert {one.name for make in FLEETS.values() for one in figures_of(make())} == set(FLEET_PLOTS) == set(DRAWERS)


def figures_of(fleet: FleetResults) -> list[Figure]:
    built = (build(fleet) for build in CHAPTERS.values())
    return [part for one in built if one is not None for part in one.parts if isinstance(part, Figure)]


def in_seconds(shown: Shown) -> Shown:
    """Axes with dates in seconds, not in days, and bars of rows as the lines that they are."""
    things = tuple(as_line(one) for one in shown.things)
    if shown.scales[0] != "date":
        return replace(shown, things=things)
    low, high = shown.x_range
    assert low is not None and high is not None
    return replace(
        shown,
        x_range=(SECONDS_PER_DAY * low, SECONDS_PER_DAY * high),
        things=tuple(replace(one, x=SECONDS_PER_DAY * one.x) for one in things),
    )


def as_line(thing: Thing) -> Thing:
    if thing.kind != "lanes":
        return thing
    ends, rows = np.concatenate([thing.x, thing.upper]), np.repeat(thing.y, 2)
    return replace(thing, kind="line", x=ends, y=rows, upper=np.zeros(0), weight="bold")
