"""Chapters as Markdown: the headline first, and nothing from a log is markup."""

from dataclasses import replace
from typing import Any

import pytest

from groundstation.chapters.forecast import forecast
from groundstation.chapters.inertial import inertial
from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Section
from tests.inertial_example import forecast_result, inertial_result
from tests.report_example import example


def shown(section: Section | None) -> str:
    """The Markdown of a chapter."""
    assert section is not None
    return markdown(section)


def ins_errors(**changes: Any) -> str:
    """The chapter of the INS errors as a text panel shows it."""
    return shown(inertial(example(inertial_result(**changes))))


def forecast_of(kind: str = "unaided", **changes: Any) -> str:
    """The chapter of the forecast as a text panel shows it."""
    return shown(forecast(example(inertial_result(kind=kind), forecast_result(**changes))))


def test_the_headline_stands_first_and_settings_are_left_out() -> None:
    text = ins_errors().replace("\u202f", " ")
    assert text.startswith("# Unaided INS, 0\\.41 nmi/h \\(median\\)\n\n**✓** An unaided INS of 0\\.41 nmi/h")
    assert "## States" in text and "Model, noise and gates" not in text
    assert forecast_of().startswith("# Shipped method\\: windows of the drift alone\n\n**✓** After 60 min")


@pytest.mark.parametrize(("kind", "mark"), [("gnss_aided", "▲"), ("unknown", "○")])
def test_doubt_of_an_ins_is_marked_in_both(kind: str, mark: str) -> None:
    for text in (ins_errors(kind=kind), forecast_of(kind)):
        assert text.split("\n\n")[1].startswith(f"**{mark}** ")


def test_marks_are_bold_in_tables() -> None:
    text = forecast_of()
    assert "| windows of the drift alone \\(shipped\\) | **✓ 24** |" in text
    assert "| **✓ within limits** |" in text and "| **▲ too sure** |" in text
    few = tuple(replace(row, independent_starts=4) for row in forecast_result().calibration)
    text = forecast_of(calibration=few)
    assert "| **○ too few to judge** |" in text and "within limits" not in text


def test_nothing_of_a_log_is_markup() -> None:
    text = ins_errors(ins_topic="![x](http://y)", kind_reason="<b>|", ins_class="a|b")
    assert "](" not in text and "<b>" not in text and "a\\|b" in text
    assert "Not calibrated\\: \\<i\\>" in forecast_of(is_calibrated=False, calibration_reason="<i>")
