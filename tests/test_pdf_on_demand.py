"""PDFs on demand: what a run leaves without ``--pdf``, what ``--pdf`` adds to it, and what goes again."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

import groundstation
from groundstation.cli.main import app
from groundstation.pipeline.many_flights.fleet.publishing import report_again
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.many_flights.runs.dry_run import plan_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.verbs.plan import run_plan
from groundstation.pipeline.verbs.watching import watch
from groundstation.reports import sections
from groundstation.results.files import load_manifest
from tests.systems.planning.test_plan import scenario
from tests.test_resume import SHORT, copied, flight_in, stages, times

PDFS = {"report.pdf", "summary.pdf"}
BY_CONTENT = (".rrd", ".parquet")  # of the files beside the flights, which every run writes
ADDED = "finished, its PDF to add"


@pytest.fixture(scope="module")
def finished(finished_run: Callable[..., Outcome]) -> Path:
    """OUT of a run of the short sample: shared, to be copied."""
    return Path(finished_run(SHORT.stem).folder).parent


def pdfs_in(out: Path) -> set[str]:
    return {path.name for path in out.rglob("*.pdf")}


def contents(out: Path) -> dict[str, bytes]:
    """All files of an OUT that are compared by the byte, those of a flight but its manifest."""
    files = (path for path in out.rglob("*") if path.is_file() and path.name not in ("manifest.json", ".lock"))
    inside = flight_in(out)
    compared = (path for path in files if path.parent == inside or path.suffix not in BY_CONTENT)
    return {str(path.relative_to(out)): path.read_bytes() for path in compared if ".parquet" not in str(path.parent)}


def called(*arguments: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [str(one) for one in arguments])
    return done.exit_code, done.stdout, done.stderr


@pytest.mark.slow
def test_a_run_writes_pages_and_no_pdf_and_needs_no_typst(finished: Path, tmp_path: Path) -> None:
    assert pdfs_in(finished) == set() and (finished / "summary.html").is_file()
    for page in (finished / "summary.html", flight_in(finished) / "report.html", flight_in(finished) / "summary.json"):
        assert not [name for name in PDFS if name in page.read_text(encoding="utf-8")], page
    code = (
        "import sys; from groundstation.cli.main import main\n"
        f"sys.argv[1:] = ['run', {str(SHORT)!r}, '-o', {str(tmp_path / 'out')!r}, '-q', '-j', '1']\n"
        "try: main()\nexcept SystemExit as stop: assert not stop.code\nprint('typst' in sys.modules)"
    )
    environment = {name: value for name, value in os.environ.items() if not name.startswith("COV_")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.splitlines()[-1] == "False"
    assert pdfs_in(tmp_path / "out") == set()


def test_pdf_adds_the_pdfs_of_a_finished_run_and_touches_nothing_else(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    before, made = contents(out), times(flight_in(out))
    assert plan_many([SHORT], out, Configuration(), with_pdf=True)[0].text == ADDED
    outcome, told = stages([SHORT], out, Configuration(), with_pdf=True)
    assert told == {"reporting"} and not outcome.was_finished
    assert pdfs_in(out) == PDFS
    after = contents(out)
    assert {name for name in after if name not in before} == {
        "summary.pdf",
        f"{flight_in(out).name}/report.pdf",
    }
    assert {name: after[name] for name in before} == before
    assert {name for name, time in times(flight_in(out)).items() if made.get(name) != time} == {
        "report.pdf",
        "manifest.json",
    }
    kept = times(flight_in(out))
    for with_pdf in (True, False):  # what is there tells of these results, asked for or not
        outcome, told = stages([SHORT], out, Configuration(), with_pdf=with_pdf)
        assert outcome.was_finished and told == set() and times(flight_in(out)) == kept
        assert pdfs_in(out) == PDFS


def test_the_pdf_of_a_finished_run_is_that_of_one_run(finished: Path, tmp_path: Path) -> None:
    added, at_once = copied(finished, tmp_path / "added"), tmp_path / "at_once"
    run_many([SHORT], added, Configuration(), jobs=1, with_pdf=True)
    run_many([SHORT], at_once, Configuration(), jobs=1, with_pdf=True)
    assert contents(added).keys() == contents(at_once).keys()
    for path in (*added.rglob("*.pdf"), *added.rglob("*.html")):
        assert path.read_bytes() == (at_once / path.relative_to(added)).read_bytes(), path


@pytest.mark.slow
def test_a_pdf_that_is_not_as_the_run_left_it_is_made_again_where_it_is_asked_for(
    finished: Path, tmp_path: Path
) -> None:
    out = copied(finished, tmp_path / "out")
    run_many([SHORT], out, Configuration(), jobs=1, with_pdf=True)
    pdf = flight_in(out) / "report.pdf"
    whole = pdf.read_bytes()

    def plans() -> tuple[str, ...]:
        return tuple(plan_many([SHORT], out, Configuration(), with_pdf=asked)[0].text for asked in (True, False))

    for content in (whole[:100], whole + b"signed", None):
        pdf.unlink() if content is None else pdf.write_bytes(content)
        assert plans() == (ADDED, "finished, nothing to do")
        run_many([SHORT], out, Configuration(), jobs=1)
        assert (pdf.read_bytes() if pdf.exists() else None) == content
        run_many([SHORT], out, Configuration(), jobs=1, with_pdf=True)
        assert pdf.read_bytes() == whole
    assert plans() == ("finished, nothing to do", "finished, nothing to do")


def test_a_run_that_was_killed_before_it_noted_the_pdf_makes_it_again(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    manifest = (flight_in(out) / "manifest.json").read_bytes()
    run_many([SHORT], out, Configuration(), jobs=1, with_pdf=True)
    (flight_in(out) / "manifest.json").write_bytes(manifest)
    (flight_in(out) / "report.pdf").write_bytes(b"of somebody")
    assert plan_many([SHORT], out, Configuration(), with_pdf=True)[0].text == ADDED
    run_many([SHORT], out, Configuration(), jobs=1, with_pdf=True)
    assert (flight_in(out) / "report.pdf").read_bytes().startswith(b"%PDF")
    assert "report.pdf" in load_manifest(flight_in(out)).files


def test_a_page_that_is_made_again_keeps_its_pdf(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    run_many([SHORT], out, Configuration(), jobs=1, with_pdf=True)
    before = contents(out)
    (flight_in(out) / "report.html").unlink()
    _outcome, told = stages([SHORT], out, Configuration())
    assert told == {"reporting"} and contents(out) == before


@pytest.mark.slow
def test_other_results_lose_the_pdfs_of_the_earlier_ones(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    run_many([SHORT], out, Configuration(), jobs=1, with_pdf=True)
    flight = flight_in(out)
    run_many([SHORT, SHORT.with_name("taxi-drift.csv")], out, Configuration(), jobs=1)
    assert list(out.rglob("*.pdf")) == [flight / "report.pdf"], "the flight is as it was, the fleet is not"
    run_many([SHORT], out, Configuration({"heading": {"standstill_min_s": 12.0}}), jobs=1)
    assert pdfs_in(out) == set()


def test_a_part_that_fails_when_the_pdf_is_added_is_told_by_page_and_pdf(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise ValueError("broken")

    out = copied(finished, tmp_path / "out")
    monkeypatch.setitem(sections.BEFORE_THE_ANSWERS, "next_steps", fails)
    (outcome,) = run_many([SHORT], out, Configuration(), jobs=1, with_pdf=True)
    assert outcome.state == "incomplete" and pdfs_in(out) == PDFS
    assert "the chapter next_steps is left out" in (flight_in(out) / "report.html").read_text(encoding="utf-8")
    monkeypatch.undo()
    assert plan_many([SHORT], out, Configuration())[0].text.startswith("to analyse again")


def test_a_report_without_pdf_removes_those_of_an_earlier_run_and_says_so(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    assert called("report", out)[2] == ""
    assert called("report", out, "--pdf")[2] == "" and pdfs_in(out) == PDFS
    code, written, told = called("report", out, "--no-pdf")
    assert (code, told) == (0, "removed 2 PDFs of an earlier run; --pdf makes them\n")
    assert ".pdf" not in written and pdfs_in(out) == set()
    assert "report.pdf" not in load_manifest(flight_in(out)).files
    assert called("report", flight_in(out), "--pdf", "-q")[0] == 0
    assert called("report", flight_in(out), "-q") == (0, "", "") and pdfs_in(out) == set()
    assert plan_many([SHORT], out, Configuration())[0].text == "finished, nothing to do"


def test_a_report_of_one_flight_names_the_pdf_that_it_removed(finished: Path, tmp_path: Path) -> None:
    folder = flight_in(copied(finished, tmp_path / "out"))
    assert report_again(folder, with_pdf=True).removed == []
    _code, _out, told = called("report", folder)
    assert told == f"removed {folder / 'report.pdf'} of an earlier run; --pdf makes it\n"


@pytest.mark.parametrize("verb", ["run", "watch"])
def test_results_alone_with_pdfs_is_an_error_of_usage(verb: str, tmp_path: Path) -> None:
    code, out, told = called(verb, SHORT, "-o", tmp_path / "out", "--only", "results", "--pdf")
    assert (code, out, told.count("\n")) == (2, "", 1)
    assert told.startswith("error: --only results: found --pdf, expected one of them") and "report OUT --pdf" in told
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_no_pdf_is_what_happens_by_itself(tmp_path: Path) -> None:
    for options in (("--no-pdf",), ("--pdf", "--no-pdf"), ("--only", "results", "--no-pdf")):
        out = tmp_path / "-".join(options)
        assert called("run", SHORT, "-o", out, "-q", "-j", "1", *options) == (0, "", "")
        assert pdfs_in(out) == set()


def test_a_plan_gets_its_pdf_and_is_not_made_again(tmp_path: Path) -> None:
    file, out = scenario(tmp_path), tmp_path / "out"
    made = run_plan("session", file, out)
    folder = Path(made.folder)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    del before[folder / "manifest.json"]
    added = run_plan("session", file, out, with_pdf=True)
    assert added.times_s.keys() == {"reporting"} and not added.was_finished and added.text == made.text
    assert {path: path.read_bytes() for path in before} == before
    pdf = (folder / "report.pdf").read_bytes()
    for with_pdf in (True, False):
        again = run_plan("session", file, out, with_pdf=with_pdf)
        assert again.was_finished and again.text == made.text and (folder / "report.pdf").read_bytes() == pdf
    assert run_plan("session", file, out, with_pdf=True, force=True).times_s.keys() > {"planning"}
    assert (folder / "report.pdf").read_bytes() == pdf
    (folder / "report.html").unlink()
    assert run_plan("session", file, out).times_s.keys() > {"planning"}
    assert not (folder / "report.pdf").exists()


def test_a_plan_of_another_scenario_is_made_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_plan("session", scenario(tmp_path), out, with_pdf=True)
    text = Path(scenario(tmp_path)).read_text(encoding="utf-8")
    again = run_plan("session", scenario(tmp_path, text.replace("duration_s = 4", "duration_s = 5")), out)
    assert not again.was_finished and pdfs_in(out) == set()
    assert load_manifest(Path(again.folder)).configuration["scenario"]["duration_s"] == 5.0


@pytest.mark.slow
def test_a_watch_and_the_python_api_write_pdfs_where_they_are_asked_to(finished: Path, tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    shutil.copy2(SHORT, logs)
    opened = groundstation.open(SHORT)
    for with_pdf, pdfs in ((False, set()), (True, PDFS)):
        list(watch(logs, tmp_path / "seen", Configuration(), every_s=0.01, once=True, with_pdf=with_pdf, say=print))
        assert pdfs_in(tmp_path / "seen") == pdfs
        saved = opened.save(tmp_path / "saved", pdf=with_pdf)  # type: ignore[attr-defined]
        assert pdfs_in(tmp_path / "saved") == pdfs
        assert json.loads((saved.folder / "summary.json").read_text())["flight"]["id"] == flight_in(finished).name
