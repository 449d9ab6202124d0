"""Destination of finished flights.

They are put there one after the other, so that a run that is killed keeps what it had finished.
"""

import json
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, Protocol

from groundstation.base.errors import GroundstationError
from groundstation.pipeline.many_flights.fleet.keys import FlightKeys
from groundstation.pipeline.many_flights.fleet.scan import Scan
from groundstation.pipeline.many_flights.inputs import is_remote
from groundstation.pipeline.one_flight.flight import place, remove
from groundstation.pipeline.one_flight.identity import plain_id
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.file_names import MANIFEST
from groundstation.results.files import utf8_text


class Output(Protocol):
    """Takes finished flights in.

    Attributes
    ----------
    root : Path
        A folder on this machine with what index and fleet are made from: the flight folders, or what of them it takes.
    """

    root: Path

    def has_in_place(self, outcome: Outcome) -> bool:
        """Tell whether the flight stands in its place."""

    def place(self, outcome: Outcome) -> str:
        """Move a finished flight to its place, which is told."""

    def discard(self, folder: str) -> None:
        """Throw a flight folder away; what somebody else put into one that is in place stays."""


class LocalOutput:
    """A folder on this machine."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def has_in_place(self, outcome: Outcome) -> bool:
        """Tell whether the flight stands in its place."""
        return Path(outcome.folder) == self.root / outcome.flight_id

    def place(self, outcome: Outcome) -> str:
        """Move a finished flight to its place, which is told."""
        target = self.root / outcome.flight_id
        place(Path(outcome.folder), target)
        return str(target)

    def discard(self, folder: str) -> None:
        """Throw a flight folder away; what somebody else put into one that is in place stays."""
        if Path(folder).name.startswith("."):
            shutil.rmtree(folder, ignore_errors=True)
        else:
            remove(self.root / Path(folder).name)


class _Origin(NamedTuple):
    """Origin of a flight folder: path of the log, digest of its content, power-up in it."""

    path: str
    sha256: str
    power_up: int = 0


class _Content(NamedTuple):
    """Content of a flight: the digest of its log, and which power-up in it."""

    sha256: str
    power_up: int

    @classmethod
    def of(cls, one: "Outcome | _Origin") -> "_Content":
        return cls(one.sha256, one.power_up)


class Destination:
    """Puts finished flights into place at once.

    Two flights of one id get the digests of their logs into their names; as that is known only when the second one
    is finished, they are run again at the end. Of logs with the same content the first in the list is kept, whichever
    was finished first. At the end flights of these logs under ids that they have no longer, from other settings or
    another version, are removed, and so is what an older version of a log gave for the same flight.

    Parameters
    ----------
    output : Output
    names : sequence of str
        The logs as the user would type them. A log has its place among them for its number; what else is in it has
        numbers that are higher by multiples of how many logs there are.
    """

    def __init__(self, output: Output, names: Sequence[str]) -> None:
        self._output, self._names = output, names
        self._outcomes: dict[int, Outcome] = {}
        self._kept: dict[_Content, int] = {}  # content -> number of the log that is kept
        self._owner: dict[str, _Content] = {}  # flight id -> content
        self._clashes: set[str] = set()

    def put(self, number: int, outcome: Outcome) -> None:
        """Take a finished log over."""
        if not outcome.flight_id:
            self._outcomes[number] = outcome
            return
        content = _Content.of(outcome)
        twin = self._kept.get(content)
        if twin is not None and twin < number:
            self.put_twin(number, outcome, twin)
            return
        self._kept[content] = number
        self._outcomes[number] = self._placed(outcome)
        if twin is not None:
            self.put_twin(twin, self._outcomes[twin], number)

    def put_twin(self, number: int, outcome: Outcome, kept: int) -> None:
        """Take over a log whose content is that of the log with the number ``kept``."""
        if outcome.folder and not self._output.has_in_place(outcome):
            self._output.discard(outcome.folder)
        if len(outcome.parts) > 1:
            self.put_part(number, kept, outcome.flight_id, "", was_finished=outcome.was_finished)
            return
        text = f"{Path(outcome.source).name}: same content as {self._names[kept % len(self._names)]}, listed once"
        self._outcomes[number] = Outcome(outcome.source, "skipped", text, sha256=outcome.sha256)

    def _placed(self, outcome: Outcome) -> Outcome:
        identity, plain = outcome.flight_id, plain_id(outcome.flight_id, outcome.sha256)
        content = _Content.of(outcome)
        owner = self._owner.setdefault(plain, content)
        is_taken = owner != content or self._is_of_another_log(identity, outcome)
        was_taken = plain != identity  # in an earlier run
        if is_taken or (not was_taken and self._with_digest(plain, outcome).exists()):
            self._clashes.add(plain)
            if not was_taken:
                return outcome
        return outcome if self._output.has_in_place(outcome) else self._put_in_place(outcome)

    def _with_digest(self, plain: str, outcome: Outcome) -> Path:
        """The folder of a flight that had to take the digest of its log into its name."""
        number = f"_{outcome.power_up}" if outcome.power_up else ""
        return self._output.root / f"{plain}_{outcome.sha256[:8]}{number}"

    def _put_in_place(self, outcome: Outcome) -> Outcome:
        try:
            return replace(outcome, folder=self._output.place(outcome))
        except GroundstationError as error:
            reason = str(error)
        except OSError as error:
            reason = f"{outcome.flight_id}: cannot be put into place ({error.strerror or error})"
        with suppress(OSError, GroundstationError):
            self._output.discard(outcome.folder)
        return Outcome(outcome.source, "failed", reason, sha256=outcome.sha256, times_s=outcome.times_s)

    def clashing(self) -> tuple[int, ...]:
        """Numbers of the logs to run again with their digests in their names, once all are put."""
        return tuple(number for number, outcome in sorted(self._outcomes.items()) if outcome.flight_id in self._clashes)

    def put_again(self, number: int, outcome: Outcome) -> None:
        """Take over what was run again; if that failed, what stood in place stays."""
        former = self._outcomes[number]
        if not self._output.has_in_place(former):
            self._output.discard(former.folder)
        self._outcomes[number] = self._put_in_place(outcome) if outcome.flight_id else outcome

    def put_part(self, number: int, kept: int, flight_id: str, sha256: str, *, was_finished: bool = False) -> None:
        """Take over a log that is part of a flight, which that with the number ``kept`` gives."""
        name, folder = self._names[number % len(self._names)], str(self._output.root / flight_id)
        text = f"part of {flight_id}, with {Path(self._names[kept % len(self._names)]).name}"
        self._outcomes[number] = Outcome(
            name, "done", text, flight_id=flight_id, folder=folder, sha256=sha256, was_finished=was_finished
        )

    def put_joined(self, numbers: Sequence[int], outcome: Outcome) -> Outcome | None:
        """Put the flight of several logs into place.

        It takes the place of the flights that they gave one by one.

        Parameters
        ----------
        numbers : sequence of int
            Of those of the logs that are of this run.

        Returns
        -------
        Outcome or None
            Why they are not joined: then what each of them gave stays.
        """
        placed = self._put_in_place(outcome) if outcome.flight_id else outcome
        if not placed.flight_id:
            return Outcome(outcome.source, "skipped", f"not joined with the files behind it: {placed.text}")
        self._outcomes[numbers[0]] = placed
        for number in numbers[1:]:
            self.put_part(number, numbers[0], placed.flight_id, self._outcomes[number].sha256)
        return None

    def flights(self) -> dict[int, Outcome]:
        """Outcomes of the logs put so far, by their numbers."""
        return dict(self._outcomes)

    def flights_of(self, number: int, count: int) -> tuple[Outcome, ...]:
        """Outcomes of a log with so many flights, as they stand now."""
        return tuple(self._outcomes[number + place * len(self._names)] for place in range(count))

    def sweep(self, found: Scan) -> bool:
        """Remove flights of these logs that stand under another id.

        Those of older versions of the logs are removed, too.

        Returns whether there were any. ``found`` are the flights of the folder, with what is known of them.
        """
        flights = [outcome for outcome in self._outcomes.values() if outcome.flight_id]
        now: dict[str, set[str]] = {}
        for outcome in flights:
            for sha256 in (outcome.sha256, *(part.sha256 for part in outcome.parts)):
                now.setdefault(sha256, set()).add(outcome.flight_id)
        versions = {(utf8_text(_place_of(one)), plain_id(one.flight_id, one.sha256)) for one in flights}
        old = []
        for name in sorted({*_came_from(found.fresh, now, {path for path, _ in versions}), *found.stale}):
            origin = _origin_of(found.out / name)  # nothing is removed for what is remembered alone
            if origin is None or name in now.get(origin.sha256, ()):
                continue
            if origin.sha256 in now or (utf8_text(origin.path), plain_id(name, origin.sha256)) in versions:
                old.append(name)
        for name in old:
            with suppress(OSError, GroundstationError):  # the next run tries again
                self._output.discard(name)
        return bool(old)

    def outcomes(self) -> tuple[Outcome, ...]:
        """Outcomes of the logs put so far, in the order of the inputs."""
        count = max(1, len(self._names))
        return tuple(
            self._outcomes[number] for number in sorted(self._outcomes, key=lambda one: divmod(one, count)[::-1])
        )

    def power_up(self, number: int) -> int:
        """Number of the power-up in its log that a flight is; 0 where the log holds one."""
        return self._outcomes[number].power_up

    def _is_of_another_log(self, flight_id: str, outcome: Outcome) -> bool:
        """Tell whether a flight folder came from another log than an earlier version of this one."""
        origin = _origin_of(self._output.root / flight_id)
        if origin is None or _Content.of(origin) == _Content.of(outcome):
            return False
        return origin.path != _place_of(outcome)


def _came_from(flights: FlightKeys, digests: Collection[str], paths: Collection[str]) -> Iterator[str]:
    """Flights that came from logs of some digests or at some places, as far as is remembered."""
    for name, path, sha256 in zip(flights, *map(flights.column, ("path", "sha256")), strict=True):
        if sha256 in digests or path in paths:
            yield name


def _place_of(outcome: Outcome) -> str:
    """Path or URL of the log, as manifests tell it."""
    return outcome.source if is_remote(outcome.source) else str(Path(outcome.source).absolute())


def _origin_of(folder: Path) -> _Origin | None:
    """Origin of a flight folder; None when it is not whole."""
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        source, power_up = manifest["source"], manifest.get("power_up") or {}
        return _Origin(str(source["path"]), str(source["sha256"]), int(power_up.get("number", 0)))
    except (OSError, ValueError, KeyError, TypeError):
        return None
