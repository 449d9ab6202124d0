"""The verb check: what it tells of built logs of every format, that it writes nothing; results that lean on damage."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from typer.testing import CliRunner

from groundstation.cli.main import app
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.verbs import describe
from groundstation.pipeline.verbs.conversions import convert_many
from tests.readers.dataflash_writer import DataFlash
from tests.readers.ulog_writer import ATTITUDE, BARO, UlogWriter
from tests.saved import load

SAMPLES = Path(__file__).parents[1] / "sample_logs"
GARBAGE = b"\xff" * 64


def groundstation(*arguments: str | Path) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call in this process."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, result.stdout, result.stderr


def checked(*arguments: str | Path) -> tuple[int, dict[str, Any]]:
    code, out, _ = groundstation("check", "--json", *arguments)
    (entry,) = json.loads(out)
    return code, entry


def ulog(path: Path, rows: int = 200) -> Path:
    """20 ms apart; at row 100 a drop-out of 400 ms, at row 150 64 bytes of nothing; cut in a message."""
    log = UlogWriter().flags().format(ATTITUDE).format(BARO)
    log.subscribe(0, "vehicle_attitude").subscribe(1, "vehicle_air_data")
    for row in range(rows):
        time_us = 1_000_000 + 20_000 * row + (400_000 if row >= 100 else 0)
        if row == 100:
            log.dropout(400)
        if row == 150:
            log.data += GARBAGE
        log.row(0, "Q4f", time_us, 1.0, 0.0, 0.0, 0.0).row(1, "Qf", time_us + 3, 101_325.0 - row)
    path.write_bytes(bytes(log.data[:-5]))
    return path


def dataflash(path: Path) -> Path:
    """Records with the recorder's count of losses, bytes of nothing between, and a range that is left."""
    log = DataFlash()
    log.define(130, "ATT", "QccCC", "TimeUS,Roll,Pitch,Yaw,ErrYaw")
    log.define(131, "DSF", "QI", "TimeUS,Dp")
    for row in range(100):
        log.write("ATT", 1_000_000 + 20_000 * row, 100, 9_500 if row == 40 else 50, 9_000, 0)
        if row % 10 == 0:
            log.write("DSF", 1_000_000 + 20_000 * row, 7 if row < 50 else 12)
    half = len(log.records) // 2
    path.write_bytes(b"".join(log.records[:half]) + GARBAGE + b"".join(log.records[half:]))
    return path


def table(path: Path) -> Path:
    """A flight east: a row too short, a latitude out of range, and a heading that stands still in a turn."""
    lines = ["time_s,ins.true_heading_deg,gnss.latitude_deg,gnss.velocity_north_mps,gnss.velocity_east_mps"]
    for row in range(600):
        heading = (
            row if row < 300 else max(row - 100, 300)
        ) * 0.3  # stands from row 300 to 400, and goes on from there
        turn_rad = math.radians(row * 0.3)
        latitude = 912.0 if row == 50 else 48.0 + row * 1e-4
        north, east = 60.0 * math.cos(turn_rad), 60.0 * math.sin(turn_rad)
        lines.append(f"{row / 10},{heading:.4f},{latitude:.7f},{north:.3f},{east:.3f}" if row != 20 else "2.0,6.0")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_ulog_with_a_dropout_skipped_bytes_and_a_cut(tmp_path: Path) -> None:
    code, entry = checked(ulog(tmp_path / "a.ulg"))
    ledger = entry["ledger"]
    assert (code, entry["state"], entry["exit_code"]) == (3, "data_lost", 3)
    assert ledger["dropouts"] == {"count": 1, "total_s": 0.4}
    (dropout,) = (span for span in ledger["spans"] if span["cause"] == "dropout")
    assert (dropout["start_s"], dropout["length_s"], dropout["topic"]) == (1.98, 0.4, "")
    corrupt = [damage for damage in ledger["damages"] if damage["kind"] == "corrupt"]
    assert [damage["count"] for damage in corrupt] == [64]
    assert ledger["truncated"]["place"].startswith("byte ")
    assert ledger["bytes_skipped"] == 64 + ledger["truncated"]["count"]
    assert ledger["topics"]["raw.vehicle_attitude"]["gaps"]["listed"] == [["+0:03.0", 0.42]]


def test_a_dataflash_log_with_skipped_bytes_and_counted_losses(tmp_path: Path) -> None:
    code, entry = checked(dataflash(tmp_path / "a.BIN"))
    ledger = entry["ledger"]
    assert code == 3 and ledger["bytes_skipped"] == 64
    (counter,) = ledger["topics"]["raw.DSF"]["sequences"]
    assert (counter["before"], counter["lost"], len(counter["listed"])) == (7, 5, 1)
    pitch = ledger["topics"]["ins"]["fields"]["pitch_deg"]
    assert pitch["out_of_range"] == 1 and pitch["first_out_of_range"]["range"] == [-90.0, 90.0]


def test_a_table_with_a_short_row_a_wild_value_and_a_stuck_heading(tmp_path: Path) -> None:
    code, entry = checked(table(tmp_path / "a.csv"))
    topics = entry["ledger"]["topics"]
    assert code == 3
    assert topics["gnss"]["fields"]["latitude_deg"]["first_out_of_range"]["record"] == 52  # line of the file
    (stuck,) = topics["ins"]["fields"]["true_heading_deg"]["stuck"]
    assert (stuck["record"], stuck["length_s"], stuck["samples"], stuck["value"]) == (302, 10.0, 101, 90.0)
    causes = {span["cause"]: span["start_s"] for span in entry["ledger"]["spans"]}
    assert causes["stuck"] == 30.0 and causes["out_of_range"] == 5.0 and causes["dropped_rows"] == 1.9


def test_the_table_for_people_names_what_is_wrong(tmp_path: Path) -> None:
    code, text, err = groundstation("check", table(tmp_path / "a.csv"))
    assert code == 3 and err == ""
    for part in ("thresholds:", "nominal Hz", "stuck values", "values out of range", "dropped_rows", "data lost"):
        assert part in text, part
    assert "version 1" in text and "ins.true_heading_deg" in text


@pytest.mark.parametrize("verb", ["check", "info"])
def test_equal_remarks_on_several_sensors_are_one_line_that_names_them(verb: str, tmp_path: Path) -> None:
    log = DataFlash()
    names = ("BARO", "BAR2", "BAR3")
    for kind, name in enumerate(names, 130):
        log.define(kind, name, "Qff", "TimeUS,Alt,Press")
    for row in range(300):
        log.write(names[row % 3], 1_000_000 + 20_000 * row, 0.1 * row, 101_325.0 - row)
    path = tmp_path / "three.bin"
    path.write_bytes(b"".join(log.records))
    _code, told, _ = groundstation(verb, path)
    (line,) = [line for line in told.splitlines() if "from measured pressure" in line]
    assert line.startswith("info  baro.1, baro.2, baro.3: from measured pressure by the standard atmosphere")


def test_exit_codes(tmp_path: Path) -> None:
    good, damaged = SAMPLES / "taxi-good.csv", SAMPLES / "taxi-damaged.csv"
    bad = tmp_path / "bad.bin"
    bad.write_bytes(b"\x00" * 50)
    assert groundstation("check", good)[0] == 0
    assert groundstation("check", good, "--fail-on", "fail")[0] == 0
    assert groundstation("check", damaged)[0] == 3
    assert groundstation("check", damaged, "--fail-on", "warn")[0] == 4
    code, out, err = groundstation("check", good, bad, damaged)
    assert code == 1 and "bad.bin" in err and "3 logs: 1 done, 1 with data lost" in err
    assert "taxi-good.csv" in out and "taxi-damaged.csv" in out
    assert groundstation("check", tmp_path)[0] == 2
    assert groundstation("check", good, tmp_path / "none")[0] == 2
    assert groundstation("check", "-q", good)[1] == ""


def test_it_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary, here = tmp_path / "tmp", tmp_path / "here"
    temporary.mkdir()
    here.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.chdir(here)
    log = table(tmp_path / "a.csv")
    before = log.stat().st_mtime_ns
    assert groundstation("check", log)[0] == 3
    assert list(temporary.iterdir()) == list(here.iterdir()) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "here", "tmp"]
    assert log.stat().st_mtime_ns == before


@pytest.mark.parametrize("build", [ulog, dataflash, table])
def test_the_mcap_tells_what_its_log_told(tmp_path: Path, build: Any) -> None:
    log, mcap = (
        build(tmp_path / {"ulog": "a.ulg", "dataflash": "a.BIN", "table": "a.csv"}[build.__name__]),
        tmp_path / "a.mcap",
    )
    convert_many([log], mcap)
    (code, first), (mcap_code, second) = checked(log), checked(mcap)
    assert code == mcap_code == 3
    assert second["ledger"] == first["ledger"]
    assert second["findings"] == first["findings"]


@pytest.mark.parametrize("build", [ulog, dataflash, table])
def test_the_ledger_obeys_the_schema_of_the_summary(tmp_path: Path, build: Any) -> None:
    schema = json.loads((SAMPLES.parent / "schemas/summary.schema.json").read_text(encoding="utf-8"))
    strict = {**schema["$defs"]["ledger"], "additionalProperties": False, "$defs": schema["$defs"]}
    _, entry = checked(build(tmp_path / {"ulog": "a.ulg", "dataflash": "a.BIN", "table": "a.csv"}[build.__name__]))
    jsonschema.Draft202012Validator(strict).validate(entry["ledger"])
    assert {*entry["ledger"], "pauses"} == set(strict["properties"])  # written where there are some


@pytest.mark.parametrize("build", [ulog, table])
def test_other_thresholds_count_the_topics_of_an_mcap_anew(tmp_path: Path, build: Any) -> None:
    log, mcap = build(tmp_path / {"ulog": "a.ulg", "table": "a.csv"}[build.__name__]), tmp_path / "a.mcap"
    limits = tmp_path / "mine.toml"
    limits.write_text(
        'version = 1\nname = "mine"\n[gaps]\nmin_s = 0.5\n[stuck]\nmin_s = 30.0\n'
        "[ranges.gnss]\nvelocity_north_mps = [-10, 10]\n",
        encoding="utf-8",
    )
    convert_many([log], mcap)
    (_, default), (_, first), (code, second) = (
        checked(log),
        checked(log, "--thresholds", limits),
        checked(mcap, "--thresholds", limits),
    )
    assert code == 3 and second["ledger"]["thresholds"]["name"] == "mine"
    assert first["ledger"]["topics"] == second["ledger"]["topics"] != default["ledger"]["topics"]
    assert first["ledger"]["spans"] == second["ledger"]["spans"]
    assert {finding["text"] for finding in first["findings"]} == {finding["text"] for finding in second["findings"]}


def test_a_damaged_mcap_is_counted_anew(tmp_path: Path) -> None:
    mcap = tmp_path / "a.mcap"
    convert_many([SAMPLES / "taxi-good.csv"], mcap)
    content = mcap.read_bytes()
    mcap.write_bytes(content[: len(content) // 2])
    code, entry = checked(mcap)
    assert code == 3 and entry["ledger"]["truncated"] is not None
    whole = checked(SAMPLES / "taxi-good.csv")[1]["ledger"]["topics"]
    assert 0 < entry["ledger"]["topics"]["gnss"]["rows"] < whole["gnss"]["rows"]


def test_thresholds_are_checked_and_a_file_wins_over_the_section(tmp_path: Path) -> None:
    log = SAMPLES / "taxi-damaged.csv"
    config, own = tmp_path / "c.toml", tmp_path / "t.toml"
    config.write_text('[thresholds]\nversion = 1\nname = "of the section"\n[thresholds.gaps]\nmin_s = 10.0\n', "utf-8")
    own.write_text('version = 1\nname = "of the file"\n', "utf-8")
    _, by_section = checked(log, "--config", config)
    _, by_file = checked(log, "--config", config, "--thresholds", own)
    assert by_section["ledger"]["thresholds"]["name"] == "of the section"
    assert by_section["ledger"]["topics"]["gnss"]["gaps"]["count"] == 0
    assert by_file["ledger"]["thresholds"]["name"] == "of the file"
    assert by_file["ledger"]["topics"]["gnss"]["gaps"]["count"] == 1
    own.write_text("version = 1\n[gaps]\nmin = 10.0\n", "utf-8")
    for verb in (["check", log], ["run", log, "-o", tmp_path / "out"]):
        code, _, err = groundstation(*verb, "--thresholds", own)
        assert code == 2 and "t.toml, key thresholds.gaps.min" in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_an_answer_that_leans_on_a_damaged_span_says_so(finished_run: Callable[..., Outcome], tmp_path: Path) -> None:
    sound = finished_run("taxi-good")
    summary = load(Path(sound.folder)).summary
    assert not [one for one in summary["findings"] if one["code"].endswith("damaged_span")]
    start_s = max(summary["results"]["heading"]["segments"], key=lambda one: one["end_s"] - one["start_s"])["start_s"]
    limits = {"version": 1, "ranges": {"gnss": {"ground_speed_mps": [0, 50]}}}
    rows = (SAMPLES / "taxi-good.csv").read_text(encoding="utf-8").splitlines()
    head = next(number for number, line in enumerate(rows) if not line.startswith("#"))
    times = [float(line.split(",")[0]) for line in rows[head + 1 :]]
    at = next(number for number, time in enumerate(times) if time - times[0] > start_s + 1.0)
    broken = tmp_path / "broken.csv"
    cells = rows[head + 1 + at].split(",")
    rows[head + 1 + at] = ",".join(cells[:-2])  # a row too short, within the segment
    broken.write_text("\n".join(rows) + "\n", encoding="utf-8")
    (outcome,) = run_many([broken], tmp_path / "out", Configuration({"thresholds": limits}), only_results=True)
    summary = load(Path(outcome.folder)).summary
    (finding,) = (one for one in summary["findings"] if one["code"] == "heading.damaged_span")
    assert finding["severity"] == "warn" and "dropped rows" in finding["text"]
    assert summary["ledger"]["thresholds"]["name"] == "user"
    first = rows[:]
    first[head + 1 + at] = ",".join(cells)
    first[head + 2] = "0"  # the same loss at the parking stand, which no answer rests on
    broken.write_text("\n".join(first) + "\n", encoding="utf-8")
    (outcome,) = run_many([broken], tmp_path / "out2", Configuration(), only_results=True)
    codes = {one["code"] for one in load(Path(outcome.folder)).summary["findings"]}
    assert "data.dropped_rows" in codes and "heading.damaged_span" not in codes


def test_a_receiver_that_falls_silent_is_a_loss_for_every_verb_unless_limits_allow_it(tmp_path: Path) -> None:
    """Positions for 40 of 100 s at 1 Hz: 60 records fewer than their rate leads one to expect."""
    log, allowed, mcap = tmp_path / "a.csv", tmp_path / "allowed.toml", tmp_path / "a.mcap"
    rows = [f"{t},{t % 9},{'50.0,30.0' if t <= 40 else ','}" for t in range(101)]
    log.write_text("\n".join(["time_s,ins.roll_deg,gnss.latitude_deg,gnss.longitude_deg", *rows]) + "\n")
    allowed.write_text("version = 1\n[gaps]\nend_s = 60.0\n")
    code, entry = checked(log)
    found = [one for one in entry["findings"] if one["code"] == "data.breaks_off"]
    assert [(one["topic"], one["count"]) for one in found] == [("gnss", 60)]
    assert entry["ledger"]["topics"]["gnss"]["losses"] == {"breaks_off": 60}
    codes = [code, groundstation("info", log)[0], groundstation("convert", log, "-o", mcap)[0]]
    codes += [groundstation("run", log, "-o", tmp_path / "out", "--only", "results")[0], checked(mcap)[0]]
    assert codes == [3, 3, 3, 3, 3]
    assert [checked(one, "--thresholds", allowed)[0] for one in (log, mcap)] == [0, 0]


def test_a_profile_serves_the_logs_that_it_describes(tmp_path: Path) -> None:
    """Of several logs the others are read as they are known, as `run --together` does."""
    table, profile = tmp_path / "imu.csv", tmp_path / "imu.toml"
    table.write_text("ms,wz\n" + "".join(f"{20 * k},{k % 5}\n" for k in range(100)), encoding="utf-8")
    profile.write_text(
        'name = "imu"\n[recognise]\ncolumns = ["ms", "wz"]\n[time]\nkind = "seconds"\ncolumn = "ms"\nunit = "ms"\n'
        '[columns]\nwz = { field = "imu.rate_z_dps", unit = "dps" }\n',
        encoding="utf-8",
    )
    flat = SAMPLES / "taxi-short.csv"
    code, out, _ = groundstation("check", "--json", table, flat, "--profile", profile)
    found = json.loads(out)
    assert code == 0 and [one["state"] for one in found] == ["done", "done"], out[:300]
    assert groundstation("check", flat, "--profile", profile)[0] == 1


def test_tables_whose_rows_were_counted_are_made_without_a_move(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from groundstation.pipeline.verbs import export
    from groundstation.tables import growing

    rows = 70_000  # more than a batch has
    log, stored = tmp_path / "long.csv", tmp_path / "long.mcap"
    cells = (f"{0.02 * row:.2f},{47.0 + 1e-6 * row:.6f},8.5,{row % 90}.0" for row in range(rows))
    log.write_text("\n".join(["time_s,ins.latitude_deg,ins.longitude_deg,ins.true_heading_deg", *cells, ""]))
    assert groundstation("convert", log, "-o", stored)[0] == 0
    moves: list[int] = []
    moved = growing._moved

    def counted(values: Any, start: int, room: int, dtype: Any) -> Any:
        moves.append(start)
        return moved(values, start, room, dtype)

    monkeypatch.setattr(growing, "_moved", counted)
    for path in (log, stored):
        assert groundstation("check", "--for", "heading", path)[0] == 4  # nothing to judge it by
        flight, *_rest = export._read(path, Configuration())
        assert len(flight["ins"]) == rows
    assert not moves


def test_a_gap_is_no_loss_beside_the_end_that_is_cut_off_and_a_damaged_mcap_is_one(tmp_path: Path) -> None:
    log = DataFlash()
    log.define(130, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    for row in range(100):
        log.write("ATT", 1_000_000 + 20_000 * row + (900_000 if row > 50 else 0), 100, 50, 9_000)
    path, target = tmp_path / "cut.BIN", tmp_path / "cut.mcap"
    path.write_bytes(log.content[:-3])
    code, entry = checked(path)
    assert code == 3 and "data.gaps" in {one["code"] for one in entry["findings"]}
    assert entry["text"].startswith("end cut off, ")
    (converted,) = convert_many([path], target)
    assert converted.loss == "end cut off"
    told = groundstation("info", path, dataflash(tmp_path / "noise.BIN"))[1].splitlines()
    assert told[0].endswith("  end cut off") and told[1].endswith("  data lost")
    (cut := tmp_path / "half.mcap").write_bytes(target.read_bytes()[: target.stat().st_size // 2])
    assert groundstation("info", cut, path)[1].splitlines()[0].endswith("  end cut off")
    content = bytearray(target.read_bytes())
    content[len(content) // 3] ^= 0xFF
    target.write_bytes(content)
    code, entry = checked(target)
    assert code == 3 and any(one["code"].startswith("store.") for one in entry["findings"])
    assert entry["text"].startswith("data lost, ")


def test_an_error_of_ours_on_one_log_does_not_keep_info_from_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual, bad, good = describe.describe, dataflash(tmp_path / "bad.BIN"), dataflash(tmp_path / "good.BIN")

    def failing(path: Path, *arguments: Any, **named: Any) -> describe.Description:
        if path == bad:
            raise ValueError("cannot convert float NaN to integer")
        return usual(path, *arguments, **named)

    monkeypatch.setattr(describe, "describe", failing)
    code, out, error = groundstation("info", bad, good)
    assert code == 1 and "good.BIN  dataflash" in out
    assert "error: bad.BIN: internal error (ValueError: cannot convert float NaN to integer)" in error
    assert "Traceback" not in error
