"""Run of one log into a folder of its own: MCAP, answers, recording and report."""

import os
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import field, replace
from functools import partial as bound
from pathlib import Path, PurePosixPath

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnclaimedLogError, UnreadableLogError
from groundstation.base.failures import attempt, failures, gathered_failures, is_incomplete, with_failures
from groundstation.base.findings import SEVERITIES, Finding, worst
from groundstation.base.records import RecordBatch
from groundstation.base.to_disk import sync_folder
from groundstation.base.words import counted
from groundstation.pipeline.one_flight.ahead import imported_meanwhile
from groundstation.pipeline.one_flight.analyse import Given, analyse
from groundstation.pipeline.one_flight.apply import apply_step, corrected_name, write_derived
from groundstation.pipeline.one_flight.convert import Converted, convert_flight, parts_told
from groundstation.pipeline.one_flight.identity import flight_id, sha256_of
from groundstation.pipeline.one_flight.job import Job as Job
from groundstation.pipeline.one_flight.line import line_of_results
from groundstation.pipeline.one_flight.log import Log, digest_of, open_parts
from groundstation.pipeline.one_flight.manifest import manifest_of
from groundstation.pipeline.one_flight.outcome import Outcome, State, reason_of
from groundstation.pipeline.one_flight.parts import part_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.resume import Finished, keys_of
from groundstation.pipeline.one_flight.sealing import note, seal
from groundstation.reports.exports import write_exports
from groundstation.reports.flight_report import PDF, REPORT, add_pdf, write_flight_report
from groundstation.results.file_names import ARRAYS, MANIFEST, OLD_ARRAYS, SUMMARY, TABLES
from groundstation.results.flight import FlightResults
from groundstation.results.manifest import PartOfRun, PowerUpOfRun, Resume
from groundstation.systems import systems
from groundstation.tables.table import Flight

PARTIAL_PREFIX = ".partial-"
OF_THE_WORLD = OSError, GroundstationError  # a full disk, a setting: no defect of the part that meets it
MOST_APART = 50  # records that a part read alone may have more than as part of a flight, at each joint
Version = tuple[tuple[int, int], ...]  # of each file of a log: time and size


@dataclass
class Stopwatch:
    """Seconds spent by stage."""

    listen: Listener = silent
    name: str = ""
    times_s: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, text: str) -> Iterator[None]:
        """Time a stage and tell the listener that it began."""
        self.listen(Event("stage", self.name, text))
        started = time.perf_counter()
        try:
            yield
        finally:
            self.times_s[text] = self.times_s.get(text, 0.0) + time.perf_counter() - started


def run_flight(job: Job, listen: Listener = silent) -> Outcome:
    """Run one log into a partial folder in ``out``.

    The caller moves it into place (see :func:`place`). A log that cannot be read or computed gives an outcome with the
    reason, never an exception: one bad log never stops the others. Nor does one part of a flight that fails by a defect
    (an analysis, a figure, a tab) stop the rest of it: the flight is then incomplete, and a finding says what it lacks.
    Of a log with several power-ups each has its own folder, those behind the first in ``more``.
    """
    watch = Stopwatch(listen, job.path.name)
    try:
        if job.finished is not None and job.step in ("nothing", "pdf", "reports"):
            with gathered_failures():
                return _run_reports(job, job.finished, watch)
        paths = [Path(part.path) for part in job.parts] or [job.path]
        version = tuple(map(_version, paths))
        log = open_parts(paths, job.configuration.profile_path, job.configuration.icds)
        job.out.mkdir(parents=True, exist_ok=True)
    except UnclaimedLogError as error:
        return Outcome(job.log, "failed" if job.is_named else "skipped", str(error))
    except Exception as error:
        return _failed(job, error, watch)
    return _run_log(log, version, job, watch)


def _run_log(log: Log, version: Version, job: Job, watch: Stopwatch) -> Outcome:
    """Run a log, or one power-up of it, into a partial folder.

    Each power-up goes into its own.
    """
    partial = partial_folder(job.out)
    try:
        with gathered_failures():
            found = _run(log, version, job, partial, watch)
        if isinstance(found, Outcome):
            return found
        wanted = [one for one in found if job.power_up in (0, _power_up_of(one))]
        if not wanted:
            raise UnreadableLogError(
                log.path.name, f"{len(found)} power-ups", f"{job.power_up} of them", "run it again"
            )
        first, *others = [_run_log(one, version, job, Stopwatch(watch.listen, watch.name)) for one in wanted]
        outcome = replace(first, more=tuple(others))
    except Exception as error:
        outcome = _failed(job, error, watch, log)
    shutil.rmtree(partial, ignore_errors=True)
    return outcome


def _power_up_of(log: Log) -> int:
    return 0 if log.segment is None else log.segment.number


def _failed(job: Job, error: Exception, watch: Stopwatch, log: Log | None = None) -> Outcome:
    reason, trace = reason_of(job.name, error)
    sha256, power_up = ("", 0) if log is None else (log.source.sha256, _power_up_of(log))
    return Outcome(job.log, "failed", reason, sha256=sha256, times_s=watch.times_s, trace=trace, power_up=power_up)


def partial_folder(out: Path) -> Path:
    """Make a folder in ``out`` for unfinished work, with the permissions of the user's mask."""
    partial = out / f"{PARTIAL_PREFIX}{secrets.token_hex(8)}"
    partial.mkdir()
    return partial


def _version(path: Path) -> tuple[int, int]:
    """Return time and size of a file, which change when it is written to."""
    found = path.stat()
    return found.st_mtime_ns, found.st_size


def _require_unchanged(log: Log, version: Version) -> None:
    """Refuse a log that was written to while it was read.

    Its digest is not that of what was converted.
    """
    digests = log.digests or (log.source.sha256,)
    for path, before, sha256 in zip(log.parts or (log.path,), version, digests, strict=True):
        if _version(path) != before and (log.is_store or digest_of(path) != sha256):
            raise UnreadableLogError(path.name, "changed while it was read", "", "run it again once it is complete")


def _run(log: Log, version: Version, job: Job, partial: Path, watch: Stopwatch) -> Outcome | tuple[Log, ...]:
    """Run one flight into a folder.

    For a log with several power-ups nothing is run; a log for each is returned.
    """
    from groundstation.results.files import put_failures, save

    mcap = partial / "flight.mcap"
    with imported_meanwhile(with_pages=not job.only_results):
        converted: Converted | tuple[Log, ...]
        if job.step == "analysis" and job.finished is not None:
            converted = _taken_over(job.finished, mcap)
        else:
            with watch.stage("converting"):
                converted = convert_flight(log, mcap, job.configuration.thresholds, job.configuration.references)
            _require_unchanged(log, version)
        if isinstance(converted, tuple):
            return converted
        with watch.stage("reading the MCAP"):
            flight = read_flight(mcap, converted)
    start_utc_ns = flight.start_ns if flight.has_utc else None
    path = job.url or str(log.path.absolute())
    power_up, parts = _power_up(log, job), _parts(log, job, path, converted, flight)
    number = power_up.number if power_up else 0
    identity = flight_id(start_utc_ns, flight.metadata, log.source.sha256, number, add_suffix=job.add_suffix)
    with watch.stage("estimating"):
        results = analyse(flight, given_of(log, converted, identity), job.configuration)
        asked = flight, results, job.configuration
        applied = attempt("applied deviation", "all", apply_step, *asked, unless=OF_THE_WORLD)
        results = results if applied is None else applied.results
        for one in systems().analyses:
            attempt("columns", one.name, one.values, results.answers)  # of the tables of flights
    with watch.stage("saving"):
        if applied is not None:
            corrected = partial / corrected_name(identity)
            write_derived(corrected, converted.info, applied.derived, job.configuration.thresholds)
        results = replace(results, findings=with_failures(results.findings, failures()))
        mcap.rename(partial / f"{identity}.mcap")
        text = sentence(results)
        keys = keys_of(log.source, job.configuration, digests=log.digests)
        resume = Resume(keys, text, converted.has_lost_data)
        settings = job.configuration.to_dict()
        manifest = manifest_of(results, settings, path=path, resume=resume, power_up=power_up, parts=parts)
        save(partial, results, manifest)
    problem = _show(partial, flight, results, job, watch)
    put_failures(partial, failures())
    findings = with_failures(results.findings, failures())
    with watch.stage("saving"):
        seal(partial, manifest, {f"{identity}.mcap": converted.sha256})
    return Outcome(
        job.log,
        state_of(findings, converted.has_lost_data, job.fail_on),
        "; ".join(filter(None, (text, problem))),
        flight_id=identity,
        folder=str(partial),
        sha256=log.source.sha256,
        times_s=watch.times_s,
        failures=failures(),
        power_up=number,
        parts=parts,
        loss=results.ledger.loss,
    )


def _parts(log: Log, job: Job, path: str, converted: Converted, flight: Flight) -> tuple[PartOfRun, ...]:
    """Return the consecutive logs of a flight, with the facts that show which one goes on.

    Raises
    ------
    GroundstationError
        When the records of parts are not those of the flight: they are not of one recording.
    """
    if _power_up(log, job) is not None:
        return ()
    if job.step == "analysis" and job.finished is not None:
        return job.finished.parts
    if log.is_store:  # a recorder does not go on in it
        return tuple(
            PartOfRun(name=name, sha256=sha256, reader=log.source.reader)
            for name, sha256 in parts_told(converted.info.metadata)
        )
    whole = part_of(log, path, converted.info.reader, flight)
    if not log.parts:
        return (whole,)
    missing = sum(part.rows for part in job.parts) - whole.rows
    if missing > MOST_APART * (len(job.parts) - 1):
        raise GroundstationError(
            log.source.name, f"{counted(missing, 'record')} of its parts missing", "files of one layout"
        )
    return tuple(replace(one, sha256=sha256) for one, sha256 in zip(job.parts, log.digests, strict=True))


def _power_up(log: Log, job: Job) -> PowerUpOfRun | None:
    """Return which power-up of its log a flight is, None for a log with one."""
    if log.segment is not None:
        return PowerUpOfRun(log.segment.number, log.segment.count)
    return job.finished.power_up if job.step == "analysis" and job.finished is not None else None


def _show(partial: Path, flight: Flight, results: FlightResults, job: Job, watch: Stopwatch) -> str:
    """Write the recording and the reports of saved results, where asked for.

    Returns what went wrong.
    """
    if job.only_results:
        return _export(partial)
    with watch.stage("recording"):
        from groundstation.viewer.recording import write_recording

        path = partial / f"{results.flight_id}.rrd"
        layout = job.configuration.layout_bytes("flight")
        attempt("recording", "flight", write_recording, path, flight, results, systems(), layout, unless=OF_THE_WORLD)
    with watch.stage("reporting"):
        return write_flight_report(partial, systems(), with_pdf=job.with_pdf).problem


def _export(folder: Path) -> str:
    """Write the tables that reports write beside them; returns what went wrong."""
    from groundstation.results.files import load

    every = systems()
    exports = bound(write_exports, load(folder, every.answer_types), every, with_pages=False)
    written = attempt("report", "exports", exports, unless=OF_THE_WORLD)
    return "" if written is None else written[1]


def _run_reports(job: Job, finished: Finished, watch: Stopwatch) -> Outcome:
    """Return the outcome of a finished flight, its reports made again where asked for."""
    from groundstation.results.files import put_failures

    problem = ""
    if job.step == "reports" and job.only_results:
        problem = _export(finished.folder)
        put_failures(finished.folder, failures())
        exports = systems().exports_of(finished.answered, with_pages=False)
        note(finished.folder, [finished.folder / one.name for one in exports])
    elif job.step != "nothing":
        with watch.stage("reporting"):
            problem = report_finished(
                finished.folder,
                with_page=job.step == "reports",
                with_pdf=job.with_pdf or PDF in finished.files,  # one that is there stays
            )
    return Outcome(
        job.log,
        state_of(with_failures(finished.findings, failures()), finished.has_lost_data, job.fail_on),
        "; ".join(filter(None, (finished.text, problem))),
        flight_id=finished.flight_id,
        folder=str(finished.folder),
        sha256=finished.sha256,
        times_s=watch.times_s,
        was_finished=job.step == "nothing",
        failures=failures(),
        power_up=job.power_up,
        parts=finished.parts,
        loss=finished.loss,
    )


def report_finished(folder: Path, *, with_page: bool, with_pdf: bool) -> str:
    """Write the report of a finished folder again, or its PDF alone.

    The manifest is brought up to date. Returns the problem, empty where there is none.
    """
    every = systems()
    written = write_flight_report(folder, every, with_pdf=with_pdf) if with_page else add_pdf(folder, every)
    note(folder, written.paths, removed=report_files())
    return written.problem


def _taken_over(finished: Finished, target: Path) -> Converted:
    """Return the MCAP of a finished flight, as if just converted."""
    from groundstation.store.reader import read_info

    try:
        os.link(finished.mcap, target)
    except OSError:  # no links here, or another file system
        shutil.copyfile(finished.mcap, target)
    info, sha256 = read_info(target), finished.mcap_sha256 or sha256_of(target)
    return Converted(info, info.findings, any(entry.get("loses_data") for entry in info.damages), sha256)


def given_of(log: Log, converted: Converted, identity: str) -> Given:
    """Return the facts of a converted log before anything is estimated."""
    info = converted.info
    return Given(identity, log.source, info.ledger, info.clock, converted.findings, converted.has_lost_data)


def read_flight(mcap: Path, converted: Converted) -> Flight:
    """Return tables of an MCAP that was just written."""
    from groundstation.store.reader import read
    from groundstation.tables.assemble import flight_from_batches

    info = converted.info
    batches = (item for item in read(mcap) if isinstance(item, RecordBatch))
    return flight_from_batches(
        batches,
        metadata=info.metadata,
        has_utc=info.has_utc,
        source_name=info.source_name,
        rows=info.ledger.rows,
        pauses=info.ledger.pauses,
    )


def state_of(findings: tuple[Finding, ...], has_lost_data: bool, fail_on: str) -> State:
    """Return the state of a run from its findings and whether data was lost."""
    if is_incomplete(findings):
        return "incomplete"
    gravest = worst(findings)
    if fail_on in SEVERITIES and gravest and SEVERITIES.index(gravest) >= SEVERITIES.index(fail_on):
        return "limit_reached"
    return "data_lost" if has_lost_data else "done"


def sentence(results: FlightResults) -> str:
    """Return the results of a flight in one line, the answer first that its page opens with."""
    return line_of_results(results, systems())


def is_made(name: str, identity: str) -> bool:
    """Tell whether a run makes that file of a flight folder; any other file is the user's.

    Examples
    --------
    >>> is_made("tables/heading.csv", "NOTIME_abababab"), is_made("notes.txt", "NOTIME_abababab")
    (True, False)
    """
    made = SUMMARY, MANIFEST, ARRAYS, OLD_ARRAYS, TABLES, f"{identity}.mcap"
    return PurePosixPath(name).parts[0] in (*made, *optional_files(identity))


def optional_files(identity: str) -> tuple[str, ...]:
    """Return the files of a flight folder that not every run makes.

    Left from an earlier run, they would show other results.
    """
    return f"{identity}.rrd", *report_files(), corrected_name(identity)


def report_files() -> tuple[str, ...]:
    """Return the files of a flight that are its reports: page, PDF, those of systems."""
    return REPORT, PDF, *(one.name for one in systems().exports)


def remove(folder: Path) -> None:
    """Remove a flight folder.

    Where it holds foreign files, only the run's own files are removed, its marks first.
    """
    if all(is_made(entry.name, folder.name) for entry in folder.iterdir()):
        shutil.rmtree(folder.rename(folder.with_name(f"{PARTIAL_PREFIX}{folder.name}")))  # a kill leaves no part of it
        return
    for name in (SUMMARY, MANIFEST):
        (folder / name).unlink(missing_ok=True)
    for entry in folder.iterdir():
        if is_made(entry.name, folder.name):
            shutil.rmtree(entry) if entry.is_dir() and not entry.is_symlink() else entry.unlink()


def place(partial: Path, target: Path) -> None:
    """Move a finished flight folder into place.

    In a folder that exists, only the files of a run are replaced.
    """
    if not target.exists():
        partial.rename(target)
        return
    (target / MANIFEST).unlink(missing_ok=True)  # the mark of a whole folder goes first and comes back last
    sync_folder(target)
    for name in optional_files(target.name):
        (target / name).unlink(missing_ok=True)
    shutil.rmtree(target / OLD_ARRAYS, ignore_errors=True)
    for entry in sorted(partial.iterdir(), key=lambda path: path.name == MANIFEST):
        old = target / entry.name
        if entry.name == MANIFEST:
            sync_folder(target)
        if old.is_dir() and not old.is_symlink():
            shutil.rmtree(old)
        else:
            old.unlink(missing_ok=True)
        entry.rename(old)
    partial.rmdir()
