"""Pages of the docs: their links lead somewhere, and the README stays one screen."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
LINK = re.compile(r"\]\(([^)\s]+)\)")
README_WORDS = 500  # more is not read
PAGE_WORDS, ALL_WORDS = 1200, 35_500  # of a page of a system; of all pages but those apart
APART = ("evidence/", "decisions/", "health_checks.md", "signals.md")  # the last two are made from the code
SYSTEMS = (
    *("heading", "installation", "inertial", "several_ins", "trajectory", "magnetic", "flux_valve", "approaches"),
    *("landing", "cooperative", "cooperative_stations", "control", "health", "gnss", "latency", "reference"),
)


def slugs(text: str) -> set[str]:
    """Names by which headings are linked, as GitHub makes them."""
    heads = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    broken = []
    for link in LINK.findall(page.read_text(encoding="utf-8")):
        name, _, anchor = link.partition("#")
        if name.startswith(("http:", "https:", "mailto:")):
            continue
        target = page.parent / name if name else page
        if not target.exists() or (anchor and anchor not in slugs(target.read_text(encoding="utf-8"))):
            broken.append(link)
    assert not broken, broken


def words(page: Path) -> int:
    """The words of a page, tables and code with them."""
    return len(page.read_text(encoding="utf-8").split())


def test_readme_is_one_screen() -> None:
    assert words(ROOT / "README.md") <= README_WORDS


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_page_of_a_system_is_read_in_ten_minutes(name: str) -> None:
    assert words(ROOT / "docs" / f"{name}.md") <= PAGE_WORDS, "figures belong to docs/evidence"


def test_pages_stay_few() -> None:
    read = {page.relative_to(ROOT / "docs").as_posix(): words(page) for page in (ROOT / "docs").rglob("*.md")}
    assert sum(count for name, count in read.items() if not name.startswith(APART)) <= ALL_WORDS


def test_every_page_is_listed() -> None:
    listed = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    pages = [page.relative_to(ROOT / "docs").as_posix() for page in (ROOT / "docs").rglob("*.md")]
    every = {name for name in pages if not name.startswith("decisions/")} - {"README.md"}
    assert {name for name in every if f"({name})" not in listed} == set()
