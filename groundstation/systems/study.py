"""Results of studies: tables, and a page of sections, told as those of a report are."""

import multiprocessing
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Grid, Head, Note, Part, Section
from groundstation.results.figures import FigureData

OutcomeT = TypeVar("OutcomeT")
FamilyT = TypeVar("FamilyT", bound="Named")
Row = Mapping[str, object]
Mapped = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Any]]

POOLED_FROM = 8  # fewer jobs are done before other processes have started
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Named(Protocol):
    """Family or case of a study."""

    @property
    def name(self) -> str: ...


class RunStore(Protocol[OutcomeT]):
    """Outcomes of earlier calls, by a name for what was run, its seed and number."""

    def get(self, name: str, number: int) -> OutcomeT | None:
        """Return the outcome of a run, None where it has not ended."""

    def put(self, name: str, number: int, outcome: OutcomeT) -> None:
        """Keep the outcome of a run."""


def judged_families(
    families: Sequence[FamilyT],
    judge: Callable[[FamilyT], Row],
    progress: Callable[[str], None] | None,
    told: Callable[[Row], str],
) -> list[Row]:
    """Return a row of each family, and tell of each as it is judged."""
    rows = []
    for family in families:
        rows.append(judge(family))
        if progress:
            progress(f"{family.name}: {told(rows[-1])}")
    return rows


@contextmanager
def mapped(jobs: int) -> Iterator[Mapped]:
    """Return a map over jobs: in this process for a few, else in single-threaded processes."""
    workers = min(jobs, os.cpu_count() or 1)
    if jobs < POOLED_FROM or workers < 2:
        yield map
        return
    with _environment(dict.fromkeys(ONE_THREAD, "1")):
        pool = ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))
        try:
            yield pool.map
        finally:
            pool.shutdown(cancel_futures=True)


@contextmanager
def _environment(changes: dict[str, str]) -> Iterator[None]:
    """Set environment variables for processes started meanwhile."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def table_of(name: str, rows: Sequence[Row], digits: Mapping[str, int]) -> FigureData:
    """Return rows with the same keys as the columns of a table; there is at least one."""
    return FigureData(name, {key: np.array([row[key] for row in rows]) for key in rows[0]}, digits)


def share_inside(scaled: Sequence[float], sigmas: float) -> float:
    """Return the share of errors, each over its sigma, within so many sigmas; NaN without any.

    Examples
    --------
    >>> share_inside([0.5, -3.0], 1.96), share_inside([], 1.96)
    (0.5, nan)
    """
    return float(np.mean(np.abs(scaled) <= sigmas)) if scaled else float("nan")


@dataclass(frozen=True)
class StudyResult:
    """Result of a study: tables (arrays with units in their names) and its page.

    The heading section comes first.
    """

    name: str
    tables: tuple[FigureData, ...]
    sections: tuple[Section, ...]

    @property
    def markdown(self) -> str:
        """The page as a Markdown document."""
        return self.markdown_with("")

    def markdown_with(self, line: str) -> str:
        """Return the page as a Markdown document with a line, Markdown already, below its title."""
        parts = [
            markdown(section, level=2 if number else 1, widest=sys.maxsize)
            for number, section in enumerate(self.sections)
        ]
        title, _, rest = parts[0].partition("\n\n")
        return "\n\n".join(part for part in (title, line, rest, *parts[1:]) if part) + "\n"


def section(title: str, *parts: Part | str) -> Section:
    """Return a section of a page; a text becomes a paragraph, an empty one is left out."""
    made = [Note(part) if isinstance(part, str) else part for part in parts if part != ""]
    return Section("", title, "", made)


def table(data: FigureData) -> Grid:
    """Return a table with all its columns, rounded to the digits of their columns."""

    def cell(name: str, value: object) -> str:
        if isinstance(value, float | np.floating):
            return "" if np.isnan(value) else f"{value:.{data.digits.get(name, 2)}f}"
        return str(value)

    names = list(data.columns)
    rows = [[cell(name, data[name][row]) for name in names] for row in range(len(data))]
    heads = [Head(name.replace("_", " "), data[name].dtype.kind in "iuf") for name in names]
    return Grid("", heads, rows)


def grid(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Grid:
    """Return a table of texts."""
    return Grid("", [Head(head) for head in heads], rows)
