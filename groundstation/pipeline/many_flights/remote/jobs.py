"""Runs of logs that lie elsewhere, or whose results do.

A log is fetched, run and its flight folder sent to a staging place by the process that runs it; the process that leads
the run moves it into place. A rename is not atomic in a bucket: the manifest, which marks a whole folder, goes last.
"""

import tempfile
import uuid
from dataclasses import replace
from pathlib import Path, PurePosixPath

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.pipeline.many_flights.inputs import is_remote
from groundstation.pipeline.many_flights.remote.folder import RemoteFolder
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.one_flight.log import digest_of
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.resume import Finished, finished
from groundstation.reports.flight_report import PDF
from groundstation.results.file_names import ARRAYS, MANIFEST, OLD_ARRAYS, SUMMARY
from groundstation.systems import systems

STAGING, BY_LOG = ".staging", ".logs"  # in an OUT elsewhere: what is on its way; flight ids by digest of the log


@dataclass(frozen=True)
class RemoteJob:
    """A job whose log or results lie elsewhere.

    ``log`` and ``out`` are URLs or paths; with ``redo`` nothing counts as finished; ``size`` is that of the log, bytes.
    """

    job: Job
    log: str
    out: str
    redo: bool = False
    size: int = 0

    @property
    def name(self) -> str:
        """Name of its log."""
        return PurePosixPath(self.log).name


def run_remote(remote: RemoteJob, listen: Listener = silent) -> Outcome:
    """Fetch a log, run it and send its flight folder to staging.

    Returns
    -------
    Outcome
        With ``folder`` the name of the staging folder in OUT, or that of the flight where nothing was to do.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="groundstation-") as scratch:
            outcome = _run_in(Path(scratch), remote, listen)
    except GroundstationError as error:
        outcome = Outcome(remote.log, "failed", str(error))
    except OSError as error:
        outcome = Outcome(remote.log, "failed", f"{remote.name}: {error.strerror or error}")
    return outcome


def digest_remote(remote: RemoteJob, listen: Listener = silent) -> Outcome:
    """Fetch a log for its digest alone, which the outcome holds.

    The run of a log without one tells what is wrong with it.
    """
    listen(Event("stage", remote.name, "comparing its content"))
    try:
        with tempfile.TemporaryDirectory(prefix="groundstation-") as scratch:
            return Outcome(remote.log, "done", "", sha256=digest_of(_here(Path(scratch), remote)))
    except (GroundstationError, OSError) as error:
        return Outcome(remote.log, "failed", str(error))


def _here(scratch: Path, remote: RemoteJob) -> Path:
    """The path of a log on this machine, fetched if need be."""
    if not is_remote(remote.log):
        return Path(remote.log)
    parent, _, _name = remote.log.rpartition("/")
    path = scratch / "log" / remote.name
    RemoteFolder(parent).fetch(remote.name, path)
    return path


def _run_in(scratch: Path, remote: RemoteJob, listen: Listener) -> Outcome:
    out = RemoteFolder(remote.out)
    job = replace(
        remote.job, path=_here(scratch, remote), out=scratch / "out", url=remote.log if is_remote(remote.log) else ""
    )
    jobs = (job,) if remote.redo else _planned(job, out, scratch / "finished")
    outcomes: list[Outcome] = []
    for one in jobs:
        first = run_flight(one, listen)
        outcomes += [_sent(one, outcome, out) for outcome in (replace(first, more=()), *first.more)]
    return replace(outcomes[0], more=tuple(outcomes[1:]))


def _sent(job: Job, outcome: Outcome, out: RemoteFolder) -> Outcome:
    """Outcome of a flight, its folder sent to staging.

    What was made again of a finished one is sent to its place.
    """
    if not outcome.flight_id:
        return outcome
    if job.step == "nothing":
        return replace(outcome, folder=outcome.flight_id)
    if job.step == "reports" and job.finished is not None:
        out.send(job.finished.folder, outcome.flight_id)
        for name in (PDF, *(one.name for one in systems().exports)):
            if not (job.finished.folder / name).exists():
                out.remove(f"{outcome.flight_id}/{name}")
        return replace(outcome, folder=outcome.flight_id)
    staged = f"{STAGING}/{outcome.sha256}-{uuid.uuid4().hex[:8]}"
    out.send(Path(outcome.folder), staged)
    return replace(outcome, folder=staged)


def _planned(job: Job, out: RemoteFolder, scratch: Path) -> tuple[Job, ...]:
    """Job with what has to be done of it, one for each power-up.

    What it needs of finished flights is fetched.
    """
    asked = job.asked()
    if asked is None:
        return (job,)
    sha256, keys = asked
    planned: list[Job] = []
    for flight_id in flights_of(out, sha256).values():
        found = _fetched(out, flight_id, scratch)
        if found is None or found.sha256 != sha256:
            return (job,)
        one = job.going_on(found, keys)
        if one.step == "pdf":  # the page is not here: both are made, it as it was
            one = replace(one, step="reports")
        if one.step == "analysis":
            out.fetch(f"{flight_id}/{found.mcap.name}", found.mcap)
        elif one.step == "reports":
            for name in array_files(out, flight_id):
                out.fetch(f"{flight_id}/{name}", found.folder / name)
        planned.append(one)
    counts = {one.finished.power_up.count for one in planned if one.finished and one.finished.power_up}
    if not planned or counts - {len(planned)} or (counts and any(one.step == "everything" for one in planned)):
        return (job,)  # the log tells what it holds
    return tuple(planned)


def flights_of(out: RemoteFolder, sha256: str) -> dict[int, str]:
    """Ids of the flights that a log gave, by the number of the power-up in it.

    The number is 0 where the log holds one.
    """
    lines = (out.read(f"{BY_LOG}/{sha256}") or b"").decode().split("\n")
    pairs = (line.rpartition(" ")[::2] for line in lines if line)
    return dict(sorted((int(number or 0), flight_id) for number, flight_id in pairs))


def remember_flight(out: RemoteFolder, outcome: Outcome) -> None:
    """Take down which flight a log, or a power-up in it, gave."""
    known = flights_of(out, outcome.sha256) if outcome.power_up else {}
    known = {number: one for number, one in known.items() if number} | {outcome.power_up: outcome.flight_id}
    lines = (f"{number} {one}" if number else one for number, one in sorted(known.items()))
    out.write(f"{BY_LOG}/{outcome.sha256}", "\n".join(lines).encode())


def array_files(out: RemoteFolder, flight_id: str) -> list[str]:
    """Files of a flight that hold the arrays behind its figures."""
    folders = ARRAYS, OLD_ARRAYS
    return [f"{folder}/{name}" for folder in folders for name in out.names(f"{flight_id}/{folder}")]


def _fetched(out: RemoteFolder, flight_id: str, scratch: Path) -> Finished | None:
    """Finished flight elsewhere, its two documents fetched; None when it is not whole."""
    folder, sizes = scratch / flight_id, out.sizes(flight_id)
    if not {MANIFEST, SUMMARY} <= sizes.keys():
        return None
    for name in (SUMMARY, MANIFEST):
        out.fetch(f"{flight_id}/{name}", folder / name)
    return finished(folder, sizes)
