"""Plan as one object: its scenario, how it is made, its line for the terminal."""

from collections.abc import Callable
from typing import Generic, TypeVar

from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.results.answer import Answer, Answers
from groundstation.results.figures import FigureData

ScenarioT = TypeVar("ScenarioT")


@dataclass(frozen=True)
class Planned:
    """Result of a plan.

    Parameters
    ----------
    answers : mapping of str to PlanAnswer
        By the name of their analysis, in the order they are shown.
    duration_s : float
        Of what is planned.
    findings : tuple of Finding
    figures : tuple of FigureData
        Arrays that no answer owns.
    """

    answers: Answers
    duration_s: float
    findings: tuple[Finding, ...] = ()
    figures: tuple[FigureData, ...] = ()


@dataclass(frozen=True)
class Plan(Generic[ScenarioT]):
    """Kind of plan; all that run, list or save plans loop over these objects.

    Parameters
    ----------
    name : str
        The word behind ``groundstation plan``, and the folder of its shipped scenarios in groundstation/plans.
    title : str
        What ``list`` says it does.
    scenario : type
        Frozen dataclass with a ``title``; a TOML file fills it.
    answers : tuple of types
        What it may answer with, in the order they are shown.
    run : callable
        ``run(scenario) -> Planned``. It raises GroundstationError for a scenario that has no answer.
    sentence : callable
        One line for people, of its answers.
    """

    name: str
    title: str
    scenario: type[ScenarioT]
    answers: tuple[type[Answer], ...]
    run: Callable[[ScenarioT], Planned]
    sentence: Callable[[Answers], str]
