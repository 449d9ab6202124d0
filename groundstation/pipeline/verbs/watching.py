"""Watch a folder: what arrives is run by the engine of ``run``, once it stops growing.

All that is known of finished logs stands in OUT, so the watch may be killed at any moment: at its next start it finds
what is finished, and goes on. Folders are listed again and again, which works on network shares too.
"""

import math
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import field, replace
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UsageError
from groundstation.base.words import counted
from groundstation.pipeline.many_flights.inputs import collect
from groundstation.pipeline.many_flights.runs.out_folder import refuse_foreign
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Listener, silent
from groundstation.pipeline.verbs.watched_batch import WatchedLogs, run_batch
from groundstation.readers.bags.marks import METADATA

UNFINISHED = (".part", ".partial", ".tmp", ".filepart", ".crdownload")  # what programs call a file that still comes
Signature = tuple[tuple[str, int, int], ...]  # name, size and time of change of every file of a log


@dataclass
class Watched:
    """Memory of a watch between two looks at its folder.

    Parameters
    ----------
    seen : dict of Path to Signature
        Logs as they were at the last look.
    done : dict of Path to Signature
        Logs as they were when they were run: one that changed since is run again.
    """

    seen: dict[Path, Signature] = field(default_factory=dict)
    done: dict[Path, Signature] = field(default_factory=dict)

    def ready(self, now: dict[Path, Signature]) -> list[Path]:
        """Logs that have not changed since the last look, and were not run as they are.

        The look is remembered.

        Examples
        --------
        >>> watched, log = Watched(), Path("a.csv")
        >>> grows = [{log: (("a.csv", size, 0),)} for size in (1, 2, 2, 2)]
        >>> found = []
        >>> for look in grows:
        ...     found.append(len(watched.ready(look)))
        ...     watched.done.update({log: look[log] for _ in range(found[-1])})
        >>> found
        [0, 0, 1, 0]
        """
        stable = [path for path, signature in now.items() if signature and self.seen.get(path) == signature]
        self.seen = now
        return [path for path in stable if self.done.get(path) != now[path]]


def watch(
    folder: Path,
    out: Path,
    configuration: Configuration,
    *,
    every_s: float,
    once: bool = False,
    jobs: int = 0,
    fail_on: str = "none",
    with_pdf: bool = False,
    stations: Path | None = None,
    force: bool = False,
    only_results: bool = False,
    timeout_s: float = math.inf,
    is_isolated: bool = False,
    say: Callable[[str], None],
    listen: Listener = silent,
    wait: Callable[[float], None] = time.sleep,
) -> Iterator[tuple[Outcome, ...]]:
    """Run what arrives in a folder, as long as it is asked for.

    Yields what became of each batch.

    A log is run once two looks, ``every_s`` apart, find the same sizes and times; one that is written to later, or
    replaced, is run again, and its results replace the earlier ones. What no reader claims is told once.

    Parameters
    ----------
    folder, out : Path
        Of this machine, or of a share that it sees as a folder.
    once : bool
        Look twice, run what is ready, and end; what kept it from that is then an outcome that failed.
    only_results : bool
        No recording and no report, as for ``run``.
    timeout_s : float
        Longest time for one log, in seconds; one that takes longer has failed, and is run again when it changes.
    is_isolated : bool
        Each log in a process of its own, as for ``run``.
    say : callable
        Is given what is not about a log: that the folder cannot be reached, that another run writes into ``out``.
    wait : callable
        Sleeps between two looks.

    Raises
    ------
    UsageError
        When the folder does not exist, or is ``out``; when ``out`` is a folder of others and ``force`` is not given.
    """
    if not folder.is_dir():
        raise UsageError(str(folder), "no such folder", "a folder where logs arrive")
    if folder.resolve() == out.resolve():
        raise UsageError(str(out), "the folder that is watched", "another one for the results")
    refuse_foreign(out, force)
    batch = WatchedLogs((), out, configuration, fail_on, with_pdf, jobs, stations, force, True, only_results, timeout_s)
    batch = replace(batch, is_isolated=is_isolated)
    watched, trouble = Watched(), _Trouble((lambda _: None) if once else say)
    here = _look(folder, out, configuration, trouble)
    watched.ready(here)
    if not once and not trouble.told:
        say(f"watching {folder}: {counted(len(here), 'file')} there now, looked at every {every_s:g} s; Ctrl-C ends")
    while True:
        wait(every_s)
        now = _look(folder, out, configuration, trouble)
        ready = watched.ready(now)
        if ready:
            found = run_batch(replace(batch, paths=tuple(ready)), listen)
            if isinstance(found, str):  # nothing was run: at the next look it is tried again
                trouble.tell(found)
            else:
                batch = replace(batch, is_first=False)
                watched.done.update({path: now[path] for path in ready})
                trouble.end()
                yield found
        if once:
            if trouble.told:
                yield (Outcome(str(out), "failed", trouble.told, is_beside=True),)
            return


@dataclass
class _Trouble:
    """Trouble that keeps a watch from its work, told once and not at every look."""

    say: Callable[[str], None]
    told: str = ""

    def tell(self, text: str) -> None:
        if text != self.told:
            self.say(text)
        self.told = text

    def end(self) -> None:
        self.told = ""


def _look(folder: Path, out: Path, configuration: Configuration, trouble: _Trouble) -> dict[Path, Signature]:
    """The logs of a folder as they are now; none where it cannot be reached, which is told."""
    judges = {path.resolve() for path in configuration.references.paths}
    try:
        listed = [one.path for one in collect([folder], out)]
    except (UsageError, OSError) as error:
        trouble.tell(f"{folder} cannot be read now ({error})")
        return {}
    paths = [path for path in listed if path.suffix.lower() not in UNFINISHED and path.resolve() not in judges]
    return {path: signature_of(path) for path in paths}


def signature_of(path: Path) -> Signature:
    """Names, sizes and times of the files of a log.

    Empty where they cannot be read: then it is not looked at.
    """
    files: Collection[Path] = (path,)
    try:
        if path.name == METADATA:
            files = sorted(file for file in path.parent.iterdir() if file.is_file())
        stats = [(file.name, file.stat()) for file in files if file.is_file()]
    except OSError:
        return ()
    return tuple((name, stat.st_size, stat.st_mtime_ns) for name, stat in stats)


def fresh(outcomes: Sequence[Outcome]) -> tuple[Outcome, ...]:
    """Outcomes that are news: those of logs that an earlier start had finished are left out."""
    return tuple(one for one in outcomes if not one.was_finished)
