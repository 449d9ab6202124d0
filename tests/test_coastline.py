"""Coastline, scale bar and north of the track's map: places, date line, poles, size, what is left out."""

import re

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.coastline import COARSE_M, ERROR_M, FILE, LONGEST_DEG, NAME, coastline_near
from groundstation.base.geodesy import POLAR_LATITUDE_DEG, latitude_longitude_deg, plan_north_east_m
from groundstation.chapters.plots import coast
from groundstation.chapters.plots.flight import track_map
from groundstation.chapters.wording import NARROW_SPACE
from groundstation.plots.extents import x_extent
from groundstation.plots.marks import Curve, Outlines
from groundstation.plots.plot import Axis, Panel, Plot, one_panel
from groundstation.reports.notebook.figure import figure_of
from groundstation.reports.svg.boxes import Box, placed
from groundstation.reports.svg.map_scale import map_scale_of
from groundstation.reports.svg.picture import picture_of
from groundstation.results.arrays.flight import Overview
from groundstation.results.flight import FlightResults
from tests.report_example import example

MOST_BYTES = 300_000
MOST_DRAWN = 300  # rings: fewer than a painter draws
# Capes and shores whose places are known from charts, to a minute of arc or better.
KNOWN_DEG = {
    "Cabo Finisterre": (42.882, -9.272),
    "Cape Agulhas": (-34.833, 20.0),
    "Cape Byron": (-28.638, 153.638),
    "Punta Gallinas": (12.458, -71.667),
    "Point Barrow": (71.388, -156.479),
    "Cape Dezhnev": (66.079, -169.652),
    "Nice, Promenade des Anglais": (43.694, 7.26),
}
NICE, FIJI, GREENLAND = (43.66, 7.21), (-16.9, 179.6), (83.0, -40.0)


def flown(latitude: np.ndarray, longitude: np.ndarray) -> FlightResults:
    """Results of a flight along places, nothing else known of it."""
    nothing = np.full(len(latitude), np.nan)
    course = Overview(
        time_s=np.linspace(0.0, 600.0, len(latitude)),
        latitude_deg=latitude,
        longitude_deg=longitude,
        **dict.fromkeys(("altitude_m", "ground_speed_mps", "heading_deg", "track_deg", "climb_mps"), nothing),
    )
    return example(None, figures=(course,))


def straight(start_deg: tuple[float, float], end_deg: tuple[float, float], count: int = 200) -> FlightResults:
    """A flight from place to place; longitudes as receivers write them, below 180."""
    latitude, longitude = np.linspace(start_deg, end_deg, count).T
    return flown(latitude, (longitude + 180.0) % 360.0 - 180.0)


def around(place_deg: tuple[float, float], half_deg: float = 0.2) -> FlightResults:
    """A flight past a place, about 45 km long for 0.2 deg."""
    (north, east) = place_deg
    return straight((north - half_deg, east - half_deg), (north + half_deg, east + half_deg))


def drawn(results: FlightResults) -> Plot:
    plot = track_map(results)
    assert plot is not None
    return plot


def shore_of(plot: Plot) -> Outlines | None:
    return next((mark for panel in plot.panels for mark in panel.marks if isinstance(mark, Outlines)), None)


def box_of(plot: Plot) -> Box:
    return placed(plot)[0][0].boxes[0]


def test_file_is_small_and_says_whence_it_comes() -> None:
    assert FILE.stat().st_size <= MOST_BYTES
    with np.load(FILE, allow_pickle=False) as kept:
        assert "Natural Earth 4.1.0" in str(kept["source"]) and str(kept["licence"]) == "public domain"


@pytest.mark.parametrize("name", KNOWN_DEG)
def test_coast_lies_where_charts_have_it(name: str) -> None:
    place = KNOWN_DEG[name]
    north, east = plan_north_east_m(*coastline_near(*place, 20_000.0), *place)
    assert np.nanmin(np.hypot(north, east)) < 2.0 * ERROR_M


def test_nothing_near_is_missing_and_lines_do_not_leap() -> None:
    for latitude, longitude in (NICE, FIJI, (66.0, -179.9), (-70.0, 180.0), (0.0, 0.0)):
        found, across = coastline_near(latitude, longitude, 30_000_000.0)
        assert np.nanmax(np.abs(np.diff(found))) <= LONGEST_DEG
        steps = np.abs(np.diff(across))
        assert np.nanmax(steps) <= LONGEST_DEG and np.nanmax(np.abs(across - longitude)) <= 180.0 + 1e-9
        near, beside = coastline_near(latitude, longitude, 300_000.0)
        north, east = plan_north_east_m(found, across, latitude, longitude)
        within = np.hypot(north, east) < 250_000.0
        kept = set(zip(near.round(6), np.mod(beside, 360.0).round(4), strict=True))
        missing = set(zip(found[within].round(6), np.mod(across[within], 360.0).round(4), strict=True)) - kept
        assert not missing


def test_line_of_a_continent_stays_near_the_other() -> None:
    place = (47.0, -2.0)
    fine, coarse = (
        np.column_stack(plan_north_east_m(*coastline_near(*place, 300_000.0, step_m), *place, is_polar=False))
        for step_m in (0.0, COARSE_M)
    )
    coarse = coarse[np.hypot(*coarse.T) < 250_000.0]
    fine = fine[np.isfinite(fine).all(axis=1)]
    apart = np.hypot(coarse[:, None, 0] - fine[:, 0], coarse[:, None, 1] - fine[:, 1]).min(axis=1)
    assert len(coarse) > 10 and apart.max() < 1.0, "its places are some of the other's"
    assert len(coastline_near(*place, 30_000_000.0, COARSE_M)[0]) < 40_000


def test_map_at_a_shore_has_it_beneath_the_track_and_says_so() -> None:
    plot = drawn(around(NICE))
    shore = shore_of(plot)
    assert shore is not None and plot.panels[0].marks[0] is shore
    assert f"Coastline: {NAME}, ±2 km." in plot.caption
    assert "Scale and north" not in plot.caption
    box = box_of(plot)
    inside = [
        (box.x.low <= ring[:, 0]) & (ring[:, 0] <= box.x.high) & (box.y.low <= ring[:, 1]) & (ring[:, 1] <= box.y.high)
        for ring in shore.rings
    ]
    assert any(one.any() for one in inside)


def test_coast_leaves_the_axes_as_they_are() -> None:
    plot = drawn(around(NICE))
    (panel,) = plot.panels
    track = [mark for mark in panel.marks if not isinstance(mark, Outlines)]
    without = Panel(track, Axis(panel.x.title), Axis(panel.y.title), legend="", is_map=True, unit_m=panel.unit_m)
    assert x_extent(panel.marks)[0] < x_extent(track)[0]
    plain = box_of(Plot("overview.track", "Track", "", "", one_panel(without, plot.rows[0].height_mm)))
    box = box_of(plot)
    assert (box.x.low, box.x.high, box.y.low, box.y.high) == pytest.approx(
        (plain.x.low, plain.x.high, plain.y.low, plain.y.high)
    )


@pytest.mark.parametrize(
    ("results", "why"),
    [
        (around(NICE, 0.03), "a map of 7 km: the line may be wrong by as much as one sees"),
        (around((50.0, 80.0)), "no coast in the middle of a continent"),
        (around((43.2, 4.7), 0.0001), "a receiver at rest"),
    ],
    ids=["small", "inland", "at rest"],
)
def test_map_without_a_coast_does_not_name_one(results: FlightResults, why: str) -> None:
    plot = drawn(results)
    assert shore_of(plot) is None and "Coastline" not in plot.caption, why
    assert plot.panels[0].x.low is None or plot.panels[0].unit_m == 1.0


@pytest.mark.parametrize("beyond_deg", [-0.2, 0.3, 0.6])
def test_date_line_is_crossed_as_if_it_were_not_there(beyond_deg: float) -> None:
    place = (FIJI[0], FIJI[1] + beyond_deg)
    plot = drawn(around(place))
    shore = shore_of(plot)
    assert shore is not None
    steps = np.concatenate([np.hypot(*np.diff(ring, axis=0).T) for ring in shore.rings])
    assert steps.max() < 60.0  # km: no line around the Earth
    start = place[0] - 0.2, place[1] - 0.2
    east, north = 1e3 * np.concatenate(shore.rings).T
    latitude, longitude = latitude_longitude_deg(north, east, *start)
    known, across = coastline_near(*place, 100_000.0)
    apart = np.hypot(known[:, None] - latitude, wrap_180(across[:, None] - longitude))
    assert np.nanmax(np.nanmin(apart, axis=0)) < 0.001
    is_there = np.abs(wrap_180(across - 180.0)) < 0.003
    assert not (is_there[1:] & is_there[:-1]).any(), "land is not cut along the date line"


def test_near_a_pole_the_coast_has_the_distance_and_direction_of_the_track() -> None:
    over = straight((POLAR_LATITUDE_DEG - 2.0, -40.0), (POLAR_LATITUDE_DEG + 1.0, -40.0))
    plot = drawn(over)
    shore = shore_of(plot)
    assert shore is not None and "Scale and north are those at the start." in plot.caption
    latitude, longitude = coastline_near(83.0, -40.0, 100_000.0)
    north, east = plan_north_east_m(latitude, longitude, 83.0, -40.0, is_polar=True)
    ring = np.concatenate(shore.rings)
    for place in np.flatnonzero(np.hypot(north, east) < 50_000.0)[::20]:
        assert np.hypot(ring[:, 0] - east[place] / 1e3, ring[:, 1] - north[place] / 1e3).min() < 3.0


def test_track_that_is_not_polar_keeps_its_plan_beside_an_antarctic_coast() -> None:
    plot = drawn(straight((-84.5, 170.0), (-77.5, 170.0)))
    curve = next(mark for mark in plot.panels[0].marks if isinstance(mark, Curve))
    assert shore_of(plot) is not None
    assert float(np.ptp(curve.x)) == pytest.approx(0.0, abs=1e-6)


def test_a_continent_is_drawn_with_a_bounded_number_of_places() -> None:
    plot = drawn(straight((40.0, -75.0), (50.0, 10.0)))
    shore = shore_of(plot)
    assert shore is not None
    assert sum(map(len, shore.rings)) <= coast.MOST_PLACES and len(shore.rings) < MOST_DRAWN
    assert max(map(len, shore.rings)) <= coast.MOST_OF_A_RING
    assert len(picture_of(plot)) < 120_000


@pytest.mark.parametrize("half_deg", [1e-6, 1e-4, 0.003, 0.2, 7.0, 60.0])
def test_scale_bar_is_as_long_as_it_says(half_deg: float) -> None:
    plot = drawn(around((10.0, 80.0), half_deg))
    box = box_of(plot)
    scale = map_scale_of(box)
    assert scale is not None
    size, unit = scale.text.split(NARROW_SPACE)
    length_m = float(size) * (1000.0 if unit == "km" else 1.0)
    metres_per_pt = plot.panels[0].unit_m * (box.x.high - box.x.low) / box.width
    assert (scale.right - scale.left) * metres_per_pt == pytest.approx(length_m)
    assert re.fullmatch("[125]0*", f"{length_m * 1000:.0f}")
    assert box.left < scale.left < scale.right < scale.arrow < box.right and box.top < scale.bottom < box.bottom
    told = picture_of(plot)
    assert scale.text in told and ">N</text>" in told


def test_scale_bar_stands_where_the_track_leaves_room() -> None:
    corner = np.linspace(0.0, 0.2, 400)
    plot = drawn(flown(10.0 + np.concatenate([corner, np.zeros(400)]), 80.0 + np.concatenate([0.0 * corner, corner])))
    box = box_of(plot)
    scale = map_scale_of(box)
    curve = next(mark for mark in box.panel.marks if isinstance(mark, Curve))
    assert scale is not None
    x, y = box.across(curve.x), box.down(curve.y)
    assert not ((x > scale.left) & (x < scale.arrow) & (np.abs(y - scale.bottom) < 5.0)).any()


def test_other_panels_and_small_maps_have_no_scale() -> None:
    curve = Curve(x=np.array([0.0, 10.0]), y=np.array([0.0, 10.0]))
    for panel in (Panel([curve]), Panel([curve], is_map=True), Panel([curve], is_map=True, unit_m=1.0, nothing="none")):
        assert map_scale_of(box_of(Plot("a", "A", "", "", one_panel(panel, 60.0)))) is None
    small = Panel([curve], is_map=True, unit_m=1.0)
    assert map_scale_of(box_of(Plot("a", "A", "", "", one_panel(small, 12.0)))) is None


def test_notebook_has_the_same_bar_and_arrow() -> None:
    plot = drawn(around(NICE))
    scale = map_scale_of(box_of(plot))
    assert scale is not None
    (axes,) = figure_of(plot).axes
    told = [text.get_text() for text in axes.texts]
    assert {scale.text, "N"} <= set(told)
    bar = next(line for line in axes.lines if len(line.get_xdata()) == 4)
    across = np.asarray(bar.get_xdata(), dtype=np.float64)
    assert plot.panels[0].unit_m * float(np.ptp(across)) == pytest.approx(
        float(scale.text.split(NARROW_SPACE)[0]) * 1000.0
    )
