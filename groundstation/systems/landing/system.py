"""The landing system as one object."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from groundstation.estimators.approaches.analysis import LANDING
from groundstation.estimators.landing_beacons.analysis import LANDING_BEACONS
from groundstation.systems.system import Study, System, Tab

if TYPE_CHECKING:
    from groundstation.chapters.chapter import Chapter
    from groundstation.plots.plot import Describe
    from groundstation.systems.study import StudyResult


def _chapters() -> "tuple[Chapter, ...]":
    from groundstation.chapters.chapter import Chapter
    from groundstation.chapters.landing import landing
    from groundstation.chapters.landing_beacons import landing_beacons
    from groundstation.results.landing import LandingResult
    from groundstation.results.landing_beacons import BeaconLanding

    return (
        Chapter((LandingResult,), landing),
        Chapter((BeaconLanding,), landing_beacons),
    )


def _plots() -> "Mapping[str, Describe]":
    from groundstation.chapters.plots import landing, landing_beacons

    return {**landing_beacons.PLOTS, **landing.PLOTS}


def _tabs() -> tuple[Tab, ...]:
    from groundstation.viewer.tabs.landing import landing
    from groundstation.viewer.tabs.landing_beacons import landing_beacons

    return (
        Tab(("landing",), landing),
        Tab(("landing_beacons",), landing_beacons),
    )


def _study_approach() -> "Callable[..., StudyResult]":
    from groundstation.studies.approach import study_approach

    return study_approach


SYSTEM = System(
    name="landing",
    analyses=(
        LANDING,
        LANDING_BEACONS,
    ),
    studies=(
        Study(
            "approach",
            "recorded approaches: the localizer as a reference for positions, how honest its interval is",
            _study_approach,
        ),
    ),
    chapters=_chapters,
    plots=_plots,
    tabs=_tabs,
)
