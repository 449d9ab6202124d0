"""Sections as Markdown: the text panels of the recording."""

import pytest

from groundstation.chapters.markdown import escaped, front_markdown, markdown, part_markdown
from groundstation.chapters.parts import Cell, Facts, Figure, Front, Grid, Head, Mark, Note, Section
from groundstation.results.flight import NotAssessable
from groundstation.systems.heading.chapter import heading
from tests.markup import MARKDOWN, foreign_markup
from tests.report_example import example, heading_result
from tests.told import front

HEADS = (Head("State"), Head("Gate"), Head("Figure", True), Head("Reason"))
LONG = "a remark that is far longer than a cell of a panel that does not wrap"
HOSTILE = "<script>|![x](http://y)\x00\u202e`*_#"


def lines(*parts: Note | Facts | Grid | Figure) -> list[str]:
    return markdown(Section("key", "Title", "lead", parts)).split("\n\n")


def test_a_section_is_headed_by_its_headline_or_its_title() -> None:
    assert markdown(Section("key", "Title", "lead")) == "# Title"
    assert markdown(Section("key", "Title", "lead", (), "Answer"), level=2) == "## Answer"
    above = (Note("why"),)
    assert markdown(Section("key", "Title", "lead", (Note("rest"),), "Answer", above)).split("\n\n") == [
        *("# Answer", "why", "rest")
    ]


def test_states_are_symbols_and_words() -> None:
    rows: list[tuple[Cell, ...]] = [(Mark("warn", "failed"), "Kurtosis", "2.4", "gusts")]
    assert lines(Grid("Gates", HEADS, rows, "Caption"))[1:] == [
        "## Gates",
        "| State | Gate | Figure | Reason |\n|---|---|---|---|\n| **▲ failed** | Kurtosis | 2.4 | gusts |",
        "*Caption*",
    ]
    assert lines(Note("Lost.", "bad"), Note("Said."))[1:] == ["**✗** Lost.", "Said."]


def test_long_remarks_stand_below_the_table_under_the_name_of_their_row() -> None:
    rows: list[tuple[Cell, ...]] = [
        (Mark("bad", "failed"), "Kurtosis", "2.4", LONG),
        (Mark("good", "passed"), "e", "1", ""),
    ]
    _, table, below = lines(Grid("", HEADS, rows))
    assert table.splitlines()[0] == "| State | Gate | Figure |" and LONG not in table
    assert below == f"Kurtosis: {LONG}"


def test_long_names_stand_behind_the_figures_of_their_rows() -> None:
    rows: list[tuple[Cell, ...]] = [(Mark("good", "passed"), LONG, "1", "")]
    _, table = lines(Grid("", HEADS, rows))
    assert table.splitlines()[0] == "| State | Figure | Gate | Reason |"
    assert table.splitlines()[2].endswith(f"| 1 | {LONG} |  |")


def test_names_with_long_remarks_alone_need_no_table() -> None:
    assert lines(Grid("", (Head("Analysis"), Head("Reason")), [("magnetic", LONG)]))[1:] == [f"magnetic: {LONG}"]


def test_facts_have_a_column_of_remarks_if_there_are_any() -> None:
    plain, remarked = Facts("", [("Log", "a.csv", "")]), Facts("", [("Log", "a", "7 bytes"), ("Reader", "b", LONG)])
    assert lines(plain)[1].splitlines()[0] == "|  | value |"
    _, table, below = lines(remarked)
    assert table.splitlines()[2:] == ["| Log | a | 7 bytes |", "| Reader | b |  |"]
    assert below == f"Reader: {LONG}"


def test_what_is_for_paper_or_for_figures_is_left_out() -> None:
    small = Facts("Settings", [("limit", "1", "")], compact=True)
    assert lines(small, Figure("heading.taxi"), Note("beside it", files=("card.csv",))) == ["# Title"]
    assert lines(Figure("heading.forest", instead=Note("a table")))[1:] == ["a table"]
    assert part_markdown(small) == ""


def test_nothing_from_a_log_is_markup() -> None:
    rows: list[tuple[Cell, ...]] = [(Mark("bad", HOSTILE), HOSTILE, HOSTILE, "")]
    facts = Facts(HOSTILE, [(HOSTILE, HOSTILE, HOSTILE)], HOSTILE)
    section = Section("key", HOSTILE, "", (Note(HOSTILE), facts, Grid(HOSTILE, HEADS, rows, HOSTILE)), HOSTILE)
    for text in (markdown(section), front_markdown(Front(HOSTILE, [(HOSTILE, HOSTILE)], None, HOSTILE, [HOSTILE]))):
        assert not [mark for mark in "\x00\u202e" if mark in text]
        assert not foreign_markup(text)


@pytest.mark.parametrize(
    "text", ["# a", "- a", "+ a", "1. a", "12) a", "---", "===", "> a", "~~~", "    a", "<a@b.c>", "-", "1."]
)
def test_a_line_begins_no_markup(text: str) -> None:
    blocks = [token.type for token in MARKDOWN.parse("before\n\n" + escaped(text.strip()) + "\n\nbehind")]
    assert blocks == 3 * ["paragraph_open", "inline", "paragraph_close"]


def test_a_front_tells_flight_verdict_and_why() -> None:
    text = front_markdown(front(example(heading_result()))).split("\n\n")
    assert text[0] == "# A12 · flight 17"
    assert text[1] == "## ✓ Accept · Enter −1.05°" and text[4] == "Every required gate passed."
    assert text[2] == "No signals; nothing lost"
    assert "| Status | **✓ ok** |" in text[3]
    assert any("| Precision e |" in part for part in text)
    assert "## Not assessable" in text


@pytest.mark.parametrize("verdict", ["accept", "advisory", "reject", "extend", "undecided"])
def test_the_heading_panel_begins_with_the_line_of_the_front(verdict: str) -> None:
    results = example(heading_result(verdict=verdict))
    assert markdown(heading(results)).splitlines()[0] == front_markdown(front(results)).split("\n\n")[1][1:]


def test_the_heading_panel_tells_gates_segments_and_no_settings() -> None:
    text = markdown(heading(example(heading_result())))
    assert "**▲ failed**" in text and "**✗ failed**" not in text  # the gate that failed only informs
    assert "## Estimates by segment" in text and "Settings" not in text
    reasons = (NotAssessable("heading", "no GNSS velocity in the log"),)
    text = markdown(heading(example(None, not_assessable=reasons)))
    assert text.startswith("# ○ Heading not assessable") and "no GNSS velocity in the log" in text
