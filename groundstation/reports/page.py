"""Pages from the parts of a report: jinja2 with autoescape, one style sheet.

Nothing is loaded from outside.
"""

import base64
import hashlib
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from groundstation.chapters.wording import clean
from groundstation.reports.live import Frame, LivePanel, page_data

_WHOLE = re.compile(r"\b(?:(?:\d{8}T\d{6}Z|NOTIME_[0-9a-f]{8})[\w-]{0,32}|\d{4}-\d\d-\d\d)(?![\w-])")
TEMPLATES = Path(__file__).parent / "templates"
# Nothing may be loaded, nothing run but scripts that a template names by digest. SVG sets style attributes, hence
# unsafe-inline.
CONTENT_SECURITY_POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"


def render(template: str, **context: Any) -> str:
    """Render a template of reports/templates.

    Every value is escaped and cleaned of hidden characters.
    """
    return str(_environment().get_template(template).render(csp=CONTENT_SECURITY_POLICY, **context))


def live_figures(figures: Sequence[tuple[LivePanel, ...]], pictures: Sequence[tuple[Frame, ...]]) -> dict[str, str]:
    """Return the values by which flight.html.j2 draws figures live and zooms into pictures.

    Empty texts without any. Those are data, script with its digest, style.
    """
    if not (figures or pictures):
        return dict.fromkeys(("live_data", "script", "script_digest", "live_style"), "")
    uplot, licence, ours = (
        (TEMPLATES / name).read_text(encoding="utf-8").strip()
        for name in ("uplot/uPlot.iife.min.js", "uplot/LICENSE", "live.js")
    )
    script = f"/*\n{licence}\n*/\n{uplot.partition('*/')[2].strip()}\n{ours}"
    style = (TEMPLATES / "uplot/uPlot.min.css").read_text(encoding="utf-8").strip()
    return {
        "live_data": page_data(figures, pictures),
        "script": script,
        "script_digest": digest_of(script),
        "live_style": style,
    }


def digest_of(script: str) -> str:
    """Return the SHA-256 of a script as a content security policy names it."""
    return base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")


def whole_ids(value: str) -> Any:
    """Return escaped text in which no line breaks within a date, or the id of a flight.

    Very long ids are as other words.

    Examples
    --------
    >>> whole_ids("Rejected: 20260504T060000Z_SIM-1_101 <b>.")
    Markup('Rejected: <span class="id">20260504T060000Z_SIM-1_101</span> &lt;b&gt;.')
    """
    from markupsafe import Markup, escape

    text = clean(value)
    if not _WHOLE.search(text):
        return text
    return Markup(_WHOLE.sub(r'<span class="id">\g<0></span>', str(escape(text))))


@cache
def _environment() -> Any:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_without_hidden_characters,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters["ids"] = whole_ids
    return made


def _without_hidden_characters(value: Any) -> Any:
    return clean(value) if type(value) is str else value
