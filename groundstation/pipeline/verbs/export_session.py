"""Verb ``export`` for a session: tracks and ranges in the formats of its systems."""

from collections.abc import Sequence
from pathlib import Path

from groundstation.base.errors import UsageError, told_in_a_line
from groundstation.pipeline.one_flight.identity import safe_part
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.verbs.export import require_place, require_suffix
from groundstation.results.files import load, write_text
from groundstation.systems import systems


def export_session(path: Path, target: Path, *, names: Sequence[str] = (), force: bool = False) -> Outcome:
    """Write a session to ``target`` in the format of its suffix.

    .tum: a file for each vehicle, named after the target and the vehicle. .g2o: a graph with poses and ranges.

    Parameters
    ----------
    path : Path
        Folder of a session.
    names : sequence of str
        The algorithm whose tracks are wanted; none: the default answer.

    Raises
    ------
    UsageError
        For another suffix, an algorithm that the session lacks, several of them, or a file that is there.
    """
    formats = {one.suffix: one.load for every in systems().every for one in every.session_exports}
    require_suffix(target, tuple(formats))
    if len(names) > 1:
        raise UsageError(str(target), f"{len(names)} tracks", "one", "name one --track")
    results = load(path, systems().answer_types).results
    texts = formats[target.suffix.lower()]()(results, names[0] if names else "")
    files = {_beside(target, name): text for name, text in texts.items()}
    if len(files) < len(texts):
        raise UsageError(str(target), "vehicles whose names differ in signs alone", "names that make different files")
    for file in files:
        require_place(path, file, force)
    with told_in_a_line(str(target)):
        target.parent.mkdir(parents=True, exist_ok=True)
        for file, text in files.items():
            write_text(file, text)
    return Outcome(str(path), "done", f"-> {', '.join(file.name for file in files)}", folder=str(target))


def _beside(target: Path, name: str) -> Path:
    return target if not name else target.with_stem(f"{target.stem}_{safe_part(name) or 'vehicle'}")
