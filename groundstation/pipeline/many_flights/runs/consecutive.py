"""Consecutive logs among those of a run and the flights of its OUT.

They are found by where each begins and ends.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, pairwise
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.runs.known_flights import KnownFlights
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.log import Log, open_log
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.parts import LATE_S, LONGEST_GAP_S, behind_it, family, gap_ns, goes_on, order_of
from groundstation.results.manifest import PartOfRun

_NOT_JOINED = "groundstation-mcap"  # how readers of MCAPs that we wrote begin: a recorder's files are joined


@dataclass(frozen=True)
class ConsecutiveLogs:
    """Consecutive logs as far as they are known to be of one flight.

    Parameters
    ----------
    parts : tuple of PartOfRun
    numbers : tuple of int
        Of the logs of this run among them.
    """

    parts: tuple[PartOfRun, ...]
    numbers: tuple[int, ...] = ()

    @property
    def first(self) -> PartOfRun:
        """The log with which it begins."""
        return self.parts[0]

    @property
    def last(self) -> PartOfRun:
        """The log with which it ends."""
        return self.parts[-1]

    def with_next(self, other: "ConsecutiveLogs") -> "ConsecutiveLogs":
        """Both, one behind the other."""
        return ConsecutiveLogs((*self.parts, *other.parts), (*self.numbers, *other.numbers))


def flights_of_parts(
    outcomes: Mapping[int, Outcome], known: KnownFlights, configuration: Configuration
) -> list[ConsecutiveLogs]:
    """Flights that consist of several logs, and are not so in OUT yet.

    This run has at least one log of each.

    Parameters
    ----------
    outcomes : mapping of int to Outcome
        By the numbers of the logs; those without a flight may be parts that cannot be read alone.
    known : KnownFlights
        What OUT had before the run.
    configuration : Configuration
        How logs are read.
    """
    own = [
        ConsecutiveLogs(one.parts, (number,))
        for number, one in outcomes.items()
        if one.flight_id and _may_join(one.parts)
    ]
    strangers = {Path(one.source).absolute(): number for number, one in outcomes.items() if not one.flight_id}
    stretches = [*own, *_others(own, strangers, known)]
    folders = _Folders()
    grown = [_with_strangers(one, strangers, folders, configuration) for one in stretches]
    known_ones = {_digests(one) for one in stretches}
    return [one for one in _chained(grown, folders) if one.numbers and _digests(one) not in known_ones]


def _digests(stretch: ConsecutiveLogs) -> tuple[str, ...]:
    return tuple(part.sha256 for part in stretch.parts)


class _Folders:
    """Files of folders by the families of their names, each folder looked at once."""

    def __init__(self) -> None:
        self._known: dict[Path, dict[str, str]] = {}

    def next_file(self, path: Path) -> Path | None:
        """The file behind one of those in its folder whose names differ in a number alone."""
        if path.parent not in self._known:
            self._known[path.parent] = _followers(path.parent)
        name = self._known[path.parent].get(path.name)
        return None if name is None else path.parent / name


def _followers(folder: Path) -> dict[str, str]:
    """File behind each file of a folder, among those of its family."""
    families: dict[str, list[str]] = {}
    try:
        for one in folder.iterdir():
            families.setdefault(family(one.name), []).append(one.name)
    except OSError:
        return {}
    return {name: after for names in families.values() for name, after in pairwise(sorted(names, key=order_of))}


def _may_join(parts: Sequence[PartOfRun]) -> bool:
    return bool(parts) and not parts[0].reader.startswith(_NOT_JOINED)


def _others(
    own: Sequence[ConsecutiveLogs], strangers: Iterable[Path], known: KnownFlights
) -> Iterator[ConsecutiveLogs]:
    """Flights of OUT that are near those of the run.

    What the run has anew of their parts is left out of them.
    """
    of_logs = (found for one in own for part in one.parts for found in known.about(part))
    of_files = (found for path in strangers for found in known.beside(path))
    mine = {part.sha256 for one in own for part in one.parts}
    paths = {part.path for one in own for part in one.parts}
    for manifest in known.manifests_of(dict.fromkeys(chain(of_logs, of_files))):
        if not _may_join(manifest.parts):
            continue
        left = [part for part in manifest.parts if part.sha256 not in mine and part.path not in paths]
        if len(left) == len(manifest.parts):
            yield ConsecutiveLogs(manifest.parts)
        else:
            yield from (ConsecutiveLogs((part,)) for part in left)


def _with_strangers(
    stretch: ConsecutiveLogs, strangers: Mapping[Path, int], folders: _Folders, configuration: Configuration
) -> ConsecutiveLogs:
    """Stretch with the files behind it that cannot be read alone.

    By name they follow, by content they go on.
    """
    first: Log | None = None
    while strangers and (path := folders.next_file(Path(stretch.last.path))) in strangers:
        assert path is not None
        try:
            first = first or open_log(Path(stretch.first.path), configuration.profile_path, configuration.icds)
        except (GroundstationError, OSError):
            break
        part = behind_it(first, stretch.last, path)
        if part is None or not goes_on(stretch.last, part, is_beside=True):
            break
        stretch = ConsecutiveLogs((*stretch.parts, part), (*stretch.numbers, strangers[path]))
    return stretch


def _chained(stretches: Sequence[ConsecutiveLogs], folders: _Folders) -> list[ConsecutiveLogs]:
    """Stretches put behind one another where exactly one goes on from another."""
    behind: dict[int, list[int]] = {}
    before: dict[int, list[int]] = {}
    for one, other in _pairs(stretches, folders):
        behind.setdefault(one, []).append(other)
        before.setdefault(other, []).append(one)
    links: dict[int, int] = {}
    for one, others in behind.items():
        chosen = _only(stretches, one, _nearest(stretches, others, is_behind=True))
        if chosen is None:
            continue
        if _only(stretches, chosen, _nearest(stretches, before[chosen], is_behind=False)) == one:
            links[one] = chosen
    starts = [number for number in range(len(stretches)) if number not in links.values()]
    chains = []
    for number in starts:
        whole = stretches[number]
        while (number := links.get(number, -1)) >= 0:
            whole = whole.with_next(stretches[number])
        chains.append(whole)
    return chains


def _nearest(stretches: Sequence[ConsecutiveLogs], others: Sequence[int], *, is_behind: bool) -> list[int]:
    """Stretches next behind (or before) another one, out of several.

    They are not behind (or before) one of themselves.
    """

    def comes_first(one: int, other: int) -> bool:
        first, second = (stretches[one], stretches[other]) if is_behind else (stretches[other], stretches[one])
        is_earlier = _first_ns(first) < _first_ns(second)
        return is_earlier and gap_ns(first.last, second.first) >= -round(LATE_S * NS_PER_S)

    return [other for other in others if not any(comes_first(one, other) for one in others if one != other)]


def _first_ns(stretch: ConsecutiveLogs) -> int:
    return stretch.first.utc_ns[0] if stretch.first.utc_ns else stretch.first.device_ns[0]


def _only(stretches: Sequence[ConsecutiveLogs], one: int, others: Sequence[int]) -> int | None:
    """Stretch that goes with another one, out of several.

    Where there are more, it is that of the same family of names.
    """
    if len(others) == 1:
        return others[0]
    like = family(stretches[one].last.name)
    akin = [other for other in others if family(stretches[other].first.name) == like]
    return akin[0] if len(akin) == 1 else None


def _pairs(stretches: Sequence[ConsecutiveLogs], folders: _Folders) -> Iterator[tuple[int, int]]:
    """Numbers of stretches of which the second goes on from the first."""
    by_start = sorted((start, number) for number, one in enumerate(stretches) for start in _moments(one.first, 0))
    for number, one in enumerate(stretches):
        found: set[int] = set()
        for kind, end_ns in _moments(one.last, 1):
            low = bisect_left(by_start, ((kind, end_ns - round(LATE_S * NS_PER_S)), -1))
            high = bisect_right(by_start, ((kind, end_ns + round(LONGEST_GAP_S * NS_PER_S)), len(stretches)))
            found.update(other for _start, other in by_start[low:high] if other != number)
        for other in sorted(found):
            first = stretches[other].first
            is_beside = folders.next_file(Path(one.last.path)) == Path(first.path)
            if goes_on(one.last, first, is_beside=is_beside):
                yield number, other


def _moments(part: PartOfRun, at: int) -> list[tuple[str, int]]:
    """Times at which a log begins (0) or ends (1), by each clock that tells it."""
    return [("device", part.device_ns[at]), *([("utc", part.utc_ns[at])] if part.utc_ns else [])]
