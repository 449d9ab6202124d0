"""Files that systems write beside a flight's report: for flights with their answer alone."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from groundstation.chapters.parts import Paper
from groundstation.reports.exports import write_exports
from groundstation.results.files import save
from groundstation.results.flight import FlightResults
from groundstation.results.manifest import Manifest
from groundstation.systems.system import Export, System, Systems
from tests.installation_example import heading_of
from tests.report_example import example
from tests.saved import load

TEMPLATE = "#let told = json(bytes(sys.inputs.document))\n#told.text"


@dataclass(frozen=True)
class Told:
    text: str


def table(results: FlightResults) -> str | None:
    return f"flight\n{results.flight_id}\n" if results.figures else None


def offering(template: Path) -> Systems:
    def page(results: FlightResults) -> Paper:
        return Paper(Told(results.flight_id), template)

    def exports(analysis: str, end: str) -> tuple[Export, ...]:
        return (
            Export(f"table{end}.csv", analysis, lambda: table),
            Export(f"page{end}.pdf", analysis, lambda: page, is_page=True),
        )

    return Systems((System("own", exports=(*exports("heading", ""), *exports("nothing", "_of_none"))),))


def written(folder: Path, systems: Systems, **asked: Any) -> tuple[list[str], str]:
    paths, problem = write_exports(load(folder), systems, **asked)
    assert all(path.is_file() for path in paths)
    return [path.name for path in paths], problem


def test_files_of_the_answers_that_a_flight_has(tmp_path: Path) -> None:
    template = tmp_path / "page.typ"
    template.write_text(TEMPLATE, encoding="utf-8")
    systems, folder = offering(template), tmp_path / "flight"
    save(folder, example(heading_of(0.3)), Manifest())
    old = [folder / name for name in ("table_of_none.csv", "page_of_none.pdf")]
    for path in old:
        path.write_text("of an earlier run", encoding="utf-8")
    assert written(folder, systems) == (["table.csv", "page.pdf"], "")
    assert not any(path.exists() for path in old)
    card = (folder / "page.pdf").read_bytes()
    assert written(folder, systems, with_pages=False) == (["table.csv"], "")
    assert (folder / "page.pdf").read_bytes() == card
    save(folder, replace(example(heading_of(0.3)), figures=()), Manifest())
    names, problem = written(folder, systems)
    assert names == ["page.pdf"] and problem.startswith("table.csv: not written, its arrays are missing")
    template.write_text("#nothing", encoding="utf-8")
    names, problem = written(folder, systems)
    assert names == [] and "page.pdf: not written, typst failed" in problem
