"""Finished flights are put into place: twins, clashing ids, ids that changed, places that cannot be written."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from groundstation.pipeline.many_flights.fleet.refresh import refresh
from groundstation.pipeline.many_flights.fleet.scan import scan
from groundstation.pipeline.many_flights.runs.destination import Destination, LocalOutput
from groundstation.pipeline.one_flight.flight import PARTIAL_PREFIX, remove
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.files import load_manifest, save_manifest
from tests.fleet_example import save_flight

ONE, OTHER = "1" * 64, "2" * 64
FLIGHT = "20260504T060000Z_A12"
SUFFIXED = f"{FLIGHT}_{ONE[:8]}", f"{FLIGHT}_{OTHER[:8]}"


def finished(out: Path, log: str, sha256: str, flight_id: str = FLIGHT, folder: str = "") -> Outcome:
    """A flight folder in OUT, a partial one unless it has a name, and its outcome."""
    path = out / (folder or f"{PARTIAL_PREFIX}{log}-{flight_id}")
    path.mkdir(parents=True)
    (path / "summary.json").write_text("{}")
    manifest = {"source": {"path": str(Path(log).absolute()), "sha256": sha256}}
    (path / "manifest.json").write_text(json.dumps(manifest))
    (path / f"{flight_id}.mcap").write_text(log)
    return Outcome(log, "done", "", flight_id=flight_id, folder=str(path), sha256=sha256)


def run(out: Path, *outcomes: Outcome, again: bool = True) -> list[Outcome]:
    """Put outcomes in their order; those that clash are run again, with success or without."""
    destination = Destination(LocalOutput(out), [one.source for one in outcomes])
    for number, outcome in enumerate(outcomes):
        destination.put(number, outcome)
    for number in destination.clashing():
        one = outcomes[number]
        flight_id = f"{FLIGHT}_{one.sha256[:8]}"
        anew = finished(out, one.source, one.sha256, flight_id) if again else Outcome(one.source, "failed", "no memory")
        destination.put_again(number, anew)
    destination.sweep(scan(out))
    return list(destination.outcomes())


def names(out: Path) -> list[str]:
    return sorted(path.name for path in out.iterdir())


def test_two_flights_of_one_id_get_their_digests(tmp_path: Path) -> None:
    done = run(tmp_path, finished(tmp_path, "a", ONE), finished(tmp_path, "b", OTHER))
    assert names(tmp_path) == list(SUFFIXED)
    assert [one.flight_id for one in done] == list(SUFFIXED)


def test_a_flight_that_fails_when_it_is_run_again_keeps_what_stood_there(tmp_path: Path) -> None:
    done = run(tmp_path, finished(tmp_path, "a", ONE), finished(tmp_path, "b", OTHER), again=False)
    assert names(tmp_path) == [FLIGHT]
    assert [one.state for one in done] == ["failed", "failed"]


def test_a_twin_of_a_clashing_flight_leaves_nothing_behind(tmp_path: Path) -> None:
    kept, twin, other = (finished(tmp_path, log, sha) for log, sha in (("a", ONE), ("b", ONE), ("c", OTHER)))
    destination = Destination(LocalOutput(tmp_path), ["a", "b", "c"])
    for number, outcome in ((2, other), (1, twin), (0, kept)):  # the later twin is finished first
        destination.put(number, outcome)
    assert [one.state for one in destination.outcomes()] == ["done", "skipped", "done"]
    assert destination.clashing() == (0, 2)
    assert names(tmp_path) == [Path(kept.folder).name, FLIGHT]


def test_a_flight_that_has_another_id_now_is_listed_once_and_notes_stay(tmp_path: Path) -> None:
    for old in ("old", "annotated"):
        finished(tmp_path, "a", ONE, old, folder=old)
    (tmp_path / "annotated" / "notes.txt").write_text("mine")
    finished(tmp_path, "elsewhere", OTHER, "kept", folder="kept")  # its log is not in this run
    run(tmp_path, finished(tmp_path, "a", ONE))
    assert names(tmp_path) == [FLIGHT, "annotated", "kept"]
    assert names(tmp_path / "annotated") == ["notes.txt"]


def test_a_flight_is_removed_at_once_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    finished(tmp_path, "a", ONE, folder=FLIGHT)

    def killed(path: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(shutil, "rmtree", killed)
    with pytest.raises(KeyboardInterrupt):
        remove(tmp_path / FLIGHT)
    assert names(tmp_path) == [f"{PARTIAL_PREFIX}{FLIGHT}"]  # which the next run clears away


def test_a_newer_version_of_a_log_takes_the_place_of_the_older_one(tmp_path: Path) -> None:
    finished(tmp_path, "a", ONE, folder=FLIGHT)
    run(tmp_path, finished(tmp_path, "a", OTHER))
    assert names(tmp_path) == [FLIGHT]
    assert json.loads((tmp_path / FLIGHT / "manifest.json").read_text())["source"]["sha256"] == OTHER


def test_a_newer_version_of_a_log_that_clashed_removes_the_older_one(tmp_path: Path) -> None:
    finished(tmp_path, "a", ONE, SUFFIXED[0], folder=SUFFIXED[0])
    finished(tmp_path, "a", ONE, "another-day", folder="another-day")  # a recorder's card: one name, many flights
    run(tmp_path, finished(tmp_path, "a", OTHER))
    assert names(tmp_path) == [FLIGHT, "another-day"]


def test_a_flight_that_clashed_before_is_put_where_it_was(tmp_path: Path) -> None:
    for log, sha256, folder in (("a", ONE, SUFFIXED[0]), ("b", OTHER, SUFFIXED[1])):
        finished(tmp_path, log, sha256, folder, folder=folder)
    anew = [
        finished(tmp_path, log, sha, name) for log, sha, name in (("a", ONE, SUFFIXED[0]), ("b", OTHER, SUFFIXED[1]))
    ]
    destination = Destination(LocalOutput(tmp_path), ["a", "b"])
    for number, outcome in enumerate(anew):
        destination.put(number, outcome)
    destination.sweep(scan(tmp_path))
    assert destination.clashing() == () and names(tmp_path) == list(SUFFIXED)


def test_another_log_does_not_take_the_place_of_one_that_is_not_in_this_run(tmp_path: Path) -> None:
    finished(tmp_path, "a", ONE, folder=FLIGHT)
    run(tmp_path, finished(tmp_path, "b", OTHER))
    assert names(tmp_path) == [FLIGHT, SUFFIXED[1]]


def test_a_flight_that_cannot_be_put_into_place_has_failed_and_stops_no_other(tmp_path: Path) -> None:
    (tmp_path / FLIGHT).write_text("a file of somebody")
    first, second = run(tmp_path, finished(tmp_path, "a", ONE), finished(tmp_path, "b", OTHER, "other"))
    assert first.state == "failed" and first.text.startswith(f"{FLIGHT}: cannot be put into place (")
    assert second.state == "done" and names(tmp_path) == [FLIGHT, "other"]


def test_a_flight_is_removed_for_what_its_manifest_says_not_for_what_is_remembered(tmp_path: Path) -> None:
    old = [save_flight(tmp_path, number) for number in range(2)]
    found, _unwritten = refresh(tmp_path)
    remembered = found.fresh[old[0].name].sha256
    for folder, sha256 in zip(old, (OTHER, remembered), strict=True):
        manifest = json.loads((folder / "manifest.json").read_text())
        manifest["source"]["sha256"] = sha256
        (folder / "manifest.json").write_text(json.dumps(manifest))  # in place: the time of the folder stays
    destination = Destination(LocalOutput(tmp_path), ["a"])
    destination.put(0, finished(tmp_path, "a", remembered))
    assert list(scan(tmp_path).fresh) == [folder.name for folder in old]
    assert destination.sweep(scan(tmp_path))
    assert names(tmp_path) == sorted([".flights", FLIGHT, old[0].name, "flights.parquet", "samples.parquet"])


def test_a_manifest_that_is_replaced_alone_is_noticed(tmp_path: Path) -> None:
    folders = [save_flight(tmp_path, number) for number in range(2)]
    refresh(tmp_path)
    manifest = load_manifest(folders[1])
    save_manifest(folders[1], replace(manifest, source=replace(manifest.source, path="/moved/b.csv")))
    assert scan(tmp_path).stale == (folders[1].name,)
    found, _ = refresh(tmp_path)
    assert found.fresh[folders[1].name].path == "/moved/b.csv"
