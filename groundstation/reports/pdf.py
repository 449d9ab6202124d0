"""Reports on paper: a document handed to typst as data.

So no text from a log can act as markup.
"""

import json
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from groundstation.base.errors import GroundstationError
from groundstation.chapters.parts import Mark
from groundstation.chapters.wording import clean
from groundstation.reports.drawing import Drawing
from groundstation.reports.page import TEMPLATES
from groundstation.reports.svg.font import FONTS
from groundstation.results.files import write_bytes

TEMPLATE = TEMPLATES / "report.typ"
# A page inherits them from elsewhere: the name space from HTML, joins and font from its style sheet.
SVG_ALONE = '<svg xmlns="http://www.w3.org/2000/svg" stroke-linejoin="round" font-family="DejaVu Sans" '


class PdfError(GroundstationError):
    """Error of the PDF alone; everything else of the report was made."""


def write_pdf(document: object, path: Path, template: Path | None = None) -> None:
    """Write a report as PDF on A4; equal documents give equal bytes.

    A report is a :class:`~groundstation.chapters.parts.Document`. Another dataclass is set by a template of its own.

    Raises
    ------
    PdfError
        When typst cannot be imported or cannot set the document.
    OSError
        When the file cannot be written.
    """
    try:
        content = pdf_bytes(document, template)
    except BaseException as error:
        # A panic inside typst arrives as a PanicException, which is no Exception.
        if not isinstance(error, ImportError | RuntimeError) and type(error).__name__ != "PanicException":
            raise
        raise PdfError(path.name, f"not written, typst failed ({error})") from error
    write_bytes(path, content)


def pdf_bytes(document: object, template: Path | None = None) -> bytes:
    """Set a report and return the bytes of its PDF.

    The template imports and reads nothing: the document comes as one JSON text in ``sys.inputs``, whose strings typst
    shows as they are. Its root is a folder that holds the template alone, its fonts are those in its package and, for
    pictures, in ours, its time is 1970.
    """
    import typst

    text = json.dumps(_plain(document), ensure_ascii=False).encode("utf-8", "replace").decode("utf-8")
    with tempfile.TemporaryDirectory(prefix="groundstation-") as root:
        return typst.compile(
            shutil.copy(template or TEMPLATE, root),
            root=root,
            ignore_system_fonts=True,
            font_paths=[str(FONTS)],
            sys_inputs={"document": text},
            timestamp=0,
            format="pdf",
        )


def _plain(value: Any) -> Any:
    """Return a part of a document as JSON values, each with its kind."""
    if isinstance(value, str):
        return clean(value).replace(" %", "\u00a0%")  # a number keeps its sign on its line
    if isinstance(value, Sequence):
        return [_plain(item) for item in value]
    if not is_dataclass(value):
        return value
    known = {item.name: _plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, Mark):
        return known | {"symbol": value.symbol}
    if isinstance(value, Drawing):
        known["svg"] = value.svg.replace("<svg ", SVG_ALONE, 1)
    return {"kind": getattr(value, "kind", "")} | known
