"""The heading system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.systems.heading.analysis import HEADING
from groundstation.systems.heading.installation.analysis import INSTALLATION
from groundstation.systems.system import InFleet, Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Adviser, Chapter
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.chapters.plots.comparison import Compared
    from groundstation.plots.plot import Describe
    from groundstation.systems.learning import LearnStep
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.heading.answer import HeadingResult
    from groundstation.systems.heading.chapter import SOURCES, heading
    from groundstation.systems.heading.installation.answer import InstallationResult
    from groundstation.systems.heading.installation.chapter import installation

    return (
        Chapter((InstallationResult,), installation),
        Chapter((HeadingResult,), heading, sources=SOURCES),
    )


def _fleet_chapters() -> "tuple[FleetChapter, ...]":
    from groundstation.chapters.fleet.chapter import FleetChapter
    from groundstation.systems.heading import fleet_chapter as aircraft
    from groundstation.systems.heading import fleet_densities_chapter as densities
    from groundstation.systems.heading.installation import fleet_chapter as installations

    return (
        FleetChapter("densities", 200, densities.build),
        FleetChapter("heading", 300, aircraft.build, "aircraft", figures=aircraft.figures),
        FleetChapter("installations", 400, installations.build),
    )


def _fleet_plots() -> "Mapping[str, Describe]":
    from groundstation.systems.heading import fleet_densities_plots as densities
    from groundstation.systems.heading import fleet_plots as aircraft
    from groundstation.systems.heading.installation import fleet_plots as installations

    return {
        "fleet.forest": aircraft.forest,
        "fleet.densities": densities.overlay,
        "fleet.densities_by_aircraft": densities.by_aircraft,
        "fleet.installation": installations.over_time,
    }


def _in_fleet() -> InFleet:
    from groundstation.systems.heading.fleet_share import IN_FLEET

    return IN_FLEET


def _learn() -> "LearnStep":
    from groundstation.systems.heading.installation.learned import STEP

    return STEP


def _advice() -> "Adviser":
    from groundstation.chapters.chapter import Adviser
    from groundstation.systems.heading import advice_chapter
    from groundstation.systems.heading.settings import HeadingSettings

    shipped = HeadingSettings()
    remedies = advice_chapter.remedies(shipped.taxi_speed_min_mps, shipped.taxi_min_s)
    return Adviser(remedies, advice_chapter.advise)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.heading import plots as heading
    from groundstation.systems.heading import standstill_plots as standstill

    return {**heading.PLOTS, **standstill.PLOTS}


def _compared() -> "tuple[Compared, ...]":
    from groundstation.systems.heading import comparison_plots

    return (comparison_plots.COMPARED,)


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.heading.tab import heading

    return (
        Tab(("heading",), heading),
        Tab(("installation",)),
    )


def _study_heading() -> "Callable[..., StudyResult]":
    from groundstation.systems.heading.study.heading import study_heading

    return study_heading


def _outcome_heading() -> type:
    from groundstation.systems.heading.study.family import RunOutcome

    return RunOutcome


def _study_crew() -> "Callable[..., StudyResult]":
    from groundstation.systems.heading.study.crew import study_crew

    return study_crew


def _outcome_crew() -> type:
    from groundstation.systems.heading.study.crew import CrewOutcome

    return CrewOutcome


def _study_installation() -> "Callable[..., StudyResult]":
    from groundstation.systems.heading.study.installation import study_installation

    return study_installation


def _outcome_installation() -> type:
    from groundstation.systems.heading.study.installation_pool import TaxiOfPool

    return TaxiOfPool


SYSTEM = System(
    name="heading",
    analyses=(HEADING, INSTALLATION),
    studies=(
        Study(
            "heading",
            "heading correction before take-off: errors, coverage of the interval, figures of the paper repeated",
            _study_heading,
            _outcome_heading,
        ),
        Study(
            "crew",
            "heading verdicts on taxi in the wind: accepted, advisory, refused; both numbers; what is no straight taxi",
            _study_crew,
            _outcome_crew,
        ),
        Study(
            "installation",
            "what earlier flights teach of mounting and crab: coverage and verdicts on fleets of aircraft",
            _study_installation,
            _outcome_installation,
        ),
    ),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
    fleet_chapters=_fleet_chapters,
    fleet_plots=_fleet_plots,
    in_fleet=_in_fleet,
    compared=_compared,
    advice=_advice,
    learn=_learn,
    notebook_names={"heading": "", "standstill": ""},
)
