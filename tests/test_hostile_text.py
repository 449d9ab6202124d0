"""Text of a log drives no terminal and no spreadsheet: every verb, every file, whatever a log, or its name, holds."""

import ast
import csv
import gzip
import io
import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from groundstation.base.printable import FORMULA_STARTS, csv_cell, in_a_line, is_hidden, printable, printable_json
from groundstation.base.text_columns import columns
from groundstation.chapters.wording import clean
from groundstation.cli import application, progress
from groundstation.cli.main import app
from groundstation.pipeline.one_flight.progress import Event
from groundstation.viewer.names import clean_text
from tests.readers.ulog_writer import UlogWriter
from tests.real_logs import real_log

HIDDEN = (
    *("\x1b]0;PWN\x07", "\x1b[2J\x1b[31m", "\x9b2J", "\x00", "\x7f", "\x85", "\u2028", "\ufeff", "\u00ad"),
    *("\u202a", "\u202b", "\u202c", "\u202d", "\u202e", "\u2066", "\u2067", "\u2068", "\u2069"),
    *("\u200e", "\u200f", "\u061c", "\U000e0041"),
)
EVIL = [
    f"{start}{hidden}x" for start, hidden in zip(("", "=1+1", "+", "-2", "@A", "\t=", " =") * 4, HIDDEN, strict=False)
]
EVIL += ["two\nlines", "cr\rlf\r\n=1", "a\tb"]
NAME = "l\x1b]0;PWN\x07og\u202e=\x9b.csv"
TEXTS = ".csv", ".json", ".html", ".kml", ".gpx", ".toml"


def hostile_log(path: Path, *, peer: str = "B", shift: float = 0.0) -> Path:
    """A flat CSV in which every name and text is hostile, that has an INS, a receiver and a link to a peer."""
    evil = [text for text in EVIL if "\0" not in text]  # with it a file is no text
    quoted = [text.replace('"', '""') for text in evil]
    ours = [
        *("ins.latitude_deg", "ins.longitude_deg", "ins.altitude_ellipsoid_m", "ins.velocity_north_mps"),
        *("ins.velocity_east_mps", "ins.true_heading_deg", "gnss.latitude_deg", "gnss.longitude_deg"),
        *(
            "gnss.velocity_north_mps",
            "gnss.velocity_east_mps",
            "gnss.\x1b[2J=1.latitude_deg",
            f"link.{peer}.pseudorange_m",
        ),
    ]
    names = [text for text in quoted if not {"\n", "\r"} & {*text}]
    header = ["time_s", *ours, *(f"t{at}.{text}" for at, text in enumerate(names)), *names, "event.name"]
    head = ["start_utc: 2026-05-04T06:00:00Z"]
    head += [f"{key}: {text}" for key, text in zip(("aircraft", "flight", "note"), evil, strict=False)]
    head += [f"{text.split()[0]}{at}: x" for at, text in enumerate(evil)]
    lines = [f"# {line}" for line in head if "\n" not in line and "\r" not in line]
    lines.append(",".join(f'"{name}"' for name in header))
    others = ",1" * 2 * len(names)
    for row in range(60):
        place = f"56.{row:04d},38.{row:04d}"
        numbers = f"{row},{place},{200 + shift},10,10,45,{place},10,10,56,{1000 + shift}"
        lines.append(f'{numbers}{others},"{quoted[row % len(quoted)]}"')
    path.write_bytes(("\n".join(lines) + "\n").encode("utf-8"))
    return path


def hostile_ulog(path: Path) -> Path:
    """A ULog with what no text file can hold: zero bytes in names and texts."""
    log = UlogWriter().flags().info("sys_name", "a\0b\x1b[2J").info("ver_hw", "=\0")
    log.format("t:uint64_t timestamp;float a;").subscribe(0, "t")
    for row in range(20):
        log.row(0, "Qf", 1_000_000 + row * 100_000, 1.0).text(1_000_000 + row * 100_000, EVIL[row % len(EVIL)])
    path.write_bytes(bytes(log.data))
    return path


def hidden_in(text: str) -> str:
    """What of a printed text is hidden but for the ends of its lines."""
    return "".join(mark for mark in text if mark != "\n" and is_hidden(mark))


def groundstation(*arguments: str | Path) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call, neither of which holds anything hidden; its errors are lines."""
    result = CliRunner().invoke(app, list(map(str, arguments)))
    assert hidden_in(result.stdout) == "" and hidden_in(result.stderr) == "", arguments
    assert "Traceback" not in result.stderr
    return result.exit_code, result.stdout, result.stderr


# ------------------------------------------------------------------------------------------------ the one place


@given(st.text())
def test_what_is_printable_is_one_line_that_shows(text: str) -> None:
    shown = printable(text)
    assert not any(map(is_hidden, shown)) and len(shown) == len(text)
    assert printable(shown) == shown
    assert "\n" not in clean(text) and not any(map(is_hidden, clean(text)))
    assert not any(map(is_hidden, clean_text(text))) and not any(map(is_hidden, in_a_line(text)))


@given(st.text() | st.sampled_from(EVIL))
def test_a_cell_is_one_cell_that_shows_and_is_no_formula(text: str) -> None:
    cell = csv_cell(text)
    (row,) = csv.reader(io.StringIO(cell + ",end\n"))
    assert len(row) == 2 and row[1] == "end" and not any(map(is_hidden, row[0]))
    assert not row[0].lstrip().startswith(FORMULA_STARTS)
    assert row[0].removeprefix("'") == printable(text) or row[0] == printable(text), "nothing else is changed"


@given(st.recursive(st.text() | st.integers(), lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner)))
def test_json_says_the_same_and_shows(document: object) -> None:
    text = printable_json(json.dumps(document, indent=2, ensure_ascii=False))
    assert json.loads(text) == document and hidden_in(text) == ""


@pytest.mark.parametrize("hidden", HIDDEN)
def test_kinds_of_hidden_characters_are_seen(hidden: str) -> None:
    assert is_hidden(hidden[0]) and not any(map(is_hidden, printable(hidden)))


def test_words_of_any_script_stay_as_they_are() -> None:
    for text in ("борт 7", "日本語", "naïve café", "می‌روم", "e\u0301", "12\u202f346", "a\u00a0b", "🛩️"):
        assert printable(text) == text == clean(text)


def test_columns_are_not_broken_by_a_cell() -> None:
    shown = columns([["a\nb", "c"], ["\x1b[2J", "d"]])
    assert shown.splitlines() == ["a b   c", "?[2J  d"]


def test_verbs_print_through_one_place_alone() -> None:
    for path in sorted((Path(application.__file__).parent).glob("*.py")):
        if path.name == "text.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert called not in ("typer.echo", "typer.secho", "print", "sys.stdout.write"), f"{path}:{node.lineno}"
                assert called != "sys.stderr.write" or path.name == "progress.py", f"{path}:{node.lineno}"


# ------------------------------------------------------------------------------------------------ every verb


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """A hostile log, the OUT of its run, and its flight folder."""
    folder = tmp_path_factory.mktemp("hostile")
    log = hostile_log(folder / NAME)
    code, out, err = groundstation("run", log, "-o", folder / "out", "-j", "1", "--no-pdf")
    assert (code, len(out.splitlines())) == (3, 1), err
    (summary,) = (folder / "out").glob("*/summary.json")
    return log, folder / "out", summary.parent


TRIED = {
    "info": ("info {log}", "info -v {log}", "info {mcap}", "info --json {log}", "info {log}x"),
    "check": (
        "check {log}",
        "check -v {log}",
        "check --json {log}",
        "check --for heading {log} {mcap}",
        "check {log}x",
    ),
    "profile": (
        "profile list",
        "profile new {log} -o {tmp}/draft.toml",
        "profile check igc {log}",
        "profile check {tmp}/draft.toml {log}",
        "profile new {log}x",
    ),
    "convert": ("convert -f -o {tmp}/a.mcap {log}", "convert --json -f -o {tmp}/b.mcap {log} ", "convert -o x {log}x"),
    "run": (
        "run -v -f -j 1 --no-pdf --progress json --only results -o {tmp}/run {log}",
        "run --json -f -j 1 --only results -o {tmp}/json {log} {log}x",
        "run --dry-run -o {out} {log}",
        "run -j 1 --only results --timeout 100 -o {tmp}/worker {log} {other}",
        "run -o {tmp}/x {log}x",
    ),
    "watch": ("watch {folder} -o {tmp}/watched --once --every 0.1 --only results -j 1", "watch {log} -o {tmp}/x"),
    "report": ("report {flight} --no-pdf", "report --standard app-g -o {tmp}/standard {out}", "report {log}"),
    "view": ("view {log}x", "view {folder}"),
    "clip": (
        "clip {log} --from 5 --to 20 -o {tmp}/c.mcap --no-recording",
        "clip --json {log} -o {log}",
        "clip {log}x -o x",
    ),
    "export": (
        *(f"export -f {{log}} -o {{tmp}}/e.{suffix}" for suffix in ("csv", "kml", "gpx", "nmea")),
        "export --figures {flight} -o {tmp}/figures",
        "export {log} -o {tmp}/e.csv --track {name}",
        "export {flight} -o {tmp}/e.csv --figure {name}",
    ),
    "compare": (
        "compare {flight} {flight}",
        "compare --json {flight} {flight}",
        "compare -f {flight} {flight} -o {tmp}/compared",
    ),
    "cooperative": ("cooperative {log} {other} -o {tmp}/session --no-pdf", "cooperative {log}x -o {tmp}/x"),
    "plan": ("plan session {log} -o {tmp}/plan", "plan landing {name} -o {tmp}/plan"),
    "rules": (
        "rules test {rules} --over {out}",
        "rules test {rules} --over {out} --json",
        "rules test {log} --over {out}",
    ),
    "runways": (
        "runways near 56 38",
        "runways show {name}",
        "runways show ENGM {name}",
        "runways show --json",
        "runways update {log}",
        "runways update {log}x",
    ),
    "serve": ("serve {folder}", "serve {log}x"),
    "simulate": ("simulate {name} -o {tmp}/s", "simulate {log} -o {tmp}/s"),
    "study": ("study {name} -o {tmp}/s",),
    "list": ("list {log}", "list --json {log}", "list {log}x"),
}


def test_every_verb_is_tried() -> None:
    assert set(TRIED) == set(application.VERBS)


@pytest.mark.parametrize("verb", TRIED)
def test_a_verb_prints_and_writes_nothing_hidden(
    verb: str, ran: tuple[Path, Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, out, flight = ran
    monkeypatch.setenv("DISPLAY", ":0")
    (tmp_path / "logs").mkdir()
    other = hostile_log(tmp_path / f"other{NAME}", peer="A", shift=5.0)
    rules = tmp_path / "rules.toml"
    rules.write_text("[heading]\nprecision_max_deg = 0.01\n", encoding="utf-8")
    places = {
        "log": log,
        "out": out,
        "flight": flight,
        "tmp": tmp_path,
        "other": other,
        "rules": rules,
        "mcap": next(flight.glob("*.mcap")),
        "folder": log.parent,
        "name": "n\x1b[2J\u202e",
    }
    for line in TRIED[verb]:
        code, printed, err = groundstation(*(word.format(**places) for word in line.split(" ") if word))
        assert code in (0, 1, 2, 3, 4), line
        assert len(printed + err) > 0 or "--timeout" in line, line
        if "--json" in line and code not in (1, 2):
            assert json.loads(printed)
    assert_shown(tmp_path)
    assert_shown(out)


def assert_shown(folder: Path) -> None:
    """Every text that was made in a folder shows, no cell of a table is a formula, and what has a grammar keeps it."""
    made = [path for path in folder.rglob("*") if path.suffix in TEXTS and not path.name.endswith(NAME)]
    for path in made:
        text = path.read_text(encoding="utf-8")
        assert hidden_in(text.replace("\r\n", "\n")) == "", path
        if path.suffix == ".csv":
            for row in csv.reader(text.splitlines()):
                cells = [cell for cell in row if cell.lstrip().startswith(FORMULA_STARTS)]
                assert all(_is_number(cell) for cell in cells), (path, cells)
        elif path.suffix == ".json":
            json.loads(text)
        elif path.suffix in (".kml", ".gpx"):
            ET.fromstring(text)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def test_data_stay_data(ran: tuple[Path, Path, Path]) -> None:
    log, _out, flight = ran
    described = json.loads(CliRunner().invoke(app, ["info", "--json", str(log)]).stdout)
    assert EVIL[0] in described["facts"].values(), "in JSON a text is as it was logged"
    assert any("\x1b" in topic["name"] for topic in described["topics"])
    summary = json.loads((flight / "summary.json").read_text(encoding="utf-8"))
    assert summary["flight"]["metadata"]["aircraft"] == EVIL[0].strip() and summary["flight"]["source"]["name"] == NAME


def test_a_name_that_looks_like_an_option_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("--\x1b[2J.csv", "-\x9b\u202e", "--json=\x1b[2J", "\x1b[2J"):
        assert groundstation("info", name)[0] == 2
    assert groundstation("\x1b[2Jverb")[0] == 2


def test_progress_shows(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    event = Event("stage", EVIL[0], EVIL[1])
    with progress.listener("json") as listen:
        listen(event)
    line = capsys.readouterr().err
    assert hidden_in(line) == "" and json.loads(line)["name"] == EVIL[0]
    terminal = io.StringIO()
    terminal.isatty = lambda: True  # type: ignore[method-assign]
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress.listener("auto") as listen:
        listen(event)
    assert "\x1b]0;" not in terminal.getvalue() and "\x1b[2J" not in terminal.getvalue()


def test_zero_bytes_of_a_binary_log_are_shown(tmp_path: Path) -> None:
    log = hostile_ulog(tmp_path / "a.ulg")
    for line in ("info {0}", "check -v {0}", "run --no-pdf -j 1 -o {1}/out {0}", "list {0}"):
        groundstation(*line.format(log, tmp_path).split())
    assert_shown(tmp_path)


@pytest.mark.real_log
def test_the_log_of_the_report_drives_nothing(tmp_path: Path) -> None:
    log = tmp_path / "esc.csv"
    with gzip.open(real_log("cases/reliability/esc.csv.gz")) as packed, log.open("wb") as file:
        shutil.copyfileobj(packed, file)
    for line in ("info {0}", "check -v {0}", "run --no-pdf -j 1 -o {1}/out {0}", "list {0}", "export {0} -o {1}/a.kml"):
        groundstation(*line.format(log, tmp_path).split())
    log.unlink()
    assert_shown(tmp_path)


@pytest.fixture(autouse=True)
def _no_viewer(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """`view` ends before a window opens."""
    monkeypatch.setattr("groundstation.viewer.launch.open_viewer", lambda *_, **__: 0)
    yield
