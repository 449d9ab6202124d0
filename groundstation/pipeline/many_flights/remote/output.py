"""OUT in a bucket or on a server, with a small copy of it here."""

import shutil
import uuid
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from groundstation.base.errors import UsageError
from groundstation.pipeline.many_flights.inputs import FLIGHT_FOLDER_MARK, OUT_FOLDER_MARK, SESSION_ARRAYS
from groundstation.pipeline.many_flights.remote.folder import RemoteFolder
from groundstation.pipeline.many_flights.remote.jobs import BY_LOG, STAGING, array_files, remember_flight
from groundstation.pipeline.many_flights.remote.lease import LOCKS, Lease, alone_elsewhere
from groundstation.pipeline.one_flight.flight import is_made
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.reports.fleet_report import PAGE as FLEET_PAGE
from groundstation.reports.fleet_report import PDF as FLEET_PDF
from groundstation.reports.flight_report import PDF, REPORT
from groundstation.results.file_names import ARRAYS, MANIFEST, OLD_ARRAYS, SUMMARY, TABLES

FLEET_ARRAYS = (
    "heading_samples.parquet",
    "reference_checks.parquet",
)  # of a flight's arrays, what the fleet is made from


class RemoteOutput:
    """OUT elsewhere.

    Its copy here holds documents and what the fleet is made from, and other files by name alone.

    Parameters
    ----------
    url : str
    root : Path
        Folder for the copy.
    """

    def __init__(self, url: str, root: Path) -> None:
        self.root = root
        self._out = RemoteFolder(url)
        self._lease: Lease | None = None

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other runs out while this one writes.

        From when another one took over, nothing is written any more.
        """
        with alone_elsewhere(self._out) as self._lease:
            yield

    def _require_alone(self) -> None:
        if self._lease is not None:
            self._lease.require()

    def refuse_foreign(self, *, force: bool) -> None:
        """Raise UsageError when something else is in the folder."""
        names = [name for name in self._out.names() if name != LOCKS]
        if FLIGHT_FOLDER_MARK in names:
            raise UsageError(self._out.url, "a flight folder", "a folder that holds flight folders", "name another -o")
        if names and OUT_FOLDER_MARK not in names and BY_LOG not in names and not force:
            raise UsageError(
                self._out.url, "a folder that groundstation did not make", "a new folder or one it made", "-f uses it"
            )

    def copy_all(self) -> None:
        """Make the copy of what is there already."""
        for name in (OUT_FOLDER_MARK, FLEET_PAGE, FLEET_PDF):
            if (content := self._out.read(name)) is not None:
                (self.root / name).write_bytes(content)
        for name in self._out.names():
            if not name.startswith(".") and "." not in name:
                self._copy(name)

    def _copy(self, flight_id: str) -> None:
        folder = self.root / flight_id
        shutil.rmtree(folder, ignore_errors=True)
        names = self._out.names(flight_id)
        if not {MANIFEST, SUMMARY} <= set(names):
            return
        folder.mkdir()
        (folder / ARRAYS).mkdir()
        for name in names:
            if "." in name and name != OLD_ARRAYS:
                (folder / name).touch()
        there = array_files(self._out, flight_id)
        files = [name.rpartition("/")[2] for name in there]
        kept = there if SESSION_ARRAYS in files else [name for name in there if name.endswith(FLEET_ARRAYS)]
        for name in (SUMMARY, MANIFEST, *kept):
            self._out.fetch(f"{flight_id}/{name}", folder / name)

    def has_in_place(self, outcome: Outcome) -> bool:
        """Tell whether the flight stands in its place."""
        return outcome.folder == outcome.flight_id

    def place(self, outcome: Outcome) -> str:
        """Move a finished flight to its place, which is told."""
        self._require_alone()
        self._out.replace(outcome.folder, outcome.flight_id, partial(is_made, identity=outcome.flight_id))
        remember_flight(self._out, outcome)
        self._copy(outcome.flight_id)
        return outcome.flight_id

    def mcap_in(self, folder: Path) -> Path:
        """The MCAP of a flight of the copy, fetched when it is first asked for."""
        mcap = folder / f"{folder.name}.mcap"
        if not mcap.is_file() or not mcap.stat().st_size:
            self._out.fetch(f"{folder.name}/{mcap.name}", mcap)
        return mcap

    def send_session(self, session_id: str) -> None:
        """Send the files made of a session of the copy.

        Files that stand there by name alone are there already.
        """
        self._require_alone()
        folder = self.root / session_id
        if (folder / TABLES).is_dir():  # made just now: of what is there already the copy has no tables
            staged = f"{STAGING}/{session_id}-{uuid.uuid4().hex[:8]}"
            self._out.send(folder, staged)
            self._out.replace(staged, session_id, partial(is_made, identity=session_id))
            return
        for name in (REPORT, PDF, SUMMARY, MANIFEST):
            if (folder / name).is_file() and (content := (folder / name).read_bytes()):
                self._out.write(f"{session_id}/{name}", content)
        if not (folder / PDF).exists():  # it could not be made again
            self._out.remove(f"{session_id}/{PDF}")

    def discard(self, folder: str) -> None:
        """Throw a flight folder away; what somebody else put into one that is in place stays."""
        if folder.startswith("."):
            self._out.remove(folder)
        else:
            self._require_alone()
            self._out.remove_where(folder, partial(is_made, identity=folder))
            shutil.rmtree(self.root / folder, ignore_errors=True)

    def publish(self, names: Sequence[str], *, is_whole: bool) -> None:
        """Send files and folders of the copy that stand beside the flight folders.

        What is left of staging is cleared.

        What a run that came to its end did not make is removed there too.
        """
        self._require_alone()
        for name in names:
            path = self.root / name
            if path.is_dir():
                self._out.send(path, name)
                there = {one.relative_to(path).as_posix() for one in path.rglob("*")}
                self._out.remove_where(name, partial(_is_missing, there))
            elif path.is_file():
                self._out.write(name, path.read_bytes())
            elif is_whole:
                self._out.remove(name)
        self._out.remove(STAGING)


def _is_missing(there: Collection[str], name: str) -> bool:
    return name not in there
