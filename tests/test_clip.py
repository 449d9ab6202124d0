"""``clip``: a part of a flight holds exactly its records, says what it was cut from, and is an input of every verb."""

import json
import shutil
from errno import ENOSPC
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.base.errors import UsageError
from groundstation.base.records import Damage, RecordBatch
from groundstation.base.units import NS_PER_S
from groundstation.cli.main import app
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.verbs.clip import Wanted, clip
from groundstation.pipeline.verbs.describe import describe
from groundstation.store.reader import StorePart, read, read_info
from tests.recording_contents import Contents
from tests.saved import load
from tests.store.test_store import joined

SAMPLES = Path(__file__).parents[1] / "sample_logs"
SAME = ("record_index", "time_ns")


def groundstation(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call in this process."""
    result = CliRunner().invoke(app, list(arguments))
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The MCAP of the accepted sample log, 304.2 s."""
    path = tmp_path_factory.mktemp("whole") / "whole.mcap"
    convert_log(open_log(SAMPLES / "taxi-good.csv"), path)
    return path


def part_of(source: Path, target: Path, start: str | None, end: str | None, *topics: str) -> Path:
    """A part without recording."""
    outcome = clip(source, target, Wanted(start, end, topics), with_recording=False)
    assert outcome.folder == str(target) and not target.with_suffix(".rrd").exists()
    return target


def records(path: Path) -> dict[str, RecordBatch]:
    """All records of a store file by topic; fails at any damage."""
    found: dict[str, list[RecordBatch]] = {}
    for item in read(path):
        assert not isinstance(item, Damage), item
        if isinstance(item, RecordBatch):
            found.setdefault(item.topic, []).append(item)
    return {topic: joined(batches) for topic, batches in found.items()}


def assert_same(part: RecordBatch, other: RecordBatch) -> None:
    for name in SAME:
        assert np.array_equal(getattr(part, name), getattr(other, name)), name
    columns = {**part.columns, "device": part.device_time_ns}
    others = {**other.columns, "device": other.device_time_ns}
    for name, column in columns.items():
        known = column.mask
        assert np.array_equal(known, others[name].mask)
        is_float = column.values.dtype.kind == "f"
        assert np.array_equal(column.values[known], others[name].values[known], equal_nan=is_float), name


@pytest.mark.parametrize(
    ("start", "end"), [("60", "120.05"), ("+1:00", "+02:00.05"), ("2026-05-04T06:01:00Z", "2026-05-04T06:02:00.05Z")]
)
def test_a_part_holds_exactly_the_records_in_its_range(whole: Path, tmp_path: Path, start: str, end: str) -> None:
    part = records(part_of(whole, tmp_path / "part.mcap", start, end))
    zero_ns = read_info(whole).start_ns or 0
    low, high = zero_ns + 60 * NS_PER_S, zero_ns + 120_050_000_000
    rows = 0
    for topic, batch in records(whole).items():
        assert batch.time_ns is not None
        inside = (batch.time_ns >= low) & (batch.time_ns < high)
        assert (topic in part) == inside.any()
        if inside.any():
            assert_same(part[topic], batch.take(inside))
            rows += int(inside.sum())
    assert rows > 1000


def test_parts_that_touch_hold_every_record_once(whole: Path, tmp_path: Path) -> None:
    ends = [None, "100", "200.1", None]
    parts = [
        records(part_of(whole, tmp_path / f"{number}.mcap", ends[number], ends[number + 1])) for number in range(3)
    ]
    for topic, batch in records(whole).items():
        assert_same(joined([part[topic] for part in parts if topic in part]), batch)


def test_log_mcap_and_flight_folder_give_the_same_part(whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "flight"
    folder.mkdir()
    shutil.copy(whole, folder / "flight.mcap")
    sources = (SAMPLES / "taxi-good.csv", whole, folder)
    parts = [
        part_of(source, tmp_path / f"{number}.mcap", "10", "20").read_bytes() for number, source in enumerate(sources)
    ]
    assert len(set(parts)) == 1, "to the byte, whatever the part is called"
    assert len(list(tmp_path.iterdir())) == 4, "a temporary file stayed behind"


def test_a_part_has_the_name_of_its_file(whole: Path, tmp_path: Path) -> None:
    part = part_of(whole, tmp_path / "part.mcap", "10", "20")
    assert read_info(part).source_name == "part.mcap" and b"part.mcap" not in part.read_bytes()
    moved = part.rename(tmp_path / "moved.mcap")
    assert read_info(moved).source_name == "moved.mcap" and open_log(moved).source.name == "moved.mcap"
    assert describe(moved).facts["log"] == "moved.mcap, read as flat-csv"


def test_metadata_says_what_it_was_cut_from(whole: Path, tmp_path: Path) -> None:
    first, second = read_info(whole), read_info(part_of(whole, tmp_path / "a.mcap", "60", "120", "ins", "gn*"))
    assert {key: value for key, value in second.metadata.items() if key.startswith("clip.")} == {
        "clip.source": "taxi-good.csv",
        "clip.source_sha256": first.source_sha256,
        "clip.from": "2026-05-04T06:01:00.000Z",
        "clip.from_s": "60",
        "clip.to": "2026-05-04T06:02:00.000Z",
        "clip.to_s": "120",
        "clip.zero_s": "60.000000000",
        "clip.topics": "ins gn*",
    }
    assert second.metadata["aircraft"] == first.metadata["aircraft"] and second.clock == first.clock
    assert set(second.ledger.topics) == {"ins", "gnss"}
    assert second.ledger.topics["gnss"].rows == 600
    assert second.start_ns == (first.start_ns or 0) + 60 * NS_PER_S


def test_a_part_of_a_part_is_told_in_times_of_the_flight(whole: Path, tmp_path: Path) -> None:
    part = part_of(whole, tmp_path / "a.mcap", "60", "120")
    metadata = read_info(part_of(part, tmp_path / "b.mcap", "10", "20")).metadata
    assert (metadata["clip.source"], metadata["clip.from_s"], metadata["clip.to_s"]) == ("taxi-good.csv", "70", "80")
    assert metadata["clip.zero_s"] == "70.000000000"
    assert metadata["clip.from"] == "2026-05-04T06:01:10.000Z"


@pytest.mark.slow
def test_two_parts_of_one_log_are_two_flights_of_a_run(whole: Path, tmp_path: Path) -> None:
    parts = [part_of(whole, tmp_path / "a.mcap", "0", "100"), part_of(whole, tmp_path / "b.mcap", "100", "200")]
    outcomes = run_many(parts, tmp_path / "out", Configuration(), jobs=1, with_pdf=False)
    assert [outcome.state for outcome in outcomes] == ["done", "done"]
    assert len({outcome.flight_id for outcome in outcomes}) == 2
    source = load(Path(outcomes[0].folder)).summary["flight"]["source"]
    assert source["name"] == "a.mcap" and len(source["sha256"]) == 64


def damaged(path: Path, whole: Path, at_s: float) -> tuple[float, float]:
    """Copy of a file with one byte of the GNSS chunk around a time changed; the chunk's span in flight seconds."""
    from mcap.reader import make_reader

    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None and summary.statistics is not None
    channel = next(one.id for one in summary.channels.values() if one.topic == "gnss")
    zero_ns = summary.statistics.message_start_time
    time_ns = zero_ns + round(at_s * NS_PER_S)
    chunk = next(
        one
        for one in summary.chunk_indexes
        if channel in one.message_index_offsets and one.message_start_time <= time_ns <= one.message_end_time
    )
    content = bytearray(whole.read_bytes())
    content[chunk.chunk_start_offset + chunk.chunk_length - 40] ^= 0xFF
    path.write_bytes(content)
    return tuple((ns - zero_ns) / NS_PER_S for ns in (chunk.message_start_time, chunk.message_end_time))  # type: ignore[return-value]


def test_only_chunks_that_overlap_are_read(whole: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.mcap"
    low_s, high_s = damaged(broken, whole, 200.0)
    assert any(isinstance(item, Damage) for item in read(broken))
    before = clip(broken, tmp_path / "a.mcap", Wanted(end=str(low_s)), with_recording=False)
    assert before.state == "done"
    within = clip(broken, tmp_path / "b.mcap", Wanted(str(low_s), str(high_s)), with_recording=False)
    assert within.state == "data_lost" and within.code == 3
    assert read_info(tmp_path / "b.mcap").findings[-1].code.startswith("store.")
    elsewhere = clip(broken, tmp_path / "c.mcap", Wanted(str(low_s), str(high_s), ("ins",)), with_recording=False)
    assert elsewhere.state == "done"
    part = StorePart(0, (read_info(whole).start_ns or 0) + 60 * NS_PER_S)
    assert sum(isinstance(item, RecordBatch) for item in read(whole, part)) < sum(
        isinstance(item, RecordBatch) for item in read(whole)
    )


def test_a_cut_file_gives_the_part_that_is_left(whole: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[:-20_000])
    outcome = clip(cut, tmp_path / "a.mcap", Wanted("0", "30"), with_recording=False)
    assert outcome.state == "data_lost"
    part = records(part_of(whole, tmp_path / "b.mcap", "0", "30"))
    for topic, batch in records(tmp_path / "a.mcap").items():
        assert_same(batch, part[topic])


def test_losses_of_the_log_stay_with_the_part_they_lie_in(tmp_path: Path) -> None:
    """The damaged sample is cut at its end and its clock stepped: only the last part lacks anything."""
    log = SAMPLES / "taxi-damaged.csv"
    early = clip(log, tmp_path / "a.mcap", Wanted("0", "60"), with_recording=False)
    late = clip(log, tmp_path / "b.mcap", Wanted("200", None), with_recording=False)
    assert (early.state, late.state) == ("done", "data_lost")
    codes = [{one.code for one in read_info(tmp_path / f"{name}.mcap").findings} for name in "ab"]
    assert "data.truncated" not in codes[0] and {"data.truncated", "clock.backward_step"} <= codes[1]
    zero_s = float(read_info(tmp_path / "b.mcap").metadata["clip.zero_s"])
    convert_log(open_log(log), tmp_path / "whole.mcap")
    spans = [read_info(tmp_path / name).ledger.spans for name in ("whole.mcap", "b.mcap")]
    kept = {one.cause: one.start_s for one in spans[1]}
    (truncated,) = [one.start_s for one in spans[0] if one.cause == "truncated"]
    assert kept["truncated"] == pytest.approx(truncated - zero_s, abs=2e-3)


def test_a_log_without_utc_is_cut_by_flight_seconds(tmp_path: Path) -> None:
    log = SAMPLES / "taxi-notime.csv"
    info = read_info(part_of(log, tmp_path / "a.mcap", "50", "60"))
    assert not info.has_utc and info.metadata["clip.from_s"] == "50" and "clip.from" not in info.metadata
    with pytest.raises(UsageError, match="the flight has no UTC"):
        clip(log, tmp_path / "b.mcap", Wanted("2026-05-04T06:00:00Z"), with_recording=False)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--from", "120", "--to", "60"], "an end after its start"),
        (["--from", "60", "--to", "60"], "an end after its start"),
        (["--from", "400"], "0 to 304.2 s"),
        (["--from", "1e300"], "0 to 304.2 s"),
        (["--to", "2020-01-01T00:00:00Z"], "0 to 304.2 s"),
        (["--from", "soon"], "flight seconds, +mm:ss or ISO UTC"),
        (["--from", "nan"], "flight seconds, +mm:ss or ISO UTC"),
        (["--topics", "nonsense*"], "gnss, ins"),
    ],
)
def test_what_cannot_be_cut_is_one_line(whole: Path, tmp_path: Path, arguments: list[str], told: str) -> None:
    code, out, err = groundstation("clip", str(whole), *arguments, "-o", str(tmp_path / "part.mcap"))
    assert (code, out) == (2, "") and err.count("\n") == 1 and told in err
    assert not list(tmp_path.iterdir())


def test_nothing_is_overwritten_without_force(whole: Path, tmp_path: Path) -> None:
    part = tmp_path / "part.mcap"
    for name in ("part.mcap", "part.rrd"):
        (tmp_path / name).write_text("mine", encoding="utf-8")
        code, _, err = groundstation("clip", str(whole), "--to", "5", "-o", str(part))
        assert code == 2 and "-f" in err and (tmp_path / name).read_text(encoding="utf-8") == "mine"
        (tmp_path / name).unlink()
    for target in (whole, tmp_path, tmp_path / "part.rrd"):
        code, _, err = groundstation("clip", str(whole), "--to", "5", "-o", str(target), "-f")
        assert code == 2 and err.count("\n") == 1
    assert groundstation("clip", str(tmp_path / "none.mcap"), "-o", str(part))[0] == 2
    assert groundstation("clip", str(tmp_path), "-o", str(part))[0] == 2


def test_a_full_disk_is_told_with_the_file(whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(ENOSPC, "No space left on device")

    monkeypatch.setattr("groundstation.store.writer.StoreWriter.write", refuse)
    code, _, err = groundstation("clip", str(whole), "--to", "5", "-o", str(tmp_path / "part.mcap"))
    assert (code, err) == (1, f"error: {tmp_path / 'part.mcap'}: No space left on device\n")
    assert not list(tmp_path.iterdir())


def test_the_recording_stands_beside_it(whole: Path, tmp_path: Path) -> None:
    part = tmp_path / "part.mcap"
    code, text, err = groundstation("clip", str(whole), "--from", "60", "--to", "120", "-o", str(part), "--json")
    (told,) = json.loads(text)
    size = f"recording {part.with_suffix('.rrd').stat().st_size / 1e6:.2f} MB)"
    assert "s long, " in told["text"] and told["text"].endswith(size), told["text"]
    assert (code, err) == (0, "") and told["folder"] == str(part)
    contents = Contents(tmp_path / "part.rrd")
    assert contents.timelines == {"utc", "flight_time"}
    time_ns, _ = contents.scalars("/raw/ins/velocity")
    assert len(time_ns) == 600 and time_ns[0] == 0 and time_ns[-1] < 60 * NS_PER_S
    assert sorted(path.name for path in tmp_path.iterdir()) == ["part.mcap", "part.rrd"]
