"""Turning report parts into pages: jinja2 with autoescape, one style sheet, no scripts, nothing from outside."""

from functools import cache
from pathlib import Path
from typing import Any

from groundstation.chapters.wording import clean

TEMPLATES = Path(__file__).parent / "templates"
# Nothing may be loaded or run: the page needs its own style alone. SVG sets style attributes, hence unsafe-inline.
CONTENT_SECURITY_POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"


def render(template: str, **context: Any) -> str:
    """Render a template of reports/templates; every value is escaped and cleaned of hidden characters."""
    return str(_environment().get_template(template).render(csp=CONTENT_SECURITY_POLICY, **context))


@cache
def _environment() -> Any:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_without_hidden_characters,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def _without_hidden_characters(value: Any) -> Any:
    return clean(value) if type(value) is str else value
