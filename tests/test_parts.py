"""Parts of one flight: files cut anywhere give the tables of the whole; run finds them, and what is none."""

import gzip
import json
import random
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.base.timescales import iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.runs.batch import run_many, run_together
from groundstation.pipeline.many_flights.runs.dry_run import plan_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_parts
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.parts import goes_on
from groundstation.pipeline.one_flight.progress import silent
from groundstation.pipeline.verbs.watched_batch import WatchedLogs, run_batch
from groundstation.readers.joined import JoinedSource
from groundstation.readers.source import Source
from groundstation.results.files import load_document, load_manifest
from groundstation.results.manifest import PartOfRun
from groundstation.tables.table import Flight
from tests.readers.bag_writer import small_flight, write_ros2
from tests.real_logs import real_log
from tests.test_formats_agree import ICDS, WRITERS

ABOUT_FILES = {"parts", "start_utc"}  # metadata that is of the files
START = "2026-05-04T06:00:00Z"
COLUMNS = "time_s,ins.true_heading_deg,gnss.latitude_deg,gnss.longitude_deg"


def tables(paths: Sequence[Path], target: Path, icds: tuple[str, ...] = ()) -> Flight:
    """Tables of consecutive files, or of one."""
    return read_flight(target, convert_log(open_parts(paths, icds=icds), target))


def said(flight: Flight) -> dict[str, str]:
    return {key: value for key, value in flight.metadata.items() if key not in ABOUT_FILES}


def assert_equal_flights(one: Flight, other: Flight) -> None:
    assert one.topics() == other.topics() and said(one) == said(other)
    for topic in one.topics():
        first, second = one[topic], other[topic]
        assert np.array_equal(first.time_ns, second.time_ns), topic
        assert first.columns.keys() == second.columns.keys()
        for name, column in first.columns.items():
            mask = column.mask
            assert np.array_equal(mask, second.columns[name].mask), (topic, name)
            shown = column.values[mask], second.columns[name].values[mask]
            if column.values.dtype.kind in "fiu":
                np.testing.assert_allclose(*shown, rtol=0.0, atol=1e-6)
            else:
                assert (shown[0] == shown[1]).all(), (topic, name)


def cut(content: bytes, folder: Path, name: str, places: Sequence[int]) -> list[Path]:
    """Write the pieces of a file between places: ``log_1.bin``, ``log_2.bin``."""
    stem, dot, ending = name.partition(".")
    paths = []
    for number, (start, end) in enumerate(pairwise((0, *places, len(content))), start=1):
        paths.append(folder / f"{stem}_{number}{dot}{ending}")
        paths[-1].write_bytes(content[start:end])
    return paths


FORMS = [form for form in WRITERS if form not in ("ros2", "arinc429")]


@pytest.mark.parametrize("form", FORMS)
def test_a_file_that_is_cut_has_the_tables_of_the_whole(tmp_path: Path, form: str) -> None:
    """In four, anywhere: within rows, within messages, within packets."""
    write, pattern = WRITERS[form]
    whole = tmp_path / pattern.format(day="20260504")
    write(whole)
    icds = tuple(str(tmp_path / icd) for icd in ICDS.get(form, ()))
    content = whole.read_bytes()
    places = sorted(random.Random(38).sample(range(len(content) // 5, len(content)), 3))
    paths = cut(content, tmp_path, whole.name, places)
    assert_equal_flights(tables(paths, tmp_path / "parts.mcap", icds), tables([whole], tmp_path / "whole.mcap", icds))


def test_a_bag_in_three_files_has_the_tables_of_the_whole(tmp_path: Path) -> None:
    """As recorders split them: each file is a bag of its own, with definitions at its end."""
    messages = small_flight(rows=300)
    rows = sorted(messages.rows, key=lambda row: row[1])
    (whole,) = write_ros2(tmp_path / "whole", messages).glob("*.mcap")
    paths = []
    for number in range(3):
        messages.rows = rows[number * len(rows) // 3 : (number + 1) * len(rows) // 3]
        (file,) = write_ros2(tmp_path / f"part{number}", messages).glob("*.mcap")
        paths.append(file.rename(tmp_path / f"bag_{number}.mcap"))
    alone = whole.rename(tmp_path / "bag.mcap")
    assert_equal_flights(tables(paths, tmp_path / "parts.mcap"), tables([alone], tmp_path / "whole.mcap"))


@given(st.binary(min_size=5, max_size=400), st.sets(st.integers(1, 400), max_size=4), st.integers(1, 70), st.booleans())
@settings(max_examples=40, deadline=None)
def test_joined_files_read_as_one(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, places: set[int], size: int, is_compressed: bool
) -> None:
    content = content.replace(b"\n", b"\0")  # nothing looks like rows: no line feed is put between them
    folder = tmp_path_factory.mktemp("joined")
    paths = cut(content, folder, "x.bin", sorted(place for place in places if place < len(content)))
    if is_compressed:
        for path in paths:
            path.write_bytes(gzip.compress(path.read_bytes()))
    elif content.startswith(b"\x1f\x8b"):
        return
    joined = JoinedSource(paths[0], files=tuple(map(Source, paths)))
    with joined.open() as stream:
        read = b"".join(iter(lambda: stream.read(size), b""))
        stream.seek(len(content) // 2)
        assert stream.read() == content[len(content) // 2 :]
    assert read == content and joined.size == len(content)


@pytest.mark.parametrize(
    ("before", "behind", "glued"),
    [
        ("1,2\n3,4", "5,6\n", True),  # a row without a line end, then a whole row
        ("1,2\n3,4", "# aircraft: B\n", True),
        ("$GPGGA,1*00\n$GPGGA,2*01", "$GPGGA,3*02\n", True),
        ("1 2\n3 4", "5 6\n", True),
        ("1,2\n3,4\n", "5,6\n", False),
        ("1,2\n3", ",4\n5,6\n", False),  # a row that is cut
        ("1,2,3\n4,5", "6,7\n", False),
        ("1,2\n3,4", "\x005,6\n", False),
    ],
)
def test_a_missing_line_end_is_put_between_rows(tmp_path: Path, before: str, behind: str, glued: bool) -> None:
    paths = [tmp_path / "1.csv", tmp_path / "2.csv"]
    for path, content in zip(paths, (before, behind), strict=True):
        path.write_text(content)
    with JoinedSource(paths[0], files=tuple(map(Source, paths))).open() as stream:
        assert stream.read().decode() == before + "\n" * glued + behind


# What run finds.


def rows(first_s: int, last_s: int, zero_s: int = 0, longitude_deg: float = 20.0) -> list[str]:
    """Rows twice a second, of a flight whose every second has figures of its own."""
    found = []
    for half in range(2 * first_s, 2 * last_s):
        time_s = half / 2
        heading_deg = (30.0 * np.sin(time_s / 9.0)) % 360.0
        place = f"{50.0 + time_s * 1e-4:.6f},{longitude_deg:.6f}"
        found.append(f"{time_s - zero_s:.1f},{heading_deg:.4f},{place}")
    return found


def head(aircraft: str = "T-1", start: str = START) -> list[str]:
    return [*([f"# aircraft: {aircraft}"] if aircraft else []), *([f"# start_utc: {start}"] if start else [])]


def text(*lines: str) -> str:
    return "\n".join(lines) + "\n"


def later(seconds: int) -> str:
    return utc_ns_to_iso(iso_to_utc_ns(START)[0] + seconds * NS_PER_S, 0)


Part = Callable[[int, int], str]


def with_headers(first_s: int, last_s: int) -> str:
    return text(*head(), COLUMNS, *rows(first_s, last_s))


KINDS: dict[str, Part] = {
    "headers": with_headers,
    "column row only": lambda first_s, last_s: text(*(head() if not first_s else []), COLUMNS, *rows(first_s, last_s)),
    "rows only": lambda first_s, last_s: text(*([*head(), COLUMNS] if not first_s else []), *rows(first_s, last_s)),
    "no line end": lambda first_s, last_s: with_headers(first_s, last_s).rstrip("\n"),
    "a counter and UTC of their own": lambda first_s, last_s: text(
        *head(start=later(first_s)), COLUMNS, *rows(first_s, last_s, zero_s=first_s)
    ),
    "no UTC": lambda first_s, last_s: text(*head(start=""), COLUMNS, *rows(first_s, last_s)),
    "no UTC, no aircraft": lambda first_s, last_s: text(COLUMNS, *rows(first_s, last_s)),
}
ENDS = (0, 40, 75, 120)


def written(folder: Path, part: Part, ends: Sequence[int] = ENDS, name: str = "log") -> list[Path]:
    """The parts of a flight between some seconds: ``log_1.csv``, ``log_2.csv``."""
    folder.mkdir(exist_ok=True)
    paths = []
    for number, (first_s, last_s) in enumerate(pairwise(ends), start=1):
        paths.append(folder / f"{name}_{number}.csv")
        paths[-1].write_text(part(first_s, last_s))
    return paths


def run(what: Path, out: Path, *, is_isolated: bool = False) -> tuple[Outcome, ...]:
    return run_many([what], out, Configuration(), jobs=1, only_results=True, is_isolated=is_isolated)


def flights(out: Path) -> list[Path]:
    return sorted(path.parent for path in out.glob("*/manifest.json"))


def figures(folder: Path) -> object:
    """What a flight folder says, without what tells of its files."""
    document = json.loads((folder / "summary.json").read_text())
    found = {key: document[key] for key in ("clock", "completeness", "results", "not_assessable")}
    found |= {key: document["flight"][key] for key in ("aircraft", "start_utc", "duration_s")}
    return found | {"topics": document["ledger"]["topics"]}


def assert_close(one: object, other: object, place: str = "") -> None:
    """Equal to 1e-6."""
    if isinstance(one, dict) and isinstance(other, dict):
        assert one.keys() == other.keys(), place
        for key in one:
            assert_close(one[key], other[key], f"{place}/{key}")
    elif isinstance(one, list) and isinstance(other, list):
        assert len(one) == len(other), place
        for number, pair in enumerate(zip(one, other, strict=True)):
            assert_close(*pair, f"{place}[{number}]")
    elif isinstance(one, float) and isinstance(other, float):
        assert one == pytest.approx(other, rel=0.0, abs=1e-6), place
    else:
        assert one == other, place


def assert_is_the_whole(out: Path, part: Part, folder: Path) -> Path:
    """The one flight of OUT has the figures of the parts in one file; returns its folder."""
    (whole,) = written(folder / "whole", part, (ENDS[0], ENDS[-1]))
    run(whole, folder / "whole-out")
    (expected,), (flight,) = flights(folder / "whole-out"), flights(out)
    assert flight.name.startswith("NOTIME") or flight.name == expected.name
    assert_close(figures(flight), figures(expected))
    return flight


@pytest.mark.parametrize("kind", KINDS)
def test_parts_are_one_flight_with_the_figures_of_the_whole(tmp_path: Path, kind: str) -> None:
    paths, out = written(tmp_path / "logs", KINDS[kind]), tmp_path / "out"
    outcomes = run(tmp_path / "logs", out)
    flight = assert_is_the_whole(out, KINDS[kind], tmp_path)
    assert {one.flight_id for one in outcomes} == {flight.name}
    assert outcomes[1].text == f"part of {flight.name}, with log_1.csv"
    parts = load_manifest(flight).parts
    assert [part.name for part in parts] == [path.name for path in paths]
    assert len({part.sha256 for part in parts}) == 3
    (told,) = [one for one in load_document(flight).findings if one.code == "log.parts"]
    assert told.severity == "info" and "log_1.csv" in told.text and told.count == 3


def test_a_file_that_split_has_cut_is_one_flight(tmp_path: Path) -> None:
    """Endings .aa, .ab: only the first is a log by itself."""
    folder = tmp_path / "logs"
    folder.mkdir()
    content = with_headers(0, 120).encode()
    size = len(content) // 3 + 7
    for number, ending in enumerate(("aa", "ab", "ac")):
        (folder / f"log.csv.{ending}").write_bytes(content[number * size : (number + 1) * size])
    run(folder, tmp_path / "out")
    assert_is_the_whole(tmp_path / "out", with_headers, tmp_path)


@pytest.mark.parametrize("kind", ["headers", "rows only"])
def test_what_is_finished_is_not_done_again(tmp_path: Path, kind: str) -> None:
    folder, out = tmp_path / "logs", tmp_path / "out"
    written(folder, KINDS[kind])
    run(folder, out)
    (flight,) = flights(out)
    before = (flight / "summary.json").stat().st_mtime_ns
    planned = plan_many([folder], out, Configuration(), only_results=True)
    assert [one.text for one in planned[1:]] == [f"part of {flight.name}, with log_1.csv"] * 2
    again = run(folder, out)
    assert [one.flight_id for one in again] == [flight.name] * 3 and all(one.was_finished for one in again)
    assert (flight / "summary.json").stat().st_mtime_ns == before
    alone = run(folder / "log_2.csv", out)
    assert flights(out) == [flight] and (kind == "rows only" or [one.flight_id for one in alone] == [flight.name])


@pytest.mark.slow
def test_isolated_runs_find_the_same(tmp_path: Path) -> None:
    folder, out = tmp_path / "logs", tmp_path / "out"
    *_others, last = written(folder, with_headers)
    content = last.read_text()
    last.unlink()
    run(folder, out)
    last.write_text(content)
    run(folder, out, is_isolated=True)
    flight = assert_is_the_whole(out, with_headers, tmp_path)
    again = run(folder, out, is_isolated=True)
    assert [one.flight_id for one in again] == [flight.name] * 3 and all(one.was_finished for one in again)


@pytest.mark.parametrize("order", [(1, 2, 3), (3, 2, 1), (1, 3, 2)])
def test_a_part_that_comes_later_makes_the_flight_again(tmp_path: Path, order: tuple[int, ...]) -> None:
    paths, out, folder = written(tmp_path / "all", with_headers), tmp_path / "out", tmp_path / "logs"
    folder.mkdir()
    for number in order:
        run(paths[number - 1].rename(folder / paths[number - 1].name), out)
    assert_is_the_whole(out, with_headers, tmp_path)


@pytest.mark.slow
def test_a_part_that_changes_makes_the_flight_again(tmp_path: Path) -> None:
    folder, out = tmp_path / "logs", tmp_path / "out"
    *_others, last = written(folder, with_headers, (0, 40, 75, 100))
    run(folder, out)
    last.write_text(with_headers(75, 120))
    run(folder, out)
    assert_is_the_whole(out, with_headers, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["headers", "rows only"])
def test_watch_joins_a_part_that_comes(tmp_path: Path, kind: str) -> None:
    paths, out, folder = written(tmp_path / "all", KINDS[kind]), tmp_path / "out", tmp_path / "logs"
    folder.mkdir()
    for number, path in enumerate(paths):
        new = path.rename(folder / path.name)
        batch = WatchedLogs((new,), out, Configuration(), "none", False, 1, None, False, number == 0, only_results=True)
        assert isinstance(run_batch(batch, silent), tuple)
    assert_is_the_whole(out, KINDS[kind], tmp_path)


def test_names_out_of_order_and_a_part_twice(tmp_path: Path) -> None:
    folder, out = tmp_path / "logs", tmp_path / "out"
    first, second, third = written(folder, with_headers)
    first.rename(folder / "log_8.csv")
    third.rename(folder / "log_0.csv")
    (folder / "copy.csv").write_text(second.read_text())
    outcomes = run(folder, out)
    assert_is_the_whole(out, with_headers, tmp_path)
    assert [one.state for one in outcomes].count("skipped") == 1


@pytest.mark.slow
@pytest.mark.parametrize("aircraft", [("A", "B"), ("", "")])
def test_two_aircraft_in_one_folder_are_two_flights(tmp_path: Path, aircraft: tuple[str, str]) -> None:
    """Told apart by what the logs name, or else by where they are."""
    folder, out = tmp_path / "logs", tmp_path / "out"
    for name, of, longitude_deg in zip("ab", aircraft, (20.0, 20.5), strict=True):

        def part(first_s: int, last_s: int, of: str = of, longitude_deg: float = longitude_deg) -> str:
            return text(*head(of), COLUMNS, *rows(first_s, last_s, longitude_deg=longitude_deg))

        written(folder, part, name=name)
    run(folder, out)
    names = [[part.name for part in load_manifest(flight).parts] for flight in flights(out)]
    assert sorted(names) == [[f"{name}_{number}.csv" for number in (1, 2, 3)] for name in "ab"]


@pytest.mark.parametrize(
    ("second", "count"),
    [
        (with_headers(49, 90), 1),  # 9.5 s from the last record to the next
        (with_headers(52, 90), 2),  # a part is missing
        (with_headers(30, 90), 2),  # it overlaps by 10 s: another recorder
        (text(*head("T-2"), COLUMNS, *rows(40, 90)), 2),  # another aircraft
        (text(*head(), COLUMNS, *rows(40, 90, longitude_deg=21.0)), 2),  # 70 km away
        (text(*head(start=""), COLUMNS, *rows(0, 40)), 2),  # its counter starts again, nothing tells its UTC
    ],
)
def test_what_does_not_go_on_is_another_flight(tmp_path: Path, second: str, count: int) -> None:
    folder = tmp_path / "logs"
    written(folder, with_headers, (0, 40))
    (folder / "log_2.csv").write_text(second)
    run(folder, tmp_path / "out")
    assert len(flights(tmp_path / "out")) == count


def test_together_joins_parts_with_one_missing(tmp_path: Path) -> None:
    first, _second, third = written(tmp_path / "logs", with_headers)
    out = tmp_path / "out"
    run_together([third, first], out, Configuration(), only_results=True)
    (flight,) = flights(out)
    assert flight.name == "20260504T060000Z_T-1"
    assert [part.name for part in load_manifest(flight).parts] == [first.name, third.name]
    topics = load_document(flight).ledger.topics
    assert topics["ins"].rows == len(rows(0, 40)) + len(rows(75, 120)) and "ins.b" not in topics


def part_of(start_s: float, end_s: float, aircraft: str = "") -> PartOfRun:
    device_ns = round(start_s * NS_PER_S), round(end_s * NS_PER_S)
    return PartOfRun("/logs/a_1.bin", "a_1.bin", "0" * 64, 1, "r", aircraft=aircraft, device_ns=device_ns)


@given(st.floats(-20.0, 30.0))
def test_a_gap_below_ten_seconds_goes_on(gap_s: float) -> None:
    before, behind = part_of(0.0, 100.0), part_of(100.0 + gap_s, 200.0)
    between_s = (behind.device_ns[0] - before.device_ns[1]) / NS_PER_S
    assert goes_on(before, behind, is_beside=True) == (-3.0 <= between_s < 10.0)


def test_what_names_and_readers_say_comes_first() -> None:
    before, behind = part_of(0.0, 100.0, "A"), part_of(101.0, 200.0, "A")
    assert goes_on(before, behind, is_beside=True)
    assert goes_on(before, replace(behind, aircraft=""), is_beside=True), "a part need not name it again"
    assert not goes_on(before, replace(behind, aircraft="B"), is_beside=True)
    assert not goes_on(before, replace(behind, reader="other"), is_beside=True)
    assert not goes_on(before, behind, is_beside=False), "counters alone tell nothing of files elsewhere"
    day_ns = 10**9 * NS_PER_S
    first = replace(before, utc_ns=(day_ns, day_ns + 100 * NS_PER_S))
    second = replace(behind, utc_ns=(day_ns + 101 * NS_PER_S, day_ns + 200 * NS_PER_S), path="/others/x.bin")
    assert goes_on(first, second, is_beside=False)


@pytest.mark.slow
@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "is_text"),
    [
        ("cases/x0_whole_flight.csv.gz", True),
        ("dataflash/TestLog2_REENCODED_plane.BIN", False),
        ("inertial/gv_ff02.csv", True),
        ("g1000/log_220417_125002_LFQA.csv", True),
    ],
)
def test_recorded_flights_in_three_parts(tmp_path: Path, name: str, is_text: bool) -> None:
    path, folder = real_log(name), tmp_path / "logs"
    content = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    plain = path.name.removesuffix(".gz")
    folder.mkdir()
    places = [len(content) // 3, 2 * len(content) // 3]
    if is_text:
        places = [content.index(b"\n", place) + 1 for place in places]
    for part in cut(content, folder, plain, places):
        part.rename(folder / re.sub(r"^.*_(\d)(\.\w+)$", r"part_\1\2", part.name))
    (tmp_path / plain).write_bytes(content)
    run(tmp_path / plain, tmp_path / "whole")
    run(folder, tmp_path / "out")
    (expected,), (flight,) = flights(tmp_path / "whole"), flights(tmp_path / "out")
    assert flight.name == expected.name and len(load_manifest(flight).parts) == 3
    assert_close(figures(flight), figures(expected))
