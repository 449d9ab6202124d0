"""Runs of a study kept in its folder, so that a stopped study continues."""

import json
from pathlib import Path
from typing import Any, Generic, TypeVar

from groundstation.base.errors import UsageError
from groundstation.base.serial import from_json, to_json_exactly
from groundstation.base.version import __version__

R = TypeVar("R")


class KeptRuns(Generic[R]):
    """Outcomes by name and number in files ``<folder>/<name>.jsonl``, a line each.

    The name is that of their kind: family and seed. The first line has the version that made them; a last line that was
    cut is passed over and made again.
    """

    def __init__(self, folder: Path, outcome: type[R]) -> None:
        self._folder, self._outcome = folder, outcome
        self._runs: dict[str, dict[int, R]] = {}

    def get(self, name: str, number: int) -> R | None:
        """Return the outcome of a run that ended before.

        Raises
        ------
        UsageError
            When another version made the runs: they are not to be mixed.
        """
        if name not in self._runs:
            self._runs[name] = self._load(self._folder / f"{name}.jsonl")
        return self._runs[name].get(number)

    def put(self, name: str, number: int, outcome: R) -> None:
        """Keep the outcome of a run."""
        self._runs.setdefault(name, {})[number] = outcome
        line = json.dumps([number, to_json_exactly(outcome)])
        with (self._folder / f"{name}.jsonl").open("a", encoding="utf-8") as stream:
            stream.write(f"{line}\n")

    def _load(self, path: Path) -> dict[int, R]:
        if not path.is_file():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{json.dumps({'version': __version__})}\n", encoding="utf-8")
            return {}
        head, *lines = path.read_text(encoding="utf-8").split("\n")
        version = json.loads(head)["version"]
        if version != __version__:
            raise UsageError(str(path), f"runs of version {version}", __version__, "a new folder, or -f")
        whole: list[tuple[int, Any]] = [json.loads(line) for line in lines[:-1]]
        if lines[-1]:  # cut: what follows it must not stand on the same line
            path.write_text("\n".join([head, *lines[:-1], ""]), encoding="utf-8")
        return {number: from_json(self._outcome, document) for number, document in whole}
