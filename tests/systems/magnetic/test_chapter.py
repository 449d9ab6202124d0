"""The chapter on magnetic deviation: numbers as they were found, and a page whatever is missing."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Figure, Grid, Note, Section
from groundstation.reports.drawing import Drawing, drawn_by
from groundstation.results.answer import by_analysis
from groundstation.results.figures import FigureData
from groundstation.results.files import save
from groundstation.results.flight import FlightResults, NotAssessable
from groundstation.results.gates import Gate
from groundstation.results.manifest import Manifest
from groundstation.systems.magnetic.answer import ADVISORY, DEVIATION_CSV, STEER_CARD, MagneticResult
from groundstation.systems.magnetic.chapter import magnetic
from tests.report_example import example
from tests.reports.test_reports import Page, report
from tests.saved import load
from tests.systems.magnetic.test_run import figure_eight
from tests.told import PLOTS, flight_sections

FIGURES = ("Deviation by heading", "Error on data that no fit used", "Figures as flown", "Both branches")
TABLES = ("Coefficients", "Steer card", "Gates", "Methods side by side", "Turns of steady bank", "Each figure alone")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("eight")
    save(path, figure_eight(), Manifest())
    return path


def chapter(results: FlightResults) -> Section:
    section = magnetic(results)
    assert section is not None
    return section


def found() -> MagneticResult:
    answer = figure_eight().answer(MagneticResult)
    assert answer is not None
    return answer


def changed(**fields: Any) -> FlightResults:
    """The figure of eight with fields of its answer replaced."""
    return replace(figure_eight(), answers=by_analysis(replace(found(), **fields)))


def grid(section: Section, title: str) -> Grid:
    return next(part for part in whole(section).parts if isinstance(part, Grid) and part.title == title)


def whole(section: Section) -> Section:
    """The chapter with what it leaves to the appendix."""
    return replace(section, parts=(*section.parts, *section.appendix))


def test_the_chapter_stands_whole(folder: Path) -> None:
    section = chapter(load(folder).results)
    assert set(TABLES) <= {part.title for part in whole(section).parts if isinstance(part, Grid)}
    first = section.parts[0]
    assert isinstance(first, Note)
    assert (first.tone, first.text[:7]) == ("good", "Accept:")
    assert first.text.endswith(ADVISORY)
    drawn = drawn_by(PLOTS, whole(section), load(folder).results)
    titles = [part.title for part in drawn.parts if isinstance(part, Drawing)]
    assert {*FIGURES, "Modulus of the field"} <= set(titles)
    page = Page(report(folder, figure_eight()))
    assert "nan" not in page.text.lower().split()
    assert "None" not in page.text


def test_coefficients_and_card_are_those_of_the_result() -> None:
    section = chapter(figure_eight())
    iron = found().method("poisson_attitude")
    cells = {row[0]: row[3] for row in grid(section, "Coefficients").rows}
    assert cells["C"] == f"+{iron.coefficients_deg['C']:.3f} ± {iron.coefficients_sigma_deg['C']:.3f}"
    rows = grid(section, "Steer card").rows
    assert [row[0] for row in rows] + [row[4] for row in rows] == [f"{heading}°" for heading in range(0, 360, 30)]
    assert rows[3][1] == f"{found().card[3].steer_deg:.1f}°"
    added = f"{abs(found().card[3].deviation_deg):.1f}°"
    assert rows[3][2] in (f"+{added}", f"−{added}")


def test_the_modulus_is_refused_with_its_condition_number() -> None:
    row = grid(chapter(figure_eight()), "Methods side by side").rows[2]
    number = found().method("constant_modulus").condition_number
    assert row[5] == f"{number:.0f}"
    assert "Condition number" in str(row[7])


def test_a_reject_is_red_and_says_why() -> None:
    section = chapter(changed(verdict="reject", verdict_reason="coverage: 0.8, at least 0.98"))
    first = section.parts[0]
    assert isinstance(first, Note)
    assert (first.tone, first.text[:36]) == ("bad", "Reject: Coverage: 0.8, at least 0.98")
    assert section.headline == "Magnetic deviation: reject"


def test_a_gate_that_informs_warns_in_report_and_recording_alike() -> None:
    gates = (
        Gate("spread", "spread of the turns", 2.0, 1.0, "deg", "failed", required=False, reason="gusts"),
        Gate("coverage", "coverage", 0.8, 0.98, "", "failed", sense="at_least"),
    )
    section = chapter(changed(gates=gates))
    states = [row[0] for row in grid(section, "Gates").rows]
    assert [(state.tone, state.text) for state in states if not isinstance(state, str)] == [
        ("warn", "failed"),
        ("bad", "failed"),
    ]
    text = markdown(section)
    assert "**▲ failed**" in text and "**✗ failed**" in text and "gusts" in text


@pytest.mark.parametrize(
    "fields",
    [
        {"residual_rms_deg": None, "held_out": None},
        {"card": ()},
        {"methods": ()},
        {"turns": (), "swings": ()},
        {"poisson": None},
        {"gates": (), "settings": {}},
        {"bank_bias": (), "a_parts": (), "remarks": ()},
        {"coefficients_deg": {}, "coefficients_sigma_deg": {}},
    ],
)
def test_a_chapter_whatever_is_absent(fields: dict[str, Any]) -> None:
    results = changed(**fields)
    assert drawn_by(PLOTS, chapter(results), results).parts
    assert "None" not in markdown(chapter(results))


def test_numbers_that_are_not_known_are_dashes() -> None:
    answer, unknown = found(), float("nan")
    alignment = replace(answer.alignment, error_deg=unknown, sigma_deg=unknown, gyro_drift_deg_per_h=None)
    methods = tuple(replace(row, held_out_mean_deg=None, fit_rms_nt=None) for row in answer.methods)
    coverage = replace(answer.coverage, share=unknown)
    text = markdown(whole(chapter(changed(alignment=alignment, methods=methods, coverage=coverage))))
    assert "— ± —" in text and "nan" not in text.lower().replace("nanotesla", "")


def test_a_page_without_figures_and_with_empty_ones(folder: Path) -> None:
    bare = replace(load(folder).results, figures=())
    assert [part for part in chapter(bare).parts if isinstance(part, Figure)]
    assert not [part for part in drawn_by(PLOTS, chapter(bare), bare).parts if isinstance(part, Drawing)]
    empty = [
        FigureData(figure.name, {key: column[:0] for key, column in figure.columns.items()}, figure.digits)
        for figure in load(folder).results.figures
    ]
    none = replace(bare, figures=empty)
    assert not [part for part in drawn_by(PLOTS, chapter(none), none).parts if isinstance(part, Drawing)]


def test_the_report_names_the_files_that_are_there(folder: Path, tmp_path: Path) -> None:
    save(tmp_path, figure_eight(), Manifest())
    (tmp_path / DEVIATION_CSV).write_text("", encoding="utf-8")

    def named() -> list[list[str]]:
        sections = flight_sections(load(tmp_path))
        (section,) = (one for one in sections if one.key == "magnetic")
        return [list(part.files) for part in section.parts if isinstance(part, Note) and part.files]

    assert named() == [[DEVIATION_CSV]]
    (tmp_path / STEER_CARD).write_text("", encoding="utf-8")
    assert named() == [[STEER_CARD, DEVIATION_CSV]]
    for name in (STEER_CARD, DEVIATION_CSV):
        (tmp_path / name).unlink()
    assert named() == []


def test_without_a_result_the_chapter_says_why() -> None:
    results: FlightResults = example(None, not_assessable=(NotAssessable("magnetic", "no opposite turns"),))
    section = chapter(results)
    (note,) = section.parts
    assert isinstance(note, Note)
    assert note.text == "Not assessable: no opposite turns"
    assert section.headline == "Magnetic deviation not assessed"
    assert magnetic(replace(results, not_assessable=())) is None
