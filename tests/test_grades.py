"""Words of grades: one vocabulary in every system, each with a meaning that stands on the page."""

import ast
from pathlib import Path

import groundstation
from groundstation.chapters import gates
from groundstation.chapters.grades import MEANINGS, legend, meaning_of
from groundstation.chapters.markdown import front_markdown
from groundstation.chapters.parts import Claim, Document, Mark, Rank
from groundstation.cli.lines import GRADES
from groundstation.reports.flight_report import flight_report_html
from groundstation.systems.health.answer import HEADLINES
from groundstation.systems.inertial.units_chapter import CLAIMS
from groundstation.systems.magnetic.chapter import TONES
from tests.report_example import example, heading_result
from tests.systems.inertial.example import forecast_result, inertial_result
from tests.told import front

PACKAGE = Path(groundstation.__file__).parent
IN_TABLES = {  # words of cells, explained by the tables that they stand in
    *("Observable", "Not observable", "Not known", "No", "Yes", "Within", "Beyond"),
    *("It or another", "GNSS corrects it", "Repeats another", "Repeats "),  # of a unit
    *("Not assessable", "NOT ACCEPTED", "Planned", "Planned, with warnings", "No usable plan"),
    *("Pass", "Fail", "Not enough flights", "Not flown", "No limit"),  # of an acceptance, by its own page
}


COLOURS = {"good": {"green"}, "bad": {"red"}, "warn": {"yellow", "red"}, "unknown": {"yellow"}, "plain": set[str]()}


def words_of_marks() -> dict[str, str]:
    """Words of marks that begin with a capital, with the file: those of claims, and some of cells."""
    return {mark.text: file for mark, file in marks().items()}


def marks() -> dict[Mark, str]:
    """Marks of constant words that begin with a capital, with their file."""
    found = {}
    for path in sorted((*(PACKAGE / "systems").rglob("*.py"), *(PACKAGE / "chapters").glob("*.py"))):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Mark":
                texts = [one.value for part in node.args[1:] for one in ast.walk(part) if isinstance(one, ast.Constant)]
                tone = node.args[0].value if isinstance(node.args[0], ast.Constant) else "plain"
                found |= {Mark(tone, text): path.name for text in texts if isinstance(text, str) and text[:1].isupper()}  # type: ignore[arg-type]
    return found


def test_a_word_has_the_colour_of_its_tone_on_the_terminal() -> None:
    """Yellow of what is open, or none; never the colour of another word that it begins with."""
    wrong = {}
    for mark in (*marks(), *gates.VERDICTS.values(), *CLAIMS.values()):
        phrase = f"{mark.text[:1].lower()}{mark.text[1:]}"
        colour = GRADES.get(phrase, GRADES.get(phrase.partition(" ")[0]))
        if mark.text in MEANINGS and mark.tone != "plain" and colour is not None and colour not in COLOURS[mark.tone]:
            wrong[mark.text] = (mark.tone, colour)
    assert not wrong


def test_every_word_that_grades_an_answer_has_a_meaning() -> None:
    found = words_of_marks()
    assert len(found) > 30
    assert {word: file for word, file in found.items() if word not in MEANINGS and word not in IN_TABLES} == {}
    made = [mark.text for mark in (*gates.VERDICTS.values(), *CLAIMS.values())]
    made += [*HEADLINES.values(), *(verdict.capitalize() for verdict in TONES)]
    assert not set(made) - MEANINGS.keys()


def test_no_two_words_mean_the_same() -> None:
    assert len(set(MEANINGS.values())) == len(MEANINGS)
    pairs = (("Accept", "Accepted"), ("Good", "Healthy"), ("Bad", "Failed"), ("Not judged", "Not logged"))
    assert all(word in MEANINGS and other not in MEANINGS for word, other in pairs)


def test_the_legend_has_the_words_of_the_page_each_once() -> None:
    claims = [Claim(Rank.GNSS, Mark(tone, word), "") for tone, word in (("good", "Good"), ("warn", "Ours"))]  # type: ignore[arg-type]
    words = legend(Mark("good", "Good"), (*claims, *claims))
    assert [(mark.text, text) for mark, text in words] == [("Good", MEANINGS["Good"])]
    assert meaning_of(claims[1].mark) == "", "a word of somebody else's system"


def test_the_words_stand_explained_on_the_page() -> None:
    top = front(example(heading_result(), inertial_result(), forecast_result()))
    told = [mark.text for mark, _ in top.legend]
    assert top.verdict is not None and told[0] == top.verdict.text and "Measured" in told
    assert set(told) == {top.verdict.text, *(tile.claim.mark.text for tile in top.others)}
    assert f"Measured: {MEANINGS['Measured']}" in front_markdown(top)
    page = flight_report_html(Document("Flight report", "x", top, ()))
    assert f'title="{MEANINGS["Measured"]}"' in page and 'class="legend"' in page
    assert f'title="{MEANINGS[top.verdict.text]}"' in page
