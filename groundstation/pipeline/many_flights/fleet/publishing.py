"""Files beside the flight folders of an OUT: the index and what the flights say together."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from groundstation.base.errors import GroundstationError, UsageError, told_in_a_line
from groundstation.base.failures import attempt, failures, gathered_failures
from groundstation.pipeline.many_flights.fleet.index import outcome_beside, rows_without_flight, write_index_of
from groundstation.pipeline.many_flights.fleet.installations import refresh_installations, show_installation
from groundstation.pipeline.many_flights.fleet.refresh import forget_month, refresh, restamp
from groundstation.pipeline.many_flights.fleet.samples import SAMPLES
from groundstation.pipeline.many_flights.fleet.scan import FLIGHTS, DamagedMonthError, Scan
from groundstation.pipeline.many_flights.fleet.statistics import FLEET_PARQUET, write_fleet
from groundstation.pipeline.many_flights.fleet.unit_files import UNIT_FLIGHTS_CSV, UNITS_CSV, keep_limits
from groundstation.pipeline.many_flights.inputs import (
    FLIGHT_FOLDER_MARK,
    flight_folders,
    is_ours,
    plan_folders,
    session_folders,
)
from groundstation.pipeline.one_flight.flight import report_files
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.sealing import note
from groundstation.reports.fleet_report import PAGE as FLEET_PAGE
from groundstation.reports.fleet_report import PDF as FLEET_PDF
from groundstation.reports.fleet_report import write_fleet_report
from groundstation.reports.index import IndexRow
from groundstation.results.file_names import INDEX_CSV, INDEX_JSON
from groundstation.results.installations import INSTALLATIONS
from groundstation.systems import systems

FLEET_RECORDING = "fleet.rrd"
FLEET_FILES = (
    *(INDEX_JSON, INDEX_CSV, FLEET_PARQUET, FLIGHTS, SAMPLES, INSTALLATIONS),
    *(UNITS_CSV, UNIT_FLIGHTS_CSV),
    *(FLEET_RECORDING, FLEET_PAGE, FLEET_PDF),
)


def write_beside(
    out: Path,
    outcomes: Sequence[Outcome],
    kept_rows: Sequence[IndexRow] = (),
    *,
    with_pdf: bool = False,
    only_results: bool = False,
    found: Scan | None = None,
    remade: Sequence[str] | None = None,
    layout: bytes = b"",
) -> tuple[Outcome, ...]:
    """Write everything that stands beside the flight folders.

    Returns what could not be written or read.

    ``found`` is what :func:`~groundstation.pipeline.many_flights.fleet.refresh.refresh` gave, where it was called.
    With ``only_results`` the page and the recording of all flights are removed: they would tell of an earlier run.
    ``remade`` are the flights whose reports are new; left out: those of ``outcomes`` that were not finished before.
    ``layout`` is a saved one for the recording of all flights, in place of its own.
    """
    problems: list[Outcome] = []
    if remade is None:
        remade = [one.flight_id for one in outcomes if one.flight_id and not one.was_finished]
    again: set[str] = set()
    try:
        with told_in_a_line(str(out)), gathered_failures():
            while True:
                if found is None:
                    found, unwritten = refresh(out)
                    problems += unwritten
                try:
                    learn = partial(refresh_installations, out, found, remade)
                    shown = attempt("installations", "fleet", learn, unless=(OSError, GroundstationError))
                    restamp(out, shown or ())
                    problems += _write_beside(out, outcomes, kept_rows, found, with_pdf, only_results, layout)
                    problems += [outcome_beside(out, "failed", f"{out}: {one.text}", one.trace) for one in failures()]
                    break
                except DamagedMonthError as error:
                    if error.month in again:  # making it again did not help
                        raise
                    again.add(error.month)
                    forget_month(out, error.month)
                    text = f"{error.where}: damaged ({error.found}), made again from the flight folders"
                    problems.append(outcome_beside(out, "skipped", text))
                    found = None
    except Exception as error:  # the flights are done, and told of in any case
        problems.append(outcome_beside(out, "failed", *reason_of(str(out), error)))
    return tuple({(one.source, one.text): one for one in problems}.values())


def _write_beside(
    out: Path,
    outcomes: Sequence[Outcome],
    kept_rows: Sequence[IndexRow],
    found: Scan,
    with_pdf: bool,
    only_results: bool,
    layout: bytes,
) -> list[Outcome]:
    """Write index, fleet, page and recording of the flights as they were found.

    Returns what went wrong.
    """
    problems = list(write_index_of(out, outcomes, kept_rows, found))
    fleet, unwritten = write_fleet(out, found)
    problems += unwritten
    if only_results:
        for name in (FLEET_PAGE, FLEET_PDF, FLEET_RECORDING):
            (out / name).unlink(missing_ok=True)
        return problems
    from groundstation.viewer.fleet import write_fleet_recording

    recording = out / FLEET_RECORDING
    write = partial(write_fleet_recording, recording, fleet, systems(), layout)
    attempt("recording", "fleet", write, unless=(OSError, GroundstationError))
    problem = write_fleet_report(out, fleet, systems(), with_pdf=with_pdf).problem
    return [*problems, outcome_beside(out, "skipped", f"{out}: {problem}")] if problem else problems


class ReportedAgain(NamedTuple):
    """Result of making reports again.

    Parameters
    ----------
    written : list of Path
    problems : tuple of Outcome
        Flight folders that could not be read or have no PDF though one was asked for.
    removed : list of Path
        PDFs of an earlier run, which were not asked for.
    """

    written: list[Path]
    problems: tuple[Outcome, ...]
    removed: list[Path]


def report_again(out: Path, *, with_pdf: bool = False, limits: Path | None = None) -> ReportedAgain:
    """Make reports and index of an OUT again from the saved results.

    Of one flight folder, its report alone is made. ``limits`` is a file of limits for the INS units, which is kept in
    the folder.

    Raises
    ------
    UsageError
        When the folder is not one that ``run`` made, or limits are given with one flight.
    SettingsError
        For a file of limits that cannot be used.
    """
    from groundstation.reports.flight_report import PDF, write_flight_report

    is_flight = (out / FLIGHT_FOLDER_MARK).is_file()
    if not is_flight and (not out.is_dir() or not (is_ours(out) or flight_folders(out))):
        raise UsageError(str(out), "no results", "a folder that `run` made")
    if limits is not None:
        if is_flight:
            raise UsageError(str(out), "--unit-limits with one flight", "a folder of flights")
        keep_limits(out, limits)
    paths: list[Path] = []
    problems: list[Outcome] = []
    folders = [out] if is_flight else [*flight_folders(out), *session_folders(out), *plan_folders(out)]
    pdfs = [path for path in (out / FLEET_PDF, *(folder / PDF for folder in folders)) if path.is_file()]
    for folder in folders:
        try:
            with told_in_a_line(str(folder)):
                written = write_flight_report(folder, systems(), with_pdf=with_pdf)
                note(folder, written.paths, removed=report_files())
        except GroundstationError as error:
            if is_flight:
                raise
            problems.append(outcome_beside(folder, "failed", str(error)))
            continue
        paths += written.paths
        if written.problem:
            problems.append(outcome_beside(folder, "done", f"{folder.name}: {written.problem}"))
        problems += [
            outcome_beside(folder, "incomplete", f"{folder.name}: {one.text}", one.trace) for one in written.failures
        ]
    if is_flight:
        show_installation(out.absolute())
        return ReportedAgain(paths, tuple(problems), _gone(pdfs, with_pdf=with_pdf))
    if not with_pdf:
        (out / FLEET_PDF).unlink(missing_ok=True)
    told = {one.source for one in problems}
    remade = [folder.name for folder in flight_folders(out)]
    beside = write_beside(out, (), rows_without_flight(out), with_pdf=with_pdf, remade=remade)
    unread = [one for one in beside if one.source not in told]
    paths += [out / name for name in FLEET_FILES if (out / name).exists()]
    return ReportedAgain(paths, (*problems, *unread), _gone(pdfs, with_pdf=with_pdf))


def _gone(pdfs: Sequence[Path], *, with_pdf: bool) -> list[Path]:
    """PDFs that are not there any more.

    None where PDFs were asked for: then it was told why.
    """
    return [] if with_pdf else [path for path in pdfs if not path.exists()]
