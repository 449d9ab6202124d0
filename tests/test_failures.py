"""One part of a flight that fails by a defect: the rest is there, and finding, report and exit code tell."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn, cast

import pytest
import rerun.blueprint as rrb

from groundstation.base.failures import Failure, attempt, failures, gathered_failures, reason_of
from groundstation.base.ledger import Ledger
from groundstation.chapters import by_answer
from groundstation.chapters.chapter import Chapters
from groundstation.chapters.parts import Figure, Note, Section
from groundstation.chapters.plots.acceptance import JUDGED
from groundstation.chapters.plots.comparison import COMPARED, Compared
from groundstation.cli.main import main
from groundstation.pipeline.many_flights.fleet import publishing
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight import analyse as analysing
from groundstation.pipeline.one_flight import flight as running
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.reports import comparison, drawing, fleet_report, sections
from groundstation.reports.drawing import drawn_by
from groundstation.results.answer import Answer, PlanAnswer
from groundstation.results.files import load_document, put_failures, save
from groundstation.results.flight import FlightResults
from groundstation.systems import systems
from groundstation.systems.analysis import Analysis
from groundstation.systems.system import Tab
from groundstation.tables.table import Flight
from groundstation.viewer import comparison as viewer_comparison
from groundstation.viewer import fleet as viewer_fleet
from groundstation.viewer import plan as viewer_plan
from groundstation.viewer import recording
from groundstation.viewer.recorder import Recorder
from tests.recording_contents import Contents
from tests.report_example import MANIFEST, example, heading_result
from tests.saved import load, write_flight_report
from tests.told import PLOTS, answer_chapters, flight_document, flight_sections, shipped_but, write_recording
from tests.viewer_example import make_flight, make_results

SAMPLE = Path(__file__).parents[1] / "sample_logs" / "taxi-short.csv"
ANSWERED = example(heading_result())
SHORT = make_flight(240.0, 5.0)
REASON = "internal error (ZeroDivisionError: of this test); please report it"


def fails(*_: Any, **__: Any) -> NoReturn:
    raise ZeroDivisionError("of this test")


def codes() -> list[str]:
    return [failure.code for failure in failures()]


# ------------------------------------------------------------------------------------------------ gathering


def test_where_nobody_gathers_an_error_is_raised_as_it_is() -> None:
    with pytest.raises(ZeroDivisionError, match="of this test"):
        attempt("figure", "a", fails)


@pytest.mark.parametrize(
    "error", [MemoryError(), OSError(28, "No space left on device"), KeyError("a"), ValueError("a\n\x1b[2Jb" * 200)]
)
def test_any_error_is_one_short_line_that_shows(error: Exception) -> None:
    def raises() -> NoReturn:
        raise error

    with gathered_failures():
        assert attempt("tab", "a", raises) is None
        (failure,) = failures()
    assert failure.text.isprintable() and len(failure.text) < 500
    assert failure.text.startswith("the tab a is left out: ") and type(error).__name__ in failure.trace


def test_a_panic_of_a_library_is_a_failure_and_an_interrupt_is_none() -> None:
    panic = type("PanicException", (BaseException,), {})

    def panics() -> NoReturn:
        raise panic("of this test")

    def interrupted() -> NoReturn:
        raise KeyboardInterrupt

    with gathered_failures():
        assert attempt("tab", "a", panics) is None and codes() == ["internal.tab.a"]
        with pytest.raises(KeyboardInterrupt):
            attempt("tab", "b", interrupted)
        with pytest.raises(OSError, match="full"):
            attempt("tab", "c", lambda: (_ for _ in ()).throw(OSError("full")), unless=(OSError,))
    assert failures() == ()


def test_each_failure_is_told_once() -> None:
    with gathered_failures():
        attempt("chapter", "a", fails)
        with gathered_failures():
            attempt("chapter", "a", fails)
        assert codes() == ["internal.chapter.a"]


# ------------------------------------------------------------------------------------------------ analyses


def bare() -> Flight:
    """A flight on which no analysis finds what it needs: they are through at once."""
    return replace(SHORT, tables={"discrete": SHORT["discrete"]})


def changed(listed: tuple[Analysis, ...], name: str, **parts: Callable[..., Any]) -> tuple[Analysis, ...]:
    return tuple(replace(one, **parts) if one.name == name else one for one in listed)


@pytest.mark.parametrize("part", ["run", "applies"])
@pytest.mark.parametrize("name", [one.name for one in systems().analyses])
def test_an_analysis_that_fails_leaves_the_others(name: str, part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    flight = bare()
    before = analysing.answers_of(flight, Configuration())[0]
    requires = {one.name: {*one.requires} for one in systems().analyses}
    always: dict[str, Any] = {"requires": (), "applies": lambda *_: True}
    with_it = changed(systems().analyses, name, **(always if part == "run" else {}), **{part: fails})
    monkeypatch.setattr(analysing, "systems", lambda: shipped_but(analyses=with_it))
    with pytest.raises(ZeroDivisionError):
        analysing.answers_of(flight, Configuration())
    with gathered_failures():
        found = analysing.answers_of(flight, Configuration())[0]
        assert codes() == [f"internal.analysis.{name}"]
    (finding,) = found.findings[name]
    assert (finding.severity, finding.code) == ("warn", f"internal.analysis.{name}")
    assert finding.text == f"the analysis {name} is left out: {REASON}"
    assert found.reasons[name] == REASON
    kept = [one for one in before.reasons if one != name and name not in requires[one]]
    assert {one: found.reasons[one] for one in kept} == {one: before.reasons[one] for one in kept}


@pytest.mark.parametrize("name", [one.name for one in systems().session_analyses])
def test_an_analysis_of_a_session_that_fails_leaves_the_others(name: str) -> None:
    from groundstation.systems.known import SessionKnown

    known = SessionKnown(settings=Configuration().settings.analyses)
    with gathered_failures():
        found = analysing.run_analyses(changed(systems().session_analyses, name, run=fails), None, known)
    assert [one.analysis for one in found.not_assessable] == [name] and found.reasons[name] == REASON


@pytest.mark.parametrize("name", [one.name for one in systems().analyses])
def test_damage_checks_lines_and_columns_that_fail_leave_the_rest(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    results = replace(ANSWERED, answers={})
    with_it = changed(systems().analyses, name, sentence=fails)
    monkeypatch.setattr(running, "systems", lambda: shipped_but(analyses=with_it))
    with gathered_failures():
        assert running.sentence(results).startswith("no signals; nothing lost; not assessable")
        assert codes() == [f"internal.line.{name}"]
    monkeypatch.setattr(analysing, "_on_damage", fails)
    flight = bare()
    given = analysing.Given("NOTIME_01234567", results.source, Ledger(), results.clock, (), False)
    with gathered_failures():
        done = analysing.analyse(flight, given, Configuration())
        assert f"internal.damage_check.{name}" in codes() and len(codes()) == len(systems().analyses)
    assert done.figure("phases") is not None


# ------------------------------------------------------------------------------------------------ figures


@pytest.mark.parametrize(
    ("plots", "name"),
    [(one, name) for one in (PLOTS, systems().fleet_plots, JUDGED) for name in one],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_a_figure_that_cannot_be_drawn_leaves_the_rest_of_its_chapter(plots: dict[str, Any], name: str) -> None:
    plots = {**plots, name: fails}
    section = Section("a", "A", "", (Note("before"), Figure(name), Figure(name, "one"), Note("behind")))
    with gathered_failures():
        assert drawn_by(plots, section, None).parts == (Note("before"), Note("behind"))
        assert codes() == [f"internal.figure.{name}", f"internal.figure.{name}.one"]


# ------------------------------------------------------------------------------------------------ chapters


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place: Path = tmp_path_factory.mktemp("flight")
    save(place, ANSWERED, MANIFEST)
    return place


OF_A_FLIGHT = [
    *(("BEFORE_THE_ANSWERS", name) for name in sections.BEFORE_THE_ANSWERS),
    *(("ON_THE_DATA", name) for name in sections.ON_THE_DATA),
    *(("APPENDICES", name) for name in sections.APPENDICES),
]


@pytest.mark.parametrize(("where", "name"), OF_A_FLIGHT)
def test_a_chapter_on_a_flight_that_fails_leaves_the_others(
    where: str, name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(getattr(sections, where), name, fails)
    with gathered_failures():
        found = flight_sections(load(folder))
        assert codes() == [f"internal.chapter.{name}"]
    assert len(found) > 5 and "heading" in {one.key for one in found}


@pytest.mark.parametrize("kind", ["flight", "session", "plan"])
def test_a_chapter_on_an_answer_that_fails_leaves_the_others(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    every = getattr(systems().chapters, kind)
    if kind != "flight":
        monkeypatch.setattr(FlightResults, f"is_{kind}", True)
    for failing in every:
        whole = tuple(one._replace(build=_named(one)) for one in every)
        shown = [one.key for one in by_answer.chapters_of(ANSWERED, Chapters(**{kind: whole}))]
        broken = tuple(one._replace(build=fails if one is failing else _named(one)) for one in every)
        with gathered_failures():
            found = by_answer.chapters_of(ANSWERED, Chapters(**{kind: broken}))
            assert codes() == [f"internal.chapter.{failing.name}"]
        assert [one.key for one in found] == [key for key in shown if key != failing.name]


def _named(chapter: Any) -> Callable[[Any], Section]:
    return lambda _: Section(chapter.name, chapter.name, "")


def test_a_generic_chapter_a_front_and_a_page_that_fail_leave_the_rest(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from groundstation.reports import flight_report

    monkeypatch.setattr(by_answer, "generic", fails)
    other = type("Other", (Answer,), {"analysis": "other", "figures": ()})
    results = replace(ANSWERED, answers={"other": other()})
    with gathered_failures():
        assert answer_chapters(results) == () and codes() == ["internal.chapter.other"]
    monkeypatch.setattr(flight_report, "front", fails)
    with gathered_failures():
        document = flight_document(load(folder))
        assert document.front.title == ANSWERED.flight_id and len(document.sections) > 5
        whole = flight_report.flight_report_html(document)
        assert f"<h1>{ANSWERED.flight_id}</h1>" in whole and 'class="verdict' not in whole
        page = tmp_path / "report.html"
        page.write_text("of an earlier run", encoding="utf-8")
        flight_report.write_pages(page, fails, document, document, with_pdf=False)
        assert codes() == ["internal.chapter.front", "internal.report.report.html"] and not page.exists()


@pytest.mark.parametrize("name", [one.key for one in systems().fleet_chapters])
def test_a_chapter_on_a_fleet_that_fails_leaves_the_others(
    name: str, fleet: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = fleet_report.fleet_document(fleet, systems())
    _break_fleet_chapter(name, monkeypatch)
    with gathered_failures():
        found = fleet_report.fleet_document(fleet, systems())
        assert codes() == [f"internal.chapter.{name}"]
    assert len(whole.sections) - len(found.sections) in (0, 1) and len(found.sections) > 2


def _break_fleet_chapter(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    told = (one._replace(build=fails) if one.key == name else one for one in systems().fleet_chapters)
    monkeypatch.setitem(vars(systems()), "fleet_chapters", tuple(told))  # a cached property


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Any:
    from groundstation.pipeline.many_flights.fleet.statistics import gather
    from tests.fleet_example import save_flight

    out: Path = tmp_path_factory.mktemp("fleet")
    for number in range(2):
        save_flight(out, number)
    return gather(out)


# ------------------------------------------------------------------------------------------------ recordings


def empty(name: str) -> Callable[..., rrb.Container]:
    return lambda *_: rrb.Vertical(name=name)


OF_PLANS: dict[str, Any] = dict.fromkeys(tab.shows[0] for tab in systems().tabs_of(PlanAnswer))
NAMES = [name for name, _ in recording.tabs_of(Recorder(None, 0, False, systems()), None, make_results(SHORT))]  # type: ignore[arg-type]


@pytest.mark.parametrize("failing", [*NAMES, "log"])
def test_a_tab_of_a_flight_that_fails_leaves_the_others(
    failing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    layout = recording.send_layout
    monkeypatch.setattr(recording, "send_layout", lambda stream, tabs, **_: shown.extend(one.name for one in tabs))
    named = recording.tabs_of

    def tabs(*given: Any) -> Iterator[Any]:
        for name, _tab in named(*given):
            yield name, fails if name == failing else empty(name)

    monkeypatch.setattr(recording, "tabs_of", tabs)
    monkeypatch.setattr(recording, "log", fails if failing == "log" else empty("log"))
    flight = SHORT
    with gathered_failures():
        write_recording(tmp_path / "a.rrd", flight, make_results(flight))
        assert codes() == [f"internal.tab.{failing}"]
    assert shown == [name for name in (*NAMES, "log") if name != failing] and layout is not None


@pytest.mark.parametrize(
    ("tabs", "name"),
    [(one, name) for one in (viewer_fleet.TABS, viewer_fleet.TABS_BEHIND, OF_PLANS) for name in one],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_a_tab_of_another_recording_that_fails_leaves_the_others(
    tabs: dict[str, Any], name: str, fleet: Any, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = {one: fails if one == name else empty(one) for one in tabs}
    if tabs is not OF_PLANS:
        for one, tab in made.items():
            monkeypatch.setitem(tabs, one, tab)
    path = tmp_path / "a.rrd"
    with gathered_failures():
        if tabs in (viewer_fleet.TABS, viewer_fleet.TABS_BEHIND):
            viewer_fleet.write_fleet_recording(path, fleet, systems())
        else:
            planned = shipped_but(tabs=tuple(Tab((one,), tab) for one, tab in made.items()))
            viewer_plan.write_plan_recording(path, replace(ANSWERED, answers={}, figures=()), planned)
        assert codes() == [f"internal.tab.{name}"]
    assert path.is_file()


@pytest.mark.parametrize("name", ["overview", "heading", "inertial"])
def test_a_tab_of_a_comparison_that_fails_leaves_the_others(
    name: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name == "overview":
        monkeypatch.setattr(viewer_comparison, "_overview", fails)
    broken = tuple(
        Compared(one, one, {"a": fails if one == name else lambda _: None}, (("a",),))
        for one in ("heading", "inertial")
    )
    saved, path = load(folder), tmp_path / "a.rrd"
    with gathered_failures():
        viewer_comparison.write_comparison(
            path,
            _compared(folder),
            saved,
            saved,
            systems() if name == "overview" else shipped_but(compared=broken),
        )
        assert codes() == [f"internal.tab.{name}"]
    assert path.is_file()


def _compared(folder: Path) -> Any:
    from groundstation.pipeline.verbs.compare import compare

    return compare(folder, folder, None)[0]


def test_a_figure_of_a_comparison_that_fails_leaves_the_others(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    saved, compared = load(folder), _compared(folder)
    for figures in (COMPARED, *(one.figures for one in systems().compared)):
        for name in figures:
            with monkeypatch.context() as patch, gathered_failures():
                patch.setitem(cast(dict[str, Any], figures), name, fails)
                assert "Answers" in comparison.comparison_html(compared, saved, saved, systems())
                assert codes() == [f"internal.figure.{name}"]


# ------------------------------------------------------------------------------------------------ a whole run


def break_five(monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """Make an analysis, a plot, the picture of one, a chapter and a tab fail; the codes in their order."""
    with_it = changed(systems().analyses, "latency", run=fails, requires=())
    monkeypatch.setattr(analysing, "systems", lambda: shipped_but(analyses=with_it))
    monkeypatch.setitem(PLOTS, "overview.profile", fails)
    write = drawing.picture_of
    monkeypatch.setattr(drawing, "picture_of", lambda plot: fails() if plot.name == "overview.track" else write(plot))
    monkeypatch.setitem(sections.BEFORE_THE_ANSWERS, "next_steps", fails)
    monkeypatch.setattr(recording, "raw", fails)
    return (
        "internal.analysis.latency",
        "internal.tab.raw",
        "internal.chapter.next_steps",
        "internal.figure.overview.track",
        "internal.figure.overview.profile",
    )


def test_a_run_with_failures_has_all_else_tells_and_is_mended_by_the_next(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out, whole = tmp_path / "out", tmp_path / "whole"
    with monkeypatch.context() as patch:
        expected = break_five(patch)
        with pytest.raises(SystemExit) as ended:
            main(["run", str(SAMPLE), "-o", str(out), "-j", "1", "--no-pdf"])
    printed = capsys.readouterr()
    assert ended.value.code == 1
    assert "  incomplete  2026" in printed.out
    lines = [line for line in printed.err.splitlines() if line.startswith("error: ")]
    assert [line.partition(" is left out: ")[2] for line in lines] == [REASON] * 5
    assert "Traceback" not in printed.err
    (place,) = (path.parent for path in out.glob("*/summary.json"))
    findings = load_document(place).findings
    told = {finding.code: finding for finding in findings if finding.code.startswith("internal.")}
    assert set(told) == set(expected) and {one.severity for one in told.values()} == {"warn"}
    assert list(told) == list(expected), "in the order of their making"
    page = (place / "report.html").read_text(encoding="utf-8")
    for finding in told.values():
        assert finding.text in page
    assert 'id="quality' in page and 'id="heading' in page and 'id="next' not in page
    contents = Contents(place / f"{place.name}.rrd")
    assert "the tab raw is left out" in contents.text("/log/by_gravity") and not any(
        entity.startswith("/raw/") for entity in contents.batches
    )

    (outcome,) = run_many([SAMPLE], out, Configuration(), jobs=1, with_pdf=False)
    assert (outcome.state, outcome.failures, outcome.was_finished) == ("done", (), False)
    run_many([SAMPLE], whole, Configuration(), jobs=1, with_pdf=False)
    for name in ("summary.json", "report.html", "tables/overview.csv"):
        assert (place / name).read_bytes() == (whole / place.name / name).read_bytes(), name


def test_a_report_made_again_tells_what_fails_now_and_no_longer_what_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save(tmp_path, ANSWERED, MANIFEST)
    put_failures(tmp_path, [Failure("tab", "raw", "old"), Failure("figure", "heading.taxi", "old")])
    before = (tmp_path / "summary.json").read_bytes()
    with monkeypatch.context() as patch:
        patch.setitem(PLOTS, "heading.taxi", fails)
        assert [one.code for one in write_flight_report(tmp_path, with_pdf=False).failures] == [
            "internal.figure.heading.taxi"
        ]
    codes_now = [one.code for one in load_document(tmp_path).findings if one.code.startswith("internal.")]
    assert codes_now == ["internal.tab.raw", "internal.figure.heading.taxi"]
    assert write_flight_report(tmp_path, with_pdf=False).failures == ()
    codes_now = [one.code for one in load_document(tmp_path).findings if one.code.startswith("internal.")]
    assert codes_now == ["internal.tab.raw"], "reports make no recording"
    assert (tmp_path / "summary.json").read_bytes() != before


def test_a_summary_without_failures_is_left_as_it_is(tmp_path: Path) -> None:
    save(tmp_path, ANSWERED, MANIFEST)
    before = (tmp_path / "summary.json").stat().st_mtime_ns
    assert not put_failures(tmp_path, (), ("figure",))
    assert (tmp_path / "summary.json").stat().st_mtime_ns == before
    one = Failure("figure", "a", reason_of(ValueError("at 0x7f0000000000")))
    assert put_failures(tmp_path, [one]) and not put_failures(tmp_path, [one])
    assert re.search(r"ValueError: at 0x\.\.\.\)", (tmp_path / "summary.json").read_text(encoding="utf-8"))


def test_a_plan_with_failures_has_all_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.pipeline.verbs.plan import run_plan
    from tests.systems.planning.test_plan import scenario

    tabs = tuple(tab._replace(log=fails) if "placement" in tab.shows else tab for tab in systems().tabs)
    monkeypatch.setitem(systems().__dict__, "tabs", tabs)
    monkeypatch.setitem(PLOTS, "control.paths", fails)
    monkeypatch.setitem(sections.ON_THE_SESSION, "provenance", fails)
    done = run_plan("session", scenario(tmp_path), tmp_path / "out", with_pdf=False)
    assert (done.state, done.code) == ("incomplete", 1)
    told = [one.code for one in load_document(Path(done.folder)).findings if one.code.startswith("internal.")]
    assert told == ["internal.tab.placement", "internal.chapter.provenance", "internal.figure.control.paths"]
    assert {"summary.json", "manifest.json", "report.html", "mine.rrd"} <= {
        one.name for one in Path(done.folder).iterdir()
    }


@pytest.mark.slow
def test_a_session_with_failures_has_all_else_and_is_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.pipeline.one_flight.configuration import load_configuration
    from groundstation.pipeline.verbs.cooperative import run_session
    from groundstation.simulation.session_log import write_session
    from tests.session_example import SEED
    from tests.session_example import SHORT as SCENARIO

    write_session(SCENARIO, tmp_path, "example", SEED)
    logs, settings = sorted(tmp_path.glob("*.csv")), load_configuration(tmp_path / "settings.toml")
    with monkeypatch.context() as patch:
        tabs = tuple(tab._replace(log=fails) if "cooperative" in tab.shows else tab for tab in systems().tabs)
        patch.setitem(systems().__dict__, "tabs", tabs)
        patch.setitem(PLOTS, "cooperative.map", fails)
        (done,) = run_session(logs, tmp_path / "out", settings, with_pdf=False)
        assert (done.state, done.code) == ("incomplete", 1)
    told = [one.code for one in load_document(Path(done.folder)).findings if one.code.startswith("internal.")]
    assert set(told) == {"internal.tab.cooperative", "internal.figure.cooperative.map"}
    (again,) = run_session(logs, tmp_path / "out", settings, with_pdf=False)
    assert (again.state, again.was_finished) == ("done", False)
    assert not [one for one in load_document(Path(done.folder)).findings if one.code.startswith("internal.")]


# ------------------------------------------------------------------------------------------------ beside the flights


def test_publishing_that_fails_is_no_log_and_leaves_the_rest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = [tmp_path / f"{name}.csv" for name in "ab"]
    for number, log in enumerate(logs):
        log.write_text(f"time_s,baro.pressure_altitude_m\n0,{number}\n1,{number}\n2,3\n", encoding="utf-8")
    _break_fleet_chapter("method", monkeypatch)
    monkeypatch.setitem(viewer_fleet.TABS_BEHIND, "flights", fails)
    with pytest.raises(SystemExit) as ended:
        main(["run", *map(str, logs), "-o", str(tmp_path / "out"), "-j", "1", "--no-pdf"])
    printed = capsys.readouterr().err
    assert ended.value.code == 1
    assert "2 logs: 2 done, 0 with data lost, 0 at the limit, 0 failed, 0 skipped" in printed
    assert f"out: the chapter method is left out: {REASON}" in printed
    assert f"out: the tab flights is left out: {REASON}" in printed
    assert {"index.json", "index.csv", "fleet.parquet", "summary.html", "fleet.rrd"} <= {
        path.name for path in (tmp_path / "out").iterdir()
    }

    monkeypatch.setattr(publishing, "write_fleet", fails)
    with pytest.raises(SystemExit) as ended:
        main(["run", *map(str, logs), "-o", str(tmp_path / "out"), "-j", "1", "--no-pdf", "--json"])
    told = json.loads(capsys.readouterr().out)
    assert ended.value.code == 1
    assert [one.get("kind") for one in told] == [None, None, "output"] and REASON in told[2]["text"]


def test_an_incomplete_log_is_worse_than_lost_data() -> None:
    from groundstation.pipeline.one_flight.outcome import worst_code

    lost, lacking = Outcome("a", "data_lost", ""), Outcome("b", "incomplete", "")
    assert worst_code((lost, lacking)) == 1
