"""docs/signals.md, made from the canonical signals of the code.

``python -m tests.signals_page`` writes it.
"""

from pathlib import Path

from tests.test_site_reference import loaded

PAGE = Path(__file__).parent.parent / "docs" / "signals.md"


def page() -> str:
    """The page as the code has it."""
    return str(loaded()._signals())


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
