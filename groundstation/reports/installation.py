"""Place in the report of a flight for what earlier flights taught.

It is filled in once all of them are known. The report of a flight is written when the flight is run; earlier flights
may arrive later. It therefore has two places, between marks that nothing from a log can write, and only what stands
between them changes.
"""

import re

from groundstation.reports.page import render
from groundstation.results.installations import LearnedHeading
from groundstation.systems.learning import LearnStep

TOP, CHAPTER = "installation-top", "installation"


def with_installation(page: str, answer: LearnedHeading | None, learn: LearnStep) -> str:
    """Return the page of a flight with a learned answer in its places; empty without one."""
    top = chapter = ""
    if answer is not None:
        top = "" if answer.why_not else render("installation-top.html.j2", text=learn.sentence(answer))
        chapter = render("installation.html.j2", told=learn.parts(answer))
    return _filled(_filled(page, TOP, top), CHAPTER, chapter)


def _filled(page: str, name: str, content: str) -> str:
    between = re.compile(rf"(<!--{name}-->).*?(<!--/{name}-->)", re.DOTALL)
    return between.sub(lambda found: f"{found[1]}{content}{found[2]}", page, count=1)
