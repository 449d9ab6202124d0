"""Records of benchmarks: what was measured, beside which peer, by which goal, on which machine.

A benchmark opens a :class:`Book` and puts a record in it for each figure; the book writes
``build/bench/<part>.json`` and prints each figure as it comes. Figures of two sides are ratios of processor time
(user and system, children among it) of rounds in which the sides take turns; the clock stands beside. A figure is the
median of the rounds (``ROUNDS`` in the environment, seven by default) and its interval is that of order statistics; a
goal is met when the less favourable end of the interval meets it.
"""

import json
import math
import os
import resource
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from importlib import metadata
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from groundstation.pipeline.verbs.provenance import CHECKOUT, Machine, commit_of, this_machine, utc_told

ROUNDS = max(int(os.environ.get("ROUNDS", "7")), 1)
FOLDER = CHECKOUT / "build" / "bench"
CONFIDENCE = 0.95
DIGITS = 4  # significant, of figures in a record
CORES_TIME = Path("/proc/stat")
Sense = Literal["at most", "at least"]


@dataclass(frozen=True)
class Interval:
    """A median and an interval that holds it."""

    value: float
    low: float
    high: float

    def inverse(self) -> "Interval":
        """Return the interval of one over the figure."""
        return Interval(1.0 / self.value, 1.0 / self.high, 1.0 / self.low)


@dataclass(frozen=True)
class Goal:
    """A limit of a figure."""

    limit: float
    sense: Sense = "at most"

    def is_met_by(self, figure: Interval) -> bool:
        """Tell whether the less favourable end of a figure's interval is within the limit."""
        return figure.high <= self.limit if self.sense == "at most" else figure.low >= self.limit


@dataclass(frozen=True)
class Record:
    """One figure of a benchmark.

    Parameters
    ----------
    part, what, command : str
        Part of the benchmarks, the figure, and the command that prints it.
    unit : str
        Of ``ours`` and ``peer``.
    ours, peer : float or None
        Medians; None where there is none.
    peer_name, peer_version : str
        Empty where there is none.
    ratio, ratio_low, ratio_high : float or None
        ``peer`` over ours where ``is_times`` is true (how many times as fast), ours over ``peer`` else.
    low, high : float or None
        Interval of ``ours``.
    goal, sense
        Limit of the ratio, of ours where there is no peer; None: none was set.
    met : bool or None
    note : str
        A fact that explains the figure; the reason where nothing was measured.
    rounds : int
    others : float or None
        Cores that other processes used meanwhile: above a few tenths, seconds are not those of a quiet machine.
    """

    part: str
    what: str
    command: str
    unit: str = ""
    ours: float | None = None
    low: float | None = None
    high: float | None = None
    peer: float | None = None
    peer_name: str = ""
    peer_version: str = ""
    ratio: float | None = None
    ratio_low: float | None = None
    ratio_high: float | None = None
    is_times: bool = False
    goal: float | None = None
    sense: Sense = "at most"
    met: bool | None = None
    note: str = ""
    rounds: int = 0
    others: float | None = None
    machine: Machine | None = None
    commit: str = ""
    date: str = ""

    @property
    def key(self) -> tuple[str, str, str]:
        """Identity of the figure: a later record of it replaces an earlier one."""
        return self.part, self.what, self.peer_name

    @classmethod
    def of(cls, document: Mapping[str, object]) -> "Record":
        """Return the record of a JSON document."""
        known = dict(document)
        machine = known.pop("machine", None)
        return cls(**known, machine=Machine(**machine) if isinstance(machine, dict) else None)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Times:
    """Seconds of each round of one side: processor time, and by the clock."""

    processor_s: tuple[float, ...]
    clock_s: tuple[float, ...]


def order_statistics(rounds: int) -> int:
    """Return how many of the lowest and of the highest rounds lie outside the median's interval.

    The interval between order statistics k + 1 and n - k holds the median with probability
    ``1 - 2 P(B(n, 1/2) <= k)``. With fewer than six rounds no interval has 95 %: it is then the whole range.

    Source: David and Nagaraja, Order Statistics, 3rd ed., 2003, section 7.1.

    Examples
    --------
    >>> [order_statistics(rounds) for rounds in (3, 6, 7, 9, 15)]
    [0, 0, 0, 1, 3]
    """
    outside = -1
    below = 0.0
    while outside + 1 < rounds / 2:
        below += math.comb(rounds, outside + 1) / 2.0**rounds
        if 1.0 - 2.0 * below < CONFIDENCE:
            break
        outside += 1
    return max(outside, 0)


def interval(values: Sequence[float]) -> Interval:
    """Return the median of rounds and its interval by order statistics.

    Examples
    --------
    >>> interval([3.0, 1.0, 2.0])
    Interval(value=2.0, low=1.0, high=3.0)
    """
    ordered = sorted(values)
    outside = order_statistics(len(ordered))
    return Interval(statistics.median(ordered), ordered[outside], ordered[-1 - outside])


def used_s() -> float:
    """Return processor seconds of this process and of its children that have ended, user and system."""
    parts = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(part.ru_utime + part.ru_stime for part in parts)


def by_turns(
    works: Mapping[str, Callable[[], object]], rounds: int = ROUNDS, repeats: Mapping[str, int] | None = None
) -> dict[str, Times]:
    """Do works by turns, after one turn that warms them up; return the times of each.

    ``repeats``: works that are done so often in a round, their mean counts.
    """
    for do in works.values():
        do()
    seen: dict[str, list[tuple[float, float]]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, do in works.items():
            count = (repeats or {}).get(name, 1)
            clock, processor = time.perf_counter(), used_s()
            for _again in range(count):
                do()
            seen[name].append(((used_s() - processor) / count, (time.perf_counter() - clock) / count))
    return {name: Times(tuple(one for one, _ in pairs), tuple(one for _, one in pairs)) for name, pairs in seen.items()}


def version_of(distribution: str) -> str:
    """Return the version of an installed package; empty where it is not installed."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return ""


class Book:
    """Records of one part of the benchmarks; on leaving they are written.

    Parameters
    ----------
    part : str
        ``ulog``: the name of benchmarks/bench_ulog.py.
    folder : Path
        Where ``<part>.json`` is written.
    """

    def __init__(self, part: str, folder: Path = FOLDER) -> None:
        self.part, self.records = part, list[Record]()
        self._folder = folder
        self._machine, self._commit, self._date = this_machine(), commit_of(), utc_told()
        self._load = _Load()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        if kind is None:
            self.write()

    def write(self) -> Path:
        """Write the records."""
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._folder / f"{self.part}.json"
        path.write_text(as_json(self.records), encoding="utf-8")
        return path

    def against(
        self,
        what: str,
        ours: Times,
        peer: Times,
        peer_name: str,
        *,
        goal: Goal | None = None,
        is_times: bool = False,
        by_clock: bool = False,
        distribution: str = "",
        note: str = "",
    ) -> Record:
        """Record a figure beside a peer's of the same rounds.

        ``goal`` is that of the ratio: peer over ours with ``is_times``, ours over peer else. ``distribution`` is the
        package whose version is told, ``peer_name`` unless given.
        """
        own, theirs = (side.clock_s if by_clock else side.processor_s for side in (ours, peer))
        pairs = [(b, a) if is_times else (a, b) for a, b in zip(own, theirs, strict=True)]
        ratio = interval([upper / lower for upper, lower in pairs])
        figure = interval(own)
        return self._put(
            what,
            unit="s by the clock" if by_clock else "s",
            ours=figure.value,
            low=figure.low,
            high=figure.high,
            peer=statistics.median(theirs),
            peer_name=peer_name,
            peer_version=version_of(distribution or peer_name),
            ratio=ratio.value,
            ratio_low=ratio.low,
            ratio_high=ratio.high,
            is_times=is_times,
            goal=goal.limit if goal else None,
            sense=goal.sense if goal else "at most",
            met=goal.is_met_by(ratio) if goal else None,
            note=note,
            rounds=len(own),
        )

    def figure(
        self, what: str, values: float | Sequence[float], unit: str, *, goal: Goal | None = None, note: str = ""
    ) -> Record:
        """Record a figure without a peer: one value, or those of the rounds."""
        several = list(values) if isinstance(values, Sequence) else [values]
        found = interval(several)
        return self._put(
            what,
            unit=unit,
            ours=found.value,
            low=found.low,
            high=found.high,
            goal=goal.limit if goal else None,
            sense=goal.sense if goal else "at most",
            met=goal.is_met_by(found) if goal else None,
            note=note,
            rounds=len(several),
        )

    def not_measured(self, what: str, why: str, peer_name: str = "") -> Record:
        """Record that a figure was not measured, and why: a peer or a log is missing."""
        return self._put(what, peer_name=peer_name, note=f"not measured: {why}")

    def has(self, *distributions: str) -> bool:
        """Tell whether packages are installed; record each that is missing as not measured."""
        missing = [name for name in distributions if not version_of(name)]
        for name in missing:
            self.not_measured(f"beside {name}", f"{name} is not installed", name)
        return not missing

    def _put(self, what: str, **facts: object) -> Record:
        rounded = {name: _rounded(one) if isinstance(one, float) else one for name, one in facts.items()}
        command = f"make bench WHAT={self.part}"
        own = {"machine": self._machine, "commit": self._commit, "date": self._date}
        record = Record(self.part, what, command, **rounded, others=self._load.others(), **own)  # type: ignore[arg-type]
        self.records.append(record)
        print(told(record), flush=True)
        return record


class _Load:
    """Cores that other processes have used since the book was opened; Linux alone tells."""

    def __init__(self) -> None:
        self._start_s, self._busy_s, self._own_s = time.monotonic(), _busy_s(), used_s()

    def others(self) -> float | None:
        """Return them, in cores; children that still run count as others."""
        passed_s = time.monotonic() - self._start_s
        if passed_s < 1.0 or not self._busy_s:
            return None
        return round(max(_busy_s() - self._busy_s - (used_s() - self._own_s), 0.0) / passed_s, 1)


def _busy_s() -> float:
    """Return seconds of all processors that were not idle; 0 where the system does not tell."""
    try:
        numbers = [int(word) for word in CORES_TIME.read_text(encoding="ascii").split("\n")[0].split()[1:9]]
        return (sum(numbers) - numbers[3] - numbers[4]) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError):
        return 0.0


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def number(value: float | None) -> str:
    """Return a figure with three significant digits, an integer from 1000 on; empty for None.

    Examples
    --------
    >>> number(0.01234), number(12.345), number(12345.6), number(None)
    ('0.0123', '12.3', '12 346', '')
    """
    if value is None:
        return ""
    return f"{value:,.0f}".replace(",", " ") if abs(value) >= 1000.0 else f"{value:.3g}"


def ratio_told(record: Record) -> str:
    """Return the ratio of a record with its interval; empty where there is none.

    Examples
    --------
    >>> ratio_told(Record("a", "b", "c", ratio=8.5, ratio_low=8.0, ratio_high=9.0, is_times=True))
    '8.5 times as fast (8 to 9)'
    """
    if record.ratio is None:
        return ""
    words = " times as fast" if record.is_times else ""
    return f"{number(record.ratio)}{words} ({number(record.ratio_low)} to {number(record.ratio_high)})"


def goal_told(record: Record) -> str:
    """Return the goal of a record and whether it is met; empty where none was set.

    Examples
    --------
    >>> goal_told(Record("a", "b", "c", goal=5.0, sense="at least", met=True))
    'at least 5: met'
    """
    if record.goal is None or record.met is None:
        return ""
    return f"{record.sense} {number(record.goal)}: {'met' if record.met else 'not met'}"


def peer_told(record: Record) -> str:
    """Return the peer of a record and its version."""
    return " ".join(filter(None, (record.peer_name, record.peer_version)))


def told(record: Record) -> str:
    """Return a record in one line."""
    parts = [f"{record.part}: {record.what}"]
    if record.ours is not None:
        parts.append(f"{number(record.ours)} {record.unit}".strip())
    if record.peer is not None:
        parts.append(f"{peer_told(record)} {number(record.peer)} {record.unit}".strip())
    parts += [text for text in (ratio_told(record), goal_told(record), record.note) if text]
    return "; ".join(parts)


def as_json(records: Iterable[Record]) -> str:
    """Return records as JSON, one a line: a change is a change of lines."""
    usual = {one.name: one.default for one in fields(Record)}
    told_of = ({key: one for key, one in asdict(record).items() if one != usual[key]} for record in records)
    lines = [json.dumps(one, ensure_ascii=False) for one in told_of]
    return "[\n" + ",\n".join(lines) + "\n]\n"


def read(path: Path) -> list[Record]:
    """Read the records of a file."""
    return [Record.of(one) for one in json.loads(path.read_text(encoding="utf-8"))]
