"""The flight report: safe with hostile logs, equal bytes for equal input, useful whatever is missing."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields, replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.clock import Clock
from groundstation.base.errors import UnreadableLogError
from groundstation.base.findings import Finding
from groundstation.base.ledger import DamageEntry, Ledger, ThresholdsUsed, Truncation
from groundstation.reports.flight_report import PDF, REPORT, flight_report_html
from groundstation.reports.page import digest_of
from groundstation.results.answer import by_analysis
from groundstation.results.figures import FigureData
from groundstation.results.files import save
from groundstation.results.flight import FlightResults, NotAssessable, Source
from groundstation.results.gates import Gate
from groundstation.systems.heading.answer import HeadingResult
from tests.report_example import MANIFEST, example, figure, heading_result
from tests.saved import load, write_flight_report
from tests.systems.inertial.example import forecast_result, inertial_result
from tests.told import flight_document

LARGEST_REPORT_BYTES = 2_000_000  # mailed and opened on old machines
LARGEST_LONG_REPORT_BYTES = 3_000_000  # with the figures of INS errors and forecast
VOID = {"meta", "col", "link", "br", "hr", "img", "input", "path", "use"}
HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(1)>=cmd|' /C calc'!A0&amp;{{7*7}}$\\frac$-->]]>"


class Page(HTMLParser):
    """Elements, attributes and text of a page; refuses tags that do not balance."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.texts: list[str] = []
        self.scripts: list[str] = []
        self.feed(html)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open and self.open.pop() == tag, f"</{tag}> closes nothing"

    def handle_data(self, data: str) -> None:
        (self.scripts if self.open[-1:] == ["script"] else self.texts).append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())


def report(folder: Path, results: FlightResults) -> str:
    save(folder, results, MANIFEST)
    write_flight_report(folder, with_pdf=False)
    return (folder / REPORT).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> str:
    return report(tmp_path_factory.mktemp("full"), example(heading_result()))


def runs_our_script_alone(page: Page) -> bool:
    """Whether a page runs the script that its policy names by digest, and nothing else."""
    policy = next(value for tag, name, value in page.attributes if tag == "meta" and name == "content")
    kinds = [value for tag, name, value in page.attributes if tag == "script" and name == "type"]
    data, script = page.scripts
    json.loads(data)
    allowed = re.findall("script-src '([^']*)'", policy)
    return (
        page.tags.count("script") == 2
        and kinds == ["application/json"]
        and allowed == [f"sha256-{digest_of(script)}"]
        and not [name for _, name, _ in page.attributes if name.startswith("on")]
    )


def test_report_is_a_balanced_page_that_loads_nothing_and_runs_its_own_script_alone(full: str) -> None:
    page = Page(full)
    assert runs_our_script_alone(page)
    policy = next(value for tag, name, value in page.attributes if tag == "meta" and name == "content")
    assert policy.startswith("default-src 'none'") and "unsafe-eval" not in policy
    links = [value for _, name, value in page.attributes if name in ("href", "src", "xlink:href", "action")]
    assert not [link for link in links if re.match(r"[a-z]+:|//", link)]
    without_names = full.replace("http://www.w3.org/2000/svg", "").replace("http://www.w3.org/1999/xlink", "")
    assert "://" not in without_names and "@import" not in full
    assert not [url for url in re.findall(r"url\(([^)]*)\)", full) if not url.startswith("#")]


def test_names_inside_the_page_are_unique_and_links_lead_somewhere(full: str) -> None:
    page = Page(full)
    names = [value for _, name, value in page.attributes if name == "id"]
    assert len(names) == len(set(names))
    inside = [value[1:] for _, name, value in page.attributes if name in ("href", "xlink:href") and value[:1] == "#"]
    assert set(inside) <= set(names)
    assert set(re.findall(r"url\(#([^)]*)\)", full)) <= set(names)


def links_of(page: Page) -> list[str]:
    """Links to other files."""
    return [value for tag, name, value in page.attributes if tag == "a" and name == "href" and value[:1] != "#"]


def test_links_to_tables_exist(tmp_path: Path) -> None:
    links = links_of(Page(report(tmp_path, example(heading_result()))))
    assert "tables/heading_samples.csv" in links and "manifest.json" in links
    assert all((tmp_path / link).is_file() for link in links)


def test_every_figure_has_title_caption_and_text_for_those_who_cannot_see_it(full: str) -> None:
    page = Page(full)
    assert page.tags.count("figure") == page.tags.count("figcaption") == 12
    described = [value for _, name, value in page.attributes if name == "aria-label" and value]
    assert len(described) >= 10
    assert page.tags.count("title") == 1 and page.tags.count("h1") == 1


def test_report_is_small_enough(full: str) -> None:
    assert len(full.encode()) < LARGEST_REPORT_BYTES


def test_long_flights_are_thinned(tmp_path: Path) -> None:
    short, heading = example(heading_result()), heading_result()
    samples = heading.figures[0]
    many = {name: np.tile(values, 40) for name, values in samples.columns.items()}
    many["time_s"] = np.arange(len(many["time_s"])) * 0.1
    longer = FigureData(samples.name, many, samples.digits)
    others = tuple(item for item in short.figures if item.name != samples.name)
    assert len(report(tmp_path, replace(short, figures=(*others, longer))).encode()) < LARGEST_REPORT_BYTES


def test_verdict_stands_first_with_the_number_to_type(full: str) -> None:
    page = Page(full)
    text = page.text
    assert text.index("Accept") < text.index("Enter −1.05°") < text.index("reads too high by 1.04°")
    assert text.index("Enter −1.05°") < text.index("Gates")


def test_states_of_gates_are_symbols_and_words(full: str) -> None:
    text = Page(full).text.replace("\u202f", " ")
    for shown in ("✓ passed", "▲ failed", "○ not measured", "≤ 0.01 m/s", "≥ 20 s"):
        assert shown in text, shown


def test_flight_without_heading_says_why_and_shows_the_rest(tmp_path: Path) -> None:
    reasons = (NotAssessable("heading", "no GNSS velocity in the log"),)
    page = Page(report(tmp_path, example(None, not_assessable=reasons)))
    front = page.text[: page.text.index("1 Overview of the flight")]
    assert (
        "No answer" not in front and "Recorded" in front and "Heading correction no GNSS velocity in the log" in front
    )
    assert page.text.count("no GNSS velocity in the log") == 1, "told once"
    assert page.tags.count("figure") == 5
    assert "Signature" not in page.text


def test_report_holds_nothing_of_the_run_itself(full: str) -> None:
    assert "2031-01-02" not in full and "somewhere" not in full  # time and host of the manifest


def hostile_results() -> FlightResults:
    ledger = next(item for item in example().figures if item.name == "ledger")
    topics = np.array([HOSTILE, "日本語\u202eabc\x07", "a" * 300, *ledger["topic"][3:]])
    figures = (
        FigureData("ledger", {**ledger.columns, "topic": topics}, {}),
        figure("phases", start_s=[0.0], end_s=[10.0], phase=[HOSTILE]),
        figure("gnss_lanes", start_s=[0.0], end_s=[10.0], state=[HOSTILE]),
        figure("state_lanes", lane=["mode"], start_s=[0.0], end_s=[10.0], state=[HOSTILE]),
        figure("gaps", topic=[HOSTILE], start_s=[1.0], length_s=[2.0]),
        next(item for item in example().figures if item.name == "overview"),
    )
    heading = heading_result(
        verdict_reason=HOSTILE,
        heading_source=HOSTILE,
        ins_topic=HOSTILE,
        settings={HOSTILE: HOSTILE},
        gates=(Gate(HOSTILE, HOSTILE, 1.0, 2.0, HOSTILE, "failed", True, HOSTILE),),
    )
    return FlightResults(
        flight_id=HOSTILE,
        source=Source(HOSTILE + "\udcff\u202e", HOSTILE, 1, HOSTILE),
        metadata={"aircraft": HOSTILE, "flight": HOSTILE + "\x00", HOSTILE: HOSTILE, "-": "=1+1"},
        start_utc_ns=None,
        duration_s=10.0,
        status="ok",
        ledger=Ledger(
            damages=(DamageEntry(kind=HOSTILE, what=HOSTILE, topic=HOSTILE, place=HOSTILE, count=1, loses_data=True),),
            thresholds=ThresholdsUsed(name=HOSTILE, sha256=HOSTILE),
            truncated=Truncation(place=HOSTILE, what=HOSTILE, count=1),
        ),
        clock=Clock(first_device_time=HOSTILE),
        findings=(Finding("fail", HOSTILE, HOSTILE, HOSTILE, HOSTILE, 3),),
        not_assessable=(NotAssessable(HOSTILE, HOSTILE),),
        answers=by_analysis(heading),
        figures=(*figures, *heading.figures),
    )


def test_nothing_from_a_log_becomes_markup(tmp_path: Path) -> None:
    html = report(tmp_path, hostile_results())
    page = Page(html)
    assert runs_our_script_alone(page) and "img" not in page.tags
    assert "<script>alert(1)</script>" in page.text  # shown as it was written
    assert "{{7*7}}" in page.text
    assert not [mark for mark in "\x00\x07\u202e" if mark in html]
    style = html[html.index("<style>") : html.index("</style>")]
    assert re.search(r'bottom-left \{ content: "[A-Za-z0-9_-]*"; \} \}\s*$', style) and "<" not in style[7:]


@pytest.mark.slow  # test_run.py tells it of a sample log
def test_equal_input_gives_equal_bytes_in_any_process(tmp_path: Path) -> None:
    save(tmp_path, example(heading_result()), MANIFEST)
    files = write_flight_report(tmp_path, with_pdf=True).paths
    assert [path.name for path in files] == [REPORT, PDF]
    first = [path.read_bytes() for path in files]
    (tmp_path / "manifest.json").write_text(
        (tmp_path / "manifest.json").read_text().replace("2031", "2044"), encoding="utf-8"
    )
    code = (
        "import sys; from pathlib import Path; from tests.saved import write_flight_report;"
        "write_flight_report(Path(sys.argv[1]), with_pdf=True)"
    )
    matplotlibrc = tmp_path / "matplotlibrc"
    matplotlibrc.write_text("lines.linewidth: 7\nsvg.hashsalt: other\nfont.size: 20\n")
    environment = {**os.environ, "PYTHONHASHSEED": "1", "MATPLOTLIBRC": str(matplotlibrc), "TZ": "Asia/Tokyo"}
    environment |= {"RAYON_NUM_THREADS": "1", "SOURCE_DATE_EPOCH": "1700000000"}
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True, env=environment)
    assert [path.read_bytes() for path in files] == first


def without_figures(results: FlightResults) -> FlightResults:
    return replace(results, figures=())


def with_nan_everywhere(results: FlightResults) -> FlightResults:
    figures = []
    for item in results.figures:
        columns = {
            name: np.full(len(values), np.nan) if values.dtype.kind == "f" else values
            for name, values in item.columns.items()
        }
        figures.append(FigureData(item.name, columns, item.digits))
    heading = results.answer(HeadingResult)
    assert heading is not None
    unknown = {item.name: float("nan") for item in fields(heading) if isinstance(getattr(heading, item.name), float)}
    unknown.pop("entry_step_deg")
    gone = replace(heading, **unknown, confidence95_deg=(float("nan"), float("nan")))
    return replace(results, answers=by_analysis(gone), duration_s=float("nan"), figures=tuple(figures))


def with_one_sample(results: FlightResults) -> FlightResults:
    figures = [
        FigureData(item.name, {name: values[:1] for name, values in item.columns.items()}, item.digits)
        for item in results.figures
    ]
    return replace(results, figures=tuple(figures))


def with_empty_columns(results: FlightResults) -> FlightResults:
    figures = [
        FigureData(item.name, {name: values[:0] for name, values in item.columns.items()}, item.digits)
        for item in results.figures
    ]
    return replace(results, figures=tuple(figures))


def with_time_alone(results: FlightResults) -> FlightResults:
    figures = [FigureData(item.name, dict(list(item.columns.items())[:1]), item.digits) for item in results.figures]
    return replace(results, figures=tuple(figures))


@pytest.mark.parametrize(
    "change", [without_figures, with_nan_everywhere, with_one_sample, with_empty_columns, with_time_alone]
)
def test_report_is_written_whatever_is_missing(
    tmp_path: Path, change: Callable[[FlightResults], FlightResults]
) -> None:
    page = Page(report(tmp_path, change(example(heading_result()))))
    assert "nan" not in page.text.lower().split() and "None" not in page.text
    assert page.tags.count("h2") >= 4


def test_each_figure_alone_makes_a_report(tmp_path: Path) -> None:
    results = example(heading_result())
    for item in results.figures:
        page = Page(report(tmp_path, replace(results, figures=(item,))))
        assert page.tags.count("figure") <= 4, item.name
        assert [link for link in links_of(page) if not (tmp_path / link).is_file()] == [], item.name


def test_bare_results_give_a_report(tmp_path: Path) -> None:
    bare = FlightResults("NOTIME_00000000", Source("a.csv", "00" * 32, 0, "flat-csv"), {}, None, 0.0, "failed")
    text = Page(report(tmp_path, bare)).text
    assert "failed: nothing could be computed" in text and "No warnings." in text


def test_a_summary_that_cannot_be_read_is_refused_in_one_line(tmp_path: Path) -> None:
    save(tmp_path, example(heading_result()), MANIFEST)
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    summary["results"]["heading"]["gates"][0]["limit"] = "wide"
    (tmp_path / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    with pytest.raises(UnreadableLogError, match=r"summary\.json.*gates\[0\]\.limit.*run the log again") as refused:
        write_flight_report(tmp_path)
    assert "\n" not in str(refused.value) and not (tmp_path / REPORT).exists()


def test_folder_without_results_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnreadableLogError, match=r"summary\.json"):
        write_flight_report(tmp_path)
    assert not (tmp_path / REPORT).exists()


def test_modes_and_states_stand_in_a_figure(full: str) -> None:
    assert "Modes and states" in full and "ground contact by its weight on wheels" in full


def test_every_chapter_has_its_own_anchor(tmp_path: Path) -> None:
    results = example(heading_result(), inertial_result(), forecast_result())
    save(tmp_path, results, MANIFEST)
    document = flight_document(load(tmp_path))
    keys = [section.key for section in document.sections]
    assert len(set(keys)) == len(keys) > 5
    assert "Contents" in flight_report_html(document)


def test_a_report_with_ins_errors_and_forecast_is_whole_and_small_enough(tmp_path: Path) -> None:
    html = report(tmp_path, example(inertial_result(), forecast_result()))
    page = Page(html)
    assert len(html.encode()) < LARGEST_LONG_REPORT_BYTES
    for title in ("Position error of the INS", "Hindcast map", "States", "Skill by method and horizon"):
        assert title in page.text, title
    assert "nan" not in page.text.lower().split() and "None" not in page.text
    links = {value for tag, name, value in page.attributes if tag == "a" and name == "href"}
    assert {f"tables/{name}.csv" for name in ("inertial_states", "forecast_map", "forecast_growth")} <= links


def test_settings_are_those_that_the_user_set(tmp_path: Path, full: str) -> None:
    assert "Settings: [heading]" not in full  # all as shipped; summary.json has them
    save(tmp_path, example(heading_result()), replace(MANIFEST, configuration={"heading": {"taxi_speed_min_mps": 6.0}}))
    write_flight_report(tmp_path, with_pdf=False)
    page = (tmp_path / REPORT).read_text(encoding="utf-8")
    assert "Settings: [heading]" in page and page.count("_min_mps</dt>") == 1


def test_texts_of_ins_errors_and_forecast_are_escaped(tmp_path: Path) -> None:
    inertial = inertial_result(
        ins_topic=HOSTILE, kind_reason=HOSTILE, ins_class=HOSTILE, settings={HOSTILE: HOSTILE}, figures=()
    )
    forecast = forecast_result(calibration_reason=HOSTILE, is_calibrated=False, figures=())
    page = Page(report(tmp_path, example(inertial, forecast)))
    assert runs_our_script_alone(page) and "img" not in page.tags
    assert page.text.count("<script>alert(1)</script>") >= 4
