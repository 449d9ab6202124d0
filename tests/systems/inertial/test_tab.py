"""Tabs of system 2 in the recording: values as they came, lines broken at NaN, forecasts at their start."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rerun as rr

from groundstation.base.ellipse import ELLIPSE_95
from groundstation.base.failures import gathered_failures
from groundstation.results.answer import by_analysis
from groundstation.results.corrected_position import corrected_position
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults, NotAssessable
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.tables.table import Flight
from groundstation.viewer.chart import Chart, ChartAxis
from groundstation.viewer.recorder import Line, Recorder
from tests.recording_contents import Contents
from tests.systems.inertial.example import AIDED, aided_figures, inertial_result
from tests.told import write_recording
from tests.viewer_example import START_NS, make_flight, make_results


@pytest.fixture(scope="module")
def flight() -> Flight:
    return make_flight(240.0, 10.0)


@pytest.fixture(scope="module")
def results(flight: Flight) -> FlightResults:
    return make_results(flight)


@pytest.fixture(scope="module")
def contents(flight: Flight, results: FlightResults, tmp_path_factory: pytest.TempPathFactory) -> Contents:
    path = tmp_path_factory.mktemp("recording") / "flight.rrd"
    write_recording(path, flight, results)
    return Contents(path)


def written(folder: Path, flight: Flight, results: FlightResults) -> Contents:
    write_recording(folder / "a.rrd", flight, results)
    return Contents(folder / "a.rrd")


def plain(text: str) -> str:
    """Markdown as it is read: no escapes, plain spaces."""
    return text.replace("\\", "").replace("\u202f", " ")


def test_states_are_those_of_the_results_with_their_band(contents: Contents, results: FlightResults) -> None:
    states = results.figure("inertial_states")
    assert states is not None
    time_ns, middle, half = contents.band("/inertial/state/tilt/east_tilt/c01_band")
    assert len(time_ns) == len(states)
    np.testing.assert_array_equal(middle, states["east_tilt_arcsec"])
    np.testing.assert_allclose(half, 1.96 * states["east_tilt_sigma_arcsec"])


def test_nothing_is_measured_without_gnss(contents: Contents, results: FlightResults) -> None:
    states = results.figure("inertial_states")
    assert states is not None
    measured = contents.scalars("/inertial/state/position/north_position_error/b00_lines")[1][:, 0]
    assert (np.isnan(measured) == states["is_forecast"]).all()
    lane = contents.batches["/inertial/filter"]
    names = [row[0] for batch in lane for row in batch.column("StateChange:state").to_pylist()]
    assert names == ["GNSS used", "forecast", "GNSS used", "forecast"]


def test_each_forecast_stands_at_its_start(contents: Contents, results: FlightResults) -> None:
    fan = results.figure("forecast_fan")
    assert fan is not None
    starts = np.unique(fan["start_s"])
    for chart in ("north", "east", "radial"):
        batches = contents.batches[f"/forecast/fan_{chart}/latest"]
        times = np.sort(np.concatenate([np.asarray(batch.column("flight_time").cast("int64")) for batch in batches]))
        assert times[0] == 0, "the first one is there when the recording opens"
        np.testing.assert_allclose(times[1:], np.rint(starts[1:] * 1e9), atol=1)


def test_hindcast_map_is_a_tensor_with_named_dimensions(contents: Contents, results: FlightResults) -> None:
    figure = results.figure("forecast_map")
    assert figure is not None
    batch = contents.fixed["/forecast/map/drift_windows"][0]
    (tensor,) = batch.column("Tensor:data")[0].as_py()
    assert tensor["names"] == ["start", "horizon"]
    assert tensor["shape"] == [len(np.unique(figure["start_s"])), len(np.unique(figure["horizon_min"]))]


def test_figures_asked_first_stand_in_the_panels(contents: Contents) -> None:
    first = plain(contents.text("/inertial/answer"))
    assert first.startswith("# Unaided INS, 0.37 nmi/h\n")
    assert "| Platform tilt, arcsec | +11.2 | 1.5 | 0.81 |" in first and "| **○ GNSS did not return** |" in first
    skill = plain(contents.text("/forecast/answer"))
    assert skill.startswith("# Shipped method: windows of the drift alone\n")
    assert "| windows of the drift alone (shipped) | **✓ 24** |" in skill and "| Starts | 43 |" in skill


def test_the_plan_has_an_ellipse_of_the_corrected_position_at_every_row(
    contents: Contents, results: FlightResults
) -> None:
    states = results.figure("inertial_states")
    corrected = corrected_position(results)
    assert states is not None and corrected is not None
    (batch,) = contents.batches["/plan/ellipse_now"]
    half = np.array(batch.column("Ellipses2D:half_sizes").to_pylist(), dtype=np.float64).reshape(-1, 2)
    sigmas = np.column_stack([states[f"{axis}_position_sigma_m"] for axis in ("east", "north")])
    larger = round(float(half[0, 0] / (ELLIPSE_95 * sigmas[0, 0])))
    np.testing.assert_allclose(half, larger * ELLIPSE_95 * sigmas, rtol=1e-5)
    assert "/plan/ellipses" in contents.fixed


def test_of_an_aided_ins_differences_and_its_filter_are_shown(
    tmp_path: Path, flight: Flight, results: FlightResults
) -> None:
    aided = inertial_result(flight.duration_s, **AIDED, figures=aided_figures(flight.duration_s))
    reason = NotAssessable("forecast", "GNSS corrects this INS already")
    kept = tuple(item for item in results.figures if not item.name.startswith(("inertial", "forecast")))
    changed = replace(results, answers=by_analysis(aided), figures=(*kept, *aided.figures), not_assessable=(reason,))
    contents = written(tmp_path, flight, changed)
    assert plain(contents.text("/inertial/answer")).startswith("# GNSS corrects this INS: within 3.0 m of it")
    drawn = {entity for entity in contents.batches if entity.startswith("/inertial/")}
    shown = {entity.rpartition("/")[0] for entity in drawn}
    assert shown == {
        *(f"/inertial/differences/{one}/{axis}" for one in ("position", "velocity") for axis in ("north", "east")),
        *(f"/inertial/own_innovations/{axis}_{one}" for one in ("position", "velocity") for axis in ("north", "east")),
    }


def test_reasons_stand_in_the_overview_and_make_no_tab(tmp_path: Path, flight: Flight, results: FlightResults) -> None:
    reasons = (NotAssessable("inertial", "GNSS for a minute only"), NotAssessable("forecast", "too short"))
    contents = written(tmp_path, flight, replace(results, answers={}, not_assessable=reasons))
    told = contents.text("/summary")
    assert "GNSS for a minute only" in told and "too short" in told
    entities = [*contents.batches, *contents.fixed]
    assert not [entity for entity in entities if entity.startswith(("/inertial", "/forecast"))]


@pytest.mark.parametrize("kind", ["one row", "no row", "nan", "time alone", "none", "huge"])
def test_a_recording_is_written_whatever_the_figures_lack(
    tmp_path: Path, flight: Flight, results: FlightResults, kind: str
) -> None:
    def changed(item: FigureData) -> FigureData:
        columns = dict(item.columns)
        if kind == "time alone":
            columns = dict(list(columns.items())[:1])
        for name, values in columns.items():
            if kind in ("one row", "no row"):
                columns[name] = values[: int(kind == "one row")]
            elif kind in ("nan", "huge") and values.dtype.kind == "f" and not name.endswith(("time_s", "start_s")):
                columns[name] = np.full(len(values), np.nan if kind == "nan" else 1e300)
        return FigureData(item.name, columns, item.digits)

    answers = [results.answer(InertialResult), results.answer(ForecastResult)]
    names = {item.name for answer in answers if answer for item in answer.figures}
    figures = [changed(item) if item.name in names else item for item in results.figures]
    shown = tuple(item for item in figures if kind != "none" or item.name not in names)
    bare = by_analysis(*(replace(answer, figures=()) for answer in answers if answer))
    with gathered_failures():
        contents = written(tmp_path, flight, replace(results, answers=bare, figures=shown))
    assert "nmi/h" in plain(contents.text("/inertial/answer"))


def test_a_chart_scales_values_into_its_box(tmp_path: Path) -> None:
    with rr.RecordingStream("a") as stream:
        stream.save(tmp_path / "a.rrd")
        chart = Chart(
            Recorder(stream, START_NS, True), "chart", ChartAxis("x", 0.0, 10.0), ChartAxis("y", 1.0, 100.0, "log")
        )
        chart.curves("line", [(np.array([0.0, 5.0]), np.array([1.0, np.nan]), Line("a", (0, 0, 0, 255)))])
        points = chart.points(np.array([0.0, 5.0, 10.0, 11.0]), np.array([1.0, 10.0, 100.0, 10.0]))
    np.testing.assert_allclose(points[:3], [[0.0, 100.0], [80.0, 50.0], [160.0, 0.0]], atol=1e-9)
    assert np.isnan(points[3, 0]), "outside of the axis"
