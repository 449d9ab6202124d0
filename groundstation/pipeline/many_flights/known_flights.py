"""Flights that an OUT has already, by the log they came from; a folder is read when its log is asked for."""

from pathlib import Path

from groundstation.base.errors import GroundstationError
from groundstation.pipeline.many_flights.fleet_store import Scan
from groundstation.pipeline.one_flight.resume import Finished, finished
from groundstation.results.files import load_manifest


class KnownFlights:
    """Whole flights among those of an OUT.

    Parameters
    ----------
    found : Scan, optional
        Left out: there are none.
    """

    def __init__(self, found: Scan | None = None) -> None:
        self._folders: dict[str, list[Path]] = {}
        if found is None:
            return
        for name in found.names:
            folder = found.out / name
            known = found.fresh.get(name)
            try:
                sha256 = load_manifest(folder).source.sha256 if known is None else known.sha256
            except GroundstationError:  # it is not whole
                continue
            self._folders.setdefault(sha256, []).append(folder)

    def __len__(self) -> int:
        return len(self._folders)

    def of(self, sha256: str) -> Finished | None:
        """The flight that a log gave, by the digest of the log; None when there is none that is whole."""
        found = map(finished, reversed(self._folders.get(sha256, [])))
        return next((one for one in found if one is not None), None)
