"""Flights that an OUT has already, by the log they came from; a folder is read when its log is asked for."""

from collections import Counter
from contextlib import suppress
from functools import cached_property
from pathlib import Path

from groundstation.base.errors import GroundstationError
from groundstation.pipeline.many_flights.fleet_store import names_in, remembered
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
        self._names: list[str] = []
        self._digests: list[str] = []
        if out is not None:
            keys = remembered(out)
            self._names, self._digests = list(keys), keys.column("sha256")
            for name in set(names_in(out)).difference(keys.names):
                with suppress(GroundstationError):  # it is not whole
                    self._digests.append(load_manifest(out / name).source.sha256)
                    self._names.append(name)
        self._one_of = dict(zip(self._digests, self._names, strict=True))

    def __len__(self) -> int:
        return len(self._one_of)

    def of(self, sha256: str) -> tuple[Finished, ...]:
        """The flights that a log gave, by its digest: one of each power-up in it; none unless all of them are whole."""
        if self._out is None or sha256 not in self._one_of:
            return ()
        several = self._several.get(sha256) or [self._one_of[sha256]]
        whole = [one for name in several if (one := finished(self._out / name)) is not None and one.sha256 == sha256]
        by_number = {one.power_up.number if one.power_up else 0: one for one in reversed(whole)}
        if not whole or whole[0].power_up is None:
            return tuple(whole[:1])
        wanted = range(1, whole[0].power_up.count + 1)
        return tuple(by_number[number] for number in wanted) if by_number.keys() >= set(wanted) else ()

    @cached_property
    def _several(self) -> dict[str, list[str]]:
        """Folders by the digest of their log where it gave more than one, the last name first."""
        if len(self._one_of) == len(self._names):
            return {}
        counts = Counter(self._digests)
        found: dict[str, list[str]] = {}
        for name, sha256 in sorted(zip(self._names, self._digests, strict=True), reverse=True):
            if counts[sha256] > 1:
                found.setdefault(sha256, []).append(name)
        return found
