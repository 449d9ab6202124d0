"""System 2 in the report: figures drawn where the chapters place them, whatever their arrays lack; the front."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from groundstation.base.ellipse import ELLIPSE_95
from groundstation.base.failures import failures, gathered_failures
from groundstation.chapters.parts import Front
from groundstation.chapters.plots.flight import track_map
from groundstation.reports.drawing import Drawing, drawn_by
from groundstation.results.corrected_position import corrected_position
from groundstation.results.figures import FigureData
from groundstation.results.files import save
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.chapter import inertial
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.inertial.forecast_chapter import forecast
from tests.report_example import MANIFEST, example
from tests.saved import load
from tests.systems.inertial.example import AIDED, aided_figures, forecast_result, inertial_result
from tests.told import PLOTS, flight_document

INERTIAL = (
    *("Position error of the INS", "Velocity error of the INS", "Track error before and after correction"),
    *("Platform tilt and gyro drift", "Innovations", "Observability"),
)
FORECAST = ("How the error grows", "Calibration of the shipped method", "Hindcast map")
SHOWS = {
    "inertial_states": {INERTIAL[0], INERTIAL[1], INERTIAL[3], INERTIAL[4]},
    "inertial_observability": {"Observability"},
    "inertial_track": {"Track error before and after correction"},
    "forecast_map": {"Hindcast map"},
    "forecast_fan": set(),
    "forecast_growth": {"How the error grows"},
    "forecast_classic": set(),
}


def flight(inertial: InertialResult | None = None, forecast: ForecastResult | None = None) -> FlightResults:
    """The report's example without a heading, with the answers of system 2."""
    return example(inertial or inertial_result(), forecast or forecast_result())


def drawings(results: FlightResults) -> list[Drawing]:
    """The figures of both chapters; each is a picture that can be parsed."""
    found = []
    for chapter in (inertial, forecast):
        section = chapter(results)
        assert section is not None
        whole = replace(section, parts=(*section.parts, *section.appendix))
        found += [part for part in drawn_by(PLOTS, whole, results).parts if isinstance(part, Drawing)]
    for drawing in found:
        assert ElementTree.fromstring(drawing.svg).tag.endswith("svg")
        assert drawing.caption and drawing.alt
    return found


def told_above(folder: Path, **changes: Any) -> Front:
    """What stands above the first chapter."""
    save(folder, flight(inertial_result(figures=(), **changes), forecast_result(figures=())), MANIFEST)
    return flight_document(load(folder)).front


def test_every_figure_is_drawn_in_its_order_and_names_its_arrays() -> None:
    found = drawings(flight())
    assert [drawing.title for drawing in found] == [*INERTIAL, *FORECAST]
    for name, shown in SHOWS.items():
        assert {drawing.title for drawing in found if name in drawing.numbers} == shown


def test_drift_and_error_after_an_hour_stand_on_the_front(tmp_path: Path) -> None:
    told = told_above(tmp_path)
    assert told.headline.replace("\u202f", " ") == "Unaided INS, drifts 0.37 nmi/h"
    (tile,) = told.others
    told_by = {row.method: row.p95_m for row in forecast_result().skill if row.horizon_min == 60.0}
    ours, raw = told_by[forecast_result().default_method], told_by["raw_ins"]
    assert tile.claim.value.replace("\u202f", " ") == f"{ours:.0f} m"
    remark = tile.claim.remark.replace("\u202f", " ")
    assert remark == f"95 % after 60 min without GNSS, corrected; raw INS {raw:.0f} m"


def test_of_an_aided_ins_differences_and_its_own_filter_are_drawn() -> None:
    answer = inertial_result(**AIDED, figures=aided_figures(3600.0))
    results = example(answer)
    section = inertial(results)
    assert section is not None
    found = [part for part in drawn_by(PLOTS, section, results).parts if isinstance(part, Drawing)]
    assert [drawing.title for drawing in found] == [
        *("INS − GNSS, position", "INS − GNSS, velocity", "Innovations of the INS's own filter"),
    ]
    assert "Shaded" in found[2].caption


def test_the_track_has_ellipses_of_the_corrected_position() -> None:
    drawn = track_map(flight())
    assert drawn is not None and "Ellipses: 95 % of the corrected position" in drawn.caption
    corrected = corrected_position(flight())
    assert corrected is not None and len(corrected.along()) == 8
    assert corrected.drawn_on(1e3)[1] <= corrected.drawn_on(1e6)[1] / 100
    wide = replace(corrected, sigma_north_m=np.geomspace(1.0, 1e7, len(corrected.time_s)))
    rows, larger = wide.drawn_on(1e5)
    assert 0 < len(rows) < 8 and larger * ELLIPSE_95 * wide.sigma_north_m[rows].max() <= 1e5
    without = track_map(example(inertial_result(**AIDED, figures=aided_figures(600.0))))
    assert without is not None and "Ellipses" not in without.caption


@pytest.mark.parametrize("kind", ["unknown", "gnss_aided"])
def test_an_ins_that_may_be_aided_has_no_drift_on_the_front(tmp_path: Path, kind: str) -> None:
    told = told_above(tmp_path, kind=kind)
    assert not told.figures and not told.others
    assert told.verdict is not None and told.verdict.tone == "unknown"


TIMES = ("time_s", "start_s", "horizon_min")


def cut(results: FlightResults, rows: int) -> FlightResults:
    """The first rows of every array."""
    return with_columns(results, lambda _, values: values[:rows])


def with_numbers(results: FlightResults, change: Callable[[np.ndarray], np.ndarray]) -> FlightResults:
    """Every column of numbers changed but times."""
    return with_columns(
        results,
        lambda name, values: values if values.dtype.kind != "f" or name.endswith(TIMES) else change(values),
    )


def with_columns(results: FlightResults, change: Callable[[str, np.ndarray], np.ndarray]) -> FlightResults:
    figures = tuple(
        FigureData(item.name, {name: change(name, values) for name, values in item.columns.items()}, item.digits)
        for item in results.figures
    )
    return replace(results, figures=figures)


@pytest.mark.parametrize(
    "results",
    [cut(flight(), 0), with_numbers(flight(), lambda values: np.full(len(values), np.nan))],
    ids=["no row", "nan"],
)
def test_without_numbers_only_the_answer_is_drawn(results: FlightResults) -> None:
    assert [drawing.title for drawing in drawings(results)] == ["Calibration of the shipped method"]


def test_absurd_values_are_drawn() -> None:
    results = with_numbers(flight(), lambda values: np.where(np.arange(len(values)) % 7 == 3, 1e9, values))
    assert [drawing.title for drawing in drawings(results)] == [*INERTIAL, *FORECAST]


def test_a_single_row_is_drawn_but_for_the_map() -> None:
    found = {drawing.title for drawing in drawings(cut(flight(), 1))}
    assert "Position error of the INS" in found and "Hindcast map" not in found


def test_each_array_alone_gives_its_own_figures_and_its_first_column_none() -> None:
    results = flight()
    always = "Calibration of the shipped method"
    for name, shown in SHOWS.items():
        item = results.figure(name)
        assert item is not None
        alone = drawings(replace(results, figures=(item,)))
        assert {drawing.title for drawing in alone} - {always} == shown, name
        first = FigureData(name, dict(list(item.columns.items())[:1]), {})
        with gathered_failures():
            assert [drawing.title for drawing in drawings(replace(results, figures=(first,)))] == [always], name
            assert {one.code for one in failures()} == ({f"internal.arrays.{name}"} if shown else set())
