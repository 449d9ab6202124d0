"""Session from beginning to end: MCAPs, answers, recording and report in its own folder."""

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.clock import Clock
from groundstation.base.errors import GroundstationError, NotAssessableError
from groundstation.base.failures import attempt, failures, gathered_failures, with_failures
from groundstation.base.findings import Finding
from groundstation.base.ledger import Ledger
from groundstation.base.records import RecordBatch
from groundstation.base.signals import kind_of
from groundstation.chapters.wording import names_or_count
from groundstation.pipeline.many_flights.sessions.job import SessionJob, kept_session
from groundstation.pipeline.one_flight.analyse import run_analyses
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import (
    OF_THE_WORLD,
    Stopwatch,
    partial_folder,
    place,
    report_finished,
    state_of,
)
from groundstation.pipeline.one_flight.identity import MAX_PART_CHARACTERS, flight_id, safe_part
from groundstation.pipeline.one_flight.manifest import manifest_of
from groundstation.pipeline.one_flight.outcome import Outcome, State, reason_of
from groundstation.pipeline.one_flight.progress import Listener, silent
from groundstation.pipeline.one_flight.sealing import seal
from groundstation.reports.flight_report import write_flight_report
from groundstation.results.arrays.session import SessionClocks, SessionPoints
from groundstation.results.figures import FigureData
from groundstation.results.file_names import MANIFEST
from groundstation.results.files import load_document, load_manifest, put_failures, save
from groundstation.results.flight import FlightResults, Source
from groundstation.results.manifest import LogOfSession, Manifest, Resume
from groundstation.systems import systems
from groundstation.systems.known import SessionKnown
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.session_assemble import AssembledSession, session_from_flights
from groundstation.tables.session_settings import Stations
from groundstation.tables.table import Flight

if TYPE_CHECKING:
    from groundstation.store.info import StoreInfo

KINDS = frozenset(("ins", "baro", "link", "satellite", "truth"))  # of topics that a session reads
MCAPS = "mcap"  # folder of those that the session converted itself


def run_one(job: SessionJob, listen: Listener = silent) -> Outcome:
    """Run a session into its place.

    Of one that is finished only the reports that are missing are made.

    What cannot be computed is an outcome with the reason, never an exception; a part that fails by a defect is left
    out, as in a flight.
    """
    with gathered_failures():
        return _run_gathering(job, Stopwatch(listen, job.name))


def _run_gathering(job: SessionJob, watch: Stopwatch) -> Outcome:
    partial: Path | None = None
    try:
        if (finished := _finished(job, watch)) is not None:
            return finished
        partial = partial_folder(job.out)
        return _run_into(partial, job, watch)
    except Exception as error:
        reason, trace = reason_of(job.name, error)
        is_wanted = not (job.is_found and isinstance(error, NotAssessableError))
        return _outcome(job, "failed" if is_wanted else "skipped", reason, None, watch, trace)
    finally:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)


def _outcome(
    job: SessionJob, state: State, text: str, folder: Path | None, watch: Stopwatch, trace: str = ""
) -> Outcome:
    name, place = (folder.name, str(folder)) if folder else ("", "")
    return Outcome(
        *(job.name, state, text, name, place, job.sha256, watch.times_s, trace), is_session=True, failures=failures()
    )


def _finished(job: SessionJob, watch: Stopwatch) -> Outcome | None:
    """Outcome of a session that is finished; None without one.

    Its reports are made again where they are missing.
    """
    kept = kept_session(job)
    if kept is None:
        return None
    folder, resume, problem = kept.folder, kept.resume, ""
    if kept.step != "nothing":
        with watch.stage("reporting"):
            problem = report_finished(folder, with_page=kept.step == "reports", with_pdf=kept.with_pdf)
    state = state_of(load_document(folder).findings, resume.has_lost_data, job.fail_on)
    found = _outcome(job, state, "; ".join(filter(None, (resume.text, problem))), folder, watch)
    return replace(found, was_finished=kept.step == "nothing")


def _run_into(partial: Path, job: SessionJob, watch: Stopwatch) -> Outcome:
    with watch.stage("converting"):
        flights, logs, damaged = _flights(partial, job)
    with watch.stage("assembling"):
        settings = job.configuration.settings.session
        assembled = session_from_flights(flights, job.stations, settings=settings)
        if not assembled.session.vehicles:
            reasons = "; ".join(finding.text for finding in assembled.findings)
            raise NotAssessableError(job.name, f"no aircraft with dead reckoning ({reasons})")
    with watch.stage("estimating"):
        results = _results(job, assembled, flights, damaged)
    with watch.stage("saving"):
        text = _sentence(results)
        manifest = _manifest(job, results, logs, Resume(job.keys(), text, bool(damaged)))
        save(partial, results, manifest)
    problem = "" if job.only_results else _show(partial, assembled, results, job, watch)
    put_failures(partial, failures())
    with watch.stage("saving"):
        seal(partial, manifest)
    target = job.out / results.flight_id
    shutil.rmtree(target / MCAPS, ignore_errors=True)
    place(partial, target)
    state = state_of(with_failures(results.findings, failures()), bool(damaged), job.fail_on)
    return _outcome(job, state, "; ".join(filter(None, (text, problem))), target, watch)


def _show(partial: Path, assembled: AssembledSession, results: FlightResults, job: SessionJob, watch: Stopwatch) -> str:
    """Write the recording and the reports of saved results; returns what went wrong."""
    with watch.stage("recording"):
        from groundstation.viewer.session import write_session_recording

        path = partial / f"{results.flight_id}.rrd"
        layout = job.configuration.layout_bytes("session")
        given = (path, assembled, results, systems(), layout)
        attempt("recording", "session", write_session_recording, *given, unless=OF_THE_WORLD)
    with watch.stage("reporting"):
        return write_flight_report(partial, systems(), with_pdf=job.with_pdf).problem


def _flights(partial: Path, job: SessionJob) -> tuple[list[Flight], tuple[LogOfSession, ...], list[Finding]]:
    """Flights of a session as read from each log, the logs, and findings of lost data.

    A log that is no MCAP gets one beside the session's results.
    """
    from groundstation.store.reader import read_info

    flights, logs, damaged = [], [], []
    for log in job.logs:
        mcap, source = log.path, log.source
        if log.is_store:
            info = read_info(mcap)
            has_lost = any(entry.get("loses_data") for entry in info.damages)
        else:
            (partial / MCAPS).mkdir(exist_ok=True)
            mcap = partial / MCAPS / f"{safe_part(log.path.stem) or 'log'}.mcap"
            if mcap.exists():  # of another folder
                mcap = mcap.with_stem(f"{mcap.stem}_{source.sha256[:8]}")
            converted = convert_log(log, mcap, job.configuration.thresholds)
            info, has_lost = converted.info, converted.has_lost_data
        if has_lost:
            text = f"{source.name} lost data; `groundstation check` shows what"
            damaged.append(Finding("warn", "session.lost_data", text, place=source.name))
        flights.append(_read(mcap, info))
        where = _seen_from_a_folder_in(job.out, mcap) if log.is_store else str(mcap.relative_to(partial))
        path = where if log.is_store else str(log.path.absolute())
        logs.append(LogOfSession(path, source.name, source.sha256, source.size_bytes, source.reader, where))
    return flights, tuple(logs), damaged


def _seen_from_a_folder_in(out: Path, mcap: Path) -> str:
    """Path of an MCAP, from a folder in OUT where it is in OUT, else from the root.

    OUT may be moved as a whole.
    """
    if not mcap.resolve().is_relative_to(out.resolve()):
        return str(mcap.absolute())
    return str(Path("..") / mcap.resolve().relative_to(out.resolve()))


def _read(mcap: Path, info: "StoreInfo") -> Flight:
    from groundstation.store.reader import read

    batches = (item for item in read(mcap) if isinstance(item, RecordBatch) and kind_of(item.topic) in KINDS)
    return flight_from_batches(
        batches, metadata=info.metadata, has_utc=info.has_utc, source_name=info.source_name, rows=info.ledger.rows
    )


def _results(
    job: SessionJob, assembled: AssembledSession, flights: Sequence[Flight], damaged: Sequence[Finding]
) -> FlightResults:
    known = SessionKnown(assembled.truth, job.configuration.settings.analyses)
    found = run_analyses(systems().session_analyses, assembled.session, known)
    findings = [*damaged, *job.notes, *_assumed(job), *assembled.findings]
    for analysis in systems().session_analyses:
        findings += found.findings.get(analysis.name, ())
    names = assembled.session.names
    start_utc_ns = assembled.start_ns if assembled.has_utc else None
    identity = flight_id(start_utc_ns, {"aircraft": "session", "flight": joined_names(names)}, job.sha256)
    title = f"session of {names_or_count(names)}"
    tried = {*found.answers, *found.reasons}
    analyses = ", ".join(one.name for one in systems().session_analyses if one.name in tried)
    size = sum(log.source.size_bytes for log in job.logs)
    told = sorted({flight.metadata.get("flight", "") for flight in flights} - {""})
    return FlightResults(
        flight_id=_free(job, identity),
        source=Source(title, job.sha256, size, f"groundstation {analyses}, {len(job.logs)} logs"),
        metadata={"aircraft": ", ".join(names), "flight": ", ".join(told)},
        start_utc_ns=start_utc_ns,
        duration_s=assembled.duration_s,
        status="failed" if any(one.severity == "fail" for one in findings) else "degraded" if damaged else "ok",
        ledger=Ledger(),
        clock=Clock(),
        findings=tuple(findings),
        not_assessable=found.not_assessable,
        answers=found.answers,
        figures=(*_session_figures(assembled), *(one for answer in found.answers.values() for one in answer.figures)),
    )


def _assumed(job: SessionJob) -> Iterator[Finding]:
    """Findings of what the session takes for granted because nobody set it."""
    tables, settings = job.configuration.tables, job.configuration.settings.session
    shipped = {"session": f"sigma of a range, {settings.range_sigma_m:g} m"}
    shipped |= {one.settings_table: one.assumes for one in systems().session_analyses if one.assumes}
    told = [what for table, what in shipped.items() if not tables.get(table)]
    if told:
        text = f"not set, so shipped values are used: {', '.join(told)}; the computed sigmas depend on them"
        yield Finding("info", "session.assumed_sigmas", text)
    if job.stations == Stations():
        text = "no ground stations and no origin: computed on the globe, 13 states per aircraft"
        yield Finding("info", "session.no_stations", text)


def _free(job: SessionJob, identity: str) -> str:
    """Id of the session, with the digest where other logs gave a folder of that name.

    A run replaces what a run found.
    """
    target = job.out / identity
    if not (target / MANIFEST).is_file():
        return identity
    try:
        there = load_manifest(target)
        is_mine = there.source.sha256 == job.sha256 or (job.is_found and there.is_found)
    except GroundstationError:
        is_mine = True
    return identity if is_mine else f"{identity}_{job.sha256[:8]}"


def joined_names(names: Sequence[str]) -> str:
    """Names of the aircraft of a session as a part of its id.

    Of very many it has the first, and how many more.

    Examples
    --------
    >>> joined_names(["A", "B", "C"]), joined_names([f"RA-{number:05d}" for number in range(20)])
    ('A-B-C', 'RA-00000-and-19-others')
    """
    joined = "-".join(names)
    return joined if len(joined) <= MAX_PART_CHARACTERS else f"{names[0]}-and-{len(names) - 1}-others"


def _sentence(results: FlightResults) -> str:
    told = (attempt("line", one.name, one.sentence, results.answers) for one in systems().session_analyses)
    found = [text for text in told if text]
    reasons = "; ".join(f"{entry.analysis}: {entry.reason}" for entry in results.not_assessable)
    return "; ".join(found) or f"not assessable: {reasons}"


def _manifest(job: SessionJob, results: FlightResults, logs: tuple[LogOfSession, ...], resume: Resume) -> Manifest:
    configuration = job.configuration.to_dict() | {"stations": asdict(job.stations)}
    return replace(manifest_of(results, configuration, resume=resume), logs=logs, is_found=job.is_found)


def _session_figures(assembled: AssembledSession) -> tuple[FigureData, ...]:
    """Arrays of a session that no analysis owns.

    They are ``session_clocks``, a row a log, and ``session_points`` where the session has ground points.
    """
    clocks, points = assembled.clocks, assembled.session.points
    offsets = [float("nan") if row.offset_s is None else row.offset_s for row in clocks]
    found: list[FigureData] = [
        SessionClocks(
            aircraft=np.array([row.aircraft for row in clocks], dtype=np.str_),
            log=np.array([row.log for row in clocks], dtype=np.str_),
            has_utc=np.array([row.has_utc for row in clocks], dtype=bool),
            ranges=np.array([row.ranges for row in clocks], dtype=np.int64),
            offset_s=np.array(offsets, dtype=np.float64),
            leaps=np.array([row.leaps for row in clocks], dtype=np.int64),
            is_corrected=np.array([row.is_corrected for row in clocks], dtype=bool),
        )
    ]
    if points:
        places = np.array([point.position_m for point in points])
        x_m, y_m, z_m = places.T
        found.append(
            SessionPoints(
                label=np.array([point.name for point in points], dtype=np.str_),
                x_m=x_m,
                y_m=y_m,
                z_m=z_m,
                position_sigma_m=np.array([point.position_sigma_m for point in points]),
            )
        )
    return tuple(found)
