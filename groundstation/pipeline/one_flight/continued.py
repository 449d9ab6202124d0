"""Logs that the user states to be of one flight: parts of one recording are read as one."""

from collections.abc import Sequence
from pathlib import Path

from groundstation.base.units import NS_PER_S
from groundstation.pipeline.one_flight.convert import Converted
from groundstation.pipeline.one_flight.log import Log, open_parts
from groundstation.pipeline.one_flight.parts import LATE_S, behind_it, family, gap_ns, order_of, part_of
from groundstation.results.manifest import PartOfRun
from groundstation.tables.table import Flight


def with_strangers(logs: Sequence[Log], strangers: Sequence[Path]) -> tuple[list[Log], set[Path]]:
    """Put files that cannot be read alone after their logs; also return the files taken.

    A file is taken whose name differs from that of a log in a number alone, and which can be read behind it.
    """
    taken: set[Path] = set()
    found = []
    for log in logs:
        like, before = family(log.path.name), PartOfRun(str(log.path), log.source.name, reader=log.source.reader)
        akin = [path for path in strangers if path not in taken and family(path.name) == like]
        behind = [path for path in akin if behind_it(log, before, path) is not None]
        taken.update(behind)
        found.append(_joined([log, *behind]) if behind else log)
    return found, taken


def in_recordings(logs: Sequence[tuple[Log, Converted, Flight]]) -> list[Log]:
    """Join logs of one recording, each group at the place of its first log.

    Two are of one recording where format and aircraft are equal, and one goes on from the other, by UTC or by the
    device's counter.
    """
    known = [
        (log, part_of(log, str(log.path.absolute()), converted.info.reader, flight)) for log, converted, flight in logs
    ]
    groups: list[list[tuple[Log, PartOfRun]]] = []
    for one in sorted(known, key=lambda pair: pair[1].utc_ns or pair[1].device_ns):
        group = next((group for group in groups if _is_behind(group[-1][1], one[1])), None)
        groups.append([one]) if group is None else group.append(one)
    order = {id(log): number for number, (log, _converted, _flight) in enumerate(logs)}
    groups.sort(key=lambda group: min(order[id(log)] for log, _part in group))
    return [_joined([log for log, _part in group]) if len(group) > 1 else group[0][0] for group in groups]


def _is_behind(before: PartOfRun, behind: PartOfRun) -> bool:
    """Tell whether a log of the same format and aircraft begins where another one has ended."""
    has_utc = before.utc_ns is not None, behind.utc_ns is not None
    is_same = before.reader == behind.reader and before.aircraft == behind.aircraft and has_utc[0] == has_utc[1]
    return is_same and gap_ns(before, behind) >= -LATE_S * NS_PER_S


def _joined(logs: Sequence[Log | Path]) -> Log:
    """Return consecutive logs and files as one log."""
    first = logs[0]
    assert isinstance(first, Log), "a recording begins with a log that can be read"
    paths: list[Path] = []
    for one in logs:
        paths += (one.parts or (one.path,)) if isinstance(one, Log) else (one,)
    ordered = [paths[0], *sorted(paths[1:], key=lambda path: order_of(path.name))] if _are_files(logs) else paths
    return open_parts(ordered, first.profile, first.icds)


def _are_files(logs: Sequence[Log | Path]) -> bool:
    return any(isinstance(one, Path) for one in logs)
