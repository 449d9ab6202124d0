"""Sections as plain text for a terminal."""

from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Head, Mark, Note, Section
from groundstation.chapters.terminal import grid_text, part_text, terminal
from groundstation.systems.heading.chapter import heading
from tests.report_example import example, heading_result


def test_a_table_has_aligned_columns_with_numbers_to_the_right() -> None:
    rows: list[tuple[Cell, ...]] = [
        (Mark("good", "passed"), "e", "0.02"),
        (Mark("unknown", "not measured"), "GDOP", "—"),
    ]
    table = Grid("Gates", (Head("State"), Head("Gate"), Head("Figure", True)), rows, "Caption.")
    assert grid_text(table).splitlines() == [
        "Gates",
        "State           Gate  Figure",
        "✓ passed        e       0.02",
        "○ not measured  GDOP       —",
        "Caption.",
    ]


def test_a_table_without_rows_or_without_heads_says_no_more_than_it_has() -> None:
    assert grid_text(Grid("Gates", (Head("State"),), (), "Caption.")) == ""
    assert grid_text(Grid("", (Head(""), Head("")), [("a", "b")])) == "a  b"


def test_facts_and_notes_are_lines() -> None:
    assert part_text(Facts("Log", [("Name", "a.csv", "7 bytes"), ("Read by", "flat-csv", "")])).splitlines() == [
        *("Log", "Name     a.csv     7 bytes", "Read by  flat-csv")
    ]
    assert part_text(Note("Lost.", "bad")) == "✗ Lost." and part_text(Note("Said.")) == "Said."
    assert part_text(Facts("Settings", [("limit", "1", "")], compact=True)) == ""
    assert part_text(Figure("a")) == "" and part_text(Figure("a", instead=Note("b"))) == "b"


def test_a_section_begins_with_its_answer_and_says_what_the_front_says() -> None:
    text = terminal(heading(example(heading_result())))
    assert text.startswith("✓ Accept · Enter −1.05°\n\nEvery required gate passed.\n\n")
    assert "▲ failed" in text and "✗ failed" not in text
    assert "Estimates by segment" in text and "Settings" not in text


def test_a_log_does_not_drive_the_terminal() -> None:
    hostile = "a\x1b[2J\u202e\n"
    table = Grid(hostile, (Head("x"),), [(hostile,), (Mark("bad", hostile),)], hostile)
    text = terminal(Section("key", hostile, "", (Note(hostile), Facts(hostile, [(hostile, hostile, hostile)]), table)))
    assert not [mark for mark in ("\x1b", "\u202e") if mark in text]
    assert len(text.splitlines()) == 12, "a line feed in a name begins no line"
