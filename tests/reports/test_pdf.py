"""The report on paper: everything the page says, nothing of a log taken for markup, nothing outside the page."""

import math
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from pypdf import PdfReader

from groundstation.chapters.parts import Cell, Document, Facts, Front, Grid, Head, Mark, Note, Section
from groundstation.pipeline.many_flights.fleet.publishing import report_again
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.reports import pdf
from groundstation.reports.drawing import Drawing
from groundstation.reports.flight_report import PDF, REPORT
from groundstation.reports.pdf import PdfError, write_pdf
from groundstation.results.files import save
from groundstation.results.flight import FlightResults
from tests.report_example import MANIFEST, example, heading_result
from tests.reports import test_reports as html
from tests.saved import load, write_flight_report
from tests.systems.inertial.example import forecast_result, inertial_result
from tests.told import flight_document

A4_POINTS = (595.3, 841.9)
MARGIN_POINTS = 45.0  # 16 mm
SMALLEST_POINTS = 8.0
LARGEST_PDF_BYTES = 1_500_000
TYPST = (
    '#eval("1+1") #import "@preview/cetz:0.1.0": * #panic("no") $x^2$ *bold* _it_ `raw` <label> @ref \\u{1F600} '
    "// no /* no */ = heading [body] {code} -- ~ https://example.org/path"
)
LONG = "a" * 300


def text_of(reader: PdfReader) -> str:
    return " ".join(" ".join(page.extract_text() for page in reader.pages).split())


def packed(text: str) -> str:
    """Text without spaces: where a line ends is the page's business."""
    return re.sub(r"[\s\u00a0\u202f\u200b]+", "", text)


def paper(folder: Path, results: FlightResults) -> PdfReader:
    save(folder, results, MANIFEST)
    written = write_flight_report(folder, with_pdf=True)
    assert not written.problem
    return PdfReader(folder / PDF)


def grid(rows: int, columns: int) -> Grid:
    heads = (Head("Name of it"), *(Head(f"Column {place}", True) for place in range(1, columns)))
    return Grid("Grid", heads, [(f"row-{row}.", *["123456"] * (columns - 1)) for row in range(rows)], "What it is.")


def document(*parts: Any, label: str = "L1") -> Document:
    return Document("Fleet report", label, Front("A fleet"), (Section("one", "Chapter", "What it answers.", parts),))


@dataclass(frozen=True)
class Paper:
    """A report, its PDF and the text of each page."""

    document: Document
    reader: PdfReader
    pages: tuple[str, ...]
    places: list[tuple[float, float, str]]
    size_bytes: int


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Paper:
    """A flight with every chapter."""
    folder = tmp_path_factory.mktemp("paper")
    results = example(heading_result(), inertial_result(), forecast_result())
    figures = (*results.figures, *inertial_result().figures, *forecast_result().figures)
    save(folder, replace(results, figures=figures), MANIFEST)
    made = flight_document(load(folder))
    write_pdf(made, folder / PDF)
    reader = PdfReader(folder / PDF)
    texts, found = texts_and_places(reader)
    return Paper(made, reader, tuple(" ".join(text.split()) for text in texts), found, (folder / PDF).stat().st_size)


def strings(doc: Document) -> Iterator[str]:
    """Everything a document shows, each as it stands in one place."""
    yield from (doc.front.title, doc.front.headline, *doc.front.sentences)
    yield from (told(value) for pair in doc.front.pairs for value in pair)
    yield from (text for item in doc.front.figures for text in item)
    for section in doc.sections:
        yield from (section.title, section.lead)
        for part in section.parts:
            if isinstance(part, Note):
                yield part.text
                continue
            yield from (part.title, part.caption)
            if isinstance(part, Facts):
                yield from (text for pair in part.pairs for text in pair[: 2 if part.compact else 3])
            if isinstance(part, Grid):
                yield from (head.title for head in part.heads)
                yield from (told(value) for row in part.rows for value in row)


def told(value: Cell) -> str:
    return value if isinstance(value, str) else value.symbol + value.text


def test_paper_says_everything_the_page_says(flight: Paper) -> None:
    text = packed(" ".join(flight.pages))
    assert not [shown for shown in strings(flight.document) if packed(shown) not in text]
    drawings = [part for section in flight.document.sections for part in section.parts if isinstance(part, Drawing)]
    assert len(re.findall(r"Figure\d+\.", text)) == len(drawings) > 15
    assert "tables/heading_samples.csv" in text


def test_the_verdict_with_the_number_to_type_is_on_the_first_page(flight: Paper) -> None:
    first = flight.pages[0]
    assert (
        first.index("Accept") < first.index("Enter −1.05°") < first.index("Parking heading") < first.index("Overview")
    )
    assert "Signature" in first


def test_every_page_is_a4_with_flight_and_number(flight: Paper) -> None:
    for place, (page, text) in enumerate(zip(flight.reader.pages, flight.pages, strict=True), 1):
        assert f"page {place} of {len(flight.pages)}" in text and flight.document.label in text
        assert (float(page.mediabox.width), float(page.mediabox.height)) == pytest.approx(A4_POINTS, abs=0.1)


def test_title_and_outline_are_there_and_no_time(flight: Paper) -> None:
    metadata = flight.reader.metadata or {}
    assert metadata["/Title"] == "Flight report · A12 · flight 17 · Accept"
    assert not {"/CreationDate", "/ModDate"} & set(metadata)
    titles = [item.title for item in flight.reader.outline if not isinstance(item, list)]
    assert titles == [f"{section.number} {section.title}" for section in flight.document.sections]
    assert flight.size_bytes < LARGEST_PDF_BYTES


def texts_and_places(reader: PdfReader) -> tuple[list[str], list[tuple[float, float, str]]]:
    """Text of each page; left edge and size of every piece of text, and the piece."""
    found: list[tuple[float, float, str]] = []

    def visit(text: str, page: list[float], line: list[float], _font: Any, size: float) -> None:
        if text.strip():
            across, up = line[0] * page[0] + line[1] * page[2], line[0] * page[1] + line[1] * page[3]
            left = line[4] * page[0] + line[5] * page[2] + page[4]
            found.append((left, size * math.hypot(across, up), text))

    return [page.extract_text(visitor_text=visit) for page in reader.pages], found


def test_no_text_is_small_or_outside_the_margins(flight: Paper) -> None:
    found = flight.places
    assert len(found) > 500
    assert not [item for item in found if item[1] < SMALLEST_POINTS - 0.001]
    assert not [item for item in found if not MARGIN_POINTS <= item[0] <= A4_POINTS[0] - MARGIN_POINTS]


def test_a_long_table_repeats_its_head_on_every_page(tmp_path: Path) -> None:
    write_pdf(document(grid(200, 4)), tmp_path / PDF)
    pages = [page.extract_text() for page in PdfReader(tmp_path / PDF).pages]
    assert len(pages) > 3 and all("Name of it" in text for text in pages)
    assert sum(len(re.findall(r"row-\d+\.", text)) for text in pages) == 200


@pytest.mark.parametrize("columns", [1, 2, 9, 13, 16, 24])
def test_a_wide_table_stays_on_its_page(tmp_path: Path, columns: int) -> None:
    write_pdf(document(grid(3, columns)), tmp_path / PDF)
    reader = PdfReader(tmp_path / PDF)
    texts, found = texts_and_places(reader)
    assert max(left for left, _, _ in found) < A4_POINTS[0] - MARGIN_POINTS
    assert min(size for _, size, _ in found) >= SMALLEST_POINTS
    assert packed(" ".join(texts)).count("123456") == 3 * (columns - 1)


def test_words_without_a_space_are_broken_and_copied_whole(tmp_path: Path) -> None:
    long = Grid("T", (Head("Topic"), Head("Rows", True), Head("Where")), [(LONG, "1", LONG)])
    write_pdf(document(long, Facts("F", [(LONG, LONG, LONG)]), Note(LONG), label=LONG), tmp_path / PDF)
    reader = PdfReader(tmp_path / PDF)
    text = text_of(reader)
    assert packed(text).count("a" * 300) >= 1 and "\u200b" not in text
    assert max(len(line) for page in reader.pages for line in page.extract_text().split()) < 130


def test_nothing_from_a_log_is_markup(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(html, "HOSTILE", html.HOSTILE + TYPST)
    reader = paper(tmp_path, html.hostile_results())
    text = packed(text_of(reader))
    assert text.count(packed(TYPST)) > 20  # as it was written, everywhere
    assert not [page for page in reader.pages for note in page.get("/Annots", []) if "/URI" in str(note.get_object())]


def test_the_template_reads_and_imports_nothing() -> None:
    template = pdf.TEMPLATE.read_text(encoding="utf-8")
    assert not re.findall(r"\b(?:eval|read|csv|yaml|toml|xml|plugin|datetime)\b\s*[(]", template)
    assert not re.findall(r"#(?:import|include)|@", template)
    assert template.count("json(") == 1 and "json(bytes(sys.inputs.document))" in template


def test_cyrillic_is_shown_and_unknown_scripts_do_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    metadata = {"aircraft": "Як-40 борт 87937", "flight": "рейс 17 «Ёлка»", "note": "日本語 한국어 עברית"}
    reader = paper(tmp_path, replace(example(heading_result()), metadata=metadata))
    assert "Як-40 борт 87937 · flight рейс 17 «Ёлка»" in text_of(reader)
    fonts = {str(font.get_object()["/BaseFont"]) for font in reader.pages[0]["/Resources"]["/Font"].values()}
    assert fonts and all("Libertinus" in name or "DejaVu" in name for name in fonts)


CHANGES = (
    *(html.without_figures, html.with_nan_everywhere, html.with_one_sample),
    *(html.with_empty_columns, html.with_time_alone),
)


@pytest.mark.parametrize("change", CHANGES)
def test_paper_is_made_whatever_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Callable[[FlightResults], FlightResults]
) -> None:
    text = text_of(paper(tmp_path, change(example(heading_result()))))
    assert "nan" not in text.lower().split() and "Heading correction: workings" in text


def test_a_document_may_have_little_in_it(tmp_path: Path) -> None:
    write_pdf(Document("Fleet report", "", Front(""), ()), tmp_path / "bare.pdf")
    assert "page 1 of 1" in text_of(PdfReader(tmp_path / "bare.pdf"))
    empty = (Grid("G", (Head("A"), Head("B", True)), []), Facts("F", ()), Facts("C", (), compact=True), Note(""))
    write_pdf(document(*empty), tmp_path / PDF)
    assert "Chapter" in text_of(PdfReader(tmp_path / PDF))


def test_marks_keep_their_symbol_on_paper(tmp_path: Path) -> None:
    marks = [Mark(tone, "word") for tone in ("good", "bad", "warn", "unknown", "plain")]
    write_pdf(document(Grid("G", (Head("State"),), [(mark,) for mark in marks])), tmp_path / PDF)
    text = packed(text_of(PdfReader(tmp_path / PDF)))
    assert all(shown in text for shown in ("✓word", "✗word", "▲word", "○word"))


# ------------------------------------------------------------------------------------------------ when there is none


class PanicException(BaseException):
    """What a panic in a Rust extension arrives as."""


def broken_typst(error: BaseException) -> ModuleType:
    module = ModuleType("typst")

    def compile(*_: Any, **__: Any) -> bytes:
        raise error

    module.compile = compile  # type: ignore[attr-defined]
    return module


@pytest.mark.parametrize(
    "typst", [None, broken_typst(RuntimeError("line 1\nline 2")), broken_typst(PanicException("index out of range"))]
)
def test_without_typst_the_page_is_there_and_one_line_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, typst: ModuleType | None
) -> None:
    save(tmp_path, html.without_figures(example(heading_result())), MANIFEST)
    assert write_flight_report(tmp_path, with_pdf=True).paths[1].is_file()
    monkeypatch.setitem(sys.modules, "typst", typst)
    written = write_flight_report(tmp_path, with_pdf=True)
    assert [path.name for path in written.paths] == [REPORT]
    assert "report.pdf: not written, typst" in written.problem and "\n" not in written.problem
    assert not (tmp_path / PDF).exists()  # the old one told of other results


def test_other_errors_are_not_swallowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "typst", broken_typst(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        write_pdf(document(), tmp_path / PDF)


def test_a_template_that_cannot_be_set_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "broken.typ"
    broken.write_text('#read("/etc/passwd")', encoding="utf-8")
    monkeypatch.setattr(pdf, "TEMPLATE", broken)
    with pytest.raises(PdfError, match=r"report\.pdf: not written, typst failed"):
        write_pdf(document(), tmp_path / PDF)


@pytest.mark.slow
def test_a_report_makes_the_pdf_of_the_run_again_and_one_line_says_why_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, out = Path(__file__).parents[2] / "sample_logs" / "taxi-short.csv", tmp_path / "out"
    (outcome,) = run_many([log], out, Configuration(), with_pdf=True)
    made = Path(outcome.folder) / PDF
    first = made.read_bytes()
    done = report_again(out, with_pdf=True)
    assert made in done.written and not done.problems and not done.removed and made.read_bytes() == first
    monkeypatch.setitem(sys.modules, "typst", None)
    problem, of_fleet = report_again(out, with_pdf=True).problems
    assert problem.code == of_fleet.code == 0 and "summary.pdf: not written" in of_fleet.text
    assert problem.text.startswith(f"{made.parent.name}: report.pdf: not written")
    outcome, _ = run_many([log], out, Configuration(), with_pdf=True)
    assert outcome.state == "done" and "report.pdf: not written, typst failed" in outcome.text
