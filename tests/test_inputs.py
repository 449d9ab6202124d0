"""Which files a run takes."""

import inspect
import sys
from pathlib import Path

import pytest

from groundstation.base.errors import UsageError
from groundstation.pipeline.many_flights.inputs import collect, no_log


def touched(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("x", encoding="utf-8")
    return path


def test_a_folder_is_walked_in_a_stable_order(tmp_path: Path) -> None:
    expected = [touched(tmp_path / name) for name in ("a/1.csv", "a/2.csv", "b.csv")]
    touched(tmp_path / ".hidden/x.csv")
    touched(tmp_path / ".x.csv")
    assert [item.path for item in collect([tmp_path])] == expected
    assert not any(item.is_named for item in collect([tmp_path]))


def test_what_groundstation_made_is_never_an_input(tmp_path: Path) -> None:
    log = touched(tmp_path / "log.csv")
    touched(tmp_path / "results/index.json")
    touched(tmp_path / "results/index.csv")
    touched(tmp_path / "results/flight/tables/ledger.csv")
    touched(tmp_path / "copied_flight/manifest.json")
    touched(tmp_path / "copied_flight/summary.json")
    touched(tmp_path / "out/x.csv")
    assert [item.path for item in collect([tmp_path], out=tmp_path / "out")] == [log]


def test_a_file_named_and_found_counts_once_as_named(tmp_path: Path) -> None:
    log = touched(tmp_path / "log.csv")
    found = collect([tmp_path, log])
    assert len(found) == 1 and found[0].is_named


def test_links_in_a_circle_are_not_followed(tmp_path: Path) -> None:
    log = touched(tmp_path / "logs/log.csv")
    (tmp_path / "logs/again").symlink_to(tmp_path / "logs")
    assert [item.path for item in collect([tmp_path])] == [log]


def test_of_a_file_and_a_link_to_it_the_first_counts(tmp_path: Path) -> None:
    touched(tmp_path / "b/log.csv")
    (tmp_path / "a").mkdir()
    (tmp_path / "a/link.csv").symlink_to(tmp_path / "b/log.csv")
    assert [item.path for item in collect([tmp_path])] == [tmp_path / "a/link.csv"]


def test_folders_of_any_depth_are_walked(tmp_path: Path) -> None:
    log = touched(tmp_path.joinpath(*("d" for _ in range(300)), "log.csv"))
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(len(inspect.stack()) + 100)
    try:
        (found,) = collect([tmp_path])
    finally:
        sys.setrecursionlimit(limit)
    assert found.path == log


def test_a_missing_path_is_a_usage_error(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such file"):
        collect([tmp_path / "none"])


def test_a_folder_in_place_of_a_log_names_the_next_step(tmp_path: Path) -> None:
    touched(tmp_path / "out/flight/manifest.json")
    assert str(no_log(tmp_path)).endswith("found a folder, expected a log: `run` takes folders")
    assert str(no_log(tmp_path / "out")).endswith("of flights, expected a log: name the .mcap of a flight in it")
    assert str(no_log(tmp_path / "out/flight")).endswith("of a flight, expected a log: name the .mcap in it")
    told = str(no_log(tmp_path / "out", takes_flights=True))
    assert told.endswith("expected a log or the folder of one flight: name a flight in it")
