"""Resumption of a run: a flight's manifest keeps a key for each stage.

Equal keys give equal results, so that a run need not repeat the stage. A key is a digest of everything that goes into a
stage: the content of the log and of its profile, the settings that the stage reads, and the versions. The conversion
reads the thresholds, the analysis everything else that a user sets. The reports of finished results are asked for by
their files: report.pdf only where a PDF is asked for.
"""

import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.failures import is_incomplete
from groundstation.base.findings import Finding
from groundstation.base.installed import installed_version
from groundstation.base.runways.kept import usable_runways
from groundstation.base.version import __version__
from groundstation.pipeline.one_flight.apply import corrected_name
from groundstation.pipeline.one_flight.configuration import ISOLATION, Configuration
from groundstation.pipeline.one_flight.identity import plain_id
from groundstation.pipeline.one_flight.log import as_log, digest_of
from groundstation.pipeline.one_flight.sealing import spoiled_files
from groundstation.readers.profile_sources import known_as, path_of_profile
from groundstation.reports.flight_report import PDF, REPORT
from groundstation.results.document import SummaryDocument
from groundstation.results.file_names import ARRAYS, SUMMARY, TABLES
from groundstation.results.files import load_document, load_manifest
from groundstation.results.flight import Source
from groundstation.results.manifest import Keys as Keys
from groundstation.results.manifest import Manifest, PartOfRun, PowerUpOfRun
from groundstation.systems import systems
from groundstation.systems.applied import APPLIED

Step = Literal["everything", "analysis", "reports", "pdf", "nothing"]  # what has to be done for a log
TO_DO: Mapping[Step, str] = {
    "everything": "to run",
    "analysis": "to analyse again: a setting changed, a file is missing or a part failed; the MCAP stays",
    "reports": "to report again",
    "pdf": "finished, its PDF to add",
    "nothing": "finished, nothing to do",
}
_OF_RESULTS = (SUMMARY, f"{ARRAYS}/", f"{TABLES}/")
PACKAGES = (
    *("mcap", "numpy", "pandas", "numba", "scipy", "pyarrow", "rerun-sdk"),
    *("protobuf", "typst", "pygeomag", "ppigrf"),
)


@dataclass(frozen=True)
class Finished:
    """Flight folder that is whole.

    Parameters
    ----------
    folder : Path
    files : frozenset of str
        Names of what is in it.
    flight_id, sha256 : str
        ``sha256`` of the log that the flight came from.
    keys : Keys
    text : str
        What was found, in one line.
    has_lost_data : bool
    findings : tuple of Finding
    loss : str
        Loss in words, as the ledger has it.
    answered : frozenset of str
        Names of the analyses that gave an answer: there are files of some.
    has_applied : bool
        Whether records were added to the log by ``--apply``: there is an MCAP with them.
    spoiled : frozenset of str
        Paths in the folder of files that are missing or not as the run left them; ``files`` has none of them.
    mcap_sha256 : str
        Empty where an earlier version made the flight.
    power_up : PowerUpOfRun, optional
        Which of several in its log.
    parts : tuple of PartOfRun
        The consecutive logs that it came from.
    source : Source
        Of its log, or of all its parts.
    """

    folder: Path
    files: frozenset[str]
    flight_id: str
    sha256: str
    keys: Keys
    text: str
    has_lost_data: bool
    findings: tuple[Finding, ...]
    loss: str = ""
    answered: frozenset[str] = frozenset()
    has_applied: bool = False
    spoiled: frozenset[str] = frozenset()
    mcap_sha256: str = ""
    power_up: PowerUpOfRun | None = None
    parts: tuple[PartOfRun, ...] = ()
    source: Source = field(default_factory=lambda: Source("", "", 0, ""))

    @property
    def mcap(self) -> Path:
        """Path of its store file."""
        return self.folder / f"{self.flight_id}.mcap"

    def has(self, sha256: str) -> bool:
        """Tell whether a log with a digest is the flight's, or one of its parts."""
        return sha256 == self.sha256 or any(part.sha256 == sha256 for part in self.parts)

    @property
    def has_suffix(self) -> bool:
        """Tell whether the flight id ends with the digest of the log.

        It does where another flight had the same id.
        """
        return plain_id(self.flight_id, self.sha256) != self.flight_id

    def step(self, keys: Keys, *, with_pdf: bool, only_results: bool = False) -> Step:
        """Return the step that is still to be done for the results to be those of ``keys``.

        A file that somebody took away, or that is not as the run left it, is made again; "pdf" is report.pdf alone.
        One that is there stays, whether it is asked for or not: it tells of these results.

        With ``only_results`` neither recording nor reports are asked for; what there is of them stays. A part that
        failed is tried again.
        """
        if keys.conversion != self.keys.conversion or self.mcap.name not in self.files:
            return "everything"
        analysed = {corrected_name(self.flight_id)} if self.has_applied else set()
        if not only_results:
            analysed.add(f"{self.flight_id}.rrd")
        is_spoiled = self._has_spoiled_results or is_incomplete(self.findings)
        if keys.analysis != self.keys.analysis or not analysed <= self.files or is_spoiled:
            return "analysis"
        wanted = {one.name for one in systems().exports_of(self.answered, with_pages=not only_results)}
        if only_results:
            return "nothing" if wanted <= self.files else "reports"
        if not {REPORT, *wanted} <= self.files:
            return "reports"
        return "pdf" if with_pdf and PDF not in self.files else "nothing"

    @property
    def _has_spoiled_results(self) -> bool:
        return any(name.startswith(_OF_RESULTS) for name in self.spoiled)


@cache
def versions() -> Mapping[str, str]:
    """Return the versions of the packages that results depend on."""
    return MappingProxyType({"groundstation": __version__, **{name: _version(name) for name in PACKAGES}})


def _version(package: str) -> str:
    try:
        return installed_version(package)
    except ModuleNotFoundError:
        return ""


def keys_of(source: Source, configuration: Configuration, *, digests: Sequence[str] = ()) -> Keys:
    """Return keys of the run of a log: its name counts too, as it stands in the results.

    ``digests`` are those of the consecutive files of one recording.

    Raises
    ------
    GroundstationError
        When the profile cannot be read.
    """
    tables = dict(configuration.tables)
    thresholds = tables.pop("thresholds", {})
    tables.pop(ISOLATION, None)
    layouts = layouts_of(source, configuration)
    conversion = digest_of_parts(
        *(asdict(source), layouts, thresholds, dict(versions()), platform.python_version()),
        *([list(digests)] if len(digests) > 1 else []),
    )
    intervals = [[asdict(part) for part in listed] for listed in (configuration.exclude, configuration.force)]
    apply = None if configuration.apply is None else asdict(configuration.apply)
    lessons = [] if configuration.lessons is None else [[asdict(one) for one in configuration.lessons]]
    left_out = [list(configuration.without)] if configuration.without else []
    layout = [] if (saved := configuration.layout_of("flight")) is None else [saved.sha256]
    runways, problem = usable_runways()
    analysis = digest_of_parts(
        *(conversion, tables, intervals, apply, configuration.weather, *lessons, *left_out, *layout),
        *(runways.digest, bool(problem)),
    )
    return Keys(conversion, analysis)


def digest_of_parts(*parts: Any) -> str:
    """Return the SHA-256 of the parts of a key."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def layouts_of(source: Source, configuration: Configuration) -> list[str]:
    """Return the content of profile, ICDs and references; the name of a shipped ICD.

    The profile is the one that is given, or another's that was found for the log. Whether a reference is expected
    counts: without one of its time a log is then refused, else it is run.
    """
    given = configuration.profile_path
    used = path_of_profile(source.reader) if given is None else known_as(given)
    profile = [] if used is None else [_content_of(str(used), "a profile")]
    icds = [_content_of(one, "an ICD") if Path(one).is_file() else one for one in configuration.icds]
    references = [_content_of(str(path), "a reference") for path in configuration.references.paths]
    return [
        *profile,
        *icds,
        *references,
        *(["expected"] if references and configuration.references.is_expected else []),
    ]


def _content_of(file: str, expected: str) -> str:
    """Return the digest of a file, of a bag's files, and of files read with a reference."""
    try:
        return digest_of(as_log(Path(file)))
    except OSError as error:
        raise GroundstationError(file, error.strerror or "cannot be read", expected) from error


def finished(folder: Path, sizes: Mapping[str, int] | None = None) -> Finished | None:
    """Return the finished run that a flight folder holds.

    None when it is not whole, or was not made by such a run. ``sizes`` are those of its files by their path in it,
    where ``folder`` holds but its documents.
    """
    try:
        manifest, summary = load_manifest(folder), load_document(folder)
        files = _not_empty(folder) if sizes is None else {name for name, size in sizes.items() if size}
    except (OSError, GroundstationError):
        return None
    spoiled = spoiled_files(folder, manifest, None if sizes is None else sizes.get)
    unknown = {PDF} - manifest.files.keys() if manifest.files else set()  # a run was killed before it noted its size
    return _finished(folder, frozenset(files) - spoiled - unknown, manifest, summary, spoiled)


def _not_empty(folder: Path) -> set[str]:
    """Return the names of the folders and of the files with content in a folder.

    No file of a run is empty.
    """
    with os.scandir(folder) as entries:
        return {entry.name for entry in entries if entry.is_dir() or (entry.is_file() and entry.stat().st_size)}


def _finished(
    folder: Path, files: frozenset[str], manifest: Manifest, summary: SummaryDocument, spoiled: frozenset[str]
) -> Finished | None:
    resume, mcap = manifest.resume, manifest.files.get(f"{folder.name}.mcap")
    if resume is None:
        return None
    return Finished(
        folder,
        files,
        folder.name,
        manifest.source.sha256,
        resume.keys,
        resume.text,
        resume.has_lost_data,
        summary.findings,
        summary.ledger.loss,
        frozenset(name for name, found in summary.results.items() if found),
        any(finding.code.endswith(APPLIED) for finding in summary.findings),
        spoiled,
        "" if mcap is None else mcap.sha256,
        manifest.power_up,
        manifest.parts,
        Source(manifest.source.name, manifest.source.sha256, manifest.source.size_bytes, manifest.source.reader),
    )
