"""Files in folders of logs that no reader claims.

They are told before any process is started, and remembered.

What is remembered stands in OUT. A file that is as it was then, by its size and by the times of its content and of its
last change, is not opened again.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from groundstation.base.version import __version__
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.readers import registry
from groundstation.readers.profile_sources import contents
from groundstation.results.files import write_bytes

MEMORY = ".strangers.json"  # in OUT
_BEHIND_NAME = ": "
Stamp = tuple[int, int, int]


class Strangers:
    """Files that are no logs.

    Parameters
    ----------
    out : Path, optional
        Where is remembered which they are; left out: nowhere.
    """

    def __init__(self, out: Path | None = None) -> None:
        self._place = None if out is None else out / MEMORY
        self._before = {} if self._place is None else _read(self._place)
        self._now: dict[str, tuple[Stamp, str]] = {}
        self._told: set[str] = set()

    def reason(self, path: Path) -> str | None:
        """Reason why a file is skipped, None where only its run can tell."""
        place = str(path.absolute())
        try:
            stamp, known = _stamp(path), self._before.get(place)
            if known is not None and known[0] == stamp:
                found: str | None = known[1]
            else:
                error = None if _is_ours(path) else registry.unclaimed(path)
                found = None if error is None else str(error).removeprefix(path.name)
        except OSError:
            return None
        if found is None:
            return None
        self._now[place] = stamp, found
        self._told.add(str(path))
        return f"{path.name}{found}" if found.startswith(_BEHIND_NAME) else found

    def keep(self, outcomes: Iterable[Outcome]) -> None:
        """Remember the files that were found, and those that a run told of.

        A folder that cannot be written keeps none.
        """
        for one in outcomes:
            if one.state != "skipped" or one.sha256 or one.is_session or one.source in self._told:
                continue
            path = Path(one.source)
            with suppress(OSError):
                self._now[str(path.absolute())] = _stamp(path), one.text.removeprefix(path.name)
        if self._place is None or self._now == self._before:
            return
        with suppress(OSError):
            if self._now:
                write_bytes(self._place, _encoded(self._now))
            else:
                self._place.unlink(missing_ok=True)


def _is_ours(path: Path) -> bool:
    from groundstation.store.recognition import is_groundstation_mcap

    return is_groundstation_mcap(path)


def _stamp(path: Path) -> Stamp:
    found = path.stat()
    return found.st_size, found.st_mtime_ns, found.st_ctime_ns


def _key() -> list[str]:
    """Key of the memory: another version, reader or profile may claim a file."""
    return [__version__, *(one.name for one in registry.formats()), *registry.plug_in_failures(), *contents()]


def _encoded(found: Mapping[str, tuple[Stamp, str]]) -> bytes:
    reasons = sorted({reason for _, reason in found.values()})
    place = {reason: number for number, reason in enumerate(reasons)}
    files = {name: [*stamp, place[reason]] for name, (stamp, reason) in sorted(found.items())}
    return json.dumps({"key": _key(), "reasons": reasons, "files": files}).encode()


def _read(path: Path) -> dict[str, tuple[Stamp, str]]:
    """Read what was remembered.

    Nothing where it cannot be read, or was by another version.
    """
    try:
        told = json.loads(path.read_bytes())
        if told["key"] != _key():
            return {}
        reasons: Sequence[str] = [str(one) for one in told["reasons"]]
        return {
            str(name): ((int(size), int(time), int(change)), reasons[number])
            for name, (size, time, change, number) in told["files"].items()
        }
    except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError):
        return {}
