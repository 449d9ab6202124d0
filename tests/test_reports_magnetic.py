"""The chapter on magnetic deviation: numbers as they were found, and a page whatever is missing."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from groundstation.chapters.parts import Grid, Note, Section
from groundstation.reports.drawing import Drawing, sketching
from groundstation.reports.sections.magnetic import build
from groundstation.results.figures import FigureData
from groundstation.results.files import SUMMARY, load, save
from groundstation.results.flight import FlightResults, NotAssessable
from groundstation.results.magnetic import ADVISORY, MagneticResult
from groundstation.results.manifest import Manifest
from tests.report_example import example
from tests.test_magnetic_run import figure_eight
from tests.test_reports import HOSTILE, Page, report

FIGURES = ("Deviation by heading", "Error where no fit has seen", "Figures as flown", "Both branches")
TABLES = ("Coefficients", "Steer card", "Gates", "Methods side by side", "Turns of steady bank", "Figures apart")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("eight")
    save(path, figure_eight(), Manifest())
    return path


def chapter(folder: Path) -> Section:
    section = build(load(folder))
    assert section is not None
    return section


def grid(section: Section, title: str) -> Grid:
    return next(part for part in section.parts if isinstance(part, Grid) and part.title == title)


def test_the_chapter_stands_whole(folder: Path) -> None:
    section = chapter(folder)
    titles = [part.title for part in section.parts if isinstance(part, Drawing | Grid)]
    assert {*FIGURES, "Modulus of the field"} <= set(titles)
    assert set(TABLES) <= set(titles)
    first = section.parts[0]
    assert isinstance(first, Note)
    assert (first.tone, first.text[:7]) == ("good", "Accept:")
    assert first.text.endswith(ADVISORY)
    page = Page(report(folder, figure_eight()))
    assert "nan" not in page.text.lower().split()
    assert "None" not in page.text


def test_coefficients_and_card_are_those_of_the_result(folder: Path) -> None:
    found = figure_eight().answer(MagneticResult)
    assert found is not None
    section = chapter(folder)
    iron = found.method("poisson_attitude")
    cells = {row[0]: row[3] for row in grid(section, "Coefficients").rows}
    assert cells["C"] == f"+{iron.coefficients_deg['C']:.3f} ± {iron.coefficients_sigma_deg['C']:.3f}"
    rows = grid(section, "Steer card").rows
    assert [row[0] for row in rows] + [row[4] for row in rows] == [f"{heading}°" for heading in range(0, 360, 30)]
    assert rows[3][1] == f"{found.card[3].steer_deg:.1f}°"


def test_the_modulus_is_refused_with_its_condition_number(folder: Path) -> None:
    row = grid(chapter(folder), "Methods side by side").rows[2]
    found = figure_eight().answer(MagneticResult)
    assert found is not None
    number = found.method("constant_modulus").condition_number
    assert row[5] == f"{number:.0f}"
    assert "Condition number" in str(row[7])


def changed(folder: Path, **fields: Any) -> Section:
    document = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    document["results"]["magnetic"] |= fields
    with sketching():
        return chapter_of(replace(load(folder), summary=document))


def chapter_of(saved: Any) -> Section:
    section = build(saved)
    assert section is not None
    return section


def test_a_reject_is_red_and_says_why(folder: Path) -> None:
    section = changed(folder, verdict="reject", verdict_reason="coverage: 0.8, at least 0.98")
    first = section.parts[0]
    assert isinstance(first, Note)
    assert (first.tone, first.text[:36]) == ("bad", "Reject: Coverage: 0.8, at least 0.98")


@pytest.mark.parametrize("name", ["verdict", "card", "methods", "turns", "swings", "alignment", "poisson", "held_out"])
@pytest.mark.parametrize("value", [None, [], {}, "?", HOSTILE])
def test_a_page_whatever_is_missing(folder: Path, name: str, value: Any) -> None:
    assert changed(folder, **{name: value}).parts


def test_a_page_without_figures_and_with_empty_ones(folder: Path) -> None:
    bare = replace(load(folder), figures={})
    assert not [part for part in chapter_of(bare).parts if isinstance(part, Drawing)]
    empty = {
        name: FigureData(name, {key: column[:0] for key, column in figure.columns.items()}, figure.digits)
        for name, figure in load(folder).figures.items()
    }
    assert chapter_of(replace(load(folder), figures=empty)).parts


def test_without_a_result_the_chapter_says_why(tmp_path: Path) -> None:
    results: FlightResults = example(None, not_assessable=(NotAssessable("magnetic", "no opposite turns"),))
    save(tmp_path, results, Manifest())
    (note,) = chapter(tmp_path).parts
    assert isinstance(note, Note)
    assert note.text == "Not assessable: no opposite turns"
    save(tmp_path, replace(results, not_assessable=()), Manifest())
    assert build(load(tmp_path)) is None
