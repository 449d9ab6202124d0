"""Files that systems write beside a flight's report: tables for programs, pages to print."""

from pathlib import Path

from groundstation.reports.pdf import PdfError, write_pdf
from groundstation.results.files import SavedFlight, write_text
from groundstation.systems.system import Export, Systems


def write_exports(saved: SavedFlight, systems: Systems, *, with_pages: bool = True) -> tuple[tuple[Path, ...], str]:
    """Write the files of the answers that a flight has.

    Old ones of answers that it has not go. Without ``with_pages`` a page of an answer that is there stays.

    Returns
    -------
    tuple of Path, str
        What was written, and why some of them were not.
    """
    wanted = systems.exports_of(saved.results.answers, with_pages=with_pages)
    kept = {one.name for one in systems.exports_of(saved.results.answers) if one not in wanted}
    for name in (one.name for one in systems.exports if one.name not in kept):
        (saved.folder / name).unlink(missing_ok=True)
    paths, problems = [], []
    for one in wanted:
        path = saved.folder / one.name
        problem = _write(saved, one, path)
        if problem:
            problems.append(problem)
        else:
            paths.append(path)
    return tuple(paths), "; ".join(problems)


def _write(saved: SavedFlight, export: Export, path: Path) -> str:
    """Write a file; returns why it was not written, empty where it was."""
    made = export.load()(saved.results)
    if made is None:
        return f"{export.name}: not written, its arrays are missing in arrays/: run the log again"
    if isinstance(made, str):
        write_text(path, made)
        return ""
    try:
        write_pdf(made.document, path, made.template)
    except PdfError as error:
        return str(error)
    return ""
