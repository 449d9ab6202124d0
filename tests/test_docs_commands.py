"""Every command that the docs show: run in a folder with the files they name, or parsed where that takes long."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from filelock import FileLock

from tests.docs_commands import ROOT, Command, commands, make_folder, missing_extra, missing_target, parse, run

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
NEVER_RUN = {
    "view": "opens a window",
    "serve": "serves until Ctrl-C",
    "watch": "waits for logs until Ctrl-C",
    "study": "takes minutes to hours",
}
RUN_IN_SLOW = {
    "run": "3 s a log: what it leaves is in the folder already",
    "report": "paints every page again, 1 s a flight",
    "clip": "writes a recording, 3 s, but with --no-recording",
    "compare": "writes a recording, 3 s",
    "cooperative": "runs a session, 5 s",
    "plan": "optimises, up to a minute",
    "simulate": "hours of flight in some scenarios, 10 s",
}
NOT_HERE = ("://", ".rrd", "--open", "--layout")  # clusters and buckets, recordings, a window, a layout saved by hand


@pytest.fixture(scope="session")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the files that the pages name, made once for all workers."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "docs-commands"
    with FileLock(f"{folder}.lock"):
        if not folder.exists():
            made = tmp_path_factory.mktemp("made")
            before = Path.cwd()
            os.chdir(made)
            try:
                make_folder(made)
            finally:
                os.chdir(before)
            made.rename(folder)
    return folder


@pytest.fixture
def here(prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the folder, as working directory; profiles and runways of the user are none."""
    folder = tmp_path / "docs"
    shutil.copytree(prepared, folder)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.chdir(folder)
    yield folder
    shutil.rmtree(folder)


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def pages(tool: str) -> list[Path]:
    return [page for page in PAGES if commands(page, (tool,))]


@pytest.mark.parametrize("page", pages("groundstation"), ids=name_of)
def test_commands_do_what_the_page_says(page: Path, here: Path) -> None:
    assert done(page, {**NEVER_RUN, **RUN_IN_SLOW}) == []


@pytest.mark.slow
@pytest.mark.parametrize("page", pages("groundstation"), ids=name_of)
def test_long_commands_do_what_the_page_says(page: Path, here: Path) -> None:
    assert done(page, NEVER_RUN) == []


def done(page: Path, only_parsed: dict[str, str]) -> list[str]:
    """Return what is wrong with the commands of a page, done in their order."""
    problems, made = [], list[str]()
    for command in commands(page):
        verb = next((word for word in command.words[1:] if not word.startswith("-")), "")
        is_run = verb not in only_parsed or is_short(command)
        is_run &= not any(one in word for word in command.words for one in NOT_HERE)
        problems.append(parse(command, made) or (run(command) if is_run else ""))
    return [problem for problem in problems if problem]


def is_short(command: Command) -> bool:
    """Return whether a call of a long verb takes no time: a list, a clip without its recording, a simulated taxi."""
    short = {"--list", "--no-recording"} & set(command.words)
    return bool(short) or (command.words[1] == "simulate" and command.words[2].startswith("taxi-"))


def test_targets_of_make_and_extras_of_pip_are_there() -> None:
    targets = [missing_target(command) for page in PAGES for command in commands(page, ("make",))]
    extras = [missing_extra(command) for page in PAGES for command in commands(page, ("pip", "pipx", "uv"))]
    assert [problem for problem in (*targets, *extras) if problem] == []


def test_lines_are_read_as_a_shell_reads_them(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "groundstation info prose.csv\n\n```\n$ groundstation info a.csv  # why\ngroundstation info a.ch10 \\\n"
        "    --suggest-icd > a.yaml\nmake x && groundstation list | head\n```\n\n    groundstation list 'b c.csv'\n"
        "    error: no\n",
        encoding="utf-8",
    )
    assert commands(page) == (
        Command("page.md:4", ("groundstation", "info", "a.csv")),
        Command("page.md:6", ("groundstation", "info", "a.ch10", "--suggest-icd"), "a.yaml"),
        Command("page.md:7", ("groundstation", "list")),
        Command("page.md:10", ("groundstation", "list", "b c.csv"), error="error: no"),
    )


def test_a_wrong_command_is_seen_without_running_it(here: Path) -> None:
    for line, said in {
        "nonsense a.csv": "nonsense",
        "run logs --nonsense -o out": "nonsense",
        "run logs": "-o",
        "run nowhere -o out": "no file nowhere",
        "study nonsense -o study": "no study nonsense",
        "plan landing nonsense -o plans": "no landing nonsense",
        "simulate nonsense -o logs": "no simulate nonsense",
        "watch logs -o out --every soon": "soon",
    }.items():
        assert said in parse(Command("page", ("groundstation", *line.split()))), line
    made = list[str]()
    assert parse(Command("page", ("groundstation", "run", "logs", "-o", "results")), made) == ""
    assert parse(Command("page", ("groundstation", "view", "results/flight")), made) == ""


def test_a_command_that_fails_is_told(here: Path) -> None:
    nowhere = ("groundstation", "info", "nowhere.csv")
    assert "exit code 2" in run(Command("page", nowhere))
    assert run(Command("page", nowhere, error="error: nowhere.csv: no such file")) == ""
    assert "not the error" in run(Command("page", nowhere, error="error: nothing"))
    assert missing_target(Command("page", ("make", "nonsense"))) and not missing_target(
        Command("page", ("make", "site"))
    )
    assert missing_extra(Command("page", ("pip", "install", ".[nonsense]"))) != ""
