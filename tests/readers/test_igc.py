"""IGC flight records: fixes, altitudes, midnight, what the I record adds, damage."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.readers import igc, registry
from groundstation.readers.source import Source
from tests.readers.test_flat_csv import Read

UTC = iso_to_utc_ns("2024-05-06T23:59:58Z")[0]
HEAD = "AXXX001\r\nHFDTEDATE:060524,01\r\nHFGTYGLIDERTYPE: ASK 21\r\nHFGIDGLIDERID:D-1234\r\nI023638FXA3940SIU\r\n"
ROWS = (
    "B2359584730600N00815000WA010000110000509\r\nE235958PEV\r\n"
    "B2359594730600S00815000EV-00500000000608\r\nLXXX a comment\r\nB0000004730630N00815030EA010020110200710\r\n"
)


def read(tmp_path: Path, text: str) -> Read:
    path = tmp_path / "x.igc"
    path.write_text(text, newline="")
    return Read(path)


def test_fixes_and_events(tmp_path: Path) -> None:
    found = read(tmp_path, HEAD + ROWS)
    assert found.header.reader == "igc" and found.header.utc_of_zero_ns == 0
    assert found.header.metadata["aircraft"] == "D-1234" and found.header.metadata["aircraft_type"] == "ASK 21"
    assert found.times("gnss") == [UTC + k * NS_PER_S for k in range(3)] and found.rows("gnss") == [6, 8, 10]
    assert found.values("gnss", "latitude_deg") == pytest.approx([47.51, -47.51, 47.5105])
    assert found.values("gnss", "longitude_deg") == pytest.approx([-8.25, 8.25, 8.2505])
    assert found.values("gnss", "altitude_ellipsoid_m") == [1100.0, None, 1102.0]
    assert found.values("baro", "pressure_altitude_m") == [1000.0, -50.0, 1002.0]
    assert found.values("gnss", "fix") == ["3d", "2d", "3d"]
    assert found.values("gnss", "satellites_used") == [9.0, 8.0, 10.0] and found.values("raw.igc", "FXA") == [
        "005",
        "006",
        "007",
    ]
    assert found.values("event", "name") == ["PEV"] and found.times("event") == [UTC]
    assert not found.damages and "assumed" in found.remarks


@pytest.mark.parametrize(("told", "field"), [("GEO", "altitude_msl_m"), ("ELL", "altitude_ellipsoid_m")])
def test_the_header_tells_what_altitudes_are_above(tmp_path: Path, told: str, field: str) -> None:
    found = read(tmp_path, HEAD + f"HFALGALTGPS:{told}\r\n" + ROWS)
    assert found.values("gnss", field)[0] == 1100.0 and "assumed" not in found.remarks


def test_broken_fixes_are_counted_and_no_date_is_no_absolute_time(tmp_path: Path) -> None:
    text = (HEAD + ROWS).replace("HFDTEDATE:060524,01", "HFDTEDATE:460524,01")
    bad = "B2559584730600N00815000WA010000110000509\nB2359584799\nB235958xx30600N00815000WA0100001100\n"
    found = read(tmp_path, text + bad + "B0000019930600N00815000WA0100001100\n")
    assert found.header.utc_of_zero_ns is None and found.damage("dropped_rows").count == 4
    assert len(found.times("gnss")) == 3


def test_zero_is_no_place(tmp_path: Path) -> None:
    found = read(tmp_path, HEAD + "B1000000000000N00000000EV0100000000\n" + ROWS)
    assert found.values("gnss", "latitude_deg")[0] is None and found.damage("no_position").count == 1


def test_pieces_of_a_file_read_as_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = [f"B{s // 3600:02d}{s // 60 % 60:02d}{s % 60:02d}4730600N00815000EA0100001100" for s in range(40, 100)]
    monkeypatch.setattr(igc, "LINES", 7)
    found = read(tmp_path, "AXXX001\nHFDTE060524\n" + "\n".join(lines) + "\n")
    assert np.diff(np.array(found.times("gnss"))).tolist() == [NS_PER_S] * 59


@pytest.mark.parametrize("text", ["AXXX\nnothing\n", "B1000004730600N00815000EA0100001100\n", "a,b\n1,2\n"])
def test_other_texts_are_not_claimed(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.txt"
    path.write_text(text)
    assert igc.sniff(Source(path)) is None
    path.write_text(HEAD + ROWS)
    assert registry.identify(path).reader == "igc"
