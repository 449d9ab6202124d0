"""What other rules make of verdicts that were given: gates and verdict before and after, from stored values."""

from dataclasses import dataclass

from groundstation.results.gates import Gate


@dataclass(frozen=True)
class Rejudged:
    """A verdict under other limits. ``subject`` says what it is on: "heading", "landing 1 from 305 m".

    ``gates_before`` and ``gates_after`` go together, one to one.
    """

    subject: str
    before: str
    after: str
    gates_before: tuple[Gate, ...]
    gates_after: tuple[Gate, ...]

    @property
    def is_changed(self) -> bool:
        """Whether the verdict is another one."""
        return self.before != self.after
