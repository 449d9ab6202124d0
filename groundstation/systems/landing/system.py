"""The landing system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.beacons.analysis import LANDING_BEACONS
from groundstation.systems.system import Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Adviser, Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.folder_standard import FolderStandard
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.systems.landing.answer import LandingResult
    from groundstation.systems.landing.beacons.answer import BeaconLanding
    from groundstation.systems.landing.beacons.chapter import landing_beacons
    from groundstation.systems.landing.chapter import SOURCES, landing

    return (
        Chapter((LandingResult,), landing, sources=SOURCES),
        Chapter((BeaconLanding,), landing_beacons),
    )


def _advice() -> "Adviser":
    from groundstation.chapters.chapter import Adviser
    from groundstation.systems.landing.chapter import REMEDIES

    return Adviser(REMEDIES)


def _plots() -> "Mapping[str, Describe]":
    from groundstation.systems.landing import plots as landing
    from groundstation.systems.landing.beacons import plots as landing_beacons

    return {**landing_beacons.PLOTS, **landing.PLOTS}


def _tabs() -> tuple[Tab, ...]:
    from groundstation.systems.landing.beacons.tab import landing_beacons
    from groundstation.systems.landing.tab import landing

    return (
        Tab(("landing",), landing),
        Tab(("landing_beacons",), landing_beacons),
    )


def _study_approach() -> "Callable[..., StudyResult]":
    from groundstation.systems.landing.study import study_approach

    return study_approach


def _study_runways() -> "Callable[..., StudyResult]":
    from groundstation.systems.landing.runway_study import study_runways

    return study_runways


def _study_along() -> "Callable[..., StudyResult]":
    from groundstation.systems.landing.along_study import study_along

    return study_along


def _study_criteria() -> "Callable[..., StudyResult]":
    from groundstation.systems.landing.criteria_study import study_criteria

    return study_criteria


def _folder_standards() -> "tuple[FolderStandard, ...]":
    from groundstation.systems.folder_standard import FolderStandard
    from groundstation.systems.landing.unstable import KIND, SHIPPED, judge
    from groundstation.systems.landing.unstable_chapter import document

    return (FolderStandard(KIND, SHIPPED, judge, document),)


def _study_touchdown() -> "Callable[..., StudyResult]":
    from groundstation.systems.landing.touchdown_study import study_touchdown

    return study_touchdown


SYSTEM = System(
    name="landing",
    analyses=(LANDING, LANDING_BEACONS),
    studies=(
        Study(
            "criteria",
            "criteria of approaches: verdicts on flap, gear, speed and wind against what was flown",
            _study_criteria,
        ),
        Study(
            "approach",
            "recorded approaches: the localizer as a reference for positions, how honest its interval is",
            _study_approach,
        ),
        Study("along", "recorded approaches: the glide path as a reference along the course", _study_along),
        Study(
            "runways", "choice of the runway from the table: how often one is named, and the right one", _study_runways
        ),
        Study("touchdown", "touchdowns: time by all that shows it, and how honest its interval is", _study_touchdown),
    ),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
    advice=_advice,
    folder_standards=_folder_standards,
    notebook_names={"landing_beacons.deviations": "landing-beacons"},
)
