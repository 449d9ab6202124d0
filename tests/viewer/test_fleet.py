"""The recording of a fleet as a file, read back and held against the results; and every tab of it in the viewer."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from rerun.experimental import ViewerClient

from groundstation.chapters.fleet import flights, rest, trend
from groundstation.chapters.markdown import escaped
from groundstation.chapters.parts import Grid
from groundstation.pipeline.many_flights.fleet.statistics import gather
from groundstation.results.figures import FigureData
from groundstation.results.fleet import Densities, FleetResults, NotInFleet
from groundstation.systems.cooperative.fleet_chapter import build as sessions
from groundstation.systems.heading import fleet_chapter as aircraft
from groundstation.systems.inertial import fleet_chapter as forecast
from groundstation.viewer.file_contents import facts_of_file
from groundstation.viewer.fleet_density import MOST_STEPS, PATH, SO_FAR, steps
from tests.fleet_example import save_flight, skill
from tests.recording_contents import Contents
from tests.told import write_fleet_recording
from tests.viewer_shots import ALL_OR_SOME, chosen, colourful, drawn_in, pages

STEADY, STEPPING, HOSTILE = "A12", "B3", "![x](http://127.0.0.1/x)|<b>/../"
FLIGHTS, NEW_LEVEL = 48, 27  # the flight from which on B3 is 1 deg off
LEAST_PIXELS = 40
DRAWN_IN_COLOUR = {"TimeSeries", "StateTimeline", "BarChart", "2D"}


def changed(fleet: FleetResults, **columns: np.ndarray) -> FleetResults:
    """The same fleet with other columns in its table of flights."""
    return replace(fleet, flights=FigureData("flights", {**fleet.flights.columns, **columns}, fleet.flights.digits))


def untimed(fleet: FleetResults, first: int) -> FleetResults:
    """The same fleet, flights from ``first`` on without a time, and so without a trend."""
    starts = fleet.flights["start_utc"].copy()
    starts[first:] = np.datetime64("NaT")
    kept = ~np.isin(fleet.trend["flight_id"], fleet.flights["flight_id"][first:])
    trend = fleet.trend.where(kept)
    changes = tuple(one for one in fleet.change_points if one.flight_id in set(trend["flight_id"].tolist()))
    return replace(changed(fleet, start_utc=starts), trend=trend, change_points=changes)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> FleetResults:
    out = tmp_path_factory.mktemp("out")
    rng = np.random.default_rng(11)
    for number in range(FLIGHTS):
        name = (STEADY, STEPPING, HOSTILE)[number % 3]
        error = 0.4 + float(name == STEPPING and number >= NEW_LEVEL) + float(rng.normal(0.0, 0.05))
        rms_m = 250.0 + 10.0 * number
        save_flight(out, number, aircraft=name, error_deg=error, samples=200, forecast=skill(rms_m=rms_m))
    found = gather(out)
    recordings = np.array([f"{name}/{name}.rrd" for name in found.flights["flight_id"].tolist()])
    failed = (NotInFleet("failed", "logs/a|b.ulg", "found <nothing>"), NotInFleet("skipped", "c.txt", "no reader"))
    return replace(changed(found, recording=recordings), not_in_fleet=failed)


@pytest.fixture(scope="module")
def path(fleet: FleetResults, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "fleet.rrd"
    write_fleet_recording(path, fleet)
    assert [entry.name for entry in path.parent.iterdir()] == ["fleet.rrd"], "a temporary file stayed behind"
    return path


@pytest.fixture(scope="module")
def contents(path: Path) -> Contents:
    return Contents(path)


def test_every_row_is_a_flight_at_its_start(contents: Contents, fleet: FleetResults) -> None:
    assert contents.timelines == {"utc", "flight_number"}
    starts = np.sort(fleet.flights["start_utc"]).astype(np.int64)
    for entity, batches in contents.batches.items():
        for batch in batches:
            places = np.asarray(batch.column("flight_number"))
            utc_ns = np.asarray(batch.column("utc").cast(pa.int64()))
            if places[0] > FLIGHTS:
                assert entity.endswith("/verdict") and utc_ns[0] > starts[-1], entity
                continue
            assert (utc_ns == starts[places - 1]).all(), entity


def test_identity_and_embedded_layout(contents: Contents) -> None:
    assert contents.store.recording_id == "fleet"
    assert [one.application_id for one in contents.blueprints] == [contents.store.application_id]


@pytest.mark.parametrize("name", [STEADY, STEPPING])
def test_errors_and_intervals_are_those_of_the_flights(contents: Contents, fleet: FleetResults, name: str) -> None:
    flights = fleet.flights
    mine = flights["aircraft"] == name
    outside = fleet.trend.flight_id[fleet.trend.is_outside & (fleet.trend.aircraft == name)]
    dots = [contents.scalars(one) for one in drawn(contents, name, "dots") if one != new_level(contents, name)]
    places, values = (np.concatenate([one[part] for one in dots]) for part in (0, 1))
    order = np.argsort(places)
    assert (places[order] == np.flatnonzero(mine) + 1).all() and len(dots) == (2 if len(outside) else 1)
    assert (values[order, 0] == flights["error_deg"][mine]).all()
    stretches = drawn(contents, name, "band")
    assert len(stretches) == (2 if name == STEPPING else 1), "a band ends where the level changes"
    bands = [contents.band(entity) for entity in stretches]
    middle, half = (np.concatenate([band[part] for band in bands]) for part in (1, 2))
    assert middle - half == pytest.approx(flights["confidence95_low_deg"][mine])
    assert middle + half == pytest.approx(flights["confidence95_high_deg"][mine])


def drawn(contents: Contents, name: str, kind: str, what: str = "heading_error") -> list[str]:
    """Entities of one kind of mark of an aircraft, in their order."""
    start = f"/aircraft/{name}/{what}/"
    return sorted(one for one in contents.batches if one.startswith(start) and one.endswith(f"_{kind}"))


def new_level(contents: Contents, name: str) -> str | None:
    """The entity of the first flights of new levels."""
    style = {
        one: contents.fixed[one][0].column("SeriesPoints:names")[0].as_py() for one in drawn(contents, name, "dots")
    }
    return next((one for one, names in style.items() if names == ["new level, °"]), None)


def test_lines_are_interrupted_where_the_level_changes(contents: Contents, fleet: FleetResults) -> None:
    change = next(one for one in fleet.change_points if one.aircraft == STEPPING)
    first = fleet.flights["flight_id"].tolist().index(change.flight_id) + 1
    before, after = (contents.scalars(one) for one in drawn(contents, STEPPING, "lines"))
    assert (before[0] < first).all() and (after[0] >= first).all()
    for (_, values), level in ((before, change.level_before), (after, change.level_after)):
        low, high, own = values.T
        assert np.allclose(own, level) and (low < own).all() and (own < high).all()
    entity = new_level(contents, STEPPING)
    assert entity is not None
    place, level = contents.scalars(entity)
    assert place.tolist() == [first] and level[0, 0] == pytest.approx(change.level_after)


def test_an_aircraft_without_changes_has_none(contents: Contents) -> None:
    assert new_level(contents, STEADY) is None
    ((_, values),) = (contents.scalars(one) for one in drawn(contents, STEADY, "lines"))
    assert values.shape == (2, 3)


def test_each_aircraft_has_a_row_with_the_density_of_its_flights_so_far(
    contents: Contents, fleet: FleetResults
) -> None:
    """Errors of different aircraft were pooled in one chart, as the page never does."""
    densities, numbers = fleet.densities, fleet.flights["flight_id"].tolist()
    assert not any(entity.startswith(f"/{PATH}/{SO_FAR}") for entity in contents.batches)
    rows = [entity for entity in contents.batches if entity.startswith(f"/{PATH}/") and entity.endswith(SO_FAR)]
    assert len(rows) == len(densities.named) == 3
    seen = set()
    for entity in rows:
        so_far_of = {
            place: np.asarray(tensor[0]["buffer"])
            for batch in contents.batches[entity]
            for place, tensor in zip(
                batch.column("flight_number").to_pylist(), batch.column("BarChart:values").to_pylist(), strict=True
            )
        }
        (name,) = {str(densities.aircraft[densities.flight_id == numbers[place - 1]][0]) for place in so_far_of}
        seen.add(name)
        own = densities.aircraft == name
        assert len(so_far_of) == int(own.sum())
        last = so_far_of[max(so_far_of)]
        assert np.allclose(last, densities.pooled_of(name), rtol=1e-6, atol=1e-9)
    assert seen == set(densities.named)


def test_the_growing_density_is_that_of_all_flights_so_far(fleet: FleetResults) -> None:
    densities = fleet.densities
    for upto, (place, so_far) in enumerate(steps_of(densities), start=1):
        expected = np.average(densities.density_per_deg[:upto], axis=0, weights=densities.samples[:upto])
        assert place == upto - 1 and np.allclose(so_far, expected, rtol=1e-6)


def steps_of(densities: Densities) -> list[tuple[int, np.ndarray]]:
    return list(steps(densities, np.arange(len(densities))))


def test_many_flights_are_drawn_in_some_200_steps(fleet: FleetResults) -> None:
    one, times = fleet.densities, 30
    many = Densities(
        one.edge_deg,
        *(np.tile(values, times) for values in (one.flight_id, one.aircraft, one.samples)),  # type: ignore[arg-type]
        np.tile(one.density_per_deg, (times, 1)),
        one.pooled_per_deg,
    )
    found = steps_of(many)
    assert len(many) > MOST_STEPS and len(found) == MOST_STEPS and found[-1][0] == len(many) - 1
    assert np.allclose(found[-1][1], one.pooled_per_deg, rtol=1e-6, atol=1e-9)


def test_skill_of_every_flight_by_horizon(contents: Contents, fleet: FleetResults) -> None:
    rms, horizons = fleet.skill_flights["rms_m"], fleet.skill_flights["horizon_min"]
    for number, horizon in enumerate(np.unique(horizons).tolist()):
        places, values = contents.scalars(f"/forecast/rms_by_flight/d0{number}_dots")
        assert (places == np.arange(1, FLIGHTS + 1)).all() and (values[:, 0] == rms[horizons == horizon]).all()
    assert {f"/fleet/growth/RMS_radial_error/{mark}" for mark in ("00_dots/0", "03_curve")} <= set(contents.fixed)
    assert "900" not in contents.text("/forecast/skill") and "last estimate" in contents.text("/forecast/skill")


def test_names_from_logs_are_neither_paths_nor_markup(contents: Contents) -> None:
    own = {entity.split("/")[2] for entity in contents.batches if entity.startswith("/aircraft/")}
    assert len(own) == 3 and all(re.fullmatch(r"[\w.-]+", part) for part in own)
    for document in ("/by_aircraft", "/flights", "/failed"):
        text = contents.text(document)
        assert "![" not in text and "<" not in text.replace("\\<", "")
        for block in text.split("\n\n"):
            if block.startswith("|"):
                assert len({len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}) == 1


def test_the_panels_tell_what_the_page_tells(contents: Contents, fleet: FleetResults) -> None:
    skill_told, sessions_told = forecast.build(fleet), sessions(fleet)
    assert skill_told is not None and sessions_told is None
    for document, section in (
        ("/by_aircraft", aircraft.build(fleet)),
        ("/by_aircraft", trend.build(fleet)),
        ("/forecast/skill", skill_told),
        ("/failed", rest.not_in_fleet(fleet)),
    ):
        text = contents.text(document)
        grids = [part for part in section.parts if isinstance(part, Grid)]
        assert grids and f"# {section.title}" in text
        cells = (cell for grid in grids for row in grid.rows for cell in row)
        assert [cell for cell in cells if escaped(cell if isinstance(cell, str) else cell.text) not in text] == []
    names = [line.cells[0] for line in flights.lines(fleet)]
    assert all(isinstance(name, str) and escaped(name) in contents.text("/flights") for name in names)


def test_links_name_the_recordings_and_nothing_else(fleet: FleetResults, tmp_path: Path) -> None:
    recordings = fleet.flights["recording"].copy().astype("U80")
    recordings[:3] = ["", "a b/(c).rrd", "http://127.0.0.1/x.rrd"]
    write_fleet_recording(tmp_path / "fleet.rrd", changed(fleet, recording=recordings))
    links = re.findall(r"(?<!\\)\]\(([^)]*)\)", Contents(tmp_path / "fleet.rrd").text("/flights"))
    assert links == recordings[3:].tolist()


def test_logs_without_a_flight_are_told(contents: Contents) -> None:
    text = contents.text("/failed")
    assert "no reader" in text and "nothing" in text and text.startswith("# Not in the fleet")


@pytest.mark.parametrize("first", [0, 30])
def test_flights_without_a_time_have_a_number_alone(fleet: FleetResults, tmp_path: Path, first: int) -> None:
    write_fleet_recording(tmp_path / "fleet.rrd", untimed(fleet, first))
    found = Contents(tmp_path / "fleet.rrd")
    assert found.timelines == ({"utc", "flight_number"} if first else {"flight_number"})
    for batches in found.batches.values():
        for batch in batches:
            places = np.asarray(batch.column("flight_number"))
            behind = bool(first) & (places > FLIGHTS)  # where every lane ends, on both timelines
            assert (((places <= first) | behind) == ("utc" in batch.schema.names)).all()
    places = np.concatenate([found.scalars(one)[0] for one in drawn(found, STEADY, "dots")])
    assert len(places) == FLIGHTS // 3, "all of them have a place on flight_number"
    assert f"{FLIGHTS - first} flights have no absolute time" in found.text("/flights")


def test_one_flight_and_none(tmp_path: Path) -> None:
    (tmp_path / "none").mkdir()
    write_fleet_recording(tmp_path / "none.rrd", gather(tmp_path / "none"))
    assert "# 0 flights" in Contents(tmp_path / "none.rrd").text("/flights")
    save_flight(tmp_path / "one", 0)
    write_fleet_recording(tmp_path / "one.rrd", gather(tmp_path / "one"))
    found = Contents(tmp_path / "one.rrd")
    (dots,) = drawn(found, "A12", "dots")
    assert found.scalars(dots)[1].tolist() == [[1.0]]
    ends = [found.scalars(f"/aircraft/A12/heading_error/c00_band/{end}")[1][0, 0] for end in ("low", "high")]
    assert ends[0] < ends[1], "a band of one flight is not seen"


FIGURES = ("error_deg", "radial_error_rate_fit_nmiph")


def test_flights_without_any_heading_leave_the_charts_out(fleet: FleetResults, tmp_path: Path) -> None:
    unknown = np.full(FLIGHTS, np.nan)
    bare = changed(fleet, error_deg=unknown, radial_error_rate_fit_nmiph=unknown, verdict=np.full(FLIGHTS, ""))
    none = fleet.trend.where(slice(0))
    empty = gather_nothing(tmp_path).densities
    write_fleet_recording(
        tmp_path / "fleet.rrd", replace(bare, trend=none, change_points=(), densities=empty, normals=())
    )
    found = Contents(tmp_path / "fleet.rrd")
    assert not [entity for entity in found.batches if "heading_error" in entity or "radial" in entity]
    assert not [entity for entity in found.batches if entity.startswith("/aircraft/")]
    assert facts_of_file(tmp_path / "fleet.rrd")["tabs"] == "Fleet, Forecast, Flights, Failed", "no aircraft has a page"


def test_aircraft_that_no_flight_judged_have_no_page(fleet: FleetResults, tmp_path: Path) -> None:
    is_other = fleet.flights["aircraft"] != STEADY
    errors, rates = (np.where(is_other, np.nan, fleet.flights[name]) for name in FIGURES)
    verdicts = np.where(is_other, "", fleet.flights["verdict"])
    mixed = changed(fleet, **dict(zip(FIGURES, (errors, rates), strict=True)), verdict=verdicts)
    write_fleet_recording(tmp_path / "fleet.rrd", replace(mixed, trend=fleet.trend.where(slice(0)), change_points=()))
    found = Contents(tmp_path / "fleet.rrd")
    assert {entity.split("/")[2] for entity in found.batches if entity.startswith("/aircraft/")} == {STEADY}


def test_the_newest_verdict_of_every_aircraft_has_room_behind_it(contents: Contents) -> None:
    lanes = [entity for entity in contents.batches if entity.endswith("/verdict")]
    assert len(lanes) == 3
    for entity in lanes:
        rows = [
            (place, state[0])
            for batch in contents.batches[entity]
            for place, state in zip(
                batch.column("flight_number").to_pylist(), batch.column("StateChange:state").to_pylist(), strict=True
            )
        ]
        assert max(rows) == (FLIGHTS + 1, "")


def gather_nothing(folder: Path) -> FleetResults:
    (folder / "nothing").mkdir()
    return gather(folder / "nothing")


@pytest.mark.viewer
@ALL_OR_SOME
def test_views_of_every_tab_draw_and_complain_of_nothing(
    path: Path, headless_viewer: Callable[[Path], ViewerClient], is_every: bool
) -> None:
    client = headless_viewer(path)
    client.set_time("flight_number", sequence=FLIGHTS // 2)
    seen = []
    seen_views = set()
    for name, views in pages(client, at_rest=False):
        seen.append(name)
        for view in chosen(views, is_every):
            if view.view_id in seen_views:  # stands on several pages
                continue
            seen_views.add(view.view_id)
            kind = view.view_class
            enough = LEAST_PIXELS if kind in DRAWN_IN_COLOUR else -1
            assert drawn_in(client, view.view_id, colourful, enough) > enough, (name, kind)
        assert not [view.reports for view in client.get_state().views if view.reports], name
    assert [tab for tab in ("Fleet", "Aircraft", "Forecast", "Flights", "Failed") if any(tab in one for one in seen)]
