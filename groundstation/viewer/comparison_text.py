"""Text panel of a comparison: the chapters of its page."""

from groundstation.chapters.comparison import answers, findings, opening, settings
from groundstation.chapters.markdown import markdown, part_markdown
from groundstation.chapters.shortened import shortened
from groundstation.results.comparison import Comparison

MOST_ROWS = 100  # of a table: the viewer lays out the whole text again and again


def comparison_text(comparison: Comparison) -> str:
    """Return Markdown of the panel."""
    sections = (answers(comparison), settings(comparison), findings(comparison))
    told = (markdown(shortened(one, MOST_ROWS, "compare.html"), level=2) for one in sections if one is not None)
    return "\n\n".join([*map(part_markdown, opening(comparison)), *told])
