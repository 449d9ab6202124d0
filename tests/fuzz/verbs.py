"""Mutated logs through the verbs: ``python -m tests.fuzz.verbs [--cases N] [--first SEED] [FORMAT ...]``.

``info``, ``check``, ``convert`` and ``run`` of every log, as the command line does it, with all warnings as errors.
The logs are spread over the formats; one in ``FULL_EVERY`` of each format is run with everything, the others with
``--only results``. Prints each fault and the totals; ends with 1 when there was any.
"""

import argparse
import contextlib
import gc
import json
import os
import shutil
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tests.fuzz.bases import FORMATS
from tests.fuzz.pool import WALL, Child
from tests.fuzz.trial import Case, Watch, content_of, edits_of, suffix_of

BASE_S, PER_MB_S = 3.0, 5.0  # of processor time that a verb may take, and as much again for each 10^6 bytes of a log
ONE_MB_S = BASE_S + PER_MB_S
MOST_SHOWN = 12  # of the slowest
FULL_EVERY = 40  # logs: a report and a recording take many times as long as everything else
LIMIT_MB = 400.0  # of memory that a log may take beyond those before it
CODES = (0, 1, 3, 4)  # 2 is a wrong call, and no call here is wrong
VERBS = ("info", "check", "convert", "run")


@dataclass(frozen=True)
class Answer:
    """What a verb gave: exit code, both streams, seconds of processor time."""

    code: int
    out: str
    err: str
    seconds: float


@contextlib.contextmanager
def streams_into(folder: Path) -> Iterator[None]:
    """Both streams of this process, those of libraries too, into files ``out`` and ``err`` of a folder."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(number) for number in (1, 2)]
    try:
        for number, name in ((1, "out"), (2, "err")):
            with (folder / name).open("wb") as stream:
                os.dup2(stream.fileno(), number)
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, saved in zip((1, 2), kept, strict=True):
            os.dup2(saved, number)
            os.close(saved)


def limit_of(size_bytes: int) -> float:
    """Processor time that a verb may take for a log of so many bytes."""
    return BASE_S + PER_MB_S * size_bytes / 1e6


def call(arguments: list[str], folder: Path) -> Answer:
    """Call the command in this process; an exception that it lets through is in ``err`` as a traceback."""
    from groundstation.cli.main import main

    began, code = time.process_time(), 0
    with streams_into(folder), warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            main(arguments)
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else 0 if ended.code is None else 1
        except BaseException:
            traceback.print_exc()
    seconds = time.process_time() - began
    out, err = ((folder / name).read_text(encoding="utf-8", errors="replace") for name in ("out", "err"))
    return Answer(code, out, err, seconds)


def arguments_of(verb: str, log: Path, out: Path, *, is_full: bool) -> list[str]:
    """What a user types."""
    return {
        "info": ["info", str(log)],
        "check": ["check", str(log), "--progress", "none"],
        "convert": ["convert", str(log), "-o", str(out / "flight.mcap"), "--progress", "none"],
        "run": ["run", str(log), "-o", str(out / "run"), "-j", "1", "--progress", "none"]
        + ([] if is_full else ["--only", "results"]),
    }[verb]


def faults_of(verb: str, answer: Answer) -> Iterator[str]:
    """What one verb must never do."""
    said = answer.out + answer.err
    for word in ("Traceback", "internal error", "Warning:"):
        if word in said:
            yield f"{verb}: {word}: {next(line for line in said.splitlines() if word in line)[:300]}"
    if answer.code not in CODES:
        yield f"{verb}: exit code {answer.code}: {answer.err[:300]}"
    errors = answer.err.splitlines()
    if answer.code == 1 and (len(errors) != 1 or not errors[0].startswith("error: ")):
        yield f"{verb}: {len(errors)} lines on stderr at exit code 1: {answer.err[:300]!r}"
    if answer.code != 1 and "error:" in answer.err:
        yield f"{verb}: an error at exit code {answer.code}: {answer.err[:300]!r}"


def is_harmless(what: str) -> bool:
    """Whether a note of the watch is no file of anybody's: filelock's probe of hard links, the name of the system."""
    return what.endswith(("/dev/null", "'uname'", "/probe-source", "/probe-link"))


def disagreements(answers: dict[str, Answer]) -> Iterator[str]:
    """Verbs of which some read the log and some do not, or of which some say that data are lost."""
    codes = {verb: answer.code for verb, answer in answers.items()}
    if len(set(codes.values())) > 1:
        reasons = {verb: one.err.strip()[:200] for verb, one in answers.items() if one.code == 1}
        yield f"exit codes differ: {codes} {reasons}"


def run_verbs(case: Case, folder: Path, watch: Watch) -> dict[str, Any]:
    """One mutated log through all verbs; what it came to, and what was wrong."""
    base, other, edits = edits_of(case)
    out, scratch = folder / "out", folder / "streams"
    out.mkdir()
    scratch.mkdir()
    log = folder / f"log{suffix_of(case.format)}"
    size_bytes = log.write_bytes(content_of(base, other, edits))
    limit_s = limit_of(size_bytes)
    is_full = case.seed // len(FORMATS) % FULL_EVERY == 0
    answers, faults = {}, []
    watch.seen.clear()
    watch.folder = str(folder.resolve())
    for verb in VERBS:
        arguments = arguments_of(verb, log, out, is_full=is_full)
        answers[verb] = call(arguments, scratch)
        if answers[verb].seconds > limit_s:  # once more: code may have been compiled, pages fetched
            again = call([*arguments, *({"convert": ["-f"], "run": ["--redo"]}.get(verb, []))], scratch)
            if again.seconds > limit_s and not (is_full and verb == "run"):
                faults.append(f"{verb}: {again.seconds:.1f} s of processor time, limit {limit_s:.1f} s")
            answers[verb] = replace(answers[verb], seconds=min(answers[verb].seconds, again.seconds))
        faults += faults_of(verb, answers[verb])
    watch.folder = ""
    faults += disagreements(answers)
    left = sorted(entry.name for entry in folder.iterdir() if entry not in (out, scratch, log))
    escaped = [what for what in watch.seen if not is_harmless(what)]
    if escaped or left:
        faults.append(f"written: {escaped} left: {left}")
    for name in left:
        entry = folder / name
        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
    for entry in (out, scratch):
        shutil.rmtree(entry)
    log.unlink()
    gc.collect()
    code = answers["check"].code
    spent = {verb: answer.seconds for verb, answer in answers.items()} | {"is_full": is_full}
    return {"came_to": str(code), "fault": "\n".join(faults), "spent": spent, "bytes": size_bytes, "base": base.name}


class Crew:
    """A child that is started anew when a log ends or hangs it."""

    def __init__(self, formats: list[str]) -> None:
        self._warm_up = [Case(formats[0], 0)]  # in full: everything is imported before memory is limited
        self._child: Child | None = None

    def run(self, case: Case) -> dict[str, Any]:
        """Result of a case; a death or a hang is a fault."""
        self._child = self._child or Child(self._warm_up, run_verbs)
        limit_s = WALL * ONE_MB_S * len(VERBS)
        found = self._child.run(case, limit_s)
        if found is None:
            code, self._child = self._child.end(), None
            how = f"no answer in {limit_s:.0f} s" if code is None else f"the process ended with {code}"
            return {"came_to": "lost", "fault": how, "seconds": 0.0, "growth_mb": 0.0, "spent": {}}
        if found["growth_mb"] > LIMIT_MB:
            found["fault"] += f"\n{found['growth_mb']:.0f} MB of memory more"
        return found

    def end(self) -> None:
        """Stop the child."""
        if self._child is not None:
            self._child.end()


def slowest_of(case: Case, found: dict[str, Any]) -> Iterator[tuple[float, str]]:
    """Share of its limit that each verb took, and a row of the table that tells so."""
    for verb in VERBS:
        if verb in found["spent"]:
            seconds, size_bytes = found["spent"][verb], found["bytes"]
            name = "run with everything" if verb == "run" and found["spent"]["is_full"] else verb
            share = seconds / limit_of(size_bytes)
            yield share, f"| {name} | {found['base']} | {case.seed} | {size_bytes / 1e6:.2f} MB | {seconds:.2f} s |"


def print_slowest(rows: Iterable[tuple[float, str]]) -> None:
    """Print the rows with the largest share of their limits as a table."""
    print("| verb | base | seed | size | processor time |\n|---|---|---|---|---|")
    for _, row in sorted(rows, reverse=True)[:MOST_SHOWN]:
        print(row)


def report(case: Case, found: dict[str, Any]) -> None:
    """Print a fault and the corpus entry that repeats it."""
    base, other, edits = edits_of(case)
    entry = {"base": base.name, "other": other.name, "edits": edits}
    print(f"--- {case.format} seed {case.seed}\n{found['fault'].strip()}\n{json.dumps(entry)[:600]}", flush=True)


def main() -> int:
    """Read the command line and run the logs."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.verbs")
    parser.add_argument("formats", nargs="*", default=[], choices=[*FORMATS, []], metavar="FORMAT")
    parser.add_argument("--cases", type=int, default=300, help="logs of all formats together")
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    formats = list(options.formats or FORMATS)
    crew, began = Crew(formats), time.monotonic()
    counts, faults, spent, most_mb = Counter[str](), Counter[str](), Counter[str](), 0.0
    slowest: list[tuple[float, str]] = []
    for number in range(options.cases):
        case = Case(formats[number % len(formats)], options.first + number)
        found = crew.run(case)
        counts[found["came_to"]] += 1
        slowest = sorted([*slowest, *slowest_of(case, found)], reverse=True)[:MOST_SHOWN]
        most_mb = max(most_mb, found["growth_mb"])
        spent.update({verb: found["spent"].get(verb, 0.0) for verb in VERBS})
        if found["fault"]:
            faults[case.format] += 1
            report(case, found)
        if (number + 1) % 200 == 0:
            print(f"{number + 1} logs, {faults.total()} with faults, {time.monotonic() - began:.0f} s", flush=True)
    crew.end()
    told = ", ".join(f"exit code {code}: {count}" for code, count in sorted(counts.items()))
    each = ", ".join(f"{verb} {seconds / options.cases:.2f} s" for verb, seconds in spent.items())
    print(f"{options.cases} logs in {time.monotonic() - began:.0f} s: {told}; on average {each};")
    print(f"largest growth of memory {most_mb:.0f} MB; faults: {dict(faults) or 0}")
    print_slowest(slowest)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
