"""Runs cases in a child process with a limit of time for each and of memory for all; a child that hangs is replaced."""

import gc
import multiprocessing
import resource
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from tests.fuzz.trial import Case, Watch, run_case

Run = Callable[[Case, Path, Watch], dict[str, Any]]

LIMIT_S = 5.0  # of processor time: other programs may hold the processor
WALL = 12.0  # so many times the limit have to pass before a child is taken for hung
START_S = 900.0  # of a child: imports and compiled loops
MEMORY_BYTES = 1 << 30  # that a case may take beyond what a child has after its first logs
REPEATS = 2  # a case that hangs is run again


def _limit_memory() -> None:
    used = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES, resource.RLIM_INFINITY))


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _child(pipe: Any, warm_up: list[Case], run: Run) -> None:
    warnings.simplefilter("error", RuntimeWarning)  # what numpy warns of would be told to users
    watch = Watch()
    with tempfile.TemporaryDirectory() as name:
        tempfile.tempdir = name
        for case in warm_up:  # compiled loops are loaded before memory is limited
            run(case, Path(name), watch)
        gc.collect()
        gc.freeze()  # modules are not looked through again after each log
        _limit_memory()
        pipe.send(_peak_mb())
        while (case := pipe.recv()) is not None:
            before, began = _peak_mb(), time.process_time()
            found = run(case, Path(name), watch)
            found |= {"seconds": time.process_time() - began, "growth_mb": _peak_mb() - before}
            pipe.send(found)


class Child:
    """One child process."""

    def __init__(self, warm_up: list[Case], run: Run = run_case) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_child, args=(theirs, warm_up, run), daemon=True)
        self._process.start()
        theirs.close()
        if not self._pipe.poll(START_S):
            raise RuntimeError("the child does not start")
        self.start_mb: float = self._pipe.recv()

    def run(self, case: Case, limit_s: float) -> dict[str, Any] | None:
        """Result of a case; None when it took too long or the child died."""
        try:
            self._pipe.send(case)
            if not self._pipe.poll(limit_s):
                return None
            found: dict[str, Any] = self._pipe.recv()
            return found
        except (EOFError, OSError):
            return None

    def end(self) -> int | None:
        """Stop the child; its exit code where it had died by itself."""
        self._process.join(0.1)
        code = self._process.exitcode
        self._process.kill()
        self._process.join()
        self._pipe.close()
        return code


def run_all(cases: Iterable[Case], limit_s: float = LIMIT_S) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Results of cases, one after the other."""
    child: Child | None = None
    warm_up: list[Case] = []
    for case in cases:
        warm_up = warm_up or [Case(case.format, seed) for seed in range(30)]
        found, code = None, None
        for _ in range(REPEATS):
            child = child or Child(warm_up)
            found = child.run(case, WALL * limit_s)
            if found is not None:
                break
            code, child = child.end(), None
        if found is None:
            how = f"no answer in {WALL * limit_s:.0f} s" if code is None else f"the process ended with {code}"
            found = {"came_to": "hang" if code is None else "death", "fault": how, "seconds": limit_s, "growth_mb": 0.0}
        elif found["seconds"] > limit_s and not found["fault"]:
            found |= {"came_to": "hang", "fault": f"{found['seconds']:.1f} s of processor time, limit {limit_s} s"}
        yield case, found
    if child is not None:
        child.end()
