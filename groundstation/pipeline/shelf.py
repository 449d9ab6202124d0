"""Where finished flights are put, one after the other, so that a run that is killed keeps what it had finished."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from groundstation.base.errors import GroundstationError
from groundstation.pipeline.depot import Depot
from groundstation.pipeline.outcome import Outcome


class Shelf:
    """Puts finished flights into place at once.

    Two flights of one id get the digests of their logs into their names; as that is known only when the second one
    is finished, they are run again at the end. Of logs with the same content the first in the list is kept, whichever
    was finished first.

    Parameters
    ----------
    depot : Depot
    names : sequence of str
        The logs as the user would type them.
    """

    def __init__(self, depot: Depot, names: Sequence[str]) -> None:
        self._depot, self._names = depot, names
        self._outcomes: dict[int, Outcome] = {}
        self._kept: dict[str, int] = {}  # content -> number of the log that is kept
        self._owner: dict[str, str] = {}  # flight id -> content
        self._clashes: set[str] = set()

    def put(self, number: int, outcome: Outcome) -> None:
        """Take a finished log over."""
        if not outcome.flight_id:
            self._outcomes[number] = outcome
            return
        twin = self._kept.get(outcome.sha256)
        if twin is not None and twin < number:
            self._outcomes[number] = self._as_twin(outcome, twin)
            return
        self._kept[outcome.sha256] = number
        self._outcomes[number] = self._placed(outcome)
        if twin is not None:
            self._outcomes[twin] = self._as_twin(replace(self._outcomes[twin], folder=""), number)

    def _as_twin(self, outcome: Outcome, kept: int) -> Outcome:
        if outcome.folder and not self._depot.has_in_place(outcome):
            self._depot.discard(outcome.folder)
        text = f"{Path(outcome.source).name}: same content as {self._names[kept]}, listed once"
        return Outcome(outcome.source, "skipped", text, sha256=outcome.sha256)

    def _placed(self, outcome: Outcome) -> Outcome:
        identity, suffix = outcome.flight_id, f"_{outcome.sha256[:8]}"
        is_in_place = self._depot.has_in_place(outcome)
        plain = identity.removesuffix(suffix) if is_in_place else identity
        owner = self._owner.setdefault(plain, outcome.sha256)
        is_taken = owner != outcome.sha256 or _is_of_another_log(self._depot.root / identity, outcome)
        if plain != identity:  # finished in an earlier run, in which two flights had this id
            self._clashes |= {plain} if is_taken else set()
            return outcome
        if is_taken or (self._depot.root / f"{identity}{suffix}").exists():
            self._clashes.add(identity)
            return outcome
        return outcome if is_in_place else replace(outcome, folder=self._depot.place(outcome))

    def settle(self, run_with_suffix: Callable[[int], Outcome]) -> None:
        """Give flights of one id their digests, once all are put; logs are run again by their numbers."""
        for number, outcome in sorted(self._outcomes.items()):
            if outcome.flight_id in self._clashes:
                again = run_with_suffix(number)
                self._depot.discard(outcome.folder)
                if again.flight_id:
                    again = replace(again, folder=self._depot.place(again))
                self._outcomes[number] = again

    def outcomes(self) -> tuple[Outcome, ...]:
        """What became of the logs put so far, in the order of the inputs."""
        return tuple(outcome for _, outcome in sorted(self._outcomes.items()))


def _is_of_another_log(folder: Path, outcome: Outcome) -> bool:
    from groundstation.results.files import load

    if not folder.exists():
        return False
    try:
        return str(load(folder).summary["flight"]["source"]["sha256"]) != outcome.sha256
    except (GroundstationError, KeyError, TypeError):
        return False
