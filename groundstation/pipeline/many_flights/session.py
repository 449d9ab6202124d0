"""Several logs from beginning to end: MCAPs, one session, its answers, recording and report in a folder of its own."""

import hashlib
import json
import platform
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from groundstation.base.clock import Clock
from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.findings import Finding, worst
from groundstation.base.ledger import Ledger
from groundstation.base.records import RecordBatch
from groundstation.base.signals import kind_of
from groundstation.base.toml_settings import settings_from
from groundstation.base.version import __version__
from groundstation.estimators.analyses import ANSWER_TYPES, SESSION_ANALYSES
from groundstation.estimators.cooperative.analysis import SessionKnown
from groundstation.pipeline.many_flights.batch import alone_in, prepare, refuse_foreign
from groundstation.pipeline.many_flights.inputs import file_in, session_folders
from groundstation.pipeline.many_flights.session_figures import session_figures
from groundstation.pipeline.one_flight.analyse import run_analyses
from groundstation.pipeline.one_flight.configuration import SESSION_TABLES, Configuration, read_toml
from groundstation.pipeline.one_flight.convert import Converted, convert_log
from groundstation.pipeline.one_flight.flight import PARTIAL_PREFIX, Stopwatch, place, state_of
from groundstation.pipeline.one_flight.identity import flight_id, safe_part
from groundstation.pipeline.one_flight.log import Log, open_log
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.resume import versions
from groundstation.reports.flight_report import PDF, REPORT, write_flight_report
from groundstation.results.files import MANIFEST, load_document, load_manifest, save, save_manifest
from groundstation.results.flight import FlightResults, Source
from groundstation.results.manifest import Host, Keys, LogOfSession, Manifest, Resume, SourceOfRun
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.session_assemble import AssembledSession, session_from_flights
from groundstation.tables.session_settings import Stations
from groundstation.tables.table import Flight

KINDS = frozenset(("ins", "baro", "link", "satellite", "truth"))  # of topics that a session reads
MCAPS = "mcap"  # folder of those that the session converted itself


@dataclass(frozen=True)
class SessionJob:
    """One session to run.

    Parameters
    ----------
    logs : tuple of Log
        Those that a reader claims, in the order of their digests.
    stations : Stations
    out : Path
    configuration : Configuration
    fail_on : str
    with_pdf : bool
    """

    logs: tuple[Log, ...]
    stations: Stations
    out: Path
    configuration: Configuration
    fail_on: str = "none"
    with_pdf: bool = True

    @property
    def sha256(self) -> str:
        """Digest over those of the logs, whatever their order."""
        return hashlib.sha256("\n".join(sorted(log.source.sha256 for log in self.logs)).encode()).hexdigest()

    def keys(self) -> Keys:
        """Equal keys, equal results: logs, stations, settings and versions go in."""
        logs = [asdict(log.source) for log in self.logs]
        tables = dict(self.configuration.tables)
        thresholds = tables.get("thresholds", {})
        used = {name: tables.get(name, {}) for name in SESSION_TABLES}
        conversion = _digest(logs, thresholds, self.configuration.profile, dict(versions()), platform.python_version())
        analysis = _digest(conversion, asdict(self.stations), used)
        return Keys(conversion, analysis, _digest(analysis, self.with_pdf))


def _digest(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def load_stations(path: Path | None) -> Stations:
    """Ground stations from a TOML file; none without one.

    Raises
    ------
    SettingsError
        For a file that cannot be read, an unknown key or a value out of range, naming file and key.
    """
    return Stations() if path is None else settings_from(Stations, read_toml(path), str(path))


def run_session(
    paths: Sequence[Path],
    out: Path,
    configuration: Configuration,
    *,
    stations: Path | None = None,
    force: bool = False,
    fail_on: str = "none",
    with_pdf: bool = True,
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Analyse the logs of several aircraft together, into ``<out>/<session_id>/``.

    Parameters
    ----------
    paths : sequence of Path
        Logs of any format a reader knows, MCAPs, or flight folders.
    out : Path
        A session in it with the same logs, stations, settings and versions is not run again.
    configuration : Configuration
    stations : Path, optional
        TOML file with the ground stations.

    Returns
    -------
    tuple of Outcome
        Of the session, behind those of the logs that could not be read.

    Raises
    ------
    UsageError
        When a path is missing, a setting is wrong, or ``out`` is something else's.
    """
    ground = load_stations(stations)
    files = [_file_of(path) for path in paths]
    refuse_foreign(out, force)
    listen(Event("begin", total=1))
    logs, failed = _opened(files, configuration)
    if not logs:
        return failed
    job = SessionJob(logs, ground, out, configuration, fail_on, with_pdf)
    with alone_in(out):
        prepare(out)
        outcome = _continued(job, listen) or _run(job, listen)
    listen(Event("end", outcome.source, outcome.text))
    return (*failed, outcome)


def _file_of(path: Path) -> Path:
    if not path.exists():
        raise UsageError(str(path), "no such file")
    return file_in(path, ".mcap") if path.is_dir() else path


def _opened(files: Sequence[Path], configuration: Configuration) -> tuple[tuple[Log, ...], tuple[Outcome, ...]]:
    """The logs that a reader claims, in the order of their digests; why the others are none."""
    logs, failed = [], []
    for path in dict.fromkeys(files):
        try:
            logs.append(open_log(path, configuration.profile_path))
        except Exception as error:
            reason, trace = reason_of(path.name, error)
            failed.append(Outcome(str(path), "failed", reason, trace=trace))
    return tuple(sorted(logs, key=lambda log: (log.source.sha256, log.source.name))), tuple(failed)


def _continued(job: SessionJob, listen: Listener) -> Outcome | None:
    """The outcome of a session that is finished, its reports made again where they are missing; None without one."""
    keys, names = job.keys(), ", ".join(sorted(log.source.name for log in job.logs))
    for folder in session_folders(job.out):
        try:
            manifest = load_manifest(folder)
            findings = load_document(folder).findings
        except GroundstationError:
            continue
        resume = manifest.resume
        if resume is None or resume.keys.analysis != keys.analysis or not (folder / f"{folder.name}.rrd").is_file():
            continue
        watch, problem = Stopwatch(listen, folder.name), ""
        wanted = (REPORT, PDF) if job.with_pdf else (REPORT,)
        if resume.keys != keys or not all((folder / name).is_file() for name in wanted):
            with watch.stage("reporting"):
                problem = write_flight_report(folder, ANSWER_TYPES, with_pdf=job.with_pdf).problem
            save_manifest(folder, _with_keys(manifest, resume, keys))
        state = state_of(worst(findings), resume.has_lost_data, job.fail_on)
        text = "; ".join(filter(None, (resume.text, problem)))
        return Outcome(names, state, text, folder.name, str(folder), job.sha256, watch.times_s)
    return None


def _with_keys(manifest: Manifest, resume: Resume, keys: Keys) -> Manifest:
    return replace(manifest, resume=replace(resume, keys=keys))


def _run(job: SessionJob, listen: Listener) -> Outcome:
    names = ", ".join(sorted(log.source.name for log in job.logs))
    watch = Stopwatch(listen, names)
    partial = Path(tempfile.mkdtemp(prefix=PARTIAL_PREFIX, dir=job.out))
    partial.chmod(0o755)  # mkdtemp's folders are private
    try:
        return _run_into(partial, job, names, watch)
    except Exception as error:
        reason, trace = reason_of(names, error)
        return Outcome(names, "failed", reason, sha256=job.sha256, times_s=watch.times_s, trace=trace)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _run_into(partial: Path, job: SessionJob, names: str, watch: Stopwatch) -> Outcome:
    from groundstation.viewer.session import write_session_recording

    with watch.stage("converting"):
        flights, logs, damaged = _flights(partial, job)
    with watch.stage("assembling"):
        settings = job.configuration.settings.session
        assembled = session_from_flights(flights, job.stations, settings=settings)
        if not assembled.session.vehicles:
            reasons = "; ".join(finding.text for finding in assembled.findings)
            raise GroundstationError(names, f"no aircraft with dead reckoning ({reasons})")
    with watch.stage("estimating"):
        results = _results(job, assembled, flights, damaged)
    with watch.stage("saving"):
        text = _sentence(results)
        resume = Resume(job.keys(), text, bool(damaged))
        save(partial, results, _manifest(job, results, logs, resume))
    with watch.stage("recording"):
        write_session_recording(partial / f"{results.flight_id}.rrd", assembled, results)
    with watch.stage("reporting"):
        problem = write_flight_report(partial, ANSWER_TYPES, with_pdf=job.with_pdf).problem
    target = job.out / results.flight_id
    shutil.rmtree(target / MCAPS, ignore_errors=True)
    place(partial, target)
    state = state_of(worst(results.findings), bool(damaged), job.fail_on)
    told = "; ".join(filter(None, (text, problem)))
    return Outcome(names, state, told, results.flight_id, str(target), job.sha256, watch.times_s)


def _flights(partial: Path, job: SessionJob) -> tuple[list[Flight], tuple[LogOfSession, ...], list[Finding]]:
    """What a session reads of each log; a log that is no MCAP gets one beside the session's results."""
    flights, logs, damaged = [], [], []
    thresholds = job.configuration.settings.thresholds
    for log in job.logs:
        mcap, source = log.path, log.source
        if log.is_store:
            flights.append(_read(mcap, None))
        else:
            (partial / MCAPS).mkdir(exist_ok=True)
            mcap = partial / MCAPS / f"{safe_part(log.path.stem) or 'log'}.mcap"
            if mcap.exists():  # of another folder
                mcap = mcap.with_stem(f"{mcap.stem}_{source.sha256[:8]}")
            converted = convert_log(log, mcap, thresholds)
            flights.append(_read(mcap, converted))
            if converted.has_lost_data:
                text = f"{source.name} lost data; `groundstation check` tells what"
                damaged.append(Finding("warn", "session.lost_data", text, place=source.name))
        where = str(mcap.absolute()) if log.is_store else str(mcap.relative_to(partial))
        path = str(log.path.absolute())
        logs.append(LogOfSession(path, source.name, source.sha256, source.size_bytes, source.reader, where))
    return flights, tuple(logs), damaged


def _read(mcap: Path, converted: Converted | None) -> Flight:
    from groundstation.store.reader import read, read_info

    info = read_info(mcap) if converted is None else converted.info
    batches = (item for item in read(mcap) if isinstance(item, RecordBatch) and kind_of(item.topic) in KINDS)
    return flight_from_batches(batches, metadata=info.metadata, has_utc=info.has_utc, source_name=info.source_name)


def _results(
    job: SessionJob, assembled: AssembledSession, flights: Sequence[Flight], damaged: Sequence[Finding]
) -> FlightResults:
    known = SessionKnown(assembled.truth, job.configuration.settings.analyses)
    found = run_analyses(SESSION_ANALYSES, assembled.session, known)
    findings = [*damaged, *assembled.findings]
    for analysis in SESSION_ANALYSES:
        findings += found.findings.get(analysis.name, ())
    names = assembled.session.names
    start_utc_ns = assembled.start_ns if assembled.has_utc else None
    identity = flight_id(start_utc_ns, {"aircraft": "session", "flight": "-".join(names)}, job.sha256)
    title = f"session of {', '.join(names)}"
    size = sum(log.source.size_bytes for log in job.logs)
    told = sorted({flight.metadata.get("flight", "") for flight in flights} - {""})
    return FlightResults(
        flight_id=_free(job, identity),
        source=Source(title, job.sha256, size, f"groundstation cooperative, {len(job.logs)} logs"),
        metadata={"aircraft": ", ".join(names), "flight": ", ".join(told)},
        start_utc_ns=start_utc_ns,
        duration_s=assembled.duration_s,
        status="failed" if any(one.severity == "fail" for one in findings) else "degraded" if damaged else "ok",
        ledger=Ledger(),
        clock=Clock(),
        findings=tuple(findings),
        not_assessable=found.not_assessable,
        answers=found.answers,
        figures=(*session_figures(assembled), *(one for answer in found.answers.values() for one in answer.figures)),
    )


def _free(job: SessionJob, identity: str) -> str:
    """The id, with the digest where other logs gave a folder of that name."""
    target = job.out / identity
    if not (target / MANIFEST).is_file():
        return identity
    try:
        is_mine = load_manifest(target).source.sha256 == job.sha256
    except GroundstationError:
        is_mine = True
    return identity if is_mine else f"{identity}_{job.sha256[:8]}"


def _sentence(results: FlightResults) -> str:
    found = [text for analysis in SESSION_ANALYSES if (text := analysis.sentence(results.answers))]
    reasons = "; ".join(f"{entry.analysis}: {entry.reason}" for entry in results.not_assessable)
    return "; ".join(found) or f"not assessable: {reasons}"


def _manifest(job: SessionJob, results: FlightResults, logs: tuple[LogOfSession, ...], resume: Resume) -> Manifest:
    source = results.source
    return Manifest(
        groundstation=__version__,
        flight_id=results.flight_id,
        made_utc=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        source=SourceOfRun("", source.name, source.sha256, source.size_bytes, source.reader),
        configuration=job.configuration.to_dict() | {"stations": asdict(job.stations)},
        host=Host(platform.platform(), platform.machine(), sys.version.split()[0]),
        versions=versions(),
        logs=logs,
        resume=resume,
    )
