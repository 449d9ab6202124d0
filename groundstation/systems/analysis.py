"""One analysis as one object: needs, settings, answer, run, and its line for the terminal."""

import dataclasses
import re
from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Generic, NamedTuple, Protocol, TypeVar, cast

from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.words import capitalised
from groundstation.results.answer import Answer, Answers
from groundstation.results.columns import AnswerColumn
from groundstation.results.rules import Rejudged

Data = TypeVar("Data", contravariant=True)  # a flight, or a session of several
KnownT = TypeVar("KnownT", contravariant=True)
SettingsT = TypeVar("SettingsT")
AnswerT = TypeVar("AnswerT", bound=Answer)


@dataclass(frozen=True)
class Found(Generic[AnswerT]):
    """Result of a run: answer, findings, and workings that later analyses build on."""

    answer: AnswerT
    findings: tuple[Finding, ...] = ()
    workings: Any = None


class Run(Protocol[Data, KnownT, SettingsT, AnswerT]):  # type: ignore[misc]
    """Run of an analysis.

    It raises NotAssessableError, with the reason, for what the data lack.
    """

    def __call__(self, data: Data, known: KnownT, settings: SettingsT, /) -> Found[AnswerT]: ...


class RestsOn(NamedTuple):
    """Samples an answer rests on: topics, fields and spans of flight seconds.

    Damage in them is a finding.
    """

    topics: tuple[str, ...]
    fields: tuple[str, ...]
    spans_s: tuple[tuple[float, float], ...]


class Shortfall(NamedTuple):
    """Reason why an answer is not a full one, and where: spans of flight seconds."""

    text: str
    spans_s: tuple[tuple[float, float], ...] = ()


class Examine(Protocol[Data, KnownT, SettingsT]):  # type: ignore[misc]
    """Check of what data lack for a full answer, without estimating.

    NotAssessableError where none would come.
    """

    def __call__(self, data: Data, known: KnownT, settings: SettingsT, /) -> tuple[Shortfall, ...]: ...


def _always(_data: Any, _known: Any) -> bool:
    return True


def _nothing(_answers: Answers) -> str:
    return ""


def _any_settings(_settings: Any, _known: Any) -> None:
    """Accept any settings: values in range are fit to run with."""


def _gives_nothing(_data: Any, _known: Any, _settings: Any) -> tuple[str, ...]:
    return ()


def _no_samples(_data: Any, _answer: Any) -> None:
    """Return no samples: no damage counts against the answer."""


def _none_is_main(_path: str, _saved: Any) -> bool:
    return False


def main_numbers(pattern: str) -> Callable[[str, Any], bool]:
    r"""Return the ``is_main`` of an analysis whose main numbers have paths of a pattern.

    Examples
    --------
    >>> is_main = main_numbers(r"verdict|azimuth\.error_deg")
    >>> is_main("azimuth.error_deg", ()), is_main("azimuth.samples", ())
    (True, False)
    """
    compiled = re.compile(pattern)
    return lambda path, _saved: compiled.fullmatch(path) is not None


RejudgeAlso = Callable[[str, Rejudged, Any], tuple[Rejudged, ...]]


@dataclass(frozen=True)
class Rules:
    """Rules to judge the gates of an answer again under other limits, without the log.

    ``limits`` are the settings that bound gates and choose no data; a change of any other one
    needs the log. ``rejudge(answer, settings)`` gives each verdict before and after. ``also_in(out)`` reads what the
    flights of a folder gave together; what it returns takes a flight id, one of these verdicts and the settings, and
    gives the verdicts that rest on both.
    """

    limits: frozenset[str]
    rejudge: Callable[[Any, Any], tuple[Rejudged, ...]]
    also_in: Callable[[Path], RejudgeAlso] | None = None


@dataclass(frozen=True)
class Analysis(Generic[Data, KnownT, SettingsT, AnswerT]):
    """One analysis of a flight or a session; all that run, list or save loop over them.

    Parameters
    ----------
    name : str
        Its key in settings, in ``results`` of summary.json and in findings.
    title : str
        What ``list`` says it does.
    subject : str
        What its findings speak of: "magnetic deviation".
    page_title : str
        What pages call it where it could not be carried out; empty: its subject.
    needs : str
        What a log must hold, for people.
    settings : type
        Frozen dataclass; the TOML table ``table`` fills it.
    answer : type of Answer
    table : str
        Name of its settings in TOML; empty: its own name.
    run : callable
        ``run(data, known, settings) -> Found``.
    builds_on : tuple of str
        Analyses whose answers it uses where there are any; they run first.
    requires : tuple of str
        Those of them without which it cannot run; that it then did not run is their reason, told once.
    applies : callable
        Whether data of that kind can have it at all: of other data nothing is said of it, not even why not.
    is_expected : callable
        Whether such data let one expect an answer: then a finding says why there is none.
    rests_on : callable
        ``rests_on(data, answer)``: the samples whose damage makes the answer doubtful.
    sentence : callable
        One line for people, of all answers; empty where another analysis says it.
    columns : tuple of AnswerColumn
        What it gives to the tables of flights: index.json, index.csv, fleet.parquet. Names differ between analyses.
    check : callable
        ``check(settings, aircraft)`` raises SettingsError for settings that contradict what is known of the aircraft.
    examine : callable, optional
        ``examine(data, known, settings)``: what the data lack, by the same selection of data as ``run`` makes, for
        ``check --for``; an analysis of a flight without it is run there.
    gives : callable
        ``gives(data, known, settings)``: what such data give beside the answer itself, a line each for ``check --for``.
    rules : Rules, optional
        Of an answer with gates.
    offers : mapping of role to callable
        What others may ask of it (:mod:`groundstation.methods.roles`): ``offers[role](known)`` makes it.
    assumes : str
        What an analysis of a session takes for granted where its table is not set.
    is_main : callable
        ``is_main(path, saved)``: whether the number at that path of its answer, ``azimuth.error_deg``, is one of those
        that ``compare`` tells first; ``saved`` are the answers of both flights, as in summary.json.
    compared : tuple of str
        Names of its columns that ``compare`` tells first too, with what they mean.
    judges : bool
        Whether it is given the truth, by which it judges the others: it runs where there is one, and last; every other
        analysis is given a flight without it.
    """

    name: str
    title: str
    subject: str
    needs: str
    settings: type[SettingsT]
    answer: type[AnswerT]
    run: Run[Data, KnownT, SettingsT, AnswerT]
    table: str = ""
    builds_on: tuple[str, ...] = ()
    requires: tuple[str, ...] = ()
    applies: Callable[[Any, Any], bool] = _always
    is_expected: Callable[[Any, Any], bool] = _always
    rests_on: Callable[[Any, Any], RestsOn | None] = _no_samples
    sentence: Callable[[Answers], str] = _nothing
    columns: tuple[AnswerColumn[AnswerT], ...] = ()
    check: Callable[[Any, Any], None] = _any_settings
    examine: Examine[Data, KnownT, SettingsT] | None = None
    gives: Callable[[Any, Any, Any], tuple[str, ...]] = _gives_nothing
    judges: bool = False
    assumes: str = ""
    rules: Rules | None = None
    offers: Mapping[type[Any], Callable[[KnownT], Any]] = field(default_factory=dict)
    page_title: str = ""
    is_main: Callable[[str, "tuple[Mapping[str, Any], ...]"], bool] = _none_is_main
    compared: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        known = {field.name for field in dataclasses.fields(cast(Any, self.answer))}
        unknown = [column.name for column in self.columns if column.of is None and column.name not in known]
        if unknown:
            raise TypeError(f"{self.answer.__name__} has no field for the columns {', '.join(unknown)}")

    @property
    def settings_table(self) -> str:
        """Name of the TOML table with its settings."""
        return self.table or self.name

    @property
    def title_of_pages(self) -> str:
        """Title of pages, with a capital."""
        return self.page_title or capitalised(self.subject)

    def values(self, answers: Answers) -> dict[str, Any]:
        """Values of its columns in the tables of flights, by name; none without an answer."""
        answer = answers.get(self.answer.analysis)
        return {} if answer is None else {column.name: column.value(cast(Any, answer)) for column in self.columns}


def in_order_of_need(analyses: tuple[Analysis, ...]) -> tuple[Analysis, ...]:
    """Order the analyses so that each stands behind those it builds on.

    Otherwise the order given is kept.

    Raises
    ------
    ValueError
        When some build on each other.
    """
    ordered: list[Analysis] = []
    left = list(analyses)
    while left:
        waiting = {analysis.name for analysis in left}
        ready = next((one for one in left if waiting.isdisjoint((*one.builds_on, *one.requires))), None)
        if ready is None:
            raise ValueError(f"analyses that wait for each other: {', '.join(one.name for one in left)}")
        ordered.append(ready)
        left.remove(ready)
    return tuple(ordered)
