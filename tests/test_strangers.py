"""Folders full of files that are no logs: each is looked at once, by its first bytes, and not again."""

import gzip
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from groundstation.pipeline.many_flights.fleet.index import MOST_SKIPPED
from groundstation.pipeline.many_flights.runs import batch, strangers
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.many_flights.runs.dry_run import plan_many
from groundstation.pipeline.many_flights.runs.strangers import MEMORY, Strangers
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.readers import registry
from tests.conftest import forget_profiles

CONTENTS = {
    "note.txt": b"notes of the day",
    "photo.jpg": b"\xff\xd8\xff\xe0" + bytes(range(256)),
    "code.py": b"import os\n",
    "empty": b"",
    "table.csv": b"a,b\n1,2\n",
    "archive.zip": b"PK\x03\x04" + bytes(50),
    "two  blanks \x1b.txt": b"no log",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "logs").mkdir()
    for name, content in CONTENTS.items():
        (tmp_path / "logs" / name).write_bytes(content)
    return tmp_path / "logs"


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Path]]:
    """Files that are looked at."""
    seen: list[Path] = []
    real = registry.unclaimed
    monkeypatch.setattr(registry, "unclaimed", lambda path: seen.append(path) or real(path))
    return seen


def run(folder: Path, out: Path) -> tuple[Outcome, ...]:
    return run_many([folder], out, Configuration(), jobs=1, only_results=True)


def test_files_that_are_no_logs_are_told_as_before_and_no_job_is_made_of_them(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(batch, "skipped_files", lambda *_: {})
        before = run(folder, tmp_path / "one")
    assert {one.state for one in before} == {"skipped"} and len(before) == len(CONTENTS)
    monkeypatch.setattr("groundstation.pipeline.many_flights.runs.batch.run_flight", None)
    assert run(folder, tmp_path / "two") == before
    assert (tmp_path / "one/index.json").read_bytes() == (tmp_path / "two/index.json").read_bytes()
    assert (tmp_path / "one" / MEMORY).read_bytes() == (tmp_path / "two" / MEMORY).read_bytes()


def test_nothing_is_opened_again_until_it_changes(folder: Path, tmp_path: Path, opened: list[Path]) -> None:
    first = run(folder, tmp_path / "out")
    assert len(opened) == len(CONTENTS)
    opened.clear()
    assert run(folder, tmp_path / "out") == first and not opened
    assert plan_many([folder], tmp_path / "out", Configuration()) == first and not opened
    (folder / "note.txt").write_bytes(b"notes of the dax")
    (folder / "new.txt").write_bytes(b"new")
    assert len(run(folder, tmp_path / "out")) == len(CONTENTS) + 1
    assert {path.name for path in opened} == {"note.txt", "new.txt"}


def test_another_version_looks_again(
    folder: Path, tmp_path: Path, opened: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    run(folder, tmp_path / "out")
    opened.clear()
    monkeypatch.setattr(strangers, "__version__", "0.0.1")
    run(folder, tmp_path / "out")
    assert len(opened) == len(CONTENTS)


def test_a_new_profile_looks_again(folder: Path, tmp_path: Path, opened: list[Path], own_profiles: Path) -> None:
    assert len(run(folder, tmp_path / "out")) == len(opened) == len(CONTENTS)
    opened.clear()
    (own_profiles / "mine.toml").write_text(
        'name = "mine"\n[time]\nkind = "seconds"\ncolumn = "a"\n[columns]\nb = { field = "gnss.hdop" }\n'
    )
    forget_profiles()
    run(folder, tmp_path / "out")
    assert len(opened) == len(CONTENTS)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"key": 1}', b"\xff"])
def test_a_memory_that_cannot_be_read_is_none(folder: Path, tmp_path: Path, content: bytes) -> None:
    first = run(folder, tmp_path / "out")
    (tmp_path / "out" / MEMORY).write_bytes(content)
    assert run(folder, tmp_path / "out") == first
    assert json.loads((tmp_path / "out" / MEMORY).read_bytes())["files"]


def test_what_the_first_bytes_do_not_show_is_left_to_a_run(tmp_path: Path) -> None:
    log, packed, gone = tmp_path / "log.csv", tmp_path / "a.gz", tmp_path / "gone"
    log.write_text("time_s,ins.true_heading_deg\n0,1\n1,1\n2,1\n")
    packed.write_bytes(gzip.compress(b"no log"))
    assert [Strangers().reason(path) for path in (log, packed, gone)] == [None, None, None]


def test_a_compressed_stranger_is_remembered_once_a_run_has_told_of_it(tmp_path: Path, opened: list[Path]) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    (folder / "a.gz").write_bytes(gzip.compress(b"no log"))
    first = run(folder, tmp_path / "out")
    opened.clear()
    assert run(folder, tmp_path / "out") == first and not opened


def test_of_very_many_the_index_lists_the_first(tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    for number in range(MOST_SKIPPED + 5):
        (folder / f"{number:05d}.txt").write_bytes(b"x")
    assert len(run(folder, tmp_path / "out")) == MOST_SKIPPED + 5
    rows = json.loads((tmp_path / "out/index.json").read_text())["rows"]
    assert len(rows) == MOST_SKIPPED + 1 and rows[-1]["source"] == "5 more files"
