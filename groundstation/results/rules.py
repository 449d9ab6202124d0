"""Verdicts judged again by other rules: gates and verdict before and after.

They are judged from stored values.
"""

from groundstation.base.dataclasses import dataclass
from groundstation.results.gates import Gate


@dataclass(frozen=True)
class Rejudged:
    """Verdict under other limits.

    ``subject`` says what it is on: "heading", "landing 1 from 305 m". ``gates_before`` and ``gates_after`` go together,
    one to one.
    """

    subject: str
    before: str
    after: str
    gates_before: tuple[Gate, ...]
    gates_after: tuple[Gate, ...]

    @property
    def is_changed(self) -> bool:
        """Tell whether the verdict is another one."""
        return self.before != self.after
