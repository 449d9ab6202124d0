"""Job of a session, and what an earlier run left of it."""

import hashlib
import platform
from collections.abc import Collection, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.failures import is_incomplete
from groundstation.base.findings import Finding
from groundstation.base.toml_settings import settings_from
from groundstation.pipeline.many_flights.inputs import session_folders
from groundstation.pipeline.one_flight.configuration import Configuration, read_toml, session_tables
from groundstation.pipeline.one_flight.flight import report_files
from groundstation.pipeline.one_flight.log import Log
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.resume import TO_DO, Step, digest_of_parts, layouts_of, versions
from groundstation.pipeline.one_flight.sealing import spoiled_files
from groundstation.reports.flight_report import PDF, REPORT
from groundstation.results.files import load_document, load_manifest
from groundstation.results.manifest import Keys, Manifest, Resume
from groundstation.tables.session_settings import Stations


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
    redo : bool
        Whether it is run though a session with equal keys is finished.
    is_found : bool
        Whether a run found it among its flights; it then leaves what the verb ``cooperative`` made of these logs.
    notes : tuple of Finding
        What is known of it before its logs are read.
    only_results : bool
        Whether there is neither a recording nor a report.
    is_copy : bool
        Whether ``out`` is a copy of a folder elsewhere, which has most files by name alone.
    """

    logs: tuple[Log, ...]
    stations: Stations
    out: Path
    configuration: Configuration
    fail_on: str = "none"
    with_pdf: bool = False
    redo: bool = False
    is_found: bool = False
    notes: tuple[Finding, ...] = ()
    only_results: bool = False
    is_copy: bool = False

    @property
    def log(self) -> str:
        """Names of its logs as the user would type them."""
        return self.name

    @property
    def name(self) -> str:
        """Names of its logs."""
        return ", ".join(sorted(log.source.name for log in self.logs))

    @property
    def sha256(self) -> str:
        """Digest over those of the logs, whatever their order."""
        return hashlib.sha256("\n".join(sorted(log.source.sha256 for log in self.logs)).encode()).hexdigest()

    def keys(self) -> Keys:
        """Equal keys, equal results: logs, stations, settings and versions go in."""
        logs = [asdict(log.source) for log in self.logs]
        tables = dict(self.configuration.tables)
        thresholds = tables.get("thresholds", {})
        used = {name: tables.get(name, {}) for name in session_tables()}
        layouts = [layouts_of(log.source, self.configuration) for log in self.logs]
        conversion = digest_of_parts(logs, thresholds, layouts, dict(versions()), platform.python_version())
        layout = [] if (saved := self.configuration.layout_of("session")) is None else [saved.sha256]
        notes = [asdict(note) for note in self.notes]
        analysis = digest_of_parts(conversion, asdict(self.stations), used, notes, *layout)
        return Keys(conversion, analysis)


def load_stations(path: Path | None) -> Stations:
    """Ground stations from a TOML file; none without one.

    Raises
    ------
    SettingsError
        For a file that cannot be read, an unknown key or a value out of range, naming file and key.
    """
    return Stations() if path is None else settings_from(Stations, read_toml(path), str(path))


def sessions_of(out: Path) -> Iterator[tuple[Path, Manifest]]:
    """Whole sessions of a folder, each with its manifest."""
    for folder in session_folders(out):
        try:
            yield folder, load_manifest(folder)
        except GroundstationError:
            continue


class KeptSession(NamedTuple):
    """Session of the same logs and settings that an earlier run left.

    It has what of its report is to be made.
    """

    folder: Path
    resume: Resume
    step: Step
    with_pdf: bool = False


def kept_session(job: SessionJob) -> KeptSession | None:
    keys = job.keys()
    for folder, manifest in sessions_of(job.out):
        resume = manifest.resume
        if resume is None or manifest.source.sha256 != job.sha256:
            continue
        is_of_the_verb = job.is_found and not manifest.is_found
        spoiled = frozenset() if job.is_copy else spoiled_files(folder, manifest)
        is_whole = resume.keys.analysis == keys.analysis and not _is_incomplete(folder)
        is_whole &= spoiled <= {f"{folder.name}.rrd", *report_files()}
        if not job.only_results:
            is_whole &= _is_whole(folder / f"{folder.name}.rrd", spoiled)
        if not is_of_the_verb and (job.redo or not is_whole):
            continue
        if job.only_results:
            return KeptSession(folder, resume, "nothing")
        has_pdf = PDF in manifest.files and _is_whole(folder / PDF, spoiled)
        step: Step = "pdf" if job.with_pdf and not has_pdf else "nothing"
        if not _is_whole(folder / REPORT, spoiled):
            step = "reports"
        return KeptSession(folder, resume, step, job.with_pdf or has_pdf)  # one that is there stays
    return None


def _is_incomplete(folder: Path) -> bool:
    """Tell whether a part of a session failed: it is then run again."""
    try:
        return is_incomplete(load_document(folder).findings)
    except GroundstationError:
        return True


def _is_whole(file: Path, spoiled: Collection[str]) -> bool:
    return file.is_file() and file.name not in spoiled


def planned_session(job: SessionJob) -> Outcome:
    """Say what :func:`run_one` would do of a session; nothing is written."""
    kept = kept_session(job)
    if kept is None:
        return Outcome(job.name, "done", "session to run", is_session=True)
    is_finished = kept.step == "nothing"
    text = f"session {TO_DO[kept.step]}"
    return Outcome(job.name, "done", text, kept.folder.name, is_session=True, was_finished=is_finished)
