"""Flights that an OUT has already, by the log they came from.

A folder is read when its log is asked for.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.base.errors import GroundstationError
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.fleet.scan import names_in, remembered
from groundstation.pipeline.one_flight.parts import LONGEST_GAP_S, family
from groundstation.pipeline.one_flight.resume import Finished, finished
from groundstation.results.files import load_manifest
from groundstation.results.manifest import Manifest, PartOfRun


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
        self._manifests: dict[str, Manifest] = {}  # of those that are not remembered
        later: list[list[str]] = []  # digests of the parts behind the first
        if out is not None:
            self._keys = keys = remembered(out)
            self._names, self._digests = list(keys), keys.column("sha256")
            later = [text.split("\n") if text else [] for text in keys.column("parts")]
            for name in set(names_in(out)).difference(keys.names):
                with suppress(GroundstationError):  # it is not whole
                    self._manifests[name] = manifest = load_manifest(out / name)
                    self._digests.append(manifest.source.sha256)
                    self._names.append(name)
                    later.append([part.sha256 for part in manifest.parts[1:]])
        self._of_several = [name for name, parts in zip(self._names, later, strict=True) if parts]
        self._one_of = {sha256: name for name, parts in zip(self._names, later, strict=True) for sha256 in parts}
        self._one_of |= dict(zip(self._digests, self._names, strict=True))

    def __len__(self) -> int:
        return len(self._one_of)

    def of(self, sha256: str) -> tuple[Finished, ...]:
        """Flights that a log gave, by its digest: one of each power-up in it.

        None unless all of them are whole.

        Of a log that is part of a flight, the flight.
        """
        if self._out is None or sha256 not in self._one_of:
            return ()
        several = self._several.get(sha256) or [self._one_of[sha256]]
        whole = [one for name in several if (one := finished(self._out / name)) is not None and one.has(sha256)]
        by_number = {one.power_up.number if one.power_up else 0: one for one in reversed(whole)}
        if not whole or whole[0].power_up is None:
            return tuple(whole[:1])
        wanted = range(1, whole[0].power_up.count + 1)
        return tuple(by_number[number] for number in wanted) if by_number.keys() >= set(wanted) else ()

    @cached_property
    def paths_of_parts(self) -> frozenset[str]:
        """Paths of the logs behind the first one, of flights that came from several."""
        several = self.manifests_of(self._of_several)
        return frozenset(part.path for manifest in several for part in manifest.parts[1:])

    def about(self, part: PartOfRun) -> list[str]:
        """Flights that another one may go on from, or that may go on from it.

        Their times tell, or names of files.
        """
        is_sure = part.utc_ns is not None and part.aircraft
        return sorted({*self._near(part), *([] if is_sure else self.beside(Path(part.path)))})

    def beside(self, path: Path) -> list[str]:
        """Flights of files beside another one whose names differ from its in a number alone."""
        return self._by_family.get((path.parent, family(path.name)), [])

    def manifests_of(self, names: Iterable[str]) -> Iterator[Manifest]:
        """Manifests of some flights, without those that are gone or not whole."""
        for name in names:
            with suppress(GroundstationError):
                yield self._manifests.get(name) or load_manifest((self._out or Path()) / name)

    def _near(self, part: PartOfRun) -> list[str]:
        """Flights that overlap with a log, or nearly."""
        if part.utc_ns is None or self._out is None:
            return []
        gap_ns = round(LONGEST_GAP_S * NS_PER_S)
        start_ns, end_ns = self._spans
        rows = np.flatnonzero((start_ns <= part.utc_ns[1] + gap_ns) & (end_ns >= part.utc_ns[0] - gap_ns))
        return [self._names[row] for row in rows.tolist()]

    @cached_property
    def _by_family(self) -> dict[tuple[Path, str], list[str]]:
        """Flights by the folder of their log and the family of its name, sorted by name."""
        if self._out is None:
            return {}
        paths = (*self._keys.column("path"), *(one.source.path for one in self._manifests.values()))
        found: dict[tuple[Path, str], list[str]] = {}
        for name, path in sorted(zip(self._names, map(Path, paths), strict=True)):
            found.setdefault((path.parent, family(path.name)), []).append(name)
        return found

    @cached_property
    def _spans(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """First and last time of the flights; of one without UTC, none that anything is near to."""
        never = np.iinfo(np.int64)
        spans = list(zip(*(self._keys.column(name) for name in ("start_ns", "end_ns")), strict=True))
        for manifest in self._manifests.values():
            known = [part.utc_ns for part in manifest.parts if part.utc_ns is not None]
            spans.append((known[0][0], known[-1][1]) if known else (None, None))
        starts = [never.max if start is None else start for start, _end in spans]
        ends = [never.min if end is None else end for _start, end in spans]
        return np.array(starts, dtype=np.int64), np.array(ends, dtype=np.int64)

    @cached_property
    def _several(self) -> dict[str, list[str]]:
        """Folders by the digest of their log where it gave more than one, the last name first."""
        if len(set(self._digests)) == len(self._names):
            return {}
        counts = Counter(self._digests)
        found: dict[str, list[str]] = {}
        for name, sha256 in sorted(zip(self._names, self._digests, strict=True), reverse=True):
            if counts[sha256] > 1:
                found.setdefault(sha256, []).append(name)
        return found
