"""A header governs the rows below it: a second one in the middle of a table, and rows that have none above them."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.base.records import Remark
from groundstation.base.units import NS_PER_S
from groundstation.readers import registry, sections
from tests.readers.garmin_writer import G3X, G5, G5_TOP, G1000, G1000_TOP, Flight, log
from tests.readers.test_flat_csv import Read
from tests.real_logs import real_log

ONE, TWO = "time_s,ins.roll_deg,ins.pitch_deg", "time_s,ins.pitch_deg,ins.roll_deg"
PROFILE = """
name = "p"
[time]
kind = "seconds"
column = "t"
[metadata.find]
start_utc = 'Start: (\\\\S+)'
[columns]
"roll" = { field = "ins.roll_deg", unit = "deg" }
"pitch" = { field = "ins.pitch_deg", unit = "deg" }
"""
START = "# start_utc: 2024-05-06T{}:00:00Z\n"
HOUR_NS = 3600 * NS_PER_S


def read(tmp_path: Path, text: str | bytes, profile: str | None = None) -> Read:
    path, settings_path = tmp_path / "log.csv", tmp_path / "p.toml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    if profile is not None:
        settings_path.write_text(profile.replace("\\\\", "\\"))
    return Read(path, None if profile is None else settings_path)


def angles(log: Read) -> list[tuple[float, float]]:
    return list(zip(log.values("ins", "roll_deg"), log.values("ins", "pitch_deg"), strict=True))


def test_columns_in_another_order(tmp_path: Path) -> None:
    found = read(tmp_path, f"{ONE}\n0,1,2\n1,1,2\n{TWO}\n2,2,1\n3,2,1\n{ONE}\n4,1,2\n")
    assert angles(found) == [(1.0, 2.0)] * 5 and found.rows("ins") == [2, 3, 5, 6, 8]
    assert not found.damages and "row 7" in found.remarks["second_header"].text


def test_another_number_of_columns_and_another_delimiter(tmp_path: Path) -> None:
    found = read(tmp_path, f"{ONE}\n0,1,2\ntime_s;ins.roll_deg;x.n\n1;1,5;7\n2;2,5;8\ntime_s,ins.roll_deg\n3,9\n")
    assert found.values("ins", "roll_deg") == [1.0, 1.5, 2.5, 9.0] and found.values("raw.x", "n") == [7.0, 8.0]
    assert found.times("ins") == [0, NS_PER_S, 2 * NS_PER_S, 3 * NS_PER_S] and not found.damages


def test_a_raw_column_has_one_type_in_all_sections(tmp_path: Path) -> None:
    found = read(tmp_path, f"{ONE},x.n\n0,1,2,5\n{TWO},x.n\n1,2,1,abc\n")
    assert found.values("raw.x", "n") == ["5", "abc"]


def test_another_start_is_another_zero_of_time(tmp_path: Path) -> None:
    text = "".join(f"{START.format(hour)}{ONE}\n0,1,2\n1,1,2\n" for hour in (10, 12))
    found = read(tmp_path, text)
    first = found.header.utc_of_zero_ns
    assert first is not None and found.times("ins") == [0, NS_PER_S, 2 * HOUR_NS, 2 * HOUR_NS + NS_PER_S]
    assert "zero of time" in found.remarks["second_header"].text and not found.damages  # no comment among the rows


def test_the_same_header_again_is_a_repetition(tmp_path: Path) -> None:
    found = read(tmp_path, f"{START.format(10)}{ONE}\n0,1,2\n{START.format(10)}{ONE}\n1,1,2\n{ONE}\n2,1,2\n")
    assert found.times("ins") == [0, NS_PER_S, 2 * NS_PER_S] and found.damage("repeated_header").count == 2
    assert "second_header" not in found.remarks


def test_times_by_another_clock(tmp_path: Path) -> None:
    utc = "time_utc,ins.roll_deg,ins.pitch_deg\n2024-05-06T11:00:00Z,1,2\n"
    found = read(tmp_path, f"{START.format(10)}{ONE}\n0,1,2\n{utc}{ONE}\n7,1,2\n")
    assert found.times("ins") == [0, HOUR_NS, None] and "left out" in found.remarks["second_header"].text
    alone = read(tmp_path, f"{ONE}\n0,1,2\n{utc}")
    assert alone.times("ins") == [0, None] and alone.header.utc_of_zero_ns is None


def test_a_file_with_its_byte_order_mark_was_appended(tmp_path: Path) -> None:
    content = f"{ONE}\r\n0,1,2\r\n".encode() + b"\xef\xbb\xbf" + f"{TWO}\r\n1,2,1\r\n".encode()
    assert angles(read(tmp_path, content)) == [(1.0, 2.0)] * 2


def test_text_that_only_looks_like_a_header(tmp_path: Path) -> None:
    found = read(tmp_path, "time_s,ins.roll_deg,event.name\n0,1,time_s\n1,2,the time_ns. x\n")
    assert found.values("event", "name") == ["time_s", "the time_ns. x"] and not found.damages


def test_too_many_headers_leave_the_rest_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("groundstation.readers.flat_csv.MOST", 3)
    monkeypatch.setattr("groundstation.readers.profile_table.MOST", 3)
    found = read(tmp_path, f"{ONE}\n0,1,2\n{TWO}\n0,2,1\n" * 3)
    assert angles(found) == [(1.0, 2.0)] * 3
    assert (found.damage("dropped_rows").count, found.damage("dropped_rows").place) == (6, "rows 7 to 12")
    table = "t,roll,pitch\n0,1,2\nt,pitch,roll\n0,2,1\n" * 3
    found = read(tmp_path, table, PROFILE)
    assert angles(found) == [(1.0, 2.0)] * 3 and found.damage("dropped_rows").place == "rows 7 to 12"


def test_a_profile_s_table(tmp_path: Path) -> None:
    """Names of one letter are found too, and the start that stands above a header is that of its rows."""
    text = "Start: 2024-05-06T10:00:00Z\nt,roll,pitch\n0,1,2\nStart: 2024-05-06T11:00:00Z\nt,pitch,roll,v\n0,2,1,9\n"
    found = read(tmp_path, text, PROFILE)
    assert angles(found) == [(1.0, 2.0)] * 2 and found.times("ins") == [0, HOUR_NS]
    assert found.values("raw.p", "v") == [9.0] and not found.damages


def test_logs_of_one_panel_with_other_columns(tmp_path: Path) -> None:
    flight = Flight(declination_deg=-13.0, track_is_true=False)
    whole, less = log(flight, G1000, top=G1000_TOP), log(flight, G1000, top=G1000_TOP, without=("offset", "altitude"))
    found = read(tmp_path, whole + less + whole)
    assert len(found.rows("gnss")) == 180 and not [one for one in found.damages if one.loses_data]
    assert set(found.values("ins", "roll_deg") if "roll_deg" in found.batches[0].columns else [0]) == {0}
    tracks = {round(track, 1) for track in found.values("gnss", "track_deg")}
    assert tracks == {90.0}


@pytest.mark.parametrize(("names", "top"), [(G3X, None), (G5, G5_TOP)])
def test_long_names_in_the_middle_are_no_row(
    tmp_path: Path, names: dict[str, tuple[str, str]], top: str | None
) -> None:
    given_top = {} if top is None else {"top": top}
    flight = Flight(variation_sign=-1)
    text = log(flight, names, **given_top) + log(flight, names, without=("pitch",), **given_top)
    found = read(tmp_path, text)
    assert len(found.rows("gnss")) == 120 and not found.damages
    assert set(found.values("gnss", "velocity_east_mps")) == {50.0}
    for again in (log(flight, names, **given_top), log(flight, names, **given_top).replace("version=", "version2=")):
        found = read(tmp_path, log(flight, names, **given_top) + again)
        assert len(found.rows("gnss")) == 120 and "second_header" not in found.remarks
        assert not [one for one in found.damages if one.loses_data]


@given(st.lists(st.permutations(["ins.roll_deg", "ins.pitch_deg", "gnss.hdop", "x.n"]), min_size=1, max_size=6))
@settings(max_examples=40, deadline=None)
def test_each_value_stands_below_its_name(tmp_path_factory: pytest.TempPathFactory, orders: list[list[str]]) -> None:
    values = {"ins.roll_deg": "1", "ins.pitch_deg": "2", "gnss.hdop": "3", "x.n": "4"}
    text = "".join(
        f"time_s,{','.join(names)}\n{at},{','.join(values[name] for name in names)}\n"
        for at, names in enumerate(orders)
    )
    found = read(tmp_path_factory.mktemp("t"), text)
    n = len(orders)
    assert angles(found) == [(1.0, 2.0)] * n and found.values("gnss", "hdop") == [3.0] * n
    assert found.values("raw.x", "n") == [4.0] * n and found.times("ins") == [at * NS_PER_S for at in range(n)]


def test_places_over_pieces_of_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "".join(f"{ONE if at % 2 else TWO}\n" + f"{at},1,2\n" * (at % 5) for at in range(60))
    whole = read(tmp_path, text)
    for size in (64, 97, 1000):
        monkeypatch.setattr(sections, "_PIECE_BYTES", size)
        pieces = read(tmp_path, text)
        assert angles(pieces) == angles(whole) and pieces.rows("ins") == whole.rows("ins")
    remarks = [item for item in registry.read(tmp_path / "log.csv") if isinstance(item, Remark)]
    assert sum(one.code == "second_header" for one in remarks) == 59


LATE = (
    '#airframe_info, log_version="1.03", airframe_name="X"\n#yyy-mm-dd, hh:mm:ss, hh:mm, deg, deg\n{rows}'
    "Lcl Date, Lcl Time, UTCOfst, HDG, MagVar\n{rows}"
)


@pytest.mark.parametrize("count", [1, 7, 200])
def test_rows_above_a_late_header_are_counted(tmp_path: Path, count: int) -> None:
    rows = "".join(f"2022-04-17, 12:{at // 60:02d}:{at % 60:02d}, +02:00, 10, 2\n" for at in range(count))
    found = read(tmp_path, LATE.format(rows=rows))
    damage = found.damage("dropped_rows")
    assert len(found.rows("ins")) == count and damage.count == count and damage.loses_data
    assert damage.place == ("row 3" if count == 1 else f"rows 3 to {count + 2}")


def test_text_above_the_header_of_a_profile_is_no_row(tmp_path: Path) -> None:
    text = "Recorder 7\nSerial,12,34\nUnits: s,deg,deg\n\nt,roll,pitch\n0,1,2\n"
    assert not read(tmp_path, text, PROFILE).damages
    lost = read(tmp_path, "Recorder 7\n0,1,2\n1,1,2\nt,roll,pitch\n2,1,2\n", PROFILE)
    assert lost.damage("dropped_rows").count == 2


@pytest.mark.real_log
def test_case_g_late() -> None:
    found = Read(real_log("cases/reliability/g_late.csv.gz"))
    assert len(found.rows("ins")) + found.damage("dropped_rows").count == 400
