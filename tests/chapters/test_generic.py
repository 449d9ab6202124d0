"""The chapter and the figure that an answer has without a chapter of its own."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from groundstation.chapters.generic import MOST_ROWS, figures_over_time, generic
from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Facts, Section
from groundstation.chapters.plots.generic import series
from groundstation.reports.drawing import Drawing, drawn_by
from groundstation.results.answer import Answer, by_analysis
from groundstation.results.columns import AnswerColumn
from groundstation.results.figures import FigureData
from groundstation.results.files import load, save
from groundstation.results.flight import FlightResults
from groundstation.results.gates import Gate
from groundstation.results.manifest import Manifest
from groundstation.systems import systems
from tests.report_example import example, heading_result
from tests.section_contents import facts, grid, notes, row, rows, titles, tones
from tests.told import PLOTS, chapters_of, without_chapter

NAN = float("nan")


@dataclass(frozen=True)
class Layer:
    """Wind in one layer."""

    low_m: float
    speed_mps: float | None
    name: str
    is_calm: bool = False


@dataclass(frozen=True)
class Mean:
    """Mean wind."""

    north_mps: float
    east_mps: float


@dataclass(frozen=True)
class Wind(Answer):
    """Wind that the flight met.

    More of it, which no page shows.
    """

    analysis: ClassVar[str] = "wind"

    ins_topic: str
    speed_mps: float
    gust_mps: float | None
    mean: Mean
    layers: tuple[Layer, ...]
    verdict: str = "reject"
    verdict_reason: str = "gusts: 12.0, at most 8 m/s"
    share_by_sector: dict[str, float] = field(default_factory=dict)
    bias_deg: dict[str, float] = field(default_factory=dict)
    bins: tuple[float, ...] = ()
    confidence95_mps: tuple[float, float] = (-0.5, 1.5)
    gates: tuple[Gate, ...] = ()
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()


@dataclass(frozen=True)
class WindAloft(Answer):
    analysis: ClassVar[str] = "wind_aloft"

    height_m: float
    figures: tuple[FigureData, ...] = ()


def figure(name: str, **columns: object) -> FigureData:
    return FigureData(name, {key: np.asarray(values) for key, values in columns.items()}, {})


TIME = np.arange(0.0, 60.0, 1.0)
FIGURES = (
    figure("wind_samples", time_s=TIME, north_mps=np.sin(TIME), east_mps=TIME, turbulence=TIME, part=["a"] * len(TIME)),
    figure("wind_by_height", height_m=[1.0, 2.0], speed_mps=[3.0, 4.0]),
    figure("wind_empty", time_s=TIME[:0], speed_mps=TIME[:0]),
    figure("wind_aloft_samples", time_s=TIME, speed_mps=TIME),
    figure("windows", time_s=TIME, speed_mps=TIME),
)


def wind(**changes: object) -> Wind:
    layers = (Layer(0.0, 4.123456, "low, -1.0 deg"), Layer(1000.0, None, "high", True))
    return replace(Wind("ins.1", 7.123456, None, Mean(-5.0, 2.0), layers), **changes)


def flight(*answers: Answer) -> FlightResults:
    results = example(*answers)
    return replace(results, figures=(*results.figures, *FIGURES))


def chapter(answer: Answer) -> Section:
    return generic(flight(answer), answer)


def test_numbers_texts_and_what_is_absent_are_facts_with_units() -> None:
    found = facts(chapter(wind()), "Figures")
    assert found == {
        "INS topic": ("ins.1", ""),
        "Speed": ("7.1235 m/s", ""),
        "Gust": ("—", ""),
        "Bins": ("none", ""),
        "Confidence95": ("−0.5 m/s, 1.5 m/s", ""),
    }
    assert facts(chapter(wind(speed_mps=NAN)), "Figures")["Speed"] == ("—", "")
    assert facts(chapter(wind(bins=tuple(range(360)))), "Figures")["Bins"] == ("360 values", "")


def test_rows_are_a_table_and_a_dataclass_is_a_list_of_its_own() -> None:
    section = chapter(wind(bias_deg={"taxi": 0.25}))
    assert [(head.title, head.numeric) for head in grid(section, "Layers").heads] == [
        *(("Low, m", True), ("Speed, m/s", True), ("Name", False), ("Is calm", False)),
    ]
    assert rows(section, "Layers")[0] == ("0", "4.1235", "low, −1.0°", "no")
    assert row(section, "Layers", "1000") == ("—", "high", "yes")
    assert facts(section, "Mean") == {"North": ("−5 m/s", ""), "East": ("2 m/s", "")}
    assert facts(section, "Bias") == {"Taxi": ("0.25°", "")}


def test_a_long_table_is_cut_and_says_so() -> None:
    layers = tuple(Layer(float(place), 1.0, "") for place in range(MOST_ROWS + 3))
    found = grid(chapter(wind(layers=layers)), "Layers")
    assert (len(found.rows), found.caption) == (MOST_ROWS, "3 further rows are left out.")


@pytest.mark.parametrize(
    ("verdict", "tone"),
    [("accept", "good"), ("advisory", "warn"), ("reject", "bad"), ("extend", "warn"), ("undecided", "unknown")],
)
def test_the_verdict_stands_first_and_in_the_headline(verdict: str, tone: str) -> None:
    section = chapter(wind(verdict=verdict, remarks=("few turns",)))
    assert section.headline == f"Wind: {verdict}"
    assert notes(section) == [f"{verdict.capitalize()}: Gusts: 12.0, at most 8 m/s.", "Few turns."]
    assert tones(section)[0] == tone
    assert markdown(section).startswith(f"# Wind: {verdict}\n\n**")


def test_gates_and_settings_are_told_as_in_every_chapter() -> None:
    gate = Gate("gust", "gusts", 12.0, 8.0, "mps", "failed", required=False)
    section = chapter(wind(gates=(gate,), settings={"window_s": 30.0}))
    assert rows(section, "Gates") == [("▲ failed", "Gusts", "12 m/s", "≤ 8 m/s", "informs")]
    (settings,) = (part for part in section.appendix if isinstance(part, Facts))
    assert settings.title == "Settings: [wind]" and settings.compact
    assert list(settings.pairs) == [("window_s", "30", "")]
    assert "window" not in markdown(section)


def test_the_docstring_leads_where_there_is_one() -> None:
    assert chapter(wind()).lead == "Wind that the flight met."
    assert generic(flight(), WindAloft(3.0)).lead == ""


def test_figures_over_time_are_those_of_the_analysis() -> None:
    both = flight(wind(), WindAloft(3.0))
    assert figures_over_time(both, "wind") == ("wind_samples",)
    assert figures_over_time(both, "wind_aloft") == ("wind_aloft_samples",)
    assert "generic.series wind_samples" in titles(chapter(wind()))


def test_a_figure_has_a_panel_for_each_unit() -> None:
    results = flight(wind(), WindAloft(3.0))
    drawn = drawn_by(PLOTS, generic(results, wind()), results)
    (drawing,) = (part for part in drawn.parts if isinstance(part, Drawing))
    assert (drawing.title, drawing.numbers) == ("Wind samples", ("wind_samples",))
    assert "n = 60 rows" in drawing.caption
    plot = series(results, "wind_samples")
    assert plot is not None
    told = [(panel.y.title, [mark.name for mark in panel.marks]) for panel in plot.panels]
    assert told == [("m/s", ["north", "east"]), ("turbulence", ["turbulence"])]


def test_an_answer_with_a_chapter_has_no_second_one(tmp_path: Path) -> None:
    results = flight(heading_result(), wind())
    assert [answer.analysis for answer in without_chapter(results)] == ["wind"]
    assert [section.key for section in chapters_of(results)][-1] == "wind"
    save(tmp_path, results, Manifest())
    assert without_chapter(load(tmp_path, systems().answer_types).results) == ()  # a type that nobody named is left out
    (back,) = without_chapter(load(tmp_path, {**systems().answer_types, "wind": Wind}).results)
    live, saved = generic(results, wind()), generic(load(tmp_path, {"wind": Wind}).results, back)
    assert markdown(saved) == markdown(live)
    assert titles(saved) == titles(live)


def test_every_shipped_answer_has_a_chapter_of_its_own() -> None:
    assert set(systems().chapters.told) == set(systems().answer_types.values())
    assert by_analysis(wind())["wind"] == wind()


def test_tabs_name_analyses_that_there_are() -> None:
    named = [name for tab in systems().tabs for name in tab.shows]
    assert sorted(named) == sorted(systems().answer_types)


def test_a_column_without_a_field_is_refused_where_the_analysis_is_defined() -> None:
    heading = next(analysis for analysis in systems().analyses if analysis.name == "heading")
    with pytest.raises(TypeError, match="HeadingResult has no field for the columns eror_deg"):
        replace(heading, columns=(AnswerColumn("eror_deg", "number", "misspelt"),))
