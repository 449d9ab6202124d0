"""The flat CSV, sentence by sentence of the contract."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import MAX_BATCH_ROWS, Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.readers import registry, rows, table_reader

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write(text: str | bytes, name: str = "log.csv", encoding: str = "utf-8") -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        return path

    return write


class Read:
    """Everything a log yields, batches of a topic joined."""

    def __init__(self, path: Path, profile: Path | None = None) -> None:
        items: list[Item] = list(registry.read(path, profile))
        assert isinstance(items[0], LogHeader)
        self.header = items[0]
        self.batches = [item for item in items if isinstance(item, RecordBatch)]
        self.damages = [item for item in items if isinstance(item, Damage)]
        self.remarks = {item.code: item for item in items if isinstance(item, Remark)}
        self.topics = list(dict.fromkeys(batch.topic for batch in self.batches))

    def values(self, topic: str, field: str) -> list[Any]:
        """Values of a field, None where absent."""
        found = []
        for batch in self.batches:
            if batch.topic == topic:
                column = batch.columns[field]
                found += [v if p else None for v, p in zip(column.values.tolist(), column.mask, strict=True)]
        return found

    def rows(self, topic: str) -> list[int]:
        return [int(row) for batch in self.batches if batch.topic == topic for row in batch.record_index]

    def times(self, topic: str) -> list[int | None]:
        return [
            int(time) if known else None
            for batch in self.batches
            if batch.topic == topic
            for time, known in zip(batch.device_time_ns.values, batch.device_time_ns.mask, strict=True)
        ]

    def damage(self, kind: str) -> Damage:
        (found,) = [damage for damage in self.damages if damage.kind == kind]
        return found


def test_metadata_header_and_rows(write: Write) -> None:
    log = Read(write("# aircraft: RA-1\n# note: a: b\ntime_s,ins.roll_deg\n0.5,1.25\n1.5,-2\n"))
    assert dict(log.header.metadata) == {"aircraft": "RA-1", "note": "a: b"}
    assert log.header.reader == "flat-csv" and log.header.utc_of_zero_ns is None
    assert log.values("ins", "roll_deg") == [1.25, -2.0]
    assert log.rows("ins") == [4, 5]  # line numbers of the file, as an editor shows them
    assert log.times("ins") == [500_000_000, 1_500_000_000]
    assert not log.damages and not log.remarks


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_delimiters_line_ends_and_byte_order_mark(write: Write, delimiter: str, end: str, mark: str) -> None:
    lines = ["# flight: 7", "time_s,ins.roll_deg,ins.mode", "1,2,nav", "3,4,align", ""]
    log = Read(write(mark + end.join(line.replace(",", delimiter) for line in lines)))
    assert log.values("ins", "roll_deg") == [2.0, 4.0] and log.values("ins", "mode") == ["nav", "align"]
    assert log.header.metadata["flight"] == "7" and log.rows("ins") == [3, 4] and not log.damages


@pytest.mark.parametrize("encoding", ["utf-8", "cp1251"])
def test_cyrillic_in_both_encodings(write: Write, encoding: str) -> None:
    text = "# aircraft: Ан-124\ntime_s;event.name\n1;разворот\n2;посадка\n"
    log = Read(write(text, encoding=encoding))
    assert log.header.metadata["aircraft"] == "Ан-124"
    assert log.values("event", "name") == ["разворот", "посадка"] and not log.damages


def test_cp1251_is_seen_in_the_rows_alone(write: Write) -> None:
    log = Read(write("time_s;event.name\n1;разворот\n", encoding="cp1251"))
    assert log.values("event", "name") == ["разворот"]


def test_utf16_is_named(write: Write) -> None:
    with pytest.raises(UnreadableLogError, match="UTF-16"):
        registry.identify(write("time_s,ins.roll_deg\n1,2\n", encoding="utf-16"))


@pytest.mark.parametrize(
    ("text", "ns"),
    [
        ("1700000000.123456789", 1_700_000_000_123_456_789),
        ("0.1", 100_000_000),
        ("-0.000000001", -1),
        ("+12.", 12_000_000_000),
        ("3.9999999999", 3_999_999_999),  # digits past the ninth are cut, not rounded
        ("1.7e3", 1_700_000_000_000),
        (" 7 ", 7_000_000_000),
    ],
)
def test_seconds_become_integer_nanoseconds_exactly(write: Write, text: str, ns: int) -> None:
    assert Read(write(f"time_s,ins.roll_deg\n{text},1\n")).times("ins") == [ns]


@pytest.mark.parametrize(
    "text", ["x", "1:2", "1_5", "99999999999", "1e99", "1e-99x", "nan", "12-5", "9" * 30, "-9223372036.854775808"]
)
def test_a_time_that_cannot_be_read_is_absent_and_counted(write: Write, text: str) -> None:
    log = Read(write(f"time_s,ins.roll_deg\n1,1\n{text},2\n3,3\n"))
    assert log.times("ins") == [10**9, None, 3 * 10**9] and log.values("ins", "roll_deg") == [1, 2, 3]
    damage = log.damage("unreadable_cells")
    assert damage.count == 1 and "time_s" in damage.place and "row 3" in damage.place


def test_time_ns(write: Write) -> None:
    assert Read(write("time_ns,ins.roll_deg\n-5,1\n1700000000123456789,1\n")).times("ins") == [-5, 1700000000123456789]


def test_time_utc_with_and_without_zone(write: Write) -> None:
    path = write("time_utc,ins.roll_deg\n2026-05-04T06:00:00Z,1\n2026-05-04 09:00:00.25+03:00,2\n")
    log = Read(path)
    assert log.header.utc_of_zero_ns == 0 and "assumed_utc" not in log.remarks
    assert log.times("ins") == [1777874400_000_000_000, 1777874400_250_000_000]
    for cell in ("2026-05-04T06:00:00", "2026-05-04 06:00"):
        log = Read(write(f"time_utc,ins.roll_deg\n{cell},1\n"))
        assert log.times("ins") == [1777874400_000_000_000] and "1 time" in log.remarks["assumed_utc"].text
    mixed = Read(write("time_utc,ins.roll_deg\n2026-05-04T06:00:00Z,1\n2026-05-04T06:00:01,2\n06:00,3\n"))
    assert mixed.times("ins") == [1777874400_000_000_000, 1777874401_000_000_000, None]
    assert "1 time" in mixed.remarks["assumed_utc"].text and mixed.damage("unreadable_cells").count == 1


def test_start_utc_gives_the_zero(write: Write) -> None:
    assert Read(write("# start_utc: 1970-01-01T00:00:02Z\ntime_s,ins.roll_deg\n")).header.utc_of_zero_ns == 2 * 10**9
    naive = Read(write("# start_utc: 1970-01-01T00:00:02\ntime_s,ins.roll_deg\n"))
    assert naive.header.utc_of_zero_ns == 2 * 10**9 and "assumed_utc" in naive.remarks
    broken = Read(write("# start_utc: yesterday\ntime_s,ins.roll_deg\n"))
    assert broken.header.utc_of_zero_ns is None and "unreadable_metadata" in broken.remarks


@pytest.mark.parametrize("year", ["9999", "1600", "2262", "0001"])
def test_a_start_beyond_64_bits_is_none(write: Write, year: str) -> None:
    log = Read(write(f"# start_utc: {year}-12-31T00:00:00Z\ntime_s,ins.roll_deg\n1,2\n"))
    assert log.header.utc_of_zero_ns is None and "start_utc" in log.remarks["unreadable_metadata"].text
    assert log.times("ins") == [10**9]


@pytest.mark.parametrize(
    ("key", "text", "is_usable"),
    [
        *(("heading", text, False) for text in ("abc", "nan", "inf", "1e9", "-361", "12,5")),
        *(("heading", text, True) for text in ("-90", "0", "719.5", "")),
        *(("heading_sigma", text, False) for text in ("0", "-1", "nan", "inf", "x")),
        ("heading_sigma", "0.02", True),
    ],
)
def test_a_reference_that_cannot_be_used_is_told(write: Write, key: str, text: str, is_usable: bool) -> None:
    log = Read(write(f"# reference.parking_{key}_deg: {text}\ntime_s,ins.roll_deg\n1,2\n"))
    assert ("unreadable_metadata" in log.remarks) != is_usable
    assert is_usable or f"reference.parking_{key}_deg" in log.remarks["unreadable_metadata"].text


@pytest.mark.parametrize("absurd", ["1e308", "-1e308", "inf", "-inf", "nan"])
def test_absurd_numbers_are_kept_without_a_murmur(write: Write, absurd: str) -> None:
    log = Read(
        write(f"time_s,ins.true_heading_deg,gnss.track_deg,gnss.ground_speed_mps\n1,-10,90,5\n2{f',{absurd}' * 3}\n")
    )
    assert log.values("ins", "true_heading_deg")[0] == 350.0 and len(log.values("gnss", "velocity_north_mps")) == 2
    assert str(log.values("ins", "true_heading_deg")[1]) == str(float(absurd))


def test_recorder_time_beside_utc_gives_the_zero(write: Write) -> None:
    log = Read(write("time_utc,time_s,ins.roll_deg\n,1,1\n1970-01-01T00:00:10Z,3,2\n"))
    assert log.header.utc_of_zero_ns == 7 * 10**9 and "derived" in log.remarks
    assert log.times("ins") == [10**9, 3 * 10**9]


def test_field_is_what_follows_the_last_dot(write: Write) -> None:
    log = Read(write("time_s,link.tanker.2.pseudorange_m,ins.2.roll_deg\n1,5,6\n"))
    assert log.values("link.tanker.2", "pseudorange_m") == [5.0] and log.values("ins.2", "roll_deg") == [6.0]


def test_empty_cell_is_no_sample(write: Write) -> None:
    log = Read(
        write("time_s,ins.roll_deg,ins.pitch_deg,baro.pressure_altitude_m\n1,2,,\n2,,,7\n3,,,\n4,,  ,\n5,1,1,1\n")
    )
    assert log.rows("ins") == [2, 6] and log.rows("baro") == [3, 6]
    assert log.values("ins", "pitch_deg") == [None, 1.0]


def test_nan_of_the_device_is_present(write: Write) -> None:
    log = Read(write("time_s,ins.roll_deg,ins.pitch_deg\n1,NaN,\n2,nan,bad\n"))
    (batch,) = log.batches
    assert batch.columns["roll_deg"].mask.all() and np.isnan(batch.columns["roll_deg"].values).all()
    assert not batch.columns["pitch_deg"].mask.any()


def test_cells_that_are_no_number(write: Write) -> None:
    log = Read(write("time_s,ins.roll_deg,ins.pitch_deg\n1,5,1\n2,a,2\n3,1.2.3,3\n4,0x10,4\n5,--,5\n"))
    assert log.values("ins", "roll_deg") == [5.0, None, None, None, None]
    assert log.values("ins", "pitch_deg") == [1, 2, 3, 4, 5]
    damage = log.damage("unreadable_cells")
    assert (damage.count, damage.topic, damage.place) == (4, "ins", "ins.roll_deg, rows 3 to 6") and damage.loses_data


def test_flags(write: Write) -> None:
    log = Read(write("time_s,ins.valid\n1,0\n2,1\n3,true\n4,FALSE\n5,yes\n6,\n"))
    assert log.values("ins", "valid") == [False, True, True, False]  # a row without any sample is no row
    assert log.rows("ins") == [2, 3, 4, 5] and log.damage("unreadable_cells").count == 1


def test_text_fields_are_kept_as_they_are(write: Write) -> None:
    assert Read(write("time_s,ins.mode\n1,nav\n2,Режим 2\n3,7\n")).values("ins", "mode") == ["nav", "Режим 2", "7"]


def test_headings_are_wrapped_and_nothing_else(write: Write) -> None:
    head = "time_s,ins.true_heading_deg,gnss.track_deg,ins.roll_deg,gnss.latitude_deg\n"
    log = Read(write(head + "1,-10,360,-200,912\n2,0,359.5,5,1\n3,912,10,5,1\n"))
    assert log.values("ins", "true_heading_deg") == [350.0, 0.0, 912.0]  # no heading: left for the ledger
    assert log.values("gnss", "track_deg") == [0.0, 359.5, 10.0]
    assert log.values("ins", "roll_deg")[0] == -200.0 and log.values("gnss", "latitude_deg")[0] == 912.0
    assert "1 value " in log.remarks["wrapped_heading"].text


def test_velocities_are_derived_from_track_and_speed(write: Write) -> None:
    log = Read(write("time_s,gnss.track_deg,gnss.ground_speed_mps\n1,90,50\n2,180,10\n3,,10\n"))
    north, east = log.values("gnss", "velocity_north_mps"), log.values("gnss", "velocity_east_mps")
    assert north[:2] == pytest.approx([0.0, -10.0]) and east[:2] == pytest.approx([50.0, 0.0], abs=1e-12)
    assert north[2] is None and "velocity_north_mps" in log.remarks["derived"].text
    own = Read(write("time_s,gnss.track_deg,gnss.ground_speed_mps,gnss.velocity_north_mps\n1,90,50,7\n"))
    assert own.values("gnss", "velocity_north_mps") == [7.0] and "derived" not in own.remarks


def test_unknown_columns_are_kept_as_raw(write: Write) -> None:
    log = Read(
        write("time_s,ins.roll_deg,ins.rolll_deg,radar.range_m,volts,note,raw.x.y\n1,1,2,3,4,5,6\n2,1,2,3,,b,6\n")
    )
    assert log.values("raw.ins", "rolll_deg") == [2.0, 2.0] and log.values("raw.radar", "range_m") == [3.0, 3.0]
    assert log.values("raw.csv", "volts") == [4.0, None] and log.values("raw.csv", "note") == ["5", "b"]
    assert log.values("raw.x", "y") == [6.0, 6.0] and "ins.rolll_deg" in log.remarks["unknown_columns"].text


def test_type_of_a_raw_column_holds_for_the_whole_file(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "BLOCK_BYTES", 64)
    lines = [f"{row},1,{row}" for row in range(200)] + ["200,1,late text"]
    log = Read(write("time_s,ins.roll_deg,x\n" + "\n".join(lines) + "\n"))
    kinds = {batch.columns["x"].values.dtype.kind for batch in log.batches if batch.topic == "raw.csv"}
    assert kinds == {"U"} and len(log.values("raw.csv", "x")) == 201


def test_a_name_that_occurs_twice_is_kept_and_told(write: Write) -> None:
    log = Read(write("time_s,ins.roll_deg,ins.roll_deg\n1,2,3\n"))
    assert log.values("ins", "roll_deg") == [2.0] and log.values("raw.csv", "ins.roll_deg_3") == [3.0]
    assert "duplicate_column" in log.remarks


def test_rows_with_another_number_of_cells_are_dropped(write: Write) -> None:
    log = Read(write("time_s,ins.roll_deg,ins.pitch_deg\n1,1,1\n2,2\n3,3,3,3\n4,4\n5,5,5\n"))
    assert log.rows("ins") == [2, 6]
    few, many = (damage for damage in log.damages if damage.kind == "dropped_rows")
    assert (few.count, few.place) == (2, "rows 3 to 5") and (many.count, many.place) == (1, "row 4")
    assert "3" in few.what and few.loses_data


def test_a_cut_last_row_is_truncation(write: Write) -> None:
    log = Read(write("time_s,ins.roll_deg,ins.pitch_deg\n1,1,1\n2,2"))
    damage = log.damage("truncated")
    assert log.rows("ins") == [2] and (damage.count, damage.place) == (1, "row 3") and damage.loses_data


def test_no_final_newline_loses_nothing_but_is_told(write: Write) -> None:
    log = Read(write("time_s,ins.roll_deg\n1,1\n2,2"))
    assert log.rows("ins") == [2, 3] and not log.damages and "no_final_newline" in log.remarks


def test_repeated_headers_and_comments_inside_lose_nothing(write: Write) -> None:
    log = Read(write("time_s,ins.roll_deg\n1,1\ntime_s , ins.roll_deg\n# pause\n\n2,2\ntime_s,ins.roll_deg\n"))
    assert log.rows("ins") == [2, 6] and {damage.loses_data for damage in log.damages} == {False}
    assert log.damage("repeated_header").count == 2 and log.damage("comment_line").count == 1


def test_whole_seconds_beside_the_recorder_time_are_right_when_they_change(write: Write) -> None:
    rows = [f"{0.2 * row:.1f},1970-01-01T00:01:{(0.2 * row + 0.6) // 1:02.0f}Z,{row}" for row in range(40)]
    log = Read(write("time_s,time_utc,ins.roll_deg\n" + "\n".join(rows) + "\n"))
    assert log.header.utc_of_zero_ns == 60_600_000_000  # the first row tells a second that began 0.6 s before it


def test_trailing_delimiter_in_every_row(write: Write) -> None:
    log = Read(write("time_s,ins.roll_deg\n1,1,\n2,2,\n3,3\n"))
    assert log.rows("ins") == [2, 3] and log.damage("dropped_rows").count == 1


def test_a_first_row_that_is_cut_or_joined_does_not_judge_the_others(write: Write) -> None:
    cut = Read(write("time_s,ins.roll_deg,ins.pitch_deg\n1,1,\n2,2,2,\n3,3,3,\n"))
    assert cut.rows("ins") == [3, 4] and cut.damage("dropped_rows").count == 1
    longer = Read(write("time_s,ins.roll_deg\n1,1,\n2,2\n3,3\n"))
    assert longer.rows("ins") == [3, 4] and longer.damage("dropped_rows").count == 1


def test_quoted_cells(write: Write) -> None:
    text = 'time_s,event.name,ins.roll_deg\n"1","turn, left",5\n2,"said ""go""",6\n3, "x" ,"7"\n4,a"b,8\n5,"open,9\n'
    log = Read(write(text))
    assert log.values("event", "name") == ["turn, left", 'said "go"', "x", 'a"b', '"open']
    assert log.values("ins", "roll_deg") == [5, 6, 7, 8, 9] and not log.damages


def test_decimal_comma(write: Write) -> None:
    log = Read(write("time_s;ins.roll_deg;x\n0;1;2\n0,02;-1,5;3,5\n"))
    assert log.times("ins") == [0, 20_000_000] and log.values("ins", "roll_deg") == [1.0, -1.5]
    assert log.values("raw.csv", "x") == [2.0, 3.5] and "decimal_comma" in log.remarks


def test_a_comma_beside_decimal_points_is_no_decimal_comma(write: Write) -> None:
    log = Read(write("time_s;ins.roll_deg\n0.5;1,234\n"))
    assert log.times("ins") == [500_000_000] or not log.batches
    assert "decimal_comma" not in log.remarks and log.damage("unreadable_cells").count == 1


def test_finding_formats_does_not_import_pyarrow() -> None:
    code = "import sys, groundstation.readers.registry; sys.exit('pyarrow' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_batches_are_bounded_and_blocks_leave_no_trace(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    count = MAX_BATCH_ROWS + 10
    path = write("time_s,ins.roll_deg\n" + "".join(f"{row},1\n" for row in range(count)))
    log = Read(path)
    assert max(len(batch) for batch in log.batches) == MAX_BATCH_ROWS and len(log.rows("ins")) == count
    small = write("time_s,ins.roll_deg,event.name\n" + "".join(f"{row},{row}.5,e{row}\n" for row in range(50)))
    whole = Read(small)
    for size in (1, 7, 64):
        monkeypatch.setattr(rows, "BLOCK_BYTES", size)
        pieces = Read(small)
        for topic, field in (("ins", "roll_deg"), ("event", "name")):
            assert pieces.values(topic, field) == whole.values(topic, field)
        assert pieces.rows("ins") == whole.rows("ins") and pieces.times("ins") == whole.times("ins")


def test_long_texts_make_short_batches(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table_reader, "MAX_BATCH_BYTES", 10_000)
    log = Read(write("time_s,event.name\n" + "".join(f"{row},{'x' * 2000}\n" for row in range(20))))
    assert log.damage("cut_text").count == 20
    assert len(log.values("event", "name")) == 20 and {len(text) for text in log.values("event", "name")} == {1024}
    assert max(len(batch) for batch in log.batches) == 2


def test_the_lines_of_the_docs_are_read_as_they_stand(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "flat-csv.md").read_text(encoding="utf-8")
    (tmp_path / "copied.csv").write_text(page.partition("```csv\n")[2].partition("```")[0], encoding="utf-8")
    header, *items = registry.read(tmp_path / "copied.csv")
    assert isinstance(header, LogHeader) and header.metadata["aircraft"] == "RA-76001"
    assert header.utc_of_zero_ns == 1_777_874_400_000_000_000
    rows = {item.topic: len(item) for item in items if isinstance(item, RecordBatch)}
    assert rows == {"ins": 6, "gnss": 2}
    assert not [item for item in items if not isinstance(item, RecordBatch)], "no remark, no damage"


def test_a_column_that_is_nearly_canonical_is_told_with_the_one_meant(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time_s,ins.roll,gnss.gdop\n0,1,2\n1,1,2\n2,1,2\n", encoding="utf-8")
    (remark,) = [item for item in registry.read(tmp_path / "a.csv") if isinstance(item, Remark)]
    assert remark.text.endswith("kept as raw: ins.roll (ins.roll_deg?)")
