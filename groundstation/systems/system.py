"""One system as one object: its analyses, plans, pages, recordings and studies.

Every part is optional. What costs an import is given as a function that imports inside: a run loads the analyses, a
page the chapters and plots, a recording the tabs, a study its own simulation.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer, PlanAnswer, SessionAnswer
from groundstation.systems.analysis import Analysis
from groundstation.systems.plan import Plan

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Adviser, Chapter, Chapters
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.chapters.parts import Paper
    from groundstation.chapters.plots.comparison import Compared
    from groundstation.plots.plot import Describe
    from groundstation.results.files import SavedFlight
    from groundstation.results.fleet import FleetResults, SessionRow
    from groundstation.results.fleet_share import SystemShare
    from groundstation.results.flight import FlightResults
    from groundstation.systems.applied import ApplyStep
    from groundstation.systems.folder_standard import FolderStandard
    from groundstation.systems.joining import JoinStep
    from groundstation.systems.learning import LearnStep
    from groundstation.systems.study import StudyResult


class Tab(NamedTuple):
    """A tab of the recording, and the analyses whose answers it shows.

    ``log(recorder, results)`` logs it and returns its layout, None where there is nothing to show. Without it each
    answer has the generic tab, its chapter and its figures over time. ``part_of`` names the tab that shows the chapters
    in place of one of their own: "quality".
    """

    shows: tuple[str, ...]
    log: Callable[[Any, "FlightResults"], Any] | None = None
    part_of: Literal["", "quality"] = ""


class FleetTab(NamedTuple):
    """A tab of the recording of all flights.

    ``log(recorder, fleet)`` logs it and returns its layout, None where there is nothing to show.
    """

    name: str
    log: Callable[[Any, "FleetResults"], Any]


class Export(NamedTuple):
    """File that a system writes beside the report of a flight.

    Parameters
    ----------
    name : str
    analysis : str
        The analysis whose answer it shows: only flights with one have the file.
    load : callable
        Imports what builds it and returns it: ``build(results)`` gives its text, or a document and the template that
        sets it as PDF; None where the flight lacks the arrays.
    is_page : bool
        A page to print, which is not written where reports are not.
    """

    name: str
    analysis: str
    load: "Callable[[], Callable[[FlightResults], str | Paper | None]]"
    is_page: bool = False


class SessionExport(NamedTuple):
    """Format in which ``export`` writes the tracks of a session.

    Parameters
    ----------
    suffix : str
        Of the file: ``.tum``.
    load : callable
        Imports what builds it and returns it: ``build(results, track)`` gives texts by what their files are named after
        besides the target, an empty name for the target itself; ``track`` is empty for the default.
    """

    suffix: str
    load: "Callable[[], Callable[[FlightResults, str], Mapping[str, str]]]"


class InFleet(NamedTuple):
    """Contribution of a system to the tables of all flights and sessions.

    ``share(saved)`` is what one flight adds besides the columns of its analyses. ``row(saved, row)`` is the row of a
    session with what the system found.
    """

    share: "Callable[[SavedFlight], SystemShare] | None" = None
    row: "Callable[[SavedFlight, SessionRow], SessionRow] | None" = None


@dataclass(frozen=True)
class Study:
    """A study that ``groundstation study`` runs.

    Parameters
    ----------
    name : str
        The word behind ``groundstation study``.
    title : str
        What ``list`` says it finds out.
    load : callable
        Imports the study and returns it: ``study(*, runs, seed, progress) -> StudyResult``.
    outcome : callable, optional
        Imports the type of one run and returns it, where runs are kept: the study then takes ``kept`` and ``minutes``.
    reads : str
        Files that it needs, in words for the user: ``a folder with recorded sets``. The study then takes ``inputs``,
        the path given by ``--input``.
    """

    name: str
    title: str
    load: "Callable[[], Callable[..., StudyResult]]"
    outcome: Callable[[], type[Any]] | None = None
    reads: str = ""


def _none() -> tuple[Any, ...]:
    return ()


def _no_plots() -> "Mapping[str, Describe]":
    return {}


@dataclass(frozen=True)
class System:
    """System of the ground station.

    Whatever runs, lists, tells or draws systems loops over them.

    Parameters
    ----------
    name : str
        The name of its folder, of its page in docs/ and of its log room: one word for the mission.
    analyses : tuple of Analysis
        Of a flight, in the order they are shown.
    session_analyses : tuple of Analysis
        Of a session of several aircraft.
    plans : tuple of Plan
    studies : tuple of Study
        Monte Carlo behind its published figures.
    exports : tuple of Export
        Files beside the report of a flight.
    session_exports : tuple of SessionExport
        Formats in which ``export`` writes a session.
    chapters : callable
        Chapters of the report, in its order: what tells which answers.
    plots : callable
        Descriptions of its figures, by the name that a chapter gives.
    tabs : callable
        Tabs of the recording, in their order.
    fleet_chapters : callable
        Chapters of the report of all flights, each with its place among those of the others.
    fleet_plots : callable
        Descriptions of their figures, by the name that a chapter gives.
    fleet_tabs : callable
        Tabs of the recording of all flights.
    in_fleet : callable, optional
        Imports what it adds to the tables of all flights and sessions, and returns it.
    compared : callable
        Figures of two flights over each other, each with its tab of the recording.
    advice : callable, optional
        What the chapter on what to do next says for it.
    apply : callable, optional
        Imports what ``run --apply`` does behind the analyses and returns it; that of the first system that has one.
    notebook_names : mapping of str to str
        Names by which notebooks ask for its figures, where these are not those of the chapter with hyphens: by the name
        that the chapter gives, and by what stands there before the dot; scripts rely on them.
    join : callable, optional
        Imports what relates the clocks of several logs for ``run --together``, and returns it.
    learn : callable, optional
        Imports what earlier flights teach later ones of, and returns it; that of the first system that has one.
    folder_standards : callable
        Kinds of standards for ``report --standard`` that it judges a folder of flights by.
    """

    name: str
    analyses: tuple[Analysis, ...] = ()
    session_analyses: tuple[Analysis, ...] = ()
    plans: tuple[Plan[Any], ...] = ()
    studies: tuple[Study, ...] = ()
    exports: tuple[Export, ...] = ()
    session_exports: tuple[SessionExport, ...] = ()
    chapters: "Callable[[], tuple[Chapter, ...]]" = _none
    plots: "Callable[[], Mapping[str, Describe]]" = _no_plots
    tabs: Callable[[], tuple[Tab, ...]] = _none
    fleet_chapters: "Callable[[], tuple[FleetChapter, ...]]" = _none
    fleet_plots: "Callable[[], Mapping[str, Describe]]" = _no_plots
    fleet_tabs: Callable[[], tuple[FleetTab, ...]] = _none
    in_fleet: Callable[[], InFleet] | None = None
    advice: "Callable[[], Adviser] | None" = None
    apply: "Callable[[], ApplyStep] | None" = None
    join: "Callable[[], JoinStep] | None" = None
    learn: "Callable[[], LearnStep] | None" = None
    compared: "Callable[[], tuple[Compared, ...]]" = _none
    notebook_names: Mapping[str, str] = field(default_factory=dict)
    folder_standards: "Callable[[], tuple[FolderStandard, ...]]" = _none


@dataclass(frozen=True)
class Systems:
    """Systems in the order they are shown.

    ``failures`` has a line for each stranger's system that could not be loaded.

    Examples
    --------
    >>> Systems((System("heading"), System("landing"))).names
    ('heading', 'landing')
    """

    every: tuple[System, ...]
    failures: tuple[str, ...] = field(default=())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the systems."""
        return tuple(one.name for one in self.every)

    @cached_property
    def analyses(self) -> tuple[Analysis, ...]:
        """Analyses of a flight."""
        return tuple(analysis for one in self.every for analysis in one.analyses)

    @cached_property
    def session_analyses(self) -> tuple[Analysis, ...]:
        """Analyses of a session."""
        return tuple(analysis for one in self.every for analysis in one.session_analyses)

    @cached_property
    def plans(self) -> tuple[Plan[Any], ...]:
        """Kinds of plans."""
        return tuple(plan for one in self.every for plan in one.plans)

    @cached_property
    def studies(self) -> tuple[Study, ...]:
        """Studies."""
        return tuple(study for one in self.every for study in one.studies)

    @cached_property
    def roles(self) -> Mapping[type[Any], Callable[[Any], Any]]:
        """Roles that the analyses of a flight offer to each other."""
        return {role: make for analysis in self.analyses for role, make in analysis.offers.items()}

    @cached_property
    def exports(self) -> tuple[Export, ...]:
        """Files beside the report of a flight."""
        return tuple(export for one in self.every for export in one.exports)

    def exports_of(self, analyses: Collection[str], *, with_pages: bool = True) -> tuple[Export, ...]:
        """Files of a flight with answers of these analyses; pages to print where asked for."""
        return tuple(one for one in self.exports if one.analysis in analyses and (with_pages or not one.is_page))

    @property
    def apply(self) -> "ApplyStep | None":
        """Step of ``run --apply``; None where no system has one."""
        return next((one.apply() for one in self.every if one.apply is not None), None)

    @property
    def join(self) -> "JoinStep | None":
        """Step of ``run --together``; None where no system has one."""
        return next((one.join() for one in self.every if one.join is not None), None)

    @property
    def learn(self) -> "LearnStep | None":
        """Step across the flights of a folder; None where no system has one."""
        return next((one.learn() for one in self.every if one.learn is not None), None)

    @cached_property
    def answer_types(self) -> Mapping[str, type[Answer]]:
        """Types of the answers of a saved flight, session or plan, by the name of their analysis."""
        analyses = (*self.analyses, *self.session_analyses)
        kinds = (*(one.answer for one in analyses), *(kind for plan in self.plans for kind in plan.answers))
        return {kind.analysis: kind for kind in kinds}

    @cached_property
    def chapters(self) -> "Chapters":
        """Chapters of flights, sessions and plans."""
        from groundstation.chapters.chapter import Chapters

        every = [chapter for one in self.every for chapter in one.chapters()]

        def of(kind: type[Answer] | None) -> "tuple[Chapter, ...]":
            return tuple(one for one in every if _is_of(one.answers[0], kind))

        titles = {one.name: one.title_of_pages for one in (*self.analyses, *self.session_analyses)}
        advisers = tuple(one.advice() for one in self.every if one.advice is not None)
        return Chapters(of(None), of(SessionAnswer), of(PlanAnswer), titles, advisers)

    @cached_property
    def plots(self) -> "Mapping[str, Describe]":
        """Descriptions of figures, of all flights and of the systems, by name.

        The name is the one that a chapter gives.
        """
        from groundstation.chapters.plots import PLOTS

        return {**PLOTS, **{name: describe for one in self.every for name, describe in one.plots().items()}}

    @cached_property
    def fleet_chapters(self) -> "tuple[FleetChapter, ...]":
        """Chapters of the report of all flights, in its order."""
        from groundstation.chapters.fleet import CHAPTERS

        every = (*CHAPTERS, *(chapter for one in self.every for chapter in one.fleet_chapters()))
        return tuple(sorted(every, key=lambda chapter: chapter.place))

    @cached_property
    def fleet_plots(self) -> "Mapping[str, Describe]":
        """Descriptions of the figures of that report, by the name that a chapter gives."""
        from groundstation.chapters.plots.fleet import FLEET_PLOTS

        own = (told for one in self.every for told in one.fleet_plots().items())
        return {**FLEET_PLOTS, **dict(own)}

    @cached_property
    def fleet_tabs(self) -> tuple[FleetTab, ...]:
        """Tabs of the recording of all flights."""
        return tuple(tab for one in self.every for tab in one.fleet_tabs())

    @cached_property
    def in_fleet(self) -> tuple[InFleet, ...]:
        """Contributions to the tables of all flights and sessions."""
        return tuple(one.in_fleet() for one in self.every if one.in_fleet is not None)

    @cached_property
    def folder_standards(self) -> "tuple[FolderStandard, ...]":
        """Kinds of standards that a folder of flights is judged by."""
        return tuple(kind for one in self.every for kind in one.folder_standards())

    @cached_property
    def compared(self) -> "tuple[Compared, ...]":
        """Figures of two flights over each other."""
        return tuple(compared for one in self.every for compared in one.compared())

    @cached_property
    def tabs(self) -> tuple[Tab, ...]:
        """Tabs of recordings."""
        return tuple(tab for one in self.every for tab in one.tabs())

    def tabs_of(self, kind: type[Answer] | None) -> Iterator[Tab]:
        """Tabs that show answers of a kind: plans, sessions; None: of flights."""
        return (tab for tab in self.tabs if _is_of(self.answer_types.get(tab.shows[0], Answer), kind))


def _is_of(answer: type[Answer], kind: type[Answer] | None) -> bool:
    """Tell whether an answer is one of a kind; None: one of a flight."""
    return issubclass(answer, kind) if kind is not None else not issubclass(answer, (PlanAnswer, SessionAnswer))
