"""Standards that the flights of a folder are held against, by the system that judges them."""

from pathlib import Path
from typing import NamedTuple

from groundstation.base.errors import GroundstationError, SettingsError, UsageError
from groundstation.base.failures import gathered_failures
from groundstation.base.shipped_toml import SUFFIX, ShippedToml, TomlFile
from groundstation.pipeline.many_flights.inputs import saved_flights
from groundstation.pipeline.one_flight.identity import safe_part
from groundstation.pipeline.verbs.acceptance import STANDARDS
from groundstation.reports.flight_report import flight_report_html, write_pages
from groundstation.results.files import SavedFlight, csv_text, json_text, load, write_text
from groundstation.systems import systems
from groundstation.systems.folder_standard import FolderStandard, HeldTo


class Held(NamedTuple):
    """Answer of a standard, its line for people, what was written, what was unread."""

    answer: HeldTo
    line: str
    written: list[Path]
    problem: str
    unread: list[str]


class ChosenStandard(NamedTuple):
    """Standard of a system, and the file that states its limits."""

    standard: FolderStandard
    file: TomlFile


def standard_of(name_or_path: str) -> ChosenStandard | None:
    """Find the standard of a name or a file; None where it is of no system.

    Raises
    ------
    SettingsError
        For an unknown name, a file that cannot be read, or one of an unknown kind.
    """
    for one in systems().folder_standards:
        if name_or_path.lower() in one.shipped.names():
            return ChosenStandard(one, one.shipped.read(name_or_path))
    if not name_or_path.endswith(SUFFIX):
        names = (*STANDARDS.names(), *(name for one in systems().folder_standards for name in one.shipped.names()))
        if name_or_path.lower() not in names:
            raise SettingsError("standard", repr(name_or_path), f"a file *{SUFFIX} or one of {', '.join(names)}")
        return None
    file = ShippedToml("groundstation", "", "standard").read(name_or_path)
    kind = file.table.get("kind")
    if kind is None:
        return None
    kinds = {one.kind: one for one in systems().folder_standards}
    if kind not in kinds:
        expected = f"{', '.join(map(repr, kinds))}; left out, the standard is one of the INS"
        raise SettingsError(f"{file.where}, key kind", repr(kind), expected)
    return ChosenStandard(kinds[kind], file)


def hold_to(out: Path, standard: FolderStandard, file: TomlFile, folder: Path | None = None) -> Held:
    """Judge the flights of a folder, and write page, PDF, JSON and table.

    ``folder`` left out, they stand beside the flights.

    Raises
    ------
    UsageError
        When the folder is not one that ``run`` made, or ``folder`` is a file.
    SettingsError
        For a standard that cannot be used.
    """
    target = out if folder is None else folder
    if target.exists() and not target.is_dir():
        raise UsageError(str(target), "a file", "a folder for the page")
    flights: list[SavedFlight] = []
    unread: list[str] = []
    for one in saved_flights(out):
        try:
            flights.append(load(one, systems().answer_types))
        except GroundstationError as error:
            unread.append(f"{one.name}: cannot be read: {error}")
    answer = standard.judge(flights, file, unread)
    target.mkdir(parents=True, exist_ok=True)
    stem = f"{standard.kind}_{safe_part(file.name) or 'standard'}"
    page = target / f"{stem}.html"
    shown = standard.document(answer)
    with gathered_failures():
        pages = write_pages(page, lambda one: flight_report_html(one, f"{stem}.json"), shown, shown, with_pdf=True)
    write_text(target / f"{stem}.json", json_text(answer.to_dict()))
    write_text(target / f"{stem}.csv", csv_text(answer.table))
    written = [*pages.paths, target / f"{stem}.json", target / f"{stem}.csv"]
    return Held(answer, f"{shown.front.title}: {shown.front.headline}", written, pages.problem, unread)
