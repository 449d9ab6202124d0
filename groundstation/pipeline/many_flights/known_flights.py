"""Flights that an OUT has already, by the log they came from; a folder is read when its log is asked for."""

from pathlib import Path

from groundstation.base.errors import GroundstationError
from groundstation.pipeline.many_flights.fleet_store import folder_names, remembered
from groundstation.pipeline.one_flight.resume import Finished, finished
from groundstation.results.files import load_manifest


class KnownFlights:
    """Whole flights among those of an OUT.

    What is remembered of the folders is believed here: a flight that is asked for is looked at.

    Parameters
    ----------
    out : Path, optional
        Left out: there are none.
    """

    def __init__(self, out: Path | None = None) -> None:
        self._out = out
        self._folders: dict[str, list[str]] = {}
        if out is None:
            return
        keys = remembered(out)
        digests = keys.column("sha256")
        for name in folder_names(out):
            place = keys.place(name)
            try:
                sha256 = digests[place] if place is not None else load_manifest(out / name).source.sha256
            except GroundstationError:  # it is not whole
                continue
            self._folders.setdefault(sha256, []).append(name)

    def __len__(self) -> int:
        return len(self._folders)

    def of(self, sha256: str) -> Finished | None:
        """The flight that a log gave, by the digest of the log; None when there is none that is whole."""
        if self._out is None:
            return None
        found = (finished(self._out / name) for name in reversed(self._folders.get(sha256, [])))
        return next((one for one in found if one is not None and one.sha256 == sha256), None)
