"""Chapters as Markdown: the headline first, and nothing from a log is markup."""

from groundstation.chapters.inertial import inertial
from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Section
from groundstation.results.answer import Answer
from tests.inertial_example import inertial_result
from tests.report_example import example


def shown(section: Section | None) -> str:
    """The Markdown of a chapter."""
    assert section is not None
    return markdown(section)


def told(*answers: Answer) -> str:
    """The chapter of the INS errors."""
    return shown(inertial(example(*answers)))


def test_the_headline_stands_first_and_settings_are_left_out() -> None:
    text = told(inertial_result()).replace("\u202f", " ")
    assert text.startswith("# Unaided INS, 0\\.41 nmi/h \\(median\\)\n\n**✓** An unaided INS of 0\\.41 nmi/h")
    assert "## States" in text and "Model, noise and gates" not in text


def test_nothing_of_a_log_is_markup() -> None:
    text = told(inertial_result(ins_topic="![x](http://y)", kind_reason="<b>|", ins_class="a|b"))
    assert "](" not in text and "<b>" not in text and "a\\|b" in text
