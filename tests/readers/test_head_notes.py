"""Notes in the head of a table: they reach the metadata and the top of the page, whatever form they have."""

from dataclasses import replace
from pathlib import Path

import pytest

import groundstation
from groundstation.base.records import LogHeader
from groundstation.chapters.front import LONGEST_NOTE, note_of_log
from groundstation.chapters.markdown import front_markdown
from groundstation.readers import registry
from tests.report_example import example
from tests.told import front

ROWS = "time_s,gnss.latitude_deg,gnss.longitude_deg\n" + "".join(f"{at}.0,10.0,20.0\n" for at in range(9))


@pytest.mark.parametrize(
    ("head", "note"),
    [
        ("# note: the common motion is made up\n", "the common motion is made up"),
        ("# The common motion is made up.\n# aircraft: A-1\n", "The common motion is made up."),
        ("# How it was made in short: motion made up\n", "How it was made in short: motion made up"),
        ("# Comment: by hand\n# scaled to the local field\n", "by hand; scaled to the local field"),
        ("# aircraft: A-1\n#----------\n#time_s,gnss.latitude_deg,x.y,z.a\n", None),
    ],
)
def test_a_comment_of_the_head_is_a_note_of_the_log(head: str, note: str | None, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(head + ROWS, encoding="utf-8")
    header = next(iter(registry.read(path)))
    assert isinstance(header, LogHeader) and header.metadata.get("note") == note


def test_a_comment_above_a_table_of_a_known_layout_is_one_too(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    heads = "time,lat,lon,hMSL,velN,velE,velD,hAcc,vAcc,sAcc,heading,cAcc,gpsFix,numSV\n"
    units = ",(deg),(deg),(m),(m/s),(m/s),(m/s),(m),(m),(m/s),(deg),(deg),,\n"
    row = "2026-05-04T06:00:0{}.00Z,45.0,7.0,300.0,0.0,0.0,0.0,1.0,1.0,0.1,0.0,1.0,3,9\n"
    rows = "".join(row.format(at) for at in range(9))
    path.write_text(f"# Jump of a test, positions moved\n{heads}{units}{rows}", encoding="utf-8")
    assert groundstation.open(path).results.metadata["note"] == "Jump of a test, positions moved"


def test_the_note_stands_on_top_of_the_page_and_is_short() -> None:
    results = replace(example(), metadata={"note": "motion made up", "comment": "motion made up", "Remarks": "1 Hz"})
    top = front(results)
    assert top.note == "motion made up; 1 Hz"
    assert "Note of the log: motion made up; 1 Hz" in front_markdown(top)
    long = note_of_log(replace(results, metadata={"note": "made up " * 99}))
    assert len(long) <= LONGEST_NOTE and long.endswith("made up ...")
    assert note_of_log(replace(results, metadata={})) == ""
