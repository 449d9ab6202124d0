"""MILUV tables of ranges: odd numbers are no warning of ours."""

from pathlib import Path

import pytest

from tests.readers.test_warnings import ODD, read_in_silence

pytest.importorskip("recorded_robots", reason="the plug-in is not installed: make robots")


def test_a_table_of_ranges_with_odd_numbers(tmp_path: Path) -> None:
    lines = ["timestamp,from_id,to_id,range,r_iw_a_ifo001,q_ai_ifo001"]
    for row in range(40):
        odd, other = ODD[row % len(ODD)], ODD[(row * 3) % len(ODD)]
        place, turn = f'"[{odd} {other} {odd}]"', f'"[{other} {odd} 0 1]"'
        lines.append(f"{1_700_000_000 + row},{odd},{other},{odd},{place},{turn}")
    path = tmp_path / "range_data.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    read_in_silence(path)
